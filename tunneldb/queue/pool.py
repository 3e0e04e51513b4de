"""Worker processes of one command: start, restart after a crash, and exit."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType

from tunneldb.errors import UserError
from tunneldb.queue.worker import Orders

_ENDED = (0, 2)  # exit codes of a worker that ended by itself: done, or given up
_MIN_LIFETIME = 30.0  # s; a worker that dies sooner is restarted with a delay


@dataclass
class _Member:
    process: subprocess.Popen[bytes]
    started: float
    falls: int = 0


@dataclass
class WorkerPool:
    """Pool of worker processes.

    Parameters
    ----------
    orders : Orders
        Orders for each worker.
    size : int
        Number of workers.
    """

    orders: Orders
    size: int
    members: list[_Member] = field(default_factory=list)
    leaving: bool = False

    def start(self) -> None:
        """Start the workers."""
        self.members = [_Member(self._launch(), time.monotonic()) for _ in range(self.size)]

    def tend(self) -> bool:
        """Restart workers that died; return True if any is still running.

        Raises
        ------
        UserError
            If a worker gave up, for a reason that it has printed.
        """
        for member in list(self.members):
            code = member.process.poll()
            if code is None:
                continue
            if code in _ENDED or self.leaving:
                self.members.remove(member)
                if code == 2:
                    self.leave()
                    raise UserError("a worker gave up: its error is above; remove the cause, and type the command again")
                continue
            lived = time.monotonic() - member.started
            if lived > min(2.0**member.falls, _MIN_LIFETIME):
                falls = 0 if lived > _MIN_LIFETIME else member.falls + 1
                self.members[self.members.index(member)] = _Member(self._launch(), time.monotonic(), falls)
        return bool(self.members)

    def rest(self, seconds: float) -> None:
        """Wait, but no longer than until all workers have exited by themselves."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and any(member.process.poll() not in _ENDED for member in self.members):
            time.sleep(0.05)

    def leave(self) -> None:
        """Ask the workers to finish their current job and exit; if asked again, they exit at once."""
        for member in self.members:
            if member.process.poll() is None:
                member.process.send_signal(signal.SIGKILL if self.leaving else signal.SIGTERM)
        self.leaving = True

    def _launch(self) -> subprocess.Popen[bytes]:
        orders = json.dumps({"threads": self.orders.threads, "survey": self.orders.survey})
        environment = dict(os.environ)
        environment["TUNNELDB_DSN"] = self.orders.dsn or ""
        # The pipe stays open while this process runs; a session of its own protects it from the terminal's Ctrl-C.
        process = subprocess.Popen(
            [sys.executable, "-m", "tunneldb.queue.worker", orders],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        threading.Thread(target=_pass_on, args=(process,), daemon=True).start()
        return process


def _pass_on(process: subprocess.Popen[bytes]) -> None:
    """Forward a worker's messages to this process's stderr, so that a table on the terminal makes way for them."""
    assert process.stdout is not None
    for line in process.stdout:
        print(line.decode(errors="replace"), end="", file=sys.stderr, flush=True)


@contextmanager
def interrupts(team: WorkerPool) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM ask the workers to exit, at once on the second signal."""

    def ask(number: int, frame: FrameType | None) -> None:
        team.leave()

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        while team.members:
            if not team.leaving:
                team.leave()
            team.tend()
            time.sleep(0.05)
