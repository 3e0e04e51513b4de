"""The command ``intensity``."""

from __future__ import annotations

from pathlib import Path
from typing import cast, get_args

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FINITE, FilePath, file_path
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.export.figures.intensity_dependence import check_format, write_figure
from tunneldb.radiometry.correction import Kind
from tunneldb.radiometry.diagnosis import Diagnosis
from tunneldb.store.survey import get_survey

_FILES = (".las", ".laz", ".e57")


@command(
    examples=[
        "tunneldb intensity ringo-2024 --km 511 -o intensity.png",
        "tunneldb intensity scan.laz --intensity Amplitude --intensity-kind amplitude --scanner 0 0 1.8",
    ]
)
@click.argument("survey", metavar="SURVEY|FILE")
@click.option("--km", metavar="A-B", help="Only these kilometres of the survey: 12 or 12-14.")
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="Figure to write: .png, .pdf or .svg.")
@click.option("--intensity", metavar="DIMENSION", help="For a file: dimension with the intensity.")
@click.option(
    "--intensity-kind", type=click.Choice(get_args(Kind)), help="For a file: kind of intensity, as for tunneldb survey add."
)
@click.option(
    "--scanner",
    type=(FINITE, FINITE, FINITE),
    metavar="X Y Z",
    help="For a file: scanner position in the file's coordinates; E57 and PTX files contain it.",
)
@click.pass_obj
def intensity(
    settings: Settings,
    survey: str,
    km: str | None,
    output: Path | None,
    intensity: str | None,
    intensity_kind: str | None,
    scanner: tuple[float, float, float] | None,
) -> None:
    """Plot intensity against range and incidence, before and after correction.

    For a SURVEY, points of survey density on the lining are used, after the stages sections and ground; nothing is
    changed. For a scan FILE, all flat surfaces are used, without a database. The table has the slope of intensity,
    and the standard deviation of the medians of classes of range and incidence.
    """
    if output is not None:
        check_format(output)
    if survey.lower().endswith(_FILES):
        if km is not None:
            raise UserError("--km is of a survey, not of a file; omit it")
        look = _diagnose_file(file_path(survey), intensity, intensity_kind, scanner)
    else:
        if intensity is not None or intensity_kind is not None or scanner is not None:
            raise UserError(
                f"--intensity, --intensity-kind and --scanner are for a file; the survey {survey} has its own: omit them"
            )
        look = _diagnose_survey(settings, survey, km)
    add_to_json(title=look.title, dependence=look.dependence, verdict=look.dependence.verdict(), notes=look.notes, file=output)
    _print(look)
    if output is not None:
        write_figure(look, output)
        notify(f"figure to {output}")


def _diagnose_file(
    path: Path, dimension: str | None, kind: str | None, scanner: tuple[float, float, float] | None
) -> Diagnosis:
    from tunneldb.pipeline.intensity_diagnosis import diagnose_file

    if dimension is None:
        raise UserError(f"{path}: say which dimension holds the intensity: --intensity DIMENSION")
    if kind is None:
        raise UserError(f"{path}: say what {dimension} is: --intensity-kind {'|'.join(get_args(Kind))}")
    with bar("points") as progress:
        return diagnose_file(path, dimension, cast(Kind, kind), scanner, step(progress))


def _diagnose_survey(settings: Settings, name: str, km: str | None) -> Diagnosis:
    from tunneldb.pipeline.intensity_diagnosis import diagnose_survey
    from tunneldb.stages.parameters import settings as defaults
    from tunneldb.stages.run import loaded_kilometres, nothing_yet, parse_km

    with connect(settings.dsn) as conn:
        survey = get_survey(conn, name)
        there = loaded_kilometres(conn, survey)
        if not there:
            raise nothing_yet(conn, survey, "has no ground")
        kilometres = parse_km(km, there)
        with bar("km") as progress:
            return diagnose_survey(conn, survey, kilometres, defaults(), step(progress)("intensity", len(kilometres)))


def _print(look: Diagnosis) -> None:
    header = ["over", "slope before", "slope after", "medians before", "medians after"]
    print_table(header, look.dependence.rows(), right=(1, 2, 3, 4))
    for note in look.notes:
        click.echo(note)
    click.echo(look.dependence.verdict())
