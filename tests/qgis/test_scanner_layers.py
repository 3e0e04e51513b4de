"""Where the scanner was, as layers of a project in real QGIS: its stations, and the way of a mobile one."""

from __future__ import annotations

from pathlib import Path

import psycopg
import pytest
from click.testing import CliRunner
from support.qgis import act

from tunneldb.cli.main import main


def test_stations_and_the_way_are_layers_of_the_map(example: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    conn.execute(
        "INSERT INTO tunnel.station (survey_id, scan_id, geom)"
        " SELECT survey_id, n - 1230, ST_Translate(geom, 0, 0, 0.4) FROM tunnel.axis_vertex WHERE n IN (1232, 1240, 1248)"
    )
    conn.execute(  # at 1 m/s along the axis, ten a second, over two minutes
        "INSERT INTO tunnel.pose (survey_id, time, geom) SELECT a.survey_id, 0.1 * i, ST_SetSRID(ST_MakePoint("
        " ST_X(a.geom) + (ST_X(b.geom) - ST_X(a.geom)) * i / 1000, ST_Y(a.geom) + (ST_Y(b.geom) - ST_Y(a.geom)) * i / 1000,"
        " ST_Z(a.geom)), ST_SRID(a.geom)) FROM tunnel.axis_vertex a, tunnel.axis_vertex b, generate_series(0, 1000) i"
        " WHERE a.n = 1232 AND b.n = 1242"
    )
    conn.commit()
    done = CliRunner().invoke(main, ["qgis", example, "-o", str(tmp_path / "demo.qgs")])
    assert done.exit_code == 0, done.output
    layers = act(tmp_path / "demo.qgs", "describe")["layers"]
    stations, way = layers["scan_station"], layers["trajectory"]
    heights = conn.execute("SELECT height FROM tunnel_api.scan_station ORDER BY 1").fetchall()
    assert (stations["wkb"], stations["crs"], stations["features"], stations["error"]) == ("PointZ", "EPSG:25830", 3, "")
    assert sorted(stations["z"]) == pytest.approx([z for (z,) in heights])
    assert (way["wkb"], way["crs"], way["features"], way["error"]) == ("LineStringZ", "EPSG:25830", 2, "")
    for layer in (stations, way):
        assert layer["read_only"]
        assert layer["labels"]
        assert set(layer["aliases"]) == set(layer["widget"])
        assert layer["renderer"] == "singleSymbol"
    assert stations["clamping"] == "absolute"
    text = (tmp_path / "demo.qgs").read_text("utf-8")
    shown = text[text.index('<visibility-preset name="Map"') :].partition("</visibility-preset>")[0]
    assert "tunneldb_layer_scan_station" in shown
    assert 'id="tunneldb_layer_trajectory" visible="1"' not in shown
