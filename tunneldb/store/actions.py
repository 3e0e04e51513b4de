"""Actions of inspections, to and from the database."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.errors import InputError, UserError

STATES = ("open", "ordered", "done", "verified")
URGENCIES = ("immediate", "urgent", "planned", "monitor")

EDITABLE = (
    "finding_id", "element", "chainage_from", "chainage_to", "measure", "urgency", "responsible", "due", "cost", "currency",
    "state", "remark",
)  # fmt: skip
"""Columns that people give."""

READ = (
    "id", "survey", "label", "finding_id", "finding_kind", "element", "chainage_from", "chainage_to", "arc", "measure",
    "urgency", "responsible", "due", "overdue", "cost", "currency", "state", "remark", "photos", "follow_up", "added_by",
    "added_at", "changed_by", "changed_at",
)  # fmt: skip
"""Columns that are listed."""


def list_actions(
    conn: psycopg.Connection[Any],
    tunnel_id: int,
    states: Sequence[str] = (),
    overdue: bool = False,
    survey: str | None = None,
) -> list[dict[str, Any]]:
    """Return the actions of a tunnel by due date, those without one last; of these states, or overdue ones, or of a survey."""
    query = sql.SQL(
        "SELECT {} FROM tunnel_api.action a WHERE a.tunnel_id = %(tunnel)s"
        " AND (%(states)s::text[] = '{{}}' OR a.state = ANY (%(states)s)) AND (NOT %(overdue)s OR a.overdue)"
        " AND (%(survey)s::text IS NULL OR a.survey = %(survey)s) ORDER BY a.due NULLS LAST, a.chainage_from, a.id"
    ).format(sql.SQL(", ").join(sql.Identifier("a", name) for name in READ))
    values = {"tunnel": tunnel_id, "states": list(states), "overdue": overdue, "survey": survey}
    return conn.cursor(row_factory=dict_row).execute(query, values).fetchall()


def outdated_comparisons(conn: psycopg.Connection[Any], tunnel_id: int) -> list[tuple[str, str, str]]:
    """Return older survey, newer survey and reason of each outdated comparison that follow-ups of actions use."""
    query = (
        "SELECT DISTINCT r.older_survey, r.survey, r.reason FROM tunnel_api.result_status r"
        " WHERE r.stage = 'compare' AND r.stale AND r.survey IN (SELECT s.name FROM tunnel_api.survey s WHERE s.tunnel_id = %s)"
        " AND r.older_survey IN (SELECT a.survey FROM tunnel_api.action a WHERE a.tunnel_id = %s AND a.finding_id IS NOT NULL)"
        " ORDER BY 1, 2, 3"
    )
    return conn.execute(query, [tunnel_id, tunnel_id]).fetchall()


def add_action(conn: psycopg.Connection[Any], survey: str, values: Mapping[str, Any]) -> int:
    """Add an action that a survey demands; return its id.

    Raises
    ------
    UserError
        If the database refuses a value.
    """
    names = [name for name in EDITABLE if values.get(name) is not None]
    query = sql.SQL("INSERT INTO tunnel_api.action (survey, {}) VALUES (%s, {}) RETURNING id").format(
        sql.SQL(", ").join(map(sql.Identifier, names)), sql.SQL(", ").join(sql.Placeholder() * len(names))
    )
    row = _execute(conn, query, [survey, *(values[name] for name in names)])
    assert row is not None
    return int(row[0])


def change_action(conn: psycopg.Connection[Any], action_id: int, values: Mapping[str, Any]) -> None:
    """Change values of an action; those that are not named stay.

    Raises
    ------
    UserError
        If there is no such action, or the database refuses a value.
    """
    query = sql.SQL("UPDATE tunnel_api.action SET {} WHERE id = %s RETURNING id").format(
        sql.SQL(", ").join(sql.SQL("{} = %s").format(sql.Identifier(name)) for name in values)
    )
    if _execute(conn, query, [*values.values(), action_id]) is None:
        raise UserError(f"there is no action {action_id}: tunneldb actions list TUNNEL")


def remove_action(conn: psycopg.Connection[Any], action_id: int) -> None:
    """Remove an action; raise UserError if there is none."""
    if _execute(conn, sql.SQL("DELETE FROM tunnel_api.action WHERE id = %s RETURNING id"), [action_id]) is None:
        raise UserError(f"there is no action {action_id}: tunneldb actions list TUNNEL")


def _execute(conn: psycopg.Connection[Any], query: sql.SQL | sql.Composed, values: Sequence[Any]) -> tuple[Any, ...] | None:
    try:
        return conn.execute(query, values).fetchone()
    except (psycopg.errors.DataError, psycopg.errors.IntegrityError, psycopg.errors.FeatureNotSupported) as error:
        raise InputError(error.diag.message_primary or str(error)) from None
    except psycopg.errors.SerializationFailure as error:
        raise UserError(f"{error.diag.message_primary}; list the actions again") from None
