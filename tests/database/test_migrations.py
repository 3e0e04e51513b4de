"""Schema and functions: installed, installed again, dumped and restored they are the same."""

from __future__ import annotations

import re
import runpy
import shutil
import subprocess
import tempfile
from pathlib import Path

import psycopg
import pytest
from alembic import command
from alembic.script import ScriptDirectory
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.system import missing

from tunneldb.database import connect, install, open_connection, sqlalchemy_engine
from tunneldb.database.binaries import find_binaries
from tunneldb.database.health import examine
from tunneldb.database.schema import HEAD, alembic_config, install_api, sql_files
from tunneldb.database.server import Server
from tunneldb.errors import UserError
from tunneldb.stages.registry import REGISTRY

ROOT = Path(__file__).parents[2]


def dump(dsn: str, *options: str) -> str:
    """Text of pg_dump, without the random word that newer versions put in it."""
    program = find_binaries()["pg_dump"]
    result = subprocess.run([program, "--dbname", dsn, *options], capture_output=True, text=True, check=True)
    return re.sub(r"^\\(un)?restrict .*$", "", result.stdout, flags=re.MULTILINE)


def test_models_and_migrations_agree(dsn: str) -> None:
    with sqlalchemy_engine(dsn).begin() as session:
        command.check(alembic_config(session))


def test_the_tables_of_the_first_migration_are_those_of_the_models() -> None:
    """Also what Alembic does not compare: checks, computed columns and options of indexes."""
    assert runpy.run_path(str(ROOT / "scripts" / "write_tables.py"))["tables_sql"]() == (
        ROOT / "migrations" / "baseline" / "tables.sql"
    ).read_text("utf-8")


def test_there_is_one_line_of_migrations() -> None:
    assert ScriptDirectory.from_config(alembic_config()).get_heads() == [HEAD]


def test_a_second_install_changes_nothing(dsn: str) -> None:
    before = dump(dsn, "--schema-only")
    with open_connection(dsn) as connection:
        install(connection, REGISTRY)
    assert dump(dsn, "--schema-only") == before


def test_the_stages_in_the_database_are_those_of_the_program(dsn: str, conn: psycopg.Connection) -> None:
    query = "SELECT name, reads, reads_beside, parameters FROM tunnel.stage ORDER BY step"
    stages = [(stage.name, list(stage.reads), list(stage.reads_beside), list(stage.parameters)) for stage in REGISTRY]
    assert conn.execute(query).fetchall() == stages
    conn.execute("UPDATE tunnel.stage SET step = step + 100, parameters = '{old}'")
    conn.execute("INSERT INTO tunnel.stage VALUES (1, 'of another version', '{}', '{}', '{}', false, '{}', '{}')")
    conn.commit()
    install(conn, REGISTRY)
    assert conn.execute(query).fetchall() == stages


