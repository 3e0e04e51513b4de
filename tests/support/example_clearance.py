"""Clearance of the example survey, row by row."""

from __future__ import annotations

import psycopg

TIGHT = 12350
"""The metre in which an appendage stands 0.05 m inside; margins are 0.2 m elsewhere."""


def add_clearance(conn: psycopg.Connection, survey_id: int) -> None:
    """Sections of 1 m, an infringement that counts and one by an object."""
    conn.execute(
        "INSERT INTO tunnel.clearance_section (survey_id, km, gauge, track, chainage_from, chainage_to, track_right, track_up,"
        " cant,"
        " curvature, widened_left, widened_right, roll, margin, margin_se, clock, class, margins, seen_share, points, inside,"
        " stray, passing, ground, outline)"
        " SELECT %(survey)s, 12, 'example', 'single', c, c + 1, 0, -2, 0, 0, 0, 0, 0,"
        " CASE WHEN c = %(tight)s THEN -0.05 ELSE 0.2 END, 0.002, 90, CASE WHEN c = %(tight)s THEN 66 ELSE 64 END,"
        " '{0.2,NaN}', 0.9, 1000, 0, 0, 0, 0, '{-1,0,0,-1,4,0,1,4,0,1,0,0,-1,0,0}'"
        " FROM generate_series(12300, 12499) AS c",
        {"survey": survey_id, "tight": TIGHT},
    )
    conn.execute(
        "INSERT INTO tunnel.clearance_infringement (survey_id, km, gauge, track, chainage_from, chainage_to, depth, clock,"
        " class, counts, points, unrolled, geom) SELECT %(survey)s, 12, 'example', 'single', %(tight)s,"
        " %(tight)s + 0.5, d.depth, 90, d.class,"
        " d.counts, 7, d.unrolled::public.geometry, (SELECT public.ST_Multi(v.geom) FROM tunnel.axis_vertex v"
        " WHERE v.survey_id = %(survey)s AND v.n = floor(%(tight)s / t.spacing))"
        " FROM (VALUES (0.05, 66, true, 'MULTIPOLYGON (((12350 4, 12350.5 4, 12350.5 4.5, 12350 4)))'),"
        " (0.5, 68, false, NULL)) AS d (depth, class, counts, unrolled),"
        " tunnel.survey s JOIN tunnel.tunnel t ON t.id = s.tunnel_id WHERE s.id = %(survey)s",
        {"survey": survey_id, "tight": TIGHT},
    )
    conn.execute(
        "INSERT INTO tunnel.gauge (tunnel_id, name, outline, source, checksum)"
        " SELECT tunnel_id, 'example', '{-1,0,0,-1,4,0,1,4,0,1,0,0,-1,0,0}', 'example.csv', '0'"
        " FROM tunnel.survey WHERE id = %s",
        (survey_id,),
    )


def add_clearance_run(conn: psycopg.Connection, survey: str) -> None:
    """The run of the ledger that made it."""
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, parameters, versions, counts, started_at, finished_at, outcome)"
        " SELECT id, 12, 'clearance', '{\"gauge\": \"example\", \"track\": \"single\"}', '{}', '{}', now(), now(), 'done'"
        " FROM tunnel.survey WHERE name = %s",
        (survey,),
    )
