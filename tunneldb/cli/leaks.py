"""The command ``leaks``."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import cast

import click
import psycopg
from rich.console import Console

from tunneldb.cli.coverage import say_coverage, say_no_crs, say_remarks
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify, records
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.past import as_of_option, connect_as_of
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table, table_format
from tunneldb.errors import UserError
from tunneldb.export.tables.leak_files import as_csv, as_geojson, as_record, write_gpkg
from tunneldb.export.tables.leaks import as_table
from tunneldb.export.tables.workbooks import write_leaks
from tunneldb.files import replacing
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.numerals import percent_number
from tunneldb.stages.run import loaded_kilometres, parse_km
from tunneldb.store.coverage import read_coverage
from tunneldb.store.dry_regions import DryRegion, read_dry_regions
from tunneldb.store.findings import Geometry
from tunneldb.store.leaks import Kind, LeakList, Selection, read_leaks
from tunneldb.store.listing import list_leak_statistics
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey, get_survey

_WIDTH = 1000  # a pipe or a file has no width: nothing is to be cut there
_HOUR = r"(1[0-2]|[1-9])(?::([0-5][0-9]))?"
_CLOCK = re.compile(rf"{_HOUR}-{_HOUR}")


@command(
    examples=[
        "tunneldb leaks ringo-2024",
        "tunneldb leaks ringo-2024 --from 511+700 --to 511+800 --clock 10-2 --min-area 0.1",
        "tunneldb leaks ringo-2024 --min-confidence 0.8 -o leaks.gpkg --geometry 3d",
        "tunneldb leaks ringo-2024 -o leaks.xlsx",
        "tunneldb leaks ringo-2024 --by-km",
    ],
    wrong="done, but not all that was asked for has been searched for leaks, or nothing of it was seen: what, is said first",
)
@click.argument("survey")
@click.option(
    "--kind",
    type=click.Choice(["leak", "joint", "dark", "all"]),
    default="leak",
    show_default=True,
    help="Kind to list: leaks, joints, dry dark areas, or all.",
)
@click.option(
    "--geometry",
    type=click.Choice(["unrolled", "map", "3d"]),
    default="unrolled",
    show_default=True,
    help="Coordinates: chainage and arc; map strip beside the axis; on the lining in space.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "geojson", "gpkg", "xlsx"]),
    help="Default: by the ending of -o, otherwise a table.",
)
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write.")
@click.option("--km", metavar="A-B", help="Only these kilometres: 12 or 12-14.")
@stretch_options
@click.option(
    "--clock", metavar="A-B", help="Only between these clock positions, clockwise; 12 is the crown: 10-2 or 10:30-1:30."
)
@click.option("--min-area", type=FiniteRange(min=0), default=0.0, metavar="M2", help="Least area, m².")
@click.option(
    "--min-confidence",
    type=FiniteRange(0, 1),
    default=0.0,
    metavar="SHARE",
    help="Least confidence, 0 to 1; excludes leaks without a confidence.",
)
@click.option("--by-km", is_flag=True, help="Sums of each kilometre instead, with its class of waterproofing.")
@as_of_option
@click.pass_context
def leaks(
    context: click.Context,
    survey: str,
    kind: str,
    geometry: str,
    form: str | None,
    output: Path | None,
    km: str | None,
    start: str | None,
    end: str | None,
    clock: str | None,
    min_area: float,
    min_confidence: float,
    by_km: bool,
    moment: dt.datetime | None,
) -> None:
    """List the leaks of SURVEY, or other dark areas of its lining, or export them.

    With a range or kilometres, overlapping leaks are listed, and their area is summed inside it; with clock positions
    (looking up-chainage), leaks with their middle there. Rejected leaks, and confirmed ones that the last detection
    did not find, are listed and not counted.

    First it states where leaks could be missed: stretches not loaded, not searched, failed, outdated, or less than
    half inspected; then notes and limitations: data left out, interpolated, in doubt. The same is in every file; see
    tunnel_api.coverage_gap and tunnel_api.remark.

    In the table, arc is counted from the crown, to the right looking up-chainage. clock is the position of the
    middle: 12:00 is the crown, 3:00 right. conf. is the probability of the detected kind, 0 to 1. drop is the mean
    darkening below dry lining, max the greatest, and contrast the mean darkening in standard deviations of the local
    dry lining. image is the share of its area with measurements.

    --by-km prints a line for each kilometre and one for all: wet area, number of leaks, the most in any 100 m² of
    lining, and the best class of GB 50108-2008 that the inspected lining meets. For another range: SELECT * FROM
    tunnel_api.waterproof_class(survey, from, to).
    """
    settings: Settings = context.obj
    chosen = cast(Geometry, geometry)
    form = table_format(form, output, "leaks", ("table", "csv", "geojson", "gpkg", "xlsx"))
    filtered = start is not None or end is not None or clock is not None or min_area > 0 or min_confidence > 0
    if by_km and (output is not None or form != "table" or kind != "leak" or filtered):
        raise UserError("--by-km prints a table of all leaks; elsewhere read the view tunnel_api.km_waterproof")
    hours = parse_clock(clock) if clock else None
    with connect_as_of(settings.dsn, survey, moment) as conn:
        found = get_survey(conn, survey)
        if found.note:
            add_to_json(note=found.note)
        kilometres = parse_km(km, loaded_kilometres(conn, found)) if km else None
        stretch = parse_stretch(conn, found, start, end)
        low, high = stretch.low, stretch.high
        if kilometres:
            low, high = max(low, kilometres[0] * KILOMETRE), min(high, (kilometres[-1] + 1) * KILOMETRE)
        if low >= high:
            raise UserError(f"--km {km} and the stretch asked for have nothing in common")
        if by_km:
            coverage = read_coverage(conn, found, low, high)
            say_coverage(coverage, found, on_stdout=True)
            say_remarks(read_remarks(conn, found, low, high), found)
            _print_classes(conn, found, low, high)
        else:
            listed = read_leaks(conn, found, chosen, Selection(cast(Kind, kind), low, high, hours, min_area, min_confidence))
            coverage = listed.coverage
            say_remarks(listed.remarks, found)
            if output is None:
                say_coverage(coverage, found, on_stdout=form == "table")
                _print(listed, form, chosen, found)
            else:
                regions = read_dry_regions(conn, found, low, high) if form == "xlsx" else []
                _write_file(listed, form, chosen, found, output, regions)
                say_coverage(coverage, found)
                notify(f"{listed.total} to {output}")
            if form == "geojson" and chosen != "unrolled":
                say_no_crs(found.srid)
            add_to_json(survey=survey, kind=listed.kind, count=listed.count, area=listed.area, listed=len(listed.rows))
    if not coverage.complete:
        context.exit(1)


def _write_file(
    listed: LeakList, form: str, geometry: Geometry, survey: Survey, output: Path, regions: Sequence[DryRegion]
) -> None:
    with replacing(output) as temporary:
        if form == "gpkg":
            write_gpkg(temporary, listed, geometry, survey.srid)
        elif form == "xlsx":
            write_leaks(temporary, survey.name, listed, regions)
        else:
            temporary.write_text(_text(listed, form, geometry, survey), encoding="utf-8")
    add_to_json(file=output)


def parse_clock(text: str) -> tuple[float, float]:
    """Return the hours of a part of the clock given as ``10-2`` or ``10:30-1:30``.

    Raises
    ------
    UserError
        When it is no such part.
    """
    part = _CLOCK.fullmatch(text.strip())
    if part is None:
        raise UserError(f"--clock takes hours from 1 to 12, as 10-2 or 10:30-1:30, not {text!r}")
    hours = [int(part[n]) % 12 + int(part[n + 1] or 0) / 60 for n in (1, 3)]
    if hours[0] == hours[1]:
        raise UserError(f"--clock {text} is one position; give two, as 10-2")
    return hours[0], hours[1]


_BY_KM = (
    ("lining_area", "lining m²", ".0f"),
    ("seen_share", "seen %", "%"),
    ("wet_area", "wet m²", ".2f"),
    ("wet_per_mille", "wet ‰", ".2f"),
    ("patches", "leaks", "d"),
    ("largest_area", "largest m²", ".2f"),
    ("window_patches", "in 100 m²", "d"),
    ("class", "class", "d"),
    ("undecided_area", "undecided m²", ".2f"),
    ("class_if_wet", "class if wet", "d"),
)
"""Name in JSON, heading and format of what is stated of each kilometre."""


def _print_classes(conn: psycopg.Connection, survey: Survey, low: float, high: float) -> None:
    rows, total = list_leak_statistics(conn, survey, low, high, [name for name, _, _ in _BY_KM])
    names = ["km", *(name for name, _, _ in _BY_KM)]
    kilometres = [{**row, "km": int(row["km"])} for row in records(names, rows)]
    add_to_json(survey=survey.name, kilometres=kilometres, total=records(names, total)[0] if total else None)
    formats = [form for _, _, form in _BY_KM]
    lines = [
        [km, *(_shown(value, form) for value, form in zip(values, formats, strict=True))] for km, *values in [*rows, *total]
    ]
    header = ["km", *(heading for _, heading, _ in _BY_KM)]
    print_table(header, lines, right=range(len(header)))


def _shown(value: float | None, form: str) -> str:
    if value is None:
        return "-"
    return percent_number(value) if form == "%" else format(value, form)


def _print(listed: LeakList, form: str, geometry: Geometry, survey: Survey) -> None:
    add_to_json(geometry=geometry, leaks=[as_record(leak) for leak in listed.rows])
    if form != "table":
        click.echo(_text(listed, form, geometry, survey), nl=False)
    elif listed.rows or listed.coverage.seen_area:
        console = Console()
        if console.is_terminal:
            console.print(as_table(listed, survey.name, console.width))
        else:
            Console(width=_WIDTH).print(as_table(listed, survey.name))


def _text(listed: LeakList, form: str, geometry: Geometry, survey: Survey) -> str:
    if form == "csv":
        return as_csv(listed)
    if form == "geojson":
        return as_geojson(listed, geometry, survey.srid)
    written = StringIO()
    console = Console(width=_WIDTH, file=written)
    if listed.coverage.statement is not None:
        console.print(listed.coverage.statement, markup=False, highlight=False, soft_wrap=True)
    console.print(as_table(listed, survey.name))
    return written.getvalue()
