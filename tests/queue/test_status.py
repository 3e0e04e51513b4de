"""`tunneldb status` of a survey that a batch is at: what it says of each kilometre, files, workers, time, and what to type."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import time

import psycopg
import pytest
from click.testing import CliRunner
from psycopg import sql
from rich.console import Console
from support.queue_rows import add_file, add_goal, add_job, add_run, add_worker, survey_id

from tunneldb.cli.main import main
from tunneldb.cli.overview import render
from tunneldb.cli.watch import Watch
from tunneldb.queue.progress import Overview, overview
from tunneldb.stages.registry import STAGE_NAMES

TUNNELDB = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]
DAMAGED = "/scans/km-6.laz is damaged after point 1000 of 2000: copy it again"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture
def batch(conn: psycopg.Connection, example: str) -> str:
    """A batch of kilometres 1 to 6: 1 done, 2 failed at axis, 3 being worked at, 4 queued, 5 awaited, 6 without its file."""
    key = survey_id(conn, example)
    parent = sql.Identifier(f"point_s{key}")
    conn.execute("DELETE FROM tunnel.run")
    conn.execute(
        sql.SQL("CREATE TABLE tunnel.{} PARTITION OF tunnel.point FOR VALUES IN ({}) PARTITION BY LIST (km)").format(
            parent, sql.Literal(key)
        )
    )
    for km in range(1, 5):
        part = sql.Identifier(f"point_s{key}_km{km}")
        conn.execute(
            sql.SQL("CREATE TABLE tunnel.{} PARTITION OF tunnel.{} FOR VALUES IN ({})").format(part, parent, sql.Literal(km))
        )
    for km in range(1, 7):
        add_goal(conn, example, km)
    for km in range(1, 5):
        add_run(conn, example, km, "load", 40, ago=900)
    for km in (1, 3):
        add_run(conn, example, km, "axis", 10, ago=800)
    add_run(conn, example, 2, "axis", 4, "too few points", ago=800)
    for number, stage in enumerate(STAGE_NAMES[2:]):
        add_run(conn, example, 1, stage, 20, ago=700 - 100 * number)
    worker = add_worker(conn, "calc-1", 4711)
    begin(conn, example, 3, "segments", "calc-1/4711")
    add_worker(conn, "calc-2", 12, silent=300)
    add_job(conn, example, 3, "segments", worker)
    add_job(conn, example, 4, "axis")
    add_file(conn, example, "km-5.laz", 5)
    add_file(conn, example, "km-6.laz", 6, DAMAGED)
    add_file(conn, example, "notes.laz", None, "/scans/notes.laz is not LAS, LAZ or E57")
    conn.commit()
    return example


def begin(conn: psycopg.Connection, survey: str, km: int, stage: str, worker: str) -> None:
    """A run that goes on as long as the test's connection."""
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, backend_pid, backend_start, worker) "
        "SELECT %s, %s, %s, pid, backend_start, %s FROM pg_stat_activity WHERE pid = pg_backend_pid()",
        [survey_id(conn, survey), km, stage, worker],
    )


def states(seen: Overview) -> dict[int, str]:
    return {km: " ".join(cell.state for cell in cells.values()) for km, cells in seen.kilometres.items()}


def test_each_kilometre_says_how_far_it_is(conn: psycopg.Connection, batch: str) -> None:
    assert states(overview(conn, batch)) == {
        1: "done done done done done done",
        2: "done failed never never never never",
        3: "done done running waits waits waits",
        4: "done queued waits waits waits waits",
        5: "waits waits waits waits waits waits",
        6: "failed never never never never never",
    }


def test_counts_and_workers(conn: psycopg.Connection, batch: str) -> None:
    seen = overview(conn, batch)
    assert seen.active
    assert (seen.done, seen.total) == (6 + 1 + 2 + 1, 6 * 6)
    assert [(worker.host, worker.lost, worker.doing) for worker in seen.workers] == [
        ("calc-1", False, f"segments km 3 of {batch}"),
        ("calc-2", True, None),
    ]
    assert seen.live == 1