def test_install_is_whole_or_not_at_all(empty_dsn: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    broken = tmp_path / "broken.sql"
    broken.write_text("CREATE TABLE tunnel_api.half ();\nSELECT nonsense;")
    monkeypatch.setattr("tunneldb.database.schema.sql_files", lambda: [broken])
    with open_connection(empty_dsn) as connection, pytest.raises(psycopg.errors.UndefinedColumn) as caught:
        install(connection, REGISTRY)
    assert caught.value.__notes__ == [f"in {broken}, line 2"]
    with open_connection(empty_dsn) as connection:
        assert connection.execute("SELECT to_regnamespace('tunnel'), to_regnamespace('tunnel_api')").fetchone() == (None, None)


def test_the_functions_are_made_anew_and_data_stay(example: str, dsn: str, conn: psycopg.Connection) -> None:
    conn.execute("DROP FUNCTION tunnel_api.chainage_label CASCADE")
    conn.execute("CREATE FUNCTION tunnel_api.left_over() RETURNS int LANGUAGE sql AS 'SELECT 1'")
    conn.commit()
    leaks = conn.execute("SELECT count(*) FROM tunnel.finding").fetchone()
    conn.commit()
    install(conn, REGISTRY)
    assert conn.execute("SELECT tunnel_api.chainage_label(12345.678)").fetchone() == ("12+345.678",)
    assert conn.execute("SELECT to_regproc('tunnel_api.left_over')").fetchone() == (None,)
    assert conn.execute("SELECT count(*) FROM tunnel.finding").fetchone() == leaks


def test_a_view_of_the_users_own_is_not_dropped_unasked(conn: psycopg.Connection) -> None:
    conn.execute("CREATE VIEW public.big_leaks AS SELECT * FROM tunnel_api.leak WHERE area > 0.2")
    with pytest.raises(UserError, match="big_leaks"):
        install_api(conn)


def test_nothing_in_tunnel_calls_tunnel_api_or_tunnel_internal(conn: psycopg.Connection) -> None:
    """An upgrade drops tunnel_api whole; restoring a dump makes tunnel first. The one trigger is made anew with tunnel_api."""
    named = conn.execute(
        """
        SELECT pg_get_expr(adbin, adrelid) FROM pg_attrdef d JOIN pg_class c ON c.oid = d.adrelid
         WHERE c.relnamespace = 'tunnel'::regnamespace
        UNION ALL
        SELECT pg_get_constraintdef(oid) FROM pg_constraint WHERE connamespace = 'tunnel'::regnamespace
        UNION ALL
        SELECT indexdef FROM pg_indexes WHERE schemaname = 'tunnel'
        UNION ALL
        SELECT prosrc FROM pg_proc WHERE pronamespace = 'tunnel'::regnamespace
        UNION ALL
        SELECT pg_get_triggerdef(t.oid) FROM pg_trigger t JOIN pg_class c ON c.oid = t.tgrelid
         WHERE c.relnamespace = 'tunnel'::regnamespace AND (c.relname, t.tgname) <> ('waterproof', 'keep')
        """
    ).fetchall()
    assert named
    assert not [text for (text,) in named if "tunnel_api" in text or "tunnel_internal" in text]


def test_every_table_view_column_and_function_is_commented(conn: psycopg.Connection) -> None:
    bare = conn.execute(
        """
        SELECT c.oid::regclass::text FROM pg_class c
         WHERE c.relnamespace = ANY (ARRAY['tunnel', 'tunnel_api', 'tunnel_internal']::regnamespace[])
           AND c.relkind IN ('r', 'p', 'v')
           AND c.relname <> 'alembic_version' AND obj_description(c.oid, 'pg_class') IS NULL
        UNION ALL
        SELECT c.oid::regclass::text || '.' || a.attname FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid
         WHERE c.relnamespace = ANY (ARRAY['tunnel', 'tunnel_api', 'tunnel_internal']::regnamespace[])
           AND c.relkind IN ('r', 'p', 'v')
           AND c.relname <> 'alembic_version'
           AND a.attnum > 0 AND NOT a.attisdropped AND col_description(c.oid, a.attnum) IS NULL
        UNION ALL
        SELECT p.oid::regprocedure::text FROM pg_proc p
         WHERE p.pronamespace = ANY (ARRAY['tunnel', 'tunnel_api', 'tunnel_internal']::regnamespace[])
           AND obj_description(p.oid, 'pg_proc') IS NULL
        """
    ).fetchall()
    assert bare == []


def test_plpgsql_check_finds_nothing(conn: psycopg.Connection) -> None:
    available = conn.execute("SELECT FROM pg_available_extensions WHERE name = 'plpgsql_check'").fetchone()
    if available is None:
        missing("plpgsql_check")
    conn.execute("CREATE EXTENSION plpgsql_check")
    conn.execute("CREATE EXTENSION IF NOT EXISTS postgis_raster SCHEMA public")  # functions of images name its own
    complaints = conn.execute(
        """
        SELECT p.oid::regprocedure::text, c.level, c.lineno, c.message, c.detail
          FROM pg_proc p JOIN pg_language l ON l.oid = p.prolang
          LEFT JOIN pg_trigger t ON t.tgfoid = p.oid
         CROSS JOIN LATERAL plpgsql_check_function_tb(
               p.oid, coalesce(t.tgrelid, 0), oldtable => t.tgoldtable, newtable => t.tgnewtable, extra_warnings => true,
               performance_warnings => false) c
         WHERE p.pronamespace = ANY (ARRAY['tunnel', 'tunnel_api', 'tunnel_internal']::regnamespace[]) AND l.lanname = 'plpgsql'
           AND c.message <> 'name of parameter "offset" is reserved keyword'  -- the design's word
           -- what RETURN QUERY EXECUTE returns the checker cannot see
           AND c.detail IS DISTINCT FROM 'cannot to determine result of dynamic SQL'
        """
    ).fetchall()
    assert complaints == []


def test_each_sql_file_can_be_run_again_by_psql(dsn: str) -> None:
    before = dump(dsn, "--schema-only")
    for path in sql_files():
        subprocess.run(
            [find_binaries()["psql"], "--dbname", dsn, "-qX", "-v", "ON_ERROR_STOP=1", "-f", str(path)],
            check=True,
            capture_output=True,
        )
    assert dump(dsn, "--schema-only") == before


def draw_and_take_back(connection: psycopg.Connection) -> None:
    """Findings drawn, split, merged and taken back, with photos and a dry region."""
    insert = "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES ('demo-2024', %s, %s::geometry) RETURNING id"
    keys = [
        connection.execute(insert, [kind, shape]).fetchone()[0]  # type: ignore[index]
        for kind, shape in (
            ("crack", "LINESTRING(12350 1, 12353 1.5)"),
            ("drip", "POINT(12360 -2)"),
            ("spall", "POLYGON((12350 0, 12351 0, 12351 1, 12350 0))"),
        )
    ]
    connection.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, 'a.jpg')", [keys[1]])
    split = "SELECT tunnel_api.finding_split(%s, 'LINESTRING(12350.5 -1, 12350.5 2)')"
    connection.execute(split, [keys[2]])
    connection.execute("SELECT tunnel_api.finding_merge(%s)", [[keys[2], keys[2] + 1]])
    connection.execute("UPDATE tunnel_api.finding_unrolled SET severity = 3 WHERE id = %s", [keys[0]])
    connection.execute("SELECT tunnel_api.finding_undo(%s)", [keys[0]])
    connection.execute(
        "INSERT INTO tunnel_api.region (survey, kind, geom, reason)"
        " VALUES ('demo-2024', 'dry', ST_MakeEnvelope(12310, -4, 12330, 4), 'rebuilt')"
    )


