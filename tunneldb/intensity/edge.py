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
from numpy.typing import NDArray

from tunneldb.geometry.surface import Surface, Unrolled

Float = NDArray[np.float64]

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
    sharp: NDArray[np.bool_]

    @classmethod
    def of(cls, surface: Surface, start: float, stop: float) -> Edges:
        """Lay the grid over a surface between two chainages, m."""
        first, last = float(surface.arcs[:, 0].min()), float(surface.arcs[:, -1].max())
        chainage = np.arange(start, stop + _ALONG, _ALONG)
        arc = np.arange(first, last + _ACROSS, _ACROSS)
        c, a = (grid.ravel() for grid in np.meshgrid(chainage, arc, indexing="ij"))
        feet = surface.roll(c, a, np.zeros(len(c)))
        shape = (len(chainage), len(arc), 3)
        normals = surface.unroll(feet).normal.reshape(shape)
        sharp = np.zeros(shape[:2], np.bool_)
        with np.errstate(invalid="ignore"):
            turn = np.einsum("kmi,kmi->km", normals[:, : -2 * _SIDE], normals[:, 2 * _SIDE :])
            sharp[:, _SIDE:-_SIDE] = turn < BEND
        return cls(start, first, feet.reshape(shape), normals, sharp)

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
    sharp: NDArray[np.bool_],
) -> Float:  # pragma: no cover - compiled
    out = normal.copy()
    along, across = sharp.shape
    for i in prange(points.shape[0]):
        if np.isnan(chainage[i]) or np.isnan(arc[i]):
            continue
        k = int(np.floor((chainage[i] - start) / _ALONG + 0.5))
        m = int(np.floor((arc[i] - first) / _ACROSS + 0.5))
        if k < 0 or k >= along or m < 0 or m >= across or not sharp[k, m]:
            continue
        nearest = np.inf
        for side in (m - _SIDE, m + _SIDE):
            away = 0.0
            for c in range(3):
                away += (points[i, c] - feet[k, side, c]) * normals[k, side, c]
            if abs(away) < nearest:
                nearest = abs(away)
                for c in range(3):
                    out[i, c] = normals[k, side, c]
    return out
