"""A worker under which the server goes down."""

from __future__ import annotations

import signal

import pytest
from faults.conftest import Survey
from faults.killer import backends, postmaster, workers
from faults.project import differences, register, runs, state
from faults.waiting import done, running, wait_for

pytestmark = pytest.mark.xdist_group("short")


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