def test_a_dump_restored_is_a_working_database(example: str, dsn: str, empty_dsn: str, tmp_path: Path) -> None:
    with connect(dsn) as connection:
        connection.execute(
            """
            CREATE TABLE tunnel.point_s1 PARTITION OF tunnel.point FOR VALUES IN (1) PARTITION BY LIST (km);
            CREATE TABLE tunnel.point_s1_km12 PARTITION OF tunnel.point_s1 FOR VALUES IN (12);
            INSERT INTO tunnel.point
            SELECT 1, 12, 12300 + n, n, ST_SetSRID(ST_MakePoint(n, n, n), 25830), NULL, 1, 1, 0, 0
              FROM generate_series(1, 100) n
            """
        )
        draw_and_take_back(connection)
    archive = tmp_path / "dump"
    folder = find_binaries()
    subprocess.run([folder["pg_dump"], "-Fc", "-f", str(archive), "--dbname", dsn], check=True)
    subprocess.run([folder["pg_restore"], "--exit-on-error", "--dbname", empty_dsn, str(archive)], check=True)
    with connect(empty_dsn) as restored, connect(dsn) as original:
        for view in (
            "leak", "leak_map", "segment", "section", "axis", "stage_status", "survey", "point", "finding",
            "finding_count", "finding_photo", "dry_region", "audit", "km_waterproof", "snti_condition",
        ):  # fmt: skip
            query = sql.SQL("SELECT * FROM tunnel_api.{} ORDER BY id").format(sql.Identifier(view))
            rows = restored.execute(query).fetchall()
            assert rows
            assert rows == original.execute(query).fetchall()
        (merged,) = restored.execute("SELECT min(id) FROM tunnel_api.finding_map WHERE origin = 'merged'").fetchone()  # type: ignore[misc]
        assert restored.execute("SELECT tunnel_api.finding_undo(%s)", [merged]).fetchone() == ("merged",)
        restored.execute("UPDATE tunnel_api.leak SET review = 'confirmed' WHERE review = 'open'")
        restored.execute("DELETE FROM tunnel.survey")
        assert restored.execute("SELECT to_regclass('tunnel.point_s1')").fetchone() == (None,)
        assert restored.execute("SELECT to_regclass('tunnel.image_s1')").fetchone() == (None,)
    others = ("--schema-only", "--exclude-table=tunnel.point_*", "--exclude-table=tunnel.image_s*")
    assert dump(empty_dsn, *others) == dump(dsn, *others)


