"""Thousands of kilometres in one database: what is asked of one reads that one, and a survey goes at a stroke."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo

from tunneldb.database import connect, copy_binary, pack
from tunneldb.database.failures import describe_failure
from tunneldb.store.catalog import remove_survey
from tunneldb.store.sources import load_points, sample
from tunneldb.store.survey import get_survey

DATABASE = "tunneldb_growth"
SURVEYS = {"short": 25, "long": 1000, "third": 985, "fourth": 990}  # km of each: 3000 partitions
KM = 5
REPEATS = (
    12  # PostgreSQL thinks of a plan for all values at the sixth run, of a statement that psycopg prepared at the eleventh
)
DEFAULT_LOCKS = 64 * 100  # max_locks_per_transaction × max_connections as PostgreSQL comes
FRAME = "array_fill(0::float8, ARRAY[12])"

TUNNEL = """
INSERT INTO tunnel.tunnel (name, srid, alignment)
VALUES ('line', 25830, 'SRID=25830;LINESTRINGZ(0 0 0, 0 1000000 0)')
"""
PARTITIONS = """
DO $$
BEGIN
    CREATE TABLE IF NOT EXISTS tunnel.point_s{survey}
        PARTITION OF tunnel.point FOR VALUES IN ({survey}) PARTITION BY LIST (km);
    FOR km IN {first} .. {last} LOOP
        EXECUTE format('CREATE TABLE tunnel.%I PARTITION OF tunnel.point_s{survey} FOR VALUES IN (%s)',
            tunnel_internal.partition_name({survey}, km), km);
    END LOOP;
END
$$
"""
POINTS = """
INSERT INTO tunnel.point (survey_id, km, chainage, gps_time, geom, scan_id, file_id, intensity, classification)
SELECT %(survey)s, km, 1000 * km + i, i, ST_SetSRID(ST_MakePoint(0, 1000 * km + i, 0), 25830), 1, 1, 0, 0
  FROM generate_series(%(km)s, %(km)s + 1) AS km, generate_series(0, 999) AS i
"""
SEGMENTS = """
INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from, tangent_to,
    geom, points)
SELECT s.id, n, n / 100, 10 * n, 10 * n + 10, '{0,0,0}', '{0,0,0}', '{0,1,0}', '{0,1,0}',
    ST_GeomFromText('LINESTRINGZ(0 0 0, 0 10 0)', 25830), 0
  FROM tunnel.survey s, generate_series(0, 2499) AS n
"""
SECTIONS = """
INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, geom, points,
    interpolated)
SELECT g.survey_id, g.km, g.n, half, g.chainage_from + half / 10.0, 0.15, 5, '{1,1}', '{0,0}', g.geom, 0, 0
  FROM tunnel.segment g, (VALUES (25), (75)) AS h (half)
"""
LEAKS = """
INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, area, darkening_mean,
darkening_max,
    image_share, unrolled, map, surface)
SELECT g.survey_id, g.km, g.chainage_from, g.chainage_from + 1, 0, 1, 12, 1, 3, 3, 1,
    ST_MakeEnvelope(g.chainage_from, 0, g.chainage_from + 1, 1, 0),
    ST_MakeEnvelope(0, g.chainage_from, 1, g.chainage_from + 1, 25830),
    ST_Force3D(ST_MakeEnvelope(0, g.chainage_from, 1, g.chainage_from + 1, 25830))
  FROM tunnel.segment g
"""


@pytest.fixture(scope="module")
def many(server_dsn: str, template: str) -> Iterator[str]:
    """DSN of a database with 3000 partitions, in surveys named as in SURVEYS."""
    create = sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(sql.Identifier(DATABASE), sql.Identifier(template))
    with psycopg.connect(server_dsn, autocommit=True) as conn:
        conn.execute(create)
    dsn = make_conninfo(server_dsn, dbname=DATABASE)
    with psycopg.connect(dsn) as conn:
        conn.execute(TUNNEL)
        for name, kilometres in SURVEYS.items():
            row = conn.execute(
                "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
                " SELECT id, %s, '2024-05-04', 'none', 'mobile' FROM tunnel.tunnel RETURNING id",
                [name],
            ).fetchone()
            assert row is not None
            for first in range(0, kilometres, 500):
                last = min(first + 500, kilometres) - 1
                conn.execute(PARTITIONS.format(survey=row[0], first=first, last=last))
                conn.commit()
        conn.execute(POINTS, {"survey": survey_id(conn, "short"), "km": KM})
        for statement in (SEGMENTS, SECTIONS, LEAKS):
            conn.execute(statement)
        conn.commit()
        conn.autocommit = True
        conn.execute("ANALYZE tunnel.survey, tunnel.tunnel, tunnel.segment, tunnel.section, tunnel.finding")
    yield dsn
    with psycopg.connect(server_dsn, autocommit=True) as conn:
        conn.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(DATABASE)))


@pytest.fixture
def conn(many: str) -> Iterator[psycopg.Connection]:
    """A connection as the program's commands have it; what is changed is undone, unless it is committed."""
    with connect(many) as connection:
        yield connection
        connection.rollback()


