"""A long surveyed tunnel without scans, made set by set in SQL: axis, segments, sections, points, leaks, reviews, ledger.

    python -m benchmarks.synthetic --dsn DSN --km 25 --leaks 100000 --points 60000000      # into a database after tunneldb init

The section is an arch of 4 m radius over a floor 2.5 m below the axis, which winds gently and rises by 1.7 %. Leaks lie on the
arch, each in a cell of its own; where they lie, how large they are and who reviewed them follows from the seed of `random()`,
so that the same size makes the same rows.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import psycopg
import shapely

from benchmarks.common import progress
from tunneldb.classification.classes import PointClass
from tunneldb.database import PointZ, connect, copy_binary, pack, resolve_dsn
from tunneldb.store.partition import partition
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey, get_survey

Connection = psycopg.Connection[Any]

SRID, SPACING, RADIUS, FLOOR = 25830, 10.0, 4.0, 2.5
CORNER = RADIUS * float(np.arccos(-FLOOR / RADIUS))
"""Arc at which the wall meets the floor, m."""

CHUNK = 240_000
"""Points that are packed at once."""

COLUMNS = (
    "survey_id", "km", "chainage", "gps_time", "geom", "segment", "scan_id", "file_id", "intensity", "classification", "class"
)  # fmt: skip

PLACE, PLACE_CHAINAGE = (272039.859, 4765020.741, 644.405), 12345.0
"""A point that the documentation asks about: 0.1 m below the crown at this chainage of a tunnel that is so long."""


@dataclass(frozen=True)
class Size:
    """How much there is to be: kilometres from chainage 0 on, leaks, points, joints and dark spots, findings drawn."""

    kilometres: int = 25
    leaks: int = 100_000
    points: int = 60_000_000
    dry: int = 7_500
    drawn: int = 20_000


def make(connection: Connection, survey: str, size: Size) -> int:
    """Fill an installed database with a tunnel and its survey; an earlier and a later one are compared with it.

    Parameters
    ----------
    connection
        With the rights of the owner; committed after each kilometre of points, and at the end.
    survey : str
        The survey's name; the tunnel's is what stands before its first hyphen.
    size : Size
        How much.

    Returns
    -------
    int
        The survey's id.
    """
    connection.execute("SELECT set_config('max_parallel_workers_per_gather', '0', false), setseed(0.42)")
    made = _catalogue(connection, survey, size)
    asked = asdict(size) | {
        "id": made.id, "survey": survey, "srid": SRID, "spacing": SPACING, "radius": RADIUS, "floor": FLOOR, "corner": CORNER,
        "earlier": f"{made.tunnel}-2023", "later": f"{made.tunnel}-2026",
    }  # fmt: skip
    for title, steps in STEPS.items():
        progress(title)
        for step in steps:
            connection.execute(step, asked)
    connection.commit()
    for km in range(size.kilometres if size.points else 0):
        progress(f"points of kilometre {km}")
        _points(connection, made, km, size.points // size.kilometres)
    connection.autocommit = True
    connection.execute("VACUUM ANALYZE")
    connection.autocommit = False
    connection.execute("RESET max_parallel_workers_per_gather")
    return made.id


def vertices(kilometres: int) -> np.ndarray:
    """Vertices of the axis, (n, 3), m: every 10 m in plan, through the place that the documentation asks about."""
    count = round(kilometres * 1000 / SPACING)
    bearing = 0.6 + 0.5 * np.sin((np.arange(count) + 0.5) * SPACING / 2000)
    steps = SPACING * np.column_stack([np.sin(bearing), np.cos(bearing), np.full(count, 0.017)])
    line = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    place = min(PLACE_CHAINAGE, kilometres * 500) / SPACING
    at = [np.interp(place, np.arange(count + 1), column) for column in line.T]
    return np.asarray(line + (np.array(PLACE) - [0, 0, RADIUS - 0.1]) - at)


def _catalogue(connection: Connection, survey: str, size: Size) -> Survey:
    """The tunnel, the survey and its axis."""
    axis = vertices(size.kilometres)
    tunnel_id = _one(
        connection,
        "INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment)"
        " VALUES (split_part(%s, '-', 1), %s, 0, %s, ST_GeomFromWKB(%s, %s)) RETURNING id",
        (survey, SRID, SPACING, shapely.to_wkb(shapely.LineString(axis)), SRID),
    )
    survey_id = _one(
        connection,
        "INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform, reference)"
        " VALUES (%s, %s, '2024-05-04', 'Amplitude', 'amplitude', 'mobile', 'auto') RETURNING id",
        (tunnel_id, survey),
    )
    connection.execute(
        "INSERT INTO tunnel.axis_vertex (survey_id, n, km, geom, given, points, source)"
        " SELECT %s, v.n - 1, floor((v.n - 1) * %s / 1000), p.geom, p.geom, 5000, 'measured'"
        " FROM unnest(%s::float8[], %s::float8[], %s::float8[]) WITH ORDINALITY AS v (x, y, z, n),"
        " LATERAL (SELECT ST_SetSRID(ST_MakePoint(v.x, v.y, v.z), %s) AS geom) p",
        (survey_id, SPACING, *(column.tolist() for column in axis.T), SRID),
    )
    return get_survey(connection, survey)


def _one(connection: Connection, query: str, values: tuple[Any, ...]) -> int:
    row = connection.execute(query, values).fetchone()
    assert row is not None
    return int(row[0])


def _points(connection: Connection, survey: Survey, km: int, count: int) -> None:
    """A kilometre of points in chainage order, spread evenly over all the section, in a partition that is swapped in."""
    surface = load_surface(connection, survey, km * 1000.0, (km + 1) * 1000.0)
    girth = np.ptp(surface.arcs[0]) - 1e-3
    name = f"km-{km}.laz"
    file_id = _one(connection, "SELECT id FROM tunnel.scan_file WHERE survey_id = %s AND name = %s", (survey.id, name))
    connection.execute("SELECT tunnel_internal.partition_new(%s, %s)", (survey.id, km))

    def chunks() -> Iterator[bytes]:
        for first in range(0, count, CHUNK):
            number = np.arange(first, min(first + CHUNK, count))
            chainage = km * 1000 + 1000 * number / count
            arc = girth * (number * 0.6180339887498949 % 1 - 0.5)  # multiples of the golden ratio fill the section evenly
            noise = number * 1.4142135623730951 % 1 - 0.5
            whole = np.ones(len(number), np.int32)
            xyz = surface.to_space(chainage, arc, np.float64(0.004) * noise)
            yield pack([
                survey.id * whole, km * whole, chainage, 300_000 + chainage, PointZ(xyz, SRID),
                surface.number[surface.segment_index(chainage)].astype(np.int32), whole, file_id * whole,
                (-12 + 2 * noise).astype(np.float32), 0 * whole.astype(np.int16),
                np.where(np.abs(arc) < CORNER, PointClass.LINING, PointClass.GROUND).astype(np.int16),
            ])  # fmt: skip

    copy_binary(connection, partition(survey, km, "_new"), COLUMNS, chunks(), fresh=True)
    connection.execute("SELECT tunnel_internal.partition_swap(%s, %s)", (survey.id, km))
    connection.commit()


FILES = """
INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept,
    chainage_from, chainage_to, loaded_at)
