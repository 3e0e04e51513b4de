"""`tunneldb status`."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from typing import Any

import click
import psycopg
from rich.console import Console

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, printable, records, wants_json
from tunneldb.cli.param_types import FiniteRange
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.database.broken import broken_rows
from tunneldb.database.locks import lock_waits
from tunneldb.errors import UserError
from tunneldb.stages.registry import STAGE_NAMES
from tunneldb.store.listing import describe_survey, list_progress
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import get_survey

AT_ONCE = 50
"""Surveys whose stages are asked for together: of more, what is reckoned of them leaves the processor's cache."""


@command(examples=["tunneldb status", "tunneldb status pajares-2026 --watch", "tunneldb status pajares-2026 --json"])
@click.argument("survey", required=False)
@click.option("--watch", is_flag=True, help="Refresh until nothing is left to do, or Ctrl-C.")
@click.option(
    "--interval",
    type=FiniteRange(0.1, 3600.0),
    default=2.0,
    show_default=True,
    metavar="S",
    help="Interval of --watch, seconds.",
)
@click.pass_obj
def status(settings: Settings, survey: str | None, watch: bool, interval: float) -> None:
    """Show stages done in each kilometre of SURVEY, files, workers, speed and remaining time; or a summary of all.

    \b
    done         the result is in the database
    running      in progress
    queued       ready: the next free worker takes it
    waits        for an earlier stage, of this kilometre or of a neighbour
    failed       the reason is beside it
    stale        done, but its input has changed since
    interrupted  the program that ran it is gone
    never        not yet run
    empty        the kilometre holds no points, and awaits none
    """  # noqa: D301 - \b is click's
    if watch and survey is None:
        raise UserError("--watch is for one survey: tunneldb status SURVEY --watch")
    if watch and wants_json():
        raise UserError("--watch draws again and again; --json is one look: leave --watch out")
    with connect(settings.dsn) as connection:
        if survey is None:
            _all(connection)
            return
        get_survey(connection, survey, site=True)
        if not watch:
            _one(connection, survey)
            return
    from tunneldb.cli.watch import watch as look_on

    with suppress(KeyboardInterrupt):
        look_on(settings.dsn, survey, interval)


def _all(connection: psycopg.Connection[Any]) -> None:
    """Print a line for each survey: loaded data, and the number of kilometres that each stage has done."""
    rows = list_progress(connection, STAGE_NAMES, AT_ONCE)
    names = ("name", "tunnel", "date", "files", "points", "label_from", "label_to", "kilometres", "done")
    add_to_json(
        surveys=[row | {"done": dict(zip(STAGE_NAMES, row["done"] or (), strict=False))} for row in records(names, rows)]
    )
    table = [[*fixed, there, *(done or [None] * len(STAGE_NAMES))] for *fixed, there, done in rows]
    print_table(
        ["survey", "tunnel", "date", "files", "points", "from", "to", "km", *STAGE_NAMES],
        table,
        right=range(3, 8 + len(STAGE_NAMES)),
    )
    if not rows:
        click.echo("there is no survey yet: tunneldb tunnel add, then tunneldb survey add")


def _one(connection: psycopg.Connection[Any], survey: str) -> None:
    from tunneldb.cli.overview import render
    from tunneldb.queue.progress import overview

    key = get_survey(connection, survey, site=True)
    broken = [f"{row.name}: {row.fault}" for row in broken_rows(connection, key.id)]
    waits = lock_waits(connection)
    add_to_json(broken=broken, waits=waits)
    for line in broken[:1]:
        click.echo(f"Error: {printable(line)}{f', and {len(broken) - 1} more' if broken[1:] else ''}; tunneldb check")
    for line in waits:
        click.echo(f"Note: {printable(line)}")
    seen = overview(connection, survey)
    add_to_json(**{field.name: getattr(seen, field.name) for field in dataclasses.fields(seen)})
    rows = describe_survey(connection, survey)
    print_table(["survey", "tunnel", "date", "files", "points", "from", "to"], rows, right=(3, 4, 5, 6))
    if seen.kilometres or seen.files:
        console = Console()
        if not console.is_terminal:
            console = Console(width=1000)  # a pipe has no width: let nothing be cut there
        click.echo()
        console.print(render(seen))
    remarks = read_remarks(connection, key)
    add_to_json(remarks=remarks)
    if remarks:
        click.echo()
    for remark in remarks:
        click.echo(printable(remark.said))
