"""Clearance as rows: sections, kilometres, infringements, and as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import psycopg
from psycopg.rows import dict_row

from tunneldb.csvfile import write_csv
from tunneldb.store.survey import Survey

Row = dict[str, Any]

SECTION = (
    "label", "chainage_from", "chainage_to", "track", "margin", "margin_se", "clock", "class", "cluster_id", "seen_share",
    "points", "inside", "stray", "passing", "ground", "track_right", "track_up", "cant", "radius", "widened_left",
    "widened_right", "roll",
)  # fmt: skip


def section_rows(conn: psycopg.Connection[Any], survey: Survey, gauge: str, track: str, low: float, high: float) -> list[Row]:
    """Read the sections of a stretch in order, with the columns SECTION and ``margins``."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT label, chainage_from, chainage_to, track, margin, margin_se, clock, class, cluster_id, seen_share, points,"
            " inside, stray, passing, ground, track_right, track_up, cant, radius, widened_left, widened_right, roll, margins"
            " FROM tunnel_api.clearance_section WHERE survey_id = %s AND gauge = %s AND track = %s"
            " AND chainage_to > %s AND chainage_from < %s ORDER BY chainage_from",
            [survey.id, gauge, track, low, high],
        ).fetchall()


def infringement_rows(
    conn: psycopg.Connection[Any], survey: Survey, gauge: str, track: str, low: float, high: float
) -> list[Row]:
    """Read the infringements of a stretch, deepest first."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT id, label, chainage_from, chainage_to, depth, clock, class, counts, cluster_id, points"
            " FROM tunnel_api.clearance_infringement WHERE survey_id = %s AND gauge = %s AND track = %s"
            " AND chainage_to > %s AND chainage_from < %s ORDER BY depth DESC, id",
            [survey.id, gauge, track, low, high],
        ).fetchall()


def summary(conn: psycopg.Connection[Any], survey: Survey, gauge: str, track: str, low: float, high: float) -> list[Row]:
    """Read a row for each kilometre of a stretch, with the counts of its run."""
    with conn.cursor(row_factory=dict_row) as cursor:
        return cursor.execute(
            "SELECT c.km, count(*) AS metres, min(c.margin) AS margin, count(*) FILTER (WHERE c.inside > 0) AS metres_inside,"
            " avg(c.seen_share) AS seen_share, sum(c.stray)::int AS stray, sum(c.passing)::int AS passing,"
            " sum(c.ground)::int AS ground, (SELECT r.counts FROM tunnel.run r WHERE r.survey_id = %(survey)s AND r.km = c.km"
            " AND r.stage = 'clearance' AND r.outcome = 'done' AND r.parameters ->> 'gauge' = %(gauge)s"
            " AND r.parameters ->> 'track' = %(track)s ORDER BY r.started_at DESC LIMIT 1) AS run"
            " FROM tunnel_api.clearance_section c WHERE c.survey_id = %(survey)s AND c.gauge = %(gauge)s"
            " AND c.track = %(track)s AND c.chainage_to > %(low)s AND c.chainage_from < %(high)s GROUP BY c.km ORDER BY c.km",
            {"survey": survey.id, "gauge": gauge, "track": track, "low": low, "high": high},
        ).fetchall()


def sections_csv(rows: Sequence[Row]) -> str:
    """Return sections as CSV, with a column for each direction of 5°."""
    count = len(rows[0]["margins"]) if rows else 0
    names = [*SECTION, *(f"margin_{k * 360 // count:03d}" for k in range(count))]
    cells = ([*(row[name] for name in SECTION), *(None if v != v else v for v in row["margins"])] for row in rows)
    return write_csv(names, ([round(cell, 5) if isinstance(cell, float) else cell for cell in row] for row in cells))
