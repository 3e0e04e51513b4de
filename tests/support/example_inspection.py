"""An earlier inspection of the example's tunnel, compared with the example, for what a report says since then."""

from __future__ import annotations

import psycopg

from support.example_change import EARLIER, add_earlier
from support.example_survey import copy_rows

SEARCHED_TO = 12450.0
"""Chainage to which the earlier survey inspected the lining, m."""

THEN = (2, 3)
"""Leaks of the example that the earlier survey had, too: their ids."""

SMALLER = 0.04
"""Area of them then, as a share of that now."""


def add_inspection(conn: psycopg.Connection, survey: str) -> int:
    """Add the earlier survey with coverage, two leaks, and its comparison with the example; return its key."""
    add_earlier(conn, survey)
    (earlier,) = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [EARLIER]).fetchone()
    copy_rows(conn, survey, earlier, ("axis_vertex", "segment", "section", "coverage"))
    conn.execute(
        "UPDATE tunnel.coverage SET seen = (SELECT array_agg(CASE WHEN km * 1000 + step * (n - 0.5) < %s THEN s ELSE 0 END"
        " ORDER BY n) FROM unnest(seen) WITH ORDINALITY AS u (s, n)) WHERE survey_id = %s",
        [SEARCHED_TO, earlier],
    )
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons,"
        " confidence, contrast, area, darkening_mean, darkening_max, image_share, unrolled, map, surface, review)"
        " SELECT %s, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons, confidence, contrast, %s * area,"
        " darkening_mean, darkening_max, image_share, unrolled, map, surface, 'confirmed' FROM tunnel.finding"
        " WHERE id = ANY (%s)",
        [earlier, SMALLER, list(THEN)],
    )
    return earlier