def survey_id(conn: psycopg.Connection, name: str) -> int:
    row = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [name]).fetchone()
    assert row is not None
    return int(row[0])


def tables(survey: int, *kilometres: int) -> set[str]:
    return {f"point_s{survey}_km{km}" for km in kilometres}


def locked(conn: psycopg.Connection) -> set[str]:
    """Return the kilometres' partitions that this transaction has locked so far: those that were planned for."""
    rows = conn.execute(
        "SELECT c.relname FROM pg_locks l JOIN pg_class c ON c.oid = l.relation"
        " WHERE l.pid = pg_backend_pid() AND c.relname ~ '^point_s[0-9]+_km[0-9]+$'"
    )
    return {row[0] for row in rows}


def relations(plan: dict[str, Any]) -> set[str]:
    """Return the kilometres' partitions that a plan reads."""
    found = {relation for part in plan.get("Plans", []) for relation in relations(part)}
    name = plan.get("Relation Name", "")
    return found | ({name} if "_km" in name else set())


def explain(conn: psycopg.Connection, query: str) -> dict[str, Any]:
    row = conn.execute("EXPLAIN (FORMAT JSON) " + query).fetchone()
    assert row is not None
    plan: dict[str, Any] = row[0][0]["Plan"]
    return plan


def nodes(plan: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield plan
    for part in plan.get("Plans", []):
        yield from nodes(part)


def inner_plans(conn: psycopg.Connection, call: str) -> list[set[str]]:
    """Return what each statement on points inside a function reads, as the server itself explains it."""
    messages: list[str] = []
    conn.execute("LOAD 'auto_explain'")
    conn.execute("SET LOCAL auto_explain.log_min_duration = 0")
    conn.execute("SET LOCAL auto_explain.log_nested_statements = on")
    conn.execute("SET LOCAL auto_explain.log_format = json")
    conn.execute("SET LOCAL client_min_messages = log")

    def keep(diagnostic: psycopg.errors.Diagnostic) -> None:
        messages.append(diagnostic.message_primary or "")

    conn.add_notice_handler(keep)
    conn.execute(call)
    conn.remove_notice_handler(keep)
    plans = [json.loads(message.split("plan:\n", 1)[1]) for message in messages if "plan:\n" in message]
    return [found for plan in plans if (found := relations(plan["Plan"]))]


CALLS = {
    "axis_shift": (
        f"SELECT * FROM tunnel_internal.axis_shift({{survey}}, ARRAY[{KM}50, {KM}51], ARRAY[0, 0]::float8[],"
        f" ARRAY[{KM}500, {KM}510]::float8[], ARRAY[0, 0]::float8[])",
        [KM],
    ),
    "section_slab": (f"SELECT * FROM tunnel_internal.section_slab({{survey}}, {KM}500, {FRAME}, 0.15)", [KM]),
    "section_slab at the end of a kilometre": (
        f"SELECT * FROM tunnel_internal.section_slab({{survey}}, {KM + 1}000.05, {FRAME}, 0.15)",
        [KM, KM + 1],
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_function_reads_the_kilometres_that_it_needs_however_often_it_is_called(conn: psycopg.Connection, name: str) -> None:
    call, kilometres = CALLS[name]
    survey = survey_id(conn, "short")
    expected = tables(survey, *kilometres)
    for _ in range(REPEATS):
        assert inner_plans(conn, call.format(survey=survey)) == [expected]
        assert locked(conn) == expected
        conn.commit()


def test_tagging_touches_no_other_kilometre_however_many_a_worker_has_done(conn: psycopg.Connection) -> None:
    survey = survey_id(conn, "short")
    for km in range(10, 10 + REPEATS):
        conn.execute("SELECT tunnel_internal.segment_tag(%s, %s)", [survey, km])
        assert locked(conn) == tables(survey, km)
        conn.commit()


def test_detection_samples_one_kilometre_however_many_a_worker_has_done(conn: psycopg.Connection) -> None:
    survey = get_survey(conn, "short")
    for _ in range(REPEATS):
        assert len(sample(conn, survey, KM)) == 1000
        assert locked(conn) == tables(survey.id, KM)
        conn.commit()


def test_the_ground_holds_up_none_of_its_neighbours_however_many_a_worker_has_done(conn: psycopg.Connection) -> None:
    """Neighbours read each other's points: were they to keep their locks, none could swap in what it has made."""
    survey = get_survey(conn, "short")
    for _ in range(REPEATS):
        points, own = load_points(conn, survey, KM, 1000.0 * KM - 30.0, 1000.0 * (KM + 1) + 30.0)
        assert (own, len(points)) == (1000, 1030)
        assert locked(conn) == set()
        conn.execute("SELECT tunnel_internal.class_write(%s, %s, %b)", [survey.id, KM, bytes(own)])
        assert locked(conn) == tables(survey.id, KM)
        conn.commit()


def test_points_of_a_stretch_are_read_from_their_kilometre(conn: psycopg.Connection) -> None:
    survey = survey_id(conn, "short")
    plan = explain(
        conn, f"SELECT * FROM tunnel_api.point WHERE survey_id = {survey} AND km = {KM} AND chainage BETWEEN 5100 AND 5120"
    )
    assert relations(plan) == tables(survey, KM)
    assert locked(conn) == tables(survey, KM)


def test_points_of_a_chainage_alone_stay_within_their_survey(conn: psycopg.Connection) -> None:
    survey = survey_id(conn, "short")
    plan = explain(conn, f"SELECT * FROM tunnel_api.point WHERE survey_id = {survey} AND chainage BETWEEN 5100 AND 5120")
    assert relations(plan) == locked(conn) == tables(survey, *range(SURVEYS["short"]))


@pytest.mark.parametrize("named", ["tunnel_api.survey_id('short')", "(SELECT id FROM tunnel_api.survey WHERE name = 'short')"])
def test_points_of_a_survey_by_name_are_read_from_their_kilometre(conn: psycopg.Connection, named: str) -> None:
    """Its number is known when the query begins, so that kilometre of each survey is planned for and one is read."""
    query = f"SELECT * FROM tunnel_api.point WHERE survey_id = {named} AND km = {KM} AND chainage BETWEEN 5100 AND 5120"
    row = conn.execute("EXPLAIN (ANALYZE, FORMAT JSON) " + query).fetchone()
    assert row is not None
    read = {
        node["Relation Name"]
        for node in nodes(row[0][0]["Plan"])
        if "_km" in node.get("Relation Name", "") and node["Actual Loops"]
    }
    assert read == tables(survey_id(conn, "short"), KM)
    assert len(locked(conn)) == len(SURVEYS)


def test_points_asked_for_by_name_look_at_no_other_survey(conn: psycopg.Connection) -> None:
    survey = survey_id(conn, "short")
    found = conn.execute("SELECT count(*), min(chainage), max(chainage) FROM tunnel_api.points('short', 5100, 5120)").fetchone()
    assert found == (20, 5100, 5119)
    assert locked(conn) == tables(survey, KM)


@pytest.mark.parametrize(
    ("view", "table", "condition"),
    [
        ("segment", "segment", "chainage_to >= 5000 AND chainage_from < 5100"),
        ("section", "section", "chainage BETWEEN 5000 AND 5100"),
        ("leak", "finding", "chainage_to >= 5000 AND chainage_from < 5100"),
    ],
)
def test_rows_of_a_stretch_are_found_by_an_index_on_the_survey(
    conn: psycopg.Connection, view: str, table: str, condition: str
) -> None:
    plan = explain(conn, f"SELECT * FROM tunnel_api.{view} WHERE survey = 'short' AND {condition}")
    scans = [node for node in nodes(plan) if node.get("Relation Name") == table or table in node.get("Index Name", "")]
    assert scans
    assert not any(node["Node Type"] == "Seq Scan" for node in scans)
    assert any("survey_id =" in node.get("Index Cond", "") for node in scans)
    assert locked(conn) == set()


def test_a_survey_of_a_thousand_kilometres_goes_within_the_locks_of_a_server_as_it_comes(conn: psycopg.Connection) -> None:
    survey = survey_id(conn, "long")
    remove_survey(conn, "long")
    locks = conn.execute("SELECT count(*) FROM pg_locks WHERE pid = pg_backend_pid()").fetchone()
    left = conn.execute("SELECT count(*) FROM pg_class WHERE relname ~ %s", [f"^point_s{survey}(_|$)"]).fetchone()
    assert left == (0,)
    assert locks is not None
    assert SURVEYS["long"] < locks[0] < DEFAULT_LOCKS


@pytest.mark.parametrize("fresh", [False, True])
def test_rows_of_a_fresh_table_are_frozen(conn: psycopg.Connection, fresh: bool) -> None:
    """Others are marked committed by who reads them first; with checksums, each page so marked goes to the WAL."""
    rows = 10_000
    table = sql.Identifier("public", "fresh")
    conn.execute("CREATE EXTENSION pg_visibility")
    conn.execute("CREATE TABLE public.fresh (n bigint, v float8)")
    copy_binary(conn, table, ("n", "v"), [pack([np.arange(rows, dtype=np.int64), np.zeros(rows)])], fresh=fresh)
    frozen = conn.execute(
        "SELECT all_frozen, pg_relation_size('public.fresh') / 8192 FROM pg_visibility_map_summary('public.fresh')"
    ).fetchone()
    assert frozen is not None
    assert frozen[1] > 10
    assert frozen[0] == (frozen[1] if fresh else 0)


def test_a_removal_waits_for_who_reads_and_holds_up_nobody(dsn: str) -> None:
    with psycopg.connect(dsn) as reader, psycopg.connect(dsn, options="-c statement_timeout=20s") as others:
        reader.execute(TUNNEL)
        reader.execute(
            "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
            " SELECT id, n, '2024-05-04', 'none', 'mobile' FROM tunnel.tunnel, unnest(ARRAY['gone', 'kept']) n"
        )
        for name in ("gone", "kept"):
            reader.execute(PARTITIONS.format(survey=survey_id(reader, name), first=0, last=0))
        reader.commit()
        gone, kept = survey_id(reader, "gone"), survey_id(reader, "kept")
        reader.execute("SELECT FROM tunnel.point WHERE survey_id = %s", [kept])  # and stays in its transaction
        reader.execute("SELECT FROM tunnel.image WHERE survey_id = %s", [kept])

        def remove() -> None:
            with connect(dsn) as connection:
                remove_survey(connection, "gone")

        with ThreadPoolExecutor(1) as pool:
            removal = pool.submit(remove)
            for _ in range(10):
                others.execute("SELECT FROM tunnel.point WHERE survey_id = %s", [kept])
                others.execute("SELECT FROM tunnel.image WHERE survey_id = %s", [kept])
                others.commit()
                time.sleep(0.1)
            assert not removal.done()
            reader.commit()
            removal.result(timeout=30)
        tables_left = others.execute(
            "SELECT to_regclass(n) FROM unnest(%s::text[]) n",
            [[f"tunnel.{table}_s{survey}" for survey in (gone, kept) for table in ("point", "image")]],
        ).fetchall()
        assert tables_left == [(None,), (None,), (f"tunnel.point_s{kept}",), (f"tunnel.image_s{kept}",)]


def test_a_server_out_of_locks_says_which_setting_to_raise(conn: psycopg.Connection) -> None:
    with pytest.raises(psycopg.errors.OutOfMemory) as caught:
        conn.execute("SELECT count(pg_advisory_xact_lock(n)) FROM generate_series(1, 10000000) AS n")
    message = describe_failure(caught.value)
    assert message is not None
    assert "max_locks_per_transaction" in message
    assert "\n" not in message


def test_every_foreign_key_is_indexed_so_that_what_hangs_on_a_survey_is_found(conn: psycopg.Connection) -> None:
    keys = conn.execute(
        """
        SELECT k.conname,
               EXISTS (SELECT FROM pg_index i JOIN pg_attribute a ON a.attrelid = k.conrelid AND a.attnum = k.conkey[1]
                        WHERE i.indrelid = k.conrelid
                          -- one that leaves out empty ones serves, too: who looks for a row that hangs on another has its key
                          AND coalesce(pg_get_expr(i.indpred, i.indrelid), '') IN ('', format('(%I IS NOT NULL)', a.attname))
                          AND (i.indkey::int2[])[0:cardinality(k.conkey) - 1] @> k.conkey)
          FROM pg_constraint k
         WHERE k.contype = 'f' AND k.connamespace = 'tunnel'::regnamespace
        """
    ).fetchall()
    assert len(keys) > 10
    assert [name for name, indexed in keys if not indexed] == []
