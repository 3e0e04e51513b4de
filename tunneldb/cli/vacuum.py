"""`tunneldb vacuum`."""

from __future__ import annotations

import click
from rich.filesize import decimal

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import connect

SHOWN = 20
"""Tables that are listed; the rest, which take less, are summed: there is one of each kilometre."""


@command(examples=["tunneldb vacuum", "tunneldb vacuum --yes"])
@click.option("--yes", is_flag=True, help="Do it; without it, only show.")
@click.pass_obj
def vacuum(settings: Settings, yes: bool) -> None:
    """Show the disk space of deleted and replaced rows; with --yes VACUUM (ANALYZE) their tables.

    Freed space is used for new rows; PostgreSQL returns only the end of a table to the disk. The numbers are
    estimates of the server's statistics. Replaced kilometres and removed surveys leave no dead rows. Tables in use
    are skipped and listed. For operators.
    """
    from tunneldb.database.vacuum import tables_to_vacuum
    from tunneldb.database.vacuum import vacuum as run

    with connect(settings.dsn) as connection:
        tables = tables_to_vacuum(connection)
        connection.rollback()
        _show([(f"{t.schema}.{t.table}", t.dead, t.dead_bytes, t.bytes, t.analyzed) for t in tables])
        busy = []
        if yes:
            with bar("bytes") as progress:
                busy = run(connection, tables, step(progress))
    others = [f"{t.schema}.{t.table}" for t in tables if not t.allowed]
    waiting = [f"{t.schema}.{t.table}" for t in busy]
    freed, dead = sum(t.dead_bytes for t in tables), sum(t.dead for t in tables)
    add_to_json(tables=tables, dead=dead, dead_bytes=freed, done=yes, locked=waiting, not_owned=others)
    if not tables:
        notify("nothing to vacuum")
    elif not yes:
        notify(f"{counted(dead, 'dead row')}, {decimal(freed)}, in {counted(len(tables), 'table')}: tunneldb vacuum --yes")
    else:
        notify(f"vacuumed {counted(len(tables) - len(others) - len(busy), 'table')}")
    if waiting:
        notify(f"left out, for others are at work on them: {', '.join(waiting)}; again later: tunneldb vacuum --yes")
    if others:
        notify(f"{counted(len(others), 'table is', 'tables are')} not yours to vacuum, as {others[0]}: ask the owner")


def _show(tables: list[tuple[str, int, int, int, bool]]) -> None:
    if not tables:
        return
    rows = [
        (name, dead, decimal(gone), decimal(size), "" if known else "never") for name, dead, gone, size, known in tables[:SHOWN]
    ]
    if rest := tables[SHOWN:]:
        dead, gone, size = (sum(column) for column in zip(*((row[1], row[2], row[3]) for row in rest), strict=True))
        rows.append((counted(len(rest), "other"), dead, decimal(gone), decimal(size), ""))
    print_table(["table", "dead rows", "in them", "of", "analyzed"], rows, right=(1, 2, 3))
