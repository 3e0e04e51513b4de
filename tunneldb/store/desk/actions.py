"""Actions of inspections for the desk: listed, added, changed and deleted through the view ``tunnel_api.action``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.store.desk.rows import named

WRITTEN = {
    "finding_id": "bigint", "element": "text", "chainage_from": "float8", "chainage_to": "float8", "measure": "text",
    "urgency": "text", "responsible": "text", "due": "date", "cost": "numeric", "currency": "text", "state": "text",
    "remark": "text",
}  # fmt: skip
"""Columns that people give, with their types."""

_COLUMNS = (
    "a.id, a.survey, a.finding_id, a.finding_kind, a.element, a.chainage_from, a.chainage_to, a.arc, a.label, a.measure,"
    " a.urgency, a.responsible, a.due::text AS due, a.overdue, a.cost::float8 AS cost, a.currency, a.state, a.remark, a.photos,"
    " a.follow_up, a.added_by, to_char(a.added_at, 'YYYY-MM-DD HH24:MI') AS added_at, a.changed_by,"
    " to_char(a.changed_at, 'YYYY-MM-DD HH24:MI') AS changed_at"
)

_ORDER = "coalesce(a.overdue, false) DESC, a.state IN ('done', 'verified'), a.due NULLS LAST, a.chainage_from, a.id"
"""Overdue ones first, then those to be done by due date, then those that are done."""


def of_tunnel(conn: psycopg.Connection[Any], tunnel_id: int) -> list[dict[str, Any]]:
    """Return the actions that all surveys of a tunnel demand, overdue ones first."""
    return named(
        conn.execute(f"SELECT {_COLUMNS} FROM tunnel_api.action a WHERE a.tunnel_id = %s ORDER BY {_ORDER}", [tunnel_id])
    )


def read_of_finding(conn: psycopg.Connection[Any], finding_id: int) -> psycopg.Cursor[Any]:
    """Begin to read the actions on a finding, overdue ones first."""
    return conn.execute(f"SELECT {_COLUMNS} FROM tunnel_api.action a WHERE a.finding_id = %s ORDER BY {_ORDER}", [finding_id])


def action(conn: psycopg.Connection[Any], action_id: int) -> dict[str, Any] | None:
    """Return an action; None if there is none."""
    rows = named(conn.execute(f"SELECT {_COLUMNS} FROM tunnel_api.action a WHERE a.id = %s", [action_id]))
    return rows[0] if rows else None


def add(conn: psycopg.Connection[Any], survey: str, values: Mapping[str, Any]) -> int:
    """Add an action that a survey demands; return its id."""
    names = [name for name in WRITTEN if values.get(name) is not None]
    row = conn.execute(
        sql.SQL("INSERT INTO tunnel_api.action (survey, {}) VALUES (%s, {}) RETURNING id").format(
            sql.SQL(", ").join(map(sql.Identifier, names)), sql.SQL(", ").join(map(_typed, names))
        ),
        [survey, *(values[name] for name in names)],
    ).fetchone()
    assert row is not None
    return int(row[0])


def change(conn: psycopg.Connection[Any], action_id: int, seen: Mapping[str, Any], values: Mapping[str, Any]) -> bool:
    """Write values of an action if these columns are still as seen; return False if nothing was written.

    Changes of its other columns by other people stay.
    """
    names: Sequence[str] = list(values)
    row = conn.execute(
        sql.SQL("UPDATE tunnel_api.action a SET {} WHERE a.id = %s AND {} RETURNING a.id").format(
            sql.SQL(", ").join(sql.SQL("{} = {}").format(sql.Identifier(name), _typed(name)) for name in names),
            sql.SQL(" AND ").join(
                sql.SQL("a.{} IS NOT DISTINCT FROM {}").format(sql.Identifier(name), _typed(name)) for name in names
            ),
        ),
        [*(values[name] for name in names), action_id, *(seen[name] for name in names)],
    ).fetchone()
    return row is not None


def delete(conn: psycopg.Connection[Any], action_id: int) -> bool:
    """Delete an action; return False if there is none."""
    return conn.execute("DELETE FROM tunnel_api.action WHERE id = %s", [action_id]).rowcount > 0


def _typed(name: str) -> sql.Composable:
    return sql.SQL("%s::" + WRITTEN[name])
