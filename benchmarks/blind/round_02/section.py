"""Cross-sections: a profile with its field of distances."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from .arrays import FloatArray

STEP = 0.02
GRID = 0.02
BEYOND = 1.0


@dataclass(frozen=True)
class Piece:
    """A part of half a profile, from the crown down: straight, or an arc; `corner` turns before it, degrees."""

    length: float
    radius: float = math.inf
    corner: float = 0.0


class Section:
    """Profile of a lining, symmetrical.

    The position on it is the girth t, metres from the crown, negative on the left; depth d is the distance inward.

    Parameters
    ----------
    crown : float
        Height of the crown over the floor (v = 0).
    pieces : tuple of Piece
        Half a profile; its end ought to lie below the floor.
    axis_height : float
        Height of the tunnel's axis.
    """

    def __init__(self, crown: float, pieces: tuple[Piece, ...], axis_height: float) -> None:
        right = self._half(crown, pieces)
        points = np.concatenate([right[::-1] * [-1, 1], right[1:]]) * [-1, 1]
        lengths = np.hypot(*np.diff(points, axis=0).T)
        self.axis_height = axis_height
        self.t = np.concatenate([[0], np.cumsum(lengths)])
        self.t -= self.t[-1] / 2
        self.points = points
        tangent = np.gradient(points, self.t, axis=0)
        tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
        self.normals = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        self.half = float(self.t[-1])
        self._fields()

    @staticmethod
    def _half(crown: float, pieces: tuple[Piece, ...]) -> FloatArray:
        """Right half (u negative), as u' = -u and v, from the crown down."""
        position, heading = np.array([0.0, crown]), 0.0
        rows = [position]
        for piece in pieces:
            heading -= math.radians(piece.corner)
            count = max(1, round(piece.length / STEP))
            step = piece.length / count
            for _ in range(count):
                bend = step / piece.radius
                middle = heading - bend / 2
                position = position + step * np.array([math.cos(middle), math.sin(middle)])
                heading -= bend
                rows.append(position)
        return np.array(rows)

    def _fields(self) -> None:
        """Rasters of depth and girth about the profile."""
        low, high = self.points.min(0) - BEYOND, self.points.max(0) + BEYOND
        u, v = np.arange(low[0], high[0], GRID), np.arange(low[1], high[1], GRID)
        self._low = low
        nodes = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
        nearest = KDTree(self.points).query(nodes)[1]
        away, normal = nodes - self.points[nearest], self.normals[nearest]
        self._depth = (away * normal).sum(-1).astype(np.float32)
        along = away[..., 0] * normal[..., 1] - away[..., 1] * normal[..., 0]
        self._girth = (self.t[nearest] + np.clip(along, -STEP, STEP)).astype(np.float32)

    def depth(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """Distance from the profile, positive inside."""
        return self._look(self._depth, u, v)

    def girth(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """Position along the profile of the foot of the perpendicular."""
        return self._look(self._girth, u, v)

    def _look(self, field: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
        where = np.stack([(u - self._low[0]) / GRID, (v - self._low[1]) / GRID])
        return np.asarray(ndimage.map_coordinates(field, where, output=np.float64, order=1, mode="nearest"))

    def at(self, t: FloatArray, depth: FloatArray | float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Offset and height of positions on the lining, moved inward by `depth`."""
        normal_u, normal_v = self.normal(t)
        u = np.interp(t, self.t, self.points[:, 0]) + depth * normal_u
        return u, np.interp(t, self.t, self.points[:, 1]) + depth * normal_v

    def normal(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Inward normal at positions on the lining."""
        return np.interp(t, self.t, self.normals[:, 0]), np.interp(t, self.t, self.normals[:, 1])

    def wall(self, height: float) -> float:
        """Girth (of the right side, positive) at which the lining has a height over the floor."""
        right = self.t > 0
        return float(np.interp(-height, -self.points[right, 1], self.t[right]))
