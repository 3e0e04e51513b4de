"""`tunneldb survey export` and `tunneldb survey import`."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import bar, step, tell_warnings
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.files import exit_on_sigterm
from tunneldb.store.survey import get_survey


@command("export", examples=["tunneldb survey export ringo-2024 -o ringo-2024.tdb"])
@click.argument("name", metavar="SURVEY")
@click.option("--output", "-o", type=FilePath(), required=True, help="File to write, such as ringo-2024.tdb.")
@click.pass_obj
def export(settings: Settings, name: str, output: Path) -> None:
    """Write SURVEY with all its data into one file for survey import.

    The file holds the survey's rows of all tables, including points and images, its tunnel, and its part of the
    audit. Scan files and photos are not included. No stage may be running on the survey; later reviews are not
    included.
    """
    from tunneldb.export.archive.save import save_survey

    with exit_on_sigterm(), connect(settings.dsn) as connection, bar("bytes") as progress:
        saved = save_survey(connection, get_survey(connection, name, site=True), output, step(progress))
    add_to_json(survey=name, file=output, bytes=saved.bytes, kilometres=saved.kilometres, rows=saved.rows)
    notify(
        f"{name}: {counted(sum(saved.rows.values()), 'row')} of {counted(sum(map(bool, saved.rows.values())), 'table')},"
        f" {saved.rows.get('point', 0)}"
        f" of them points in {counted(len(saved.kilometres), 'kilometre')}: {output}, {saved.bytes / 1e6:.1f} MB"
    )
    notify(f"{name}: to free its room in the database: tunneldb survey remove {name}")


@command(
    "import",
    examples=[
        "tunneldb survey import ringo-2024.tdb",
        "tunneldb survey import ringo-2024.tdb --name ringo-2024-archived",
    ],
)
@click.argument("file", type=FilePath())
@click.option("--name", help="Name of the survey in this database; default: its own name.")
@click.pass_obj
def import_(settings: Settings, file: Path, name: str | None) -> None:
    """Import the survey of FILE, written by survey export, into the database in one transaction.

    Its tunnel is added, or the existing one is used if the axis is the same. In the original database all rows keep
    their numbers; in another they get new ones. After an interruption nothing is imported: repeat the command.
    """
    from tunneldb.export.archive.load import load_survey

    with exit_on_sigterm(), connect(settings.dsn) as connection, bar("bytes") as progress:
        tell_warnings(connection)
        loaded = load_survey(connection, file, name, step(progress))
    notes = list(loaded.notes)
    if loaded.left_out:
        listed = ", ".join(f"{count} of {table}" for table, count in sorted(loaded.left_out.items()))
        notes.append(f"left out are comparisons with surveys that are not in this database: {listed}")
    add_to_json(
        survey=loaded.survey,
        tunnel=loaded.tunnel,
        new_tunnel=loaded.new_tunnel,
        kept_numbers=loaded.kept,
        kilometres=loaded.kilometres,
        rows=loaded.rows,
        left_out=loaded.left_out,
        notes=notes,
    )
    numbers = "the numbers that they had" if loaded.kept else "new numbers"
    notify(
        f"{loaded.survey}: {counted(sum(loaded.rows.values()), 'row')}, {loaded.rows.get('point', 0)} of them points in"
        f" {counted(len(loaded.kilometres), 'kilometre')} of {loaded.tunnel}; rows have {numbers}"
    )
    for note in notes:
        notify(f"{loaded.survey}: {note}")
