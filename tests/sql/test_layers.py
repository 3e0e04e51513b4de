"""Schemas of typed layers: what they state is so, they hold what tunnel_api does, and GDAL and QGIS go by them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterator

import psycopg
import pytest
from click.testing import CliRunner
from psycopg import sql
from psycopg.conninfo import conninfo_to_dict, make_conninfo
from support.cookbook_survey import draw_findings, prepare
from support.databases import Copies
from support.example_survey import NAME
from support.qgis import ENVIRONMENT, PYTHON, has_qgis
from support.system import missing

from tunneldb.cli.main import main
from tunneldb.database import connect, install
from tunneldb.errors import UserError
from tunneldb.export.qgis.styles import store_styles, styled_columns
from tunneldb.stages.registry import REGISTRY
from tunneldb.store.catalog import add_site, make_layers, remove_tunnel

SCHEMA = "tunnel_25830"
WITH_MORE = {"leak", "finding", "finding_polygon", "spot", "change_region", "leak_change", "clearance_infringement"}
"""Views with several geometries, each of which has a view of one."""

OGR_TYPES = {"Geometry": "", "GeometryZ": "3D Unknown (any)"}
QGIS_LISTS = """
import json, sys
from qgis.core import QgsApplication, QgsDataSourceUri, QgsProviderRegistry, QgsVectorLayer, QgsWkbTypes
app = QgsApplication([], False)
app.initQgis()
uri = QgsDataSourceUri()
uri.setConnection(*sys.argv[1:5], "")
provider = QgsProviderRegistry.instance().providerMetadata("postgres")
tables = provider.createConnection(uri.uri(False), {}).tables(sys.argv[5])
words = QgsWkbTypes.displayString
found = {t.tableName(): [[words(c.wkbType), c.crs.authid()] for c in t.geometryColumnTypes()] for t in tables}
opened = {}
for name in ("leak_map", "axis", "leak_unrolled"):
    uri.setDataSource(sys.argv[5], name, "geom", "", "id")
    layer = QgsVectorLayer(uri.uri(False), name, "postgres")
    opened[name] = [layer.isValid(), words(layer.wkbType()), layer.crs().authid(), layer.featureCount()]