SELECT %(id)s, 'km-' || km || '.laz', '/scans/km-' || km || '.laz', md5(km::text) || md5(km::text), 1200000000,
    50 * kept, 1000, 2000, 49 * kept - 3000, kept, km * 1000, (km + 1) * 1000,
    '2024-05-05 06:00Z'::timestamptz + km * interval '10 min'
FROM generate_series(0, %(kilometres)s - 1) AS km, LATERAL (SELECT round(%(points)s / %(kilometres)s) AS kept) k
"""

# Each stage of each kilometre ran once; one file was read again later, which makes its kilometre stale.
RUNS = """
INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, parameters, versions, counts)
SELECT %(id)s, km, s.stage, s.at, s.at + interval '2 min', 'done', '{"image.pixel": 0.02}'::jsonb, '{"tunneldb": "1.0"}'::jsonb,
    '{}'::jsonb
FROM generate_series(0, %(kilometres)s - 1) AS km
CROSS JOIN LATERAL (
    SELECT u.stage, '2024-05-05 12:00Z'::timestamptz + n * interval '2 h' + km * interval '3 min' AS at
    FROM unnest('{load,axis,segments,sections,ground,detect}'::text[]) WITH ORDINALITY AS u (stage, n)) s
UNION ALL
SELECT %(id)s, %(kilometres)s / 3, 'load', '2024-05-20 08:00Z', '2024-05-20 08:02Z', 'done', '{}', '{}', '{}'
"""

SEGMENTS = "SELECT tunnel_internal.segment_build(%(id)s, km) FROM generate_series(0, %(kilometres)s - 1) AS km"
COUNTED = """
UPDATE tunnel.segment SET points = %(points)s / (%(kilometres)s * 1000 / %(spacing)s) WHERE survey_id = %(id)s
"""

SECTIONS = """
WITH node AS (
    SELECT i, least(%(radius)s, CASE WHEN cosd(i) < -1e-9 THEN %(floor)s / -cosd(i) ELSE %(radius)s END) AS radius
    FROM generate_series(-180, 180) AS i
), along AS (
    SELECT i, radius, radius * sind(i) AS u, radius * cosd(i) AS w,
        sum(coalesce(sqrt((radius * sind(i) - q.u) ^ 2 + (radius * cosd(i) - q.w) ^ 2), 0)) OVER (ORDER BY i) AS length
    FROM (SELECT n.*, lag(radius * sind(i)) OVER (ORDER BY i) AS u, lag(radius * cosd(i)) OVER (ORDER BY i) AS w FROM node n) q
), ring AS MATERIALIZED (
    SELECT i, radius, u, w, length - (SELECT length FROM along WHERE i = 0) AS arc FROM along
), listed AS (
    SELECT array_agg(radius ORDER BY i) AS radius, array_agg(arc ORDER BY i) AS arc FROM ring
)
INSERT INTO tunnel.section (survey_id, km, segment, half, chainage, half_width, angle_step, radius, arc, geom, points,
    interpolated)
SELECT %(id)s, s.km, s.n, h.half, s.chainage_from + h.half / 100.0 * (s.chainage_to - s.chainage_from), 0.15, 5, l.radius,
    l.arc,
    (SELECT ST_SetSRID(ST_MakeLine(ST_MakePoint(f.frame[1] + r.u * f.frame[7] + r.w * f.frame[10],
        f.frame[2] + r.u * f.frame[8] + r.w * f.frame[11], f.frame[3] + r.w * f.frame[12]) ORDER BY r.i), %(srid)s)
     FROM ring r),
    900, CASE WHEN s.n %% 40 = 0 THEN 6 ELSE 0 END
