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
from tunneldb.job.overview import STAGES, Overview, overview


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
            seen = overview(self.conn, self.survey)
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
            self._print(seen)
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

    def _print(self, seen: Overview) -> None:
        lines = changes(self.seen, seen) if self.seen is not None else iter(())
        for line in lines:
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


def changes(before: Overview, after: Overview) -> Iterator[str]:
    """Yield a line for each thing that has come to pass between two looks at a survey, numbered by the steps done."""
    lines = [*_files(before, after), *_cells(before, after), *_workers(before, after)]
    count = after.done - sum(done for done, _ in lines)
    for done, line in lines:
        count += done
        yield f"[{max(count, 0)}/{after.total}] {line}"


def _files(before: Overview, after: Overview) -> Iterator[tuple[bool, str]]:
    there = {file.name for file in after.files}
    states = {file.name: file.state for file in before.files}
    for file in before.files:
        if file.name not in there and file.state != "failed":
            yield False, f"{file.name}: read"
    for file in after.files:
        if file.state == "failed" and states.get(file.name) != "failed":
            yield False, f"{file.name}: failed: {file.message}"


def _cells(before: Overview, after: Overview) -> Iterator[tuple[bool, str]]:
    """Yield whether a stage was done, and the line of it."""
    for km, cells in after.kilometres.items():
        for stage in STAGES:
            cell, was = cells[stage], before.kilometres.get(km, {}).get(stage)
            if cell.state == (was.state if was is not None else "done"):
                continue
            if cell.state == "done":
                took = f" in {duration((after.now - was.since).total_seconds())}" if was is not None and was.since else ""
                yield True, f"km {km} {stage}: done{took}"
            elif cell.state == "running":
                yield False, f"km {km} {stage}: running" + (f" on {cell.worker}" if cell.worker else "")
            elif cell.state in ("failed", "interrupted"):
                yield False, f"km {km} {stage}: {cell.state}: {cell.reason}"


def _workers(before: Overview, after: Overview) -> Iterator[tuple[bool, str]]:
    there = {(worker.host, worker.pid): worker for worker in before.workers}
    for worker in after.workers:
        former = there.pop((worker.host, worker.pid), None)
        if former is None:
            yield False, f"worker {worker.host}/{worker.pid} came"
        elif worker.lost and not former.lost:
            yield False, f"worker {worker.host}/{worker.pid} has been silent for {duration(worker.silent)}"
    for host, pid in there:
        yield False, f"worker {host}/{pid} left"
