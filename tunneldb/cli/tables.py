"""Tables on the terminal, those of classes of points among them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from tunneldb.arrays import Int64
from tunneldb.classification.classes import PointClass
from tunneldb.cli.output import add_to_json, printable
from tunneldb.errors import UserError

_BY_SUFFIX = {".csv": "csv", ".geojson": "geojson", ".json": "geojson", ".gpkg": "gpkg", ".xlsx": "xlsx", ".txt": "table"}
_NEED_FILE = {"gpkg": "a GeoPackage", "xlsx": "an Excel workbook"}


def table_format(form: str | None, output: Path | None, what: str, files: Sequence[str]) -> str:
    """Return the format asked for, else that of a file's ending, else ``table``.

    Parameters
    ----------
    form, output : str, Path
        What was asked for.
    what : str
        What is written, in the plural.
    files : sequence of str
        Formats in which it is written to a file.

    Raises
    ------
    UserError
        If a file's ending says none of them, or the format needs a file and there is none.
    """
    form = form or (_BY_SUFFIX.get(output.suffix.lower()) if output else "table")
    if form in _NEED_FILE and output is None:
        raise UserError(f"{_NEED_FILE[form]} needs a file to be written to: add -o {what}.{form}")
    if form is None or (output is not None and form not in files):
        endings = [suffix for suffix, name in _BY_SUFFIX.items() if name in files and suffix != ".json"]
        raise UserError(
            f"{output}: {what} are written as {', '.join(endings[:-1])} or {endings[-1]}: use one of these endings, or --format"
        )
    return form


def print_table(header: Sequence[str], rows: Iterable[Sequence[Any]], right: Sequence[int] = ()) -> None:
    """Print rows as a table on stdout; columns in `right` are aligned to the right."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for index, name in enumerate(header):
        table.add_column(name, justify="right" if index in right else "left", no_wrap=True)
    for row in rows:
        # as Text, for rich takes [red] in a plain string for markup
        table.add_row(*("" if cell is None else cell if isinstance(cell, Text) else Text(printable(str(cell))) for cell in row))
    Console(width=1000).print(table, soft_wrap=True)  # nothing is cut: a terminal folds what is too wide


def print_classes(counts: Int64) -> None:
    """Print a table of the classes that points (256,) have, and tell of them."""
    total = int(counts.sum())
    add_to_json(points=total, classes={klass.name.lower(): int(counts[klass]) for klass in PointClass if counts[klass]})
    rows = [
        (int(klass), klass.name.lower(), f"{int(counts[klass]):,}".replace(",", " "), f"{100.0 * counts[klass] / total:.2f} %")
        for klass in PointClass
        if counts[klass]
    ]
    print_table(("class", "", "points", "share"), rows, right=(0, 2, 3))
