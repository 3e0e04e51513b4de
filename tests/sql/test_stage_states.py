"""How far surveys have come, of many together: what is said of each by itself, and at the price of its own rows."""

from __future__ import annotations

import json
from typing import Any

import psycopg
import pytest
from click.testing import CliRunner

from tunneldb.cli.main import main
from tunneldb.stages.registry import STAGE_NAMES

SURVEYS = """
INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)
SELECT t.id, t.name || '-' || n, '2024-05-04', 'none', 'static' FROM tunnel.tunnel t, generate_series(%s::int, %s) n
RETURNING id
"""

TUNNEL = """
INSERT INTO tunnel.tunnel (name, srid, alignment) VALUES ('line', 25830, 'SRID=25830;LINESTRINGZ(0 0 0, 0 9000 0)')
"""

RUNS = """
INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, counts)
SELECT s, floor(5 * random()), (%(stages)s::text[])[1 + floor(6 * random())::int], t, t + interval '30 s',
    CASE WHEN random() < 0.3 THEN 'failed' ELSE 'done' END,
    CASE WHEN random() < 0.1 THEN '{"kept": 0}'::jsonb ELSE '{}' END
FROM unnest(%(surveys)s::int[]) s, generate_series(1, %(runs)s) n,
    LATERAL (SELECT '2024-05-04'::timestamptz + floor(40 * random()) * interval '1 min' + 0 * (s + n) * interval '1 s') q (t)
"""

ORDERLY = """
INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome)
SELECT s, km, g.name, t, t + interval '30 s', 'done'
FROM unnest(%s::int[]) s, generate_series(0, 2) km, tunnel.stage g,
    LATERAL (SELECT '2024-05-05'::timestamptz + g.step * interval '10 min') q (t)
WHERE s %% 3 = 0 AND NOT g.on_demand
"""

FILES = """
INSERT INTO tunnel.scan_file (survey_id, name, path, bytes, checksum, points, noise, outside, thinned, kept, chainage_from,
    chainage_to, srid)
SELECT s, n || '.laz', '/' || n, 1, '', 1, 0, 0, 0, 1, 1000 * n, 1000 * n + 1000, 25830
FROM unnest(%s::int[]) s, generate_series(0, 4) n
"""

WAITING = """
INSERT INTO tunnel.file_km (file_id, km, rows, points, read_at, loaded_at)
SELECT f.id, f.chainage_from / 1000, 1, '{[0,1)}', '2024-05-04 00:20', CASE WHEN f.id %% 4 > 0 THEN now() END
FROM tunnel.scan_file f WHERE f.survey_id = ANY (%s)
"""

AXIS = """
INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source, edited_at)
SELECT s, n, n / 100, p, p, 1, 'measured', CASE WHEN n = 150 AND s %% 3 = 0 THEN '2024-05-04 00:25'::timestamptz END
FROM unnest(%s::int[]) s, generate_series(0, 500) n, LATERAL (SELECT ST_SetSRID(ST_MakePoint(0, 10 * n, 0), 25830)) q (p)
"""

SEGMENTS = """
INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from, tangent_to,
    geom, points)
SELECT s, n, n / 100, 10 * n, 10 * n + 10, ARRAY[0, 10 * n, 0], ARRAY[0.1, 10 * n + 10, 0], '{0,1,0}', '{0,1,0}',
    ST_GeomFromText('LINESTRINGZ(0 0 0, 0 10 0)', 25830), 0
FROM unnest(%s::int[]) s, generate_series(0, 499) n
"""

GOALS = "INSERT INTO tunnel.goal (survey_id, km, stage) SELECT s, s %% 7, 'detect' FROM unnest(%s::int[]) s"

EACH = """
SELECT s.id, t.km, t.step, t.stage, t.run_id, t.outcome, t.done_at, t.input_at, t.outdated, t.reason
FROM tunnel.survey s CROSS JOIN LATERAL tunnel_internal.stage_state(s.id, %(first)s, %(last)s) t ORDER BY s.id, t.km, t.step
"""

TOGETHER = """
SELECT t.survey_id, t.km, t.step, t.stage, t.run_id, t.outcome, r.finished_at, t.input_at, t.outdated, t.reason
FROM tunnel_internal.stage_states(ARRAY(SELECT id FROM tunnel.survey), %(first)s, %(last)s) t
LEFT JOIN tunnel.run r ON r.id = t.done_id ORDER BY t.survey_id, t.km, t.step
"""


