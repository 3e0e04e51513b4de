"""Watching a survey: a picture that is drawn again and again on a terminal, lines of what changed in a pipe."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any

import psycopg
from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from tunneldb.cli.overview import duration, render, summary
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.queue.progress import Overview, overview
from tunneldb.queue.watching import list_ended_runs, server_time


class Watch:
    """Looks at a survey and shows it; a context manager.

    A connection that breaks, as when the server is restarted, is made again at the next look.

    Parameters
    ----------
    dsn : str or None
        Database; None means the embedded server.
    survey : str
        Name of a survey that exists.
    console : Console, optional
        Where to show it; stdout without it.
    """

    def __init__(self, dsn: str | None, survey: str, console: Console | None = None) -> None:
        self.dsn, self.survey = dsn, survey
        self.console = console or Console()
        self.live = Live(console=self.console, auto_refresh=False) if self.console.is_terminal else None
        self.seen: Overview | None = None
        self.ledger: Ledger | None = None
        self.conn: psycopg.Connection[Any] | None = None
        self.away = False

    def __enter__(self) -> Watch:
        if self.live is not None:
            self.live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.live is not None:
            self.live.stop()
        if self.conn is not None:
            self.conn.close()

    def look(self) -> bool:
        """Look once and show what is to be seen.

        Returns
        -------
        bool
            Whether something is left that is done without anybody typing anything; also as long as the database is away.
        """
        try:
            if self.conn is None:
                self.conn = connect(self.dsn)
            if self.ledger is None:
                self.ledger = Ledger(self.conn, self.survey)
            seen = overview(self.conn, self.survey)
            ended = self.ledger.ended(self.conn)
            self.conn.rollback()
        except (psycopg.OperationalError, UserError) as error:
            if self.seen is None:
                raise
            self._lose(str(error).strip().split("\n", 1)[0])
            return True
        if self.live is not None:
            self.live.update(
                Group(Text(f"{seen.survey} at {seen.now.astimezone():%H:%M:%S}", "bold"), render(seen)), refresh=True
            )
        else:
            self._print(seen, ended)
        self.seen, self.away = seen, False
        return seen.active

    def _lose(self, message: str) -> None:
        if self.conn is not None:
            self.conn.close()
            self.conn = None
        text = f"the database is away, trying again: {message}"
        if self.live is not None and self.seen is not None:
            self.live.update(Group(render(self.seen), Text(text, "red")), refresh=True)
        elif not self.away:
            self._say(text)
        self.away = True

    def _print(self, seen: Overview, ended: list[tuple[bool, str]]) -> None:
        count = max(seen.done - sum(done for done, _ in ended), 0)
        for done, line in ended:
            count += done
            self._say(f"[{count}/{seen.total}] {line}")
        for line in changes(self.seen, seen) if self.seen is not None else ():
            self._say(line)
        if self.seen is None or self.seen.active != seen.active:
            text = summary(seen)
            if text is not None:
                self._say(text.plain)

    def _say(self, line: str) -> None:
        print(line, file=self.console.file, flush=True)


def watch(dsn: str | None, survey: str, interval: float, until: Callable[[], bool] | None = None) -> None:
    """Show a survey until nothing is left to do.

    Parameters
    ----------
    dsn, survey
        As for `Watch`.
    interval : float
        Time between looks, s.
    until : callable, optional
        Asked after each look in place of whether anything is left to do: True ends the watching, after one more look.
    """
    with Watch(dsn, survey) as watcher:
        while True:
            active = watcher.look()
            if until() if until is not None else not active:
                break
            time.sleep(interval)
        if until is not None:
            watcher.look()


class Ledger:
    """Runs of a survey that have ended since this was made, each told once.

    Parameters
    ----------
    conn : Connection
    survey : str
        Name of a survey that exists.

    Attributes
    ----------
    points : int
        Points of the files that were read since.
    """

    def __init__(self, conn: psycopg.Connection[Any], survey: str) -> None:
        self.survey = survey
        self.points = 0
        self.told = server_time(conn)

    def ended(self, conn: psycopg.Connection[Any]) -> list[tuple[bool, str]]:
        """Return whether it was a stage of a kilometre that is done, and a line, for each."""
        rows = list_ended_runs(conn, self.survey, self.told)
        lines = []
        for stage, what, outcome, message, seconds, finished_at, of_km, points in rows:
            said = f"{seconds:.1f} s" if outcome == "done" else f"{outcome}: {message}"
            lines.append((of_km and outcome == "done", f"{stage} {what}: {said}"))
            self.points += points if stage == "read" else 0
            self.told = finished_at
        return lines


def changes(before: Overview, after: Overview) -> Iterator[str]:
    """Yield a line for each stage that was begun between two looks, and each worker that came or went."""
    for km, cells in after.kilometres.items():
        for stage, cell in cells.items():
            was = before.kilometres.get(km, {}).get(stage)
            if cell.state == "running" and (was is None or was.state != "running"):
                yield f"{stage} km {km}: begun" + (f" on {cell.worker}" if cell.worker else "")
    there = {(worker.host, worker.pid): worker for worker in before.workers}
    for worker in after.workers:
        former = there.pop((worker.host, worker.pid), None)
        if former is None:
            yield f"worker {worker.host}/{worker.pid} came"
        elif worker.lost and not former.lost:
            yield f"worker {worker.host}/{worker.pid} has been silent for {duration(worker.silent)}"
    for host, pid in there:
        yield f"worker {host}/{pid} left"
