"""The command ``clearance`` on a survey whose track and walls are known."""

from __future__ import annotations

import json
from pathlib import Path

import ezdxf
import numpy as np
import psycopg
import pyogrio
import pytest
from click.testing import CliRunner
from psycopg import sql
from support.straight_survey import FIRST, LAST, RADIUS, Scene, make_survey

from tunneldb.classification.classes import PointClass
from tunneldb.cli.main import main
from tunneldb.database import PointZ, copy_binary, pack
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.clearance.compute.track import GAUGE, HEAD
from tunneldb.store.surface import load_alignment, load_surface
from tunneldb.store.survey import get_survey

TRACK = (0.2, -2.0)
"""Middle of the track on its running surface, right of the axis and above it, m."""

GAUGE_CSV = "right,up\n-1.5,0.3\n-1.5,4\n1.5,4\n1.5,0.3\n-1.5,0.3\n"
COLUMNS = (
    "survey_id", "km", "chainage", "gps_time", "geom", "segment", "scan_id", "file_id", "intensity", "classification", "class"
)  # fmt: skip


@pytest.fixture
def survey(conn: psycopg.Connection) -> str:
    """Lining of 4 m radius all around, rails, a box 0.1 m inside the outline at 990 m, and a person at 1010 m."""
    make_survey(conn, Scene("straight"))
    found = get_survey(conn, "straight")
    surface = load_surface(conn, found)
    rng = np.random.default_rng(1)
    along, angle = (v.ravel() for v in np.meshgrid(np.arange(FIRST + 0.05, LAST, 0.2), np.radians(np.arange(0, 360, 2))))
    parts = [(along, RADIUS * np.sin(angle), RADIUS * np.cos(angle), PointClass.LINING)]
    for side in (-1.0, 1.0):
        s = rng.uniform(FIRST, LAST, 2400)
        x = TRACK[0] + side * (GAUGE + HEAD) / 2 + rng.uniform(-HEAD / 2, HEAD / 2, len(s))
        parts.append((s, x, np.full(len(s), TRACK[1]), PointClass.RAIL))
    for at, x, klass in ((990.5, 1.4, PointClass.APPENDAGE), (1010.5, 0.0, PointClass.OBJECT)):
        k = np.arange(8)
        parts.append((at + 0.0 * k, TRACK[0] + x + 0.0 * k, TRACK[1] + 1.0 + 0.1 * k, klass))
    s, x, up = (np.concatenate([part[k] for part in parts]) for k in range(3))
    klass = np.concatenate([np.full(len(part[0]), part[3], np.int16) for part in parts])
    frame = surface.frames(s)
    xyz = frame[:, 0] + x[:, None] * frame[:, 2] + up[:, None] * frame[:, 3]
    (file_id,) = conn.execute("SELECT id FROM tunnel.scan_file").fetchone()
    for km in (0, 1):
        here = np.flatnonzero(np.floor(s / KILOMETRE) == km)
        here = here[np.argsort(s[here])]
        table = sql.Identifier("tunnel", f"point_s{found.id}_km{km}_new")
        conn.execute("SELECT tunnel_internal.partition_new(%s, %s)", (found.id, km))
        whole = np.ones(len(here), np.int32)
        packed = pack([
            found.id * whole, km * whole, s[here], s[here], PointZ(xyz[here], found.srid), whole, whole, file_id * whole,
            np.zeros(len(here), np.float32), 0 * whole.astype(np.int16), klass[here],
        ])  # fmt: skip
        copy_binary(conn, table, COLUMNS, [packed], fresh=True)
        conn.execute("SELECT tunnel_internal.partition_swap(%s, %s)", (found.id, km))
    conn.commit()
    assert load_alignment(conn, found, 1.0).start == FIRST
    return "straight"


def run(*words: object) -> dict:
    done = CliRunner().invoke(main, [*map(str, words), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_walls_a_box_and_a_person_about_a_track_found_by_its_rails(
    survey: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TUNNELDB_DSN", conn.info.dsn)
    gauge = tmp_path / "example.csv"
    gauge.write_text(GAUGE_CSV)
    said = run("clearance", survey, "--gauge", gauge)
    assert said["made"] == [0, 1]
    assert said["track"] == "single"
    assert [row["run"]["track_seen"] for row in said["kilometres"]] == [1.0, 1.0]
    assert {one["class"]: one["counts"] for one in said["infringements"]} == {"object": False, "appendage": True}
    rows = {row["chainage_from"]: row for row in said["sections"]}
    assert len(rows) == LAST - FIRST
    assert rows[990.0]["margin"] == pytest.approx(-0.1, abs=0.004)
    assert rows[1010.0]["passing"] == 8
    assert rows[1010.0]["margin"] > 0
    # Nearest to the wall is the corner at the upper right.
    corner = RADIUS - np.hypot(TRACK[0] + 1.5, TRACK[1] + 4.0)
    lower = RADIUS - np.hypot(TRACK[0] + 1.5, TRACK[1] + 0.3)
    ordinary = [row["margin"] for begin, row in rows.items() if begin not in (990.0, 1010.0)]
    assert np.median(ordinary) == pytest.approx(min(corner, lower), abs=0.004)
    assert rows[950.0]["seen_share"] == 1.0
    # A second time there is nothing to do; when ground ran since, there is.
    assert run("clearance", survey, "--gauge", gauge)["made"] == []
    conn.execute("UPDATE tunnel.run SET id = DEFAULT WHERE stage = 'ground' AND km = 1")
    conn.commit()
    stale = conn.execute(
        "SELECT km, reason FROM tunnel_api.result_status WHERE stage = 'clearance' AND stale ORDER BY km"
    ).fetchall()
    assert (1, "ground ran since") in stale
    assert 1 in run("clearance", survey, "--gauge", gauge)["made"]
    # Other options are measured anew; a given axis 0.1 m to the right takes that off the margin on the right.
    lane = tmp_path / "lane.csv"
    lane.write_text(f"chainage,right,up\n{FIRST},{TRACK[0] + 0.1},{TRACK[1]}\n{LAST},{TRACK[0] + 0.1},{TRACK[1]}\n")
    moved = run("clearance", survey, "--gauge", gauge, "--track-axis", lane, "-o", tmp_path / "s.dxf")
    assert moved["track"] == "given"
    drawn = ezdxf.readfile(tmp_path / "s.dxf").modelspace()
    assert len(drawn.query('LWPOLYLINE[layer=="OUTLINE"]')) == 12
    run("clearance", survey, "--gauge", gauge, "-o", tmp_path / "m.gpkg")
    file = tmp_path / "m.gpkg"
    layers = {name: pyogrio.read_info(file, layer=name)["features"] for name, _ in pyogrio.list_layers(file)}
    assert layers == {"clearance_section": LAST - FIRST, "clearance_infringement": 2, "clearance_infringement_unrolled": 1}
    run("clearance", survey, "--gauge", gauge, "-o", tmp_path / "m.csv")
    assert len((tmp_path / "m.csv").read_text().splitlines()) == 1 + LAST - FIRST


def test_rails_that_cannot_be_told_are_one_line(
    survey: str, conn: psycopg.Connection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TUNNELDB_DSN", conn.info.dsn)
    gauge = tmp_path / "example.csv"
    gauge.write_text(GAUGE_CSV)
    done = CliRunner().invoke(main, ["clearance", survey, "--gauge", str(gauge), "--track-gauge", "1.0"])
    assert done.exit_code == 2
    assert "no two rails 1 m apart" in done.output
    assert conn.execute("SELECT count(*) FROM tunnel.gauge").fetchone() == (0,)
