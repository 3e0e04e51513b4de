"""DBSCAN: clusters of points by their density (Ester et al., 1996; Li et al., 2023, eq. 2–4), compiled.

Neighbours are looked up when they are needed and never kept, so memory grows with the number of points alone, whatever
their density. Points are sorted into cells whose diagonal is the radius: all core points of a cell belong together, so
clusters are joined cell by cell, and one pair of core points near enough joins two cells.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Bool, Float, Int64

_EDGE = 0.577  # of the radius: a little less than 1/√3, the edge of a cube whose diagonal is the radius
_NEAR = 2  # cells to each side that can hold a neighbour


def dbscan(points: Float, radius: float, min_points: int) -> Int64:
    """Label the clusters of points.

    A core point has ``min_points`` points, itself included, within the radius (eq. 2). Core points within the radius of
    each other are one cluster (eq. 4); what is no core point joins the cluster of the nearest core point within the radius,
    the first of equals, or none (eq. 3). So clusters do not depend on the order of the points.

    Parameters
    ----------
    points : (n, 3) float array
        Coordinates, m, without NaN. Where the spacing differs with the direction, scale them before.
    radius : float
        R, m, above 0.
    min_points : int
        P_min, 1 or more.

    Returns
    -------
    (n,) int array
        Number of the cluster, from 0 in the order of their first points; -1 for noise.

    Raises
    ------
    ValueError
        For a radius or a number of points out of bounds, or points that are not (n, 3).
    """
    if not radius > 0.0 or min_points < 1:
        raise ValueError(f"a radius above 0 and at least 1 point are needed, not {radius} and {min_points}")
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points must be (n, 3), not {points.shape}")
    if len(points) == 0:
        return np.empty(0, np.int64)
    low = points.min(axis=0)
    edge = radius * _EDGE
    shape = np.floor((points.max(axis=0) - low) / edge).astype(np.int64) + 1 + 2 * _NEAR
    keys = _keys(points, low, edge, shape)
    order = np.argsort(keys, kind="stable")
    placed = points[order] - low
    keys = keys[order]
    starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1], [True]]))
    cells = keys[starts[:-1]]
    core = _cores(placed, starts, cells, shape, radius, min_points)
    roots = _joined(placed, starts, cells, shape, radius, core)
    found = _members(placed, order, starts, cells, shape, radius, core, roots)
    labels = np.empty(len(points), np.int64)
    labels[order] = found
    return _numbered(labels, len(cells))


@njit(cache=True, nogil=True)
def _keys(points: Float, low: Float, edge: float, shape: Int64) -> Int64:  # pragma: no cover - compiled
    keys = np.empty(points.shape[0], np.int64)
    for i in range(points.shape[0]):
        x = np.int64((points[i, 0] - low[0]) / edge) + _NEAR
        y = np.int64((points[i, 1] - low[1]) / edge) + _NEAR
        z = np.int64((points[i, 2] - low[2]) / edge) + _NEAR
        keys[i] = (z * shape[1] + y) * shape[0] + x
    return keys


@njit(cache=True, nogil=True)
def _near(placed: Float, i: int, j: int, limit: float) -> bool:  # pragma: no cover - compiled
    dx, dy, dz = placed[i, 0] - placed[j, 0], placed[i, 1] - placed[j, 1], placed[i, 2] - placed[j, 2]
    return bool(dx * dx + dy * dy + dz * dz <= limit)


@njit(cache=True, nogil=True)
def _runs(cells: Int64, shape: Int64, c: int, out: Int64) -> int:  # pragma: no cover - compiled
    """First and last + 1 of the runs of filled cells about a cell, itself included; how many runs there are."""
    count = 0
    for dz in range(-_NEAR, _NEAR + 1):
        for dy in range(-_NEAR, _NEAR + 1):
            key = cells[c] + (dz * shape[1] + dy) * shape[0]
            first = np.searchsorted(cells, key - _NEAR)
            last = first
            while last < cells.shape[0] and cells[last] <= key + _NEAR:
                last += 1
            if last > first:
                out[count, 0], out[count, 1] = first, last
                count += 1
    return count


@njit(cache=True, nogil=True, parallel=True)
def _cores(
    placed: Float, starts: Int64, cells: Int64, shape: Int64, radius: float, min_points: int
) -> Bool:  # pragma: no cover - compiled
    core = np.zeros(placed.shape[0], np.bool_)
    limit = radius * radius
    for c in prange(cells.shape[0]):
        if starts[c + 1] - starts[c] >= min_points:
            core[starts[c] : starts[c + 1]] = True
            continue
        runs = np.empty(((2 * _NEAR + 1) ** 2, 2), np.int64)
        count = _runs(cells, shape, c, runs)
        for i in range(starts[c], starts[c + 1]):
            found = 0
            for k in range(count):
                for j in range(starts[runs[k, 0]], starts[runs[k, 1]]):
                    if _near(placed, i, j, limit):
                        found += 1
                        if found >= min_points:
                            break
                if found >= min_points:
                    core[i] = True
                    break
    return core


@njit(cache=True, nogil=True)
def _root(parent: Int64, c: int) -> int:  # pragma: no cover - compiled
    while parent[c] != c:
        parent[c] = parent[parent[c]]
        c = parent[c]
    return c


@njit(cache=True, nogil=True)
def _touch(placed: Float, starts: Int64, core: Bool, a: int, b: int, limit: float) -> bool:  # pragma: no cover - compiled
    """Tell whether a core point of one cell lies within the radius of one of another."""
    for i in range(starts[a], starts[a + 1]):
        if core[i]:
            for j in range(starts[b], starts[b + 1]):
                if core[j] and _near(placed, i, j, limit):
                    return True
    return False


@njit(cache=True, nogil=True)
def _joined(placed: Float, starts: Int64, cells: Int64, shape: Int64, radius: float, core: Bool) -> Int64:  # pragma: no cover
    """First cell of the cluster of each cell's core points; -1 without one."""
    parent = np.full(cells.shape[0], -1, np.int64)
    for c in range(cells.shape[0]):
        if core[starts[c] : starts[c + 1]].any():
            parent[c] = c
    runs = np.empty(((2 * _NEAR + 1) ** 2, 2), np.int64)
    limit = radius * radius
    for c in range(cells.shape[0]):
        if parent[c] < 0:
            continue
        for k in range(_runs(cells, shape, c, runs)):
            for other in range(runs[k, 0], min(runs[k, 1], c)):  # the pairs with later cells are theirs
                if parent[other] < 0:
                    continue
                a, b = _root(parent, c), _root(parent, other)
                if a != b and _touch(placed, starts, core, c, other, limit):
                    parent[max(a, b)] = min(a, b)
    for c in range(cells.shape[0]):
        if parent[c] >= 0:
            parent[c] = _root(parent, c)
    return parent


