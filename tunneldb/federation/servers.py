"""The foreign server of one server of a hub: its options, its login, its foreign tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.database.failures import first_line
from tunneldb.errors import UserError
from tunneldb.federation.names import SHARED, STATE, foreign_server
from tunneldb.federation.target import Target

PROBE_TIMEOUT = "10s"
"""Longest time in which a server must answer a check, after it was connected to."""

_LARGE_ROWS = "10"
"""Rows of views with bytea columns, such as pictures, that are fetched at once."""

_ESTIMATED = ("deviation_section", "evenness_area", "evenness_section", "thickness_section")
"""Views with a row for each metre or less whose rows the servers estimate quickly, so that they are sorted there."""


@dataclass(frozen=True)
class DatabaseState:
    """Answer of a server about itself; columns of tunnel_shared.database_state."""

    server: str | None
    version: str | None
    login: str
    may_write: bool
    locale: str
    tunnels: int
    surveys: int


def save_server(connection: psycopg.Connection[Any], name: str, target: Target) -> None:
    """Create the foreign server and the mapping of the current role, or change them.

    Raises
    ------
    UserError
        If this role may not, or postgres_fdw does not know an option.
    """
    server = sql.Identifier(foreign_server(name))
    try:
        present = _options(connection, name)
        if present is None:
            _refuse_ordinary(connection, name, target)
            connection.execute(sql.SQL("CREATE SERVER {} FOREIGN DATA WRAPPER postgres_fdw").format(server))
            present = {}
        if changes := _changes(present, target.options):
            connection.execute(sql.SQL("ALTER SERVER {} OPTIONS ({})").format(server, changes))
        mapped = _mapping(connection, name)
        if mapped is None:
            _refuse_ordinary(connection, name, target)
            connection.execute(
                sql.SQL("CREATE USER MAPPING FOR CURRENT_USER SERVER {} OPTIONS (user {})").format(
                    server, sql.Literal(target.user)
                )
            )
        elif changes := _changes({"user": mapped.get("user", "")}, {"user": target.user}):
            connection.execute(sql.SQL("ALTER USER MAPPING FOR CURRENT_USER SERVER {} OPTIONS ({})").format(server, changes))
    except psycopg.errors.FdwInvalidOptionName as error:
        raise UserError(f"the DSN of {name} cannot be used by postgres_fdw: {first_line(error)}") from None
    except psycopg.errors.InsufficientPrivilege as error:
        raise UserError(f"{first_line(error)}; {_advice(connection, name, target)}") from None


def _refuse_ordinary(connection: psycopg.Connection[Any], name: str, target: Target) -> None:
    """Refuse to create a mapping as an ordinary role: only a superuser can make one without a password."""
    if connection.execute("SELECT rolsuper FROM pg_roles WHERE rolname = current_user").fetchone() != (True,):
        raise UserError(f"{connection.info.user} is no superuser of the hub; {_advice(connection, name, target)}")


def _advice(connection: psycopg.Connection[Any], name: str, target: Target) -> str:
    role, server = sql.Identifier(connection.info.user), sql.Identifier(foreign_server(name))
    statements = sql.SQL(
        "GRANT USAGE ON FOREIGN DATA WRAPPER postgres_fdw TO {role}; CREATE SERVER {server} FOREIGN DATA WRAPPER postgres_fdw;"
        " ALTER SERVER {server} OWNER TO {role};"
        " CREATE USER MAPPING FOR {role} SERVER {server} OPTIONS (user {user}, password_required 'false');"
    ).format(role=role, server=server, user=sql.Literal(target.user))
    return f"have one run, and add {name} again: {statements.as_string(connection)}"


def _options(connection: psycopg.Connection[Any], name: str) -> dict[str, str] | None:
    """Return the options of the foreign server, None if there is none."""
    row = connection.execute(
        "SELECT (SELECT coalesce(jsonb_object_agg(option_name, option_value), '{}') FROM pg_options_to_table(s.srvoptions))"
        "  FROM pg_foreign_server s WHERE s.srvname = %s",
        [foreign_server(name)],
    ).fetchone()
    return None if row is None else row[0]


def _mapping(connection: psycopg.Connection[Any], name: str) -> dict[str, str] | None:
    """Return the options of the current role's mapping, None if it has none."""
    row = connection.execute(
        "SELECT (SELECT coalesce(jsonb_object_agg(option_name, option_value), '{}') FROM pg_options_to_table(m.umoptions))"
        "  FROM pg_user_mappings m WHERE m.srvname = %s AND m.usename = current_user",
        [foreign_server(name)],
    ).fetchone()
    return None if row is None else row[0]


def _changes(present: Mapping[str, str], wanted: Mapping[str, str]) -> sql.Composed | None:
    """Return the changes from present to wanted options, None if there are none."""
    parts = [
        sql.SQL("{} {} {}").format(sql.SQL("SET" if key in present else "ADD"), sql.Identifier(key), sql.Literal(value))
        for key, value in wanted.items()
        if present.get(key) != value
    ]
    parts += [sql.SQL("DROP {}").format(sql.Identifier(key)) for key in present if key not in wanted]
    return sql.SQL(", ").join(parts) if parts else None


