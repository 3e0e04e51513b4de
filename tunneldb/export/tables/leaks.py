"""Leaks, joints and other dry dark areas laid out as a table; as files: leak_files."""

from __future__ import annotations

from collections.abc import Callable

from rich.cells import cell_len
from rich.table import Table

from tunneldb.store.findings import Finding
from tunneldb.store.leaks import LeakList


def as_table(leaks: LeakList, title: str, width: int | None = None) -> Table:
    """Lay leaks or what else was read out for a terminal.

    Parameters
    ----------
    leaks, title
        Leaks to print.
    width : int, optional
        Columns of the terminal. If there is not enough space, the least important are left out and named below.
    """
    cells = {heading: [cell(leak) for leak in leaks.rows] for heading, cell in _CELLS.items()}
    hidden = []
    for heading in _LEAST_FIRST if leaks.kind == "all" else ("kind", *_LEAST_FIRST):
        if width is None or _width(cells) <= width:
            break
        if cells.pop(heading, None) is not None:
            hidden.append(heading)
    lack = f"; a wider window or --format csv shows: {', '.join(h for h in _CELLS if h in hidden)}" if hidden else ""
    table = Table(title=title, caption=f"{leaks.total}{lack}")
    for heading in cells:
        table.add_column(heading, justify="left" if heading in ("kind", "review", "by") else "right", no_wrap=True)
    for row in zip(*cells.values(), strict=True):
        table.add_row(*row)
    return table


def _width(cells: dict[str, list[str]]) -> int:
    """Width of a table with lines between its columns."""
    return 1 + sum(3 + max(map(cell_len, (heading, *column))) for heading, column in cells.items())


_CELLS: dict[str, Callable[[Finding], str]] = {
    "id": lambda leak: str(leak.id),
    "chainage": lambda leak: leak.label,
    "length m": lambda leak: f"{leak.chainage_to - leak.chainage_from:.2f}",
    "arc m": lambda leak: f"{leak.arc_from:+.2f} to {leak.arc_to:+.2f}",
    "clock": lambda leak: clock_label(leak.clock),
    "kind": lambda leak: leak.kind,
    "conf.": lambda leak: "" if leak.confidence_in_kind is None else f"{leak.confidence_in_kind:.2f}",
    "contrast": lambda leak: "" if leak.contrast is None else f"{leak.contrast:.1f}",
    "area m²": lambda leak: f"{leak.area:.2f}",
    "drop dB": lambda leak: "" if leak.darkening_mean is None else f"{leak.darkening_mean:.1f}",
    "max dB": lambda leak: "" if leak.darkening_max is None else f"{leak.darkening_max:.1f}",
    "image": lambda leak: "" if leak.image_share is None else f"{100 * leak.image_share:.0f} %",
    "review": lambda leak: leak.review if leak.detected else f"{leak.review}, not found again",
    "by": lambda leak: leak.reviewed_by or "",
}
_LEAST_FIRST = ("image", "max dB", "contrast", "length m", "by", "drop dB", "conf.", "arc m", "kind")


def clock_label(hours: float) -> str:
    """Clock position as hours and minutes: 12 is the crown, 0.5 is 12:30."""
    minutes = round(hours * 60) % 720
    return f"{minutes // 60 or 12}:{minutes % 60:02d}"
