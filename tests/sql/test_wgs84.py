"""Views of the map in WGS 84, as servers of OGC API Features find them: type and SRID, places, rights, what Compose names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import psycopg
import pytest
from psycopg import sql
from pyproj import Transformer
from support.example_survey import SRID

ROOT = Path(__file__).parents[2]
VIEWS = "SELECT f_table_name FROM geometry_columns WHERE f_table_schema = 'tunnel_api' AND {} ORDER BY 1"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def names(conn: psycopg.Connection[Any], condition: str) -> list[str]:
    return [name for (name,) in conn.execute(VIEWS.format(condition)).fetchall()]  # type: ignore[arg-type]


@pytest.mark.usefixtures("example")
def test_each_says_its_type_and_system_and_compose_names_all(conn: psycopg.Connection[Any]) -> None:
    views = names(conn, "srid = 4326 AND type <> 'GEOMETRY'")
    assert len(views) > 20
    assert views == names(conn, "f_table_name LIKE '%\\_wgs84'")
    yaml = pytest.importorskip("ruamel.yaml")
    service = yaml.YAML(typ="safe").load(ROOT / "docker-compose.yml")["services"]["ogc-api"]
    served = json.loads(service["environment"]["TIPG_DB_TABLES"])
    assert served == [f"tunnel_api.{name}" for name in views]
    assert json.loads(service["environment"]["TIPG_DB_FUNCTIONS"]) == []


@pytest.mark.usefixtures("example")
def test_places_are_those_that_proj_says(conn: psycopg.Connection[Any]) -> None:
    way = Transformer.from_crs(SRID, 4326, always_xy=True)
    for view, source in (("axis_vertex", "axis_vertex"), ("leak", "leak_map"), ("section", "section"), ("outline", "outline")):
        rows = conn.execute(
            sql.SQL(
                "SELECT w.id = m.id, ST_X(p.geom), ST_Y(p.geom), ST_X(q.geom), ST_Y(q.geom), ST_Z(p.geom), ST_Z(q.geom)"
                "  FROM tunnel_api.{} w JOIN tunnel_api.{} m USING (id)"
                " CROSS JOIN LATERAL ST_DumpPoints(w.geom) WITH ORDINALITY p (path, geom, n)"
                "  JOIN LATERAL ST_DumpPoints(m.geom) WITH ORDINALITY q (path, geom, n) ON q.n = p.n LIMIT 200"
            ).format(sql.Identifier(view + "_wgs84"), sql.Identifier(source))
        ).fetchall()
        assert rows
        for same, east, north, x, y, z, height in rows:
            assert same
            assert (east, north) == pytest.approx(way.transform(x, y), abs=1e-9)  # 0.1 mm
            assert z == height or z is None


@pytest.mark.usefixtures("example")
def test_tunnels_of_no_place_are_left_out(conn: psycopg.Connection[Any]) -> None:
    conn.execute(
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, alignment)"
        " VALUES ('local', 0, 0, 'LINESTRING Z (0 0 0, 100 0 0)'::geometry)"
    )
    assert conn.execute("SELECT count(*) FROM tunnel_api.tunnel WHERE srid = 0").fetchone() == (1,)
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    world = "ST_MakeEnvelope(-180, -90, 180, 90, 4326)"
    inside = f"geom && {world} AND ST_Intersects(geom, {world})"
    rows = conn.execute(f"SELECT name FROM tunnel_api.tunnel_wgs84 WHERE {inside}").fetchall()  # type: ignore[arg-type]
    assert rows
    assert ("local",) not in rows


@pytest.mark.usefixtures("example")
def test_viewers_read_each_and_write_none(conn: psycopg.Connection[Any]) -> None:
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    for view in names(conn, "srid = 4326"):
        name = sql.Identifier(view)
        conn.execute(sql.SQL("SELECT ST_AsMVT(t) FROM tunnel_api.{} t").format(name))
        assert conn.execute(
            "SELECT has_table_privilege(current_user, %(v)s, 'INSERT, UPDATE, DELETE, TRUNCATE, TRIGGER'),"
            " has_any_column_privilege(current_user, %(v)s, 'INSERT, UPDATE')",
            {"v": f"tunnel_api.{view}"},
        ).fetchone() == (False, False)
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        conn.execute("UPDATE tunnel_api.leak_wgs84 SET review = 'confirmed'")
