"""`tunneldb load`."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify, printable
from tunneldb.cli.param_types import FINITE, FilePath, FiniteRange, WholeRange
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.cli.units import unit_options
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.numerals import parse_number
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey, get_survey

if TYPE_CHECKING:
    import psycopg

    from tunneldb.store.scan_files import Loaded

MOST_NAMED = 5  # files of which the same is said


@command(
    examples=[
        "tunneldb load ringo-2024 scans/km-511.laz scans/km-512.laz",
        "tunneldb load ringo-2024 scans/*.e57 --density all",
        "tunneldb load canal-26 soundings.laz --medium water --water-level 265.0",
    ]
)
@click.argument("survey")
@click.argument("files", nargs=-1, required=True, type=FilePath(), metavar="FILES...")
@click.option(
    "--density",
    default="100",
    show_default=True,
    help="Points per m² of surface to keep, 1 or more, or 'all'. A survey has one density.",
)
@click.option(
    "--noise-points",
    type=WholeRange(1, 1000),
    default=5,
    show_default=True,
    help="Points with fewer points than this around them, including themselves, are noise; 1 keeps all.",
)
@click.option(
    "--noise-diameter",
    type=FiniteRange(0.001, 1.0),
    default=0.05,
    show_default=True,
    metavar="M",
    help="Diameter of the neighbourhood of a point at full density; wider where the scan is sparser.",
)
@click.option(
    "--max-distance",
    type=FiniteRange(0.5, 1000.0),
    default=25.0,
    show_default=True,
    metavar="M",
    help="Distance from the given axis beyond which points are left out.",
)
@click.option(
    "--max-left-out",
    type=FiniteRange(0.0, 100.0),
    default=5.0,
    show_default=True,
    metavar="PERCENT",
    help="Share of points of unknown scanner position, or with NaN time or intensity, that are left out; a "
    "file with more is refused.",
)
@unit_options("FILES")
@click.option(
    "--medium",
    type=click.Choice(["air", "water"]),
    default="air",
    show_default=True,
    help="water: FILES are soundings in the tunnel's system. Not needed for registered sonar scans.",
)
@click.option("--water-level", type=FINITE, metavar="M", help="Height of the water for soundings, m.")
@click.pass_obj
def load(
    settings: Settings,
    survey: str,
    files: tuple[Path, ...],
    density: str,
    noise_points: int,
    noise_diameter: float,
    max_distance: float,
    max_left_out: float,
    unit: str | None,
    height_unit: str | None,
    medium: str,
    water_level: float | None,
) -> None:
    """Load FILES (LAS, LAZ, E57, PTX, PTS, PLY, tables of points) into SURVEY.

    Noise is removed, and the rest thinned to the survey's density and stored by chainage. A loaded file with the same
    content is skipped; one with other content replaces the former.

    Files of a site are checked and recorded; their points stay in the files.

    Registered sonar scans are loaded by their poses: their points are classified, false echoes are removed as noise,
    and the bed is computed. Laser points do not change. Soundings in the tunnel's system (--medium water), such as
    those of a multibeam sonar, have no pose.
    """
    from tunneldb.pipeline.load import load_files
    from tunneldb.pipeline.site_files import register_files
    from tunneldb.pointcloud.selection import FilterSettings
    from tunneldb.pointcloud.units import NOT_GIVEN, GivenUnits
    from tunneldb.store.scan_files import sonar_among

    if (medium == "water") != (water_level is not None):
        raise UserError("--medium water and --water-level M belong together: give both or none")
    units = GivenUnits(unit, height_unit)
    chosen = FilterSettings(density_of(density), noise_points, noise_diameter, max_distance, max_left_out / 100.0, units)
    done: list[Loaded] = []
    add_to_json(survey=survey, files=done)
    with connect(settings.dsn) as connection:
        found = get_survey(connection, survey, site=True)
        connection.rollback()
        try:
            with bar("points") as progress:
                if water_level is not None:
                    if found.site:
                        raise UserError(f"survey {survey} is of a site, which has no axis: soundings are of tunnels")
                    from tunneldb.pipeline.load_sonar import record_soundings

                    record_soundings(connection, found, files, water_level)
                if found.site:
                    loaded = register_files(connection, found, files, chosen, step(progress))
                else:
                    sonar = sonar_among(connection, found, files)
                    laser = [path for path in files if path not in sonar]
                    loaded = load_files(connection, found, laser, chosen, step(progress)) if laser else iter(())
                    if sonar:
                        if units != NOT_GIVEN:
                            raise UserError("--unit and --height-unit are of laser scans; load sonar scans without them")
                        from tunneldb.pipeline.load_sonar import load_sonar

                        loaded = chain(loaded, load_sonar(connection, found, sonar, step(progress)))
                for file in loaded:
                    done.append(file)  # noqa: PERF402 - those before a failure are in the summary too
        finally:
            if done:
                _summary(connection, found, done)


def density_of(text: str) -> float | None:
    """Density that a text states, points per m²; None for all."""
    if text == "all":
        return None
    try:
        value = parse_number(text)
    except ValueError:
        value = 0.0
    if not 1.0 <= value <= 1e6:
        raise UserError(f"--density takes points per m², 1 or more, or 'all', not {text!r}")
    return value


def _summary(connection: psycopg.Connection[Any], survey: Survey, done: list[Loaded]) -> None:
    said = ["left out"] if survey.site else ["noise", "outside", "left out", "thinned", "kept"]
    rows = []
    for file in done:
        left_out = file.invalid + file.unposed
        counts = [left_out] if survey.site else [file.noise, file.outside, left_out, file.thinned, file.kept]
        speed = file.points / file.seconds if file.seconds else None
        rows.append([file.name, file.state, *map(_number, (file.points, speed, *counts))])
    print_table(["file", "", "points", "points/s", *said], rows, right=range(2, 4 + len(said)))
    if survey.site:
        notify(f"looked through; the points stay in the files: tunneldb members {survey.name}")
    loaded = {file.name for file in done}
    remarks = [remark for remark in read_remarks(connection, survey) if remark.file in loaded]
    add_to_json(remarks=remarks)
    for remark in remarks:
        notify(remark.said)
    connection.rollback()
    say_notes((file.name, file.note) for file in done if file.note)


def say_notes(notes: Iterable[tuple[str, str]]) -> None:
    """Print notes on files (name, note) on standard error, one line for equal notes."""
    noted: dict[str, list[str]] = {}
    for name, note in notes:
        noted.setdefault(note, []).append(name)
    for note, names in noted.items():
        notify(printable(f"{_some(names)}: {note}"))


def _some(names: list[str]) -> str:
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:,.0f}".replace(",", " ")
