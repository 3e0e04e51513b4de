"""What is pruned of the ledger and the queue changes nothing but their lengths."""

from __future__ import annotations

import json

import numpy as np
import psycopg
from click.testing import CliRunner
from psycopg import sql
from psycopg.types.json import Jsonb
from support.example_change import EARLIER, add_earlier
from support.queue_rows import add_goal, add_job

from tunneldb.cli.main import main
from tunneldb.stages.registry import MEASURES, STAGE_NAMES
from tunneldb.stages.stage import Holds

HISTORIES = {"run", "change", "job", "survey_size"}
"""Views that list runs and jobs, or what they take: the only ones that may be different."""

INPUTS = """
    SELECT k, r.stage, tunnel_internal.result_inputs(n.id, r.stage, k, r.subject)
      FROM tunnel.survey n, tunnel.survey o, generate_series(11, 13) k,
           LATERAL (VALUES ('compare', o.id::text), ('rings', ''), ('deviation', 'lining'), ('evenness', 'lining'),
                           ('thickness', o.id || ' lining'), ('clearance', 'single example')) r (stage, subject)
"""
"""What results made now would be made from."""

SEEN = """
    SELECT DISTINCT ON (survey_id, km) survey_id, km, counts, parameters FROM tunnel.run
     WHERE stage = 'detect' AND outcome = 'done' ORDER BY survey_id, km, finished_at DESC, id DESC
"""
"""What km_statistics has of lining seen before there was a coverage."""

PREFIXES = {"axis": "axis.tolerance", "ground": "ground.angle", "detect": "image.pixel"}


def views(conn: psycopg.Connection) -> dict[str, list[str]]:
    """Rows of all views but the histories, and what is to be done next."""
    listed = conn.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api'").fetchall()
    queries = {name: sql.SQL("SELECT v::text FROM tunnel_api.{} AS v").format(sql.Identifier(name)) for (name,) in listed}
    for function in ("stage_state", "queue_state"):
        queries[function] = sql.SQL("SELECT s.id, f::text FROM tunnel.survey s, tunnel_internal.{}(s.id) f").format(
            sql.Identifier(function)
        )
    queries["inputs"] = sql.SQL(INPUTS)
    queries["seen"] = sql.SQL(SEEN)
    rows = {name: sorted(map(str, conn.execute(query))) for name, query in queries.items() if name not in HISTORIES}
    conn.rollback()
    return rows


def said(*words: str) -> dict[str, object]:
    result = CliRunner().invoke(main, [*words, "--json"])
    return {k: v for k, v in json.loads(result.stdout).items() if k not in ("seconds", "now")} | {"code": result.exit_code}


def add_history(conn: psycopg.Connection, count: int) -> None:
    """Runs of all stages at random, whose times are not in the order of their numbers, made from what there was then or not."""
    rng = np.random.default_rng(5)
    surveys = {name: key for key, name in conn.execute("SELECT id, name FROM tunnel.survey")}
    new, old = surveys["demo-2024"], surveys[EARLIER]
    made_from = {
        "compare": (f"{old}", {"old": old, "cell": 0.1, "length": 5}),
        "rings": ("", {"options": {}}),
        "deviation": ("lining", {"layer": "lining"}),
        "evenness": ("lining", {"layer": "lining", "length": 4, "limit": 0.01}),
        "thickness": (f"{old} lining", {"before": old, "layer": "lining"}),
        "clearance": ("single example", {"track": "single", "gauge": "example"}),
    }
    add = "INSERT INTO tunnel.run (survey_id, km, stage, parameters, counts, outcome, message, started_at, finished_at, job_id)"
    add += " SELECT %s, %s, %s, %s, %s, %s, %s, t, t + make_interval(secs => %s), %s"
    add += " FROM (SELECT timestamptz '2024-06-01' + make_interval(mins => %s)) m (t)"
    for _ in range(count):
        stage = str(rng.choice([*STAGE_NAMES, *made_from, "read"]))
        survey, km = int(rng.choice([new, old])), int(rng.choice([11, 12, 12, 13]))
        if stage in made_from:
            subject, options = made_from[stage]
            row = conn.execute("SELECT tunnel_internal.result_inputs(%s, %s, %s, %s)", [new, stage, km, subject]).fetchone()
            assert row is not None
            survey, parameters = new, row[0] | options
        else:
            prefix = PREFIXES.get(stage)
            parameters = {prefix: float(rng.choice([1, 2]))} if prefix else {}
        if stage == "read":
            parameters = {"file": str(rng.choice(["a.laz", "b.laz"])), "load.density": 100.0}
        outcome = str(rng.choice(["done", "done", "failed", "running"]))
        counts = {"note": f"noted {rng.integers(100)}", "lining_pixels": int(rng.integers(1000))}
        job = None
        if rng.random() < 0.3:
            job = add_job(conn, next(name for name, key in surveys.items() if key == survey), km, stage)
            conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET status = 'succeeded' WHERE id = %s", [job])
        conn.execute(
            add,
            [
                survey, None if stage == "read" else km, stage, Jsonb(parameters), Jsonb(counts), outcome,
                "broke" if outcome == "failed" else None, float(rng.integers(1, 600_000)), job, int(rng.integers(10_000)),
            ],
        )  # fmt: skip


