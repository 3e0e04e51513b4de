"""Kills at random moments while a batch runs, and readers meanwhile."""

from __future__ import annotations

import random
import signal
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

import psutil
import psycopg
from faults.project import Project

PAUSE = (0.1, 4.0)
"""Least and greatest time between two kills, s."""

KINDS = ("worker", "worker", "worker", "batch", "server", "backend", "machine")
"""What is killed in seven kills: a worker, the command, PostgreSQL's first process, that of a session, or all at once."""

PATIENCE = 900.0
"""Seconds within which a batch ends after the last kill; far more than it takes."""


def workers(project: Project) -> list[psutil.Process]:
    """Worker processes of a project's commands."""
    return [p for p in _own(project) if "tunneldb.queue.worker" in _line(p)]


def postmaster(project: Project) -> psutil.Process | None:
    """PostgreSQL's first process, if it runs."""
    try:
        pid = int((project.home / "cluster" / "postmaster.pid").read_text().split("\n", 1)[0])
        process = psutil.Process(pid)
    except (OSError, ValueError, psutil.Error):
        return None
    return process if "postgres" in _line(process) else None


def backends(project: Project) -> list[psutil.Process]:
    """Server processes of sessions."""
    first = postmaster(project)
    with suppress(psutil.Error):
        return [p for p in first.children() if "[local]" in _line(p)] if first else []
    return []


def _own(project: Project) -> Iterator[psutil.Process]:
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if "python" in process.name() and process.environ().get("TUNNELDB_HOME") == str(project.home):
                yield process


def _line(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""


@dataclass
class Killer:
    """Runs a batch to its end, killing something now and then; types the command again as its user would.

    Parameters
    ----------
    project : Project
    arguments : sequence
        The command.
    chance : random.Random
        What decides when and what.
    """

    project: Project
    arguments: Sequence[object]
    chance: random.Random
    killed: Counter[str] = field(default_factory=Counter)
    typed: int = 0
    deck: list[str] = field(default_factory=list)

    def run(self, kills: int) -> Iterator[str]:
        """Run the batch to its end with at most so many kills; yields what is killed."""
        limit = self.typed + 3 * kills + 10
        process = self._type()
        due = self._next()
        try:
            while time.monotonic() < due + PATIENCE:
                code = process.poll()
                if code == 0:
                    return
                if code is not None:
                    assert code != 1, f"something failed: {self.project.said()[-3000:]}"
                    assert self.typed < limit, f"it does not come to an end: {self.project.said()[-3000:]}"
                    process = self._type()
                if kills and time.monotonic() > due:
                    kind = self._kill(process)
                    if kind is not None:
                        kills -= 1
                        due = self._next()
                        yield kind
                time.sleep(0.02)
            raise AssertionError(f"it hangs: {self.project.said()[-3000:]}")
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()

    def _type(self) -> subprocess.Popen[bytes]:
        self.typed += 1
        return self.project.begin(*self.arguments)

    def _next(self) -> float:
        return time.monotonic() + self.chance.uniform(*PAUSE)

    def _kill(self, command: subprocess.Popen[bytes]) -> str | None:
        if not self.deck:
            self.deck = self.chance.sample(KINDS, len(KINDS))
        kind = self.deck[-1]
        first = postmaster(self.project)
        every = {
            "batch": [psutil.Process(command.pid)] if command.poll() is None else [],
            "worker": workers(self.project),
            "server": [first] if first else [],
            "backend": backends(self.project),
        }
        if kind == "machine":
            victims = [process for processes in every.values() for process in processes]
        else:
            victims = self.chance.sample(every[kind], min(1, len(every[kind])))
        if not victims:
            return None
        for process in victims:
            with suppress(psutil.NoSuchProcess):
                process.send_signal(signal.SIGKILL)
        self.killed[self.deck.pop()] += 1
        return kind


@dataclass
class Seen:
    """What readers saw: of each kilometre, how many points it had and how many of them were in a segment."""

    points: set[tuple[int, int, int]] = field(default_factory=set)
    reads: int = 0
    broken: list[str] = field(default_factory=list)


@contextmanager
def reading(project: Project, kilometres: Sequence[int]) -> Iterator[Seen]:
    """Keep asking for whole kilometres and for leaks; a server that is away is waited for."""
    seen, end = Seen(), threading.Event()
    reader = threading.Thread(target=_read, args=(project, kilometres, seen, end))
    reader.start()
    try:
        yield seen
    finally:
        end.set()
        reader.join()


def _read(project: Project, kilometres: Sequence[int], seen: Seen, end: threading.Event) -> None:
    chance = random.Random(0)
    while not end.is_set():
        try:
            with project.connect() as conn:
                while not end.is_set():
                    km = chance.choice(kilometres)
                    row = conn.execute(
                        "SELECT count(*), count(segment) FROM tunnel_api.point WHERE survey_id = 1 AND km = %s", [km]
                    ).fetchone()
                    assert row is not None
                    seen.points.add((km, *row))
                    conn.execute("SELECT count(*), sum(area) FROM tunnel_api.leak").fetchone()
                    conn.execute("SELECT count(*) FROM tunnel_api.stage_status WHERE stale").fetchone()
                    seen.reads += 1
                    end.wait(0.2)
        except psycopg.OperationalError as error:
            # Away, or on its way down or up; anything else is no fault of the server's being killed.
            if error.sqlstate and not error.sqlstate.startswith(("08", "57P")):
                seen.broken.append(f"{error.sqlstate} {error}")
            end.wait(0.2)
        except psycopg.Error as error:
            seen.broken.append(f"{error.sqlstate} {error}")


def whole(seen: Seen, points: dict[int, tuple[int, int]]) -> list[str]:
    """What readers saw that is neither nothing nor a whole kilometre, before or after its points were tagged."""
    allowed = {(km, *held) for km, (all_, tagged) in points.items() for held in ((0, 0), (all_, 0), (all_, tagged))}
    return [*seen.broken, *(f"kilometre {km}: {n} points, {tagged} tagged" for km, n, tagged in seen.points - allowed)]
