"""Two batches of the same survey at once, and a worker under which the server goes down."""

from __future__ import annotations

import signal

from faults.conftest import Survey
from faults.killer import backends, postmaster, workers
from faults.project import batch, differences, register, runs, state
from faults.waiting import done, running, wait_for


def test_worker_outlives_the_server(short: Survey) -> None:
    """One that is told where the database is waits for it to be started again, and goes on."""
    short.project.fresh()
    register(short.project, short.files)
    worker = short.project.begin("--dsn", short.project.dsn, "worker", log="worker.log")
    wait_for(short.project, lambda: running(short.project), worker)
    server = postmaster(short.project)
    assert server is not None
    orphans = backends(short.project)
    server.send_signal(signal.SIGKILL)
    wait_for(short.project, lambda: not any(process.is_running() for process in orphans), worker)
    assert len(workers(short.project)) == 1
    short.project.run("server", "start")
    wait_for(short.project, lambda: done(short.project), worker)
    short.project.run("stop", "--wait")
    assert worker.wait(60) == 0
    assert differences(short.undisturbed, state(short.project)) == []
    assert [row for row in runs(short.project) if row[3] != 1] == []


def test_two_batches_at_once(short: Survey) -> None:
    short.project.fresh()
    both = [short.project.begin(*batch(short.files, workers=1), log=f"batch-{n}.log") for n in (1, 2)]
    codes = [process.wait(300) for process in both]
    assert codes == [0, 0], short.project.said("batch-1.log") + short.project.said("batch-2.log")
    assert differences(short.undisturbed, state(short.project)) == []
    assert [row for row in runs(short.project) if row[3] != 1] == []
