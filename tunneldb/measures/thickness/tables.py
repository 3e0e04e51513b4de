"""Thickness between two surveys, as rows by section and by stretch."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.store.survey import Survey

Row = dict[str, Any]

COLUMNS = (
    "chainage_from", "chainage_to", "label", "design_length", "compared_length", "area", "thickness_mean", "thickness_least",
    "least_at",
)  # fmt: skip
"""Columns of a section; m and m²."""


def section_rows(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, layer: str, low: float, high: float
) -> list[Row]:
    """Read the sections in a stretch, also partial ones, in order of chainage."""
    query = sql.SQL(
        "SELECT {} FROM tunnel_api.thickness_section WHERE survey_id = %s AND before_id = %s AND layer = %s"
        " AND chainage_to > %s AND chainage_from < %s ORDER BY chainage_from"
    ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS)))
    with conn.cursor(row_factory=dict_row) as cursor:
        rows = cursor.execute(query, [after.id, before.id, layer, low, high]).fetchall()
    return [{name: round(value, 5) if isinstance(value, float) else value for name, value in row.items()} for row in rows]


def stretch_rows(
    conn: psycopg.Connection[Any],
    before: Survey,
    after: Survey,
    layer: str,
    low: float,
    high: float,
    step: float,
    minimum: float,
    axis_sigma: float,
) -> list[Row]:
    """Read volume and thickness by stretches of ``step`` metres, also partial ones."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT * FROM tunnel_api.thickness_stretches(%s, %s, %s, %s, %s, %s)"
            " WHERE chainage_to > %s AND chainage_from < %s ORDER BY chainage_from",
            [before.name, after.name, layer, step, minimum, axis_sigma, low, high],
        ).fetchall()
