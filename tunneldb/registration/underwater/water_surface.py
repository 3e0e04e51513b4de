"""The water's surface in a sonar scan, seen from below: as a flat surface, or as a mirror that repeats the bed above it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.robust import MAD_TO_SIGMA

CELL = 0.5  # m in plan
MIN_POINTS, MIN_CELLS = 4, 8  # of a cell, above and below; of such cells
MIN_UP = 0.15  # m above or below the sonar
SHARE_INSIDE = 0.75  # of the width between the walls
MAX_SPREAD = 0.04  # m of a mirror about its plane
MAX_SURFACE_SPREAD = 0.015  # m of the surface about its plane; the flat bottom of a boat beside it makes it uneven
MAX_SPREAD_RATIO = 1.2  # of the surface and the bed: in a scan that is upside down the bed is above
MAX_EDGE_ERROR = 0.2  # m between the surface and the upper edges of the walls
MAX_WATER_SPREAD, MIN_BED_RATIO = 0.015, 4.0  # m; ratio of a bed's spread to the water's from which they are told apart
MIN_SURFACE_SPREAD = 0.005  # m about the plane of a surface that is searched
MIN_SURFACE_NOISE = 0.001  # m of a cell's mean, which ripples change little while the scan lasts
MIN_FILLING = 0.25  # least number of points of a cell, relative to the median: cells at the rim of the ring are less certain
ROUNDS = 10

Cells = dict[tuple[int, int], tuple[float, float, float, float]]


@dataclass(frozen=True)
class Level:
    """Points (k, 3) of a scan at the water's level, file's axes, and the standard deviation of one of them, m."""

    points: Float
    noise: float


def surface_noise(surface: Float) -> float:
    """Return the standard deviation, m, of points (k, 3) of the water's surface about their plane."""
    return _plane(surface, MIN_SURFACE_NOISE)[1]


def find_surface(points: Float, walls: tuple[float, float], top: float) -> Float:
    """Return points (k, 3) of the surface in a level scan (n, 3), z up; none if it does not show.

    Parameters
    ----------
    walls : (float, float)
        Positions y of the walls.
    top : float
        Height of the upper edges of the walls, m.
    """
    high, low = _above_and_below(points, walls)
    near_top, _ = _above_and_below(points[np.abs(points[:, 2] - top) < MAX_EDGE_ERROR], walls)
    both = {cell: _middle(point, low[cell]) for cell, point in high.items() if cell in low}
    surface, mirror, (_, bed_spread) = _flat(_points(near_top)), _flat(_points(both)), _flat(_points(low))
    limits = (MAX_SURFACE_SPREAD, MAX_SPREAD)
    shown = [
        points
        for (points, spread), limit in zip((surface, mirror), limits, strict=True)
        if spread < min(limit, MAX_SPREAD_RATIO * bed_spread)
    ]
    fitting = [one for one in shown if abs(float(np.median(one[:, 2])) - top) < MAX_EDGE_ERROR]
    return _filled(min(fitting, key=lambda one: abs(float(np.median(one[:, 2])) - top), default=np.zeros((0, 4))))


def _filled(cells: Float) -> Float:
    """Return the points (k, 3) of cells (n, 4) without those that have few points."""
    if len(cells) == 0:
        return np.zeros((0, 3))
    return np.asarray(cells[cells[:, 3] >= MIN_FILLING * np.median(cells[:, 3]), :3])


def is_upside_down(points: Float, walls: tuple[float, float]) -> bool:
    """Return True if what is below the sonar in a level scan (n, 3) is a surface of water, and what is above it is a bed."""
    above, below = _above_and_below(points, walls)
    (_, upper), (_, lower) = _flat(_points(above)), _flat(_points(below))
    return bool(np.isfinite(upper) and lower < MAX_WATER_SPREAD and MIN_BED_RATIO * lower < upper)


def _above_and_below(points: Float, walls: tuple[float, float]) -> tuple[Cells, Cells]:
    """Return the cells above and below the sonar, away from the walls."""
    middle, half = 0.5 * (walls[0] + walls[1]), 0.5 * SHARE_INSIDE * (walls[1] - walls[0])
    mine = points[np.abs(points[:, 1] - middle) < half]
    return _cells(mine[mine[:, 2] > MIN_UP]), _cells(mine[mine[:, 2] < -MIN_UP])


def _cells(points: Float) -> Cells:
    """Return the mean of the middle half by height of the points (n, 3) of each cell, and their number, by the cell's number.

    The surface is seen in a ring above the sonar, so that points lie on one side of a cell. At the cell's centre they would
    give a wrong slope in a scan that is not yet level; so would heights and places of different points.
    """
    if len(points) == 0:
        return {}
    cell = np.floor(points[:, :2] / CELL).astype(np.int64)
    names, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    number = number.ravel()
    order = np.lexsort([points[:, 2], number])
    rank = np.arange(len(points)) - np.repeat(np.cumsum(count) - count, count)
    quarter = count[number[order]] // 4
    middle = order[(rank >= quarter) & (rank < count[number[order]] - quarter)]
    used = np.bincount(number[middle])
    mean = np.column_stack([np.bincount(number[middle], points[middle, k]) / used for k in range(3)])
    many = count >= MIN_POINTS
    found = np.column_stack([mean, count])[many].tolist()
    return {(int(i), int(j)): (x, y, z, n) for (i, j), (x, y, z, n) in zip(names[many], found, strict=True)}


def _middle(
    one: tuple[float, float, float, float], other: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """Return the midpoint of two cells, with the lesser number of points."""
    x, y, z = (0.5 * (a + b) for a, b in zip(one[:3], other[:3], strict=True))
    return x, y, z, min(one[3], other[3])


def _points(cells: Cells) -> Float:
    """Return cells as (n, 4): place, height and number of points."""
    return np.array(list(cells.values())).reshape(-1, 4)


def _flat(points: Float) -> tuple[Float, float]:
    """Return the cells that lie on a plane, places first, and their spread about it, m; infinite if they are few."""
    if len(points) < MIN_CELLS:
        return points[:0], np.inf
    residual, scale = _plane(points, MIN_SURFACE_SPREAD)
    on_plane = np.abs(residual) < 3.0 * scale
    return (points[on_plane], scale) if on_plane.sum() >= MIN_CELLS else (points[:0], np.inf)


def _plane(points: Float, least: float) -> tuple[Float, float]:
    """Return the heights (n,) of points over a plane fitted to most of them, and their spread, m, at least ``least``."""
    design = np.column_stack([np.ones(len(points)), points[:, :2]])
    answer, scale = np.array([float(np.median(points[:, 2])), 0.0, 0.0]), np.inf
    for _ in range(ROUNDS):
        residual = points[:, 2] - design @ answer
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(residual))), least)
        weight = 1.0 / (1.0 + (residual / (2.0 * scale)) ** 2) ** 2
        weighted = design * weight[:, None]
        answer = np.linalg.lstsq(weighted.T @ design, weighted.T @ points[:, 2], rcond=None)[0]
    return np.asarray(points[:, 2] - design @ answer), scale
