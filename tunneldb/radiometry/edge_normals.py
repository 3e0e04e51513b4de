"""Surface normals along edges, where wall and ceiling, or wall and floor, meet.

A section is a smooth curve, so along an edge its normal turns from one face to the other over a decimetre or
two. The lining there still lies on one face or the other, and its incidence angle is that of its face. Where
the surface bends sharply, a point takes the normal of the face, a little to the left or a little to the
right, whose plane it lies nearer to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.surface import Surface, Unrolled

BEND = np.cos(np.radians(25.0))
"""The surface bends sharply where its normals 0.3 m to the left and to the right differ by more than 25°."""

_ALONG, _ACROSS, _SIDE = 1.0, 0.05, 6


@dataclass(frozen=True)
class Edges:
    """Faces of a stretch of a tunnel: feet and normals on a grid of 1 m along the tunnel and 0.05 m across.

    Attributes
    ----------
    start, first : float
        Chainage and arc of the grid's first node, m.
    feet, normals : (k, m, 3) float arrays
        Points of the surface, m, and unit normals there, into the tunnel; NaN where there is no surface.
    sharp : (k, m) bool array
        Where the surface bends sharply.
    """

    start: float
    first: float
    feet: Float
    normals: Float
    sharp: Bool

    @classmethod
    def of(cls, surface: Surface, start: float, stop: float) -> Edges:
        """Lay the grid over a surface between two chainages, m."""
        lowest, highest = float(surface.arcs[:, 0].min()), float(surface.arcs[:, -1].max())
        chainage = np.arange(start, stop + _ALONG, _ALONG)
        # Whole multiples, so that the nodes lie at the same places for the kilometres on both sides of a border.
        arc = np.arange(np.floor(lowest / _ACROSS), np.ceil(highest / _ACROSS) + 1) * _ACROSS
        c, a = (grid.ravel() for grid in np.meshgrid(chainage, arc, indexing="ij"))
        feet = surface.to_space(c, a, np.zeros(len(c)))
        shape = (len(chainage), len(arc), 3)
        normals = surface.unroll(feet).normal.reshape(shape)
        sharp = np.zeros(shape[:2], np.bool_)
        with np.errstate(invalid="ignore"):
            turn = np.einsum("kmi,kmi->km", normals[:, : -2 * _SIDE], normals[:, 2 * _SIDE :])
            sharp[:, _SIDE:-_SIDE] = turn < BEND
        return cls(start, float(arc[0]), feet.reshape(shape), normals, sharp)

    def normals_of(self, points: Float, unrolled: Unrolled) -> Float:
        """Normals (n, 3) of points (n, 3): that of the surface, or of the nearer face where it bends sharply."""
        if not self.sharp.any():
            return unrolled.normal
        normal: Float = _normals(
            points,
            unrolled.chainage,
            unrolled.arc,
            unrolled.normal,
            self.start,
            self.first,
            self.feet,
            self.normals,
            self.sharp,
        )
        return normal


@njit(cache=True, nogil=True, forceinline=True)
def face_at(
    start: float, first: float, sharp: Bool, chainage: float, arc: float
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Node of the grid nearest to a place of the unrolled plane, (-1, -1) where the surface doesn't bend sharply."""
    k = int(np.floor((chainage - start) / _ALONG + 0.5))
    m = int(np.floor((arc - first) / _ACROSS + 0.5))
    if k < 0 or k >= sharp.shape[0] or m < 0 or m >= sharp.shape[1] or not sharp[k, m]:
        return -1, -1
    return k, m


@njit(cache=True, nogil=True)
def face_normal(
    feet: Float, normals: Float, k: int, m: int, x: float, y: float, z: float
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Normal of the face, to the left or to the right of a node, whose plane a point lies nearer to."""
    left, right = 0.0, 0.0
    one, other = m - _SIDE, m + _SIDE
    for c, at in enumerate((x, y, z)):
        left += (at - feet[k, one, c]) * normals[k, one, c]
        right += (at - feet[k, other, c]) * normals[k, other, c]
    side = one if abs(left) <= abs(right) else other
    return normals[k, side, 0], normals[k, side, 1], normals[k, side, 2]


@njit(cache=True, nogil=True, parallel=True)
def _normals(
    points: Float,
    chainage: Float,
    arc: Float,
    normal: Float,
    start: float,
    first: float,
    feet: Float,
    normals: Float,
    sharp: Bool,
) -> Float:  # pragma: no cover - compiled
    out = normal.copy()
    for i in prange(points.shape[0]):
        if np.isnan(chainage[i]) or np.isnan(arc[i]):
            continue
        k, m = face_at(start, first, sharp, chainage[i], arc[i])
        if k >= 0:
            out[i, 0], out[i, 1], out[i, 2] = face_normal(feet, normals, k, m, points[i, 0], points[i, 1], points[i, 2])
    return out
