"""The verb ``leaks``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import cast

import click
import psycopg
from rich.console import Console

from tunneldb.cli.main import Settings
from tunneldb.cli.output import records, tell, verb
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.export.tables.leaks import (
    Anomaly,
    Geometry,
    Kind,
    as_csv,
    as_geojson,
    as_table,
    read_leaks,
    total,
    write_gpkg,
)
from tunneldb.files import replacing
from tunneldb.pipeline.run import loaded_kilometres, parse_km
from tunneldb.store.survey import Survey, get_survey

_BY_SUFFIX = {".csv": "csv", ".geojson": "geojson", ".json": "geojson", ".gpkg": "gpkg"}
_WIDTH = 1000  # a pipe or a file has no width: nothing is to be cut there
_HOUR = r"(1[0-2]|[1-9])(?::([0-5]\d))?"
_CLOCK = re.compile(rf"{_HOUR}-{_HOUR}")


@verb(
    examples=[
        "tunneldb leaks ringo-2024",
        "tunneldb leaks ringo-2024 --from 511+700 --to 511+800 --clock 10-2 --min-area 0.1",
        "tunneldb leaks ringo-2024 -o leaks.gpkg --geometry 3d",
        "tunneldb leaks ringo-2024 --by-km",
    ]
)
@click.argument("survey")
@click.option(
    "--kind",
    type=click.Choice(["leak", "joint", "dark", "all"]),
    default="leak",
    show_default=True,
    help="What to list: leaks, joints, what else is dark but dry, or all of it.",
)
@click.option(
    "--geometry",
    type=click.Choice(["unrolled", "map", "3d"]),
    default="unrolled",
    show_default=True,
    help="Coordinates: chainage and arc; the strip on the map beside the axis; on the lining in space.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "geojson", "gpkg"]),
    help="Default: by the ending of -o, else a table.",
)
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="File to write.")
@click.option("--km", metavar="A-B", help="Only these kilometres: 12 or 12-14.")
@stretch_options
@click.option("--clock", metavar="A-B", help="Only those between these hours, clockwise; 12 is the crown: 10-2 or 10:30-1:30.")
@click.option("--min-area", type=click.FloatRange(min=0), default=0.0, metavar="M2", help="Only those of at least so many m².")
@click.option("--by-km", is_flag=True, help="Leaks of each kilometre summed up instead, with its class of waterproofing.")
@click.pass_obj
def leaks(
    settings: Settings,
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
    by_km: bool,
) -> None:
    """List the leaks of SURVEY, or what else is dark on its lining, or export them.

    Of a stretch those are listed that reach into it; of hours of the clock, looking up-chainage, those whose middle lies there.

    With --by-km a line for each kilometre: wet area and number of leaks, the most in any 100 m² of lining, and the best
    class of GB 50108-2008 that the lining seen keeps, as far as a scan can tell. Any other stretch, and what breaks a
    class: SELECT * FROM tunnel_api.waterproof_class(survey, from, to).
    """
    chosen, what = cast(Geometry, geometry), cast(Kind, kind)
    form = form or (_BY_SUFFIX.get(output.suffix.lower(), "table") if output else "table")
    if form == "gpkg" and output is None:
        raise UserError("a GeoPackage needs a file to be written to: add -o leaks.gpkg")
    parted = start is not None or end is not None or clock is not None
    if by_km and (output is not None or form != "table" or kind != "leak" or min_area > 0 or parted):
        raise UserError("--by-km prints a table of all leaks; elsewhere read the view tunnel_api.km_waterproof")
    hours = parse_clock(clock) if clock else None
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        if found.intensity_kind == "none":
            click.echo(f"survey {survey} has no intensity: leaks were not sought", err=True)
        if found.note:
            tell(note=found.note)
            click.echo(f"survey {survey}: {found.note}", err=True)
        kilometres = parse_km(km, loaded_kilometres(conn, found)) if km else None
        if by_km:
            _print_classes(conn, found, kilometres)
            return
        stretch = parse_stretch(conn, found, start, end)
        rows = read_leaks(conn, found, chosen, kilometres, min_area, what, stretch.low, stretch.high, hours)
    tell(survey=survey, kind=kind, count=len(rows), area=sum(row.area for row in rows))
    if output is None:
        tell(geometry=geometry, leaks=rows)
        _print(rows, form, chosen, what, found)
        return
    with replacing(output) as temporary:
        if form == "gpkg":
            write_gpkg(temporary, rows, chosen, found.srid, what)
        else:
            temporary.write_text(_text(rows, form, chosen, what, found), encoding="utf-8")
    tell(file=output)
    click.echo(f"{total(rows, what)} to {output}", err=True)


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


def _print_classes(conn: psycopg.Connection, survey: Survey, kilometres: list[int] | None) -> None:
    rows = conn.execute(
        "SELECT km, lining_area, seen_share, wet_area, 1000 * wet_ratio, patches, largest_area, window_patches, class"
        " FROM tunnel_api.km_waterproof WHERE survey_id = %(survey)s AND (%(km)s::int[] IS NULL OR km = ANY (%(km)s))"
        " ORDER BY km",
        {"survey": survey.id, "km": kilometres},
    ).fetchall()
    names = (
        "km", "lining_area", "seen_share", "wet_area", "wet_per_mille", "patches", "largest_area", "window_patches", "class",
    )  # fmt: skip
    tell(survey=survey.name, kilometres=records(names, rows))
    header = ("km", "lining m²", "seen %", "wet m²", "wet ‰", "leaks", "largest m²", "in 100 m²", "class")
    formats = ("d", ".0f", ".1%", ".2f", ".2f", "d", ".2f", "d", "d")
    lines = [
        ["-" if value is None else format(value, form).removesuffix("%") for value, form in zip(row, formats, strict=True)]
        for row in rows
    ]
    print_table(header, lines, right=range(len(header)))


def _print(rows: list[Anomaly], form: str, geometry: Geometry, kind: Kind, survey: Survey) -> None:
    if form == "table":
        console = Console()
        if console.is_terminal:
            console.print(as_table(rows, survey.name, kind, console.width))
        else:
            Console(width=_WIDTH).print(as_table(rows, survey.name, kind))
    else:
        click.echo(_text(rows, form, geometry, kind, survey), nl=False)


def _text(rows: list[Anomaly], form: str, geometry: Geometry, kind: Kind, survey: Survey) -> str:
    if form == "csv":
        return as_csv(rows)
    if form == "geojson":
        return as_geojson(rows, geometry, survey.srid, kind)
    console = Console(width=_WIDTH, record=True, quiet=True)
    console.print(as_table(rows, survey.name, kind))
    return console.export_text()
