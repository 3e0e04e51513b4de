"""Write the views over all servers into the hub."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql

from tunneldb.database.failures import first_line
from tunneldb.database.resources import resource_dir
from tunneldb.errors import UserError
from tunneldb.federation.load import Present, load_members, load_present, load_tables
from tunneldb.federation.names import HUB, INTERNAL, SERVER, foreign_server
from tunneldb.federation.views import Column, HubView, plan_views


def show_servers(connection: psycopg.Connection[Any]) -> int:
    """Make the views over all servers of the hub by their states, within the transaction of the caller; return their number."""
    members = load_members(connection)
    views = plan_views(
        {member.name: load_tables(connection, member.name) for member in members},
        [member.name for member in members if member.away],
    )
    save_views(connection, views)
    connection.execute("UPDATE tunnel_hub.server SET shown = state <> 'away' WHERE shown = (state = 'away')")
    return len(views)


def save_views(connection: psycopg.Connection[Any], views: list[HubView]) -> None:
    """Bring the views over all servers to the planned form, within the transaction of the caller.

    A view whose columns stay, or get others at the end, is replaced, so that views of users on it remain.

    Raises
    ------
    UserError
        If a view must be dropped that views of users depend on.
    """
    present = load_present(connection)
    planned = {view.name for view in views}
    try:
        for name in sorted((present.views.keys() | present.tables.keys()) - planned):
            _drop(connection, name, present)
        for view in views:
            _save(connection, view, present)
    except psycopg.errors.DependentObjectsStillExist as error:
        raise UserError(
            f"{first_line(error)}: {(error.diag.message_detail or '').splitlines()[0]}; drop it, and create it again afterwards"
        ) from None
    connection.execute((resource_dir("sql") / "hub" / "grant.sql").read_bytes())


def _drop(connection: psycopg.Connection[Any], name: str, present: Present) -> None:
    connection.execute(sql.SQL("DROP VIEW IF EXISTS {}").format(sql.Identifier(HUB, name)))
    for schema in present.partitions.get(name, ()):
        _detach(connection, name, schema)
    connection.execute(sql.SQL("DROP TABLE IF EXISTS {}").format(sql.Identifier(INTERNAL, name)))


def _detach(connection: psycopg.Connection[Any], name: str, schema: str) -> None:
    connection.execute(
        sql.SQL("ALTER TABLE {} DETACH PARTITION {}").format(sql.Identifier(INTERNAL, name), sql.Identifier(schema, name))
    )


def _save(connection: psycopg.Connection[Any], view: HubView, present: Present) -> None:
    attached = present.partitions.get(view.name, frozenset())
    if present.tables.get(view.name) != view.columns:
        old = present.views.get(view.name)
        if old is not None and old == view.columns[: len(old)]:  # can be replaced, first by a view without its table
            connection.execute(_define(view.name, [_empty(view.columns)]))
        else:
            connection.execute(sql.SQL("DROP VIEW IF EXISTS {}").format(sql.Identifier(HUB, view.name)))
        for schema in attached:
            _detach(connection, view.name, schema)
        connection.execute(sql.SQL("DROP TABLE IF EXISTS {}").format(sql.Identifier(INTERNAL, view.name)))
        connection.execute(
            sql.SQL("CREATE TABLE {} ({}) PARTITION BY LIST ({})").format(
                sql.Identifier(INTERNAL, view.name),
                sql.SQL(", ").join(sql.SQL("{} {}").format(sql.Identifier(c.name), sql.SQL(c.type)) for c in view.columns),
                sql.Identifier(SERVER),
            )
        )
        attached = frozenset()
    wanted = {foreign_server(server): server for server in view.partitions}
    for schema in sorted(attached - wanted.keys()):
        _detach(connection, view.name, schema)
    for schema in sorted(wanted.keys() - attached):
        connection.execute(
            sql.SQL("ALTER TABLE {} ATTACH PARTITION {} FOR VALUES IN ({})").format(
                sql.Identifier(INTERNAL, view.name), sql.Identifier(schema, view.name), sql.Literal(wanted[schema])
            )
        )
    connection.execute(_define(view.name, _branches(view)))


def _define(name: str, branches: list[sql.Composed]) -> sql.Composed:
    return sql.SQL("CREATE OR REPLACE VIEW {} AS {}").format(sql.Identifier(HUB, name), sql.SQL(" UNION ALL ").join(branches))


def _branches(view: HubView) -> list[sql.Composed]:
    """Return the parts of a view: warnings of servers without rows, the table of complete servers, incomplete servers.

    The warnings come first, so that a query with LIMIT, which may not need the later parts, gets them, too.
    """
    columns = sql.SQL(", ").join(sql.Identifier(column.name) for column in view.columns)
    branches = []
    for server in (*view.away, *view.lacking):
        constants = sql.SQL(", ").join(_value(column, server) for column in view.columns)
        function, words = ("warn_away", [server]) if server in view.away else ("warn_lacking", [server, view.name])
        warning = sql.SQL("{}({})").format(sql.Identifier(INTERNAL, function), sql.SQL(", ").join(map(sql.Literal, words)))
        branches.append(sql.SQL("SELECT {} WHERE {}").format(constants, warning))
    if view.partitions or not (view.incomplete or branches):
        branches.append(sql.SQL("SELECT {} FROM {}").format(columns, sql.Identifier(INTERNAL, view.name)))
    for server, known in view.incomplete.items():
        values = [sql.Identifier(c.name) if c.name in known and c.name != SERVER else _value(c, server) for c in view.columns]
        source = sql.Identifier(foreign_server(server), view.name)
        branches.append(sql.SQL("SELECT {} FROM {}").format(sql.SQL(", ").join(values), source))
    return branches


def _empty(columns: tuple[Column, ...]) -> sql.Composed:
    return sql.SQL("SELECT {} WHERE false").format(sql.SQL(", ").join(_value(column, None) for column in columns))


def _value(column: Column, server: str | None) -> sql.Composed:
    """Return the constant of a branch for a column: the server's name or NULL, of the column's type."""
    value = sql.Literal(server if column.name == SERVER else None)
    return sql.SQL("CAST({} AS {}) AS {}").format(value, sql.SQL(column.type), sql.Identifier(column.name))
