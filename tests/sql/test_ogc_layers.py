"""What docker-compose.yml has served by OGC API: layers of the map that state their coordinate system, for reading alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import psycopg
import pytest
from psycopg import sql
from support.example_survey import SRID

from tunneldb.store.catalog import make_layers

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def served() -> list[str]:
    yaml = pytest.importorskip("ruamel.yaml")
    environment = yaml.YAML(typ="safe").load(ROOT / "docker-compose.yml")["services"]["ogc-api"]["environment"]
    assert environment["TIPG_DB_FUNCTIONS"] == "[]"
    texts = [environment[name].replace("${OGC_SRID:-0}", str(SRID)) for name in ("TIPG_DB_SCHEMAS", "TIPG_DB_TABLES")]
    schemas, tables = map(json.loads, texts)
    assert schemas == [f"tunnel_{SRID}"]
    assert {name.split(".")[0] for name in tables} == set(schemas)
    return [name.split(".")[1] for name in tables]


@pytest.mark.usefixtures("example")
def test_layers_of_the_map_are_served_and_no_other(conn: psycopg.Connection[Any], served: list[str]) -> None:
    make_layers(conn)
    stated = conn.execute(
        "SELECT f_table_name, srid FROM geometry_columns WHERE f_table_schema = %s", [f"tunnel_{SRID}"]
    ).fetchall()
    planes = {name for (name,) in conn.execute("SELECT layer FROM tunnel_api.layer_types() WHERE plane").fetchall()}
    assert len(set(served)) == len(served)
    assert {srid for name, srid in stated if name in served} == {SRID}
    assert set(served) <= {name for name, _ in stated} - planes
    # actions have costs and names of people; ratings need conditions
    assert {name for name, _ in stated if name.endswith("_map")} - {"action_map", "rating_map"} <= set(served)


@pytest.mark.usefixtures("example")
def test_viewers_read_each_and_write_none(conn: psycopg.Connection[Any], served: list[str]) -> None:
    make_layers(conn)
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    for layer in served:
        name = sql.Identifier(f"tunnel_{SRID}", layer)
        conn.execute(sql.SQL("SELECT ST_AsMVT(t), ST_AsGeoJSON(ST_Transform(ST_Collect(geom), 4326)) FROM {} t").format(name))
        assert conn.execute(
            "SELECT has_table_privilege(current_user, %(v)s, 'INSERT, UPDATE, DELETE, TRUNCATE, TRIGGER'),"
            " has_any_column_privilege(current_user, %(v)s, 'INSERT, UPDATE')",
            {"v": f"tunnel_{SRID}.{layer}"},
        ).fetchone() == (False, False)
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        conn.execute(f"UPDATE tunnel_{SRID}.leak_map SET review = 'confirmed'")  # type: ignore[arg-type]
