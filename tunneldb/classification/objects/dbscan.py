"""DBSCAN: clusters of points by their density (Ester et al., 1996; Li et al., 2023, eq. 2–4).

Neighbours are looked up when needed and not stored, so memory grows only with the number of points, whatever their density.
Points are sorted into cells whose diagonal is the radius: all core points of a cell belong together. So clusters are joined
cell by cell, and one pair of core points near enough joins two cells.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.compiled import inner, kernel, lower_bound
from tunneldb.threads import in_blocks

_EDGE = 0.577  # of the radius: a little less than 1/√3, the edge of a cube whose diagonal is the radius
_NEIGHBOUR_CELLS = 2  # cells to each side that can hold a neighbour
_RUNS = (2 * _NEIGHBOUR_CELLS + 1) ** 2  # runs of cells about a cell
_BLOCK = 4096  # cells at a time


def dbscan(points: Float, radius: float, min_points: int) -> Int64:
    """Label the clusters of points.

    A core point has ``min_points`` points, itself included, within the radius (eq. 2). Core points within the radius of each
    other form one cluster (eq. 4). Any other point joins the cluster of the nearest core point within the radius, the first of
    equals, or none (eq. 3). So clusters do not depend on the order of the points.

    Parameters
    ----------
    points : (n, 3) float array
        Coordinates, m, without NaN. If the spacing differs with direction, scale them first.
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
        If the radius or the number of points is out of bounds, or points are not (n, 3).
    """
    if not radius > 0.0 or min_points < 1:
        raise ValueError(f"radius must be above 0 and min_points at least 1, not {radius} and {min_points}")
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points must be (n, 3), not {points.shape}")
    if len(points) == 0:
        return np.empty(0, np.int64)
    limit = float(radius) * float(radius)
    low = points.min(axis=0)
    keys, row, layer = _keys(points, low, radius * _EDGE)
    order = np.argsort(keys, kind="stable")
    placed = points[order] - low
    keys = keys[order]
    starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1], [True]]))
    cells = keys[starts[:-1]]
    core = np.zeros(len(points), np.bool_)
    in_blocks(
        lambda begin, end: _find_core(placed, starts, cells, row, layer, limit, int(min_points), _runs(), core, begin, end),
        len(cells),
        _BLOCK,
    )
    parent = np.where(np.logical_or.reduceat(core, starts[:-1]), np.arange(len(cells)), -1)
    _join_cells(placed, starts, cells, row, layer, limit, _runs(), core, parent)
    found = np.full(len(points), -1, np.int64)
    in_blocks(
        lambda begin, end: _label(placed, order, starts, cells, row, layer, limit, _runs(), core, parent, found, begin, end),
        len(cells),
        _BLOCK,
    )
    labels = np.empty(len(points), np.int64)
    labels[order] = found
    return _in_order(labels, len(cells))


def _keys(points: Float, low: Float, edge: float) -> tuple[Int64, int, int]:
    """Return the number of the cell of each point (n,), and its increments from a row and from a layer to the next."""
    keys = np.zeros(len(points), np.int64)
    steps = []
    for axis in (2, 1, 0):
        place = ((points[:, axis] - low[axis]) / edge).astype(np.int64) + _NEIGHBOUR_CELLS
        steps.append(int(place.max()) + 1 + _NEIGHBOUR_CELLS)
        keys = keys * steps[-1] + place
    return keys, steps[2], steps[2] * steps[1]


def _runs() -> Int64:
    """Return working memory for the runs of cells around a cell."""
    return np.empty((_RUNS, 2), np.int64)


def _in_order(labels: Int64, count: int) -> Int64:
    """Renumber the clusters (labels below a count, -1 for none) in the order of their first points."""
    members = np.flatnonzero(labels >= 0)
    first = np.full(count, len(labels), np.int64)
    first[labels[members[::-1]]] = members[::-1]  # the last assignment remains: the first point
    number = np.empty(count, np.int64)
    number[np.argsort(first, kind="stable")] = np.arange(count)
    labels[members] = number[labels[members]]
    return labels


@inner
def _neighbours(cells: Int64, row: int, layer: int, c: int, runs: Int64) -> int:  # pragma: no cover - compiled
    """Write the first and last + 1 of the runs of filled cells around a cell, itself included, and return their number."""
    count, first = 0, np.int64(0)  # no literal, to avoid a second compilation of the called function
    for dz in range(-_NEIGHBOUR_CELLS, _NEIGHBOUR_CELLS + 1):
        for dy in range(-_NEIGHBOUR_CELLS, _NEIGHBOUR_CELLS + 1):
            key = cells[c] + dz * layer + dy * row
            first = lower_bound(cells, key - _NEIGHBOUR_CELLS, first, cells.shape[0])
            last = first
            while last < cells.shape[0] and cells[last] <= key + _NEIGHBOUR_CELLS:
                last += 1
            if last > first:
                runs[count, 0], runs[count, 1] = first, last
                count += 1
    return count


@kernel
def _find_core(
    placed: Float, starts: Int64, cells: Int64, row: int, layer: int, limit: float, min_points: int, runs: Int64,
    core: Bool, begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Mark the core points of the cells from begin to end."""
    for c in range(begin, end):
        crowded = starts[c + 1] - starts[c] >= min_points
        count = 0 if crowded else _neighbours(cells, row, layer, c, runs)
        for i in range(starts[c], starts[c + 1]):
            found = min_points if crowded else 0
            x, y, z = placed[i, 0], placed[i, 1], placed[i, 2]
            for k in range(count):
                for j in range(starts[runs[k, 0]], starts[runs[k, 1]]):
                    dx, dy, dz = x - placed[j, 0], y - placed[j, 1], z - placed[j, 2]
                    if dx * dx + dy * dy + dz * dz <= limit:
                        found += 1
                        if found >= min_points:
                            break
                if found >= min_points:
                    break
            core[i] = found >= min_points


