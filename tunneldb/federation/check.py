"""Ask each server of a hub, and take those that are away out of the views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.errors import BusyError
from tunneldb.federation.advice import describe_gaps, warnings_of
from tunneldb.federation.hub import changing
from tunneldb.federation.load import Member, load_members, load_tables
from tunneldb.federation.save import show_servers
from tunneldb.federation.servers import ask_server, reason
from tunneldb.federation.views import find_gaps

_SAVE = """
UPDATE tunnel_hub.server s
   SET since = CASE WHEN s.state = %(state)s THEN s.since ELSE now() END, state = %(state)s, message = %(message)s,
       version = coalesce(%(version)s, s.version), tunnels = coalesce(%(tunnels)s, s.tunnels),
       surveys = coalesce(%(surveys)s, s.surveys), checked_at = now()
 WHERE s.name = %(name)s
"""


VIEWS_TIMEOUT = "3s"
"""Time for which a check waits for queries that use the views; the next check tries again."""


@dataclass(frozen=True)
class Checked:
    """Result of a check.

    Attributes
    ----------
    members
        Servers as they are now.
    went, returned
        Servers that were taken out of the views, and put in again.
    warnings
        Lines for the user.
    """

    members: list[Member]
    went: list[str]
    returned: list[str]
    warnings: list[str]


def check_servers(connection: psycopg.Connection[Any]) -> Checked:
    """Ask each server of the hub, note its state, and change the views if one went away or is back.

    Parameters
    ----------
    connection
        Idle connection to the hub, as the role that made it.

    Raises
    ------
    UserError
        If this role may not change the hub.
    """
    warnings: list[str] = []
    with changing(connection):
        noted = _note(connection, warnings)
    went = [member.name for member in noted if member.away and member.shown]
    returned = [member.name for member in noted if not member.away and not member.shown]
    if went or returned:
        try:
            with changing(connection, VIEWS_TIMEOUT):
                show_servers(connection)
        except BusyError as error:
            warnings.append(f"{error}: the views show {', '.join(went + returned)} as before until the next check")
            went, returned = [], []
    with connection.transaction():
        return Checked(load_members(connection), went, returned, warnings)


def _note(connection: psycopg.Connection[Any], warnings: list[str]) -> list[Member]:
    """Ask each server, note its state, and return the servers as they are now."""
    members = load_members(connection)
    gaps = find_gaps({member.name: load_tables(connection, member.name) for member in members})
    for member in members:
        connection.execute(_SAVE, _ask(connection, member, gaps[member.name], warnings))
    return load_members(connection)


def _ask(connection: psycopg.Connection[Any], member: Member, gaps: list[str], warnings: list[str]) -> dict[str, Any]:
    """Return the values of tunnel_hub.server for a server, and add its warnings."""
    found: dict[str, Any] = {"name": member.name, "state": "present", "message": None}
    try:
        state = ask_server(connection, member.name)
    except psycopg.Error as error:
        if connection.broken:
            raise
        return found | {"state": "away", "message": reason(error), "version": None, "tunnels": None, "surveys": None}
    warnings += warnings_of(connection, member.name, state)
    if state.version != member.imported_version:
        found |= {
            "state": "different",
            "message": f"was upgraded since its views were imported: type tunneldb federate add {member.name}",
        }
    elif gaps:
        found |= {"state": "different", "message": describe_gaps(gaps)}
    return found | {"version": state.version, "tunnels": state.tunnels, "surveys": state.surveys}
