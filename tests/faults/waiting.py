"""Waiting for what is to come to pass in a project."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable

from faults.project import Project

PATIENCE = 180.0
"""Seconds, far more than anything takes."""

INTERVAL = 0.2
"""Seconds between two looks: each takes from what is waited for."""


def wait_for(project: Project, what: Callable[[], object], process: subprocess.Popen[bytes] | None = None) -> None:
    """Wait until something is true, while a process goes on."""
    end = time.monotonic() + PATIENCE
    while not what():
        assert time.monotonic() < end, project.said("worker.log")[-3000:]
        assert process is None or process.poll() is None, project.said("worker.log")[-3000:]
        time.sleep(INTERVAL)


def done(project: Project) -> bool:
    """Whether nothing is left of what was asked for that can be done."""
    idle, wanted = project.ask("SELECT NOT tunnel_internal.queue_busy(1), count(*) FROM tunnel.goal")
    return bool(idle) and wanted > 0


def running(project: Project) -> int:
    """How many stages of kilometres are being done."""
    (count,) = project.ask("SELECT count(*) FROM tunnel_api.run WHERE outcome = 'running' AND stage <> 'read'")
    return int(count)
