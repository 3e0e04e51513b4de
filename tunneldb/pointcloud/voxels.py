"""Voxels and cells of space: index of the cell of each point, found by hashing, and contents of each cell.

`CellCounts` numbers the cells of a cloud of any extent and counts their points. `Voxels` computes an even, thinned version
of a cloud in one pass (Li et al., 2023, section 2.1). Both take the cloud chunk by chunk.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, UInt8, UInt32, UInt64
from tunneldb.compiled import inner, kernel
from tunneldb.threads import in_blocks

CELL = 0.5
"""Edge of the cells in which the density of a scan is measured, m."""

_BITS = 21  # bits of a voxel's index along each axis
_INDEX_OFFSET = 1 << (_BITS - 1)
_STEPS_PER_EDGE = 1024  # steps of a voxel's edge for the sums of positions, which are integers
_MAX_SUMMED = (1 << 22) - 1  # greatest number of points summed per voxel; more would not move its centroid
_INITIAL_VOXELS = 1 << 16  # initial number of voxels
_EMPTY = np.uint32(0xFFFFFFFF)
_BLOCK = 1 << 16  # points at a time


class CellCounts:
    """Number of points in each cubic cell of space, counted chunk by chunk.

    Parameters
    ----------
    edge : float
        Edge of a cell, m; cells lie at whole multiples of it.
    room : int
        Initial number of cells.

    Attributes
    ----------
    edge : float
        Edge of a cell, m.
    """

    def __init__(self, edge: float = CELL, room: int = 1024) -> None:
        self.edge = float(edge)
        self._used = 0
        self._cells = np.empty((room, 3), np.int64)
        self._counts = np.zeros(room, np.int64)
        self._table = _table(4 * room)

    def add(self, xyz: Float) -> Int32:
        """Count points (n, 3); return the index of the cell of each, (n,), for `counts` and `centres`."""
        return self._number(xyz, True)

    def find(self, xyz: Float) -> Int32:
        """Return the index of the cell of each point (n, 3), (n,); -1 for cells without counted points."""
        return self._number(xyz, False)

    @property
    def counts(self) -> Int64:
        """Number of points in each cell, (k,)."""
        return self._counts[: self._used]

    @property
    def centres(self) -> Float:
        """Centre of each cell, (k, 3), m."""
        return np.asarray(np.multiply(self._cells[: self._used] + 0.5, self.edge, dtype=np.float64))

    def remove(self, numbers: Int32) -> None:
        """Subtract points from the counts of their cells (n,)."""
        np.subtract.at(self._counts, numbers, 1)

    def _number(self, xyz: Float, adding: bool) -> Int32:
        xyz = np.ascontiguousarray(xyz, np.float64)
        numbers = np.empty(len(xyz), np.int32)
        done = 0
        while True:
            done, self._used = _number(
                xyz, self.edge, adding, done, self._used, self._cells, self._counts, self._table, numbers
            )
            if done == len(xyz):
                return numbers
            self._grow()

    def _grow(self) -> None:
        size = 2 * len(self._cells)
        known = self._cells[: self._used] + 0.5
        self._cells = np.empty((size, 3), np.int64)
        self._table = _table(4 * size)
        counts = np.zeros(size, np.int64)
        # Cells are entered into the larger table like points at their centres.
        _number(known, 1.0, True, 0, 0, self._cells, counts, self._table, np.empty(len(known), np.int32))
        counts[: self._used] = self.counts
        self._counts = counts


def _table(min_slots: int) -> Int32:
    """Make an empty table of a power of two of slots."""
    return np.full(1 << (min_slots - 1).bit_length(), -1, np.int32)


class Voxels:
    """Voxels of a cloud that is read in chunks; the result does not depend on the chunks.

    They lie at whole multiples of their edge. Sums are integers in edge / 1024, so the order of summation does not matter. A
    voxel takes 32 bytes, and 5 to 11 in the hash table.

    Parameters
    ----------
    edge : float
        Edge of a voxel, m.
    """

    def __init__(self, edge: float) -> None:
        if not edge > 0.0:
            raise ValueError(f"the edge of a voxel is {edge:g} m, but must be above 0")
        self.edge = float(edge)
        self._base: Int64 | None = None
        self._size = 0
        self._key = np.empty(_INITIAL_VOXELS, np.int64)
        self._count = np.zeros(_INITIAL_VOXELS, np.uint32)
        self._sum = np.zeros((_INITIAL_VOXELS, 3), np.uint32)
        self._square = np.zeros(_INITIAL_VOXELS, np.uint64)
        self._table = np.full(2 * _INITIAL_VOXELS, _EMPTY, np.uint32)

    def __len__(self) -> int:
        return self._size

    def add(self, xyz: Float) -> None:
        """Add points (n, 3), m; points that are not finite are skipped.

        Raises
        ------
        ValueError
            If a point lies more than a million voxels from the first.
        """
        points = np.ascontiguousarray(xyz, dtype=np.float64)
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
                raise ValueError("points are more than a million voxels apart; divide them, or use larger voxels")
            begin += done
            if begin < len(points):
                self._grow()

    def centroids(self) -> Float:
        """Return the mean of the points in each voxel, (n, 3), m, in the order in which the voxels were first occupied."""
        n = self._size
        out = np.empty((n, 3))
        if self._base is not None:
            count, mask = np.minimum(self._count[:n], np.uint32(_MAX_SUMMED)), (1 << _BITS) - 1
            for axis in range(3):
                cell = ((self._key[:n] >> (_BITS * (2 - axis))) & mask) - _INDEX_OFFSET + self._base[axis]
                out[:, axis] = (cell + (self._sum[:n, axis] / count + 0.5) / _STEPS_PER_EDGE) * self.edge
        return out

    def counts(self) -> Int64:
        """Return the number of points in each voxel, (n,)."""
        return self._count[: self._size].astype(np.int64)

    def spread(self) -> Float:
        """Return the standard deviation of the heights of the points in each voxel, (n,), m."""
        n = self._size
        count = np.minimum(self._count[:n], _MAX_SUMMED).astype(np.float64)
        mean = self._sum[:n, 2] / count
        variance = self._square[:n] / count - mean * mean
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)) * (self.edge / _STEPS_PER_EDGE))

    def index(self, xyz: Float) -> Int64:
        """Return the index of the voxel of each of the points (n, 3), -1 if there is none."""
        points = np.ascontiguousarray(xyz, dtype=np.float64)
        out = np.full(len(points), -1, np.int64)
        if (base := self._base) is not None:
            in_blocks(
                lambda begin, end: _index(points, self.edge, base, self._key, self._table, out, begin, end), len(points), _BLOCK
            )
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
            _enter_keys(self._key, self._size, self._table)


def value_table(keys: Int64, values: UInt8) -> tuple[Int64, UInt8]:
    """Return slots for keys (n,), all different and not negative, and their values (n,), for look-up by `key_slot`."""
    slots = np.full(1 << max(10, (2 * len(keys)).bit_length()), -1, np.int64)
    stored = np.zeros(len(slots), np.uint8)
    _enter_values(keys, values, slots, stored)
    return slots, stored


@inner
def column_hash(ix: int, iy: int) -> int:  # pragma: no cover - compiled
    """Return the hash of a column of cells (Teschner et al., 2003)."""
    return (ix * 73856093) ^ (iy * 19349663)


@kernel
def _number(
    xyz: Float, edge: float, adding: bool, done: int, used: int, cells: Int64, counts: Int64, table: Int32, numbers: Int32
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Find or add the cells of points from `done` on, and count them, until the list of cells is full; return the progress.

    Without adding, points in cells that don't exist get -1, and nothing is counted.
    """
    mask = table.shape[0] - 1
    last = -1
    lx, ly, lz = 0, 0, 0
    for i in range(done, xyz.shape[0]):
        ix = math.floor(xyz[i, 0] / edge)
        iy = math.floor(xyz[i, 1] / edge)
        iz = math.floor(xyz[i, 2] / edge)
        if last < 0 or ix != lx or iy != ly or iz != lz:
            slot = (column_hash(ix, iy) ^ (iz * 83492791)) & mask
            k = table[slot]
            while k >= 0 and (cells[k, 0] != ix or cells[k, 1] != iy or cells[k, 2] != iz):
                slot = (slot + 1) & mask
                k = table[slot]
            if k < 0 and adding:
                if used == cells.shape[0]:
                    return i, used
                k = used
                cells[k, 0], cells[k, 1], cells[k, 2] = ix, iy, iz
                table[slot] = k
                used += 1
            last, lx, ly, lz = k, ix, iy, iz
        if adding:
            counts[last] += 1
        numbers[i] = last
    return xyz.shape[0], used


