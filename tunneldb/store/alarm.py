"""Limits of series of tunnels, to and from the database, and the alarms that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import dict_row

from tunneldb.errors import UserError


@dataclass(frozen=True)
class AlarmLimit:
    """Limits of a quantity.

    Attributes
    ----------
    name : str
    quantity : str
        ovality, convergence, wet_area or growth.
    warning, alarm : float
        Values from which it is a warning or an alarm, in the unit of the quantity.
    chainage_from, chainage_to : float or None
        Part of the tunnel to which it applies, m; None for its ends.
    step : float or None
        Length of the stretches of wet_area and growth, m.
    clock : (float, float) or None
        Clock positions of the ends of the chord of convergence, hours.
    reference : str or None
        Survey since which convergence counts.
    min_inspected : float
        Inspected share below which a value below the limits is unknown.
    """

    name: str
    quantity: str
    warning: float
    alarm: float
    chainage_from: float | None = None
    chainage_to: float | None = None
    step: float | None = None
    clock: tuple[float, float] | None = None
    reference: str | None = None
    min_inspected: float = 0.95


def save_limit(conn: psycopg.Connection[Any], tunnel_id: int, tunnel: str, limit: AlarmLimit) -> None:
    """Add a limit to a tunnel; raise UserError if its name is taken."""
    row = conn.execute(
        "INSERT INTO tunnel.alarm_limit (tunnel_id, name, quantity, warning, alarm, chainage_from, chainage_to, step,"
        " clock_from, clock_to, reference, min_inspected) VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)"
        " ON CONFLICT DO NOTHING RETURNING id",
        [
            tunnel_id, limit.name, limit.quantity, limit.warning, limit.alarm, limit.chainage_from, limit.chainage_to,
            limit.step, *(limit.clock or (None, None)), limit.reference, limit.min_inspected,
        ],
    ).fetchone()  # fmt: skip
    if row is None:
        raise UserError(f"tunnel {tunnel} has a limit named {limit.name!r}: tunneldb alarms remove {tunnel} {limit.name}")


def list_limits(conn: psycopg.Connection[Any], tunnel_id: int) -> list[dict[str, Any]]:
    """Return the limits of a tunnel by name."""
    return conn.cursor(row_factory=dict_row).execute(
        "SELECT l.name, l.quantity, l.unit, l.warning, l.alarm, l.chainage_from, l.chainage_to, l.label_from, l.label_to,"
        " l.step, l.clock_from, l.clock_to, l.reference, l.min_inspected"
        " FROM tunnel_api.alarm_limit l WHERE l.tunnel_id = %s ORDER BY l.name",
        [tunnel_id],
    ).fetchall()  # fmt: skip


def remove_limit(conn: psycopg.Connection[Any], tunnel_id: int, tunnel: str, name: str) -> None:
    """Remove a limit of a tunnel; raise UserError if there is none."""
    done = conn.execute("DELETE FROM tunnel.alarm_limit WHERE tunnel_id = %s AND name = %s", [tunnel_id, name])
    if not done.rowcount:
        raise UserError(f"tunnel {tunnel} has no limit named {name!r}: tunneldb alarms list {tunnel}")


def load_alarms(conn: psycopg.Connection[Any], tunnel: str) -> list[dict[str, Any]]:
    """Return the values of the latest survey with their levels, as the function ``alarms`` does."""
    return conn.cursor(row_factory=dict_row).execute(
        "SELECT a.name, a.quantity, a.unit, a.chainage_from, a.chainage_to, a.label, a.survey, a.date, a.value,"
        " a.inspected_share, a.warning, a.alarm, a.level, a.previous_survey, a.previous_date, a.previous_value, a.rate, a.why"
        " FROM tunnel_api.alarms(%s) a",
        [tunnel],
    ).fetchall()  # fmt: skip
