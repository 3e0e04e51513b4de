"""How far a file has been worked through, on the terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress


def points_bar() -> Progress:
    """Bar on stderr, with the time that is left; nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


def step(progress: Progress) -> Callable[[str, int], Callable[[int], None]]:
    """Show one step at a time: what it returns takes a text and a total, and returns what takes the counts."""

    def begin(text: str, total: int) -> Callable[[int], None]:
        for task in progress.task_ids:
            progress.remove_task(task)
        task = progress.add_task(text, total=total)
        return lambda count: progress.advance(task, count)

    return begin