FROM tunnel.segment s CROSS JOIN (VALUES (25), (75)) AS h (half) CROSS JOIN listed l
CROSS JOIN LATERAL (SELECT tunnel_internal.segment_frame(
    s.vertex_from || s.vertex_to || s.tangent_from || s.tangent_to, h.half / 100.0) AS frame OFFSET 0) f
WHERE s.survey_id = %(id)s
"""

# A leak a cell, four cells round the arch; their outlines wobble. Joints run across at every tenth metre or so, the other
# dark spots lie where leaks might.
SPOTS = """
CREATE TEMPORARY TABLE spot ON COMMIT DROP AS
SELECT k AS number, 'leak' AS kind, (k / 4 + 0.5) * cell.length + (random() - 0.5) * (cell.length - 2.7 * s.size) AS chainage,
    (k %% 4 - 1.5) * %(corner)s / 2 + (random() - 0.5) * (%(corner)s / 2 - 2.3 * s.size) AS arc, 1.2 * s.size AS along,
    s.size AS across,
    random() AS luck, random() AS fate, random() AS day, random() AS drop
FROM (SELECT 4000.0 * %(kilometres)s / greatest(%(leaks)s, 1) AS length) cell
CROSS JOIN generate_series(0, %(leaks)s - 1) AS k
CROSS JOIN LATERAL (SELECT least(0.06 + 0.3 * random() ^ 3 + 0 * k, 0.3 * cell.length) AS size) s
UNION ALL
SELECT %(leaks)s + k, CASE k %% 3 WHEN 0 THEN 'joint' ELSE 'dark' END, (k + 0.5) * 1000 * %(kilometres)s / %(dry)s,
    CASE k %% 3 WHEN 0 THEN 0 ELSE (random() - 0.5) * %(corner)s END, CASE k %% 3 WHEN 0 THEN 0.04 ELSE 0.3 END,
    CASE k %% 3 WHEN 0 THEN 0.9 * %(corner)s ELSE 0.3 END, random(), random(), random(), random()
FROM generate_series(0, %(dry)s - 1) AS k
UNION ALL
SELECT %(leaks)s + %(dry)s + k,
    ('{crack,spall,delamination,efflorescence,missing_bolt,damaged_joint,drip,leak}'::text[])[1 + k %% 8],
    (k + 0.5) * 1000 * %(kilometres)s / %(drawn)s, (k * 0.618 %% 1 - 0.5) * 1.6 * %(corner)s, 0.3, 0.2, random(), random(),
        random(), random()
FROM generate_series(0, %(drawn)s - 1) AS k
"""

OUTLINES = """
CREATE TEMPORARY TABLE outline ON COMMIT DROP AS
SELECT v.number, min(v.chainage) AS chainage_from, max(v.chainage) AS chainage_to, min(v.arc) AS arc_from,
    max(v.arc) AS arc_to,
    ST_MakePolygon(ST_MakeLine(ST_MakePoint(v.chainage, v.arc) ORDER BY v.i)) AS unrolled,
    ST_MakePolygon(ST_SetSRID(ST_MakeLine(
        ST_MakePoint(f[1] + v.arc * f[7], f[2] + v.arc * f[8]) ORDER BY v.i), %(srid)s)) AS map,
    ST_MakePolygon(ST_SetSRID(ST_MakeLine(ST_MakePoint(f[1] + v.u * f[7] + v.w * f[10], f[2] + v.u * f[8] + v.w * f[11],
        f[3] + v.w * f[12]) ORDER BY v.i), %(srid)s)) AS surface
FROM (
    SELECT s.number, i, p.chainage, p.arc, %(radius)s * sin(p.arc / %(radius)s) AS u, %(radius)s * cos(p.arc / %(radius)s) AS w
    FROM spot s CROSS JOIN generate_series(0, 16) AS i
    CROSS JOIN LATERAL (SELECT 1 - CASE s.kind WHEN 'leak' THEN 0.3 * s.luck ELSE 0 END
        * (1 + sin(3 * pi() * (i %% 16) / 8 + 6 * s.drop)) / 2 AS reach) r
    CROSS JOIN LATERAL (SELECT s.chainage + s.along * r.reach * cos(pi() * (i %% 16) / 8) AS chainage,
                               s.arc + s.across * r.reach * sin(pi() * (i %% 16) / 8) AS arc) p
) v
JOIN tunnel.segment g ON g.survey_id = %(id)s  -- a vertex just beyond the ends lies in the first or the last one
    AND g.n = least(greatest(floor(v.chainage / %(spacing)s), 0), %(kilometres)s * 1000 / %(spacing)s - 1)
CROSS JOIN LATERAL (SELECT tunnel_internal.segment_frame(g.vertex_from || g.vertex_to || g.tangent_from || g.tangent_to,
    (v.chainage - g.chainage_from) / (g.chainage_to - g.chainage_from)) AS f OFFSET 0) q
GROUP BY v.number
"""

ANOMALIES = """
INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons, confidence,
    contrast, kind_override, area, darkening_mean, darkening_max, image_share, unrolled, map, surface, review, reviewed_by,
    reviewed_at, remark,
    detected, created_at, detected_at)