@inner
def _root(parent: Int64, c: int) -> int:  # pragma: no cover - compiled
    while parent[c] != c:
        parent[c] = parent[parent[c]]
        c = parent[c]
    return c


@kernel
def _join_cells(
    placed: Float, starts: Int64, cells: Int64, row: int, layer: int, limit: float, runs: Int64, core: Bool, parent: Int64
) -> None:  # pragma: no cover - compiled
    """Make the parent of each cell with core points (else -1) the first cell of its cluster."""
    for c in range(cells.shape[0]):
        if parent[c] < 0:
            continue
        for k in range(_neighbours(cells, row, layer, c, runs)):
            for other in range(runs[k, 0], min(runs[k, 1], c)):  # later cells handle their own pairs
                if parent[other] < 0:
                    continue
                a, b = _root(parent, c), _root(parent, other)
                if a == b:
                    continue
                touch = False
                for i in range(starts[c], starts[c + 1]):
                    if not core[i]:
                        continue
                    for j in range(starts[other], starts[other + 1]):
                        dx, dy, dz = placed[i, 0] - placed[j, 0], placed[i, 1] - placed[j, 1], placed[i, 2] - placed[j, 2]
                        if core[j] and dx * dx + dy * dy + dz * dz <= limit:
                            touch = True
                            break
                    if touch:
                        parent[max(a, b)] = min(a, b)
                        break
    for c in range(cells.shape[0]):
        if parent[c] >= 0:
            parent[c] = _root(parent, c)


@kernel
def _label(
    placed: Float, order: Int64, starts: Int64, cells: Int64, row: int, layer: int, limit: float, runs: Int64,
    core: Bool, roots: Int64, found: Int64, begin: int, end: int,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Write the first cell of each point's cluster, for the points of the cells from begin to end; noise stays unchanged."""
    for c in range(begin, end):
        count = -1
        for i in range(starts[c], starts[c + 1]):
            if core[i]:
                found[i] = roots[c]
                continue
            if count < 0:
                count = _neighbours(cells, row, layer, c, runs)
            best, first = limit, -1
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
