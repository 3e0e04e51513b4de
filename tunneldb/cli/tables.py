"""Tables on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text


def print_table(header: Sequence[str], rows: Iterable[Sequence[Any]], right: Sequence[int] = ()) -> None:
    """Print rows as a table on stdout; columns in `right` are aligned to the right."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for index, name in enumerate(header):
        table.add_column(name, justify="right" if index in right else "left", no_wrap=True)
    for row in rows:
        table.add_row(*("" if cell is None else cell if isinstance(cell, Text) else str(cell) for cell in row))
    console = Console()
    if not console.is_terminal:
        console = Console(width=1000)  # a pipe has no width: let nothing be cut there
    console.print(table, soft_wrap=True)
