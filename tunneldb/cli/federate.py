"""The command ``federate``: one database whose views show the tunnels of several servers."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import CommandGroup, add_to_json, notify
from tunneldb.cli.param_types import FiniteRange
from tunneldb.cli.progress import tell_warnings
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.database import open_connection
from tunneldb.errors import UserError

if TYPE_CHECKING:
    from tunneldb.federation import Member
    from tunneldb.federation.check import Checked

AWAY = "a server is away or different"


@click.group(cls=CommandGroup)
def federate() -> None:
    """Show the tunnels of several servers in the views of one database, the hub.

    The hub is the database of the global --dsn, or that of the embedded server. Its schema tunnel_hub has the views of
    tunnel_api over all servers, with the column server.
    """


@federate.command(
    examples=[
        "tunneldb federate add north --dsn \"host=north.example.org dbname=tunnels user=hub passfile=/etc/tunneldb/hub.pass\"",
        "tunneldb federate add north",
    ]
)  # fmt: skip
@click.argument("name")
@click.option(
    "--dsn", metavar="DSN",
    help="Connection string of the server, as the hub's PostgreSQL uses it, without a password. [default: the present one]",
)  # fmt: skip
@click.pass_obj
def add(settings: Settings, name: str, dsn: str | None) -> None:
    """Add a server to the hub as NAME, or import its views again.

    Repeat it after an upgrade of the server (tunneldb init there), or with --dsn after a move. The login must be a member of
    tunnel_viewer on the server. A password belongs in a password file (passfile=…) of the operating-system user of the hub's
    PostgreSQL.
    """
    from tunneldb.federation import add_server

    with open_connection(settings.dsn) as connection:
        tell_warnings(connection)
        added = add_server(connection, name, dsn)
    add_to_json(name=name, views=added.views, tunnels=added.state.tunnels, surveys=added.state.surveys, warnings=added.warnings)
    for warning in added.warnings:
        notify(f"Warning: {warning}")
    notify(
        f"{name}: {counted(added.state.tunnels, 'tunnel')}, {counted(added.state.surveys, 'survey')};"
        f" {counted(added.views, 'view')} in schema tunnel_hub"
    )


@federate.command("list", examples=["tunneldb federate list"])
@click.pass_obj
def list_(settings: Settings) -> None:
    """List the servers of the hub, as the last check found them."""
    from tunneldb.federation import load_members

    with open_connection(settings.dsn) as connection:
        members = load_members(connection)
    add_to_json(servers=[_record(member) for member in members])
    print_table(
        ["server", "state", "since", "surveys", "version", "host", "database", "user", "message"],
        [
            (
                member.name, member.state, f"{member.since:%Y-%m-%d %H:%M}", member.surveys, _version(member.version),
                _host(member.options), member.options.get("dbname"), member.user, member.message,
            )
            for member in members
        ],
        right=(3,),
    )  # fmt: skip


@federate.command(examples=["tunneldb federate remove north"])
@click.argument("name")
@click.pass_obj
def remove(settings: Settings, name: str) -> None:
    """Remove the server NAME from the hub; the server itself is not changed."""
    from tunneldb.federation import remove_server

    with open_connection(settings.dsn) as connection:
        remaining = remove_server(connection, name)
    add_to_json(name=name, remaining=remaining)


@federate.command(examples=["tunneldb federate check", "tunneldb federate check --every 30"], wrong=AWAY)
@click.option(
    "--every", type=FiniteRange(1.0, 86_400.0), metavar="SECONDS", help="Repeat the check until it is stopped, for a service."
)
@click.pass_context
def check(ctx: click.Context, every: float | None) -> None:
    """Ask each server of the hub, and take those that are away out of the views.

    A server that cannot be reached within 3 s, or does not answer within 10 s, is away: the views of the hub show the other
    servers, and warn that its tunnels are missing. The next check that it answers puts it in again. Until a check finds that a
    server is away, queries that need it fail.
    """
    from tunneldb.database.failures import describe_failure
    from tunneldb.federation import check_servers

    settings: Settings = ctx.obj
    before: dict[str, str] = {}
    while every is not None:
        begin = time.monotonic()
        try:
            with open_connection(settings.dsn) as connection:
                checked = check_servers(connection)
            _notify_changes(checked, before)
            before = {member.name: member.state for member in checked.members}
        except Exception as error:  # of the hub, which may be away itself
            message = str(error) if isinstance(error, UserError) else describe_failure(error)
            if message is None:
                raise
            notify(f"Warning: {message}")
        time.sleep(max(0.0, every - (time.monotonic() - begin)))
    with open_connection(settings.dsn) as connection:
        checked = check_servers(connection)
    if not checked.members:
        raise UserError("the hub has no servers: tunneldb federate add NAME --dsn …")
    add_to_json(
        servers=[_record(member) for member in checked.members], went_away=checked.went, returned=checked.returned,
        warnings=checked.warnings,
    )  # fmt: skip
    print_table(
        ["server", "state", "since", "surveys", "version", "message"],
        [(m.name, m.state, f"{m.since:%Y-%m-%d %H:%M}", m.surveys, _version(m.version), m.message) for m in checked.members],
        right=(3,),
    )
    for warning in checked.warnings:
        notify(f"Warning: {warning}")
    ctx.exit(0 if all(member.state == "present" and member.shown for member in checked.members) else 1)


def _notify_changes(checked: Checked, before: Mapping[str, str]) -> None:
    """Print the servers whose state is another one than before; at first those that are not present."""
    for warning in checked.warnings if before else ():
        notify(f"Warning: {warning}")
    for member in checked.members:
        if member.state != before.get(member.name, "present"):
            notify(f"{member.name} is {member.state}" + (f": {member.message}" if member.message else ""))
    if not before:
        notify(f"{counted(len(checked.members), 'server')}; " + ("; ".join(checked.warnings) or "no warnings"))


def _record(member: Member) -> dict[str, Any]:
    """Return a server as an object for programs."""
    return {
        "name": member.name, "state": member.state, "since": member.since, "shown": member.shown,
        "checked_at": member.checked_at, "message": member.message, "version": member.version,
        "tunnels": member.tunnels, "surveys": member.surveys,
        "host": _host(member.options), "port": member.options.get("port"), "database": member.options.get("dbname"),
        "user": member.user,
    }  # fmt: skip


def _host(options: Mapping[str, str]) -> str | None:
    return options.get("host") or options.get("hostaddr") or options.get("service")


def _version(comment: str | None) -> str:
    """Return the version in the comment of schema tunnel_api."""
    found = re.search(r"tunneldb (\S+), (\w+)", comment or "")
    return f"{found[1]} ({found[2]})" if found else ""
