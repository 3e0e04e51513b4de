"""The servers of a hub and their foreign tables, from its catalogue."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.errors import UserError, did_you_mean
from tunneldb.federation.names import COMMENTS, HUB, INTERNAL, STATE, foreign_server
from tunneldb.federation.views import Column, Tables

_MEMBERS = """
SELECT h.name, h.state, h.since, h.message, h.shown, h.version, h.imported_version, h.tunnels, h.surveys, h.checked_at,
       coalesce((SELECT jsonb_object_agg(o.option_name, o.option_value) FROM pg_options_to_table(s.srvoptions) o), '{}'),
       (SELECT o.option_value FROM pg_user_mappings m, pg_options_to_table(m.umoptions) o
         WHERE m.srvid = s.oid AND m.umuser = s.srvowner AND o.option_name = 'user')
  FROM tunnel_hub.server h
  LEFT JOIN pg_foreign_server s ON s.srvname = 'tunnel_server_' || h.name
 ORDER BY h.name
"""

_COLUMNS = """
SELECT c.relname, a.attname, format_type(a.atttypid, a.atttypmod)
  FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped
 WHERE c.relnamespace = to_regnamespace(quote_ident(%s)) AND c.relkind = ANY (%s)
 ORDER BY c.relname, a.attnum
"""

_PARTITIONS = """
SELECT p.relname, n.nspname
  FROM pg_inherits i
  JOIN pg_class p ON p.oid = i.inhparent AND p.relnamespace = to_regnamespace('tunnel_hub_internal')
  JOIN pg_class c ON c.oid = i.inhrelid
  JOIN pg_namespace n ON n.oid = c.relnamespace
"""


@dataclass(frozen=True)
class Member:
    """Server of a hub.

    Attributes
    ----------
    name
        Name, which is in the column ``server``.
    state
        present, different or away.
    since, checked_at
        Begin of the state; time of the last check.
    message
        Reason of the state, None if present.
    shown
        True if the views ask it, False if they warn instead.
    version, imported_version
        Version of its schema tunnel_api, now and when its views were imported.
    tunnels, surveys
        Their numbers at the last check that it answered.
    options, user
        Options of the foreign server, and the login there; the user is None if this role may not see it.
    """

    name: str
    state: str
    since: dt.datetime
    message: str | None
    shown: bool
    version: str | None
    imported_version: str | None
    tunnels: int | None
    surveys: int | None
    checked_at: dt.datetime
    options: Mapping[str, str]
    user: str | None

    @property
    def away(self) -> bool:
        """True if the server did not answer the last check."""
        return self.state == "away"


@dataclass(frozen=True)
class Present:
    """Views of a hub as they are.

    Attributes
    ----------
    views, tables
        Columns of the views for users, and of the partitioned tables behind them.
    partitions
        Schemas of the foreign tables that are partitions of each table.
    """

    views: Tables
    tables: Tables
    partitions: Mapping[str, frozenset[str]]


def is_hub(connection: psycopg.Connection[Any]) -> bool:
    """Return True if the database is a hub."""
    return connection.execute("SELECT to_regclass('tunnel_hub.server') IS NOT NULL").fetchone() == (True,)


def load_members(connection: psycopg.Connection[Any]) -> list[Member]:
    """Return the servers of a hub by name; none if the database is no hub yet."""
    if not is_hub(connection):
        return []
    return [Member(*row) for row in connection.execute(_MEMBERS)]


def find_member(members: list[Member], name: str) -> Member:
    """Return the server of a name.

    Raises
    ------
    UserError
        If there is none.
    """
    for member in members:
        if member.name == name:
            return member
    known = [member.name for member in members]
    raise UserError(f"the hub has no server {name}.{did_you_mean(name, known)} Type tunneldb federate list")


def load_tables(connection: psycopg.Connection[Any], name: str) -> dict[str, tuple[Column, ...]]:
    """Return the columns of the foreign tables of a server that are shown over all servers."""
    tables = _tables(connection, foreign_server(name), "f")
    return {table: columns for table, columns in tables.items() if table not in (STATE, COMMENTS)}


def load_present(connection: psycopg.Connection[Any]) -> Present:
    """Return the views over all servers, and the tables behind them, as they are."""
    partitions: dict[str, set[str]] = {}
    for table, schema in connection.execute(_PARTITIONS):
        partitions.setdefault(table, set()).add(schema)
    return Present(
        _tables(connection, HUB, "v"),
        _tables(connection, INTERNAL, "p"),
        {table: frozenset(schemas) for table, schemas in partitions.items()},
    )


def _tables(connection: psycopg.Connection[Any], schema: str, kind: str) -> dict[str, tuple[Column, ...]]:
    found: dict[str, list[Column]] = {}
    for table, column, type_ in connection.execute(_COLUMNS, [schema, [kind]]):
        found.setdefault(table, []).append(Column(column, type_))
    return {table: tuple(columns) for table, columns in found.items()}
