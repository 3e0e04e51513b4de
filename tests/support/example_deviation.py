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


THIN, THICK, THIN_PLACE = 0.15, 0.3, (12320.0, 12325.0)
"""What was put on since an earlier survey: the least, the mean, m; where it is as thin as that, m."""

UNEVEN, GAP = 0.5, 0.02
"""Of each section so many m² have a greater gap beneath a straightedge than that, m."""


def add_surfaces(conn: psycopg.Connection, survey_id: int) -> None:
    """An earlier survey, and what lies between the two; gaps beneath a straightedge, and twelve places where they are large."""
    conn.execute(
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)"
        " SELECT tunnel_id, 'demo-2023', '2023-05-04', 'none', 'mobile' FROM tunnel.survey WHERE id = %s",
        (survey_id,),
    )
    conn.execute(
        "INSERT INTO tunnel.thickness_section (survey_id, before_id, km, layer, chainage_from, chainage_to, design_length,"
        " compared_length, area, noise_area, by_right, by_up, thickness_mean, thickness_least, least_at, thickness)"
        " SELECT %(survey)s, b.id, 12, 'lining', c, c + 1, 25, 22.5, 7.5, 0.001, 0, 0, %(mean)s, t.least, 9.4,"
        " ARRAY[%(mean)s, t.least, 'NaN', 0.35]::real[]"
        " FROM generate_series(12300, 12499) AS c, tunnel.survey b, LATERAL (SELECT CASE WHEN c >= %(low)s AND c < %(high)s"
        " THEN %(least)s ELSE 0.25 END AS least) t WHERE b.name = 'demo-2023'",
        {"survey": survey_id, "mean": THICK, "least": THIN, "low": THIN_PLACE[0], "high": THIN_PLACE[1]},
    )
    conn.execute(
        "INSERT INTO tunnel.evenness_section (survey_id, km, layer, straightedge, gap_limit, chainage_from, chainage_to,"
        " arc_from, cell, lining_area, measured_area, over_area, gap_along, gap_around, along, around)"
        " SELECT %s, 12, 'lining', 2, %s, c, c + 1, -12.5, 0.1, 22.5, 22, %s, 0.01 + 0.0001 * (c - 12300), 0.015, '{}', '{}'"
        " FROM generate_series(12300, 12499) AS c",
        (survey_id, GAP, UNEVEN),
    )
    conn.execute(
        "INSERT INTO tunnel.evenness_area (survey_id, km, layer, area, gap, direction, geom)"
        " SELECT %s, 12, 'lining', 0.1, %s + 0.001 * n, 'along', ST_MakeEnvelope(12300 + 10 * n, 0, 12301 + 10 * n, 0.1)"
        " FROM generate_series(1, 12) AS n",
        (survey_id, GAP),
    )
