"""Progress of long computations, for whoever shows it."""

from __future__ import annotations

from collections.abc import Callable

StartProgress = Callable[[str, float | None], Callable[[float], None]]
"""Called with the text of a step and its size, None if unknown; returns a function that takes each advance."""


def silent(text: str, total: float | None) -> Callable[[float], None]:
    """Start a step without a progress display."""
    return lambda done: None
