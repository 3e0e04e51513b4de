"""Plan of the walls at the waterline, as the laser sees it: piers, recesses and corners, not only straight pieces of wall.

Frame: local, m, z up and zero at the water's level.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.robust import MAD_TO_SIGMA

FOOT, HEAD = 0.02, 0.35  # heights of the laser's points, m
CELLS = (0.04, 0.12)  # m in plan
MIN_POINTS, MIN_HEIGHT = 3, 0.08  # of a cell; m between its lowest and highest point
NORMAL_RADIUS, NORMAL_CELLS = 4.0, 4  # of the cells that give a normal, in cells; their least number
MAX_FLATNESS = 0.35  # ratio of the spreads across and along
UPPER_FOOT, UPPER_HEAD = 0.5, 0.8  # heights, m, of the points that show how the plan changes with height
STRETCH = 4.0  # m of wall that may have one batter; lumps of rock are shorter
MAX_CHANGE = 0.4  # m


@dataclass(frozen=True)
class Profile:
    """Plan of the walls at the waterline.

    Attributes
    ----------
    place : (k, 2) float64 array
        Points of the plan, m.
    normal : (k, 2) float64 array
        Unit normals, of either sign.
    growth : float
        Standard deviation of the plan's change per root of the change of height, m/√m: small for masonry, large for rock.
    """

    place: Float
    normal: Float
    growth: float

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree of the points."""
        return cKDTree(self.place)

    def sigma(self, height: Float) -> Float:
        """Return the standard deviation (n,) of the plan's place at heights (n,), m."""
        return np.asarray(self.growth * np.sqrt(np.abs(height)))


def find_profile(points: Float) -> Profile:
    """Return the plan of the laser's points (n, 3), in fine cells, and in wider ones where points are few."""
    low = points[(points[:, 2] > FOOT) & (points[:, 2] < HEAD)]
    place, normal = np.zeros((0, 2)), np.zeros((0, 2))
    for cell in CELLS:
        some = _upright_cells(low, cell)
        if len(place) and len(some):
            some = some[cKDTree(place).query(some)[0] > 2.0 * cell]
        direction, _, flat = line_normals(some, NORMAL_RADIUS * cell)
        place, normal = np.concatenate([place, some[flat]]), np.concatenate([normal, direction[flat]])
    return Profile(place, normal, _growth(points, place, normal))


def _upright_cells(points: Float, edge: float) -> Float:
    """Return the mean places (k, 2) of the cells in plan whose points reach from low to high."""
    if len(points) == 0:
        return np.zeros((0, 2))
    cell = np.floor(points[:, :2] / edge).astype(np.int64)
    _, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    number = number.ravel()
    low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(low, number, points[:, 2])
    np.maximum.at(high, number, points[:, 2])
    mean = np.column_stack([np.bincount(number, points[:, k]) for k in (0, 1)]) / count[:, None]
    return np.asarray(mean[(count >= MIN_POINTS) & (high - low > MIN_HEIGHT)])


def line_normals(place: Float, radius: float) -> tuple[Float, Float, Bool]:
    """Return normals (k, 2) of lines through neighbouring places (k, 2), the places' distances from these, and if these fit.

    A place is compared with those within ``radius`` m.
    """
    if len(place) == 0:
        return place, np.zeros(0), np.zeros(0, np.bool_)
    about = cKDTree(place).query_pairs(radius, output_type="ndarray")
    ends: Int64 = np.concatenate([about, about[:, ::-1], np.repeat(np.arange(len(place)), 2).reshape(-1, 2)])
    count = np.bincount(ends[:, 0], minlength=len(place))
    mean = np.column_stack([np.bincount(ends[:, 0], place[ends[:, 1], k], len(place)) for k in (0, 1)]) / count[:, None]
    away = place[ends[:, 1]] - mean[ends[:, 0]]
    moments = np.empty((len(place), 2, 2))
    for a, b in ((0, 0), (0, 1), (1, 1)):
        moments[:, a, b] = moments[:, b, a] = np.bincount(ends[:, 0], away[:, a] * away[:, b], len(place)) / count
    value, vector = np.linalg.eigh(moments)
    fits = (count >= NORMAL_CELLS) & (value[:, 0] < MAX_FLATNESS**2 * value[:, 1])
    return np.asarray(vector[:, :, 0]), np.sqrt(np.maximum(value[:, 0], 0.0)), np.asarray(fits)


def _growth(points: Float, place: Float, normal: Float) -> float:
    """Return how much the plan changes with height, apart from a common batter of each stretch; m/√m."""
    if len(place) == 0:
        return 0.0
    upper = _upright_cells(points[(points[:, 2] > UPPER_FOOT) & (points[:, 2] < UPPER_HEAD)], CELLS[0])
    if len(upper) == 0:
        return 0.0
    away, k = cKDTree(place).query(upper, distance_upper_bound=MAX_CHANGE)
    near = np.isfinite(away)
    if not near.any():
        return 0.0
    k = k[near]
    change = np.abs(((upper[near] - place[k]) * normal[k]).sum(axis=1))
    _, stretch = np.unique(np.floor(place[k] / STRETCH).astype(np.int64), axis=0, return_inverse=True)
    stretch = stretch.ravel()
    order = np.lexsort([change, stretch])
    begin = np.searchsorted(stretch[order], np.arange(stretch.max() + 1))
    middle = change[order][begin + np.bincount(stretch) // 2]
    spread = MAD_TO_SIGMA * float(np.median(np.abs(change - middle[stretch])))
    rise = 0.5 * (UPPER_FOOT + UPPER_HEAD - FOOT - HEAD)
    return spread / float(np.sqrt(rise))
