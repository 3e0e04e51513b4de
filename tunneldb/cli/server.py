"""`tunneldb server`."""

from __future__ import annotations

import click

from tunneldb.cli.main import Settings
from tunneldb.database.server import Server
from tunneldb.errors import UserError


@click.group()
@click.pass_obj
def server(settings: Settings) -> None:
    """Start, stop or look at the embedded server.

    Every command starts it by itself; it runs on until it is stopped or the machine goes down.
    """
    if settings.dsn is not None:
        raise UserError("a DSN is given (--dsn or TUNNELDB_DSN), so the embedded server is not used")


@server.command()
def start() -> None:
    """Start it, and print its DSN."""
    click.echo(Server().start())


@server.command()
def stop() -> None:
    """Stop it; what other commands are doing is undone."""
    embedded = Server()
    click.echo(f"{'stopped' if embedded.stop() else 'was not running'}: {embedded.folder}", err=True)


@server.command()
def status() -> None:
    """Print whether it runs, and where its data are."""
    embedded = Server()
    state = embedded.state()
    click.echo(f"{state}: {embedded.folder}")
    if state == "absent":
        return
    home = embedded.home()
    click.echo(f"data: {home.cluster}\nlog: {home.log}\nsocket: {home.run}")
