"""Cells of space whose points don't lie on a plane: all that need be kept of a scan in which spheres are sought.

Walls and floor make up nine tenths of a scan. A window of 2 × 2 × 2 cells with edges of one diameter holds every sphere
whole, wherever it stands; what lies in it beside a sphere, or a sphere by itself, is far from flat. Only cells of such
windows are kept. Sums are enough to tell, so one pass through the files does it, in memory that grows with the surface
and not with the points.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Int32, Int64, Single
from tunneldb.geometry.normals import eigenvalues
from tunneldb.pointcloud.voxels import CellCounts

FLAT = 0.08
"""Windows whose points scatter less about their best plane, in radii, hold no sphere: a fifth of one scatters by 0.11."""

MOST = 1 << 16  # points of a cell that are summed up: more would say nothing new, and single precision tires


class CurvedCells:
    """Where a scan is not flat; add all points, `close` it, then ask `holds` for each point.

    Parameters
    ----------
    radius : float
        Of the spheres, m.
    points : int
        Windows with fewer points hold none.
    """

    def __init__(self, radius: float, points: int) -> None:
        self.radius = radius
        self.points = points
        self.cells = CellCounts(2.0 * radius)
        self._sums = np.zeros((1024, 10), np.float32)
        self._kept = np.empty(0, np.bool_)

    def add(self, xyz: Float) -> None:
        """Take points (n, 3) into account, m."""
        numbers = self.cells.add(np.ascontiguousarray(xyz))
        used = len(self.cells.counts)
        if used > len(self._sums):
            sums = np.zeros((2 * used, 10), np.float32)
            sums[: len(self._sums)] = self._sums
            self._sums = sums
        _sum(np.ascontiguousarray(xyz), numbers, 1.0 / self.cells.edge, self._sums)

    def close(self) -> None:
        """Find the cells that are to be kept."""
        counts, sums = self.cells.counts, self._sums[: len(self.cells.counts)]
        place = np.rint(self.cells.centres / self.cells.edge - 0.5).astype(np.int64)
        order = np.lexsort((place[:, 2], place[:, 1], place[:, 0]))
        low = place.min(axis=0) if len(place) else np.zeros(3, np.int64)
        key = _keys(place[order] - low)
        kept = _curved(place[order] - low, key, sums[order], self.points, (FLAT / 2.0) ** 2)
        self._kept = np.zeros(len(counts), np.bool_)
        self._kept[order] = kept

    def holds(self, xyz: Float) -> Bool:
        """Whether points (n, 3) lie in cells that are kept, (n,)."""
        number = self.cells.find(np.ascontiguousarray(xyz))
        return np.asarray((number >= 0) & self._kept[number])


def _keys(place: Int64) -> Int64:
    """One number of each cell, in the order of x, y, z; two more cells fit at each end of a column."""
    span = place.max(axis=0, initial=0) + 5
    return np.asarray(((place[:, 0] + 2) * span[1] + place[:, 1] + 2) * span[2] + place[:, 2] + 2)


@njit(cache=True, nogil=True)
def _sum(xyz: Float, numbers: Int32, scale: float, sums: Single) -> None:  # pragma: no cover - compiled
    for i in range(len(xyz)):
        k = numbers[i]
        if sums[k, 9] >= MOST:
            continue
        x, y, z = xyz[i, 0] * scale, xyz[i, 1] * scale, xyz[i, 2] * scale
        x, y, z = x - math.floor(x) - 0.5, y - math.floor(y) - 0.5, z - math.floor(z) - 0.5
        row = sums[k]
        row[0] += x
        row[1] += y
        row[2] += z
        row[3] += x * x
        row[4] += y * y
        row[5] += z * z
        row[6] += x * y
        row[7] += x * z
        row[8] += y * z
        row[9] += 1.0


@njit(cache=True, nogil=True, parallel=True)
def _curved(place: Int64, key: Int64, sums: Single, points: int, limit: float) -> Bool:  # pragma: no cover - compiled
    n = len(place)
    kept = np.zeros(n, np.bool_)
    if n == 0:
        return kept
    high_y, high_z = place[:, 1].max() + 5, place[:, 2].max() + 5
    for k in prange(n):
        near = np.full(27, -1, np.int64)
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                first = ((place[k, 0] + dx + 2) * high_y + place[k, 1] + dy + 2) * high_z + place[k, 2] + 1
                at = np.searchsorted(key, first)
                while at < n and key[at] <= first + 2:
                    near[((dx + 1) * 3 + dy + 1) * 3 + key[at] - first] = at
                    at += 1
        total = np.empty(10)
        for window in range(8):
            total[:] = 0.0
            for member in range(8):
                sx, sy, sz = member >> 2, (member >> 1) & 1, member & 1
                px, py, pz = (window >> 2) + sx, ((window >> 1) & 1) + sy, (window & 1) + sz
                j = near[(px * 3 + py) * 3 + pz]
                if j < 0:
                    continue
                row = sums[j]
                m = float(row[9])
                # Moments about the window's middle, where its cells meet, from those about the cell's.
                ox, oy, oz = sx - 0.5, sy - 0.5, sz - 0.5
                total[9] += m
                total[0] += row[0] + m * ox
                total[1] += row[1] + m * oy
                total[2] += row[2] + m * oz
                total[3] += row[3] + 2.0 * ox * row[0] + m * ox * ox
                total[4] += row[4] + 2.0 * oy * row[1] + m * oy * oy
                total[5] += row[5] + 2.0 * oz * row[2] + m * oz * oz
                total[6] += row[6] + ox * row[1] + oy * row[0] + m * ox * oy
                total[7] += row[7] + ox * row[2] + oz * row[0] + m * ox * oz
                total[8] += row[8] + oy * row[2] + oz * row[1] + m * oy * oz
            m = total[9]
            if m < points:
                continue
            x, y, z = total[0] / m, total[1] / m, total[2] / m
            least, _, _ = eigenvalues(
                total[3] / m - x * x, total[4] / m - y * y, total[5] / m - z * z,
                total[6] / m - x * y, total[7] / m - x * z, total[8] / m - y * z,
            )  # fmt: skip
            if least > limit:
                kept[k] = True
                break
    return kept