def fill(conn: psycopg.Connection, first: int, last: int, runs: int) -> list[int]:
    """Enter surveys with numbers from first to last and so many runs each, at random; returns their keys."""
    surveys = [row[0] for row in conn.execute(SURVEYS, [first, last])]
    conn.execute("SELECT setseed(0.5)")
    conn.execute(RUNS, {"stages": list(STAGE_NAMES), "surveys": surveys, "runs": runs})
    for rows in (ORDERLY, FILES, WAITING, AXIS, SEGMENTS, GOALS):
        conn.execute(rows, [surveys])
    return surveys


@pytest.mark.parametrize(("first", "last"), [(-1000000, 1000000), (1, 2), (5, 5)])
def test_of_many_surveys_together_is_said_what_is_said_of_each(conn: psycopg.Connection, first: int, last: int) -> None:
    conn.execute(TUNNEL)
    fill(conn, 1, 6, 60)
    span = {"first": first, "last": last}
    together = conn.execute(TOGETHER, span).fetchall()
    assert together == conn.execute(EACH, span).fetchall()
    assert together
    if last > 5:
        outcomes, reasons = {row[5] for row in together}, {str(row[9]).partition(" ")[2] for row in together}
        assert outcomes == {"done", "failed", "never"}
        assert {"read since", "ran since", "is stale", "never ran", "edited since"} <= reasons
        assert len({row[0] for row in together}) == 6


def test_stages_of_a_survey_read_nothing_of_others(conn: psycopg.Connection) -> None:
    conn.execute(TUNNEL)
    survey = fill(conn, 1, 2, 60)[1]
    read = []
    for others in (0, 100):
        if others:
            fill(conn, 3, 2 + others, 60)
        conn.execute("ANALYZE")
        before = rows_read(conn)
        conn.execute("SELECT FROM tunnel_internal.stage_state(%s)", [survey])
        read.append(rows_read(conn) - before)
    assert read[1] <= read[0], "50 times the surveys"


def rows_read(conn: psycopg.Connection) -> int:
    """Rows that this transaction has read so far of tables that grow with the surveys' lengths."""
    row = conn.execute(
        "SELECT sum(seq_tup_read + coalesce(idx_tup_fetch, 0)) FROM pg_stat_xact_user_tables"
        " WHERE relname IN ('run', 'scan_file', 'file_km', 'axis_vertex', 'segment')"
    ).fetchone()
    assert row is not None
    return int(row[0])


def test_status_of_all_surveys_asks_of_many_at_once(conn: psycopg.Connection, dsn: str) -> None:
    conn.execute(TUNNEL)
    surveys = fill(conn, 1, 120, 60)
    empty = conn.execute(SURVEYS, [121, 121]).fetchall()
    assert len(empty) == 1
    each = conn.execute(
        "SELECT s.name, count(DISTINCT t.km), array_agg(DISTINCT t.km) FILTER (WHERE t.stage = 'axis' AND t.outcome = 'done'"
        " AND NOT t.stale) FROM tunnel.survey s LEFT JOIN tunnel_api.stage_status t ON t.survey_id = s.id GROUP BY s.name"
    ).fetchall()
    conn.execute("ANALYZE")
    conn.execute("DO $$ BEGIN EXECUTE format('ALTER DATABASE %I SET track_functions = ''all''', current_database()); END $$")
    conn.commit()
    before = calls(conn)
    conn.rollback()
    result = CliRunner().invoke(main, ["status", "--json"])
    assert result.exit_code == 0, result.output
    said = {row["name"]: (row["kilometres"], row["done"]) for row in json.loads(result.stdout)["surveys"]}
    assert len(said) == len(surveys) + 1
    for name, kilometres, done in each:
        assert said[name][0] == (kilometres or None)
        assert said[name][1].get("axis", 0) == len(done or ())
    assert 0 < calls(conn) - before <= 4, "of 121 surveys"


def calls(conn: psycopg.Connection) -> int:
    """Calls of the functions that say how far surveys have come, in all sessions that have ended."""
    row: tuple[Any, ...] | None = conn.execute(
        "SELECT coalesce(sum(calls), 0) FROM pg_stat_user_functions WHERE funcname LIKE 'stage_state%'"
    ).fetchone()
    assert row is not None
    return int(row[0])
