"""The water's surface in a sonar scan, seen from below: as a flat surface, or as a mirror that repeats the bed above it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.robust import MAD_TO_SIGMA

CELL = 0.5  # m in plan
MIN_POINTS, MIN_CELLS = 4, 12  # of a cell, above and below; of such cells
MIN_UP = 0.15  # m above or below the sonar
SHARE_INSIDE = 0.75  # of the width between the walls
MAX_SPREAD = 0.04  # m of the surface about its plane
MAX_SPREAD_RATIO = 1.2  # of the surface and the bed: in a scan that is upside down the bed is above
MAX_EDGE_ERROR = 0.2  # m between the surface and the upper edges of the walls
MAX_WATER_SPREAD, MIN_BED_RATIO = 0.015, 4.0  # m; ratio of a bed's spread to the water's from which they are told apart
MIN_SURFACE_NOISE = 0.005  # m: ripples
ROUNDS = 10

Place = tuple[float, float]


@dataclass(frozen=True)
class Level:
    """Points (k, 3) of a scan at the water's level, file's axes, and the standard deviation of one of them, m."""

    points: Float
    noise: float


def surface_noise(surface: Float) -> float:
    """Return the standard deviation, m, of points (k, 3) of the water's surface about their plane."""
    return _flat({(x, y): z for x, y, z in surface.tolist()})[1]


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
    both = {place: 0.5 * (z + low[place]) for place, z in high.items() if place in low}
    surface, mirror, (_, bed_spread) = _flat(near_top), _flat(both), _flat(low)
    shown = [points for points, spread in (surface, mirror) if spread < min(MAX_SPREAD, MAX_SPREAD_RATIO * bed_spread)]
    fitting = [one for one in shown if abs(float(np.median(one[:, 2])) - top) < MAX_EDGE_ERROR]
    return min(fitting, key=lambda one: abs(float(np.median(one[:, 2])) - top), default=np.zeros((0, 3)))


def is_upside_down(points: Float, walls: tuple[float, float]) -> bool:
    """Return True if what is below the sonar in a level scan (n, 3) is a surface of water, and what is above it is a bed."""
    above, below = _above_and_below(points, walls)
    (_, upper), (_, lower) = _flat(above), _flat(below)
    return bool(np.isfinite(upper) and lower < MAX_WATER_SPREAD and MIN_BED_RATIO * lower < upper)


def _above_and_below(points: Float, walls: tuple[float, float]) -> tuple[dict[Place, float], dict[Place, float]]:
    """Return the heights of cells above and below the sonar, away from the walls."""
    middle, half = 0.5 * (walls[0] + walls[1]), 0.5 * SHARE_INSIDE * (walls[1] - walls[0])
    mine = points[np.abs(points[:, 1] - middle) < half]
    return _cells(mine[mine[:, 2] > MIN_UP]), _cells(mine[mine[:, 2] < -MIN_UP])


def _cells(points: Float) -> dict[Place, float]:
    """Return the median height of each cell, by its centre."""
    if len(points) == 0:
        return {}
    cell = np.floor(points[:, :2] / CELL).astype(np.int64)
    names, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    order = np.lexsort([points[:, 2], number.ravel()])
    begin = np.concatenate([[0], np.cumsum(count)[:-1]])
    height = points[order, 2][begin + count // 2]
    return {
        (float((x + 0.5) * CELL), float((y + 0.5) * CELL)): float(z)
        for (x, y), z, n in zip(names, height, count, strict=True)
        if n >= MIN_POINTS
    }


def _flat(cells: dict[Place, float]) -> tuple[Float, float]:
    """Return the cells (k, 3) that lie on a plane, and their spread about it, m; infinite if they are few."""
    points = np.array([[x, y, z] for (x, y), z in cells.items()]).reshape(-1, 3)
    if len(points) < MIN_CELLS:
        return points[:0], np.inf
    design = np.column_stack([np.ones(len(points)), points[:, :2]])
    answer, scale = np.array([float(np.median(points[:, 2])), 0.0, 0.0]), np.inf
    for _ in range(ROUNDS):
        residual = points[:, 2] - design @ answer
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(residual))), MIN_SURFACE_NOISE)
        weight = 1.0 / (1.0 + (residual / (2.0 * scale)) ** 2) ** 2
        weighted = design * weight[:, None]
        answer = np.linalg.lstsq(weighted.T @ design, weighted.T @ points[:, 2], rcond=None)[0]
    on_plane = np.abs(points[:, 2] - design @ answer) < 3.0 * scale
    return (points[on_plane], scale) if on_plane.sum() >= MIN_CELLS else (points[:0], np.inf)
