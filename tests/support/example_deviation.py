"""The design profile of the example survey, and its lining held against it, row by row."""

from __future__ import annotations

import psycopg

UNDER, OVER, BULGE = 0.02, 0.5, (12340.0, 12343.0)
"""Underbreak of the section at 12+300, which grows by as much each metre, and overbreak of all, m²; where 60 mm stand in, m."""


def add_deviation(conn: psycopg.Connection, survey_id: int) -> None:
    """A round profile, and sections of 1 m held against it, of which nine tenths were seen."""
    conn.execute(
        "INSERT INTO tunnel.design_profile (tunnel_id, name, layer, chainage_from, chainage_to, outline, source)"
        " SELECT tunnel_id, 'round', 'lining', 12300, 12500, '{0,-4,-1,0,4,-1,0,-4,0}', 'round.csv'"
        " FROM tunnel.survey WHERE id = %s",
        (survey_id,),
    )
    conn.execute(
        "INSERT INTO tunnel.deviation_section (survey_id, km, layer, profile, chainage_from, chainage_to, design_length,"
        " seen_length, overbreak, underbreak, noise_area, over_right, over_up, under_right, under_up, sigma, deviation_mean,"
        " deviation_least, least_at, deviation_greatest, greatest_at, deviation)"
        " SELECT %(survey)s, 12, 'lining', 'round', c, c + 1, 25, 22.5, %(over)s, %(under)s * (c - 12299), 0.001, 3, 0, 0, 2,"
        " 0.003, 0, -0.1, 12.5, CASE WHEN c >= %(low)s AND c < %(high)s THEN 0.06 ELSE 0.04 END, 6.5, '{0,0.04,-0.1,NaN}'"
        " FROM generate_series(12300, 12499) AS c",
        {"survey": survey_id, "over": OVER, "under": UNDER, "low": BULGE[0], "high": BULGE[1]},
    )
