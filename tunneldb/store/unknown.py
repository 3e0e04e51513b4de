"""Errors about an unknown survey or tunnel: with the existing names, and the one that was probably meant."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.errors import UserError, did_you_mean

MAX_LISTED_NAMES = 20
"""Maximum number of names in a message."""

_OF_TUNNEL = (
    "SELECT s.name FROM tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE t.name = %s ORDER BY s.date, s.name"
)


def unknown_survey(conn: psycopg.Connection[Any], name: str) -> UserError:
    """Return the error for a survey that there is not; of a tunnel's name it asks which of its surveys is meant."""
    own = [row[0] for row in conn.execute(_OF_TUNNEL, [name])]
    if own:
        return UserError(f"{name!r} is a tunnel; say which of its surveys: {_listed(own)}")
    known = [row[0] for row in conn.execute("SELECT name FROM tunnel.survey ORDER BY name")]
    return UserError(_sentence("survey", name, known))


def unknown_tunnel(conn: psycopg.Connection[Any], name: str) -> UserError:
    """Return the error for an unknown tunnel; if it is a survey's name, with its tunnel."""
    row = conn.execute(
        "SELECT t.name FROM tunnel.tunnel t JOIN tunnel.survey s ON s.tunnel_id = t.id WHERE s.name = %s", [name]
    ).fetchone()
    if row is not None:
        return UserError(f"{name!r} is a survey; its tunnel is {row[0]!r}")
    known = [row[0] for row in conn.execute("SELECT name FROM tunnel.tunnel ORDER BY name")]
    return UserError(_sentence("tunnel", name, known))


def _sentence(what: str, name: str, known: list[str]) -> str:
    there = f"the database has {_listed(known)}" if known else f"the database has none: tunneldb {what} add"
    meant = did_you_mean(name, known)
    return f"there is no {what} {name!r}; {there}{f'.{meant}' if meant else ''}"


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - MAX_LISTED_NAMES} more" if len(names) > MAX_LISTED_NAMES else ""
    return ", ".join(names[:MAX_LISTED_NAMES]) + more
