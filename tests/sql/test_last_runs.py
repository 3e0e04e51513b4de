"""The last runs of stages, found by an index: those that sorting the ledger finds, at the price of the places alone."""

from __future__ import annotations

import itertools
from typing import Any

import psycopg
import pytest

STAGES = ("load", "detect", "deviation", "compare")

TUNNEL = "INSERT INTO tunnel.tunnel (name, srid, alignment) VALUES ('line', 25830, 'SRID=25830;LINESTRINGZ(0 0 0, 0 9000 0)')"

SURVEYS = """
INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)
SELECT t.id, 'line-' || n, '2024-05-04', 'none', 'static' FROM tunnel.tunnel t, generate_series(1, 3) n RETURNING id
"""

RUNS = """
INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, parameters)
SELECT s.id, CASE WHEN random() > 0.1 THEN floor(6 * random()) END, (%(stages)s::text[])[1 + floor(4 * random())::int],
    '2024-05-04'::timestamptz + floor(40 * random()) * interval '1 min', now(),
    CASE WHEN random() < 0.3 THEN 'failed' ELSE 'done' END,
    jsonb_build_object('layer', (ARRAY['lining', 'shotcrete'])[1 + floor(2 * random())::int], 'old', floor(3 * random()))
FROM tunnel.survey s, generate_series(1, %(runs)s)
"""

SORTED = """
SELECT DISTINCT ON (r.km, r.subject) r.id FROM tunnel.run r
WHERE r.survey_id = %(survey)s AND r.stage = %(stage)s AND r.km BETWEEN 1 AND 4 AND (r.outcome = 'done' OR NOT %(done)s)
ORDER BY r.km, r.subject, r.started_at DESC, r.id DESC
"""


def fill(conn: psycopg.Connection, runs: int) -> list[int]:
    """Enter so many runs a survey at random; returns the surveys."""
    conn.execute(TUNNEL)
    surveys = [row[0] for row in conn.execute(SURVEYS)]
    conn.execute("SELECT setseed(0.5)")
    conn.execute(RUNS, {"stages": list(STAGES), "runs": runs})
    return surveys


def ids(conn: psycopg.Connection, query: Any, values: dict[str, Any]) -> list[int]:
    return [row[0] for row in conn.execute(query, values)]


@pytest.mark.parametrize("runs", [0, 3, 300])
def test_last_runs_are_those_that_sorting_the_ledger_finds(conn: psycopg.Connection, runs: int) -> None:
    for survey in fill(conn, runs):
        stages = ids(conn, "SELECT DISTINCT stage FROM tunnel.run WHERE survey_id = %(survey)s ORDER BY 1", {"survey": survey})
        assert [row[0] for row in conn.execute("SELECT * FROM tunnel_internal.stages_run(%s)", [survey])] == stages
        for stage in STAGES:
            for done in (True, False):
                asked = {"survey": survey, "stage": stage, "done": done}
                found = ids(conn, "SELECT id FROM tunnel_internal.last_runs(%(survey)s, %(stage)s, %(done)s, 1, 4)", asked)
                assert sorted(found) == sorted(ids(conn, SORTED, asked))


def test_last_runs_of_many_are_those_of_each(conn: psycopg.Connection) -> None:
    surveys = fill(conn, 300)
    for done in (True, False):
        asked = {"surveys": surveys[1:], "stages": ["detect", "deviation"], "done": done}
        found = ids(conn, "SELECT id FROM tunnel_internal.last_runs_of(%(surveys)s, %(stages)s, %(done)s, 1, 4)", asked)
        each = [
            ids(conn, SORTED, asked | {"survey": survey, "stage": stage}) for survey in surveys[1:] for stage in asked["stages"]
        ]
        assert sorted(found) == sorted(itertools.chain.from_iterable(each))
        assert len(found) > 20


def test_subjects_are_those_that_have_results_side_by_side(conn: psycopg.Connection) -> None:
    survey = fill(conn, 0)[0]
    parameters = '{"layer": "lining", "before": 7, "old": 5, "track": "left", "gauge": "GC big"}'
    for stage in ("load", "deviation", "evenness", "thickness", "clearance", "compare"):
        conn.execute("INSERT INTO tunnel.run (survey_id, stage, parameters) VALUES (%s, %s, %s)", [survey, stage, parameters])
    rows = dict(conn.execute("SELECT stage, subject FROM tunnel.run").fetchall())
    assert rows == {
        "load": "", "deviation": "lining", "evenness": "lining", "thickness": "7 lining", "clearance": "left GC big",
        "compare": "5",
    }  # fmt: skip


def test_what_ran_before_costs_nothing(conn: psycopg.Connection) -> None:
    """Blocks that are read do not grow with the ledger."""
    read = []
    for more in (0, 20_000):
        if more == 0:
            surveys = fill(conn, 500)
        else:
            conn.execute(RUNS, {"stages": list(STAGES), "runs": more})
        conn.execute("ANALYZE tunnel.run")
        query = "EXPLAIN (ANALYZE, BUFFERS, TIMING OFF, FORMAT JSON) SELECT * FROM tunnel_internal.last_runs(%s, 'deviation')"
        conn.execute(query, [surveys[0]])  # the catalogue is read once
        row = conn.execute(query, [surveys[0]]).fetchone()
        assert row is not None
        plan = row[0][0]["Plan"]
        read.append(plan["Shared Hit Blocks"] + plan["Shared Read Blocks"])
    assert read[1] < 2 * read[0], "40 times the runs"