def test_pruning_a_long_history_changes_no_view_and_nothing_that_status_or_check_say(
    example: str, conn: psycopg.Connection
) -> None:
    add_earlier(conn, example)
    for km in (11, 12, 13):
        add_goal(conn, example, km)
    add_history(conn, 500)
    imported = conn.execute(
        "INSERT INTO tunnel.run (survey_id, stage, outcome, started_at) SELECT id, 'import', 'done', '2020-01-01'"
        " FROM tunnel.survey, generate_series(1, 2) RETURNING id"
    ).fetchall()
    conn.commit()
    before = views(conn), said("status"), said("status", example), said("check")
    jobs = conn.execute("SELECT count(*) FROM tunnel_queue.procrastinate_jobs").fetchone()
    shown = said("prune")
    assert said("prune") == shown  # nothing went

    pruned = said("prune", "--yes")
    assert pruned["superseded"] == shown["superseded"]
    after = views(conn), said("status"), said("status", example), said("check")
    for name, rows in before[0].items():
        assert after[0][name] == rows, name
    assert after[1:] == before[1:]

    left = conn.execute("SELECT count(*) FROM tunnel.run").fetchone()
    assert left is not None
    assert jobs is not None
    deleted = pruned["deleted"]
    assert isinstance(deleted, dict)
    assert deleted["runs"] + left[0] == 500 + 6 + len(imported)  # the example's own are six
    assert deleted["runs"] > 200
    assert conn.execute("SELECT count(*) FROM tunnel.run WHERE stage = 'import'").fetchone() == (len(imported),)
    dangling = "SELECT count(*) FROM tunnel_api.run r, unnest(tunnel_internal.run_inputs(r.stage, r.parameters)) i"
    assert conn.execute(dangling + " WHERE NOT EXISTS (SELECT FROM tunnel.run o WHERE o.id = i)").fetchone() == (0,)
    # a job stays with the run that it was, and goes with it
    held = conn.execute(
        "SELECT (SELECT count(*) FROM tunnel_queue.procrastinate_jobs),"
        " (SELECT count(DISTINCT job_id) FROM tunnel.run), (SELECT count(*) FROM tunnel_internal.superseded_jobs())"
    ).fetchone()
    assert held == (jobs[0] - deleted["jobs"], jobs[0] - deleted["jobs"], 0)
    assert said("prune")["superseded"] == []


def test_the_inputs_of_results_are_those_of_the_registry(example: str, conn: psycopg.Connection) -> None:
    """The functions …_inputs give what the registry says: runs, which `run_inputs` knows, and checksums."""
    survey = conn.execute("SELECT id FROM tunnel.survey").fetchone()
    assert survey is not None
    assert len(MEASURES) >= 6
    for stage in MEASURES:
        subject = " ".join(str(survey[0]) if key in ("before", "old") else "lining" for key in stage.subject)
        given = conn.execute(
            "SELECT tunnel_internal.result_inputs(%s, %s, 12, %s)", [survey[0], stage.name, subject]
        ).fetchone()
        assert given is not None
        assert set(given[0]) == {one.key for one in stage.inputs if one.holds != Holds.SURVEY}, stage.name
        runs = [one.key for one in stage.inputs if one.holds == Holds.RUN]
        known = conn.execute(
            "SELECT tunnel_internal.run_inputs(%s, %s)", [stage.name, Jsonb(dict.fromkeys(runs, 7))]
        ).fetchone()
        assert known == ([7] * len(runs) or None,), stage.name


def test_what_runs_or_waits_is_left_alone(example: str, conn: psycopg.Connection) -> None:
    run = "INSERT INTO tunnel.run (survey_id, km, stage, started_at, outcome, backend_pid, backend_start)"
    conn.execute(
        f"{run} SELECT s.id, 12, 'axis', '2023-01-01', 'running', a.pid, a.backend_start"
        " FROM tunnel.survey s, pg_stat_activity a WHERE a.pid = pg_backend_pid()"
    )
    conn.execute(f"{run} SELECT id, 12, 'axis', '2023-01-02', 'failed', 0, NULL FROM tunnel.survey".encode())
    conn.commit()
    old = "SELECT started_at::date::text, outcome FROM tunnel.run WHERE started_at < '2024-01-01' ORDER BY 1"
    assert said("prune", "--before", "2023-01-02")["rows"] == 0
    add_job(conn, example, 12, "detect")
    conn.commit()
    refused = said("prune", example, "--yes")
    assert refused["code"] == 2
    assert f"tunneldb status {example}" in str(refused["error"])
    assert said("prune", "--yes")["left_out"] == [example]
    conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET status = 'succeeded'")
    conn.commit()
    assert said("prune", example, "--before", "2023-01-03", "--yes")["deleted"] == {"runs": 1, "jobs": 0}
    assert conn.execute(old).fetchall() == [("2023-01-01", "running")]
    assert said("prune", "--yes")["deleted"] == {"runs": 0, "jobs": 1}