SELECT %(id)s, floor((o.chainage_from + o.chainage_to) / 2000), o.chainage_from, o.chainage_to, o.arc_from, o.arc_to,
    12 - mod((12 - 6 * s.arc / %(radius)s / pi())::numeric, 12)::float8, s.kind,
    CASE s.kind WHEN 'joint' THEN '{thin,straight}'::text[] WHEN 'dark' THEN '{gradual}' ELSE '{}' END, 0.5 + s.luck / 2,
    3 + 4 * s.drop, CASE WHEN r.reviewed AND s.kind = 'leak' AND s.luck > 0.98 THEN 'dark' END, ST_Area(o.unrolled),
    2 + 2 * s.drop, 3 + 4 * s.drop, 0.9 + s.luck / 10, o.unrolled, o.map, o.surface,
    CASE WHEN NOT r.reviewed THEN 'open' WHEN s.fate < 0.1 THEN 'rejected' ELSE 'confirmed' END,
    CASE WHEN r.reviewed THEN ('{hansen,iversen,olsen}'::text[])[1 + s.number %% 3] END, CASE WHEN r.reviewed THEN r.at END,
    CASE WHEN r.reviewed AND s.luck < 0.02 THEN 'drips' END, NOT r.reviewed OR s.luck > 0.01,
    CASE WHEN s.luck > 0.99 THEN now() - s.day * interval '60 days' ELSE '2024-05-06 06:00Z' END, '2024-05-06 06:00Z'
FROM outline o JOIN spot s USING (number)
CROSS JOIN LATERAL (SELECT s.fate < 0.45 AS reviewed, '2024-05-07 07:00Z'::timestamptz + s.day * interval '60 days' AS at) r
WHERE s.number < %(leaks)s + %(dry)s
ORDER BY o.chainage_from
"""

AUDIT = """
INSERT INTO tunnel_audit.entry (at, who, survey, view, row_id, action, before, after)
SELECT a.reviewed_at, a.reviewed_by, %(survey)s, 'finding', a.id, 'update',
    jsonb_build_object('review', 'open') || CASE WHEN a.kind_override IS NULL THEN '{}' ELSE jsonb_build_object('kind',
    a.kind) END,
    jsonb_build_object('review', a.review) || CASE WHEN a.kind_override IS NULL THEN '{}' ELSE jsonb_build_object('kind',
    a.kind_override) END
FROM tunnel.finding a WHERE a.survey_id = %(id)s AND a.reviewed_at IS NOT NULL ORDER BY a.reviewed_at
"""

MOVED = """
WITH moved AS (
    UPDATE tunnel.axis_vertex v SET geom = ST_Translate(v.geom, 0.03, 0, 0.02), source = 'edited', edited_by = 'hansen',
        edited_at = '2024-06-01 09:00Z'
    FROM tunnel.axis_vertex o WHERE o.id = v.id AND v.survey_id = %(id)s AND v.n = (%(kilometres)s * 50 - 7)
    RETURNING v.id, o.geom AS before, v.geom AS after, v.edited_at)
INSERT INTO tunnel_audit.entry (at, who, survey, view, row_id, action, before, after)
SELECT m.edited_at, 'hansen', %(survey)s, 'axis_vertex', m.id, 'update', jsonb_build_object('geom', ST_AsEWKT(m.before)),
    jsonb_build_object('geom', ST_AsEWKT(m.after))
FROM moved m
"""

# What people drew, eight kinds in turn: lines and points have the outline of a spot about them. A drawn leak stands for the
# next that was detected; one in fifty waits to be measured.
DRAWN = """
INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, area, length, width_mm,
    severity,
    darkening_mean, darkening_max, image_share, contrast, unrolled, map, surface, shape, shape_map, shape_surface, review,
    reviewed_by,
    reviewed_at, origin, manual, drawn_by, drawn_at, created_at)
SELECT %(id)s, floor((o.chainage_from + o.chainage_to) / 2000), o.chainage_from, o.chainage_to, o.arc_from, o.arc_to,
    12 - mod((12 - 6 * s.arc / %(radius)s / pi())::numeric, 12)::float8, s.kind,
    CASE WHEN q.line THEN 0.002 * 2 * s.along WHEN q.point THEN 0 ELSE ST_Area(o.unrolled) END,
        CASE WHEN q.line THEN 2 * s.along END,
    CASE s.kind WHEN 'crack' THEN 2.0 END,
        CASE WHEN s.fate < 0.02 THEN 4 WHEN s.fate < 0.1 THEN 3 WHEN s.fate < 0.5 THEN 2 ELSE 1 END,
    m.drop, m.drop, m.drop / 3, m.drop, o.unrolled, o.map, o.surface,
    g.shapes[1], g.shapes[2], g.shapes[3], CASE WHEN s.luck < 0.03 THEN 'open' ELSE 'confirmed' END, q.who, q.at, 'drawn', true,
    q.who, q.at, q.at
FROM outline o JOIN spot s USING (number)
CROSS JOIN LATERAL (SELECT s.kind IN ('crack', 'damaged_joint') AS line, s.kind IN ('missing_bolt', 'drip') AS point,
    ('{hansen,iversen,olsen}'::text[])[1 + s.number %% 3] AS who,
        '2024-07-01 06:00Z'::timestamptz + s.day * interval '60 days' AS at) q
