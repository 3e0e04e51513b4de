"""Detected leaks of a survey: kilometres, shapes, inspected lining and distance from the scanner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Float
from tunneldb.errors import NotReadyError, UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.stages.run import loaded_kilometres, parse_km
from tunneldb.store.poses import load_poses
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey

MAX_ARC = 1e4  # m of arc, more than any section has


@dataclass(frozen=True)
class Findings:
    """Detected leaks of a survey.

    Attributes
    ----------
    kilometres : list of int
        Kilometres in which leaks were detected.
    ids : list of int
        Keys of the leaks.
    shapes : list of Polygon
        Polygons in the unrolled plane, m.
    seen : float
        Inspected lining, m².
    """

    kilometres: list[int]
    ids: list[int]
    shapes: list[Polygon]
    seen: float

    @property
    def stretch(self) -> BaseGeometry:
        """Unrolled plane between the ends of the kilometres."""
        boxes = [shapely.box(km * KILOMETRE, -MAX_ARC, (km + 1) * KILOMETRE, MAX_ARC) for km in self.kilometres]
        return shapely.union_all(boxes)


def read_findings(conn: psycopg.Connection[Any], survey: Survey, km: str | None = None) -> Findings:
    """Read leaks of the last run, or confirmed ones, that are not rejected; kinds are those after review.

    Parameters
    ----------
    conn, survey
        Database and survey.
    km : str, optional
        Kilometres to read, for example ``511`` or ``511-513``; by default all with leak detection.

    Raises
    ------
    UserError
        If leaks were not detected there.
    """
    if survey.intensity_kind == "none":
        raise UserError(f"survey {survey.name} has no intensity, so leaks cannot be detected")
    detected = [
        row[0]
        for row in conn.execute(
            "SELECT DISTINCT km FROM tunnel.run WHERE survey_id = %s AND stage = 'detect' AND outcome = 'done' ORDER BY km",
            (survey.id,),
        )
    ]
    if not detected:
        raise NotReadyError(f"no leak detection in survey {survey.name} yet; type tunneldb run {survey.name}")
    kilometres = detected
    if km is not None:
        kilometres = parse_km(km, loaded_kilometres(conn, survey))
        if left := sorted(set(kilometres) - set(detected)):
            raise NotReadyError(f"no leak detection in kilometre {left[0]} yet; type tunneldb run {survey.name} --km {left[0]}")
    rows = conn.execute(
        "SELECT id, public.ST_AsBinary(unrolled) FROM tunnel_api.leak"
        " WHERE survey_id = %s AND (detected OR review = 'confirmed') AND review <> 'rejected'"
        " ORDER BY chainage_from + chainage_to, arc_from, id",
        (survey.id,),
    ).fetchall()
    shapes = [shapely.from_wkb(bytes(row[1])) for row in rows]
    return Findings(kilometres, [row[0] for row in rows], shapes, _seen(conn, survey, kilometres))


def _seen(conn: psycopg.Connection[Any], survey: Survey, kilometres: Sequence[int]) -> float:
    """Return the inspected lining of kilometres, m², from their coverage or from the ledger; NaN if one has neither."""
    row = conn.execute(
        """
        SELECT CASE WHEN bool_and(t.seen IS NOT NULL) THEN sum(t.seen) END
          FROM (SELECT coalesce((SELECT sum(s) FROM tunnel.coverage c, unnest(c.seen) AS s
                                  WHERE c.survey_id = %(survey)s AND c.km = k.km), m.seen_area) AS seen
                  FROM unnest(%(km)s::int[]) AS k (km)
                  LEFT JOIN tunnel_api.km_statistics m ON m.survey_id = %(survey)s AND m.km = k.km) t
        """,
        {"survey": survey.id, "km": list(kilometres)},
    ).fetchone()
    return float("nan") if row is None or row[0] is None else float(row[0])


def scanner_distance(conn: psycopg.Connection[Any], survey: Survey, shapes: Sequence[BaseGeometry]) -> Float:
    """Return the distance of a point inside each leak (n,) from the nearest scanner position, m; NaN off the tunnel."""
    if not len(shapes):
        return np.zeros(0)
    inside = shapely.get_coordinates(shapely.point_on_surface(np.asarray(shapes, dtype=object)))
    surface = load_surface(conn, survey, float(inside[:, 0].min()), float(inside[:, 0].max()))
    return distance_from_scanner(surface.to_space(inside[:, 0], inside[:, 1], np.zeros(len(inside))), load_poses(conn, survey))


def distance_from_scanner(points: Float, poses: PoseModel) -> Float:
    """Return the distance of points (n, 3) from the nearest station or from the trajectory, m; NaN stays NaN."""
    if poses.empty:
        return np.full(len(points), np.nan)
    track = poses.track if poses.mobile else poses.station
    known = np.isfinite(points).all(axis=1)
    distance = np.full(len(points), np.nan)
    distance[known], nearest = cKDTree(track).query(points[known])
    if poses.mobile:
        for other in (nearest - 1, nearest + 1):
            neighbour = np.clip(other, 0, len(track) - 1)
            distance[known] = np.fmin(distance[known], _from_segment(points[known], track[nearest], track[neighbour]))
    return distance


def _from_segment(points: Float, a: Float, b: Float) -> Float:
    """Return the distance of points from segments a-b, row by row, all (n, 3), m."""
    along = b - a
    square = (along**2).sum(axis=1)
    share = ((points - a) * along).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    return np.linalg.norm(points - a - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
