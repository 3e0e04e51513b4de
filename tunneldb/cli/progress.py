"""Progress of a command: a bar with rate and time left on a terminal, nothing in a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.output import is_quiet, log, printable

if TYPE_CHECKING:
    import psycopg
    from rich.console import RenderableType
    from rich.progress import Progress

    from tunneldb.progress import StartProgress

_REMEMBERED = 600.0  # time over which the rate is taken, s: steps of a kilometre come minutes apart
_PATIENCE = 1.0  # time that Numba may compile unmentioned, s: on first use it is a minute or two, later nothing


def bar(unit: str) -> Progress:
    """Return a bar on stderr that shows share, rate and time left; nothing where stderr is no terminal.

    Parameters
    ----------
    unit : str
        What is counted, in the plural: ``points``, ``km``.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        ProgressColumn,
        SpinnerColumn,
        Task,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Rate(ProgressColumn):
        """Counts a second, or a minute where they are few."""

        def render(self, task: Task) -> Text:
            # rich knows a speed from the second count on; what comes in one count has taken all the time so far
            speed = task.finished_speed or task.speed or (task.completed / task.elapsed if task.elapsed else None)
            return Text(rate(speed, unit), "progress.data.speed")

    class Left(TimeRemainingColumn):
        """Time left, where it can be known at all."""

        def render(self, task: Task) -> Text:
            return Text() if task.total is None else super().render(task).append(" left", "")

    class Bar(Progress):
        """A bar that says, once, when the program stands still to compile."""

        def get_renderables(self) -> Iterable[RenderableType]:
            if not self.disable:  # rich asks once in any case
                notice.attach()  # here, for Numba may be imported when the bar is drawn already
            yield from super().get_renderables()

    columns = (
        SpinnerColumn("line"), TextColumn("{task.description}", markup=False), BarColumn(bar_width=24), TaskProgressColumn(),
        Rate(), Left(),
    )  # fmt: skip
    console = Console(stderr=True)
    notice = _Notice(console.print)
    return Bar(
        *columns,
        console=console,
        transient=True,
        disable=not console.is_terminal or is_quiet(),
        speed_estimate_period=_REMEMBERED,
        redirect_stdout=sys.stdout.isatty(),  # else rich would take to the terminal what is meant for the pipe
    )


class _Notice:
    """Tells that Numba compiles, which it does once for an installation: it keeps what it has compiled.

    Parameters
    ----------
    say : callable
        Takes the text.
    """

    def __init__(self, say: Callable[[str], object]) -> None:
        self.say = say
        self.attached = self.said = False
        self.depth = 0
        self.since = self.seconds = 0.0

    def attach(self) -> None:
        """Let Numba report, as soon as it is there: to import it for this would cost who does not need it."""
        event = sys.modules.get("numba.core.event")
        if self.attached or event is None or not hasattr(event, "Listener"):
            return
        told = {"on_start": lambda *_: self.count(1), "on_end": lambda *_: self.count(-1)}
        event.register("numba:compile", type("Compiling", (event.Listener,), told)())
        self.attached = True

    def count(self, step: int) -> None:
        """Count a function whose compilation begins (1) or ends (-1) inside others."""
        now = time.monotonic()
        self.seconds += now - self.since if self.depth else 0.0
        self.since = now
        self.depth = max(self.depth + step, 0)  # what began before this was attached ends without a beginning
        if self.seconds > _PATIENCE and not self.said:
            self.said = True
            self.say("compiling, on first use only: takes a minute or two")


def step(progress: Progress) -> StartProgress:
    """Show one step at a time: what it returns takes a text and a total, None if unknown, and returns what takes the counts."""

    def begin(text: str, total: float | None) -> Callable[[float], None]:
        progress.refresh()  # else the end of a short step would never be seen
        for task in progress.task_ids:
            progress.remove_task(task)
        task = progress.add_task(printable(text), total=total)
        return lambda count: progress.advance(task, count)

    return begin


def say(text: str, *, err: bool = False) -> None:
    """Print a line while a bar is shown: above it. By itself click goes past what rich has put before the terminal."""
    if err:
        log.info("%s", text)
    if not (err and is_quiet()):
        click.echo("\n".join(map(printable, text.split("\n"))), file=sys.stderr if err else sys.stdout)


_ENDINGS = ("57P01", "57P02", "55P03")
"""Warnings with which the server ends a session, which the next error says, and of locks, which are logged (`WAITS`)."""


def tell_warnings(connection: psycopg.Connection[Any]) -> None:
    """Say from now on what the database's functions warn of."""
    connection.add_notice_handler(
        lambda notice: (
            say(f"tunneldb: {notice.message_primary}", err=True)
            if notice.severity_nonlocalized == "WARNING" and notice.sqlstate not in _ENDINGS
            else None
        )
    )


def rate(speed: float | None, unit: str) -> str:
    """Return a rate as text, from counts a second: ``1.2 million points/s``, ``3.5 km/min``; empty when it is unknown."""
    if not speed:
        return ""
    if speed >= 1e6:
        return f"{speed / 1e6:.1f} million {unit}/s"
    if speed >= 1.0:
        return f"{speed:,.0f} {unit}/s".replace(",", " ")
    return f"{60.0 * speed:.1f} {unit}/min" if speed >= 1.0 / 60.0 else f"{3600.0 * speed:.1f} {unit}/h"
