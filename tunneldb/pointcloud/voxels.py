"""Points gathered in voxels: an even, thin picture of a cloud of any size, in one pass (Li et al. 2023, section 2.1)."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Float, Int64, UInt32, UInt64

_BITS = 21  # of a voxel's number along each axis
_HALF = 1 << (_BITS - 1)
_FINE = 1024  # steps of a voxel's edge in which places are summed: exact whole numbers
_MOST = (1 << 22) - 1  # points of a voxel that are summed; more would not move its centroid
_ROOM = 1 << 16  # voxels, to begin with
_EMPTY = np.uint32(0xFFFFFFFF)


class Voxels:
    """Voxels of a cloud that comes chunk by chunk; what they hold does not depend on the chunks.

    They stand at whole multiples of their edge. Sums are whole numbers of edge / 1024, so that no order of
    summation shows. A voxel takes 32 bytes and 5 to 11 of the table that finds it.

    Parameters
    ----------
    edge : float
        Edge of a voxel, m.
    """

    def __init__(self, edge: float) -> None:
        if not edge > 0.0:
            raise ValueError(f"edge of a voxel is {edge:g} m: it must be above 0")
        self.edge = edge
        self._base: Int64 | None = None
        self._size = 0
        self._key = np.empty(_ROOM, np.int64)
        self._count = np.zeros(_ROOM, np.uint32)
        self._sum = np.zeros((_ROOM, 3), np.uint32)
        self._square = np.zeros(_ROOM, np.uint64)
        self._table = np.full(2 * _ROOM, _EMPTY, np.uint32)

    def __len__(self) -> int:
        return self._size

    def add(self, xyz: Float) -> None:
        """Add points (n, 3), m; those that are not finite are left out.

        Raises
        ------
        ValueError
            A point lies more than a million voxels from the first.
        """
        points = np.asarray(xyz, dtype=np.float64)
        if self._base is None:
            finite = np.flatnonzero(np.isfinite(points).all(axis=1))
            if not len(finite):
                return
            self._base = np.floor(points[finite[0]] / self.edge).astype(np.int64)
        begin = 0
        while begin < len(points):
            done, self._size = _add(
                points[begin:], self.edge, self._base, self._size, self._key, self._count, self._sum, self._square, self._table
            )
            if done < 0:
                raise ValueError("points lie farther apart than a million voxels: part them, or take larger voxels")
            begin += done
            if begin < len(points):
                self._grow()

    def centroids(self) -> Float:
        """Mean of the points in each voxel, (n, 3), m, in the order in which the voxels were first met."""
        n = self._size
        if self._base is None:
            return np.empty((0, 3))
        out = np.empty((n, 3))
        _centroids(self._key[:n], self._count[:n], self._sum[:n], self.edge, self._base, out)
        return out

    def counts(self) -> Int64:
        """Number of points in each voxel, (n,)."""
        return self._count[: self._size].astype(np.int64)

    def spread(self) -> Float:
        """Standard deviation of the heights of the points in each voxel, (n,), m."""
        n = self._size
        count = np.minimum(self._count[:n], _MOST).astype(np.float64)
        mean = self._sum[:n, 2] / count
        variance = self._square[:n] / count - mean * mean
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)) * (self.edge / _FINE))

    def index(self, xyz: Float) -> Int64:
        """Number of the voxel that holds each of the points (n, 3), -1 where there is none."""
        points = np.asarray(xyz, dtype=np.float64)
        out = np.full(len(points), -1, np.int64)
        if self._base is not None:
            _index(points, self.edge, self._base, self._key, self._table, out)
        return out

    def _grow(self) -> None:
        room = len(self._key) + len(self._key) // 2
        for name in ("_key", "_count", "_sum", "_square"):
            old = getattr(self, name)
            new = np.zeros((room, *old.shape[1:]), old.dtype)
            new[: self._size] = old[: self._size]
            setattr(self, name, new)
            del old
        size = len(self._table)
        while size < 1.33 * room:
            size *= 2
        if size > len(self._table):
            self._table = np.full(size, _EMPTY, np.uint32)
            _rehash(self._key, self._size, self._table)


@njit(cache=True, nogil=True, inline="always")
def _key_of(x: float, y: float, z: float, edge: float, base: Int64) -> int:
    """Number of a point's voxel, -1 beyond what can be numbered, -2 where the point is not finite."""
    fx, fy, fz = np.floor(x / edge), np.floor(y / edge), np.floor(z / edge)
    if not (np.isfinite(fx) and np.isfinite(fy) and np.isfinite(fz)):
        return -2
    i, j, k = fx - base[0] + _HALF, fy - base[1] + _HALF, fz - base[2] + _HALF
    top = 2.0 * _HALF
    if i < 0 or j < 0 or k < 0 or i >= top or j >= top or k >= top:
        return -1
    return (int(i) << (2 * _BITS)) | (int(j) << _BITS) | int(k)


