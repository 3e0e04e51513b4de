"""The command ``register``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FINITE, FilePath
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.numerals import parse_number
from tunneldb.store.survey import get_survey

if TYPE_CHECKING:
    from tunneldb.registration.underwater import Registration, SonarPose

UP = {"+z": 1, "-z": -1}


@command(
    examples=[
        "tunneldb register canal-26 mss-1.xyz mss-2.xyz --ladders ladders.csv --up +z --water-level 265.0",
        "tunneldb register canal-26 mss-*.xyz --ladders ladders.csv --up -z --water-level 265.0 --report registration.md",
        "tunneldb register canal-26 mss-*.xyz --ladders ladders.csv --up +z --water-level 265.0 --sound-speed 1500=1447",
        "tunneldb register basin-26 mss-*.xyz --up +z --water-level 265.0 --pictures .",
    ],
    wrong="some scan's pose is weak or undetermined: the table and --json name the directions",
)
@click.argument("survey")
@click.argument("files", nargs=-1, required=True, type=FilePath(), metavar="FILES...")
@click.option(
    "--ladders",
    type=FilePath(dir_okay=False),
    metavar="CSV",
    help="Ladders in the water: ladder,rung,height,stile_gap,diameter, m; a row for each rung. Without it, walls, bed and "
    "water surface must determine the poses.",
)
@click.option("--up", type=click.Choice(list(UP)), required=True, help="Direction of z in the sonar's files, up or down.")
@click.option("--water-level", type=FINITE, required=True, metavar="M", help="Height of the water in the tunnel's system, m.")
@click.option(
    "--start",
    type=FilePath(dir_okay=False),
    metavar="CSV",
    help="Approximate sonar positions: file,x,y,within, m, and if known azimuth, degrees from north, clockwise, of the "
    "file's x axis. The search is limited to within of x, y; other scans are searched everywhere.",
)
@click.option(
    "--sound-speed",
    metavar="ASSUMED=MEASURED",
    help="Speed of sound that the sonar assumed, and the speed measured in the water, m/s. Required if they differ by more "
    "than 3 %.",
)
@click.option("--report", type=FilePath(dir_okay=False), metavar="FILE", help="Report to write, as Markdown.")
@click.option(
    "--pictures",
    type=FilePath(file_okay=False),
    metavar="FOLDER",
    help="Folder for a picture of each scan: its pose, or its possible poses to choose from.",
)
@click.pass_context
def register(
    ctx: click.Context,
    survey: str,
    files: tuple[Path, ...],
    ladders: Path | None,
    up: str,
    water_level: float,
    start: Path | None,
    sound_speed: str | None,
    report: Path | None,
    pictures: Path | None,
) -> None:
    """Register sonar scans from below the water (FILES) to the laser scans of SURVEY above it.

    FILES are static scans of a mechanical sonar in its own axes, m: .xyz, .txt, .csv, .off, LAS, LAZ, E57, PLY.
    Position and heading of the sonar may be unknown. All scans are adjusted together: to the laser's walls, extended
    below the water, to their plan at the waterline, to ladders seen by both, to the water's surface, and to each other.
    Poses are stored with their covariance (tunnel_api.sonar_scan) and replace earlier poses of these files. A scan that
    fits in several ways gets no pose; its possible poses are listed with their probabilities.

    A point of a file lies in the tunnel at rotation · (scale · point) + translation.
    """
    from tunneldb.export.figures.sonar_poses import write_pictures
    from tunneldb.export.tables.registration import ALTERNATIVES_HEADER, HEADER, alternative_rows, as_report, scan_rows
    from tunneldb.files import replacing
    from tunneldb.pipeline.register import SonarInput, register_survey

    settings: Settings = ctx.obj
    if report is not None and not report.parent.is_dir():
        raise UserError(f"{report}: there is no folder {report.parent}")
    if pictures is not None and not pictures.is_dir():
        raise UserError(f"{pictures}: there is no such folder")
    given = SonarInput(files, ladders, UP[up], water_level, start, _speeds(sound_speed))
    with connect(settings.dsn) as conn:
        chosen = get_survey(conn, survey)
        conn.rollback()
        with bar("points") as progress:
            found = register_survey(conn, chosen, given, step(progress))
    _tell(survey, found)
    print_table(HEADER, scan_rows(found), right=range(2, 7))
    choices = alternative_rows(found)
    if choices:
        print_table(ALTERNATIVES_HEADER, choices, right=range(1, 7))
    for note in found.notes:
        notify(note)
    if report is not None:
        with replacing(report) as temporary:
            temporary.write_text(as_report(survey, found), encoding="utf-8")
        notify(f"report to {report}")
    if pictures is not None:
        for path in write_pictures(found, pictures):
            notify(f"picture to {path}")
    if any(scan.state != "determined" for scan in found.scans):
        ctx.exit(1)


def _speeds(text: str | None) -> tuple[float, float] | None:
    """Speeds that a text ``ASSUMED=MEASURED`` states, m/s."""
    if text is None:
        return None
    assumed, _, measured = text.partition("=")
    try:
        return parse_number(assumed), parse_number(measured)
    except ValueError:
        raise UserError(f"--sound-speed takes ASSUMED=MEASURED in m/s, as 1500=1447, not {text!r}") from None


def _tell(survey: str, found: Registration) -> None:
    add_to_json(
        survey=survey,
        scans=[_scan(scan) for scan in found.scans],
        ladders=found.ladders,
        water_level=found.water_level,
        notes=found.notes,
    )


def _scan(scan: SonarPose) -> dict[str, object]:
    return {
        "file": scan.path,
        "rotation": scan.rotation,
        "translation": scan.translation,
        "scale": scan.scale,
        "covariance": scan.covariance,
        "state": scan.state,
        "undetermined": scan.undetermined,
        "residuals": scan.residuals,
        "alternatives": scan.alternatives,
    }
