"""Add a server to a hub, and remove it: each in one transaction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.federation.advice import describe_gaps, warnings_of
from tunneldb.federation.hub import changing, drop_hub, prepare_hub, set_planner
from tunneldb.federation.load import find_member, load_members, load_tables
from tunneldb.federation.names import check_name, foreign_server
from tunneldb.federation.save import show_servers
from tunneldb.federation.servers import DatabaseState, drop_server, drop_tables, import_tables, save_server
from tunneldb.federation.target import parse_target
from tunneldb.federation.views import find_gaps

_SAVE = """
INSERT INTO tunnel_hub.server AS s (name, state, message, version, imported_version, tunnels, surveys)
VALUES (%(name)s, %(state)s, %(message)s, %(version)s, %(version)s, %(tunnels)s, %(surveys)s)
ON CONFLICT (name) DO UPDATE
   SET since = CASE WHEN s.state = excluded.state THEN s.since ELSE excluded.since END, state = excluded.state,
       message = excluded.message, version = excluded.version, imported_version = excluded.imported_version,
       tunnels = excluded.tunnels, surveys = excluded.surveys, checked_at = excluded.checked_at
"""


@dataclass(frozen=True)
class Added:
    """Server that was added.

    Attributes
    ----------
    state
        Its answer about itself.
    views
        Number of views over all servers.
    warnings
        Lines for the user.
    """

    state: DatabaseState
    views: int
    warnings: list[str]


def add_server(connection: psycopg.Connection[Any], name: str, dsn: str | None) -> Added:
    """Add a server to the hub, or import its views again, in one transaction.

    Parameters
    ----------
    connection
        Idle connection to the hub.
    name
        Name of the server.
    dsn
        Connection string, as the hub's PostgreSQL uses it; None keeps that of a server of the hub.

    Raises
    ------
    UserError
        If name or string are not valid, the hub cannot be one, or the server cannot be used. Nothing is changed.
    """
    check_name(name)
    target = None if dsn is None else parse_target(name, dsn)
    with changing(connection):
        if target is None:
            find_member(load_members(connection), name)
        prepare_hub(connection)
        if target is not None:
            save_server(connection, name, target)
        state = import_tables(connection, name)
        _save_state(connection, name, state, None)
        servers = {member.name: load_tables(connection, member.name) for member in load_members(connection)}
        gaps = find_gaps(servers)
        if gaps[name]:
            _save_state(connection, name, state, describe_gaps(gaps[name]))
        views = show_servers(connection)
        drop_tables(connection, name, old=True)
        connection.execute("SELECT tunnel_hub_internal.copy_comments(%s)", [foreign_server(name)])
        statement = set_planner(connection, on=True)
        warnings = [f"{server} {describe_gaps(missing)}" for server, missing in gaps.items() if missing]
        warnings += warnings_of(connection, name, state)
    if statement:
        warnings.append(f"joins and aggregates are not sent to the servers until the owner of the database runs: {statement}")
    return Added(state, views, warnings)


def _save_state(connection: psycopg.Connection[Any], name: str, state: DatabaseState, gaps: str | None) -> None:
    values = {"version": state.version, "tunnels": state.tunnels, "surveys": state.surveys}
    connection.execute(_SAVE, {"name": name, "state": "different" if gaps else "present", "message": gaps} | values)


def remove_server(connection: psycopg.Connection[Any], name: str) -> int:
    """Remove a server from the hub, also one that is away, and return the number of those that remain.

    Parameters
    ----------
    connection
        Idle connection to the hub.
    name
        Name of the server.

    Raises
    ------
    UserError
        If the hub has no such server, its views are in use, or objects of users depend on its tables.
    """
    with changing(connection):
        members = load_members(connection)
        find_member(members, name)
        connection.execute("DELETE FROM tunnel_hub.server WHERE name = %s", [name])
        others = [member for member in members if member.name != name]
        show_servers(connection)
        drop_tables(connection, name)
        drop_server(connection, name)
        if not others:
            drop_hub(connection)
            set_planner(connection, on=False)
    return len(others)