CROSS JOIN LATERAL (SELECT CASE WHEN s.number %% 50 > 0 THEN 2.5 END AS drop) m
CROSS JOIN LATERAL (SELECT array_agg(CASE WHEN q.line THEN ST_MakeLine(ST_PointN(r.ring, 1), ST_PointN(r.ring, 9))
                                          WHEN q.point THEN ST_PointN(r.ring, 1) END ORDER BY r.n) AS shapes
    FROM (SELECT n, ST_ExteriorRing(x) AS ring FROM unnest(ARRAY[o.unrolled, o.map, o.surface]) WITH ORDINALITY AS t (x,
        n)) r) g
WHERE s.number >= %(leaks)s + %(dry)s ORDER BY o.chainage_from
"""

LINKED = """
UPDATE tunnel.finding d SET same_as = q.other
FROM (SELECT DISTINCT ON (x.id) x.id, h.id AS other
      FROM tunnel.finding h
      CROSS JOIN LATERAL (SELECT x.id FROM tunnel.finding x WHERE x.survey_id = h.survey_id AND x.origin = 'detected'
                            AND x.kind = 'leak' AND x.kind_override IS NULL
                                AND x.chainage_from >= h.chainage_from ORDER BY x.chainage_from LIMIT 1) x
      WHERE h.survey_id = %(id)s AND h.manual AND h.kind = 'leak' ORDER BY x.id, h.id) q
WHERE d.id = q.id
"""

DRAWN_AUDIT = """
INSERT INTO tunnel_audit.entry (at, who, survey, view, row_id, action, before, after)
SELECT a.drawn_at, a.drawn_by, %(survey)s, 'finding', a.id, CASE s.n WHEN 0 THEN 'insert' ELSE 'update' END,
    CASE s.n WHEN 1 THEN jsonb_build_object('geom', ST_AsEWKT(a.unrolled)) END, jsonb_build_object('geom',
        ST_AsEWKT(a.unrolled))
FROM tunnel.finding a CROSS JOIN generate_series(0, 1) AS s (n)
WHERE a.survey_id = %(id)s AND a.manual AND (s.n = 0 OR a.id %% 20 = 0) ORDER BY a.drawn_at
"""

PHOTOS = """
INSERT INTO tunnel.photo (finding_id, path)
SELECT a.id, 'photos/' || a.id || '.jpg' FROM tunnel.finding a WHERE a.survey_id = %(id)s AND a.manual AND a.id %% 4 = 0
"""

DRY_REGIONS = """
INSERT INTO tunnel_api.region (survey_id, kind, geom, reason)
SELECT %(id)s, 'dry', ST_MakeEnvelope(km * 1000 + 500, -1, km * 1000 + 504, 1, 0), 'fresh paint' FROM generate_series(0,
    %(kilometres)s - 1) AS km
"""

COVERAGE = """
INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet)
SELECT %(id)s, km, 0.1, array_agg(l.lining), array_agg(l.lining * l.share), array_agg(l.lining * l.share * 0.02)
FROM generate_series(0, %(kilometres)s - 1) AS km, generate_series(0, 9999) AS i
CROSS JOIN LATERAL (SELECT 0.2 * %(corner)s AS lining, 0.94 + 0.05 * sin(i / 300.0) AS share) l
GROUP BY km
"""

RADIOMETRY = """
INSERT INTO tunnel.radiometry (survey_id, km, roughness, dry_mean, dry_sigma, threshold, sigma_raw, sigma_lambert,
    sigma_oren_nayar, regions, pixels, wet_pixels)
SELECT %(id)s, km, 24, -12, 0.6, -13.8, 1.4, 0.9, 0.6, 9, 45000000, 900000 FROM generate_series(0, %(kilometres)s - 1) AS km
"""

CURVES = """
INSERT INTO tunnel.range_curve (survey_id, km, range_m, intensity_db, sigma_db)
SELECT %(id)s, km, '{2,4,8,16}', '{-1,-3,-8,-14}', '{0.2,0.1,0.1,0.3}' FROM generate_series(0, %(kilometres)s - 1) AS km
"""

GROUND = """
INSERT INTO tunnel.ground (survey_id, n, km, across, height, gamma, foot, lean, arc_left, arc_right, geom)
SELECT %(id)s, m.n, m.n / 1000, -3.1, p.height, 0.05, '{-3.12,3.12}', '{-0.8,0.8}', -%(corner)s, %(corner)s, p.geom
FROM tunnel.segment g, generate_series((g.n * %(spacing)s)::int, ((g.n + 1) * %(spacing)s)::int - 1) AS m (n)
CROSS JOIN LATERAL (SELECT tunnel_internal.segment_frame(g.vertex_from || g.vertex_to || g.tangent_from || g.tangent_to,
    (m.n - g.n * %(spacing)s) / %(spacing)s) AS f OFFSET 0) q
CROSS JOIN LATERAL (
    SELECT array_agg(f[3] - %(floor)s ORDER BY i) AS height, ST_SetSRID(ST_MakeLine(ST_MakePoint(
        f[1] + i * 0.1 * f[7], f[2] + i * 0.1 * f[8], f[3] - %(floor)s) ORDER BY i), %(srid)s) AS geom
    FROM generate_series(-31, 31) AS i) p