def test_a_dump_restored_on_another_server_needs_one_init(example: str, dsn: str, tmp_path: Path) -> None:
    """Roles are the server's, not the database's: another server has none of them yet."""
    archive = tmp_path / "dump"
    subprocess.run([find_binaries()["pg_dump"], "-Fc", "-f", str(archive), "--dbname", dsn], check=True)
    home = Path(tempfile.mkdtemp(prefix="tunneldb-restore-"))
    server = Server(home, {"fsync": "off", "shared_buffers": "32MB"})
    try:
        other = server.start()
        restore = [find_binaries()["pg_restore"], "--exit-on-error", "--no-owner", "--no-privileges", "--dbname", other]
        subprocess.run([*restore, str(archive)], check=True)
        assert [finding.subject for finding in examine(other) if finding.level == "wrong"] == ["roles"]
        with open_connection(other) as connection:
            install(connection, REGISTRY)
        assert not [finding for finding in examine(other) if finding.level == "wrong"]
        with connect(other) as connection:
            connection.execute("SET ROLE tunnel_viewer")
            assert connection.execute("SELECT count(*) > 0 FROM tunnel_api.leak").fetchone() == (True,)
    finally:
        server.stop()
        shutil.rmtree(home)


def test_init_does_not_wait_for_ever_for_others(conn: psycopg.Connection, dsn: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tunneldb.database.schema._LOCK_TIMEOUT", "100ms")
    conn.execute("SELECT * FROM tunnel_api.leak")  # and stays in its transaction
    with open_connection(dsn) as connection, pytest.raises(UserError, match="close QGIS"):
        install(connection, REGISTRY)


def test_postgis_in_another_schema_is_refused(empty_dsn: str) -> None:
    with open_connection(empty_dsn) as connection:
        connection.execute("CREATE SCHEMA gis")
        connection.execute("CREATE EXTENSION postgis SCHEMA gis")
    with open_connection(empty_dsn) as connection, pytest.raises(UserError, match="in schema gis"):
        install(connection, REGISTRY)


OF_NO_SURVEY = (
    "alembic_version", "stage", "stage_input", "feature_list", "finding_kind", "severity", "rating_scheme", "rating_rule",
)  # fmt: skip


def test_a_deleted_survey_takes_its_rows_along(example: str, conn: psycopg.Connection) -> None:
    conn.execute("DELETE FROM tunnel.tunnel")
    tables = conn.execute(
        "SELECT relname FROM pg_class WHERE relnamespace = 'tunnel'::regnamespace AND relkind IN ('r', 'p')"
    ).fetchall()
    for (table,) in tables:
        if table not in OF_NO_SURVEY:
            count = conn.execute(sql.SQL("SELECT count(*) FROM {}").format(sql.Identifier("tunnel", table))).fetchone()
            assert count == (0,), table


@pytest.mark.parametrize("revision", ["0031", "9999"])
def test_a_newer_or_unreleased_database_is_refused(conn: psycopg.Connection, dsn: str, revision: str) -> None:
    conn.execute("UPDATE tunnel.alembic_version SET version_num = %s", [revision])
    conn.commit()
    message = f"schema {revision} is unknown.*newer version.*create a new database and load the scans again"
    with pytest.raises(UserError, match=message):
        connect(dsn)
    with pytest.raises(UserError, match=message):
        install(conn, REGISTRY)


def test_a_database_without_postgis_or_schema_is_refused(empty_dsn: str) -> None:
    with pytest.raises(UserError, match="not set up for tunneldb yet; type tunneldb init"):
        connect(empty_dsn)
    with open_connection(empty_dsn) as connection:
        connection.execute("CREATE EXTENSION postgis")
    with pytest.raises(UserError, match="tunneldb init"):
        connect(empty_dsn)


def test_a_server_that_is_down_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot connect") as caught:
        connect(make_conninfo(host=str(tmp_path), dbname="nowhere"))
    assert "\n" not in str(caught.value)


def test_a_dsn_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="not valid for libpq"):
        connect("this is no dsn")
