"""Two batches of the same survey at once, and a worker under which the server goes down."""

from __future__ import annotations

import signal

from faults.conftest import Survey
from faults.killer import backends, postmaster, workers
from faults.project import batch, differences, register, runs, state
from faults.waiting import done, running, wait_for


def test_worker_outlives_the_server(survey: Survey) -> None:
    """One that is told where the database is waits for it to be started again, and goes on."""
    survey.project.fresh()
    register(survey.project, survey.files)
    worker = survey.project.begin("--dsn", survey.project.dsn, "worker", log="worker.log")
    wait_for(survey.project, lambda: running(survey.project), worker)
    server = postmaster(survey.project)
    assert server is not None
    orphans = backends(survey.project)
    server.send_signal(signal.SIGKILL)
    wait_for(survey.project, lambda: not any(process.is_running() for process in orphans), worker)
    assert len(workers(survey.project)) == 1
    survey.project.run("server", "start")
    wait_for(survey.project, lambda: done(survey.project), worker)
    survey.project.run("stop", "--wait")
    assert worker.wait(60) == 0
    assert differences(survey.undisturbed, state(survey.project)) == []
    assert [row for row in runs(survey.project) if row[3] != 1] == []


def test_two_batches_at_once(survey: Survey) -> None:
    survey.project.fresh()
    both = [survey.project.begin(*batch(survey.files, workers=1), log=f"batch-{n}.log") for n in (1, 2)]
    codes = [process.wait(300) for process in both]
    assert codes == [0, 0], survey.project.said("batch-1.log") + survey.project.said("batch-2.log")
    assert differences(survey.undisturbed, state(survey.project)) == []
    assert [row for row in runs(survey.project) if row[3] != 1] == []