def import_tables(connection: psycopg.Connection[Any], name: str) -> DatabaseState:
    """Import the views of a server as foreign tables, and return its answer about itself.

    A schema of an earlier import is renamed; `drop_tables` with ``old`` drops it.

    Raises
    ------
    UserError
        If the server cannot be reached, has no views for a hub, or does not let the login read them.
    """
    schema, server = sql.Identifier(foreign_server(name)), sql.Identifier(foreign_server(name))
    if connection.execute("SELECT to_regnamespace(%s) IS NOT NULL", [foreign_server(name)]).fetchone() == (True,):
        connection.execute(sql.SQL("ALTER SCHEMA {} RENAME TO {}").format(schema, sql.Identifier(_old(name))))
    connection.execute(sql.SQL("CREATE SCHEMA {}").format(schema))
    connection.execute(sql.SQL("REVOKE ALL ON SCHEMA {} FROM PUBLIC").format(schema))
    try:
        with connection.transaction():
            connection.execute(
                sql.SQL("IMPORT FOREIGN SCHEMA {} FROM SERVER {} INTO {}").format(sql.Identifier(SHARED), server, schema)
            )
            state = ask_server(connection, name)
    except psycopg.errors.FdwSchemaNotFound:
        raise UserError(f"{name} has no schema {SHARED}: type tunneldb init there") from None
    except psycopg.errors.InsufficientPrivilege as error:
        raise UserError(f"the login of {name} may not read there ({reason(error)}): GRANT tunnel_viewer TO it") from None
    except psycopg.errors.UndefinedTable:
        raise UserError(f"{name} has no view {SHARED}.{STATE}: type tunneldb init there") from None
    except psycopg.Error as error:
        if connection.broken:
            raise
        raise UserError(f"cannot use {name}: {reason(error)}") from None
    if state.server != name:
        raise UserError(f"{name} does not take the option tunneldb.server: connect to PostgreSQL itself, not to a pooler")
    _set_options(connection, name)
    return state


def _set_options(connection: psycopg.Connection[Any], name: str) -> None:
    """Set options of the foreign tables that need others than their server."""
    rows = connection.execute(
        "SELECT c.relname, bool_or(a.atttypid = 'bytea'::regtype) FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid"
        " WHERE c.relnamespace = to_regnamespace(%s) AND c.relkind = 'f' GROUP BY c.relname",
        [foreign_server(name)],
    ).fetchall()
    for table, large in rows:
        options = {"fetch_size": _LARGE_ROWS} if large else {}
        if table in _ESTIMATED:
            options["use_remote_estimate"] = "true"
        if changes := _changes({}, options):
            identifier = sql.Identifier(foreign_server(name), table)
            connection.execute(sql.SQL("ALTER FOREIGN TABLE {} OPTIONS ({})").format(identifier, changes))


def ask_server(connection: psycopg.Connection[Any], name: str) -> DatabaseState:
    """Return the answer of a server about itself; errors are those of psycopg."""
    with connection.transaction():
        connection.execute(sql.SQL("SET LOCAL statement_timeout = {}").format(PROBE_TIMEOUT))
        row = connection.execute(
            sql.SQL("SELECT server, version, login, may_write, locale, tunnels, surveys FROM {}").format(
                sql.Identifier(foreign_server(name), STATE)
            )
        ).fetchone()
        connection.execute("SET LOCAL statement_timeout = 0")
    assert row is not None
    return DatabaseState(*row)


def drop_tables(connection: psycopg.Connection[Any], name: str, *, old: bool = False) -> None:
    """Drop the foreign tables of a server and their schema, or those of an earlier import.

    Raises
    ------
    UserError
        If objects of users depend on them.
    """
    schema = _old(name) if old else foreign_server(name)
    rows = connection.execute(
        "SELECT relname FROM pg_class WHERE relnamespace = to_regnamespace(%s) AND relkind = 'f'", [schema]
    ).fetchall()
    try:
        if rows:
            tables = sql.SQL(", ").join(sql.Identifier(schema, table) for (table,) in rows)
            connection.execute(sql.SQL("DROP FOREIGN TABLE {}").format(tables))
        connection.execute(sql.SQL("DROP SCHEMA IF EXISTS {}").format(sql.Identifier(schema)))
    except psycopg.errors.DependentObjectsStillExist as error:
        detail = (error.diag.message_detail or "").splitlines()
        raise UserError(f"{first_line(error)}: {detail[0] if detail else ''}; drop it first") from None


def drop_server(connection: psycopg.Connection[Any], name: str) -> None:
    """Drop the foreign server and its mappings."""
    connection.execute(sql.SQL("DROP SERVER IF EXISTS {} CASCADE").format(sql.Identifier(foreign_server(name))))


def _old(name: str) -> str:
    return foreign_server(name) + "_old"


def reason(error: psycopg.Error) -> str:
    """Return why a server did not answer: the detail that libpq states, else the message."""
    detail = (error.diag.message_detail or "").strip().splitlines()
    return detail[0] if detail else first_line(error)
