"""Line in plan along a tunnel, with distances of points along it and to its right."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tunneldb.arrays import Float, Int32
from tunneldb.compiled import point_kernel
from tunneldb.threads import in_blocks

_APRON = 30.0  # m around the line in which the search begins at the nearest segment
_MAX_CELLS = 1 << 20
_BLOCK = 1 << 16  # points


@dataclass(frozen=True)
class PlanLine:
    """Polyline in plan, with distances of points along it and to its right.

    Neighbouring segments meet in the bisector of their angle, where both distances agree: both are continuous on either side
    of a bend. The line continues straight before the first vertex and beyond the last.

    Attributes
    ----------
    vertices : (k, 2) float array
        Vertices in plan, m.
    distance : (k,) float array
        Distance along the line at each vertex, ascending, m.
    """

    vertices: Float
    distance: Float
    _segments: Float = field(repr=False)  # x, y, direction (2), length, shear at both ends, along at both ends
    _grid: Int32 = field(repr=False)  # segment nearest to each cell's centre
    _corner: Float = field(repr=False)  # x, y of the grid and the edge of a cell

    @classmethod
    def of(cls, vertices: ArrayLike, along: ArrayLike) -> PlanLine:
        """Return the line through given vertices.

        Parameters
        ----------
        vertices : (k, 2 or 3) array
            At least two, m; heights are ignored.
        along : (k,) array
            Distance along the line at each of them (the chainage in a survey), ascending, m.

        Raises
        ------
        ValueError
            If there are fewer than two vertices, two in the same place, or distances that are not ascending.
        """
        at = np.array(vertices, dtype=np.float64)[:, :2]
        distance = np.array(along, dtype=np.float64)
        if len(at) < 2 or at.shape[0] != distance.shape[0] or not (np.isfinite(at).all() and np.isfinite(distance).all()):
            raise ValueError("a line needs at least two vertices, each with a distance along it")
        step = np.diff(at, axis=0)
        length = np.hypot(step[:, 0], step[:, 1])
        if length.min() < 1e-9 or np.diff(distance).min() <= 0.0:
            raise ValueError("vertices of a line must differ, and their distances must ascend")
        segments = np.zeros((len(step), 9))
        segments[:, 0:2] = at[:-1]
        segments[:, 2:4] = t = step / length[:, None]
        segments[:, 4] = length
        # tan of half the bend: advance of the bisector per metre to the right.
        shear = (t[:-1, 0] * t[1:, 1] - t[:-1, 1] * t[1:, 0]) / (1.0 + (t[:-1] * t[1:]).sum(axis=1))
        segments[1:, 5] = -shear
        segments[:-1, 6] = shear
        segments[:, 7], segments[:, 8] = distance[:-1], distance[1:]
        grid, corner = _nearest_segments(at, length)
        return cls(at, distance, segments, grid, corner)

    def place(self, xyz: Float) -> tuple[Float, Float]:
        """Return the distances along the line and to its right, (n,) each, of points (n, 2 or 3), m."""
        points = np.ascontiguousarray(xyz, dtype=np.float64)
        along, across = np.empty(len(points)), np.empty(len(points))

        def work(begin: int, end: int) -> None:
            block = slice(begin, end)
            _place(self._segments, self._grid, self._corner, points[block], along[block], across[block])

        in_blocks(work, len(points), _BLOCK)
        return along, across

    def point(self, along: ArrayLike, across: ArrayLike) -> Float:
        """Return coordinates (n, 2) of places on or beside the line, m: the inverse of :meth:`place`."""
        a, x = (np.atleast_1d(v).astype(np.float64) for v in np.broadcast_arrays(along, across))
        s = self._segments
        i = np.clip(np.searchsorted(self.distance, a, side="right") - 1, 0, len(s) - 1)
        share = (a - s[i, 7]) / (s[i, 8] - s[i, 7])
        first, last = x * s[i, 5], s[i, 4] + x * s[i, 6]
        ahead = first + share * (last - first)
        return np.column_stack([s[i, 0] + ahead * s[i, 2] + x * s[i, 3], s[i, 1] + ahead * s[i, 3] - x * s[i, 2]])


def _nearest_segments(vertices: Float, length: Float) -> tuple[Int32, Float]:
    """Return the segment nearest to the centre of each cell of a grid around the line, and the position of the grid."""
    low, high = vertices.min(axis=0) - _APRON, vertices.max(axis=0) + _APRON
    edge = max(5.0, float(np.sqrt((high - low).prod() / _MAX_CELLS)))
    shape = np.ceil((high - low) / edge).astype(int)
    x, y = (low[k] + edge * (np.arange(shape[k]) + 0.5) for k in range(2))
    cells = np.column_stack([g.ravel() for g in np.meshgrid(x, y, indexing="xy")])
    parts = np.ceil(length / edge).astype(int)
    which = np.repeat(np.arange(len(length)), parts)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / np.repeat(parts, parts)
    samples = vertices[which] + share[:, None] * (vertices[which + 1] - vertices[which])
    nearest = cKDTree(samples).query(cells)[1]
    grid = which[nearest].reshape(shape[1], shape[0]).astype(np.int32)
    return grid, np.array([low[0], low[1], edge])


@point_kernel
def _place(
    s: Float, grid: Int32, corner: Float, points: Float, along: Float, across: Float
) -> None:  # pragma: no cover - compiled
    """Locate points, searching from the segment nearest to the centre of each one's cell."""
    last = s.shape[0] - 1
    for n in range(points.shape[0]):
        x, y = points[n, 0], points[n, 1]
        column = min(max(int((x - corner[0]) / corner[2]), 0), grid.shape[1] - 1)
        row = min(max(int((y - corner[1]) / corner[2]), 0), grid.shape[0] - 1)
        i = int(grid[row, column])
        way = 0
        while True:
            dx, dy = x - s[i, 0], y - s[i, 1]
            ahead = dx * s[i, 2] + dy * s[i, 3]
            right = dx * s[i, 3] - dy * s[i, 2]
            low, high = right * s[i, 5], s[i, 4] + right * s[i, 6]
            if high - low < 0.1 * s[i, 4]:  # beyond the centre of the bend
                low, high = 0.0, s[i, 4]
            share = (ahead - low) / (high - low)
            if share < 0.0 and i > 0 and way <= 0:
                i -= 1
                way = -1
            elif share > 1.0 and i < last and way >= 0:
                i += 1
                way = 1
            else:
                along[n] = s[i, 7] + share * (s[i, 8] - s[i, 7])
                across[n] = right
                break
