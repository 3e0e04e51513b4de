"""The command ``rings``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FINITE, FilePath, FiniteRange, WholeRange
from tunneldb.cli.stretch import stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.errors import UserError

if TYPE_CHECKING:
    from tunneldb.export.tables.rings import Chord
    from tunneldb.measures.rings.surveyed import SurveyedRings

_END = r"([0-9]{1,3}(?:\.[0-9]+)?|[0-9]{1,2}:[0-9]{2})"
_CHORD = re.compile(f"{_END}-{_END}")


@command(
    examples=[
        "tunneldb rings demo-2024 --find",
        "tunneldb rings demo-2024 --length 1.5 --diameter 8 --chord 9:00-3:00 -o rings.csv",
        "tunneldb rings demo-2024 -o rings.gpkg",
        "tunneldb rings demo-2024 --from 12+310.000 --to 12+340.000 --json",
        "tunneldb rings --points points.csv --axis axis.csv --diameter 5.8 -o rings.csv",
        "tunneldb rings --points points.csv --axis axis.csv --diameter 5.8 --chord 9:00-3:00 --chord 300-60 -o rings.csv",
        "tunneldb rings --points points.csv --axis axis.csv --diameter 5.8 --sigma 0.002 --json",
    ]
)
@click.argument("survey", required=False)
@click.option(
    "--length", type=FiniteRange(0.3, 20.0), metavar="M",
    help="Of SURVEY: length of the rings, from its start or --start on, m.",
)  # fmt: skip
@click.option("--start", "joint_at", type=FINITE, metavar="CHAINAGE", help="With --length: chainage of a joint, m.")
@click.option(
    "--rings", "rings_file", type=FilePath(dir_okay=False), metavar="CSV",
    help="Of SURVEY: file of rings: number,chainage_from,chainage_to, m.",
)  # fmt: skip
@click.option("--find", is_flag=True, help="Of SURVEY: find the rings between joints in the images.")
@stretch_options
@click.option(
    "--points",
    type=FilePath(dir_okay=False),
    metavar="CSV",
    help="Surveyed points: ring,point,x,y,z, m, and optionally offset: distance of the prism from the lining, m.",
)
@click.option(
    "--axis",
    type=FilePath(dir_okay=False),
    metavar="CSV",
    help="Of --points: design axis: chainage,x,y,z, m, in increasing chainage.",
)
@click.option("--diameter", type=FiniteRange(0.5, 50.0), metavar="M", help="Inner diameter of the design, m.")
@click.option(
    "--sigma",
    type=FiniteRange(0.0, 0.1, min_open=True),
    metavar="M",
    help="Standard deviation of a point, m. Default: estimated from all rings.",
)
@click.option(
    "--harmonics",
    type=WholeRange(2, 20),
    default=3,
    show_default=True,
    metavar="N",
    help="Of --points: orders of the radius's harmonics.",
)
@click.option(
    "--chord",
    "chords",
    multiple=True,
    metavar="FROM-TO",
    help="Chord between two clock positions, in degrees or as on a clock: 300-60, 9:00-3:00. May be repeated.",
)
@click.option(
    "-o",
    "--output",
    type=FilePath(dir_okay=False),
    help="File to write, .csv, for a survey also .xlsx, or .gpkg with maps; default: standard output.",
)
@click.pass_obj
@click.pass_context
def rings(
    context: click.Context,
    settings: Settings,
    survey: str | None,
    length: float | None,
    start: str | None,
    rings_file: Path | None,
    find: bool,
    end: str | None,
    points: Path | None,
    axis: Path | None,
    diameter: float | None,
    sigma: float | None,
    harmonics: int,
    chords: tuple[str, ...],
    output: Path | None,
    joint_at: float | None,
) -> None:
    """Measure rings: centre, deviation from the design axis, radius, ovality, harmonics, chords, steps.

    Rings of SURVEY are measured from the offset image, kilometre by kilometre, and stored; define them once by
    --length, --rings or --find. Ovality is relative to --diameter, else to a circular design profile, else to the
    ring's own mean diameter.

    With --points rings are measured from total-station points, without a database. A ring needs 5 points, its ellipse
    6. Each value has its standard error. A point that cannot belong to its ring is rejected and named in the column
    remark, as are unknown values. Clock positions are degrees from the crown to the right, looking up-chainage.
    docs/howto-shape.md describes the columns.
    """
    _require_one_kind(context, survey, points)
    lines = _chords(chords)
    if survey is not None:
        from tunneldb.cli.survey_rings import Definition, survey_rings

        definition = Definition(length, joint_at, rings_file, find)
        ends = tuple(chord[1:] for chord in lines)
        survey_rings(settings, survey, definition, (start, end), diameter, ends, output)
        return
    if points is None or axis is None or diameter is None:
        raise UserError("rings of points need --points, --axis and --diameter; rings of a survey its name")
    from tunneldb.export.tables.rings import SUMMARY, ring_records, rings_csv, summary
    from tunneldb.files import replacing
    from tunneldb.measures.rings.surveyed import measure_rings

    if output is not None:
        _require_writable(output, (points, axis))
    found = measure_rings(points, axis, diameter, sigma, harmonics)
    _tell(found, output)
    text = rings_csv(found, harmonics, lines)
    if output is None:
        add_to_json(rows=ring_records(found, harmonics, lines))
        click.echo(text, nl=False)
    else:
        with replacing(output) as temporary:
            temporary.write_text(text, encoding="utf-8")
        print_table(("", *SUMMARY), summary(found), right=(1, 2, 3, 4, 5))
        click.echo(_summary(found))
    for note in found.notes:
        notify(note)


_OF_SURVEY = {
    "length": "--length",
    "joint_at": "--start",
    "rings_file": "--rings",
    "find": "--find",
    "start": "--from",
    "end": "--to",
}
_OF_POINTS = {"axis": "--axis", "sigma": "--sigma", "harmonics": "--harmonics"}


def _require_one_kind(context: click.Context, survey: str | None, points: Path | None) -> None:
    """Refuse a survey and points together, neither, and options of the one with the other."""
    if survey is not None and points is not None:
        raise UserError("rings are of a survey or of --points, not of both: omit one of them")
    if survey is None and points is None:
        raise UserError("rings of what? Give a survey, or --points with --axis and --diameter")
    for name, option in (_OF_POINTS if points is None else _OF_SURVEY).items():
        if context.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT:
            kind = "of --points" if points is None else "of a survey"
            raise UserError(f"{option} is for rings {kind}; omit it")


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
    add_to_json(
        rings=len(found.rows),
        measured=sum(row.ring is not None for row in found.rows),
        remarks={row.name: "; ".join(row.remarks) for row in found.rows if row.remarks},
        sigma=found.sigma,
        sigma_given=found.sigma_given,
        notes=found.notes,
        file=output,
    )


def _summary(found: SurveyedRings) -> str:
    measured = sum(row.ring is not None for row in found.rows)
    remarks = sum(bool(row.remarks) for row in found.rows)
    source = "given" if found.sigma_given else "estimated from all rings"
    accuracy = "" if found.sigma is None else f"; standard deviation of a point {1e3 * found.sigma:.1f} mm, {source}"
    return f"{measured} of {counted(len(found.rows), 'ring')} measured, {remarks} with a remark{accuracy}"
