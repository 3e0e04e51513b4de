"""`tunneldb psql`."""

from __future__ import annotations

import os
import shutil

import click

from tunneldb.cli.main import Settings
from tunneldb.database.binaries import find_binaries
from tunneldb.database.connection import resolve_dsn
from tunneldb.errors import UserError


@click.command(context_settings={"ignore_unknown_options": True, "help_option_names": []})
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
@click.pass_obj
def psql(settings: Settings, arguments: tuple[str, ...]) -> None:
    """Open psql on the database; ARGUMENTS are psql's own, such as -c or -f."""
    dsn = resolve_dsn(settings.dsn)
    program = shutil.which("psql")
    if program is None:
        if settings.dsn is not None:
            raise UserError("psql is not installed: sudo apt install postgresql-client")
        program = find_binaries()["psql"]
    os.environ.setdefault("LESS", "FRX")  # as git does: the pager, often less, waits for its q only where a page is full
    os.execv(program, ["psql", "--dbname", dsn, *arguments])
