"""Surface normals along edges, where wall and ceiling, or wall and floor, meet.

A section is a smooth curve, so along an edge its normal turns from one face to the other over a decimetre or two. The lining
there is still on one face or the other, and its incidence angle is that of its face. Where the surface bends sharply, a point
takes the normal of the nearer face, to the left or to the right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Intp
from tunneldb.compiled import point_inner
from tunneldb.geometry.surface import Surface, Unrolled

BEND_COSINE = np.cos(np.radians(25.0))
"""Cosine of the angle between the normals 0.3 m to the left and right from which the surface bends sharply (25°)."""

_ALONG, _ACROSS, _SIDE = 1.0, 0.05, 6


@dataclass(frozen=True)
class Edges:
    """Faces of a stretch of a tunnel: feet and normals on a grid of 1 m along the tunnel and 0.05 m across.

    Attributes
    ----------
    start, first : float
        Chainage and arc of the grid's first node, m.
    feet, normals : (k, m, 3) float arrays
        Points of the surface, m, and unit normals there, into the tunnel; NaN without a surface.
    sharp : (k, m) bool array
        True where the surface bends sharply.
    """

    start: float
    first: float
    feet: Float
    normals: Float
    sharp: Bool

    @classmethod
    def of(cls, surface: Surface, start: float, stop: float) -> Edges:
        """Make the grid for a surface between two chainages, m."""
        lowest, highest = float(surface.arcs[:, 0].min()), float(surface.arcs[:, -1].max())
        chainage = np.arange(start, stop + _ALONG, _ALONG)
        # Whole multiples, so that the nodes of both kilometres at a border coincide.
        arc = np.arange(np.floor(lowest / _ACROSS), np.ceil(highest / _ACROSS) + 1) * _ACROSS
        c, a = (grid.ravel() for grid in np.meshgrid(chainage, arc, indexing="ij"))
        feet = surface.to_space(c, a, np.zeros(len(c)))
        shape = (len(chainage), len(arc), 3)
        normals = surface.unroll(feet).normal.reshape(shape)
        sharp = np.zeros(shape[:2], np.bool_)
        with np.errstate(invalid="ignore"):
            turn = np.einsum("kmi,kmi->km", normals[:, : -2 * _SIDE], normals[:, 2 * _SIDE :])
            sharp[:, _SIDE:-_SIDE] = turn < BEND_COSINE
        return cls(start, float(arc[0]), feet.reshape(shape), normals, sharp)

    def normals_of(self, points: Float, unrolled: Unrolled) -> Float:
        """Return the normals (n, 3) of points (n, 3): of the surface, or of the nearer face where it bends sharply."""
        if not self.sharp.any():
            return unrolled.normal
        with np.errstate(invalid="ignore"):
            k = np.floor((unrolled.chainage - self.start) / _ALONG + 0.5)
            m = np.floor((unrolled.arc - self.first) / _ACROSS + 0.5)
            on_grid = np.flatnonzero((k >= 0) & (k < self.sharp.shape[0]) & (m >= 0) & (m < self.sharp.shape[1]))
        k, m = k[on_grid].astype(np.intp), m[on_grid].astype(np.intp)
        sharp = self.sharp[k, m]
        at, k, m = on_grid[sharp], k[sharp], m[sharp]
        left, right = (np.abs(self._above(points[at], k, m + side)) for side in (-_SIDE, _SIDE))
        out = unrolled.normal.copy()
        out[at] = self.normals[k, np.where(left <= right, m - _SIDE, m + _SIDE)]
        return out

    def _above(self, points: Float, k: Intp, m: Intp) -> Float:
        """Return the distance (n,) of points (n, 3) from the planes at nodes of the grid, m, positive into the tunnel."""
        x, y, z = ((points - self.feet[k, m]) * self.normals[k, m]).T
        return np.asarray(x + y + z)


@point_inner
def face_at(
    start: float, first: float, sharp: Bool, chainage: float, arc: float
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return the grid node nearest to a place of the unrolled plane, or (-1, -1) where the surface does not bend sharply."""
    k = int(np.floor((chainage - start) / _ALONG + 0.5))
    m = int(np.floor((arc - first) / _ACROSS + 0.5))
    if k < 0 or k >= sharp.shape[0] or m < 0 or m >= sharp.shape[1] or not sharp[k, m]:
        return -1, -1
    return k, m


@point_inner
def face_normal(
    feet: Float, normals: Float, k: int, m: int, x: float, y: float, z: float
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return the normal of the face, left or right of a node, whose plane is nearer to a point."""
    one, other = m - _SIDE, m + _SIDE
    left = (
        (x - feet[k, one, 0]) * normals[k, one, 0]
        + (y - feet[k, one, 1]) * normals[k, one, 1]
        + (z - feet[k, one, 2]) * normals[k, one, 2]
    )
    right = (
        (x - feet[k, other, 0]) * normals[k, other, 0]
        + (y - feet[k, other, 1]) * normals[k, other, 1]
        + (z - feet[k, other, 2]) * normals[k, other, 2]
    )
    side = one if abs(left) <= abs(right) else other
    return normals[k, side, 0], normals[k, side, 1], normals[k, side, 2]
