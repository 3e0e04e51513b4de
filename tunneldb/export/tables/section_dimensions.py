"""Width, height and area of cross-sections at a step, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.export.tables.workbook import Column, Sheet
from tunneldb.store.survey import Survey

Row = dict[str, Any]

COLUMNS = (
    "chainage", "label", "width", "height", "area", "measured_share", "profile", "design_area", "area_difference",
)  # fmt: skip
"""Columns of a section: m, m², shares."""

_DECIMALS = 4
_HEADINGS = (
    Column("Chainage, m", "0.000"), Column("Station"), Column("Width, m", "0.000"), Column("Height, m", "0.000"),
    Column("Area, m²", "0.000"), Column("Measured", "0 %"), Column("Design profile"), Column("Design area, m²", "0.000"),
    Column("Area less design, m²", "0.000"),
)  # fmt: skip


def dimension_rows(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, step: float) -> list[Row]:
    """Read for each multiple of a step, m, the nearest section between two chainages, m."""
    with conn.cursor(row_factory=dict_row) as cursor:
        query = sql.SQL("SELECT {} FROM tunnel_api.section_dimensions(%s, %s, %s, %s)").format(
            sql.SQL(", ").join(map(sql.Identifier, COLUMNS))
        )
        rows = cursor.execute(query, [survey.name, step, low, high]).fetchall()
    return [
        {name: round(value, _DECIMALS) if isinstance(value, float) else value for name, value in row.items()} for row in rows
    ]


def dimension_sheet(rows: Sequence[Row]) -> Sheet:
    """Return the sheet of a workbook with these rows."""
    return Sheet("Cross-sections", _HEADINGS, [[row[name] for name in COLUMNS] for row in rows])
