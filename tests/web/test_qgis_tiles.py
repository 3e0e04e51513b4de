"""QGIS shows the tiles of the desk as an XYZ layer, in their place."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import psycopg
import pytest
from support.desk_server import DeskServer
from support.qgis import ENVIRONMENT, PYTHON, has_qgis
from support.system import missing
from web.conftest import PASSWORD

SCRIPT = Path(__file__).with_name("tiles_in_qgis.py")


def test_pixels_lie_at_their_chainage_and_arc(logins: None, dsn: str, example: str, conn: psycopg.Connection) -> None:
    if not has_qgis():
        missing("QGIS")
    if conn.execute("SELECT FROM pg_available_extensions WHERE name = 'postgis_raster'").fetchone() is None:
        pytest.skip("no postgis_raster")
    conn.execute("CREATE EXTENSION postgis_raster SCHEMA public")
    # Places on and around a leak, which is much darker than the lining.
    low, high, bottom, top = conn.execute(
        "SELECT chainage_from, chainage_to, arc_from, arc_to FROM tunnel_api.leak WHERE review <> 'rejected' AND area > 1"
        " ORDER BY area DESC LIMIT 1"
    ).fetchone()  # type: ignore[misc]
    x, y = (at.ravel() for at in np.meshgrid(np.linspace(low - 1, high + 1, 30), np.linspace(bottom - 1, top + 1, 30)))
    places = json.dumps(np.column_stack([x, y]).tolist())
    server = DeskServer(dsn)
    try:
        done = subprocess.run(
            [PYTHON, str(SCRIPT), server.address, "viola_web", PASSWORD, places],
            env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=200,
        )  # fmt: skip
    finally:
        server.stop()
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["valid"]
    assert told["errors"] == []
    grey = np.array([np.nan if g is None else g for g in told["grey"]], dtype=np.float64)

    def likeness(right: float, up: float) -> float:
        """Correlation of what QGIS shows with the stored values that lie so far off, m."""
        rows = conn.execute(
            "SELECT value FROM tunnel_api.image_values('demo-2024', 'corrected', %s, %s) ORDER BY n",
            [(x + right).tolist(), (y + up).tolist()],
        ).fetchall()
        value = np.array([row[0] for row in rows], dtype=np.float64)
        both = np.isfinite(value) & np.isfinite(grey)
        assert both.mean() > 0.8
        return float(np.corrcoef(value[both], grey[both])[0, 1])

    here = likeness(0.0, 0.0)
    assert here > 0.6
    for right, up in ((0.2, 0), (-0.2, 0), (0, 0.2), (0, -0.2)):
        assert likeness(right, up) < here - 0.02
