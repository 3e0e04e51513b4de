"""Centreline of a tunnel in plan, found from points only."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.smoothing import smooth_line

_CELL = 1.0  # m in plan
_REACH = 3.0  # distance up to which cells are neighbours, m, since profiles have gaps
MAX_SHORT_LENGTH = 40.0
"""Length below which a tunnel may be wider than long, and its direction is found by projection, m."""

_STEP = 5.0  # m between vertices
_SAMPLE = 10_000  # points that are projected in all directions
_PIXEL = 0.2  # edge of a cell of the projection, m
_SLICE = 1.0  # m, across the line
_MIN_CELLS = 10  # least number of cells in a slice
_MAX_OUTLIER_SHARE = 0.02  # greatest share of a slice's cells beyond each wall
_CELL_OFFSET = 1 << 24  # cells; more than the length of any tunnel


def centreline_through(points: ArrayLike) -> PlanLine:
    """Return a line along a tunnel's point cloud, in any direction, straight or curved; its distance begins at 0.

    Parameters
    ----------
    points : (n, 3) array
        Points on the tunnel's surface, m, without distant objects; preferably evenly thinned.

    Raises
    ------
    ValueError
        If there are no points, or they are far apart.
    """
    vertices = centreline(np.asarray(points, dtype=np.float64))
    steps = np.hypot(*np.diff(vertices, axis=0).T)
    return PlanLine.of(vertices, np.concatenate([[0.0], np.cumsum(steps)]))


def centreline(points: Float) -> Float:
    """Return the vertices (k, 2) of a line along a tunnel, from its western end.

    A long tunnel's points are ordered by the shortest path to one of its ends, through neighbouring cells of the plan.
    A short piece is projected in all directions: along the tunnel, its points occupy the fewest cells. The line is then
    moved to the middle between the walls and smoothed.

    Parameters
    ----------
    points : (n, 3) array
        Points, m; those that are not finite are ignored.

    Raises
    ------
    ValueError
        If there are no points, or they are far apart.
    """
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        raise ValueError("there are no points to fit a line to")
    origin = np.floor(points.mean(axis=0))
    local = points - origin
    cells = _connected_cells(local[:, :2])
    path = _path_lengths(cells)
    vertices = _vertices_along_path(cells, path) if path.max() > MAX_SHORT_LENGTH else ends_by_projection(local)
    if vertices[-1, 0] < vertices[0, 0]:
        vertices = vertices[::-1]
    # Spread evenly: otherwise dense points around a scanner would dominate.
    spaced = _occupied_cells(local[:, :2], _PIXEL)
    for _ in range(3):
        vertices = _between_walls(vertices, spaced)
    return np.asarray(vertices + origin[:2])


def _connected_cells(plan: Float) -> Float:
    """Return the centres (m, 2) of occupied cells of the plan that are connected, without isolated points."""
    middle = _occupied_cells(plan, _CELL)
    _, label = connected_components(_graph(middle), directed=False)
    return np.asarray(middle[label == np.argmax(np.bincount(label))], dtype=np.float64)


def _occupied_cells(plan: Float, edge: float) -> Float:
    """Return the centres (m, 2) of occupied cells of the plan, without those that have far fewer points than most."""
    key = np.floor(plan / edge).astype(np.int64)
    key, count = np.unique(key[:, 0] * _CELL_OFFSET + key[:, 1] + _CELL_OFFSET // 2, return_counts=True)
    cells = np.column_stack([key // _CELL_OFFSET, key % _CELL_OFFSET - _CELL_OFFSET // 2])[count >= 0.1 * np.median(count)]
    return np.asarray((cells + 0.5) * edge, dtype=np.float64)


def _graph(middle: Float) -> coo_array:
    pairs = cKDTree(middle).query_pairs(_REACH, output_type="ndarray")
    length = np.hypot(*(middle[pairs[:, 0]] - middle[pairs[:, 1]]).T) if len(pairs) else np.empty(0)
    return coo_array((length, (pairs[:, 0], pairs[:, 1])), shape=(len(middle), len(middle)))


def _path_lengths(cells: Float) -> Float:
    """Return the length of the path from one end of the cells to each of them, m."""
    graph = _graph(cells).tocsr()
    start = 0
    for _ in range(2):
        start = int(np.argmax(dijkstra(graph, directed=False, indices=start)))
    return np.asarray(dijkstra(graph, directed=False, indices=start))


def _vertices_along_path(cells: Float, path: Float) -> Float:
    """Return the mean of the cells of every 5 m of the path; the first and last ones are not cut square."""
    count = max(2, int(path.max() / (2 * _STEP)))
    piece = np.minimum((path / path.max() * count).astype(int), count - 1)
    number = np.bincount(piece, minlength=count)
    mean = np.column_stack([np.bincount(piece, cells[:, k], minlength=count) / number for k in range(2)])
    mean = mean[1:-1] if count > 4 else mean
    step = np.diff(mean, axis=0)
    unit = step / np.hypot(*step.T)[:, None]
    ends = [_end_of_cells(cells, mean[0], -unit[0]), _end_of_cells(cells, mean[-1], unit[-1])]
    return np.vstack([ends[0], mean, ends[1]])


def _end_of_cells(cells: Float, at: Float, unit: Float) -> Float:
    """Return the end of the cells, straight ahead of a position."""
    near = cells - at
    near = near[np.hypot(*near.T) < 6 * _STEP]
    return np.asarray(at + max(float((near @ unit).max()), 0.5) * unit)


def ends_by_projection(local: Float) -> Float:
    """Return both ends of a short piece, in the direction of projection in which its points occupy the fewest cells."""
    local = local[np.abs(local - np.median(local, axis=0)).max(axis=1) < MAX_SHORT_LENGTH]
    if not len(local):
        raise ValueError(f"no points within {MAX_SHORT_LENGTH:g} m of their centre: not a piece of a tunnel")
    sample = local[:: max(1, len(local) // _SAMPLE)]
    sample = sample - sample.mean(axis=0)
    best, step = 0.0, np.pi / 90
    angles = np.arange(0.0, np.pi, step)
    for _ in range(3):
        filled = [_cells_in_projection(sample, angle) for angle in angles.tolist()]
        best = float(angles[int(np.argmin(filled))])
        angles, step = best + step * np.linspace(-1.0, 1.0, 11), step / 5
    unit = np.array([np.cos(best), np.sin(best)])
    ahead = local[:, :2] @ unit
    middle = np.median(local[:, :2], axis=0)
    middle = middle - (middle @ unit) * unit
    low, high = float(ahead.min()), float(ahead.max())
    if high - low < 1.0:
        low, high = 0.5 * (low + high) - 0.5, 0.5 * (low + high) + 0.5
    return np.vstack([middle + low * unit, middle + high * unit])


def _cells_in_projection(sample: Float, angle: float) -> int:
    """Return the number of cells of 0.2 m that the points occupy, projected in a direction of the plan."""
    across = sample[:, 0] * np.sin(angle) - sample[:, 1] * np.cos(angle)
    column, row = (np.floor((v - v.min()) / _PIXEL).astype(np.int64) for v in (across, sample[:, 2]))
    return int(np.count_nonzero(np.bincount(column * (row.max() + 1) + row)))


def _between_walls(vertices: Float, plan: Float) -> Float:
    """Return the line with vertices every 5 m, in the middle between the walls, smoothed."""
    step = np.hypot(*np.diff(vertices, axis=0).T)
    line = PlanLine.of(vertices, np.concatenate([[0.0], np.cumsum(step)]))
    length = float(line.distance[-1])
    if length < 4 * _STEP:
        return vertices
    count = round(length / _STEP)
    at = np.linspace(0.0, length, count + 1)
    walls = _walls(*line.place(plan), math.ceil(length / _SLICE))
    slices = (np.arange(len(walls)) + 0.5) * _SLICE
    # Median of the slices around a vertex: a niche widens only some of them.
    near = [walls[np.abs(slices - place) <= _STEP] for place in at]
    middle = np.array([np.nanmedian(w, axis=0).mean() if np.isfinite(w).any() else np.nan for w in near])
    seen = np.isfinite(middle)
    return smooth_line(line.point(at, np.where(seen, middle, 0.0)), seen)


def _walls(along: Float, across: Float, count: int) -> Float:
    """Return the positions of the walls (count, 2), m right of the line, in slices across it; NaN where there are no points."""
    number = np.floor(along / _SLICE).astype(np.int64)
    order = np.lexsort((across, number))
    number, across = number[order], across[order]
    first, stop = (np.searchsorted(number, np.arange(count), side=side) for side in ("left", "right"))
    walls = np.full((count, 2), np.nan)
    occupied = stop - first >= _MIN_CELLS
    spare = np.floor(_MAX_OUTLIER_SHARE * (stop - first - 1)).astype(np.int64)
    walls[occupied, 0] = across[(first + spare)[occupied]]
    walls[occupied, 1] = across[(stop - 1 - spare)[occupied]]
    return walls
