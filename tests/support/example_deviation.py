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


THIN, OVER_LIMIT = (12360.0, 12365.0), 2.5
"""Where half of what was put on is 150 mm, elsewhere 250 mm, m; area of each metre where the gap is over the limit, m²."""


def add_surfaces(conn: psycopg.Connection, survey: str) -> None:
    """An earlier survey with what was put on since, and gaps beneath a straightedge, by sections of 1 m."""
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT tunnel_id, 'demo-2023', '2023-05-04', 'none', 'mobile' FROM tunnel.survey WHERE name = %s",
        (survey,),
    )
    asked = {"survey": survey, "low": THIN[0], "high": THIN[1], "over": OVER_LIMIT}
    conn.execute(
        "INSERT INTO tunnel.thickness_section (survey_id, before_id, km, layer, chainage_from, chainage_to, design_length,"
        " compared_length, area, noise_area, by_right, by_up, thickness_mean, thickness_least, least_at, thickness)"
        " SELECT tunnel_api.survey_id(%(survey)s), tunnel_api.survey_id('demo-2023'), 12, 'lining', c, c + 1, 24, 18, 4.5,"
        " 0.001, 0, 0, 0.25, CASE WHEN thin THEN 0.15 ELSE 0.25 END, 9,"
        " CASE WHEN thin THEN '{0.15,0.15,0.25,NaN}'::real[] ELSE '{0.25,0.25,0.25,NaN}' END"
        " FROM generate_series(12300, 12499) AS c, LATERAL (SELECT c >= %(low)s AND c < %(high)s AS thin) t",
        asked,
    )
    conn.execute(
        "INSERT INTO tunnel.evenness_section (survey_id, km, layer, straightedge, gap_limit, chainage_from, chainage_to,"
        " arc_from, cell, lining_area, measured_area, over_area, gap_along, gap_along_at, gap_around, gap_around_at, waviness,"
        " sigma, along, around)"
        " SELECT tunnel_api.survey_id(%(survey)s), 12, 'lining', 2, 0.02, c, c + 1, -10, 0.1, 20, 18, %(over)s, 0.021, 0,"
        " 0.024, 1, 0.03, 0.001, '{0.021,NaN}', '{0.024,NaN}' FROM generate_series(12300, 12499) AS c",
        asked,
    )
