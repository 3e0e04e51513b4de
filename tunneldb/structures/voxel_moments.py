"""Moments of the points in each voxel of each scan, summed in one pass, independent of the order.

A voxel stores the number of its points, their sum and the sum of their products (planes and their residuals follow from
these, and those of a neighbourhood are sums). All are whole numbers of `QUANTUM`, so the result does not depend on the order of
points or threads. Voxels of several scans are separate: one scan sees one side of a plate, and scans that do not fit to the
millimetre are fitted separately.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.errors import UserError
from tunneldb.structures.voxel_grid import AXIS_BITS, VoxelGrid

QUANTUM = 2.0**-14
"""Step of coordinates, m: 0.06 mm."""

FINEST = 7
"""Edge of the finest voxels is 2^-FINEST m, 7.8 mm: two to three points of a dense scan."""

COARSEST = 2
"""Edge of the coarsest is 2^-COARSEST m."""

MAX_VOXELS = 3_000_000
"""Maximum number of voxels in memory; beyond it the next coarser ones are used."""

SCANS = 1 << 10
"""Maximum number of scans."""

_HALF = 1 << (AXIS_BITS - 1)
_MASK = (1 << AXIS_BITS) - 1
REACH = _HALF * 2.0**-FINEST
"""Maximum distance of points from the middle of the scanner positions along an axis, m; others are ignored."""

_ROOM = 1 << 16


class VoxelMoments:
    """Moments of the points in each voxel, scan by scan.

    Parameters
    ----------
    middle : (3,) float array
        About where voxels are numbered, m: the middle of the scanner's positions.

    Attributes
    ----------
    level : int
        The edge of a voxel is 2^-level m.
    points, far : int
        Points added, and those left out for lying farther than `REACH` from the middle.
    """

    def __init__(self, middle: Float) -> None:
        self.origin: Float = np.round(np.asarray(middle, np.float64)).astype(np.float64)
        self.level = FINEST
        self.points = 0
        self.far = 0
        self._size = 0
        self._keys = np.empty(_ROOM, np.int64)
        self._sums = np.zeros((_ROOM, 10), np.int64)
        self._table = np.full(4 * _ROOM, -1, np.int32)

    def __len__(self) -> int:
        return self._size

    def add(self, xyz: Float, scan: Int32) -> None:
        """Add points (n, 3), m, of scans (n,) from 0 to `SCANS` - 1."""
        if not len(self._table):
            raise ValueError("points were complete")
        xyz = np.ascontiguousarray(xyz, np.float64)
        scan = np.ascontiguousarray(scan, np.int32)
        self.points += len(xyz)
        done = 0
        while True:
            done, self._size, far = _add(
                xyz, scan, self.origin, self.level, done, self._size, self._keys, self._sums, self._table
            )
            self.far += far
            if done == len(xyz):
                return
            self._make_room()

    def complete(self) -> None:
        """Free the memory for further points; none can be added afterwards."""
        self._table = np.empty(0, np.int32)
        self._keys.resize(self._size, refcheck=False)
        self._sums.resize((self._size, self._sums.shape[1]), refcheck=False)

    def grid(self, level: int) -> VoxelGrid:
        """Return voxels with an edge of 2^-level m, no finer than those stored, in the order of scans and places."""
        keys, sums = self._keys[: self._size], self._sums[: self._size]
        keys, sums = _coarser_by(keys, sums, self.level, level)
        return VoxelGrid(2.0**-level, self.origin, keys, _metres(keys, sums, level))

    def within(self, grid: VoxelGrid, level: int, wanted: Bool, finer: int) -> tuple[VoxelGrid, Int64]:
        """Return the finer voxels inside some voxels of a grid, and the voxel of each.

        Parameters
        ----------
        grid : VoxelGrid
        level : int
            Its voxels have an edge of 2^-level m.
        wanted : (n,) bool array
            Indices of their voxels.
        finer : int
            The finer ones have an edge of 2^-finer m, no finer than those kept.
        """
        place = np.searchsorted(grid.keys, _above(self._keys[: self._size], self.level - level))
        chosen = np.flatnonzero(wanted[place])
        keys, sums = _coarser_by(self._keys[chosen], self._sums[chosen], self.level, finer)
        found = VoxelGrid(2.0**-finer, self.origin, keys, _metres(keys, sums, finer))
        return found, np.searchsorted(grid.keys, _above(keys, finer - level))

    def counts(self, level: int) -> Int64:
        """Return the points in each voxel with an edge of 2^-level m."""
        keys, count = self._keys[: self._size], self._sums[: self._size, 0]
        for _ in range(level, self.level):
            keys, place = np.unique(parents(keys), return_inverse=True)
            count = np.bincount(place, count, len(keys)).astype(np.int64)
        return count

    def _make_room(self) -> None:
        if self._size < MAX_VOXELS:
            room = min(len(self._keys) + len(self._keys) // 2, MAX_VOXELS)
            for name in ("_keys", "_sums"):
                old = getattr(self, name)
                new = np.zeros((room, *old.shape[1:]), old.dtype)
                new[: self._size] = old[: self._size]
                setattr(self, name, new)
                del old
        elif self.level > COARSEST:
            keys, sums = _coarser(self._keys[: self._size], self._sums[: self._size], self.level)
            self.level -= 1
            self._size = len(keys)
            self._keys[: len(keys)], self._sums[: len(keys)] = keys, sums
            self._sums[len(keys) :] = 0
        else:
            raise UserError(
                f"more than {MAX_VOXELS:,} voxels of {2.0**-COARSEST:g} m have points, too many for a structure; cut the file"
            )
        size = len(self._table)
        while size < 2 * len(self._keys):
            size *= 2
        self._table = np.full(size, -1, np.int32)
        _enter(self._keys, self._size, self._table)


def parents(keys: Int64) -> Int64:
    """Return the keys of the voxels twice as large around voxels."""
    scan, axes = keys >> (3 * AXIS_BITS), [(keys >> (AXIS_BITS * k)) & _MASK for k in (2, 1, 0)]
    x, y, z = (((axis - _HALF) >> 1) + _HALF for axis in axes)
    return np.asarray((((scan << AXIS_BITS | x) << AXIS_BITS | y) << AXIS_BITS) | z)


def _above(keys: Int64, times: int) -> Int64:
    """Return the keys of larger voxels around voxels, doubled so many times."""
    for _ in range(times):
        keys = parents(keys)
    return keys


def split_keys(keys: Int64) -> tuple[Int64, Int64]:
    """Scan (n,) and place (n, 3), in edges from the origin, of voxels."""
    places = [((keys >> (AXIS_BITS * k)) & _MASK) - _HALF for k in (2, 1, 0)]
    return keys >> (3 * AXIS_BITS), np.column_stack(places)


def _coarser_by(keys: Int64, sums: Int64, level: int, wanted: int) -> tuple[Int64, Int64]:
    """Combine moments into voxels with an edge of 2^-wanted m, in the order of their keys, from those of 2^-level m."""
    if level == wanted:
        order = np.argsort(keys)
        return keys[order], sums[order]
    for finer in range(level, wanted, -1):
        keys, sums = _coarser(keys, sums, finer)
    return keys, sums


def _coarser(keys: Int64, sums: Int64, level: int) -> tuple[Int64, Int64]:
    """Combine moments into voxels twice as large, in the order of their keys, from those with an edge of 2^-level m."""
    above = parents(keys)
    order = np.argsort(above, kind="stable")
    count = int(np.count_nonzero(np.diff(above[order]))) + 1 if len(above) else 0
    coarse, total = np.empty(count, np.int64), np.zeros((count, 10), np.int64)
    _put_together(keys, sums, above, order, round(2.0**-level / QUANTUM), coarse, total)
    return coarse, total


def _metres(keys: Int64, sums: Int64, level: int) -> Float:
    """Return moments (n, 10) about the origin, m and m²: number, x, y, z, xx, yy, zz, xy, xz, yz."""
    corner = split_keys(keys)[1] * 2.0**-level + 0.5 * QUANTUM
    out = sums.astype(np.float64)
    n, s = out[:, 0], out[:, 1:4] * QUANTUM
    out[:, 1:4] = s + n[:, None] * corner
    for k, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        out[:, 4 + k] = (
            out[:, 4 + k] * QUANTUM**2 + corner[:, a] * s[:, b] + corner[:, b] * s[:, a] + n * corner[:, a] * corner[:, b]
        )
    return out


@inner
def voxel_key(x: float, y: float, z: float, scan: int, per_metre: float) -> int:  # pragma: no cover - compiled
    """Return the key of the voxel of a place relative to the origin; -1 out of range."""
    half = 1 << 16
    if not (abs(x) < 1e6 and abs(y) < 1e6 and abs(z) < 1e6):
        return -1
    i, j, k = math.floor(x * per_metre) + half, math.floor(y * per_metre) + half, math.floor(z * per_metre) + half
    if min(i, j, k) < 1 or max(i, j, k) >= 2 * half - 1:
        return -1
    return ((((scan << 17) | i) << 17 | j) << 17) | k


@inner
def find_slot(key: int, keys: Int64, table: Int32) -> int:  # pragma: no cover - compiled
    """Return the slot of a table with the place of a key among keys, or the empty one (-1) where it belongs."""
    mask = np.uint64(table.shape[0] - 1)
    h = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    at = (h ^ (h >> np.uint64(32))) & mask
    while table[at] >= 0 and keys[table[at]] != key:
        at = (at + np.uint64(1)) & mask
    return np.int64(at)  # type: ignore[return-value]  # to Numba it is an int


@kernel
def _put_together(
    keys: Int64, sums: Int64, above: Int64, order: Int64, step: int, coarse: Int64, total: Int64
) -> None:  # pragma: no cover - compiled
    """Add the moments of voxels, in the order of those twice as large, up about the corners of these."""
    at = -1
    for m in range(order.shape[0]):
        i = order[m]
        if at < 0 or coarse[at] != above[i]:
            at += 1
            coarse[at] = above[i]
        n, row, out = sums[i, 0], sums[i], total[at]
        x, y, z = ((keys[i] >> 34) & 1) * step, ((keys[i] >> 17) & 1) * step, (keys[i] & 1) * step
        out[0] += n
        out[1] += row[1] + n * x
        out[2] += row[2] + n * y
        out[3] += row[3] + n * z
        out[4] += row[4] + 2 * x * row[1] + n * x * x
        out[5] += row[5] + 2 * y * row[2] + n * y * y
        out[6] += row[6] + 2 * z * row[3] + n * z * z
        out[7] += row[7] + x * row[2] + y * row[1] + n * x * y
        out[8] += row[8] + x * row[3] + z * row[1] + n * x * z
        out[9] += row[9] + y * row[3] + z * row[2] + n * y * z


@kernel
def _enter(keys: Int64, size: int, table: Int32) -> None:  # pragma: no cover - compiled
    for i in range(size):
        table[find_slot(keys[i], keys, table)] = i


@kernel
def _add(
    xyz: Float, scan: Int32, origin: Float, level: int, done: int, size: int, keys: Int64, sums: Int64, table: Int32
) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Add points from ``done`` on until there is no room for another voxel: how far it came, voxels, points left out."""
    per_metre, far = 2.0**level, 0
    edge = 16384 >> level
    for i in range(done, xyz.shape[0]):
        x, y, z = xyz[i, 0] - origin[0], xyz[i, 1] - origin[1], xyz[i, 2] - origin[2]
        # Numbered in the finest voxels, whatever their size now, so that what is left out does not depend on it.
        if voxel_key(x, y, z, scan[i], 128.0) < 0:
            far += 1
            continue
        key = voxel_key(x, y, z, scan[i], per_metre)
        slot = find_slot(key, keys, table)
        if table[slot] < 0:
            if size == keys.shape[0]:
                return i, size, far
            table[slot] = size
            keys[size] = key
            size += 1
        k = table[slot]
        a = np.int64(math.floor(x * 16384.0)) - np.int64(math.floor(x * per_metre)) * edge
        b = np.int64(math.floor(y * 16384.0)) - np.int64(math.floor(y * per_metre)) * edge
        c = np.int64(math.floor(z * 16384.0)) - np.int64(math.floor(z * per_metre)) * edge
        row = sums[k]
        row[0] += 1
        row[1] += a
        row[2] += b
        row[3] += c
        row[4] += a * a
        row[5] += b * b
        row[6] += c * c
        row[7] += a * b
        row[8] += a * c
        row[9] += b * c
    return xyz.shape[0], size, far


@kernel
def find_voxels(
    xyz: Float, scan: Int32, origin: Float, per_metre: float, keys: Int64, table: Int32, out: Int64, begin: int, end: int
) -> None:  # pragma: no cover - compiled
    """Write the number of the voxel of each point from begin to end; -1 without one."""
    for i in range(begin, end):
        key = voxel_key(xyz[i, 0] - origin[0], xyz[i, 1] - origin[1], xyz[i, 2] - origin[2], scan[i], per_metre)
        out[i] = -1
        if key >= 0:
            out[i] = table[find_slot(key, keys, table)]


def key_table(keys: Int64) -> Int32:
    """Return the table in which `find_voxels` looks up keys."""
    table = np.full(1 << max(10, (2 * len(keys)).bit_length()), -1, np.int32)
    _enter(keys, len(keys), table)
    return table