WHERE g.survey_id = %(id)s
"""

# Something on the floor every 50 m, a niche every 100 m, a cable tray of 60 m in each.
CLUSTERS = """
INSERT INTO tunnel.cluster (survey_id, km, class, chainage_from, chainage_to, height_from, height_to, points, cell, cells, geom)
SELECT %(id)s, floor(t.at / 1000), t.class, t.at - t.length / 2, t.at + t.length / 2, t.low, t.high, 250, 0.1, '{0,0,0}',
    tunnel_api.map_strip(%(id)s, ST_MakeEnvelope(t.at - t.length / 2, t.across - 0.3, t.at + t.length / 2, t.across + 0.3, 0))
FROM generate_series(0, %(kilometres)s * 10 - 1) AS i
CROSS JOIN LATERAL (VALUES
    (68, i * 100 + 12.0, 1.2, 0.8, 0.0, 1.8), (68, i * 100 + 62.0, -1.5, 2.0, 0.0, 1.1),
    (65, i * 100 + 40.0, 4.3, 2.0, 0.2, 2.2), (66, i * 100 + 50.0, -3.6, 60.0, 1.0, 1.1)
) AS t (class, at, across, length, low, high)
"""

SPHERES = """
INSERT INTO tunnel.target_sphere (survey_id, km, number, scan_id, chainage, geom, radius, nominal, rms, sigma, coverage, points)
SELECT %(id)s, floor(c / 1000), i + 1, scan, c, tunnel_api.roll(%(id)s, c, 7.0, 0.5), 0.0726, 0.0725, 0.0028, 0.0002, 0.41, 900
FROM generate_series(0, %(kilometres)s * 5 - 1) AS i, generate_series(1, 2) AS scan, LATERAL (SELECT i * 200 + 103.0 AS c) q
"""

PROFILE = """
INSERT INTO tunnel.design_profile (tunnel_id, name, layer, chainage_from, chainage_to, outline, source)
SELECT tunnel_id, 'round', 'lining', 0, %(kilometres)s * 1000, '{0,-4,-1,0,4,-1,0,-4,0}', 'round.csv'
FROM tunnel.survey WHERE id = %(id)s
"""

# Cells of 0.1 m along the profile, sections of 1 m.
DEVIATION = """
INSERT INTO tunnel.deviation_section (survey_id, km, layer, profile, chainage_from, chainage_to, design_length, seen_length,
    overbreak, underbreak, noise_area, over_right, over_up, under_right, under_up, sigma, deviation_mean, deviation_least,
    least_at, deviation_greatest, greatest_at, deviation)
SELECT %(id)s, c / 1000, 'lining', 'round', c, c + 1, 25.1, 20, 0.3 + 0.2 * sin(c / 40.0), 0.3 + 0.2 * cos(c / 30.0), 0.001,
    3, 1, 2, 1, 0.003, 0, -0.04, 12.5, 0.04 + 0.02 * sin(c / 50.0), 6.5, v.cells
FROM generate_series(0, %(kilometres)s * 1000 - 1) AS c
CROSS JOIN LATERAL (SELECT array_agg((0.05 * sin((c + i) / 30.0))::real) AS cells FROM generate_series(1, 251) AS i) v
"""

# Margins of two tracks in 72 directions, and what stands inside every 500 m.
CLEARANCE = """
INSERT INTO tunnel.clearance_section (survey_id, km, gauge, track, chainage_from, chainage_to, track_right, track_up, cant,
    curvature, widened_left, widened_right, roll, margin, margin_se, clock, class, margins, seen_share, points, inside, stray,
    passing, ground, outline)
SELECT %(id)s, c / 1000, 'example', t, c, c + 1, 0, -2, 0, 0, 0, 0, 0, 0.3 + 0.32 * sin(c / 77.0), 0.002, 90,
    CASE WHEN c %% 7 = 0 THEN 66 ELSE 64 END, v.margins, 0.95, 2000, 0, 0, 0, 0, '{0,0,0,1,0,0,1,1,0,0,0,0}'
FROM generate_series(0, %(kilometres)s * 1000 - 1) AS c CROSS JOIN unnest('{left,right}'::text[]) AS t
CROSS JOIN LATERAL (SELECT array_agg((0.5 + 0.2 * sin((c + i) / 30.0))::real) AS margins FROM generate_series(1, 72) AS i) v
"""

INFRINGEMENTS = """
INSERT INTO tunnel.clearance_infringement (survey_id, km, gauge, track, chainage_from, chainage_to, depth, clock, class, counts,
    points, geom)
SELECT %(id)s, c / 1000, 'example', 'left', c, c + 1, 0.1 + 0.05 * sin(c), 90, 66, c %% 1000 > 0, 12,
    ST_Multi(tunnel_api.roll(%(id)s, c + 0.5, 2.0, 0.5))
FROM generate_series(100, %(kilometres)s * 1000 - 100, 500) AS c
"""

# Rings of 1.5 m with steps in cells of 0.3 m, and a chord each.
RINGS = """
INSERT INTO tunnel.ring (survey_id, km, number, chainage_from, chainage_to, origin, joint, seen_share, shape, centre_right,
    centre_up, radius, ovality, ovality_se, design_diameter, diameter_from, step, step_se, step_arc, step_greatest,
    step_greatest_se, step_greatest_arc)
