"""Points of a stretch in space, the surface beside them, and outlines of findings, for the 3D view."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

from tunneldb.arrays import Float, Single, UInt8
from tunneldb.geometry.surface import Surface
from tunneldb.geometry.unrolling import NODES

MARGIN = 20.0
"""Length of the surface beyond both ends of a stretch, m."""

MOST_OUTLINES = 2000
"""Maximum number of findings with an outline, the largest."""

_UNITS = {"amplitude": "dB", "reflectance": "dB", "linear": ""}
"""Units of the kinds of intensity."""

_DEPTHS = {"Point": 0, "LineString": 0, "Polygon": 1, "MultiPoint": 1, "MultiLineString": 1, "MultiPolygon": 2}
"""Number of nested lists around the lines, or points, in the coordinates of each type of GeoJSON geometry."""

_COPY_HEADER = 19
"""Length of the header of a binary COPY, bytes."""

_ROW = np.dtype(
    [
        ("fields", ">i2"),
        ("x_", ">i4"), ("x", ">f8"),
        ("y_", ">i4"), ("y", ">f8"),
        ("z_", ">i4"), ("z", ">f8"),
        ("intensity_", ">i4"), ("intensity", ">f4"),
        ("class_", ">i4"), ("class", ">i2"),
        ("total_", ">i4"), ("total", ">i8"),
    ]
)  # fmt: skip
"""Row of a binary COPY of point_sample: the number of fields, and before each one its length."""


@dataclass(frozen=True)
class PointSample:
    """Points of a stretch, thinned evenly.

    Attributes
    ----------
    xyz : (n, 3) float array
        In the tunnel's SRID, m.
    intensity : (n,) float32 array
        As in the file.
    classes : (n,) uint8 array
        0 if not classified.
    total : int
        Number of points of the stretch.
    """

    xyz: Float
    intensity: Single
    classes: UInt8
    total: int


def load_points(conn: psycopg.Connection[Any], survey_id: int, low: float, high: float, limit: int) -> PointSample:
    """Read at most ``limit`` points from one chainage to another, m."""
    query = sql.SQL(
        "COPY (SELECT p.x, p.y, p.z, p.intensity, p.class, p.total FROM tunnel_api.point_sample({}, {}, {}, {}) p)"
        " TO STDOUT (FORMAT binary)"
    ).format(survey_id, low, high, limit)
    with conn.cursor().copy(query) as copy:
        sent = bytearray()  # a list of the rows would need several times the memory
        for part in copy:
            sent += part
    count = (len(sent) - _COPY_HEADER) // _ROW.itemsize
    rows = np.frombuffer(sent, _ROW, count, _COPY_HEADER)
    xyz = np.column_stack([rows[name] for name in "xyz"]).astype(np.float64)
    total = int(rows["total"][0]) if count else 0
    return PointSample(xyz, rows["intensity"].astype(np.float32), rows["class"].astype(np.uint8), total)


def intensity_unit(conn: psycopg.Connection[Any], survey_id: int) -> str | None:
    """Return the unit of a survey's intensity, "" for counts; None if it has none."""
    row = conn.execute("SELECT s.intensity_kind FROM tunnel_api.survey s WHERE s.id = %s", [survey_id]).fetchone()
    return None if row is None else _UNITS.get(row[0])


def load_surface(conn: psycopg.Connection[Any], survey_id: int, low: float, high: float) -> Surface:
    """Read the surface of a stretch, with MARGIN beyond its ends; without sections only its axis is known."""
    ends = [survey_id, low - MARGIN, high + MARGIN]
    segments = conn.execute(
        "SELECT s.n, s.first, s.last, s.planes FROM tunnel_api.segment_planes(%s, %s, %s) s", ends
    ).fetchall()
    sections = conn.execute(
        "SELECT c.chainage, s.radius, s.arc FROM tunnel_api.section c, tunnel_api.section_at(c.survey_id, c.chainage) s"
        " WHERE c.survey_id = %s AND c.chainage BETWEEN %s AND %s AND s.radius IS NOT NULL ORDER BY c.chainage",
        ends,
    ).fetchall()
    spacing = conn.execute(
        "SELECT t.spacing FROM tunnel_api.survey s JOIN tunnel_api.tunnel t ON t.id = s.tunnel_id WHERE s.id = %s", [survey_id]
    ).fetchone()
    return Surface(
        number=np.array([row[0] for row in segments], np.int64),
        segments=np.array([row[3] for row in segments], np.float64).reshape(-1, 12),
        ends=np.array([row[1:3] for row in segments], np.float64).reshape(-1, 2),
        chainages=np.array([row[0] for row in sections], np.float64),
        radius=np.array([row[1] for row in sections], np.float64).reshape(-1, NODES),
        arcs=np.array([row[2] for row in sections], np.float64).reshape(-1, NODES),
        reach=0.0 if spacing is None else spacing[0],
    )


def outlines(conn: psycopg.Connection[Any], survey_id: int, low: float, high: float) -> list[dict[str, Any]]:
    """Return the findings that touch a stretch, m, with their lines on the lining in space: lists of x, y and z, m."""
    rows = conn.execute(
        "SELECT f.id, f.kind, f.review, f.state, public.ST_AsGeoJSON(f.surface, 3) FROM tunnel_api.finding f"
        " WHERE f.survey_id = %s AND f.chainage_to > %s AND f.chainage_from < %s AND f.surface IS NOT NULL"
        " AND f.merged_into IS NULL AND f.same_as IS NULL ORDER BY f.area DESC, f.id LIMIT %s",
        [survey_id, low, high, MOST_OUTLINES],
    )
    return [
        {"id": number, "kind": kind, "review": review, "state": state, "lines": _lines(json.loads(shape))}
        for number, kind, review, state, shape in rows
    ]


def _lines(shape: dict[str, Any]) -> list[Any]:
    """Return the lines of a GeoJSON geometry: rings, lines, or points as lines of one vertex."""
    parts = [shape["coordinates"]]
    for _ in range(_DEPTHS[shape["type"]]):
        parts = [line for part in parts for line in part]
    return [[part] for part in parts] if shape["type"].endswith("Point") else parts
