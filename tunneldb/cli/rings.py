"""The verb ``rings``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tunneldb.cli.output import tell, verb
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.tables import print_table
from tunneldb.errors import UserError

if TYPE_CHECKING:
    from tunneldb.export.tables.rings import Chord
    from tunneldb.pipeline.rings import SurveyedRings

_END = r"(\d{1,3}(?:\.\d+)?|\d{1,2}:\d\d)"
_CHORD = re.compile(f"{_END}-{_END}")


@verb(
    examples=[
        "tunneldb rings --points points.csv --axis axis.csv --diameter 5.8 -o rings.csv",
        "tunneldb rings --points points.csv --axis axis.csv --diameter 5.8 --chord 9:00-3:00 --chord 300-60 -o rings.csv",
        "tunneldb rings --points points.csv --axis axis.csv --diameter 5.8 --sigma 0.002 --json",
    ]
)
@click.option(
    "--points",
    type=FilePath(dir_okay=False),
    required=True,
    metavar="CSV",
    help="Surveyed points: ring,point,x,y,z, m, and perhaps offset, how far the prism stands before the lining, m.",
)
@click.option(
    "--axis",
    type=FilePath(dir_okay=False),
    required=True,
    metavar="CSV",
    help="Design axis: chainage,x,y,z, m, in growing chainage.",
)
@click.option("--diameter", type=FiniteRange(0.5, 50.0), required=True, metavar="M", help="Inner diameter of the design, m.")
@click.option(
    "--sigma",
    type=FiniteRange(0.0, 0.1, min_open=True),
    metavar="M",
    help="What a point is good for, its standard deviation, m. By default all rings together say it.",
)
@click.option(
    "--harmonics",
    type=click.IntRange(2, 20),
    default=3,
    show_default=True,
    metavar="N",
    help="Orders of the radius's harmonics.",
)
@click.option(
    "--chord",
    "chords",
    multiple=True,
    metavar="FROM-TO",
    help="Chord between two clock positions, in degrees or as on a clock: 300-60, 9:00-3:00. May be repeated.",
)
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write, CSV; else standard output.")
def rings(
    points: Path,
    axis: Path,
    diameter: float,
    sigma: float | None,
    harmonics: int,
    chords: tuple[str, ...],
    output: Path | None,
) -> None:
    """Measure rings: centre, deviation from the design axis, radius, ovality, harmonics, chords; needs no database.

    A ring needs 5 points, its ellipse 6. Each value has its standard error. A point that cannot belong to its ring is left out,
    and named in the column remark; so is what could not be told. Clock positions are degrees from the crown to the right,
    looking up-chainage. docs/howto-shape.md says what each column means.
    """
    from tunneldb.export.tables.rings import SUMMARY, ring_records, rings_csv, summary
    from tunneldb.files import replacing
    from tunneldb.pipeline.rings import measure_rings

    lines = _chords(chords)
    if output is not None:
        _require_writable(output, (points, axis))
    found = measure_rings(points, axis, diameter, sigma, harmonics)
    _tell(found, output)
    text = rings_csv(found, harmonics, lines)
    if output is None:
        tell(rows=ring_records(found, harmonics, lines))
        click.echo(text, nl=False)
    else:
        with replacing(output) as temporary:
            temporary.write_text(text, encoding="utf-8")
        print_table(("", *SUMMARY), summary(found), right=(1, 2, 3, 4, 5))
        click.echo(_said(found))
    for note in found.notes:
        click.echo(note, err=True)


def _require_writable(output: Path, inputs: tuple[Path, ...]) -> None:
    if not output.parent.is_dir():
        raise UserError(f"{output}: there is no folder {output.parent}")
    if output.suffix.lower() != ".csv":
        raise UserError(f"{output}: rings are written as .csv")
    for path in inputs:
        if output.resolve() == path.resolve():
            raise UserError(f"{output} is what is read; write to another file")


def _chords(given: tuple[str, ...]) -> list[Chord]:
    """Name and clock positions, in degrees, of chords."""
    found: list[Chord] = []
    for text in given:
        ends = _CHORD.fullmatch(text)
        if ends is None:
            raise UserError(f"--chord takes two clock positions, as 300-60 in degrees or 9:00-3:00, not {text!r}")
        first, second = (_degrees(end, text) for end in ends.groups())
        if first == second:
            raise UserError(f"--chord {text}: both ends are one clock position")
        name = f"chord_{first:g}_{second:g}"
        if name not in (chord[0] for chord in found):
            found.append((name, first, second))
    return found


def _degrees(end: str, text: str) -> float:
    hours, colon, minutes = end.partition(":")
    value = 30.0 * int(hours) + 0.5 * int(minutes) if colon else float(end)
    if value > 360.0 or (colon and int(minutes) > 59):
        raise UserError(f"--chord {text}: {end} is no clock position; there are 0 to 360 degrees, or 0:00 to 12:00")
    return value % 360.0


def _tell(found: SurveyedRings, output: Path | None) -> None:
    tell(
        rings=len(found.rows),
        measured=sum(row.ring is not None for row in found.rows),
        remarks={row.name: "; ".join(row.remarks) for row in found.rows if row.remarks},
        sigma=found.sigma,
        sigma_given=found.sigma_given,
        notes=found.notes,
        file=output,
    )


def _said(found: SurveyedRings) -> str:
    measured = sum(row.ring is not None for row in found.rows)
    remarks = sum(bool(row.remarks) for row in found.rows)
    whence = "as given" if found.sigma_given else "as all rings together say"
    good = "" if found.sigma is None else f"; a point is good for {1e3 * found.sigma:.1f} mm, {whence}"
    return f"{measured} of {len(found.rows)} rings measured, {remarks} with a remark{good}"
