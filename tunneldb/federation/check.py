"""Ask each server of a hub, and take those that are away out of the views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.federation.advice import describe_gaps, warnings_of
from tunneldb.federation.hub import begin_change
from tunneldb.federation.load import Member, load_members, load_tables
from tunneldb.federation.save import save_views
from tunneldb.federation.servers import ask_server, reason
from tunneldb.federation.views import find_gaps, plan_views

_SAVE = """
UPDATE tunnel_hub.server s
   SET since = CASE WHEN s.state = %(state)s THEN s.since ELSE now() END, state = %(state)s, message = %(message)s,
       version = coalesce(%(version)s, s.version), tunnels = coalesce(%(tunnels)s, s.tunnels),
       surveys = coalesce(%(surveys)s, s.surveys), checked_at = now()
 WHERE s.name = %(name)s
"""


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
        If this role may not change the hub, or queries use its views for too long.
    """
    try:
        with connection.transaction():
            begin_change(connection)
            return _check(connection)
    except psycopg.errors.InsufficientPrivilege as error:
        raise UserError(f"{connection.info.user} may not change the hub: {error.diag.message_primary}") from None
    except psycopg.errors.LockNotAvailable as error:
        raise UserError(f"queries use the views of the hub, its state was not noted: {error.diag.message_primary}") from None


def _check(connection: psycopg.Connection[Any]) -> Checked:
    before = load_members(connection)
    servers = {member.name: load_tables(connection, member.name) for member in before}
    gaps = find_gaps(servers)
    warnings: list[str] = []
    for member in before:
        connection.execute(_SAVE, _ask(connection, member, gaps[member.name], warnings))
    after = load_members(connection)
    went = [new.name for old, new in zip(before, after, strict=True) if new.away and not old.away]
    returned = [new.name for old, new in zip(before, after, strict=True) if old.away and not new.away]
    if went or returned:
        save_views(connection, plan_views(servers, [member.name for member in after if member.away]))
    return Checked(after, went, returned, warnings)


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
