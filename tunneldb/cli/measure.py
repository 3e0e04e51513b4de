"""Shared parts of the commands of measures: options, the run with its progress, printing and writing of rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, notify
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.progress import bar, step
from tunneldb.cli.stretch import Stretch, parse_stretch
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm, replacing
from tunneldb.store.survey import Survey, get_survey

if TYPE_CHECKING:
    from tunneldb.progress import StartProgress

Command = TypeVar("Command", bound=Callable[..., Any])

LAYERS = click.Choice(["lining", "shotcrete", "excavation"])
layer_option = click.option("--layer", type=LAYERS, default="lining", show_default=True, help="Layer of the profile.")


def every_option(default: float = 100.0, text: str = "Length of the listed stretches, m.", shown: str | bool = True) -> Any:
    """Return the option --every: length of the listed rows, m."""
    return click.option("--every", type=FiniteRange(1.0), default=default, show_default=shown, metavar="M", help=text)


def axis_sigma_option(text: str) -> Any:
    """Return the option --axis-sigma: a standard deviation in m."""
    return click.option("--axis-sigma", type=FiniteRange(0.0, 1.0), metavar="M", help=text)


def output_option(text: str) -> Any:
    """Return the option --output: the file to write."""
    return click.option("-o", "--output", type=FilePath(dir_okay=False), help=text)


def require_ending(output: Path | None, measure: str, endings: Sequence[str]) -> None:
    """Refuse a file whose ending says a kind that the measure is not written as.

    Raises
    ------
    UserError
        If it does.
    """
    if output is not None and output.suffix.lower() not in endings:
        *others, last = endings
        kinds = f"{', '.join(others)} or {last}" if others else last
        raise UserError(f"{output}: {measure} is written as {kinds}")


@contextmanager
def surveys_in(
    settings: Settings, names: Sequence[str], start: str | None, end: str | None, of: int = 0
) -> Iterator[tuple[psycopg.Connection[Any], list[Survey], Stretch]]:
    """Connect; give the connection, idle, the surveys of these names and a stretch in the stationing of one of them."""
    with connect(settings.dsn) as conn:
        surveys = [get_survey(conn, name) for name in names]
        part = parse_stretch(conn, surveys[of], start, end)
        conn.rollback()
        yield conn, surveys, part


def with_progress(measure: Callable[[StartProgress], list[int]]) -> list[int]:
    """Run a measure under a bar of kilometres, and return those that were made."""
    with exit_on_sigterm(), bar("km") as progress:
        return measure(step(progress))


def write_text(output: Path, text: str) -> list[Path]:
    """Write a file whole or not at all; return its path as a list."""
    with replacing(output) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return [output]


def write_rows(output: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> list[Path]:
    """Write these columns of rows as CSV; return the path as a list."""
    from tunneldb.csvfile import write_csv

    return write_text(output, write_csv(columns, ([row[name] for name in columns] for row in rows)))


def say_written(files: Sequence[Path]) -> None:
    """Tell which files were written, and print a line for each."""
    add_to_json(files=list(files))
    for file in files:
        notify(f"written to {file}")


def number(value: float | None, decimals: int, factor: float = 1.0) -> str:
    """Return a number as a table shows it; empty for None."""
    return "" if value is None else f"{factor * value:.{decimals}f}"


def axis_quality(axis_sigma: float | None) -> str:
    """Return the accuracy of an axis, or of a registration, as text."""
    if axis_sigma is None:
        return "assumed exact, else give --axis-sigma"
    return f"standard deviation {1e3 * axis_sigma:g} mm"