SELECT %(id)s, floor((n + 0.5) * 1.5 / 1000), n + 1, n * 1.5, (n + 1) * 1.5, 'length', 'given', 0.75, 'ellipse', 0.01, 0, 4,
    0.003 + 0.0025 * sin(n / 60.0), 0.0001, 8, 'option', v.steps, v.errors, v.arcs, 0.005 * sin(n / 3.0), 0.0004, 0
FROM generate_series(0, (%(kilometres)s * 1000 / 1.5)::int - 1) AS n
CROSS JOIN LATERAL (
    SELECT array_agg((0.005 * sin((n + i) / 3.0))::real) AS steps, array_agg(0.0004::real) AS errors,
           array_agg((0.3 * i - 9)::real) AS arcs FROM generate_series(1, 60) AS i) v
"""
RING_CHORDS = """
INSERT INTO tunnel.ring_chord (ring_id, clock_from, clock_to, length, length_se)
SELECT id, 270, 90, 8 + 0.005 * sin(number / 50.0), 0.0005 FROM tunnel.ring WHERE survey_id = %(id)s
"""

# A later survey that was compared with it: sections of 1.5 m, a region every 50 m, and what became of a leak in 25.
LATER = """
INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)
SELECT tunnel_id, %(later)s, '2026-05-04', 'none', 'mobile' FROM tunnel.survey WHERE id = %(id)s
"""

CHANGE_SECTIONS = """
INSERT INTO tunnel.change_section (survey_id, old_survey_id, km, chainage_from, chainage_to, seen_old, seen_new, seen_both,
    shift_right, shift_right_se, shift_up, shift_up_se, change_rms, change_least, change_greatest, lod, cell, arc_from, change)
SELECT n.id, %(id)s, floor(c / 1000), c, c + 1.5, 30, 30, CASE WHEN k %% 50 = 0 THEN 10 ELSE 29 END, 0.01 * sin(c / 90), 0.0001,
    0.01 * cos(c / 70), 0.0001, 0.001 + 0.001 * sin(c / 30), -0.003, 0.003, 0.002, 0.1, -10, v.cells
FROM tunnel.survey n, generate_series(0, %(kilometres)s * 1000 * 2 / 3 - 1) AS k
CROSS JOIN LATERAL (SELECT k * 1.5 AS c) q
CROSS JOIN LATERAL (SELECT array_agg((0.001 * sin((k + i) / 30.0))::real) AS cells FROM generate_series(1, 201) AS i) v
WHERE n.name = %(later)s
"""

CHANGE_REGIONS = """
INSERT INTO tunnel.change_region (survey_id, old_survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, area,
    change_mean, lod, change_extreme, unrolled, map, surface)
SELECT n.id, %(id)s, floor(c / 1000), c, c + 1, 0, 1, 1, 1, 0.004 * sin(k), 0.001, 0.006 * sin(k), b.box, b.box,
    ST_Force3D(b.box)
FROM tunnel.survey n, generate_series(0, %(kilometres)s * 20 - 1) AS k
CROSS JOIN LATERAL (SELECT k * 50.0 + 20 AS c) q
CROSS JOIN LATERAL (SELECT ST_MakeEnvelope(c, 0, c + 1, 1, 0) AS box) b
WHERE n.name = %(later)s
"""

LEAK_CHANGES = """
INSERT INTO tunnel.leak_change (survey_id, old_survey_id, km, state, old_ids, new_ids, old_kinds, new_kinds, area_old,
    area_old_se, area_new, area_new_se, seen_old, seen_new, chainage_from, chainage_to, clock, unrolled, map, surface)
SELECT n.id, %(id)s, a.km, CASE a.id %% 25 WHEN 0 THEN 'grown' WHEN 1 THEN 'dry' ELSE 'same' END, ARRAY[a.id], ARRAY[a.id],
    '{leak}', '{leak}', a.area, 0.02, a.area * (1 + (a.id %% 25 = 0)::int), 0.02, 1, 1, a.chainage_from, a.chainage_to, a.clock,
    ST_Multi(a.unrolled), ST_Multi(a.map), ST_Multi(a.surface)
FROM tunnel.survey n, tunnel.finding a WHERE n.name = %(later)s AND a.survey_id = %(id)s AND a.wet
"""

SURFACES = """
INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_kind, platform)
SELECT tunnel_id, %(earlier)s, '2023-05-04', 'none', 'mobile' FROM tunnel.survey WHERE id = %(id)s
"""

# Of a hundred sections one is thinner than 0.2 m somewhere.
THICKNESS = """
INSERT INTO tunnel.thickness_section (survey_id, before_id, km, layer, chainage_from, chainage_to, design_length,
    compared_length, area, noise_area, by_right, by_up, thickness_mean, thickness_least, least_at, thickness)
SELECT %(id)s, b.id, c / 1000, 'lining', c, c + 1, 25.1, 20, 6.0, 0.002, 3, 1, 0.3, v.least, 12.5,
    v.least || array_fill(0.3::real, ARRAY[250])
FROM generate_series(0, %(kilometres)s * 1000 - 1) AS c
CROSS JOIN LATERAL (SELECT CASE WHEN c %% 100 = 50 THEN 0.15 ELSE 0.25 END::real AS least) v
JOIN tunnel.survey b ON b.name = %(earlier)s
"""

EVENNESS = """
INSERT INTO tunnel.evenness_section (survey_id, km, layer, straightedge, gap_limit, chainage_from, chainage_to, arc_from, cell,
    lining_area, measured_area, over_area, gap_along, gap_along_at, gap_around, gap_around_at, waviness, sigma, along, around)
