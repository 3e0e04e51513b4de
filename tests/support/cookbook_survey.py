"""What the questions of the cookbook ask of beyond the example survey: points, a niche, edits by hand, a leak that is gone."""

from __future__ import annotations

import numpy as np
import psycopg

from support.example_change import add_change
from support.example_deviation import add_surfaces
from tunneldb.classification.classes import PointClass

NICHE = (12399.0, 12401.0, 3.3, 4.3)
"""From chainage to chainage, and how far right of the axis from and to, m."""

POINTS = {PointClass.LINING: 300, PointClass.GROUND: 200}
"""Points of each class between 12+340 and 12+345; as many again lie outside."""

MOVED, SPARSE = 1245, 1233
"""The vertex that was moved, and the segment that has few points."""

CONFIRMED, REJECTED, GONE, OLD = 12344.0, 12318.0, 12436.0, 12471.0
"""Middles of the leaks that were reviewed, that the last detection did not find again, and that was found weeks ago, m."""

COPIED, COPIES = 12428.0, (14.3, 9.4)
"""Middle of the leak that has others like it near by, and how far up-chainage they are, m."""


def prepare(conn: psycopg.Connection, survey: str) -> None:
    """Add it to a copy of the example survey; to be committed or not by the caller."""
    row = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", (survey,)).fetchone()
    assert row is not None
    for chainage, review in ((CONFIRMED, "confirmed"), (REJECTED, "rejected")):
        conn.execute(
            "UPDATE tunnel_api.leak SET review = %s, remark = 'seen'"
            " WHERE survey = %s AND %s BETWEEN chainage_from AND chainage_to",
            (review, survey, chainage),
        )
    conn.execute("UPDATE tunnel.finding SET detected = false WHERE %s BETWEEN chainage_from AND chainage_to", (GONE,))
    conn.execute(
        "UPDATE tunnel.finding SET created_at = now() - interval '20 days' WHERE %s BETWEEN chainage_from AND chainage_to",
        (OLD,),
    )
    for number, shift in enumerate(COPIES, start=1):
        conn.execute(
            "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, confidence,"
            " contrast, area, darkening_mean, darkening_max, image_share, unrolled, map, surface, created_at)"
            " SELECT survey_id, km, chainage_from + %(by)s, chainage_to + %(by)s, arc_from, arc_to, clock, kind, confidence,"
            " contrast, area * %(share)s, darkening_mean, darkening_max, image_share, ST_Translate(unrolled, %(by)s,"
            " 0), map, surface,"
            " created_at FROM tunnel.finding WHERE %(at)s BETWEEN chainage_from AND chainage_to",
            {"by": shift, "at": COPIED, "share": 1 - 0.03 * number},
        )
    conn.execute(
        "UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.05, 0, 0.02) WHERE survey = %s AND n = %s",
        (survey, MOVED),
    )
    add_surfaces(conn, row[0])
    conn.execute("UPDATE tunnel.segment SET points = 100 WHERE n = %s", (SPARSE,))
    low, high, left, right = NICHE
    conn.execute(
        "INSERT INTO tunnel.cluster (survey_id, km, class, chainage_from, chainage_to, height_from, height_to, points, cell,"
        " cells, geom) SELECT %s, 12, %s, %s, %s, 0.2, 2.2, 90, 0.1, '{0,0,0}',"
        " tunnel_api.map_strip(%s, ST_MakeEnvelope(%s, %s, %s, %s, 0))",
        (row[0], int(PointClass.NICHE), low, high, row[0], low, left, high, right),
    )
    _points(conn, row[0])
    add_change(conn, survey)


def _points(conn: psycopg.Connection, survey_id: int) -> None:
    conn.execute("SELECT tunnel_internal.partition_new(%s, 12)", (survey_id,))
    assert survey_id == 1
    classes = np.repeat([int(klass) for klass in POINTS], list(POINTS.values())).tolist()
    for start in (12340.001, 12345.001):
        conn.execute(
            "INSERT INTO tunnel.point_s1_km12_new (survey_id, km, chainage, gps_time, geom, scan_id, file_id, intensity,"
            ' classification, "class")'
            " SELECT 1, 12, %s + 0.009 * (n - 1), 0, ST_SetSRID(ST_MakePoint(0, 0, 0), 25830), 1, 1,"
            ' CASE n %% 2 WHEN 0 THEN -10 ELSE -14 END, 0, "class" FROM unnest(%s::int2[]) WITH ORDINALITY AS c ("class", n)',
            (start, classes),
        )
    conn.execute("SELECT tunnel_internal.partition_swap(1, 12)")


def draw_findings(conn: psycopg.Connection, survey: str) -> dict[str, int]:
    """Draw findings, draw over one leak and put a dry region over another; their ids, and that of the region."""

    def drawn(kind: str, shape: str, severity: int | None, width_mm: float | None = None) -> int:
        row = conn.execute(
            "INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, geom) "
            "VALUES (%s, %s, %s, %s, %s) RETURNING id",
            (survey, kind, severity, width_mm, shape),
        ).fetchone()
        assert row is not None
        return int(row[0])

    made = {
        "long crack": drawn("crack", "LINESTRING(12350 0, 12353 0)", 2, 2.0),
        "longer crack": drawn("crack", "LINESTRING(12360 0, 12364 0)", 4, 1.0),
        "short crack": drawn("crack", "LINESTRING(12354 0, 12354.5 0)", 4),
        "bolt": drawn("missing_bolt", "POINT(12370 -1)", 3),
        "spall": drawn("spall", "POLYGON((12380 0, 12381 0, 12381 1, 12380 1, 12380 0))", 3),
        "other spall": drawn("spall", "POLYGON((12380.5 1, 12381 1, 12381 1.5, 12380.5 1.5, 12380.5 1))", None),
    }
    conn.execute("INSERT INTO tunnel_api.finding_photo (finding_id, path) VALUES (%s, 'spall.jpg')", (made["spall"],))
    conn.execute("SELECT tunnel_api.finding_merge(%s)", ([made["spall"], made["other spall"]],))
    place = "FROM tunnel.finding WHERE kind = 'leak' AND %s BETWEEN chainage_from AND chainage_to"
    made["leak"], made["dry leak"] = (
        conn.execute(f"SELECT id {place}".encode(), (at,)).fetchone()[0]  # type: ignore[index]
        for at in (OLD, COPIED)
    )
    made["leak over it"] = conn.execute(  # type: ignore[index]
        "INSERT INTO tunnel_api.finding_unrolled (survey_id, kind, geom) "
        "SELECT survey_id, 'leak', ST_Buffer(unrolled, 0.1) FROM tunnel.finding WHERE id = %s RETURNING id",
        (made["leak"],),
    ).fetchone()[0]
    conn.execute("UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.1) WHERE id = %s", (made["leak over it"],))
    made["region"] = conn.execute(  # type: ignore[index]
        "INSERT INTO tunnel_api.region (survey_id, kind, reason, geom) "
        "SELECT survey_id, 'dry', 'seen dry', ST_Envelope(ST_Buffer(unrolled, 0.1)) FROM tunnel.finding "
        "WHERE id = %s RETURNING id",
        (made["dry leak"],),
    ).fetchone()[0]
    return made