print(json.dumps([found, opened]))
"""


@pytest.fixture(scope="module")
def filled(copies: Copies, example_template: str) -> Iterator[str]:
    """DSN of a database with rows in nearly every layer."""
    with copies.copy(example_template) as dsn, connect(dsn) as conn:
        prepare(conn, NAME)
        draw_findings(conn, NAME)
        make_layers(conn)
        conn.commit()
        yield dsn


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def types(conn: psycopg.Connection) -> dict[str, tuple[str, bool]]:
    rows = conn.execute("SELECT layer, type, plane FROM tunnel_api.layer_types()").fetchall()
    assert len({row[0] for row in rows}) == len(rows) > 55
    return {name: (kind, plane) for name, kind, plane in rows}


def ogr_type(kind: str) -> str:
    """A type as ogrinfo lists it."""
    words = re.sub("([a-z])([A-Z])", r"\1 \2", kind.removesuffix("Z"))
    return OGR_TYPES.get(kind, f"3D {words}" if kind.endswith("Z") else words)


def schemas(conn: psycopg.Connection) -> list[str]:
    return [row[0] for row in conn.execute("SELECT schema FROM tunnel_api.layer_schemas()")]


def test_each_layer_states_what_its_rows_are(filled: str) -> None:
    with connect(filled) as conn:
        stated = types(conn)
        shown = conn.execute(
            "SELECT DISTINCT f_table_name FROM geometry_columns WHERE f_table_schema = 'tunnel_api'"
        ).fetchall()
        assert {name for (name,) in shown} == set(stated) | WITH_MORE
        filled_layers = 0
        for name, (kind, plane) in stated.items():
            column = "SELECT type, coord_dimension, srid FROM geometry_columns WHERE (f_table_schema, f_table_name) = (%s, %s)"
            flat, dimension = kind.removesuffix("Z").upper(), 3 if kind.endswith("Z") else 2
            assert conn.execute(column, [SCHEMA, name]).fetchall() == [(flat, dimension, 0 if plane else 25830)]
            place = sql.Identifier(SCHEMA, name)
            rows = conn.execute(
                sql.SQL(
                    "SELECT DISTINCT GeometryType(geom), ST_NDims(geom), ST_SRID(geom) FROM {} WHERE geom IS NOT NULL"
                ).format(place)
            ).fetchall()
            assert {row[1:] for row in rows} <= {(dimension, 0 if plane else 25830)}, name
            assert flat == "GEOMETRY" or {row[0] for row in rows} <= {flat}, name
            filled_layers += bool(rows)
            counts = sql.SQL("SELECT (SELECT count(*) FROM {}), (SELECT count(*) FROM {})")
            here, there = conn.execute(counts.format(place, sql.Identifier("tunnel_api", name))).fetchone()  # type: ignore[misc]
            assert here == there, name
        assert filled_layers >= 40


def test_gdal_lists_and_copies_them(filled: str, tmp_path: object) -> None:
    if shutil.which("ogrinfo") is None:
        missing("GDAL")
    source = f"PG:{filled} schemas={SCHEMA}"
    listed = subprocess.run(["ogrinfo", "-ro", source], capture_output=True, text=True, check=True)
    assert "Warning" not in listed.stderr
    found = dict(re.findall(r"^\d+: (\S+)(?: \((.+)\))?$", listed.stdout, re.MULTILINE))
    with connect(filled) as conn:
        words = {name: ogr_type(kind) for name, (kind, _) in types(conn).items()}
        leaks = conn.execute("SELECT count(*) FROM tunnel_api.leak").fetchone()[0]  # type: ignore[index]
    assert found == words
    copied = f"{tmp_path}/leaks.gpkg"
    subprocess.run(["ogr2ogr", copied, source, "leak_map"], check=True)
    told = subprocess.run(["ogrinfo", "-so", copied, "leak_map"], capture_output=True, text=True, check=True).stdout
    assert f"Feature Count: {leaks}\n" in told
    assert 'ID["EPSG",25830]' in told


def test_qgis_lists_and_opens_them(filled: str) -> None:
    if not has_qgis():
        missing("QGIS")
    at = conninfo_to_dict(filled)
    words = [str(at["host"]), str(at.get("port", 5432)), str(at["dbname"]), str(at["user"]), SCHEMA]
    done = subprocess.run([PYTHON, "-c", QGIS_LISTS, *words], env=ENVIRONMENT, capture_output=True, text=True, check=True)
    found, opened = json.loads(done.stdout.splitlines()[-1])
    with connect(filled) as conn:
        for name, (kind, plane) in types(conn).items():
            if plane:  # of SRID 0 QGIS looks at the rows, and knows nothing of a layer without any
                assert found[name] in ([[kind, ""]], []) or kind == "Geometry", name
            elif not kind.startswith("Geometry"):
                assert found[name] == [[kind, "EPSG:25830"]], name
        (leaks,) = conn.execute("SELECT count(*) FROM tunnel_api.leak").fetchone()  # type: ignore[misc]
    assert opened["leak_map"] == [True, "Polygon", "EPSG:25830", leaks]
    assert opened["leak_unrolled"] == [True, "Polygon", "", leaks]
    assert opened["axis"][:3] == [True, "LineStringZ", "EPSG:25830"]


def test_schemas_come_and_go_with_tunnels(conn: psycopg.Connection, dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make_layers(conn)
    conn.commit()
    assert schemas(conn) == [SCHEMA]
    for name, srid, there in (("hall", 3794, "tunnel_3794"), ("bench", 0, "tunnel_local")):
        add_site(conn, name, srid)
        assert there in schemas(conn)
        assert conn.execute(sql.SQL("SELECT name FROM {}").format(sql.Identifier(there, "tunnel"))).fetchall() == [(name,)]
    assert conn.execute(f"SELECT name FROM {SCHEMA}.tunnel").fetchall() == [("demo",)]
    remove_tunnel(conn, "hall")
    assert schemas(conn) == [SCHEMA, "tunnel_local"]
    conn.execute("CREATE SCHEMA tunnel_3035")  # somebody's own
    add_site(conn, "yard", 3035)
    assert "tunnel_3035" not in schemas(conn)
    conn.execute("CREATE VIEW public.mine AS SELECT name FROM tunnel_local.tunnel")
    remove_tunnel(conn, "bench")
    assert "tunnel_local" in schemas(conn)  # what somebody's view rests on stays
    conn.commit()
    with pytest.raises(UserError, match="mine depend on schema tunnel_api"):
        install(conn, REGISTRY)
    conn.rollback()
    conn.execute("DROP VIEW public.mine")
    conn.execute(sql.SQL("CREATE TABLE {} AS SELECT 1 AS a").format(sql.Identifier(SCHEMA, "kept")))
    conn.commit()
    with pytest.raises(UserError, match=rf"{SCHEMA}.kept are in a schema of typed layers, .*; move them to another schema"):
        install(conn, REGISTRY)
    conn.rollback()
    conn.execute(sql.SQL("ALTER TABLE {} SET SCHEMA public").format(sql.Identifier(SCHEMA, "kept")))  # as the message says
    conn.commit()
    install(conn, REGISTRY)
    assert schemas(conn) == [SCHEMA]


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_inspectors_review_and_edit_in_them(person: psycopg.Connection, conn: psycopg.Connection) -> None:
    make_layers(conn)
    store_styles(conn)
    conn.commit()
    key = conn.execute(
        f"UPDATE {SCHEMA}.leak_map SET remark = 'owner' WHERE id = (SELECT min(id) FROM tunnel_api.leak) RETURNING id"
    ).fetchone()
    conn.commit()
    assert person.execute(f"UPDATE {SCHEMA}.leak_map SET review = 'confirmed' WHERE id = %s", key).rowcount == 1
    row = conn.execute("SELECT review, reviewed_by FROM tunnel.finding WHERE id = %s", key).fetchone()
    assert row == ("confirmed", "ines")
    person.execute(f"UPDATE {SCHEMA}.axis_vertex SET geom = ST_Translate(geom, 0, 0, 0.1) WHERE n = 1240")
    assert conn.execute("SELECT source FROM tunnel.axis_vertex WHERE n = 1240").fetchone() == ("edited",)
    drawn = (
        f"INSERT INTO {SCHEMA}.finding_map (survey, kind, geom) SELECT survey, 'crack',"
        f" ST_MakeLine(ST_PointN(r, 1), ST_PointN(r, 2)) FROM {SCHEMA}.leak_map, ST_ExteriorRing(geom) r"
        " WHERE id = %s RETURNING id"
    )
    assert person.execute(drawn, key).fetchone()
    for forbidden in (
        f"UPDATE {SCHEMA}.leak_map SET area = 0",
        f"DELETE FROM {SCHEMA}.leak_3d",
        "CALL tunnel_api.make_layers()",
    ):
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            person.execute(forbidden)
    styles = conn.execute("SELECT f_table_name FROM public.layer_styles WHERE f_table_schema = %s", [SCHEMA]).fetchall()
    assert {name for (name,) in styles} == {view for view, column, *_ in styled_columns() if column == "geom"} & set(
        types(conn)
    )


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_an_operator_adds_a_tunnel_elsewhere(person: psycopg.Connection, dsn: str) -> None:
    done = CliRunner().invoke(
        main, ["--dsn", make_conninfo(dsn, user="otto"), "tunnel", "add", "hall", "--srid", "3794", "--site"]
    )
    assert done.exit_code == 0, done.output
    assert person.execute("SELECT count(*) FROM tunnel_3794.tunnel").fetchone() == (1,)
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("CREATE VIEW tunnel_3794.mine AS SELECT 1")
