"""`tunneldb survey`."""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import CommandGroup, add_to_json, notify, records
from tunneldb.cli.param_types import FINITE, FilePath, file_path
from tunneldb.cli.progress import bar, step
from tunneldb.cli.sizes import sizes
from tunneldb.cli.survey_archive import export, import_
from tunneldb.cli.tables import print_table
from tunneldb.cli.units import unit_options
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.geometry.units import Units
from tunneldb.numerals import is_plain
from tunneldb.store.listing import count_holdings, count_stale, list_surveys
from tunneldb.store.survey import UNPOSED, get_survey

FILE = FilePath()


@click.group(cls=CommandGroup)
def survey() -> None:
    """Add, list, change, export, import or remove surveys of a tunnel, and remove files."""


survey.add_command(export)
survey.add_command(import_)
survey.add_command(sizes)


class Day(click.DateTime):
    """A date as ISO 8601 has it, and words that say so."""

    def __init__(self) -> None:
        super().__init__(["%Y-%m-%d"])

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the day."""
        try:
            return super().convert(value if not isinstance(value, str) or is_plain(value) else "", param, ctx)
        except click.BadParameter:
            self.fail(f"{value!r} is no day as YYYY-MM-DD: year, month, day, as 2024-05-31", param, ctx)


DAY = Day()


@survey.command(
    examples=[
        "tunneldb survey add ringo-2024 --tunnel ringo --date 2024-05-04 --stations stations.csv --intensity-kind none",
        "tunneldb survey add bend-2024 --tunnel bend --date 2024-05-04 --trajectory trajectory.csv \\",
        "    --intensity Amplitude --intensity-kind amplitude --reference auto",
    ]
)
@click.argument("name")
@click.option("--tunnel", required=True, help="Scanned tunnel.")
@click.option("--date", type=DAY, required=True, metavar="YYYY-MM-DD", help="Date of the scan.")
@click.option("--trajectory", type=FILE, help="CSV with time,x,y,z of a mobile scanner; time is the gps_time of the files.")
@click.option(
    "--stations",
    type=FILE,
    multiple=True,
    help="CSV with scan_id,x,y,z of a static scanner (scan_id is point_source_id); or an E57 or PTX file "
    "with the poses of its scans; or a folder of such files. May be repeated.",
)
@click.option(
    "--no-poses",
    is_flag=True,
    help="Unknown scanner positions, as of merged scans: intensity, of kind reflectance or none, is used "
    "uncorrected, and every result states it.",
)
@click.option("--backwards", is_flag=True, help="The trajectory was driven down-chainage.")
@unit_options("the files of --trajectory and --stations")
@click.option(
    "--time-offset",
    type=FINITE,
    metavar="SECONDS",
    help="Seconds to add to the times of the trajectory, such as 18 if they are in UTC and the files in GPS time.",
)
@click.option(
    "--reference",
    metavar="FILE|auto",
    help="Intensity of the scanner by range: CSV with range_m,intensity_db, measured on a target; or auto: "
    "estimated on the lining (a file of that name is ./auto).",
)
@click.option(
    "--intensity",
    metavar="DIMENSION",
    help="Dimension of the files with the intensity, such as Amplitude; not read for kind none.",
)
@click.option(
    "--intensity-kind",
    type=click.Choice(["amplitude", "reflectance", "linear", "none"]),
    required=True,
    help="amplitude: dB, decreases with range. reflectance: dB, range corrected by the manufacturer. "
    "linear: counts. none: no intensity.",
)
@click.pass_obj
def add(
    settings: Settings,
    name: str,
    tunnel: str,
    date: dt.datetime,
    trajectory: Path | None,
    stations: tuple[Path, ...],
    no_poses: bool,
    backwards: bool,
    time_offset: float | None,
    unit: str | None,
    height_unit: str | None,
    reference: str | None,
    intensity: str | None,
    intensity_kind: str,
) -> None:
    """Add the survey NAME."""
    from tunneldb.store.catalog import Intensity, add_survey

    if [trajectory is not None, bool(stations), no_poses].count(True) != 1:
        raise UserError(
            "give exactly one of --trajectory FILE and --stations FILE, or --no-poses if the scanner positions are unknown"
        )
    if backwards and trajectory is None:
        raise UserError("--backwards is about a trajectory; stations have no direction: omit it")
    if time_offset is not None and trajectory is None:
        raise UserError("--time-offset is about a trajectory: give it with --trajectory")
    if intensity_kind == "none":
        intensity = None
    elif intensity is None:
        raise UserError(f"--intensity must name the dimension that holds the {intensity_kind}")
    with connect(settings.dsn) as connection:
        positions = add_survey(
            connection,
            name,
            tunnel,
            date.date(),
            None if no_poses else stations if trajectory is None else (trajectory,),
            mobile=trajectory is not None,
            backwards=backwards,
            reference="auto" if reference == "auto" else None if reference is None else file_path(reference),
            intensity=Intensity(intensity_kind, intensity),
            time_offset=time_offset or 0.0,
            units=_units(unit, height_unit, no_poses),
        )
    notes = [*positions.notes, *([UNPOSED] if no_poses and intensity is not None else [])]
    add_to_json(survey=name, tunnel=tunnel, date=date.date(), poses=len(positions), notes=notes)
    known = "no scanner positions" if no_poses else f"{len(positions)} {'poses' if trajectory else 'stations'}"
    notify(f"{name}: {known} of {tunnel}, {date:%Y-%m-%d}")
    for note in notes:
        notify(f"{name}: {note}")


@survey.command(
    "set",
    examples=[
        "tunneldb survey set ringo-2024 --date 2024-05-05",
        "tunneldb survey set ringo-2024 --trajectory trajectory-fixed.csv",
        "tunneldb survey set ringo-2024 --intensity-kind linear --reference auto",
    ],
)
@click.argument("name")
@click.option("--date", type=DAY, metavar="YYYY-MM-DD", help="Date of the scan.")
@click.option("--trajectory", type=FILE, help="Replaces the scanner positions; as for survey add.")
@click.option("--stations", type=FILE, multiple=True, help="Likewise for a static scanner; may be repeated.")
@click.option("--backwards", is_flag=True, help="The trajectory was driven down-chainage.")
@click.option(
    "--time-offset", type=FINITE, metavar="SECONDS", help="Seconds to add to the times in the trajectory's file; 0 removes it."
)
@unit_options("the files of --trajectory and --stations")
@click.option(
    "--accept-poses",
    is_flag=True,
    help="Load files although their points do not fit the scanner positions, with a remark in all results; until other "
    "positions are set.",
)
@click.option("--reference", metavar="FILE|auto", help="Intensity of the scanner by range, as for survey add.")
@click.option("--intensity", metavar="DIMENSION", help="Dimension with the intensity; the files must be loaded again.")
@click.option("--intensity-kind", type=click.Choice(["amplitude", "reflectance", "linear", "none"]), help="What it is.")
@click.pass_obj
def set_(
    settings: Settings,
    name: str,
    date: dt.datetime | None,
    trajectory: Path | None,
    stations: tuple[Path, ...],
    backwards: bool,
    time_offset: float | None,
    unit: str | None,
    height_unit: str | None,
    accept_poses: bool,
    reference: str | None,
    intensity: str | None,
    intensity_kind: str | None,
) -> None:
    """Change the settings of the survey NAME; results that depend on them become stale.

    Points, axis, sections and reviews stay.
    """
    from tunneldb.pipeline.pose_check import check_loaded_points
    from tunneldb.store.catalog import SurveyChange, set_survey

    if trajectory is not None and stations:
        raise UserError("--trajectory and --stations exclude each other: omit one of them")
    if backwards and trajectory is None:
        raise UserError("--backwards is about a trajectory: give it with --trajectory")
    if time_offset is not None and stations:
        raise UserError("--time-offset is about a trajectory; stations have no times: omit it")
    change = SurveyChange(
        None if date is None else date.date(),
        (trajectory,) if trajectory is not None else stations,
        trajectory is not None,
        backwards,
        time_offset,
        "auto" if reference == "auto" else None if reference is None else file_path(reference),
        intensity_kind,
        intensity,
        _units(unit, height_unit, trajectory is None and not stations),
        accept_poses,
    )
    if change == SurveyChange():
        raise UserError(
            "nothing to set: give --date, --trajectory, --stations, --time-offset, --accept-poses, --reference, --intensity or"
            " --intensity-kind"
        )
    with connect(settings.dsn) as connection:
        notes, reload = set_survey(connection, name, change)
        if change.poses or time_offset is not None:
            notes += filter(None, [check_loaded_points(connection, get_survey(connection, name, site=True))])
        stale = count_stale(connection, get_survey(connection, name, site=True).id)
    if reload:
        notes.append(f"{counted(reload, 'file has', 'files have')} to be loaded again: tunneldb load {name} FILE...")
    if stale:
        notes.append(f"{counted(stale, 'stage is', 'stages are')} stale: tunneldb run {name} --stale")
    add_to_json(survey=name, notes=notes, reload=reload, stale=stale)
    notify(f"{name}: set")
    for note in notes:
        notify(f"{name}: {note}")


def _units(unit: str | None, height_unit: str | None, without_files: bool) -> Units:
    """Units of the scanner positions in files."""
    if without_files and (unit or height_unit):
        raise UserError("--unit and --height-unit are of positions: give --trajectory or --stations")
    return Units(unit or "m", height_unit or unit or "m")


@survey.command(
    "remove-file",
    examples=["tunneldb survey remove-file ringo-2024 km-512.laz"],
    wrong="nothing was removed: the answer was no",
)
@click.argument("name", metavar="SURVEY")
@click.argument("files", nargs=-1, required=True, type=FILE, metavar="FILES...")
@click.option("--yes", is_flag=True, help="Do not ask.")
@click.pass_obj
def remove_file(settings: Settings, name: str, files: tuple[Path, ...], yes: bool) -> None:
    """Remove FILES, by their names, from SURVEY, as if they had never been loaded.

    Overlapping files are read again, and their kilometres loaded without the removed ones. A kilometre without points
    loses its results; if it has reviewed leaks or moved vertices, the command asks first. Findings that people drew,
    redrew, split or merged are kept. A file that a batch could not read is removed from its list. After an
    interruption, repeat the command.
    """
    from tunneldb.pipeline.remove import known_names, remove_files, work_at_stake
    from tunneldb.pipeline.site_files import remove_site_files

    names = list(dict.fromkeys(path.name for path in files))
    with connect(settings.dsn) as connection:
        found = get_survey(connection, name, site=True)
        known_names(connection, found, names)
        if found.site:
            connection.rollback()
            remove_site_files(connection, found, names)
            add_to_json(survey=name, files=names)
            notify(f"{name}: removed {', '.join(names)}; find its members anew: tunneldb members {name}")
            return
        emptied, work = work_at_stake(connection, found, names)
        connection.rollback()
        if (work.reviewed or work.edited) and not yes:
            kms = ", ".join(map(str, emptied))
            question = (
                f"Kilometre {kms} will have no points. Removed: {_areas(work.anomalies)}, {work.reviewed} of them reviewed, and"
                f" {counted(work.edited, 'axis vertex', 'axis vertices')} moved by hand. Kept:"
                f" {counted(work.drawn, 'finding')} drawn by hand. Remove {', '.join(names)}?"
            )
            if not click.confirm(question, err=True):
                raise click.Abort
        with bar("points") as progress:
            removed = remove_files(connection, found, names, step(progress))
        stale = count_stale(connection, found.id)
    add_to_json(
        survey=name,
        files=names,
        reread=removed.reread,
        kilometres=removed.kilometres,
        emptied=removed.emptied,
        anomalies=removed.lost.anomalies,
        reviewed=removed.lost.reviewed,
        edited=removed.lost.edited,
        kept=removed.lost.drawn,
        stale=stale,
    )
    again = f"; read again: {', '.join(removed.reread)}" if removed.reread else ""
    notify(f"{name}: removed {', '.join(names)}{again}")
    if removed.emptied:
        lost = removed.lost
        notify(
            f"{name}: no points are left in kilometre {', '.join(map(str, removed.emptied))}, and all that was made of them is"
            f" gone: {_areas(lost.anomalies)}, {lost.reviewed} of them reviewed;"
            f" {counted(lost.drawn, 'finding drawn by hand is', 'findings drawn by hand are')} kept"
        )
    if stale:
        notify(f"{name}: {counted(stale, 'stage is', 'stages are')} stale: tunneldb run {name} --stale")


@survey.command("list", examples=["tunneldb survey list"])
@click.pass_obj
def list_(settings: Settings) -> None:
    """List the surveys."""
    with connect(settings.dsn) as connection:
        rows = list_surveys(connection)
    names = (
        "name", "tunnel", "date", "platform", "intensity_kind", "files", "points", "label_from", "label_to",
    )  # fmt: skip
    add_to_json(surveys=records(names, rows))
    header = ["survey", "tunnel", "date", "platform", "intensity", "files", "points", "from", "to"]
    print_table(header, rows, right=(5, 6, 7, 8))


@survey.command(examples=["tunneldb survey remove ringo-2024"], wrong="it was not removed: the answer was no")
@click.argument("name")
@click.option("--yes", is_flag=True, help="Do not ask.")
@click.pass_obj
def remove(settings: Settings, name: str, yes: bool) -> None:
    """Remove the survey NAME with its points, sections, images, leaks and their reviews."""
    from tunneldb.store.catalog import remove_survey

    with connect(settings.dsn) as connection:
        found = get_survey(connection, name, site=True)
        held = count_holdings(connection, found.id)
        connection.rollback()
        question = (
            f"Remove {name} with {counted(held.points, 'point')} and {_areas(held.findings)}, {held.reviewed} of them reviewed?"
        )
        if not yes and not click.confirm(question, err=True):
            raise click.Abort
        remove_survey(connection, name)
    add_to_json(survey=name, points=held.points, anomalies=held.findings, reviewed=held.reviewed)


def _areas(count: int) -> str:
    """Return a number of detected areas in words."""
    return counted(count, "leak or dry dark area", "leaks and dry dark areas")
