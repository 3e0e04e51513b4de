"""Jobs and their results: they commit together, are taken over when a worker is lost, and are repeated when that helps."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psycopg
import pytest
from click.testing import CliRunner
from support.databases import Copies

from tunneldb.cli.main import main
from tunneldb.errors import BusyError, UserError
from tunneldb.simulate import Parameters, Simulation, write
from tunneldb.stages.ledger import Job, LostError, describe, retry_at, stage_run

pytestmark = pytest.mark.slow

KM = 12


def one(conn: psycopg.Connection, query: str, *arguments: Any) -> Any:
    row = conn.execute(query, arguments).fetchone()
    return None if row is None else row[0]


@pytest.fixture
def survey(conn: psycopg.Connection, example: str) -> int:
    """The example, with nothing but its points: three kilometres that are to be brought to sections."""
    survey = one(conn, "SELECT id FROM tunnel.survey")
    conn.execute("TRUNCATE tunnel.run")
    for km in (KM - 1, KM, KM + 1):
        conn.execute("INSERT INTO tunnel.goal (survey_id, km, stage) VALUES (%s, %s, 'sections')", [survey, km])
        conn.execute(
            "INSERT INTO tunnel.run (survey_id, km, stage, finished_at, outcome) VALUES (%s, %s, 'load', now(), 'done')",
            [survey, km],
        )
    conn.execute("CREATE TABLE tunnel.point_s1 PARTITION OF tunnel.point FOR VALUES IN (1) PARTITION BY LIST (km)")
    for km in (11, 12, 13):
        conn.execute(f"CREATE TABLE tunnel.point_s1_km{km} PARTITION OF tunnel.point_s1 FOR VALUES IN ({km})")
    conn.execute("SELECT tunnel_internal.queue_plan(%s)", [survey])
    conn.commit()
    assert survey == 1
    return int(survey)


def worker(conn: psycopg.Connection, silent: float = 0.0) -> int:
    """A worker that was last heard of some seconds ago."""
    number = one(
        conn,
        "INSERT INTO tunnel_queue.procrastinate_workers (last_heartbeat) VALUES (clock_timestamp() - make_interval(secs => %s))"
        " RETURNING id",
        silent,
    )
    conn.execute("INSERT INTO tunnel.worker (id, host, pid) VALUES (%s, 'h', 1)", [number])
    conn.commit()
    return int(number)


def take(conn: psycopg.Connection, number: int) -> tuple[Job, int, str]:
    """The next job for a worker, its kilometre and stage."""
    row = conn.execute(
        "SELECT id, attempts, (args ->> 'km')::int, args ->> 'stage'"
        " FROM tunnel_queue.procrastinate_fetch_job_v2(ARRAY['tunneldb'], %s)",
        [number],
    ).fetchone()
    conn.commit()
    assert row is not None
    return Job(row[0], number, row[1]), row[2], row[3]


def run(conn: psycopg.Connection, job: Job, km: int, stage: str, error: Exception | None = None) -> None:
    """Do a job whose result is a region."""
    with stage_run(conn, 1, km, stage, {}, job):
        conn.execute(
            "INSERT INTO tunnel.region (survey_id, kind, geom) VALUES (1, 'dry', ST_MakeEnvelope(0, 0, %s, 1, 0))", [km]
        )
        if error is not None:
            raise error


def made(conn: psycopg.Connection) -> list[int]:
    """Kilometres that have a result."""
    rows = conn.execute("SELECT ST_XMax(geom)::int FROM tunnel.region WHERE ST_XMin(geom) = 0 ORDER BY 1").fetchall()
    conn.rollback()
    return [row[0] for row in rows]


def jobs(conn: psycopg.Connection) -> dict[tuple[int, str], str]:
    rows = conn.execute("SELECT (args ->> 'km')::int, args ->> 'stage', status FROM tunnel_queue.procrastinate_jobs").fetchall()
    conn.rollback()
    return {(km, stage): status for km, stage, status in rows}


def test_a_result_and_what_follows_from_it_commit_together(conn: psycopg.Connection, dsn: str, survey: int) -> None:
    number = worker(conn)
    for _ in range(2):
        job, km, stage = take(conn, number)
        assert (km, stage) in ((11, "axis"), (12, "axis"))
        with psycopg.connect(dsn) as other, stage_run(conn, 1, km, stage, {"a": 1}, job) as ran:
            conn.execute(
                "INSERT INTO tunnel.region (survey_id, kind, geom) VALUES (1, 'dry', ST_MakeEnvelope(0,0,%s,1,0))", [km]
            )
            ran.counts["n"] = 7
            assert jobs(other)[km, stage] == "doing"
    assert made(conn) == [11, 12]
    # segments of 11 rest on the axes of 11 and 12; those of 12 wait for 13
    assert jobs(conn) == {(11, "axis"): "succeeded", (12, "axis"): "succeeded", (13, "axis"): "todo", (11, "segments"): "todo"}
    entry = conn.execute("SELECT outcome, counts, parameters, job_id, worker FROM tunnel.run WHERE km = 12 AND stage = 'axis'")
    assert entry.fetchall() == [("done", {"n": 7}, {"a": 1}, job.id, f"{os.uname().nodename}/{os.getpid()}")]


def test_a_failure_leaves_nothing_but_its_reason_and_lets_the_neighbours_go_on(conn: psycopg.Connection, survey: int) -> None:
    number = worker(conn)
    run(conn, *take(conn, number))
    job, km, stage = take(conn, number)
    with pytest.raises(UserError):
        run(conn, job, km, stage, UserError("too few points:\n  add some"))
    assert made(conn) == [11]
    assert jobs(conn)[12, "axis"] == "failed"
    assert jobs(conn)[11, "segments"] == "todo"
    assert one(conn, "SELECT message FROM tunnel.run WHERE outcome = 'failed'") == "too few points: add some"
    assert one(conn, "SELECT message FROM tunnel_internal.queue_state(1) WHERE state = 'failed'") == "too few points: add some"


def test_a_bug_fails_with_its_type(conn: psycopg.Connection, survey: int) -> None:
    job, km, stage = take(conn, worker(conn))
    with pytest.raises(ZeroDivisionError):
        run(conn, job, km, stage, ZeroDivisionError("by zero"))
    assert jobs(conn)[km, stage] == "failed"
    assert one(conn, "SELECT message FROM tunnel.run WHERE outcome = 'failed'") == "ZeroDivisionError: by zero"


def test_what_may_pass_is_tried_again_later_and_later_until_the_sixth_time(conn: psycopg.Connection, survey: int) -> None:
    number = worker(conn)
    waits = []
    for attempt in range(6):
        conn.execute("UPDATE tunnel_queue.procrastinate_jobs SET scheduled_at = NULL")
        job, km, stage = take(conn, number)
        assert (job.attempts, km, stage) == (attempt, 11, "axis")
        with pytest.raises(psycopg.errors.DeadlockDetected):
            run(conn, job, km, stage, psycopg.errors.DeadlockDetected("deadlock"))
        waits.append(one(conn, "SELECT extract(epoch FROM scheduled_at - clock_timestamp())::float FROM tunnel_queue"
                               ".procrastinate_jobs WHERE id = %s AND status = 'todo'", job.id))  # fmt: skip
        conn.commit()
    assert made(conn) == []
    assert waits[-1] is None
    assert jobs(conn)[11, "axis"] == "failed"
    for attempt, wait in enumerate(waits[:-1]):
        assert 0.7 * 2**attempt - 0.7 < wait <= 1.3 * 2**attempt


@pytest.mark.parametrize(
    ("error", "again"),
    [
        (BusyError("busy"), True),
        (psycopg.errors.SerializationFailure(), True),
        (psycopg.errors.LockNotAvailable(), True),
        (UserError("no"), False),
        (psycopg.errors.DiskFull(), False),
        (psycopg.errors.UniqueViolation(), False),
        (KeyError("k"), False),
    ],
)
def test_only_what_may_pass_is_tried_again(error: Exception, again: bool) -> None:
    assert (retry_at(error, 0) is not None) == again
    assert "\n" not in describe(error)


def test_a_kilometre_that_another_program_is_at_is_tried_again(conn: psycopg.Connection, dsn: str, survey: int) -> None:
    job, km, stage = take(conn, worker(conn))
    with psycopg.connect(dsn) as other:
        other.execute("SELECT pg_advisory_xact_lock(1, %s)", [km])
        with pytest.raises(BusyError, match="another process is at work on kilometre 11"):
            run(conn, job, km, stage)
    assert jobs(conn)[km, stage] == "todo"


def test_a_run_by_hand_that_finds_another_at_work_is_no_last_run_that_failed(
    conn: psycopg.Connection, dsn: str, survey: int
) -> None:
    with (
        psycopg.connect(dsn) as second,
        stage_run(conn, 1, 11, "axis", {}) as first,
        pytest.raises(BusyError),
        stage_run(second, 1, 11, "axis", {}),
    ):
        pytest.fail("two are at work")
    found = conn.execute("SELECT id, outcome FROM tunnel.run WHERE survey_id = 1 AND km = 11 AND stage = 'axis'").fetchall()
    assert found == [(first.id, "done")]


def test_a_worker_that_was_cut_off_and_comes_back_cannot_commit(conn: psycopg.Connection, dsn: str, survey: int) -> None:
    lost, other = worker(conn, silent=26), worker(conn)
    job, km, stage = take(conn, lost)
    with psycopg.connect(dsn) as ghost, pytest.raises(LostError), stage_run(ghost, 1, km + 100, stage, {}, job):
        ghost.execute("INSERT INTO tunnel.region (survey_id, kind, geom) VALUES (1, 'dry', ST_MakeEnvelope(0, 0, 999, 1, 0))")
        # as if the server could not end the session
        conn.execute("UPDATE tunnel.run SET backend_pid = 0 WHERE job_id = %s", [job.id])
        assert one(conn, "SELECT tunnel_internal.queue_rescue()") == 1
        conn.commit()
        run(conn, *take(conn, other))
    assert made(conn) == [km]
    assert jobs(conn)[km, stage] == "succeeded"


def test_a_session_of_a_silent_worker_is_ended_and_its_job_taken_over(conn: psycopg.Connection, dsn: str, survey: int) -> None:
    job, km, stage = take(conn, worker(conn, silent=26))
    with psycopg.connect(dsn) as ghost, pytest.raises(psycopg.OperationalError), stage_run(ghost, 1, km, stage, {}, job):
        ghost.execute("SELECT 1")
        assert one(conn, "SELECT tunnel_internal.queue_rescue()") == 1
        conn.commit()
        ghost.execute("SELECT pg_sleep(5)")
    assert jobs(conn)[km, stage] == "todo"
    assert one(conn, "SELECT count(*) FROM tunnel.worker") == 0
    assert one(conn, "SELECT outcome FROM tunnel_api.run WHERE job_id = %s", job.id) == "interrupted"


def test_a_worker_that_was_killed_is_noticed_at_once(conn: psycopg.Connection, dsn: str, survey: int) -> None:
    """Its heartbeat is fresh, but its sessions are gone, with which it stood in the lists."""
    number = worker(conn)
    with psycopg.connect(dsn, autocommit=True) as presence:
        presence.execute("SELECT tunnel_internal.queue_register(%s, 'h', 1)", [number])
        job, km, stage = take(conn, number)
        assert one(conn, "SELECT tunnel_internal.queue_rescue()") == 0
    # its job's session lives on: perhaps only the other one broke
    with psycopg.connect(dsn) as session, stage_run(session, 1, km, stage, {}, job):
        assert _eventually(conn, "SELECT NOT tunnel_internal.queue_present(%s)", number)
        assert one(conn, "SELECT tunnel_internal.queue_rescue()") == 0
        conn.commit()
    assert jobs(conn)[km, stage] == "succeeded"
    job, km, stage = take(conn, number)
    assert one(conn, "SELECT tunnel_internal.queue_rescue()") == 1
    conn.commit()
    assert jobs(conn)[km, stage] == "todo"


def _eventually(conn: psycopg.Connection, query: str, *arguments: Any, seconds: float = 30) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        value = one(conn, query, *arguments)
        conn.rollback()
        if value:
            return True
        time.sleep(0.05)
    return False


def test_a_job_that_kills_its_workers_fails_in_the_end(conn: psycopg.Connection, survey: int) -> None:
    for attempt in range(20):
        job, km, stage = take(conn, worker(conn, silent=60))
        assert (job.attempts, km, stage) == (attempt, 11, "axis")
        assert one(conn, "SELECT tunnel_internal.queue_rescue()") == 1
        conn.commit()
    assert jobs(conn)[11, "axis"] == "failed"
    message = one(conn, "SELECT message FROM tunnel_internal.queue_state(1) WHERE km = 11 AND state = 'failed'")
    assert "went down 20 times" in message


def test_a_run_that_began_before_its_input_was_committed_is_stale(conn: psycopg.Connection, dsn: str, survey: int) -> None:
    """It waits with its beginning until the other has committed, or bears an earlier time than the other's end."""
    with psycopg.connect(dsn) as first, psycopg.connect(dsn) as second:
        with stage_run(first, 1, 12, "load", {}), stage_run(second, 1, 11, "axis", {}):
            pass
        with stage_run(first, 1, 12, "axis", {}):
            pass
    # the axis of 11 ended before load of 12 did, on which it rests
    rows = conn.execute("SELECT km, stage, reason FROM tunnel_api.stage_status WHERE stale ORDER BY km, step").fetchall()
    assert rows == [(11, "axis", "load of kilometre 12 ran since")]


