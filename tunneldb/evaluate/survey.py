"""What a survey says about its leaks: where they were sought, what was found, how much lining was seen, and from how near."""

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

WIDE = 1e4  # m of arc, more than any section has


@dataclass(frozen=True)
class Findings:
    """Leaks that a survey found.

    Attributes
    ----------
    kilometres : list of int
        Where they were sought.
    ids : list of int
        Their keys.
    shapes : list of Polygon
        In the unrolled plane, m.
    seen : float
        Lining that was seen, m².
    """

    kilometres: list[int]
    ids: list[int]
    shapes: list[Polygon]
    seen: float

    @property
    def stretch(self) -> BaseGeometry:
        """The unrolled plane between the ends of the kilometres."""
        boxes = [shapely.box(km * KILOMETRE, -WIDE, (km + 1) * KILOMETRE, WIDE) for km in self.kilometres]
        return shapely.union_all(boxes)


def read_findings(conn: psycopg.Connection[Any], survey: Survey, km: str | None = None) -> Findings:
    """Read the leaks that were found last, or confirmed, and not rejected; kinds are those after judging.

    Parameters
    ----------
    conn, survey
        Where from.
    km : str, optional
        Only these kilometres, such as ``511`` or ``511-513``; by default all where leaks were sought.

    Raises
    ------
    UserError
        If leaks were not sought there.
    """
    if survey.intensity_kind == "none":
        raise UserError(f"survey {survey.name} has no intensity: no leaks were sought in it")
    detected = [
        row[0]
        for row in conn.execute(
            "SELECT DISTINCT km FROM tunnel.run WHERE survey_id = %s AND stage = 'detect' AND outcome = 'done' ORDER BY km",
            (survey.id,),
        )
    ]
    if not detected:
        raise NotReadyError(f"no leaks were sought in survey {survey.name} yet: tunneldb run {survey.name}")
    kilometres = detected
    if km is not None:
        kilometres = parse_km(km, loaded_kilometres(conn, survey))
        if left := sorted(set(kilometres) - set(detected)):
            raise NotReadyError(f"no leaks were sought in kilometre {left[0]} yet: tunneldb run {survey.name} --km {left[0]}")
    rows = conn.execute(
        "SELECT id, public.ST_AsBinary(unrolled) FROM tunnel_api.leak"
        " WHERE survey_id = %s AND (detected OR review = 'confirmed') AND review <> 'rejected'"
        " ORDER BY chainage_from + chainage_to, arc_from, id",
        (survey.id,),
    ).fetchall()
    shapes = [shapely.from_wkb(bytes(row[1])) for row in rows]
    return Findings(kilometres, [row[0] for row in rows], shapes, _seen(conn, survey, kilometres))


def _seen(conn: psycopg.Connection[Any], survey: Survey, kilometres: Sequence[int]) -> float:
    """Lining that was seen in kilometres, m²: their coverage, or what the ledger counts; NaN where one has neither."""
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
    """Distance of a point inside each leak (n,) from the nearest scanner position, m; NaN off the tunnel."""
    if not len(shapes):
        return np.zeros(0)
    inside = shapely.get_coordinates(shapely.point_on_surface(np.asarray(shapes, dtype=object)))
    surface = load_surface(conn, survey, float(inside[:, 0].min()), float(inside[:, 0].max()))
    return distance_from_scanner(surface.to_space(inside[:, 0], inside[:, 1], np.zeros(len(inside))), load_poses(conn, survey))


def distance_from_scanner(points: Float, poses: PoseModel) -> Float:
    """Distance of points (n, 3) from the nearest station, or from the trajectory between its rows, m; NaN where they are."""
    if poses.empty:
        return np.full(len(points), np.nan)
    track = poses.track if poses.mobile else poses.station
    known = np.isfinite(points).all(axis=1)
    distance = np.full(len(points), np.nan)
    distance[known], nearest = cKDTree(track).query(points[known])
    if poses.mobile:
        for other in (nearest - 1, nearest + 1):
            beside = np.clip(other, 0, len(track) - 1)
            distance[known] = np.fmin(distance[known], _from_segment(points[known], track[nearest], track[beside]))
    return distance


def _from_segment(points: Float, a: Float, b: Float) -> Float:
    """Distance of points from segments a-b, row by row, all (n, 3), m."""
    along = b - a
    square = (along**2).sum(axis=1)
    share = ((points - a) * along).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    return np.linalg.norm(points - a - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
