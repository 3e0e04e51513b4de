"""The noise filter of Xu et al. (2018, section II-D), with a search radius that follows the scan's density.

Xu et al. classify a point as noise if fewer than 5 points lie within a neighbourhood of 0.05 m diameter. That suits a scan
with a few millimetres between points; a sparser scan would lose its walls. Here the radius is

    r = max(0.025 m, √(m / (π ρ))),   m = 20,

where ρ is the areal density of the surface near the point. A circle of this radius contains 20 points on average. So a wall
keeps its points (fewer than 5 of 20 expected: once in 60 000), and an isolated point is removed. From a density of about one
point per square centimetre upwards r is 0.025 m, and the filter is that of the paper.

ρ is measured in cubic cells of 0.5 m, as ρ = n / a² for a cell of edge a with n points. A plane has at most √2 a² within a
cell, so ρ is at most 1.4 times too high, and the circle still contains 14 points. If the plane cuts only a corner of the
cell, ρ is too low and the filter is more lenient. Cells of 0.5 m also contain points of every scanned profile if profiles
are that far apart, so points that are dense along profiles are kept, too. An isolated point in an otherwise empty cell
would get a wide radius by this rule and reach the wall. Therefore no radius exceeds that for the density that 5 % of the
points of the same stretch of tunnel fall below (without cells of fewer than 5 points, which contain no surface), nor one
cell edge. Between static stations 40 m apart, the density within 5 m of tunnel varies by a factor of 4, which moves that
limit by less than the Poisson noise of the cells.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.compiled import kernel
from tunneldb.pointcloud.voxels import CellCounts, column_hash

EXPECTED_NEIGHBOURS = 20
SPARSE_SHARE = 0.05

MIN_POINT_RATIO = 4  # ratio of all points to points to be classified from which it pays to leave out distant points

POINTS = 5
DIAMETER = 0.05


def search_radii(
    counts: Int64, edge: float, points: int = POINTS, diameter: float = DIAMETER, stretch: Int64 | None = None
) -> Float:
    """Return the search radius of the points of each cell.

    Parameters
    ----------
    counts : (k,) int64 array
        Number of points in each cell.
    edge : float
        Edge of a cell, m.
    points, diameter : int and float
        The filter's parameters at full density; diameter in m.
    stretch : (k,) int64 array, optional
        Number of the stretch of tunnel that contains each cell; the widest radius is found for each stretch separately.

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
    """Return the points per m² of surface that about half of the points or more have around them; 0 without points.

    The points in each cell (k,) of an edge (m) are given. A point's cell contains, beside itself, as many points on average as
    any place like it.
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
        Coordinates of all points near those to be classified, including these, m.
    xyz : (n, 3) float64 array
        Points to be classified, m.
    radius : (n,) float64 array
        Search radius of each, m.
    points : int
        Least number of neighbours of a point that is not noise.

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
    if MIN_POINT_RATIO * len(xyz) < len(cloud):
        near = np.empty(len(cloud), np.bool_)
        marks = np.zeros(1 << max(8, math.ceil(math.log2(32 * len(xyz)))), np.bool_)
        _mark_near(cloud, xyz, radius, 2.0 * widest, marks, near)
        cloud = cloud[near]
    ordered, start, origin = _sort_by_cell(cloud, widest)
    _count_neighbours(ordered, xyz, radius, start, widest, origin, int(points), noise)
    return noise


def noise_filter(xyz: Float, points: int = POINTS, diameter: float = DIAMETER) -> Bool:
    """Return True for the noise of a whole cloud (n, 3) in memory, (n,) bool.

    Source: Xu et al. (2018), section II-D; radius as described in this module's docstring.
    """
    cells = CellCounts()
    number = cells.add(np.ascontiguousarray(xyz, np.float64))
    radii = search_radii(cells.counts, cells.edge, points, diameter)
    xyz = np.ascontiguousarray(xyz, np.float64)
    return is_noise(xyz, xyz, radii[number], points)


def _radius(density: Float) -> Float:
    with np.errstate(divide="ignore"):
        return np.sqrt(EXPECTED_NEIGHBOURS / (np.pi * density))


def _sort_by_cell(xyz: Float, edge: float) -> tuple[Float, Int32, Float]:
    """Sort the points by the bucket of their cell; start[b] is the first index of bucket b. Also return the cells' origin."""
    origin = xyz.min(axis=0)
    buckets = 1 << max(8, math.ceil(math.log2(len(xyz) + 1)))
    bucket, ordered = np.empty(len(xyz), np.int32), np.empty((len(xyz), 3))
    start = np.zeros(buckets + 2, np.int32)
    _bucket_sort(xyz, origin, 1.0 / edge, bucket, start, ordered)
    return ordered, start[:-1], origin


# Cells above each other have consecutive buckets: three cells of a column are contiguous in memory.


@kernel
def _bucket_sort(
    xyz: Float, origin: Float, scale: float, bucket: Int32, start: Int32, ordered: Float
) -> None:  # pragma: no cover - compiled
    """Sort points by bucket; ``start`` (two entries more than buckets, initially 0) gets the first index of each bucket."""
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
    # start[b + 1] is the index for the next point of bucket b; at the end it is the first index of bucket b + 1.
    for i in range(xyz.shape[0]):
        k = start[bucket[i] + 1]
        ordered[k, 0], ordered[k, 1], ordered[k, 2] = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        start[bucket[i] + 1] += 1


@kernel
def _mark_near(
    cloud: Float, xyz: Float, radius: Float, edge: float, marks: Bool, near: Bool
) -> None:  # pragma: no cover - compiled
    """Mark points of a cloud in cells that the spheres around points reach; some other points share their hash.

    The edge of the cells is at least a diameter; ``marks`` are those of the cells, by hash, initially False.
    """
    mask = marks.shape[0] - 1
    scale = 1.0 / edge
    for i in range(xyz.shape[0]):
        r = radius[i] * (1.0 + 1e-9) + 1e-9  # rounding must not exclude a neighbour
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
    """Mark points with too few neighbours; the search ends as soon as there are enough."""
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
            # The point's own column of cells first: on a dense wall it already has enough.
            dx, dy = (c + 1) % 3 - 1, (c // 3 + 1) % 3 - 1
            dx, dy = (0, 0) if c == 0 else ((1, 1) if dx == 0 and dy == 0 else (dx, dy))
            column = column_hash(ix + dx, iy + dy)
            for dz in range(-1, 2):
                b = (column + iz + dz) & mask
                for j in range(start[b], start[b + 1]):
                    ex, ey, ez = cloud[j, 0] - x, cloud[j, 1] - y, cloud[j, 2] - z
                    if ex * ex + ey * ey + ez * ez > limit:
                        continue
                    # Other cells may share the bucket: count a neighbour only in its own cell.
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
