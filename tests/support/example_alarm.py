"""Limits of the example's tunnel, one of each quantity."""

from __future__ import annotations

import psycopg

STEP = 50.0
"""Length of stretches, m."""

OVALITY = (0.005, 0.009)
"""Warning and alarm of ovality: rings 50 to 89 have a warning, the others from 90 an alarm (`example_rings`)."""


def add_alarms(conn: psycopg.Connection, survey_id: int) -> None:
    """Limits of ovality, convergence, wet area and growth."""
    conn.execute(
        "INSERT INTO tunnel.alarm_limit (tunnel_id, name, quantity, warning, alarm, step, clock_from, clock_to, min_inspected)"
        " SELECT s.tunnel_id, l.* FROM tunnel.survey s, (VALUES"
        " ('oval', 'ovality', %(warning)s, %(alarm)s, NULL, NULL, NULL, 0.7),"
        " ('chord', 'convergence', 0.0015, 0.0025, NULL, 9, 3, 0.95),"
        " ('wet', 'wet_area', 0.5, 1, %(step)s, NULL, NULL, 0.95),"
        " ('growth', 'growth', 0.25, 0.5, %(step)s, NULL, NULL, 0.95)) AS l WHERE s.id = %(survey)s",
        {"survey": survey_id, "step": STEP, "warning": OVALITY[0], "alarm": OVALITY[1]},
    )
