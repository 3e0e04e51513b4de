"""Classes of waterproofing by GB 50108-2008 of any leaks, worked out by the program's own function.

`tunnel_api.leak_statistics` and `ring_statistics` sum up the leaks of a survey that stands in the database. So a survey is
put there that has nothing but a stretch of lining and the leaks in question, asked for its classes, and taken away again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.geometry.base import BaseGeometry

from tunneldb.anomalies.coverage import Coverage
from tunneldb.geometry.stationing import KILOMETRE

STRETCH = 2.0
"""Length of the stretches of which classes are worked out besides that of the whole scene, about a ring of segments, m: longer
ones of such scenes are of the fourth class nearly all, whatever was found."""

NAME = "leaks that are scored"

Classes = list[int | None]


def read_coverage(conn: psycopg.Connection[Any], survey_id: int) -> dict[int, Coverage]:
    """Lining of each kilometre of a survey, and what detection saw of it."""
    rows = conn.execute("SELECT km, step, lining, seen, wet FROM tunnel.coverage WHERE survey_id = %s", (survey_id,))
    return {row[0]: Coverage(row[1], *(np.array(areas, np.float32) for areas in row[2:])) for row in rows}


def classes(conn: psycopg.Connection[Any], coverage: Mapping[int, Coverage], leaks: Sequence[BaseGeometry]) -> Classes:
    """Work out the class of a scene, and of each STRETCH of it.

    Areas are those of the unrolled plane. A leak of several parts is one patch; where the end of a stretch cuts it, its area
    is spread over its hull. The database is left as it was.

    Parameters
    ----------
    conn : psycopg.Connection
    coverage : mapping of int to Coverage
        Lining of each kilometre, from its beginning on.
    leaks : sequence of Polygon or MultiPolygon
        In the unrolled plane, m.

    Returns
    -------
    list of int or None
        1 to 4, of the scene, then of its stretches; None where no lining was seen; empty where there is none.
    """
    if not any(one.lining.any() for one in coverage.values()):
        return []
    with conn.transaction(force_rollback=True):
        survey = _survey(conn)
        for km, one in coverage.items():
            _add_coverage(conn, survey, km, one)
        for shape in leaks:
            if shape.area > 0.0:
                _add_leak(conn, survey, shape)
        whole = conn.execute(
            "SELECT chainage_from, class FROM tunnel_api.leak_statistics(%s, '-Infinity', 'Infinity')", (NAME,)
        ).fetchone()
        assert whole is not None
        parts = conn.execute(
            "SELECT class FROM tunnel_api.ring_statistics(%s, %s, %s) ORDER BY number", (NAME, STRETCH, whole[0])
        ).fetchall()
    return [whole[1], *(part[0] for part in parts)]


def _survey(conn: psycopg.Connection[Any]) -> int:
    row = conn.execute(
        "WITH t AS (INSERT INTO tunnel.tunnel (name, srid, start_chainage, spacing, alignment)"
        " VALUES (%(name)s, 25832, 0, 10, 'SRID=25832;LINESTRING Z (0 0 0, 1 0 0)') RETURNING id)"
        " INSERT INTO tunnel.survey (tunnel_id, name, date, intensity_dimension, intensity_kind, platform)"
        " SELECT t.id, %(name)s, '2024-05-04', 'Amplitude', 'amplitude', 'static' FROM t RETURNING id",
        {"name": NAME},
    ).fetchone()
    assert row is not None
    return int(row[0])


def _add_coverage(conn: psycopg.Connection[Any], survey: int, km: int, coverage: Coverage) -> None:
    """Add the coverage of a kilometre, and a segment that goes as far as its lining."""
    held = np.flatnonzero(coverage.lining)
    if not len(held):
        return
    start = km * KILOMETRE
    conn.execute(
        "INSERT INTO tunnel.segment (survey_id, n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from,"
        " tangent_to, geom, points) VALUES (%s, %s, %s, %s, %s, '{0,0,0}', '{1,0,0}', '{1,0,0}', '{1,0,0}',"
        " 'SRID=25832;LINESTRING Z (0 0 0, 1 0 0)', 1)",
        (survey, km, km, start + float(held[0]) * coverage.step, start + float(held[-1] + 1) * coverage.step),
    )
    conn.execute(
        "INSERT INTO tunnel.coverage (survey_id, km, step, lining, seen, wet) VALUES (%s, %s, %s, %s, %s, %s)",
        (survey, km, coverage.step, *(areas.tolist() for areas in (coverage.lining, coverage.seen, coverage.wet))),
    )


def _add_leak(conn: psycopg.Connection[Any], survey: int, shape: BaseGeometry) -> None:
    west, south, east, north = shape.bounds
    outline = shape if isinstance(shape, shapely.Polygon) else shape.convex_hull
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, area, darkening_mean,"
        " darkening_max, image_share, unrolled, map, surface) VALUES (%(survey)s, %(km)s, %(west)s, %(east)s,"
        " %(south)s, %(north)s,"
        " 12, %(area)s, 0, 0, 1, %(flat)s, %(flat)s, public.ST_Force3D(%(flat)s::public.geometry))",
        {
            "survey": survey, "km": int((west + east) / 2 // KILOMETRE), "west": west, "east": east, "south": south,
            "north": north, "area": shape.area, "flat": shapely.to_wkt(outline, rounding_precision=6),
        },
    )  # fmt: skip
