"""Clearance of a survey's tracks: points and clusters from the database, outlines, sections and infringements to it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely
from psycopg import sql

from tunneldb.arrays import Float, Int64, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.classification.objects.clusters import CELL
from tunneldb.database.copy import unpack_array
from tunneldb.database.fetch import fetch_array
from tunneldb.shape.outline import Outline
from tunneldb.store.partition import partition, partition_exists
from tunneldb.store.survey import Survey

MAX_POINTS = 200
"""Maximum number of stored points of an infringement."""

_XYZ = tuple((axis, "f8", sql.SQL(f"public.ST_{axis.upper()}(geom)")) for axis in "xyz")
_CLASS = ("class", "i2", sql.SQL("coalesce(class, 1::smallint)"))


@dataclass(frozen=True)
class SavedSection:
    """Row of tunnel.clearance_section: its values in the order of the columns after ``track``, and its point."""

    values: tuple[Any, ...]
    point: Float | None


@dataclass(frozen=True)
class SavedInfringement:
    """Row of tunnel.clearance_infringement: its values in the order of the columns after ``track``, and its geometries."""

    values: tuple[Any, ...]
    unrolled: shapely.Geometry | None
    points: Float


def load_classed(
    conn: psycopg.Connection[Any], survey: Survey, km: int, begin: float, end: float, rails: bool = False
) -> tuple[Float, UInt8]:
    """Load points between two chainages (n, 3), m, and their classes (n,), from a kilometre and its neighbours.

    Parameters
    ----------
    rails : bool
        Only points of rails and other bars along the ground.
    """
    parts = []
    limit = sql.SQL("FROM {} WHERE chainage >= %(begin)s AND chainage < %(end)s AND (class = %(rail)s OR NOT %(rails)s)")
    for part in (km - 1, km, km + 1):
        if begin < (part + 1) * 1000 and end > part * 1000 and partition_exists(conn, survey, part):
            source = limit.format(partition(survey, part))
            values = {"begin": begin, "end": end, "rail": int(PointClass.RAIL), "rails": rails}
            parts.append(fetch_array(conn, [*_XYZ, _CLASS], source, values))
    if not parts:
        return np.empty((0, 3)), np.empty(0, np.uint8)
    rows = np.concatenate(parts)
    return np.column_stack([rows[axis] for axis in "xyz"]), rows["class"].astype(np.uint8)


def classed_kilometres(conn: psycopg.Connection[Any], survey: Survey) -> list[int]:
    """Return the kilometres whose points have classes, in order."""
    rows = conn.execute(
        "SELECT DISTINCT km FROM tunnel.run WHERE survey_id = %s AND stage = 'ground' AND outcome = 'done' ORDER BY km",
        [survey.id],
    ).fetchall()
    return [km for (km,) in rows]


def clusters_at(conn: psycopg.Connection[Any], survey: Survey, km: int, points: Float) -> list[int | None]:
    """Return the key of the cluster in or next to whose cells each point (n, 3) is; None without."""
    rows = conn.execute(
        "SELECT id, array_send(cells) FROM tunnel.cluster WHERE survey_id = %s AND km BETWEEN %s AND %s ORDER BY id",
        [survey.id, km - 1, km + 1],
        binary=True,
    ).fetchall()
    if not rows or not len(points):
        return [None] * len(points)
    from scipy.spatial import cKDTree

    cells = [unpack_array(cells, np.int32).reshape(-1, 3) for _, cells in rows]
    owner: Int64 = np.repeat([key for key, _ in rows], [len(part) for part in cells])
    away, nearest = cKDTree(np.vstack(cells)).query(np.floor(points / CELL), p=np.inf, distance_upper_bound=2.5)
    return [int(owner[k]) if np.isfinite(d) else None for d, k in zip(away, nearest, strict=True)]


def save_gauge(conn: psycopg.Connection[Any], survey: Survey, name: str, outline: Outline, source: str) -> None:
    """Store an outline under a name, replacing an earlier one; committed."""
    flat = _flat(outline)
    checksum = hashlib.md5(np.round(flat, 9).tobytes(), usedforsecurity=False).hexdigest()
    conn.execute(
        "INSERT INTO tunnel.gauge (tunnel_id, name, outline, source, checksum) VALUES (%s, %s, %s, %s, %s)"
        " ON CONFLICT (tunnel_id, name) DO UPDATE SET outline = EXCLUDED.outline, source = EXCLUDED.source,"
        " checksum = EXCLUDED.checksum, added_at = clock_timestamp() WHERE gauge.checksum <> EXCLUDED.checksum",
        [survey.tunnel_id, name, flat.tolist(), source, checksum],
    )
    conn.commit()


def save_clearance(
    conn: psycopg.Connection[Any], survey: Survey, km: int, gauge: str, track: str,
    sections: Sequence[SavedSection], infringements: Sequence[SavedInfringement],
) -> None:  # fmt: skip
    """Replace the clearance of a track in a kilometre."""
    for table in ("clearance_section", "clearance_infringement"):
        conn.execute(
            sql.SQL("DELETE FROM {} WHERE survey_id = %s AND km = %s AND gauge = %s AND track = %s").format(
                sql.Identifier("tunnel", table)
            ),
            [survey.id, km, gauge, track],
        )
    head = (survey.id, km, gauge, track)
    with conn.cursor() as cursor, cursor.copy(
        "COPY tunnel.clearance_section (survey_id, km, gauge, track, chainage_from, chainage_to, track_right, track_up, cant,"
        " curvature, widened_left, widened_right, roll, margin, margin_se, clock, class, cluster_id, margins, seen_share,"
        " points, inside, stray, passing, ground, outline, geom) FROM STDIN"
    ) as copy:  # fmt: skip
        for row in sections:
            copy.write_row((*head, *row.values, None if row.point is None else _ewkb(shapely.Point(row.point), survey.srid)))
    with conn.cursor() as cursor, cursor.copy(
        "COPY tunnel.clearance_infringement (survey_id, km, gauge, track, chainage_from, chainage_to, depth, clock, class,"
        " counts, cluster_id, points, unrolled, geom) FROM STDIN"
    ) as copy:  # fmt: skip
        for one in infringements:
            plane = None if one.unrolled is None else _ewkb(one.unrolled, 0)
            copy.write_row((*head, *one.values, plane, _ewkb(shapely.MultiPoint(one.points[:MAX_POINTS]), survey.srid)))


def flat_outline(outline: Outline) -> list[float]:
    """Return the vertices and bulges of an outline in one list."""
    return [float(value) for value in _flat(outline)]


def _flat(outline: Outline) -> Float:
    elements = outline.elements
    return np.concatenate([elements[:, [0, 1, 4]].ravel(), elements[-1, 2:4], [0.0]])


def _ewkb(geometry: shapely.Geometry, srid: int) -> str:
    return shapely.to_wkb(shapely.set_srid(geometry, srid), include_srid=True, hex=True)
