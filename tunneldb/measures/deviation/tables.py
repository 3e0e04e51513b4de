"""Sections and stretches of a lining against its design, as tables."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.store.survey import Survey

Row = dict[str, Any]

COLUMNS = (
    "chainage_from", "chainage_to", "label", "profile", "design_length", "seen_length", "overbreak", "underbreak",
    "deviation_mean", "deviation_least", "least_at", "deviation_greatest", "greatest_at", "sigma", "shift_right", "shift_up",
)  # fmt: skip
"""Columns of a section; m and m²."""

_DECIMALS = 5


def section_rows(conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float) -> list[Row]:
    """Read the sections in a stretch, also partial ones, in order of chainage."""
    with conn.cursor(row_factory=dict_row) as cursor:
        query = sql.SQL(
            "SELECT {} FROM tunnel_api.deviation_section"
            " WHERE survey_id = %s AND layer = %s AND chainage_to > %s AND chainage_from < %s ORDER BY chainage_from"
        ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS)))
        rows = cursor.execute(query, [survey.id, layer, low, high]).fetchall()
    return [{name: _rounded(value) for name, value in row.items()} for row in rows]


def stretch_rows(
    conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float, step: float, axis_sigma: float
) -> list[Row]:
    """Read over- and underbreak by stretches of ``step`` metres, also partial ones."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT s.chainage_from, s.chainage_to, s.label, v.* FROM tunnel_api.deviation_stretches(%s, %s, %s) s,"
            " tunnel_api.deviation_volume(%s, %s, greatest(s.chainage_from, %s), least(s.chainage_to, %s), %s) v"
            " WHERE s.chainage_to > %s AND s.chainage_from < %s AND v.length > 0 ORDER BY s.chainage_from",
            [survey.name, layer, step, survey.name, layer, low, high, axis_sigma, low, high],
        ).fetchall()


def volume(conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float, axis_sigma: float) -> Row | None:
    """Read over- and underbreak of a stretch; None if nothing was compared with the design."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT * FROM tunnel_api.deviation_volume(%s, %s, %s, %s, %s) v WHERE v.length IS NOT NULL",
            [survey.name, layer, low, high, axis_sigma],
        ).fetchone()


def _rounded(value: Any) -> Any:
    return round(value, _DECIMALS) if isinstance(value, float) else value
