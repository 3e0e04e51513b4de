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

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.compiled import kernel
from tunneldb.pointcloud.voxels import CellCounts, column_hash

EXPECTED = 20
SPARSE_SHARE = 0.05

SELECTIVE = 4  # with this many times as many points as are to be judged it pays to leave out those far from them

POINTS = 5
DIAMETER = 0.05


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


def typical_density(counts: Int64, edge: float) -> float:
    """Points per m² of surface about half of the points or more, from the points in each cell (k,) of an edge, m; 0 of none.

    A point's cell holds, beside itself, as many points on average as any place like it does.
    """
    ascending = np.sort(counts[counts > 0])
    if not len(ascending):
        return 0.0
    until = np.cumsum(ascending)
    return float(ascending[np.searchsorted(until, 0.5 * until[-1])] - 1) / edge**2


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
    cloud, xyz, radius = (np.ascontiguousarray(part, np.float64) for part in (cloud, xyz, radius))
    widest = float(radius.max())
    if SELECTIVE * len(xyz) < len(cloud):
        near = np.empty(len(cloud), np.bool_)
        marks = np.zeros(1 << max(8, math.ceil(math.log2(32 * len(xyz)))), np.bool_)
        _mark_near(cloud, xyz, radius, 2.0 * widest, marks, near)
        cloud = cloud[near]
    ordered, start, origin = _sort_by_cell(cloud, widest)
    _count_neighbours(ordered, xyz, radius, start, widest, origin, int(points), noise)
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
    bucket, ordered = np.empty(len(xyz), np.int32), np.empty((len(xyz), 3))
    start = np.zeros(buckets + 2, np.int32)
    _bucket_sort(xyz, origin, 1.0 / edge, bucket, start, ordered)
    return ordered, start[:-1], origin


# Cells above each other get buckets beside each other: the three of a column are one run of memory.


@kernel
def _bucket_sort(
    xyz: Float, origin: Float, scale: float, bucket: Int32, start: Int32, ordered: Float
) -> None:  # pragma: no cover - compiled
    """Sort points by their bucket; of start, two longer than there are buckets and 0, the first entry of each is made."""
    mask = start.shape[0] - 3
    for i in range(xyz.shape[0]):
        ix = math.floor((xyz[i, 0] - origin[0]) * scale)
        iy = math.floor((xyz[i, 1] - origin[1]) * scale)
        iz = math.floor((xyz[i, 2] - origin[2]) * scale)
        b = (column_hash(ix, iy) + iz) & mask
        bucket[i] = b
        start[b + 2] += 1
    for b in range(2, start.shape[0]):
        start[b] += start[b - 1]
    # Where the next point of bucket b goes is start[b + 1], which in the end is where the bucket after it begins.
    for i in range(xyz.shape[0]):
        k = start[bucket[i] + 1]
        ordered[k, 0], ordered[k, 1], ordered[k, 2] = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        start[bucket[i] + 1] += 1


@kernel
def _mark_near(
    cloud: Float, xyz: Float, radius: Float, edge: float, marks: Bool, near: Bool
) -> None:  # pragma: no cover - compiled
    """Tell which points of a cloud lie in cells that the spheres around points reach into; some others share their hash.

    The edge of the cells is at least a diameter; marks are those of the cells, by their hash, and False to begin with.
    """
    mask = marks.shape[0] - 1
    scale = 1.0 / edge
    for i in range(xyz.shape[0]):
        r = radius[i] * (1.0 + 1e-9) + 1e-9  # rounding must not leave out a neighbour
        for ix in range(math.floor((xyz[i, 0] - r) * scale), math.floor((xyz[i, 0] + r) * scale) + 1):
            for iy in range(math.floor((xyz[i, 1] - r) * scale), math.floor((xyz[i, 1] + r) * scale) + 1):
                column = column_hash(ix, iy)
                for iz in range(math.floor((xyz[i, 2] - r) * scale), math.floor((xyz[i, 2] + r) * scale) + 1):
                    marks[(column + iz) & mask] = True
    for i in range(cloud.shape[0]):
        ix = math.floor(cloud[i, 0] * scale)
        iy = math.floor(cloud[i, 1] * scale)
        iz = math.floor(cloud[i, 2] * scale)
        near[i] = marks[(column_hash(ix, iy) + iz) & mask]


@kernel
def _count_neighbours(
    cloud: Float, xyz: Float, radius: Float, start: Int32, edge: float, origin: Float, points: int, noise: Bool
) -> None:  # pragma: no cover - compiled
    """Mark points with fewer neighbours than wanted; as soon as there are enough, no more are looked for."""
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
            column = column_hash(ix + dx, iy + dy)
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
