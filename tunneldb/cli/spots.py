"""The command ``spots``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from tunneldb.cli.coverage import say_no_crs
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.tables import print_table, table_format
from tunneldb.database import connect
from tunneldb.files import replacing
from tunneldb.store.survey import get_survey

if TYPE_CHECKING:
    from tunneldb.store.spots import Geometry, SpotList


@command(
    examples=[
        "tunneldb spots hall-2024",
        "tunneldb spots hall-2024 --kind dark --min-area 0.01 -o spots.gpkg --geometry 3d",
    ],
    wrong="done, but members were never looked for, or files or settings have changed since: what, is said first",
)
@click.argument("survey")
@click.option(
    "--kind",
    type=click.Choice(["dark", "bright", "all"]),
    default="all",
    show_default=True,
    help="Dark or bright against their own surface.",
)
@click.option(
    "--geometry",
    type=click.Choice(["face", "map", "3d"]),
    default="face",
    show_default=True,
    help="Coordinates: plane of the face (pipes unrolled); map; space.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "geojson", "gpkg"]),
    help="Default: by the ending of -o, otherwise a table.",
)
@click.option("-o", "--output", type=FilePath(dir_okay=False), help="File to write.")
@click.option("--min-area", type=FiniteRange(min=0), default=0.0, metavar="M2", help="Least area, m².")
@click.option(
    "--min-confidence",
    type=FiniteRange(0, 1),
    default=0.0,
    metavar="SHARE",
    help="Least confidence, 0 to 1.",
)
@click.pass_context
def spots(
    context: click.Context,
    survey: str,
    kind: str,
    geometry: str,
    form: str | None,
    output: Path | None,
    min_area: float,
    min_confidence: float,
) -> None:
    """List spots on the members of SURVEY that are dark or bright against their own surface, or export them.

    First it states the part of the faces that could not be judged, and changes of files or settings since tunneldb
    members. Rejected spots, and confirmed ones that the last run did not find, are listed and not counted.
    """
    from tunneldb.export.tables.spots import as_csv, as_geojson, write_gpkg
    from tunneldb.store.spots import Kind, SpotSelection, read_spots

    settings: Settings = context.obj
    chosen = cast("Geometry", geometry)
    form = table_format(form, output, "spots", ("csv", "geojson", "gpkg"))
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey, site=True)
        listed = read_spots(conn, found, chosen, SpotSelection(cast(Kind, kind), min_area, min_confidence))
    add_to_json(survey=survey, statement=listed.statement, count=listed.count, area=listed.area, face_area=listed.face_area)
    add_to_json(seen_area=listed.seen_area, geometry=geometry, spots=listed.rows, file=output)
    if form == "geojson" and chosen != "face":
        say_no_crs(found.srid)
    if listed.statement:
        click.echo(f"survey {survey}: {listed.statement}", err=form != "table")
    if form == "table":
        _print(listed)
    elif output is None:
        click.echo(as_csv(listed) if form == "csv" else as_geojson(listed, chosen, found.srid), nl=False)
    else:
        with replacing(output) as temporary:
            if form == "gpkg":
                write_gpkg(temporary, listed, chosen, found.srid)
            else:
                text = as_csv(listed) if form == "csv" else as_geojson(listed, chosen, found.srid)
                temporary.write_text(text, encoding="utf-8")
        notify(f"{listed.total} to {output}")
    if not listed.searched:
        context.exit(1)


def _print(listed: SpotList) -> None:
    rows = [
        [
            str(spot.number), "" if spot.member is None else f"{spot.member} {spot.member_kind}", spot.label or "", spot.kind,
            f"{1e4 * spot.area:.0f}", f"{spot.difference:.1f}", f"{spot.contrast:.1f}", f"{spot.confidence:.2f}",
            ", ".join(spot.reasons), spot.review if spot.detected else f"{spot.review}, not found again",
        ]
        for spot in listed.rows
    ]  # fmt: skip
    if rows:
        header = ["number", "member", "chainage", "kind", "cm²", "dB", "σ", "confidence", "shape", "review"]
        print_table(header, rows, right=(0, 4, 5, 6, 7))
    click.echo(listed.total)
