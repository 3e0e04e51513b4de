"""`tunneldb prune`."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence

import click
import psycopg
from rich.filesize import decimal

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.progress import bar, step
from tunneldb.cli.survey import DAY
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import BusyError, UserError
from tunneldb.store.prune import Superseded, busy, superseded
from tunneldb.store.prune import prune as delete
from tunneldb.store.survey import get_survey


@command(
    examples=[
        "tunneldb prune",
        "tunneldb prune ringo-2024 --before 2024-01-01",
        "tunneldb prune --yes",
    ]
)
@click.argument("name", required=False, metavar="[SURVEY]")
@click.option("--before", type=DAY, metavar="YYYY-MM-DD", help="Only runs that began before that day.")
@click.option("--yes", is_flag=True, help="Delete; without it, only show.")
@click.pass_obj
def prune(settings: Settings, name: str | None, before: dt.datetime | None, yes: bool) -> None:
    """Show runs and jobs that are no longer needed; with --yes delete them.

    For all surveys, or SURVEY. For each stage of each kilometre, and each layer, outline or pair of surveys, the last
    attempt, the last success and the success that ended last are kept, with the runs that these were made from, and
    every import. Nothing becomes stale. Results, findings and the audit do not change. Surveys with a running batch
    are skipped and listed. tunneldb vacuum frees the space for new rows.
    """
    with connect(settings.dsn) as connection:
        survey = None if name is None else get_survey(connection, name, site=True)
        day = None if before is None else before.date()
        found = superseded(connection, survey, day)
        working = {s for s in {row.survey_id for row in found} if s is not None and busy(connection, s)}
        connection.rollback()
        left_out = sorted({row.survey or "" for row in found if row.survey_id in working})
        if survey is not None and left_out:
            raise UserError(f"a batch is at work on {name}: wait until it has finished (tunneldb status {name})")
        found = [row for row in found if row.survey_id not in working]
        _show(found)
        runs, jobs = 0, 0
        if yes:
            runs, jobs, began = _delete(connection, found, day)
            if survey is not None and began:
                raise UserError(f"a batch is at work on {name}: wait until it has finished (tunneldb status {name})")
            left_out += began
            found = [row for row in found if row.survey not in began]
    freed = sum(row.bytes for row in found)
    add_to_json(
        superseded=found,
        rows=sum(row.rows for row in found),
        bytes=freed,
        left_out=left_out,
        deleted={"runs": runs, "jobs": jobs},
    )
    for other in left_out:
        notify(f"{other}: left out, a batch is at work on it")
    if not found:
        notify("nothing to prune")
    elif yes:
        notify(f"deleted: {counted(runs, 'run')} and {counted(jobs, 'job')}; for the room: tunneldb vacuum --yes")
    else:
        again = " ".join(
            ["tunneldb prune", *([name] if name else []), *([f"--before {before:%Y-%m-%d}"] if before else []), "--yes"]
        )
        notify(f"{counted(sum(row.rows for row in found), 'row')}, {decimal(freed)}, would go: {again}")


def _delete(connection: psycopg.Connection, found: Sequence[Superseded], before: dt.date | None) -> tuple[int, int, list[str]]:
    """Delete survey by survey, each in a transaction; how many runs and jobs went, and on which surveys a batch has begun."""
    surveys = {row.survey_id: row.survey or "" for row in found}
    runs = jobs = 0
    began = []
    with bar("surveys") as progress:
        advance = step(progress)("pruning", len(surveys))
        for survey_id, name in surveys.items():
            try:
                of_survey = delete(connection, survey_id, before)
                runs, jobs = runs + of_survey[0], jobs + of_survey[1]
            except BusyError:
                began.append(name)
            advance(1)
    return runs, jobs, began


def _show(found: Sequence[Superseded]) -> None:
    if not found:
        return
    rows = [
        (
            row.survey or "(surveys that are gone)", row.stage or row.what, row.count, decimal(row.bytes),
            "" if row.since is None else f"{row.since.astimezone():%Y-%m-%d}",
            "" if row.until is None else f"{row.until.astimezone():%Y-%m-%d}",
        )
        for row in found
    ]  # fmt: skip
    print_table(["survey", "runs of", "count", "bytes", "from", "to"], rows, right=(2, 3))