@inner
def _key_of(x: float, y: float, z: float, base: Int64) -> int:  # pragma: no cover - compiled
    """Return the number of the voxel of a position, in edges; -1 if out of range, -2 if the position is not finite."""
    if not (abs(x) < np.inf and abs(y) < np.inf and abs(z) < np.inf):
        return -2
    i, j, k = (
        math.floor(x) - base[0] + _INDEX_OFFSET,
        math.floor(y) - base[1] + _INDEX_OFFSET,
        math.floor(z) - base[2] + _INDEX_OFFSET,
    )
    if min(i, j, k) < 0 or max(i, j, k) >= 2 * _INDEX_OFFSET:
        return -1
    return (i << (2 * _BITS)) | (j << _BITS) | k


@inner
def _number_slot(key: int, keys: Int64, table: UInt32) -> int:  # pragma: no cover - compiled
    """Return the slot of a table that has the index of a key, or the empty slot for it."""
    mask = np.uint64(table.shape[0] - 1)
    h = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    at = (h ^ (h >> np.uint64(32))) & mask
    while table[at] != _EMPTY and keys[table[at]] != key:
        at = (at + np.uint64(1)) & mask
    return np.int64(at)  # type: ignore[return-value]  # an int for Numba


@inner
def key_slot(key: int, slots: Int64) -> np.int64:  # pragma: no cover - compiled
    """Return the slot of a key, or the empty one (-1) for it."""
    mask = slots.shape[0] - 1
    slot = np.int64((np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(32)) & mask
    while slots[slot] >= 0 and slots[slot] != key:
        slot = (slot + 1) & mask
    return slot


@kernel
def _enter_values(keys: Int64, values: UInt8, slots: Int64, stored: UInt8) -> None:  # pragma: no cover - compiled
    for i in range(keys.shape[0]):
        slot = key_slot(keys[i], slots)
        slots[slot], stored[slot] = keys[i], values[i]


@kernel
def _add(
    points: Float, edge: float, base: Int64, size: int, keys: Int64, count: UInt32, total: UInt32,
    square: UInt64, table: UInt32,
) -> tuple[int, int]:  # pragma: no cover - compiled  # fmt: skip
    """Add points until there is no space for another voxel; return how many, and the number of voxels; -1: out of bounds."""
    for n in range(points.shape[0]):
        x, y, z = points[n, 0] / edge, points[n, 1] / edge, points[n, 2] / edge
        key = _key_of(x, y, z, base)
        if key < 0:
            if key == -1:
                return -1, size
            continue
        slot = _number_slot(key, keys, table)
        if table[slot] == _EMPTY:
            if size == keys.shape[0]:
                return n, size
            table[slot] = np.uint32(size)
            keys[size] = key
            size += 1
        i = table[slot]
        count[i] += np.uint32(1)
        if count[i] > _MAX_SUMMED:
            continue
        last = _STEPS_PER_EDGE - 1
        total[i, 0] += np.uint32(min(int((x - math.floor(x)) * _STEPS_PER_EDGE), last))
        total[i, 1] += np.uint32(min(int((y - math.floor(y)) * _STEPS_PER_EDGE), last))
        up = min(int((z - math.floor(z)) * _STEPS_PER_EDGE), last)
        total[i, 2] += np.uint32(up)
        square[i] += np.uint64(up * up)
    return points.shape[0], size


@kernel
def _enter_keys(keys: Int64, size: int, table: UInt32) -> None:  # pragma: no cover - compiled
    for i in range(size):
        table[_number_slot(keys[i], keys, table)] = np.uint32(i)


@kernel
def _index(
    points: Float, edge: float, base: Int64, keys: Int64, table: UInt32, out: Int64, begin: int, end: int
) -> None:  # pragma: no cover - compiled
    for n in range(begin, end):
        key = _key_of(points[n, 0] / edge, points[n, 1] / edge, points[n, 2] / edge, base)
        if key >= 0:
            slot = _number_slot(key, keys, table)
            if table[slot] != _EMPTY:
                out[n] = table[slot]
