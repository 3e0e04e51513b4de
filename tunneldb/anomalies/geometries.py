"""Three geometries of a leak, its clock position and its area on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.surface import Surface

MAX_EDGE_LENGTH = 0.1
"""Maximum length of a straight edge of a polygon on the curved surface, m."""

MAX_SAMPLES = 5000
"""Approximate maximum number of places at which the stretch of the surface is averaged."""

_STEP = 0.01


@dataclass(frozen=True)
class Geometries:
    """Geometries of a leak in space.

    Attributes
    ----------
    map : Polygon
        In the map: each vertex is beside the axis at its chainage, at the distance of its arc (Gonçalves et al., 2012, eq. 1);
        the tunnel's SRID.
    surface : Polygon
        On the surface, with Z.
    clock : float
        Hours, above 0 up to 12: 12 at the crown, 3 to the right looking up-chainage.
    area : float
        Area on the surface, m².
    """

    map: Polygon
    surface: Polygon
    clock: float
    area: float


def anomaly_geometries(outline: Polygon, surface: Surface) -> Geometries:
    """Project an outline in the unrolled plane onto the map and the surface.

    Parameters
    ----------
    outline : Polygon
        (chainage, arc), m.
    surface : Surface
        Surface of the tunnel.
    """
    dense = _within(shapely.segmentize(outline, MAX_EDGE_LENGTH), surface)
    return Geometries(
        map=shapely.transform(dense, lambda unrolled: to_map(surface, unrolled)),
        surface=_to_space(dense, surface),
        clock=_clock(outline, surface),
        area=_area(outline, surface),
    )


def _within(outline: Polygon, surface: Surface) -> Polygon:
    """Return an outline whose vertices are all on the surface: pixels at its end reach beyond it.

    A vertex beyond the first or the last plane moves onto it; any other vertex off the surface moves to the nearest one on it.
    """
    at = shapely.get_coordinates(outline)
    lost = _off(at, surface)
    if not lost.any():
        return outline
    at[:, 0] = np.clip(at[:, 0], surface.ends[0, 0], surface.ends[-1, 1])
    lost = _off(at, surface)
    if not lost.all():
        at[lost] = at[~lost][cKDTree(at[~lost]).query(at[lost])[1]]
    return shapely.transform(outline, lambda _: at)


def _off(unrolled: Float, surface: Surface) -> Bool:
    """Return True for (chainage, arc) rows (n, 2) off the surface."""
    return np.isnan(surface.to_space(unrolled[:, 0], unrolled[:, 1], np.zeros(len(unrolled)))[:, 0])


def to_map(surface: Surface, unrolled: Float) -> Float:
    """Return map coordinates (n, 2) of (chainage, arc) rows (n, 2): axis in plan + arc · right."""
    frames = surface.frames(unrolled[:, 0])
    return np.asarray(frames[:, 0, :2] + unrolled[:, 1, None] * frames[:, 2, :2], dtype=np.float64)


def _to_space(outline: Polygon, surface: Surface) -> Polygon:
    def ring(line: shapely.LinearRing) -> Float:
        unrolled = shapely.get_coordinates(line)
        return surface.to_space(unrolled[:, 0], unrolled[:, 1], np.zeros(len(unrolled)))

    return Polygon(ring(outline.exterior), [ring(hole) for hole in outline.interiors])


def _clock(outline: Polygon, surface: Surface) -> float:
    inside = outline.representative_point()
    chainage = np.array([inside.x])
    origin, _, right, up = surface.frames(chainage)[0]
    ray = surface.to_space(chainage, np.array([inside.y]), np.zeros(1))[0] - origin
    hours = (np.degrees(np.arctan2(ray @ right, ray @ up)) / 30.0) % 12.0
    return float(hours) if hours > 0 else 12.0


def _area(outline: Polygon, surface: Surface) -> float:
    """Return the area in the unrolled plane × the mean stretch of the surface relative to it (slope, curve)."""
    chainage, arc = _samples(outline)
    zero = np.zeros(len(chainage))
    here = surface.to_space(chainage, arc, zero)
    along = surface.to_space(chainage + _STEP, arc, zero) - here
    across = surface.to_space(chainage, arc + _STEP, zero) - here
    stretch = np.linalg.norm(np.cross(along, across), axis=1) / _STEP**2
    known = np.isfinite(stretch)
    return float(outline.area * (stretch[known].mean() if known.any() else 1.0))


def _samples(outline: Polygon) -> tuple[Float, Float]:
    """Return places spread evenly over a polygon."""
    west, south, east, north = outline.bounds
    step = max(np.sqrt((east - west) * (north - south) / MAX_SAMPLES), 1e-3)
    x, y = (g.ravel() for g in np.meshgrid(np.arange(west, east, step) + step / 2, np.arange(south, north, step) + step / 2))
    inside = shapely.contains_xy(outline, x, y)
    if not inside.any():
        point = outline.representative_point()
        return np.array([point.x]), np.array([point.y])
    return x[inside], y[inside]
