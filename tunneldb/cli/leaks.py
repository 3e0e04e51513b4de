"""The verb ``leaks``."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import click
from rich.console import Console

from tunneldb.cli.main import Settings
from tunneldb.database import connect, get_survey
from tunneldb.errors import UserError
from tunneldb.export.atomic import replacing
from tunneldb.export.leaks import Geometry, Leak, as_csv, as_geojson, as_table, read_leaks, write_gpkg
from tunneldb.job.run import loaded_kilometres, parse_km

_BY_SUFFIX = {".csv": "csv", ".geojson": "geojson", ".json": "geojson", ".gpkg": "gpkg"}
_WIDTH = 160


@click.command()
@click.argument("survey")
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
@click.option("--min-area", type=click.FloatRange(min=0), default=0.0, metavar="M2", help="Only leaks of at least so many m².")
@click.pass_obj
def leaks(
    settings: Settings, survey: str, geometry: str, form: str | None, output: Path | None, km: str | None, min_area: float
) -> None:
    """List the leaks of SURVEY, or export them."""
    chosen = cast(Geometry, geometry)
    form = form or (_BY_SUFFIX.get(output.suffix.lower(), "table") if output else "table")
    if form == "gpkg" and output is None:
        raise UserError("a GeoPackage needs a file to be written to: add -o leaks.gpkg")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        kilometres = parse_km(km, loaded_kilometres(conn, found)) if km else None
        rows = read_leaks(conn, found, chosen, kilometres, min_area)
    if output is None:
        _print(rows, form, chosen, found.srid, found.name)
        return
    with replacing(output) as temporary:
        if form == "gpkg":
            write_gpkg(temporary, rows, chosen, found.srid)
        else:
            temporary.write_text(_text(rows, form, chosen, found.srid, found.name), encoding="utf-8")
    click.echo(f"{len(rows)} leaks to {output}", err=True)


def _print(rows: list[Leak], form: str, geometry: Geometry, srid: int, name: str) -> None:
    if form == "table":
        console = Console()
        if not console.is_terminal:
            console = Console(width=_WIDTH)
        console.print(as_table(rows, name))
    else:
        click.echo(_text(rows, form, geometry, srid, name), nl=False)


def _text(rows: list[Leak], form: str, geometry: Geometry, srid: int, name: str) -> str:
    if form == "csv":
        return as_csv(rows)
    if form == "geojson":
        return as_geojson(rows, geometry, srid)
    console = Console(width=_WIDTH, record=True, quiet=True)
    console.print(as_table(rows, name))
    return console.export_text()