def test_time_left_is_unknown_until_every_stage_was_measured(conn: psycopg.Connection, batch: str) -> None:
    seen = overview(conn, batch)
    assert (seen.left, seen.rate, seen.share) == (None, None, None)  # no file was ever read
    add_run(conn, batch, None, "read", 30, ago=1000)
    conn.execute("UPDATE tunnel.goal SET requested_at = requested_at - interval '20 minutes'")
    seen = overview(conn, batch)
    # reading 30, load 40, axis 2 × 10, segments, sections, ground and detect 3 × 20 each; that of km 3 has just begun
    assert seen.left == pytest.approx(30 + 40 + 2 * 10 + 12 * 20, abs=3)
    behind = 30 + 4 * 40 + 2 * 10 + 4 * 20
    assert seen.share == pytest.approx(behind / (behind + 330))
    assert seen.rate == pytest.approx(2000 * seen.share / 1200, rel=0.02)


def test_no_worker_no_time_left(conn: psycopg.Connection, batch: str) -> None:
    add_run(conn, batch, None, "read", 30, ago=1000)
    conn.execute("UPDATE tunnel_queue.procrastinate_workers SET last_heartbeat = now() - interval '1 hour'")
    assert overview(conn, batch).left is None
    conn.commit()
    output = CliRunner().invoke(main, ["status", batch]).output
    assert "no worker serves the queue\n    tunneldb worker\n" in output


def test_the_reason_stands_beside_and_what_to_type_below(batch: str) -> None:
    lines = [line.rstrip() for line in CliRunner().invoke(main, ["status", batch]).output.splitlines()]
    table = {line.split()[0]: line for line in lines if line[:1].isdigit()}
    assert table["2"].endswith("axis: too few points")
    assert "segments on calc-1/4711 for" in table["3"]
    assert table["6"].endswith("load: km-6.laz is damaged after point 1000 of 2000: copy it again")
    below = lines[lines.index("what to do") :]
    assert "km 6: km-6.laz is damaged after point 1000 of 2000: copy it again" in below
    place = below.index("km 2: axis: failed: too few points") + 1
    assert below[place].startswith("    first fix the cause: another file")
    assert below[place + 1].strip() == f"tunneldb batch {batch} --retry-failed"
    place = below.index("notes.laz is not LAS, LAZ or E57") + 1
    assert below[place].strip() == "first copy the file again, or export it again, then"
    assert below[place + 1].strip() == f"tunneldb batch {batch} /scans/notes.laz"


def test_equal_kilometres_share_a_row(conn: psycopg.Connection, example: str) -> None:
    for km in (*range(14, 21), 22):
        add_run(conn, example, km, "load", ago=10)
    conn.commit()
    output = CliRunner().invoke(main, ["status", example]).output
    rows = [line.split() for line in output.splitlines() if line[:1].isdigit()]
    assert rows == [["12", *["done"] * 6], ["14–20,", "22", "done", *["never"] * 5]]


@pytest.mark.parametrize("width", [80, 140])
def test_25_kilometres_each_with_an_error_of_its_own_fit_a_terminal(conn: psycopg.Connection, example: str, width: int) -> None:
    conn.execute("DELETE FROM tunnel.run")
    for km in range(25):
        add_file(conn, example, f"km-{km}.laz", km, f"/scans/km-{km}.laz is damaged after point {km}: copy it again")
    console = Console(width=width, height=50, force_terminal=True, color_system=None)
    with console.capture() as capture:
        console.print(render(overview(conn, example)))
    lines = capture.get().splitlines()
    assert max(map(len, lines)) <= width
    table = lines[: lines.index("")]
    assert len(table) == 26
    for km, line in enumerate(table[1:]):
        assert line.split()[:2] == [str(km), "failed"]
        assert f"km-{km}.laz" in line


def test_what_no_batch_wants_is_not_to_be_done(conn: psycopg.Connection, batch: str) -> None:
    conn.execute("UPDATE tunnel.goal SET stage = 'load' WHERE km = 1")
    conn.execute("DELETE FROM tunnel.run WHERE km = 1 AND stage <> 'load'")
    conn.commit()
    output = CliRunner().invoke(main, ["status", batch]).output
    assert "km 1" not in output
    conn.execute("DELETE FROM tunnel.goal WHERE km = 1")
    conn.commit()
    assert "km 1: axis: not yet run" in CliRunner().invoke(main, ["status", batch]).output


