"""Change between two surveys as tables."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.csvfile import write_csv
from tunneldb.store.survey import Survey

Row = dict[str, Any]

COLUMNS = {
    "change_section": (
        "chainage_from", "chainage_to", "label", "seen_old", "seen_new", "seen_both", "unseen", "shift", "shift_right",
        "shift_right_se", "shift_up", "shift_up_se", "shift_along", "shift_along_se", "roll", "roll_se", "yaw", "yaw_se",
        "pitch", "pitch_se", "change_rms", "change_least", "change_greatest", "lod",
    ),
    "change_region": (
        "id", "chainage_from", "chainage_to", "label", "arc_from", "arc_to", "clock", "area", "change_mean", "lod",
        "change_extreme",
    ),
    "leak_change": (
        "id", "state", "chainage_from", "chainage_to", "label", "clock", "area_old", "area_old_se", "area_new", "area_new_se",
        "area_change", "area_change_se", "seen_old", "seen_new", "old_kinds", "new_kinds", "old_ids", "new_ids",
    ),
}  # fmt: skip
"""Columns of the views; m, m² and rad."""

_DECIMALS = 6


def change_rows(conn: psycopg.Connection[Any], view: str, old: Survey, new: Survey, low: float, high: float) -> list[Row]:
    """Read the rows of a view of change in a stretch, also partial ones, in order of chainage."""
    query = sql.SQL(
        "SELECT {} FROM {} WHERE survey_id = %s AND old_survey_id = %s AND chainage_to > %s AND chainage_from < %s"
        " ORDER BY chainage_from, id"
    ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS[view])), sql.Identifier("tunnel_api", view))
    with conn.cursor(row_factory=dict_row) as cursor:
        rows = cursor.execute(query, [new.id, old.id, low, high]).fetchall()
    return [{name: _rounded(value) for name, value in row.items()} for row in rows]


def change_csv(rows: list[Row], view: str) -> str:
    """Return rows as CSV with a header; unknown values are empty."""
    cells = ([row[name] for name in COLUMNS[view]] for row in rows)
    return write_csv(COLUMNS[view], ([" ".join(map(str, v)) if isinstance(v, list) else v for v in row] for row in cells))


def summary(sections: list[Row], regions: list[Row], leaks: list[Row]) -> Row:
    """Sum over a stretch: areas in m², and the number of leaks in each state."""
    states: dict[str, int] = {}
    for leak in leaks:
        states[leak["state"]] = states.get(leak["state"], 0) + 1
    shifts = [row["shift"] for row in sections if row["shift"] is not None]
    return {
        "compared": round(sum(row["seen_both"] for row in sections), 3),
        "unseen": round(sum(row["unseen"] for row in sections), 3),
        "regions": len(regions),
        "changed": round(sum(row["area"] for row in regions), 3),
        "inwards": round(sum(row["area"] for row in regions if row["change_mean"] > 0.0), 3),
        "shift_greatest": max(shifts, default=None),
        "sections_without_motion": sum(row["shift"] is None for row in sections),
        "leaks": states,
        "wet_old": round(sum(leak["area_old"] for leak in leaks), 3),
        "wet_new": round(sum(leak["area_new"] for leak in leaks), 3),
    }


def _rounded(value: Any) -> Any:
    return round(value, _DECIMALS) if isinstance(value, float) else value
