"""Cells of space whose points are not on a plane: the only part of a scan needed for finding spheres.

Walls and floor make up nine tenths of a scan. A window of 2 × 2 × 2 cells with edges of one diameter contains every sphere
completely, wherever it is; a sphere with or without its surroundings is far from flat. Only cells of such windows are kept.
Sums are sufficient, so one pass through the files is enough, in memory that grows with the surface and not with the points.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64, Single
from tunneldb.compiled import kernel
from tunneldb.geometry.normals import least_eigenvalues
from tunneldb.pointcloud.voxels import CellCounts

MIN_SCATTER = 0.08
"""Minimum scatter of a window's points about their best plane, in radii: a fifth of a sphere scatters by 0.11."""

MAX_CELL_POINTS = 1 << 16  # maximum points of a cell that are summed: more add nothing and lose single precision
_BLOCK = 1 << 13  # windows at a time
_CORNERS = list(np.ndindex(2, 2, 2))  # cells of a window


class CurvedCells:
    """Cells of a scan that are not flat; add all points, `close` it, then ask `holds` for each point.

    Parameters
    ----------
    radius : float
        Radius of the spheres, m.
    points : int
        Minimum number of points of a window.
    """

    def __init__(self, radius: float, points: int) -> None:
        self.radius = radius
        self.points = points
        self.cells = CellCounts(2.0 * radius)
        self._sums = np.zeros((1024, 10), np.float32)
        self._kept = np.empty(0, np.bool_)

    def add(self, xyz: Float) -> None:
        """Add points (n, 3), m."""
        xyz = np.ascontiguousarray(xyz, np.float64)
        numbers = self.cells.add(xyz)
        used = len(self.cells.counts)
        if used > len(self._sums):
            sums = np.zeros((2 * used, 10), np.float32)
            sums[: len(self._sums)] = self._sums
            self._sums = sums
        _add(xyz, numbers, self.cells.edge, self._sums)

    def close(self) -> None:
        """Find the cells to keep."""
        counts, sums = self.cells.counts, self._sums[: len(self.cells.counts)]
        place = np.rint(self.cells.centres / self.cells.edge - 0.5).astype(np.int64)
        order = np.lexsort((place[:, 2], place[:, 1], place[:, 0]))
        low = place.min(axis=0) if len(place) else np.zeros(3, np.int64)
        self._kept = np.zeros(len(counts), np.bool_)
        self._kept[order] = _curved(place[order] - low, sums[order], self.points, (MIN_SCATTER / 2.0) ** 2)

    def holds(self, xyz: Float) -> Bool:
        """Return True for points (n, 3) in cells to keep, (n,)."""
        number = self.cells.find(xyz)
        return np.asarray((number >= 0) & self._kept[number])


def _keys(place: Int64) -> tuple[Int64, int, int, int]:
    """Return one number for each cell, in the order of x, y, z, and its increments along each.

    Two more cells fit at each end of a column.
    """
    _, wide, tall = place.max(axis=0, initial=0) + 5
    return np.asarray(((place[:, 0] + 2) * wide + place[:, 1] + 2) * tall + place[:, 2] + 2), int(wide * tall), int(tall), 1


def _curved(place: Int64, sums: Single, points: int, limit: float) -> Bool:
    """Return True for cells (n,) in a window that is not flat.

    Parameters
    ----------
    place : (n, 3) int array
        Cells, in the order of x, y, z, from 0 on.
    sums : (n, 10) float array
        Sums of x, y, z, x², y², z², xy, xz, yz about the middle of each cell, in edges, and of 1, over its points.
    points : int
        Windows with fewer points count as flat.
    limit : float
        Least eigenvalue of the covariance, in edges squared, up to which a window is flat.
    """
    key, *steps = _keys(place)
    shifts = [int(np.dot(corner, steps)) for corner in _CORNERS]
    # A window is identified by the cell at its low corner, filled or not.
    windows = np.unique(np.concatenate([key - shift for shift in shifts]))
    kept = np.zeros(len(key) + 1, np.bool_)
    moments: Float = np.hstack([sums.T.astype(np.float64), np.zeros((10, 1))])  # the last: a cell without points
    for begin in range(0, len(windows), _BLOCK):
        low = windows[begin : begin + _BLOCK]
        total, members = np.zeros((10, len(low))), np.empty((8, len(low)), np.int64)
        for corner, shift, member in zip(_CORNERS, shifts, members, strict=True):
            at = np.minimum(np.searchsorted(key, low + shift), len(key) - 1)
            member[:] = np.where(key[at] == low + shift, at, len(key))
            total += _moved(moments[:, member], np.array(corner) - 0.5)
        full = np.flatnonzero(total[9] >= points)
        means = total[:, full] / total[9, full]
        x, y, z = means[:3]
        products = np.stack([x * x, y * y, z * z, x * y, x * z, y * z])
        curved = full[least_eigenvalues((means[3:9] - products).T) > limit]
        kept[members[:, curved]] = True
    return kept[:-1]


def _moved(sums: Float, by: Float) -> Float:
    """Return sums (10, n) about a place, from those about another one at a distance of some edges (3,)."""
    out = sums.copy()
    m = sums[9]
    for axis, other, row in ((0, 0, 3), (1, 1, 4), (2, 2, 5), (0, 1, 6), (0, 2, 7), (1, 2, 8)):
        if axis == other:
            out[row] = sums[row] + 2.0 * by[axis] * sums[axis] + m * by[axis] * by[axis]
        else:
            out[row] = sums[row] + by[axis] * sums[other] + by[other] * sums[axis] + m * by[axis] * by[other]
    for axis in range(3):
        out[axis] += m * by[axis]
    return out


@kernel
def _add(xyz: Float, numbers: Int32, edge: float, sums: Single) -> None:  # pragma: no cover - compiled
    """Add points to the sums of their cells."""
    for i in range(numbers.shape[0]):
        k = numbers[i]
        if sums[k, 9] >= MAX_CELL_POINTS:
            continue
        x, y, z = xyz[i, 0] / edge, xyz[i, 1] / edge, xyz[i, 2] / edge
        x, y, z = x - math.floor(x) - 0.5, y - math.floor(y) - 0.5, z - math.floor(z) - 0.5
        sums[k, 0] += x
        sums[k, 1] += y
        sums[k, 2] += z
        sums[k, 3] += x * x
        sums[k, 4] += y * y
        sums[k, 5] += z * z
        sums[k, 6] += x * y
        sums[k, 7] += x * z
        sums[k, 8] += y * z
        sums[k, 9] += 1.0
