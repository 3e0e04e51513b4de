"""Rings of a survey as a table."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.store.survey import Survey

Row = dict[str, Any]

COLUMNS = (
    "number", "label", "chainage_from", "chainage_to", "joint", "seen_share", "shape", "centre_right", "centre_right_se",
    "centre_up", "centre_up_se", "radius", "radius_se", "diameter_largest", "diameter_largest_se", "diameter_smallest",
    "diameter_smallest_se", "largest_clock", "largest_clock_se", "ovality", "ovality_se", "design_diameter", "diameter_from",
    "inward", "inward_se", "inward_clock", "outward", "outward_se", "outward_clock", "sigma", "step_greatest",
    "step_greatest_se", "step_greatest_arc", "lip", "lip_se", "lip_arc", "remark",
)  # fmt: skip
"""Columns of a ring; m, °, and ovality as a share."""

CIRCLE_COLUMNS = ("circle_x", "circle_y", "circle_z", "circle_radius")
"""Columns after the chords: best-fit circle of all points, in the tunnel's SRID, m."""

_DECIMALS = 6


def ring_rows(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> list[Row]:
    """Read rings whose middle is in a stretch, in order of chainage, each with its chords."""
    with conn.cursor(row_factory=dict_row) as cursor:
        query = sql.SQL(
            "SELECT {}, (SELECT jsonb_object_agg(concat_ws('_', 'chord', c.clock_from, c.clock_to),"
            " jsonb_build_array(c.length, c.length_se)) FROM tunnel_api.ring_chord c WHERE c.ring_id = r.id) AS chords"
            " FROM tunnel_api.ring r WHERE survey_id = %s AND (chainage_from + chainage_to) / 2 BETWEEN %s AND %s"
            " ORDER BY chainage_from"
        ).format(sql.SQL(", ").join(map(sql.Identifier, (*COLUMNS, *CIRCLE_COLUMNS))))
        rows = cursor.execute(query, [survey.id, low, high]).fetchall()
    return [_flat(row) for row in rows]


def _flat(row: Row) -> Row:
    chords = row.pop("chords") or {}
    flat = {name: round(value, _DECIMALS) if isinstance(value, float) else value for name, value in row.items()}
    circle = {name: flat.pop(name) for name in CIRCLE_COLUMNS}
    for name, (length, se) in sorted(chords.items()):
        flat[name], flat[f"{name}_se"] = (None if value is None else round(value, _DECIMALS) for value in (length, se))
    return flat | circle
