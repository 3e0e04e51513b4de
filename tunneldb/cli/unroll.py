"""``tunneldb unroll``: points of a table to the unrolled plane and back."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import click
import numpy as np

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, records
from tunneldb.cli.param_types import FilePath
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.store.survey import get_survey

_SPACE = ("x", "y", "z")
_PLANE = ("chainage", "arc", "offset")


@command(examples=["tunneldb unroll ringo-2024 points.csv -o unrolled.csv", "tunneldb unroll ringo-2024 niches.csv --inverse"])
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
    from tunneldb.csvfile import read_csv, read_header, read_rows
    from tunneldb.files import replacing
    from tunneldb.store.surface import load_surface

    given, added = (_PLANE, _SPACE) if inverse else (_SPACE, _PLANE)
    header = read_header(points)
    coordinates = read_csv(points, given, {"offset": 0.0} if inverse else None).values
    rows = read_rows(points)
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
    add_to_json(survey=survey, points=len(rows), off_tunnel=sum(row[-1] == "" for row in table[1:]), file=output)
    if output is None:
        add_to_json(rows=records(table[0], table[1:]))
        csv.writer(sys.stdout, lineterminator="\n").writerows(table)
    else:
        with replacing(output) as path, path.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows(table)