def test_json_is_for_programs(batch: str) -> None:
    found = json.loads(CliRunner().invoke(main, ["status", batch, "--json"]).output)
    assert found["kilometres"]["2"]["axis"]["state"] == "failed"
    assert found["files"][1]["message"] == DAMAGED
    assert CliRunner().invoke(main, ["status", "--watch", "--json"]).exit_code == 2


def test_watch_in_a_pipe_says_what_changes_and_ends_when_nothing_is_left(conn: psycopg.Connection, batch: str) -> None:
    watcher = subprocess.Popen(
        [*TUNNELDB, "status", batch, "--watch", "--interval", "0.1"], stdout=subprocess.PIPE, text=True, env=dict(os.environ)
    )
    assert watcher.stdout is not None
    assert watcher.stdout.readline().startswith("10 of 36 steps done; — points/s")
    conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET status = 'succeeded'")
    conn.execute("UPDATE tunnel.run SET outcome = 'done', finished_at = clock_timestamp() WHERE outcome = 'running'")
    conn.execute("DELETE FROM tunnel.incoming WHERE name = 'km-5.laz'")
    conn.execute("DELETE FROM tunnel.goal WHERE km > 3")
    conn.commit()
    lines = watcher.communicate(timeout=120)[0].splitlines()
    assert watcher.returncode == 0
    assert lines[0].startswith("[10/18] segments km 3: ")
    assert lines[-1].endswith("steps done")


def test_ctrl_c_ends_the_watching_with_0(batch: str) -> None:
    watcher = subprocess.Popen([*TUNNELDB, "status", batch, "--watch"], stdout=subprocess.PIPE, text=True)
    assert watcher.stdout is not None
    watcher.stdout.readline()
    time.sleep(0.2)
    watcher.send_signal(signal.SIGINT)
    assert watcher.wait(30) == 0


def test_views_of_the_queue_for_those_who_only_look(conn: psycopg.Connection, batch: str) -> None:
    conn.execute("SET LOCAL ROLE tunnel_viewer")
    jobs = conn.execute("SELECT survey, km, file, stage, state, attempts, worker FROM tunnel_api.job ORDER BY id").fetchall()
    assert jobs == [
        (batch, 3, None, "segments", "running", 0, "calc-1/4711"),
        (batch, 4, None, "axis", "queued", 0, None),
    ]
    workers = conn.execute("SELECT host, pid, doing, heartbeat > now() - interval '1 minute' FROM tunnel_api.worker ORDER BY 1")
    assert workers.fetchall() == [("calc-1", 4711, f"segments km 3 of {batch}", True), ("calc-2", 12, None, False)]
    files = conn.execute("SELECT name, km_from, state, message FROM tunnel_api.incoming ORDER BY name").fetchall()
    assert files[:2] == [("km-5.laz", 5, "waiting", None), ("km-6.laz", 6, "failed", DAMAGED)]
    assert conn.execute("SELECT count(*) FROM tunnel_api.goal WHERE stage = 'detect'").fetchone() == (6,)


def test_a_terminal_shows_the_table_and_goes_on_when_the_connection_breaks(
    conn: psycopg.Connection, dsn: str, batch: str
) -> None:
    screen = io.StringIO()
    with Watch(dsn, batch, Console(file=screen, force_terminal=True, width=80, height=50, color_system=None)) as watch:
        assert watch.look()
        assert "segments on calc-1/4711 for" in screen.getvalue()
        assert watch.conn is not None
        conn.execute("SELECT pg_terminate_backend(%s, 5000)", [watch.conn.info.backend_pid])
        conn.commit()
        assert watch.look()
        assert "the database is away, trying again" in screen.getvalue()
        screen.truncate(0)
        conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET status = 'succeeded'")
        conn.execute("UPDATE tunnel.run SET outcome = 'done', finished_at = clock_timestamp() WHERE outcome = 'running'")
        conn.execute("DELETE FROM tunnel.incoming WHERE failed_at IS NULL")
        conn.commit()
        assert not watch.look()
        assert "away" not in screen.getvalue()
        assert "running" not in screen.getvalue()
