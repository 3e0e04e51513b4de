"""An action of the example survey."""

from __future__ import annotations

import psycopg


def add_action(conn: psycopg.Connection, survey_id: int) -> None:
    """The first leak is to be sealed by the end of 2030."""
    conn.execute(
        "INSERT INTO tunnel.action (survey_id, finding_id, chainage_from, chainage_to, arc, measure, due, cost, currency)"
        " SELECT a.survey_id, a.id, a.chainage_from, a.chainage_to, (a.arc_from + a.arc_to) / 2, 'seal the joint',"
        " '2030-12-31', 1200, 'EUR' FROM tunnel.finding a WHERE a.survey_id = %s ORDER BY a.id LIMIT 1",
        [survey_id],
    )
