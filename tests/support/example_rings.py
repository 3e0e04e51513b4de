"""Rings of the example survey, row by row: ovality and steps grow with the number."""

from __future__ import annotations

import psycopg

LENGTH, COUNT = 2.0, 100
OVALITY, STEP, CHORD = 0.0001, 0.0002, 8.0
"""Ovality and greatest step of ring 1, of which ring n has n times as much, every other step outwards; chord, m."""


def add_rings(conn: psycopg.Connection, survey_id: int) -> None:
    """Rings from 12+300 to 12+500, measured, with a chord each that shortens by 1 mm from ring to ring."""
    conn.execute(
        "INSERT INTO tunnel.ring (survey_id, km, number, chainage_from, chainage_to, origin, joint, seen_share, shape, radius,"
        " radius_se, ovality, ovality_se, design_diameter, diameter_from, step, step_se, step_arc, step_greatest,"
        " step_greatest_se, step_greatest_arc)"
        " SELECT %(survey)s, 12, n, 12300 + (n - 1) * %(length)s, 12300 + n * %(length)s, 'length', 'given', 0.75,"
        " 'ellipse', 4, 0.0001, n * %(oval)s, 0.0001, 8, 'option', ARRAY[0, s.size, 'NaN']::real[],"
        " '{0.0004,0.0004,NaN}', '{-3,0,3}', s.size, 0.0004, 0"
        " FROM generate_series(1, %(count)s) AS n CROSS JOIN LATERAL (SELECT n * %(step)s * (2 * (n %% 2) - 1) AS size) s",
        {"survey": survey_id, "length": LENGTH, "count": COUNT, "oval": OVALITY, "step": STEP},
    )
    conn.execute(
        "INSERT INTO tunnel.ring_chord (ring_id, clock_from, clock_to, length, length_se)"
        " SELECT id, 270, 90, %s - 0.001 * number, 0.0005 FROM tunnel.ring WHERE survey_id = %s",
        (CHORD, survey_id),
    )
