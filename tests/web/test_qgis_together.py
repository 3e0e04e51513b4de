"""Two inspectors at once, one in QGIS and one at the desk, on the same finding."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import psycopg
from psycopg.conninfo import conninfo_to_dict
from support.example_survey import NAME
from support.qgis import ENVIRONMENT, PYTHON, has_qgis
from support.system import missing
from web.conftest import PASSWORD, SignIn

SCRIPT = Path(__file__).with_name("edit_in_qgis.py")


def test_what_both_write_is_kept_and_a_contradiction_is_shown(
    logins: None, signed_in: SignIn, dsn: str, example: str, conn: psycopg.Connection
) -> None:
    """While Ines has the finding open in QGIS, Ivo writes a remark at the desk; then she saves. He saw it open, and is told."""
    if not has_qgis():
        missing("QGIS")
    (key,) = conn.execute("SELECT min(id) FROM tunnel_api.leak WHERE survey = %s AND review = 'open'", [NAME]).fetchone()  # type: ignore[misc]
    ivo = signed_in("ivo_web")
    finding = ivo.get(f"/api/findings/{key}").json()
    seen = {name: finding[name] for name in ("review", "remark", "kind")}
    given = {**conninfo_to_dict(dsn), "user": "ines_web", "password": PASSWORD}
    connection = " ".join(f"{name}='{value}'" for name, value in given.items())
    with subprocess.Popen(
        [PYTHON, str(SCRIPT), connection, str(key)], env=ENVIRONMENT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as qgis:
        assert qgis.stdin is not None
        assert qgis.stdout is not None
        assert json.loads(qgis.stdout.readline()) == {"valid": True, "seen": "open"}
        answer = ivo.patch(f"/api/findings/{key}", json={"seen": seen, "values": {"remark": "wet since May"}})
        assert answer.json()["written"]
        qgis.stdin.write("\n")
        qgis.stdin.flush()
        assert json.loads(qgis.stdout.readline()) == {"saved": True}
    row = "SELECT review, remark, reviewed_by FROM tunnel_api.finding WHERE id = %s"
    assert conn.execute(row, [key]).fetchone() == ("confirmed", "wet since May", "ines_web")
    refused = ivo.patch(
        f"/api/findings/{key}", json={"seen": {**seen, "remark": "wet since May"}, "values": {"review": "rejected"}}
    )
    assert refused.status_code == 409
    assert refused.json()["error"] == f"ines_web has changed finding {key} in the meantime; nothing was written"
    assert refused.json()["finding"]["review"] == "confirmed"
    conn.rollback()
    assert conn.execute(row, [key]).fetchone() == ("confirmed", "wet since May", "ines_web")
    written = "SELECT who, after FROM tunnel_api.audit WHERE view = 'finding' AND row_id = %s ORDER BY id"
    assert conn.execute(written, [key]).fetchall() == [
        ("ivo_web", {"remark": "wet since May"}), ("ines_web", {"review": "confirmed"}),
    ]  # fmt: skip
