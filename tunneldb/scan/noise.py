"""The noise filter of Xu et al. (2018, section II-D), with a search radius that follows the scan's density.

Xu et al. judge a point to be noise when fewer than 5 points lie within a neighbourhood of 0.05 m diameter. That is
meant for a scan of a few millimetres; a sparser one would lose its walls. Here the radius is

    r = max(0.025 m, √(m / (π ρ))),   m = 20,

where ρ is the areal density of the surface near the point: a circle of this radius then holds 20 points on average,
so that a wall keeps its points (fewer than 5 of 20 expected: once in 60 000) while a stray point, with nothing near,
goes. From a density of about one point a square centimetre upwards r is 0.025 m, and the filter is the paper's.

ρ is measured in cubic cells of 0.5 m, as ρ = n / a² for a cell of edge a with n points. A plane cuts at most √2 a² out
of a cell, so ρ is too high by 1.4 at worst and the circle still holds 14 points; where the plane cuts off a corner
only, ρ is too low and the filter more lenient. Cells of 0.5 m also hold some points of each scanned profile where
profiles are that far apart, so that points lying closely along profiles survive too. A stray point in an otherwise
empty cell would by this rule get a wide radius and find the wall; therefore no radius exceeds the one of the density
that 5 % of the points of the same stretch of tunnel fall below (cells with fewer than 5 points, which hold no
surface, left out), nor one cell edge. Between static stations 40 m apart the density within 5 m of tunnel differs by
a factor of 4, which moves that limit by less than the Poisson noise of the cells.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

CELL = 0.5
EXPECTED = 20
SPARSE_SHARE = 0.05

POINTS = 5
DIAMETER = 0.05


class CellCounts:
    """Number of points in each cubic cell of space, gathered chunk by chunk.

    Attributes
    ----------
    edge : float
        Edge of a cell, m; cells lie at whole multiples of it.
    """

    def __init__(self, edge: float = CELL) -> None:
        self.edge = edge
        self._used = 0
        self._cells = np.empty((1024, 3), np.int64)
        self._counts = np.zeros(1024, np.int64)
        self._table = np.full(4096, -1, np.int32)

    def add(self, xyz: Float) -> Int32:
        """Count points (n, 3); returns the number of the cell of each, (n,), good for `counts` and `centres`."""
        numbers = np.empty(len(xyz), np.int32)
        done = 0
        while True:
            done, self._used = _count(xyz, 1.0 / self.edge, done, self._used, self._cells, self._counts, self._table, numbers)
            if done == len(xyz):
                return numbers
            self._grow()

    @property
    def counts(self) -> Int64:
        """Points in each cell, (k,)."""
        return self._counts[: self._used]

    @property
    def centres(self) -> Float:
        """Centre of each cell, (k, 3), m."""
        centres: Float = np.multiply(self._cells[: self._used] + 0.5, self.edge, dtype=np.float64)
        return centres

    def _grow(self) -> None:
        size = 2 * len(self._cells)
        self._cells = np.resize(self._cells, (size, 3))
        counts = np.zeros(size, np.int64)
        counts[: self._used] = self.counts
        self._counts = counts
        self._table = np.full(4 * size, -1, np.int32)
        _rehash(self._cells, self._used, self._table)


def search_radii(
    counts: Int64, edge: float, points: int = POINTS, diameter: float = DIAMETER, stretch: Int64 | None = None
) -> Float:
    """Search radius of the points of each cell.

    Parameters
    ----------
    counts : (k,) int64 array
        Points in each cell.
    edge : float
        Edge of a cell, m.
    points, diameter : int and float
        The filter's parameters at full density; diameter in m.
    stretch : (k,) int64 array, optional
        Number of the stretch of tunnel that each cell belongs to; the widest radius is found for each by itself.

    Returns
    -------
    (k,) float64 array
        Radii, m, at least half the diameter.
    """
    smallest = diameter / 2
    radii: Float = np.clip(_radius(counts / edge**2), smallest, max(edge, smallest))
    stretch = np.zeros(len(counts), np.int64) if stretch is None else stretch
    order = np.lexsort((counts, stretch))
    bounds = np.flatnonzero(np.diff(stretch[order])) + 1
    for rows in np.split(order, bounds):
        ascending = rows[counts[rows] >= points]
        if len(ascending) == 0:
            continue
        below = np.cumsum(counts[ascending])
        sparse = ascending[np.searchsorted(below, SPARSE_SHARE * below[-1])]
        radii[rows] = np.minimum(radii[rows], radii[sparse])
    return radii


def is_noise(xyz: Float, radius: Float, points: int = POINTS, judged: Bool | None = None) -> Bool:
    """Find points with fewer than `points` points, themselves included, within their search radius.

    Parameters
    ----------
    xyz : (n, 3) float64 array
        Coordinates, m.
    radius : (n,) float64 array
        Search radius of each point, m.
    points : int
        Least number of points in the neighbourhood of a good one.
    judged : (n,) bool array, optional
        Points to judge; the others only count as neighbours, and come out False.

    Returns
    -------
    (n,) bool array
        True for noise.
    """
    noise = np.zeros(len(xyz), np.bool_)
    if len(xyz) == 0 or points <= 1:
        return noise
    judged = np.ones(len(xyz), np.bool_) if judged is None else judged
    if not judged.any():
        return noise
    order, start, edge, origin = _sort_by_cell(xyz, float(radius[judged].max()))
    _judge(xyz[order], radius, judged, order, start, edge, origin, points, noise)
    return noise


def noise_filter(xyz: Float, points: int = POINTS, diameter: float = DIAMETER) -> Bool:
    """Find the noise of a whole cloud (n, 3) held in memory; (n,) bool, True for noise.

    Source: Xu et al. (2018), section II-D; the radius as at the head of this module.
    """
    cells = CellCounts()
    number = cells.add(np.ascontiguousarray(xyz, np.float64))
    radii = search_radii(cells.counts, cells.edge, points, diameter)
    return is_noise(np.ascontiguousarray(xyz, np.float64), radii[number], points)


def _radius(density: Float) -> Float:
    with np.errstate(divide="ignore"):
        return np.sqrt(EXPECTED / (np.pi * density))


def _sort_by_cell(xyz: Float, edge: float) -> tuple[Int32, Int32, float, Float]:
    """Order the points by the bucket of their cell; start[b] is the first place of bucket b."""
    origin = xyz.min(axis=0)
    buckets = 1 << max(8, math.ceil(math.log2(len(xyz) + 1)))
    order, start = _bucket_sort(xyz, origin, 1.0 / edge, buckets)
    return order, start, edge, origin


@njit(inline="always")
def _column(ix: int, iy: int) -> int:  # pragma: no cover - compiled
    # Cells above each other get buckets beside each other: the three of a column are one run of memory.
    return (ix * 73856093) ^ (iy * 19349663)


@njit(cache=True, nogil=True)
def _bucket_sort(xyz: Float, origin: Float, scale: float, buckets: int) -> tuple[Int32, Int32]:  # pragma: no cover - compiled
    n = xyz.shape[0]
    mask = buckets - 1
    bucket = np.empty(n, np.int32)
    start = np.zeros(buckets + 1, np.int32)
    for i in range(n):
        ix = math.floor((xyz[i, 0] - origin[0]) * scale)
        iy = math.floor((xyz[i, 1] - origin[1]) * scale)
        iz = math.floor((xyz[i, 2] - origin[2]) * scale)
        b = (_column(ix, iy) + iz) & mask
        bucket[i] = b
        start[b + 1] += 1
    for b in range(buckets):
        start[b + 1] += start[b]
    place = start[:-1].copy()
    order = np.empty(n, np.int32)
    for i in range(n):
        b = bucket[i]
        order[place[b]] = i
        place[b] += 1
    return order, start


@njit(cache=True, nogil=True)
def _judge(
    xyz: Float,
    radius: Float,
    judged: Bool,
    order: Int32,
    start: Int32,
    edge: float,
    origin: Float,
    points: int,
    noise: Bool,
) -> None:  # pragma: no cover - compiled
    mask = start.shape[0] - 2
    scale = 1.0 / edge
    for k in range(xyz.shape[0]):
        i = order[k]
        if not judged[i]:
            continue
        x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
        ix = math.floor((x - origin[0]) * scale)
        iy = math.floor((y - origin[1]) * scale)
        iz = math.floor((z - origin[2]) * scale)
        limit = radius[i] * radius[i]
        found = 0
        for c in range(9):
            # The point's own column of cells first: on a dense wall it holds enough already.
            dx, dy = (c + 1) % 3 - 1, (c // 3 + 1) % 3 - 1
            dx, dy = (0, 0) if c == 0 else ((1, 1) if dx == 0 and dy == 0 else (dx, dy))
            column = _column(ix + dx, iy + dy)
            for dz in range(-1, 2):
                b = (column + iz + dz) & mask
                for j in range(start[b], start[b + 1]):
                    ex, ey, ez = xyz[j, 0] - x, xyz[j, 1] - y, xyz[j, 2] - z
                    if ex * ex + ey * ey + ez * ez > limit:
                        continue
                    # Other cells may share the bucket: count a neighbour in its own cell only.
                    if (
                        math.floor((xyz[j, 0] - origin[0]) * scale) == ix + dx
                        and math.floor((xyz[j, 1] - origin[1]) * scale) == iy + dy
                        and math.floor((xyz[j, 2] - origin[2]) * scale) == iz + dz
                    ):
                        found += 1
                        if found >= points:
                            break
                if found >= points:
                    break
            if found >= points:
                break
        noise[i] = found < points


@njit(cache=True, nogil=True)
def _count(
    xyz: Float,
    scale: float,
    done: int,
    used: int,
    cells: Int64,
    counts: Int64,
    table: Int32,
    numbers: Int32,
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Count points from `done` on until the list of cells is full; returns how far it came."""
    mask = table.shape[0] - 1
    last = -1
    lx, ly, lz = 0, 0, 0
    for i in range(done, xyz.shape[0]):
        ix = math.floor(xyz[i, 0] * scale)
        iy = math.floor(xyz[i, 1] * scale)
        iz = math.floor(xyz[i, 2] * scale)
        if last < 0 or ix != lx or iy != ly or iz != lz:
            slot = ((ix * 73856093) ^ (iy * 19349663) ^ (iz * 83492791)) & mask
            while True:
                k = table[slot]
                if k < 0:
                    if used == cells.shape[0]:
                        return i, used
                    k = used
                    cells[k, 0], cells[k, 1], cells[k, 2] = ix, iy, iz
                    table[slot] = k
                    used += 1
                    break
                if cells[k, 0] == ix and cells[k, 1] == iy and cells[k, 2] == iz:
                    break
                slot = (slot + 1) & mask
            last, lx, ly, lz = k, ix, iy, iz
        counts[last] += 1
        numbers[i] = last
    return xyz.shape[0], used


@njit(cache=True, nogil=True)
def _rehash(cells: Int64, used: int, table: Int32) -> None:  # pragma: no cover - compiled
    mask = table.shape[0] - 1
    for k in range(used):
        slot = ((cells[k, 0] * 73856093) ^ (cells[k, 1] * 19349663) ^ (cells[k, 2] * 83492791)) & mask
        while table[slot] >= 0:
            slot = (slot + 1) & mask
        table[slot] = k
