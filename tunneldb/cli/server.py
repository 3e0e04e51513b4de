"""`tunneldb server`."""

from __future__ import annotations

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.database.server import Server
from tunneldb.errors import UserError


@click.group(cls=CommandGroup)
@click.pass_obj
def server(settings: Settings) -> None:
    """Start, stop or inspect the embedded server.

    Every command starts it; it runs until it is stopped or the machine shuts down.
    """
    if settings.dsn is not None:
        raise UserError("a DSN is given (--dsn or TUNNELDB_DSN), so the embedded server is not used")


@server.command(examples=['psql "$(tunneldb server start)"'])
def start() -> None:
    """Start it, and print its DSN."""
    dsn = Server().start()
    add_to_json(dsn=dsn)
    click.echo(dsn)


@server.command(examples=["tunneldb server stop"])
def stop() -> None:
    """Stop it; running transactions of other commands are rolled back."""
    embedded = Server()
    stopped = embedded.stop()
    add_to_json(stopped=stopped, folder=embedded.folder)
    notify(f"{'stopped' if stopped else 'was not running'}: {embedded.folder}")


@server.command(examples=["tunneldb server status"])
def status() -> None:
    """Print its state and the place of its data."""
    embedded = Server()
    state = embedded.state()
    add_to_json(state=state, folder=embedded.folder)
    click.echo(f"{state}: {embedded.folder}")
    if state == "absent":
        return
    home = embedded.home()
    add_to_json(data=home.cluster, log=home.log, socket=home.run)
    click.echo(f"data: {home.cluster}\nlog: {home.log}\nsocket: {home.run}")
