"""What was put on between two surveys, by section and by stretch, as tables."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.store.survey import Survey

Row = dict[str, Any]

COLUMNS = (
    "chainage_from", "chainage_to", "label", "design_length", "compared_length", "area", "noise_area", "thickness_mean",
    "thickness_least", "least_at",
)  # fmt: skip
"""Of a section; m and m²."""

_DECIMALS = 5
_WHOLE = 1e7  # m, longer than any tunnel: one stretch


def section_rows(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, layer: str, low: float, high: float
) -> list[Row]:
    """Sections that lie in a stretch, whole or in part, in order of chainage."""
    with conn.cursor(row_factory=dict_row) as cursor:
        query = sql.SQL(
            "SELECT {} FROM tunnel_api.thickness_section WHERE survey_id = %s AND before_id = %s AND layer = %s"
            " AND chainage_to > %s AND chainage_from < %s ORDER BY chainage_from"
        ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS)))
        rows = cursor.execute(query, [after.id, before.id, layer, low, high]).fetchall()
    return [
        {name: round(value, _DECIMALS) if isinstance(value, float) else value for name, value in row.items()} for row in rows
    ]


def stretch_rows(
    conn: psycopg.Connection[Any],
    before: Survey,
    after: Survey,
    layer: str,
    low: float,
    high: float,
    step: float | None,
    minimum: float,
    axis_sigma: float,
) -> list[Row]:
    """Volume and thickness by stretches of so many metres of what lies between two chainages; of all at once without."""
    limits = [None if np.isinf(limit) else limit for limit in (low, high)]
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT * FROM tunnel_api.thickness_stretches(%s, %s, %s, %s, %s, %s, coalesce(%s::float8, '-infinity'),"
            " coalesce(%s::float8, 'infinity')) ORDER BY stretch_from",
            [before.name, after.name, layer, step or _WHOLE, minimum, axis_sigma, *limits],
        ).fetchall()


def below_rows(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, layer: str, low: float, high: float, minimum: float
) -> list[Row]:
    """Places of a stretch that are thinner than a minimum."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT * FROM tunnel_api.thickness_below(%s, %s, %s, %s) WHERE chainage_to > %s AND chainage_from < %s"
            " ORDER BY chainage_from, along_from",
            [before.name, after.name, layer, minimum, low, high],
        ).fetchall()


def sections_csv(rows: list[Row]) -> str:
    """Sections as CSV, with a header; what could not be told is empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