@njit(cache=True, nogil=True, inline="always")
def _slot(key: int, keys: Int64, table: UInt32) -> int:
    """Slot of the table that holds a key, or the empty one where it belongs."""
    mask = np.uint64(table.shape[0] - 1)
    h = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    at = (h ^ (h >> np.uint64(32))) & mask
    while table[at] != _EMPTY and keys[table[at]] != key:
        at = (at + np.uint64(1)) & mask
    return int(at)


@njit(cache=True, nogil=True)
def _add(
    points: Float, edge: float, base: Int64, size: int, keys: Int64, count: UInt32, total: UInt32,
    square: UInt64, table: UInt32,
) -> tuple[int, int]:  # pragma: no cover - compiled  # fmt: skip
    """Add points until there is no room for another voxel: how many, and the number of voxels; -1: out of bounds."""
    for n in range(points.shape[0]):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        key = _key_of(x, y, z, edge, base)
        if key < 0:
            if key == -1:
                return -1, size
            continue
        slot = _slot(key, keys, table)
        if table[slot] == _EMPTY:
            if size == keys.shape[0]:
                return n, size
            table[slot] = np.uint32(size)
            keys[size] = key
            size += 1
        i = table[slot]
        count[i] += np.uint32(1)
        if count[i] > _MOST:
            continue
        last = _FINE - 1
        total[i, 0] += np.uint32(min(int((x / edge - np.floor(x / edge)) * _FINE), last))
        total[i, 1] += np.uint32(min(int((y / edge - np.floor(y / edge)) * _FINE), last))
        up = min(int((z / edge - np.floor(z / edge)) * _FINE), last)
        total[i, 2] += np.uint32(up)
        square[i] += np.uint64(up * up)
    return points.shape[0], size


@njit(cache=True, nogil=True)
def _rehash(keys: Int64, size: int, table: UInt32) -> None:  # pragma: no cover - compiled
    for i in range(size):
        table[_slot(keys[i], keys, table)] = np.uint32(i)


@njit(cache=True, nogil=True, parallel=True)
def _centroids(
    keys: Int64, count: UInt32, total: UInt32, edge: float, base: Int64, out: Float
) -> None:  # pragma: no cover - compiled
    mask = (1 << _BITS) - 1
    for n in prange(keys.shape[0]):
        number = min(count[n], np.uint32(_MOST))
        for axis in range(3):
            cell = ((keys[n] >> (_BITS * (2 - axis))) & mask) - _HALF + base[axis]
            out[n, axis] = (cell + (total[n, axis] / number + 0.5) / _FINE) * edge


@njit(cache=True, nogil=True, parallel=True)
def _index(
    points: Float, edge: float, base: Int64, keys: Int64, table: UInt32, out: Int64
) -> None:  # pragma: no cover - compiled
    for n in prange(points.shape[0]):
        key = _key_of(points[n, 0], points[n, 1], points[n, 2], edge, base)
        if key >= 0:
            slot = _slot(key, keys, table)
            if table[slot] != _EMPTY:
                out[n] = table[slot]
