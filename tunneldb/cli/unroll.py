"""``tunneldb unroll``: points of a table to the unrolled plane and back."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import click
import numpy as np

from tunneldb.cli.main import Settings
from tunneldb.cli.output import records, tell, verb
from tunneldb.cli.param_types import FilePath
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.store.survey import get_survey

_SPACE = ("x", "y", "z")
_PLANE = ("chainage", "arc", "offset")


@verb(examples=["tunneldb unroll ringo-2024 points.csv -o unrolled.csv", "tunneldb unroll ringo-2024 niches.csv --inverse"])
@click.argument("survey")
@click.argument("points", type=FilePath(dir_okay=False))
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write, else standard output.")
@click.option("--inverse", is_flag=True, help="From chainage,arc,offset to x,y,z.")
@click.pass_obj
def unroll(settings: Settings, survey: str, points: Path, output: Path | None, inverse: bool) -> None:
    """Add the columns chainage,arc,offset to the table POINTS (CSV with x,y,z).

    With --inverse, add x,y,z to a table with chainage,arc,offset (offset 0 where there is no such column). The columns
    added are empty where a point lies off the tunnel. x,y,z are in the tunnel's SRID; all are metres: chainage in plan
    along the axis, arc from the crown, positive right looking up-chainage, offset from the surface, positive inwards.
    """
    from tunneldb.files import replacing
    from tunneldb.store.surface import load_surface

    given, added = (_PLANE, _SPACE) if inverse else (_SPACE, _PLANE)
    header, rows, coordinates = _read(points, given, optional="offset" if inverse else None)
    if clash := [name for name in added if name in header]:
        raise UserError(f"{points} already has the column {clash[0]}: rename or remove it")
    with connect(settings.dsn) as conn:
        surface = load_surface(conn, get_survey(conn, survey))
    if inverse:
        result = surface.to_space(*coordinates.T)
    else:
        unrolled = surface.unroll(coordinates)
        result = np.column_stack([unrolled.chainage, unrolled.arc, unrolled.offset])

    table = [[*header, *added]]
    for row, values in zip(rows, result.tolist(), strict=True):
        table.append([*row, *("" if value != value else f"{value:.4f}" for value in values)])
    tell(survey=survey, points=len(rows), off_tunnel=sum(row[-1] == "" for row in table[1:]), file=output)
    if output is None:
        tell(rows=records(table[0], table[1:]))
        csv.writer(sys.stdout, lineterminator="\n").writerows(table)
    else:
        with replacing(output) as path, path.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows(table)


def _read(path: Path, columns: tuple[str, ...], optional: str | None) -> tuple[list[str], list[list[str]], np.ndarray]:
    """Header, rows as text, and the coordinates (n, 3) of a table."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            lines = [(reader.line_num, row) for reader in [csv.reader(stream)] for row in reader if row]
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{path} is no text in UTF-8") from None
    if not lines:
        raise UserError(f"{path} is empty: it needs a header with {','.join(columns)}")
    header = [name.strip() for name in lines[0][1]]
    needed = [name for name in columns if name in header or name != optional]
    if missing := [name for name in needed if name not in header]:
        raise UserError(f"{path}, line 1: there is no column {missing[0]}; the header must have {','.join(columns)}")
    coordinates = np.zeros((len(lines) - 1, 3))
    for index, (number, row) in enumerate(lines[1:]):
        if len(row) != len(header):
            raise UserError(f"{path}, line {number}: {len(row)} values, the header has {len(header)} columns")
        for column, name in enumerate(columns):
            if name in header:
                coordinates[index, column] = _number(path, number, name, row[header.index(name)])
    return header, [row for _, row in lines[1:]], coordinates


def _number(path: Path, line: int, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise UserError(f"{path}, line {line}: {name} must be a finite number, not {text!r}")
    return value
