"""How far a verb has come: a bar on the terminal with rate and time left, nothing in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

_REMEMBERED = 600.0  # time over which the rate is taken, s: steps of a kilometre come minutes apart


def bar(unit: str) -> Progress:
    """Return a bar on stderr that shows share, rate and time left; nothing where stderr is no terminal.

    Parameters
    ----------
    unit : str
        What is counted, in the plural: ``points``, ``km``. Empty when the counts mean nothing: no rate is shown then.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.text import Text

    class Rate(ProgressColumn):
        """Counts a second, or a minute where they are few."""

        def render(self, task: Task) -> Text:
            # rich knows a speed from the second count on; what comes in one count has taken all the time so far
            speed = task.finished_speed or task.speed or (task.completed / task.elapsed if task.elapsed else None)
            return Text(rate(speed, unit), "progress.data.speed")

    columns = (
        TextColumn("{task.description}"), BarColumn(bar_width=24), TaskProgressColumn(), Rate(), TimeRemainingColumn(),
        TextColumn("left"),
    )  # fmt: skip
    console = Console(stderr=True)
    return Progress(
        *columns,
        console=console,
        transient=True,
        disable=not console.is_terminal,
        speed_estimate_period=_REMEMBERED,
        redirect_stdout=sys.stdout.isatty(),  # else rich would take to the terminal what is meant for the pipe
    )


def step(progress: Progress) -> Callable[[str, float], Callable[[float], None]]:
    """Show one step at a time: what it returns takes a text and a total, and returns what takes the counts."""

    def begin(text: str, total: float) -> Callable[[float], None]:
        for task in progress.task_ids:
            progress.remove_task(task)
        task = progress.add_task(text, total=total)
        return lambda count: progress.advance(task, count)

    return begin


def rate(speed: float | None, unit: str) -> str:
    """Return a rate as text, from counts a second: ``1.2 million points/s``, ``3.5 km/min``; empty when it is unknown."""
    if not speed or not unit:
        return ""
    if speed >= 1e6:
        return f"{speed / 1e6:.1f} million {unit}/s"
    if speed >= 1.0:
        return f"{speed:,.0f} {unit}/s".replace(",", " ")
    return f"{60.0 * speed:.1f} {unit}/min" if speed >= 1.0 / 60.0 else f"{3600.0 * speed:.1f} {unit}/h"
