"""`tunneldb survey sizes`."""

from __future__ import annotations

import click
from rich.filesize import decimal

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify, records
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.store.listing import list_sizes
from tunneldb.store.survey import get_survey

KINDS = ("points", "images", "sections", "results", "runs", "inputs")


@command("sizes", examples=["tunneldb survey sizes", "tunneldb survey sizes ringo-2024 --json"])
@click.argument("name", required=False, metavar="[SURVEY]")
@click.pass_obj
def sizes(settings: Settings, name: str | None) -> None:
    """Show the disk space of each survey, or of SURVEY.

    Points and images have tables for each survey. Values with ≈ are the survey's share of common tables, estimated
    from the last ANALYZE. inputs: files, scanner positions, goals.
    """
    with connect(settings.dsn) as connection:
        survey_id = None if name is None else get_survey(connection, name, site=True).id
        rows, database = list_sizes(connection, survey_id)
    names = ("survey", "kind", "rows", "bytes", "estimated")
    add_to_json(sizes=records(names, rows), database_bytes=database)
    table: dict[str | None, dict[str, tuple[int, bool]]] = {}
    for survey, kind, _, size, estimated in rows:
        there, about = table.setdefault(survey, {}).get(kind, (0, False))
        table[survey][kind] = (there + size, about or estimated)
    print_table(
        ["survey", *KINDS, "total"],
        [
            ["(unknown survey)" if survey is None else survey, *(_cell(found.get(kind)) for kind in KINDS), _total(found)]
            for survey, found in table.items()
        ],
        right=range(1, len(KINDS) + 2),
    )
    if name is None:
        click.echo(f"database: {decimal(database)}")
    if None in table:
        notify("unknown survey: tables that were never analyzed; tunneldb vacuum --yes analyzes them")


def _cell(found: tuple[int, bool] | None) -> str:
    return "" if found is None else ("≈ " if found[1] and found[0] else "") + decimal(found[0])


def _total(found: dict[str, tuple[int, bool]]) -> str:
    return _cell((sum(size for size, _ in found.values()), any(about for _, about in found.values())))