# --- with worker processes ------------------------------------------------------------------------------------------------

NAME = "curve"


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """80 m of a tunnel at survey density, over a kilometre's border."""
    folder = tmp_path_factory.mktemp("scans")
    write(
        Simulation(
            Parameters(
                name=NAME, section="circular", seed=3, length=80.0, start_chainage=960.0, radius=300.0, straight=0.0,
                slope=4.0, scanner="profiler", density=100.0, leaks=0,
            )
        ),
        folder,
    )  # fmt: skip
    return folder


@pytest.fixture(scope="module")
def added(copies: Copies, template: str, scans: Path) -> Iterator[str]:
    """A database with tunnel and survey, to be copied."""

    def fill() -> None:
        command(0, "tunnel", "add", NAME, "--srid", 25830, "--axis", scans / f"{NAME}.axis.csv", "--start-chainage", 960)
        command(
            0, "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04",
            "--trajectory", scans / f"{NAME}.trajectory.csv", "--intensity", "Amplitude", "--intensity-kind", "reflectance",
        )  # fmt: skip

    with copies.prepared(template, fill) as name:
        yield name


@pytest.fixture
def dsn(request: pytest.FixtureRequest, copies: Copies, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """DSN of a database with what the test asks for: a tunnel and its survey, the example, or neither."""
    sources = {"curve": "added", "example": "example_template"}
    source = next((of for name, of in sources.items() if name in request.fixturenames), "template")
    with copies.copy(request.getfixturevalue(source)) as fresh:
        monkeypatch.setenv("TUNNELDB_DSN", fresh)
        yield fresh


@pytest.fixture
def curve(dsn: str) -> str:
    """Name of a survey to which nothing was loaded yet."""
    return NAME


def command(code: int, *arguments: object) -> str:
    """Run a command in this process; workers are processes of their own."""
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture
def spawn() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start commands as processes, which are killed at the end."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: object) -> subprocess.Popen[str]:
        words = [sys.executable, "-c", "from tunneldb.cli.main import main; main()", *map(str, arguments)]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_a_batch_goes_from_files_to_sections(conn: psycopg.Connection, curve: str, scans: Path) -> None:
    output = command(0, "batch", curve, scans / f"{NAME}.laz", "--to", "sections", "--workers", 2)
    assert "2 of 2 kilometres done" in output
    runs = conn.execute("SELECT stage, count(*), count(job_id) FROM tunnel.run WHERE outcome = 'done' GROUP BY 1").fetchall()
    conn.rollback()
    assert sorted(runs) == [("axis", 2, 2), ("load", 2, 2), ("read", 1, 1), ("sections", 2, 2), ("segments", 2, 2)]
    assert conn.execute("SELECT stage FROM tunnel_api.stage_status WHERE stale").fetchall() == []
    assert one(conn, "SELECT count(*) FROM tunnel.incoming") == 0
    conn.rollback()
    # once more, with the same file and without: nothing is left to be done
    before = one(conn, "SELECT count(*) FROM tunnel.run")
    conn.rollback()
    assert "2 of 2 kilometres done" in command(0, "batch", curve, scans / f"{NAME}.laz", "--to", "sections")
    assert "2 of 2 kilometres done" in command(0, "batch", curve)
    assert one(conn, "SELECT count(*) FROM tunnel.run") == before


def test_a_killed_worker_is_replaced_and_its_job_done(
    conn: psycopg.Connection, dsn: str, curve: str, scans: Path, spawn: Callable[..., subprocess.Popen[str]]
) -> None:
    with psycopg.connect(dsn) as other:
        # the stage waits in the middle of its work, as it writes
        other.execute("LOCK TABLE tunnel.axis_vertex IN SHARE MODE")
        batch = spawn("batch", curve, scans / f"{NAME}.laz", "--to", "axis", "--workers", 1)
        assert _eventually(conn, "SELECT count(*) FROM tunnel.run WHERE stage = 'axis' AND outcome = 'running'", seconds=60)
        pid = int(one(conn, "SELECT worker FROM tunnel.run WHERE stage = 'axis'").split("/")[1])
        conn.rollback()
        os.kill(pid, signal.SIGKILL)
    output, _ = batch.communicate(timeout=120)
    assert batch.returncode == 0, output
    assert "2 of 2 kilometres done" in output
    workers = conn.execute("SELECT DISTINCT worker FROM tunnel.run WHERE stage = 'axis' AND outcome = 'done'").fetchall()
    assert str(pid) not in str(workers)
    assert one(conn, "SELECT count(*) FROM tunnel.worker") == 0


def test_two_batches_share_the_work_and_end_together(
    conn: psycopg.Connection, curve: str, scans: Path, spawn: Callable[..., subprocess.Popen[str]]
) -> None:
    batches = [spawn("batch", curve, scans / f"{NAME}.laz", "--to", "segments", "--workers", 1) for _ in range(2)]
    for batch in batches:
        output, _ = batch.communicate(timeout=120)
        assert batch.returncode == 0, output
        assert "2 of 2 kilometres done" in output
    runs = conn.execute("SELECT stage, km, count(*) FROM tunnel.run WHERE km IS NOT NULL GROUP BY 1, 2").fetchall()
    assert {count for *_, count in runs} == {1}
    assert len(runs) == 6


def test_workers_are_asked_to_stop_and_what_is_wanted_stays_wanted(
    conn: psycopg.Connection, curve: str, scans: Path, spawn: Callable[..., subprocess.Popen[str]]
) -> None:
    worker = spawn("worker", "--concurrency", 2)
    assert _eventually(conn, "SELECT count(*) = 2 FROM tunnel.worker", seconds=60)
    assert "2 workers asked to stop" in command(0, "stop", "--wait")
    assert one(conn, "SELECT count(*) FROM tunnel.worker") == 0
    assert worker.wait(timeout=30) == 0
    assert one(conn, "SELECT count(*) FROM tunnel_queue.procrastinate_workers") == 0


def test_workers_end_with_their_parent(conn: psycopg.Connection, dsn: str, spawn: Callable[..., subprocess.Popen[str]]) -> None:
    worker = spawn("worker", "--concurrency", 2)
    assert _eventually(conn, "SELECT count(*) = 2 FROM tunnel.worker", seconds=60)
    worker.kill()
    assert _eventually(conn, "SELECT count(*) = 0 FROM pg_stat_activity WHERE application_name = 'tunneldb worker'")
    assert "0 workers asked to stop" in command(0, "stop", "--wait")


def test_a_bad_file_fails_by_itself(conn: psycopg.Connection, curve: str, scans: Path, tmp_path: Path) -> None:
    torn = tmp_path / "torn.laz"
    torn.write_bytes((scans / f"{NAME}.laz").read_bytes()[:2000])
    blank = tmp_path / "blank.laz"
    blank.write_bytes(b"nothing")
    output = command(1, "batch", curve, scans / f"{NAME}.laz", blank, "--to", "load", "--workers", 1)
    assert "2 of 2 kilometres done" in output
    assert "blank.laz: truncated, corrupt or not a LAS or LAZ file" in output
    # one whose header promises points that are not there holds up the kilometres in which it must have some
    output = command(1, "batch", curve, torn, "--to", "axis", "--workers", 1)
    assert "2 of 2 kilometres done" not in output
    assert "torn.laz: truncated" in output
    torn.write_bytes((scans / f"{NAME}.laz").read_bytes())
    blank.unlink()
    output = command(1, "batch", curve, "--retry-failed", "--to", "axis", "--workers", 1)
    assert "2 of 2 kilometres done" in output  # and blank.laz, which is gone, stays failed
    assert "blank.laz" in output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["batch", "nowhere", "x.laz"], "there is no survey 'nowhere'"),
        (["batch", NAME], "has nothing to do"),
        (["batch", NAME, "missing.laz"], "there is no such file"),
        (["batch", NAME, "{scan}", "missing.laz"], "there is no such file"),
        (["batch", NAME, "{scan}", "--to", "leaks"], "unknown stage 'leaks'"),
        (["batch", NAME, "{scan}", "--km", "2-1"], "runs backwards"),
        (["batch", NAME, "{scan}", "--km", "7-8"], "has nothing to do in kilometres 7-8"),
        (["batch", NAME, "{scan}", "--set", "axis.speed=1"], "unknown parameter 'axis.speed'"),
        (["batch", NAME, "{scan}", "--density", "0"], "--density takes points per m²"),
        (["batch", NAME, "{scan}", "{scan}"], "have the same name"),
    ],
)
def test_what_cannot_be_begun_registers_nothing(
    conn: psycopg.Connection, curve: str, scans: Path, arguments: list[str], said: str
) -> None:
    output = command(2, *[word.format(scan=scans / f"{NAME}.laz") for word in arguments])
    assert said in output
    assert output.count("\n") == 1
    assert one(conn, "SELECT count(*) FROM tunnel.incoming") + one(conn, "SELECT count(*) FROM tunnel.goal") == 0
