"""A survey in local coordinates: QGIS and files take them for what they are."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import psycopg
import pyogrio
import pytest
from click.testing import CliRunner, Result
from support.qgis import act

from tunneldb.cli.main import main


def run(*arguments: object) -> Result:
    result = CliRunner().invoke(main, [*map(str, arguments)])
    assert result.exit_code in (0, 1), result.output
    return result


@pytest.fixture
def local(conn: psycopg.Connection, example: str) -> str:
    """The example's survey with each geometry in no reference system, as those of a tunnel in local coordinates are."""
    columns = conn.execute(
        "SELECT format('%I.%I', f_table_schema, f_table_name), quote_ident(f_geometry_column) FROM public.geometry_columns"
        " JOIN pg_class ON oid = format('%I.%I', f_table_schema, f_table_name)::regclass"
        " WHERE f_table_schema = 'tunnel' AND relkind = 'r' AND NOT relispartition"
    ).fetchall()
    assert len(columns) > 10
    conn.execute("SET session_replication_role = replica")
    for table, column in columns:
        conn.execute(f"UPDATE {table} SET {column} = public.ST_SetSRID({column}, 0)")  # type: ignore[arg-type]
    conn.execute("UPDATE tunnel.tunnel SET srid = 0")
    conn.execute("SET session_replication_role = origin")
    conn.commit()
    return example


def test_a_survey_in_local_coordinates_leaves_as_such(local: str, tmp_path: Path) -> None:
    assert " local " in run("tunnel", "list").stdout

    run("export", local, "-o", tmp_path / "all.gpkg")
    for name, kind in pyogrio.list_layers(tmp_path / "all.gpkg"):
        info = pyogrio.read_info(tmp_path / "all.gpkg", layer=name)
        assert kind is None or "Undefined Cartesian" in info["crs"], name
    run("leaks", local, "--geometry", "map", "-o", tmp_path / "leaks.gpkg")
    assert "Undefined Cartesian" in pyogrio.read_info(tmp_path / "leaks.gpkg", layer="leak_map")["crs"]

    run("export", local, "-o", tmp_path / "all.dxf")
    assert ("CRS", "local coordinates") in ezdxf.readfile(tmp_path / "all.dxf").header.custom_vars.properties

    assert "GeoJSON can't say" in run("leaks", local, "--geometry", "3d", "-o", tmp_path / "leaks.geojson").stderr
    assert "GeoJSON" not in run("leaks", local, "--geometry", "unrolled", "-o", tmp_path / "flat.geojson").stderr

    run("report", local, "-o", tmp_path / "report.html")
    assert "local coordinates" in (tmp_path / "report.html").read_text("utf-8")


def test_qgis_opens_it_without_a_system(local: str, conn: psycopg.Connection, tmp_path: Path) -> None:
    run("qgis", local, "-o", tmp_path / "local.qgz")
    seen = act(tmp_path / "local.qgz", "describe")
    assert seen["crs"] == ""
    assert {name for name, layer in seen["layers"].items() if not layer["valid"] or layer["crs"]} == set()
    (count,) = conn.execute("SELECT count(*) FROM tunnel_api.leak_map").fetchone()  # type: ignore[misc]
    assert seen["layers"]["leak_map"]["features"] == count > 0
    conn.rollback()
    act(tmp_path / "local.qgz", "move_vertex", "1235", "0.5", "0.0")
    row = conn.execute("SELECT source, ST_SRID(geom) FROM tunnel.axis_vertex WHERE n = 1235").fetchone()
    assert row == ("edited", 0)