@njit(cache=True, nogil=True, parallel=True)
def _members(
    placed: Float, order: Int64, starts: Int64, cells: Int64, shape: Int64, radius: float, core: Bool, roots: Int64
) -> Int64:  # pragma: no cover - compiled
    """Root of each point's cluster, -1 for noise."""
    found = np.full(placed.shape[0], -1, np.int64)
    for c in prange(cells.shape[0]):
        runs = np.empty(((2 * _NEAR + 1) ** 2, 2), np.int64)
        count = -1
        for i in range(starts[c], starts[c + 1]):
            if core[i]:
                found[i] = roots[c]
                continue
            if count < 0:
                count = _runs(cells, shape, c, runs)
            best, first = radius * radius, np.int64(-1)
            for k in range(count):
                for other in range(runs[k, 0], runs[k, 1]):
                    for j in range(starts[other], starts[other + 1]):
                        if not core[j]:
                            continue
                        dx, dy, dz = placed[i, 0] - placed[j, 0], placed[i, 1] - placed[j, 1], placed[i, 2] - placed[j, 2]
                        distance = dx * dx + dy * dy + dz * dz
                        if distance < best or (distance == best and (first < 0 or order[j] < first)):
                            best, first = distance, order[j]
                            found[i] = roots[other]
    return found


@njit(cache=True, nogil=True)
def _numbered(labels: Int64, count: int) -> Int64:  # pragma: no cover - compiled
    """Number the clusters in the order of their first points."""
    number = np.full(count, -1, np.int64)
    used = 0
    for i in range(labels.shape[0]):
        root = labels[i]
        if root >= 0:
            if number[root] < 0:
                number[root] = used
                used += 1
            labels[i] = number[root]
    return labels
