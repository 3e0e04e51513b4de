"""Choice between two poses of a scan: how well walls and ladders explain each of its points under either.

The points are the same under both poses, so their differences are compared in pairs, cell by cell: errors of neighbouring
points are correlated (Vuong, 1989, for models that are not nested; cells are its independent observations).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.registration.underwater.ladder_shape import PlacedLadder, nearest_element
from tunneldb.registration.underwater.observations import BEAM_SIGMA, MAX_RANGE, RANGE_NOISE, RELIEF, Pose, cell_keys
from tunneldb.registration.underwater.walls import Walls

HALF_EXPLAINED_SIGMA = 3.0  # standard deviations at which a point is explained by half
WALL_REACH = 1.0  # m in plan, of a wall
UNEXPLAINED = 1e4  # squared standard deviations of a point that is at no wall
CELL = 0.25  # m, of a ladder
COLUMN = 0.5  # m in plan, of a wall: its plan is the same at all heights
REACH = 0.15  # m around a ladder
MIN_MARGIN = 3.0  # standard deviations
PROFILE_REACH, PROFILE_SIGMA = 0.3, 0.02  # m in plan; m, half of the distance of its points


@dataclass(frozen=True)
class Evidence:
    """Evidence of points for a pose.

    Attributes
    ----------
    ratio : (n,) float64 array
        Log likelihood ratio that walls or ladders explain a point, or an outlier. NaN if undefined: the point is too far away,
        or the laser shows no wall there.
    ladder : (n,) bool array
        True if a ladder explains the point best.
    walls : (n,) float64 array
        The ratio by walls alone.
    """

    ratio: Float
    ladder: Bool
    walls: Float

    @property
    def by_walls(self) -> Evidence:
        """The same without ladders."""
        return Evidence(self.walls, np.zeros(len(self.walls), np.bool_), self.walls)


def explained(points: Float, upright: Bool, pose: Pose, walls: Walls, ladders: Sequence[PlacedLadder]) -> Evidence:
    """Return the evidence of points (n, 3), file's axes, for a pose.

    ``upright`` (n,) is True on upright surfaces. Where the laser shows the canal but no wall there, they are evidence against
    the pose.
    """
    space = pose.apply(points)
    reach = np.linalg.norm(space - pose.translation, axis=1)
    best = np.full(len(points), np.inf)
    usable = reach < MAX_RANGE
    away, piece = walls.tree.query(space[:, :2])
    near, shown = away < WALL_REACH, away < walls.widths[1]
    known = near & ~walls.rough[piece]
    sigma = np.sqrt(RANGE_NOISE**2 + RELIEF**2 + walls.profile.sigma(space[:, 2]) ** 2)
    best[known] = (walls.distance(space[known], piece[known]) / sigma[known]) ** 2
    best[~known & (near | (upright & shown))] = UNEXPLAINED  # before rock or behind it, or an upright surface in open water
    profile_away, _ = walls.profile.tree.query(space[:, :2], distance_upper_bound=PROFILE_REACH)
    there = np.isfinite(profile_away)
    best[there] = np.minimum(best[there], (profile_away[there] / np.hypot(sigma[there], PROFILE_SIGMA)) ** 2)
    by_walls = _log_ratio(best, usable)
    by_ladder = np.zeros(len(points), np.bool_)
    for placed in ladders:
        own = placed.to_ladder(space)
        low, high = placed.ladder.height[0] - REACH, placed.ladder.height[-1] + REACH
        near = (np.abs(own[:, 0]) < placed.gap / 2.0 + REACH) & (np.abs(own[:, 2]) < REACH)
        near &= (own[:, 1] > low) & (own[:, 1] < high)
        if near.any():
            deviation = _ladder_deviation(own[near], placed, pose)
            by_ladder[near] |= deviation < best[near]
            best[near] = np.minimum(best[near], deviation)
    return Evidence(_log_ratio(best, usable), by_ladder, by_walls)


def _log_ratio(deviation: Float, usable: Bool) -> Float:
    """Return log likelihood ratios (n,) of squared deviations (n,), in standard deviations; NaN if undefined."""
    ratio = HALF_EXPLAINED_SIGMA**2 / (2.0 * (1.0 + deviation / HALF_EXPLAINED_SIGMA**2))
    return np.where(usable & np.isfinite(deviation), ratio, np.nan)


def _ladder_deviation(own: Float, placed: PlacedLadder, pose: Pose) -> Float:
    """Return squared distances (n,) of points in the ladder's axes from it, in standard deviations of beam and range."""
    which, away = nearest_element(own, placed)
    ray = own - placed.to_ladder(pose.translation[None])
    reach = np.linalg.norm(ray, axis=1)
    axis = np.where(which < 2, 1, 0)
    ray[np.arange(len(ray)), axis] = 0.0
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    vector = away + placed.radius(which)[:, None] * ray
    along = (vector * ray).sum(axis=1)
    across = np.maximum((vector**2).sum(axis=1) - along**2, 0.0)
    return np.asarray((along / RANGE_NOISE) ** 2 + across / (BEAM_SIGMA * reach) ** 2)


@dataclass(frozen=True)
class Cells:
    """Cells of points, within which errors are correlated; numbered from 0.

    Attributes
    ----------
    column, cube : (n,) int arrays
        Upright column, for points of walls, and cube, for points of ladders. Cubes have numbers after those of columns.
    count : int
        Number of all.
    """

    column: Int64
    cube: Int64
    count: int

    @classmethod
    def of(cls, points: Float) -> Cells:
        """Find the cells of points (n, 3)."""
        columns, column = np.unique(cell_keys(points * [1.0, 1.0, 0.0], COLUMN), return_inverse=True)
        cubes, cube = np.unique(cell_keys(points, CELL), return_inverse=True)
        return cls(column, cube + len(columns), len(columns) + len(cubes))


def margin(cells: Cells, one: Evidence, other: Evidence) -> float:
    """Return by how many standard deviations one pose explains points better than another.

    Only points that both poses explain are included: walls that are known farther along under one pose are no evidence.
    """
    difference = one.ratio - other.ratio
    both = np.isfinite(difference)
    cell = np.where(one.ladder | other.ladder, cells.cube, cells.column)[both]
    count = np.bincount(cell, minlength=cells.count)
    total = np.bincount(cell, difference[both], minlength=cells.count)
    mean = total[count > 0] / count[count > 0]
    spread = float(np.sqrt((mean**2).sum()))
    return float(mean.sum()) / spread if spread > 0.0 else 0.0
