"""Voxels of scans with their moments: which are neighbours, and the plane about each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.compiled import kernel
from tunneldb.geometry.normals import eigenvalues, normal
from tunneldb.threads import in_blocks

AXIS_BITS = 17
"""Bits of a voxel's place along an axis in its key; the scan number is in the bits above."""

TURNS = 2
"""Number of rounds in which voxels off the plane of a neighbourhood are excluded from it."""

_BLOCK = 1 << 14


@dataclass(frozen=True)
class VoxelGrid:
    """Voxels with their moments, in the order of their keys.

    Attributes
    ----------
    edge : float
        m.
    origin : (3,) float array
        Origin of places, m.
    keys : (n,) int64 array
        Scan and place.
    moments : (n, 10) float array
        Number, x, y, z, xx, yy, zz, xy, xz, yz of the points, summed, about the origin, m.
    """

    edge: float
    origin: Float
    keys: Int64
    moments: Float

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def scan(self) -> Int64:
        """Scan of each voxel."""
        return self.keys >> (3 * AXIS_BITS)

    @property
    def centroids(self) -> Float:
        """Mean of the points in each, (n, 3), m from the origin."""
        return np.ascontiguousarray(self.moments[:, 1:4] / self.moments[:, :1])

    def neighbours(self) -> tuple[Int64, Int32]:
        """Return the touching voxels of the same scan: begin of each voxel's list (n + 1,), and their numbers."""
        starts = np.zeros(len(self) + 1, np.int64)
        _count_neighbours(self.keys, starts)
        np.cumsum(starts, out=starts)
        found = np.empty(starts[-1], np.int32)
        _list_neighbours(self.keys, starts, found)
        return starts, found


@dataclass(frozen=True)
class VoxelPlanes:
    """The plane about each voxel.

    Attributes
    ----------
    normal : (n, 3) float array
        Unit normal, towards the scanner; zero without one.
    rms : (n,) float array
        Distance of the points of the neighbourhood from it, m.
    variation : (n,) float array
        Least eigenvalue by the sum of all (Pauly et al., 2002).
    support : (n,) float array
        Points that it rests on.
    """

    normal: Float
    rms: Float
    variation: Float
    support: Float


def voxel_planes(grid: VoxelGrid, starts: Int64, neighbours: Int32, stations: Float, noise: float) -> VoxelPlanes:
    """Fit planes to the neighbourhoods of voxels, robustly.

    The plane of a voxel is that of its own neighbourhood or of an adjacent one that contains it and fits better, so that
    normals stay sharp at creases (Kuwahara et al., 1976, choose a pixel's window in this way).

    Parameters
    ----------
    grid, starts, neighbours
        Voxels, and which touch.
    stations : (k, 3) float array
        Scanner positions, by scan, m from the origin of the grid.
    noise : float
        Neighbours farther than three times this off the plane are left out, m.
    """
    n = len(grid)
    fitted, rms, variation, support = np.zeros((n, 3)), np.full(n, np.inf), np.ones(n), np.zeros(n)
    centroid, scan = grid.centroids, grid.scan
    in_blocks(
        lambda begin, end: _fit(
            grid.moments, centroid, starts, neighbours, 3.0 * noise, fitted, rms, variation, support, begin, end
        ),
        n,
        _BLOCK,
    )
    best = np.empty(n, np.int64)
    in_blocks(lambda begin, end: _choose(centroid, starts, neighbours, fitted, rms, 2.0 * noise, best, begin, end), n, _BLOCK)
    chosen = fitted[best]
    towards = stations[scan] - centroid
    chosen[np.einsum("ni,ni->n", chosen, towards) < 0.0] *= -1.0
    return VoxelPlanes(chosen, rms[best], variation[best], support[best])


@kernel
def _count_neighbours(keys: Int64, starts: Int64) -> None:  # pragma: no cover - compiled
    # For a given step, the key looked for grows with the voxel's own: one walk along the sorted keys finds all.
    n = keys.shape[0]
    for column in range(9):
        step = ((column // 3 - 1) << 34) + ((column % 3 - 1) << 17)
        p = 0
        for i in range(n):
            low = keys[i] + step - 1
            while p < n and keys[p] < low:
                p += 1
            q = p
            while q < n and keys[q] <= low + 2:
                if q != i:
                    starts[i + 1] += 1
                q += 1


@kernel
def _list_neighbours(keys: Int64, starts: Int64, found: Int32) -> None:  # pragma: no cover - compiled
    n = keys.shape[0]
    at = starts[:-1].copy()
    for column in range(9):
        step = ((column // 3 - 1) << 34) + ((column % 3 - 1) << 17)
        p = 0
        for i in range(n):
            low = keys[i] + step - 1
            while p < n and keys[p] < low:
                p += 1
            q = p
            while q < n and keys[q] <= low + 2:
                if q != i:
                    found[at[i]] = q
                    at[i] += 1
                q += 1


@kernel
def _fit(
    moments: Float, centroid: Float, starts: Int64, neighbours: Int32, far: float,
    fitted: Float, rms: Float, variation: Float, support: Float, begin: int, end: int,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    total = np.empty(10)
    for i in range(begin, end):
        nx, ny, nz, d = 0.0, 0.0, 0.0, 0.0
        for turn in range(TURNS + 1):
            total[:] = moments[i]
            held = 1
            for e in range(starts[i], starts[i + 1]):
                j = neighbours[e]
                if turn > 0:
                    off = nx * centroid[j, 0] + ny * centroid[j, 1] + nz * centroid[j, 2] - d
                    if abs(off) > far:
                        continue
                for k in range(10):
                    total[k] += moments[j, k]
                held += 1
            n = total[0]
            if n < 6.0 or held < 3:
                break
            x, y, z = total[1] / n, total[2] / n, total[3] / n
            xx, yy, zz = total[4] / n - x * x, total[5] / n - y * y, total[6] / n - z * z
            xy, xz, yz = total[7] / n - x * y, total[8] / n - x * z, total[9] / n - y * z
            least, middle, most = eigenvalues(xx, yy, zz, xy, xz, yz)
            if not middle > 4.0 * least:  # no plane
                break
            nx, ny, nz = normal(xx, yy, zz, xy, xz, yz, least)
            d = nx * x + ny * y + nz * z
            fitted[i, 0], fitted[i, 1], fitted[i, 2] = nx, ny, nz
            support[i] = n
            rms[i] = np.sqrt(max(least, 0.0) * n / max(n - 3.0, 1.0))
            variation[i] = max(least, 0.0) / (least + middle + most)


@kernel
def _choose(
    centroid: Float, starts: Int64, neighbours: Int32, fitted: Float, rms: Float, near: float, best: Int64,
    begin: int, end: int,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    for i in range(begin, end):
        best[i] = i
        for e in range(starts[i], starts[i + 1]):
            j = neighbours[e]
            if rms[j] < 0.7 * rms[best[i]]:
                off = 0.0
                for k in range(3):
                    off += fitted[j, k] * (centroid[i, k] - centroid[j, k])
                if abs(off) < near:
                    best[i] = j
