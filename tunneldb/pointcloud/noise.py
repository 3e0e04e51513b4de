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

from tunneldb.arrays import Bool, Float, Int32, Int64

CELL = 0.5
EXPECTED = 20
SPARSE_SHARE = 0.05

SELECTIVE = 4  # with this many times as many points as are to be judged it pays to leave out those far from them

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

    def find(self, xyz: Float) -> Int32:
        """Number of the cell of each point (n, 3), (n,); -1 where none was ever counted."""
        return _find(xyz, 1.0 / self.edge, self._cells, self._table)

    def remove(self, numbers: Int32) -> None:
        """Take points out of the count of their cells (n,)."""
        np.subtract.at(self._counts, numbers, 1)

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


def is_noise(cloud: Float, xyz: Float, radius: Float, points: int = POINTS) -> Bool:
    """Find points with fewer than `points` points of a cloud within their search radius.

    Parameters
    ----------
    cloud : (m, 3) float64 array
        Coordinates of all points near those to be judged, themselves included, m.
    xyz : (n, 3) float64 array
        Points to be judged, m.
    radius : (n,) float64 array
        Search radius of each, m.
    points : int
        Least number of points in the neighbourhood of a good one.

    Returns
    -------
    (n,) bool array
        True for noise.
    """
    noise = np.zeros(len(xyz), np.bool_)
    if len(xyz) == 0 or points <= 1:
        return noise
    widest = float(radius.max())
    if SELECTIVE * len(xyz) < len(cloud):
        cloud = _near(cloud, _marks(xyz, radius, 2.0 * widest, 1 << max(8, math.ceil(math.log2(32 * len(xyz))))), 2.0 * widest)
    ordered, start, origin = _sort_by_cell(cloud, widest)
    _judge(ordered, xyz, radius, start, widest, origin, points, noise)
    return noise


def noise_filter(xyz: Float, points: int = POINTS, diameter: float = DIAMETER) -> Bool:
    """Find the noise of a whole cloud (n, 3) held in memory; (n,) bool, True for noise.

    Source: Xu et al. (2018), section II-D; the radius as at the head of this module.
    """
    cells = CellCounts()
    number = cells.add(np.ascontiguousarray(xyz, np.float64))
    radii = search_radii(cells.counts, cells.edge, points, diameter)
    xyz = np.ascontiguousarray(xyz, np.float64)
    return is_noise(xyz, xyz, radii[number], points)


def _radius(density: Float) -> Float:
    with np.errstate(divide="ignore"):
        return np.sqrt(EXPECTED / (np.pi * density))


def _sort_by_cell(xyz: Float, edge: float) -> tuple[Float, Int32, Float]:
    """Order the points by the bucket of their cell; start[b] is the first place of bucket b. Also the cells' origin."""
    origin = xyz.min(axis=0)
    buckets = 1 << max(8, math.ceil(math.log2(len(xyz) + 1)))
    ordered, start = _bucket_sort(xyz, origin, 1.0 / edge, buckets)
    return ordered, start, origin


@njit(inline="always")
def _column(ix: int, iy: int) -> int:  # pragma: no cover - compiled
    # Cells above each other get buckets beside each other: the three of a column are one run of memory.
    return (ix * 73856093) ^ (iy * 19349663)


@njit(cache=True, nogil=True)
def _bucket_sort(xyz: Float, origin: Float, scale: float, buckets: int) -> tuple[Float, Int32]:  # pragma: no cover - compiled
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
    ordered = np.empty((n, 3))
    for i in range(n):
        k = place[bucket[i]]
        ordered[k, 0], ordered[k, 1], ordered[k, 2] = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        place[bucket[i]] += 1
    return ordered, start


@njit(cache=True, nogil=True)
def _marks(xyz: Float, radius: Float, edge: float, buckets: int) -> Bool:  # pragma: no cover - compiled
    """Mark the cells, by their hash, that the spheres around points reach into; edge is at least a diameter."""
    marks = np.zeros(buckets, np.bool_)
    mask = buckets - 1
    scale = 1.0 / edge
    for i in range(xyz.shape[0]):
        r = radius[i] * (1.0 + 1e-9) + 1e-9  # rounding must not leave out a neighbour
        for ix in range(math.floor((xyz[i, 0] - r) * scale), math.floor((xyz[i, 0] + r) * scale) + 1):
            for iy in range(math.floor((xyz[i, 1] - r) * scale), math.floor((xyz[i, 1] + r) * scale) + 1):
                column = _column(ix, iy)
                for iz in range(math.floor((xyz[i, 2] - r) * scale), math.floor((xyz[i, 2] + r) * scale) + 1):
                    marks[(column + iz) & mask] = True
    return marks


@njit(cache=True, nogil=True)
def _near(cloud: Float, marks: Bool, edge: float) -> Float:  # pragma: no cover - compiled
    """Points of a cloud that lie in marked cells; also some others, whose cells share a hash with them."""
    mask = len(marks) - 1
    scale = 1.0 / edge
    chosen = np.empty(len(cloud), np.int32)
    count = 0
    for i in range(len(cloud)):
        ix = math.floor(cloud[i, 0] * scale)
        iy = math.floor(cloud[i, 1] * scale)
        iz = math.floor(cloud[i, 2] * scale)
        if marks[(_column(ix, iy) + iz) & mask]:
            chosen[count] = i
            count += 1
    near = np.empty((count, 3))
    for k in range(count):
        for c in range(3):
            near[k, c] = cloud[chosen[k], c]
    return near


@njit(cache=True, nogil=True)
def _judge(
    cloud: Float, xyz: Float, radius: Float, start: Int32, edge: float, origin: Float, points: int, noise: Bool
) -> None:  # pragma: no cover - compiled
    mask = start.shape[0] - 2
    scale = 1.0 / edge
    for i in range(xyz.shape[0]):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
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
                    ex, ey, ez = cloud[j, 0] - x, cloud[j, 1] - y, cloud[j, 2] - z
                    if ex * ex + ey * ey + ez * ez > limit:
                        continue
                    # Other cells may share the bucket: count a neighbour in its own cell only.
                    if (
                        math.floor((cloud[j, 0] - origin[0]) * scale) == ix + dx
                        and math.floor((cloud[j, 1] - origin[1]) * scale) == iy + dy
                        and math.floor((cloud[j, 2] - origin[2]) * scale) == iz + dz
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
def _find(xyz: Float, scale: float, cells: Int64, table: Int32) -> Int32:  # pragma: no cover - compiled
    mask = table.shape[0] - 1
    numbers = np.empty(xyz.shape[0], np.int32)
    for i in range(xyz.shape[0]):
        ix = math.floor(xyz[i, 0] * scale)
        iy = math.floor(xyz[i, 1] * scale)
        iz = math.floor(xyz[i, 2] * scale)
        slot = ((ix * 73856093) ^ (iy * 19349663) ^ (iz * 83492791)) & mask
        while True:
            k = table[slot]
            if k < 0 or (cells[k, 0] == ix and cells[k, 1] == iy and cells[k, 2] == iz):
                break
            slot = (slot + 1) & mask
        numbers[i] = k
    return numbers


@njit(cache=True, nogil=True)
def _rehash(cells: Int64, used: int, table: Int32) -> None:  # pragma: no cover - compiled
    mask = table.shape[0] - 1
    for k in range(used):
        slot = ((cells[k, 0] * 73856093) ^ (cells[k, 1] * 19349663) ^ (cells[k, 2] * 83492791)) & mask
        while table[slot] >= 0:
            slot = (slot + 1) & mask
        table[slot] = k