SELECT %(id)s, c / 1000, 'lining', 2, 0.02, c, c + 1, -12.5, 0.1, 20, 19.5, 0.3, 0.02 + 0.01 * sin(c / 40.0), 1, 0.03, -2, 0.05,
    0.0004, array_fill(0.01::real, ARRAY[251]), array_fill(0.01::real, ARRAY[251])
FROM generate_series(0, %(kilometres)s * 1000 - 1) AS c
"""

UNEVEN = """
INSERT INTO tunnel.evenness_area (survey_id, km, layer, area, gap, direction, geom)
SELECT %(id)s, floor(c / 1000), 'lining', 0.06, 0.02 + 0.04 * random(), 'along', ST_MakeEnvelope(c, a, c + 0.3, a + 0.2)
FROM generate_series(0, %(kilometres)s * 5000 - 1) AS i, LATERAL (SELECT i / 5.0 AS c, 9 * sin(i) AS a) q
"""

BLOCKS = """
WITH d AS (INSERT INTO tunnel.element_set (tunnel_id, name, source)
           SELECT tunnel_id, 'blocks', 'length' FROM tunnel.survey WHERE id = %(id)s RETURNING id)
INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to)
SELECT d.id, n, 'block ' || n, 10 * n - 10, 10 * n FROM d, generate_series(1, %(kilometres)s * 100) AS n
"""

SCHEMES = """
WITH s AS (INSERT INTO tunnel.rating_scheme (name, version, source, results)
           VALUES ('example', '1', 'benchmark', '{A,B,C,D}'), ('count', '1', 'benchmark', '{A,B,C,D}')
           ON CONFLICT DO NOTHING RETURNING id, name)
INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results)
SELECT s.id, r.n, r.text, r.kinds, r.measure, r.inclusive, r.limits, r.results
FROM s JOIN (VALUES
    ('example', 1, 'share of wet lining', '{}'::text[], 'share', false, '{0.0005,0.002}'::float8[], '{B,C}'::text[]),
    ('example', 2, 'severity', '{leak,crack,spall}', 'severity', true, '{2,3,4}', '{B,C,D}'),
    ('count', 1, 'number of leaks', '{leak}', 'count', true, '{20,40,60}', '{B,C,D}'))
    AS r (name, n, text, kinds, measure, inclusive, limits, results) ON r.name = s.name
"""

# Of a hundred wet findings one has an action, in all states and urgencies.
ACTIONS = """
INSERT INTO tunnel.action (survey_id, finding_id, chainage_from, chainage_to, arc, measure, urgency, state, due, cost, currency)
SELECT %(id)s, a.id, a.chainage_from, a.chainage_to, (a.arc_from + a.arc_to) / 2, 'inject',
    (ARRAY['immediate', 'urgent', 'planned', 'monitor'])[1 + a.id / 100 %% 4],
    (ARRAY['open', 'ordered', 'done', 'verified', 'open'])[1 + a.id / 100 %% 5], '2025-01-01'::date + (a.id / 100 %% 900)::int,
    100, 'EUR'
FROM tunnel.finding a WHERE a.survey_id = %(id)s AND a.wet AND a.id %% 100 = 0
"""

LIMITS = """
INSERT INTO tunnel.alarm_limit (tunnel_id, name, quantity, warning, alarm, step)
SELECT tunnel_id, 'wet', 'wet_area', 1, 5, 50 FROM tunnel.survey WHERE id = %(id)s
"""

STEPS = {
    "files and ledger": (FILES, RUNS),
    "segments and sections": (SEGMENTS, COUNTED, SECTIONS),
    "leaks": (SPOTS, "ANALYZE spot", OUTLINES, ANOMALIES),
    "audit": (AUDIT, MOVED),
    "what people drew": (
        "ANALYZE outline",
        DRAWN,
        "ANALYZE tunnel.finding",
        LINKED,
        DRAWN_AUDIT,
        PHOTOS,
        DRY_REGIONS,
        "SELECT tunnel_internal.pack_sums(%(id)s)",
    ),
    "coverage and radiometry": (COVERAGE, RADIOMETRY, CURVES),
    "ground, clusters, target spheres": (GROUND, CLUSTERS, SPHERES),
    "deviation": (PROFILE, DEVIATION),
    "clearance": (CLEARANCE, INFRINGEMENTS),
    "rings": (RINGS, RING_CHORDS),
    "change until a later survey": (LATER, CHANGE_SECTIONS, CHANGE_REGIONS, LEAK_CHANGES, "ANALYZE tunnel.leak_change"),
    "thickness and evenness": (SURFACES, THICKNESS, EVENNESS, UNEVEN),
    "elements, schemes, actions, limits": (BLOCKS, SCHEMES, ACTIONS, LIMITS),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="database to fill; default: the embedded server's own")
    parser.add_argument("--survey", default="demo-2024", help="name of the survey")
    parser.add_argument("--km", type=int, default=Size.kilometres)
    parser.add_argument("--leaks", type=int, default=Size.leaks)
    parser.add_argument("--points", type=int, default=Size.points)
    arguments = parser.parse_args()
    with connect(resolve_dsn(arguments.dsn)) as connection:
        make(connection, arguments.survey, Size(arguments.km, arguments.leaks, arguments.points))


if __name__ == "__main__":
    main()
