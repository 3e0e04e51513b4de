"""A straight tunnel of 25 km with 100,000 findings and a coarse image, made set by set."""

from __future__ import annotations

import numpy as np
import psycopg

from tunneldb.raster.geotiff import Raster, encode
from tunneldb.raster.grid import BLOCK, BLOCKS, Grid
from tunneldb.raster.overview import Overview
from tunneldb.store.images import insert_image, save_overview
from tunneldb.store.survey import get_survey

NAME, KILOMETRES, FINDINGS = "long-2024", 25, 100_000
RADIUS, PIXEL = 4.0, 0.4
EAST, NORTH, HEIGHT = 300_000.0, 4_700_000.0, 400.0
"""Coordinates of the axis at its beginning; it runs to the east, level."""

_AXIS = """
WITH t AS (
    INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment)
    SELECT 'long', 25830, 0, 100, ST_SetSRID(ST_MakeLine(ST_MakePoint(%(east)s, %(north)s, %(height)s),
        ST_MakePoint(%(east)s + 1000 * %(km)s, %(north)s, %(height)s)), 25830) RETURNING id
), s AS (
    INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform)
    SELECT id, %(name)s, '2024-05-04', 'Amplitude', 'amplitude',
        'mobile' FROM t RETURNING id
)
INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source)
SELECT s.id, n, n / 10, p.geom, p.geom, 5000, 'measured' FROM s, generate_series(0, 10 * %(km)s) AS n,
    LATERAL (SELECT ST_SetSRID(ST_MakePoint(%(east)s + 100 * n, %(north)s, %(height)s), 25830) AS geom) p
"""

_SEGMENTS = """
INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from, tangent_to,
    geom, points)
SELECT a.survey_id, a.n, a.n / 10, 100 * a.n, 100 * (a.n + 1), ARRAY[ST_X(a.geom), ST_Y(a.geom), ST_Z(a.geom)],
    ARRAY[ST_X(b.geom), ST_Y(b.geom), ST_Z(b.geom)], '{1,0,0}', '{1,0,0}', ST_MakeLine(a.geom, b.geom), 1000
FROM tunnel.axis_vertex a JOIN tunnel.axis_vertex b ON b.survey_id = a.survey_id AND b.n = a.n + 1
"""

_SECTIONS = """
INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, geom, points,
    interpolated)
SELECT g.survey_id, g.km, g.n, half, g.chainage_from + half, 0.5, 5, r.radius, r.arc, g.geom, 900, 0
FROM tunnel.segment g CROSS JOIN (VALUES (25), (75)) AS h (half)
CROSS JOIN (SELECT array_agg(%(radius)s ORDER BY i) AS radius, array_agg(%(radius)s * radians(i) ORDER BY i) AS arc
            FROM generate_series(-180, 180) AS i) r
"""

# Squares of 0.3 m, ten to each 2.5 m of tunnel, all round; every tenth is a dry dark area, the others leaks.
_FINDINGS = """
INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, confidence, contrast,
    area, darkening_mean, darkening_max, image_share, unrolled, map, surface)
SELECT s.id, floor(p.x / 1000), p.x - 0.15, p.x + 0.15, p.y - 0.15, p.y + 0.15, mod((12 + p.y)::numeric, 12)::float8,
    CASE WHEN k %% 10 = 0 THEN 'dark' ELSE 'leak' END, 0.5 + (k %% 500) / 1000.0, 4, 0.09, 3, 4, 1,
    q.square, ST_Translate(ST_SetSRID(q.square, 25830), %(east)s, %(north)s - 2 * p.y),
    ST_Translate(ST_Force3DZ(ST_SetSRID(q.square, 25830)), %(east)s, %(north)s - 2 * p.y, %(height)s + %(radius)s)
FROM tunnel.survey s, generate_series(0, %(findings)s - 1) AS k,
    LATERAL (SELECT (k + 0.5) * 1000.0 * %(km)s / %(findings)s AS x, (k %% 10 - 4.5) * 1.0 AS y) p,
    LATERAL (SELECT ST_MakeEnvelope(p.x - 0.15, p.y - 0.15, p.x + 0.15, p.y + 0.15) AS square) q
WHERE s.name = %(name)s
"""

_COVERAGE = """
INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet)
SELECT s.id, km, 1, array_agg(l.lining), array_agg(0.97 * l.lining), array_agg(0.01 * l.lining)
FROM tunnel.survey s, generate_series(0, %(km)s - 1) AS km, generate_series(1, 1000), (SELECT 25.1::real AS lining) l
WHERE s.name = %(name)s GROUP BY s.id, km
"""


def make_long_survey(conn: psycopg.Connection) -> None:
    """Fill an installed, empty database."""
    values = {
        "name": NAME, "km": KILOMETRES, "findings": FINDINGS, "radius": RADIUS, "east": EAST, "north": NORTH, "height": HEIGHT,
    }  # fmt: skip
    for statement in (_AXIS, _SEGMENTS, _SECTIONS, _FINDINGS, _COVERAGE):
        conn.execute(statement, values)
    survey = get_survey(conn, NAME)
    rng = np.random.default_rng(3)
    for km in range(KILOMETRES):
        grid = Grid.covering(km, PIXEL, -RADIUS * np.pi, RADIUS * np.pi)
        overview = Overview("corrected")
        for n in range(BLOCKS):
            values_here = rng.normal(-10.0, 0.6, (grid.rows, round(BLOCK / PIXEL))).astype(np.float32)
            raster = Raster(values_here, grid.transform(n * grid.block_columns))
            insert_image(conn, survey, km, "corrected", km * BLOCKS + n, encode(raster, "corrected"))
            overview.add(raster)
        save_overview(conn, survey, km, overview)
    conn.commit()
    conn.execute("ANALYZE")
    conn.commit()
