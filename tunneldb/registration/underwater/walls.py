"""Walls at the waterline, from the laser's points above it, extrapolated below it.

Frame: local, m, z up and zero at the water's level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.errors import UserError
from tunneldb.registration.underwater.profile import Profile, find_profile
from tunneldb.robust import MAD_TO_SIGMA

SPACING = 0.5  # m between anchors along a wall
REACH = 0.8  # half length of wall fitted at an anchor, m
FOOT, HEAD = 0.02, 1.5  # heights, m, between which a wall is fitted
MIN_HEIGHT = 0.25  # least height of the fitted points, m
MAX_BATTER = 0.3  # batter, tangent
MAX_ROUGHNESS = 0.04  # m, of a wall that continues below the water as a plane
MAX_ROUGH_SHARE = 0.5  # share of rough pieces from which the walls are rock: its smooth pieces are no planes either
MAX_ROCK_ROUGHNESS = 0.3  # m, of a wall that is only known by its plan
WIDTH_QUANTILES = (0.05, 0.95)  # of the widths that occur
MIN_EDGE_POINTS = 200  # for the lower edge of the walls
MIN_POINTS = 12
MIN_WIDTH, MAX_WIDTH = 2.0, 40.0  # canal, m
TUKEY = 4.685
MAX_WALL_DISTANCE = 0.05  # m
EDGE_BIN = 0.02  # m of height, for the lower edge of the walls
COURSE_REACH, COURSE_COSINE = 4.0, 0.9  # m; of the normals of one wall
CANAL_REACH = 8.0  # m in plan: longer than piers and recesses
EDGE_REACH = 5  # bins below and above a height that are compared
STEP_SIGMA = 6.0  # of their difference, from which it is no accident
LEAST_STEP = 1.15  # ratio of points above and below it from which a height is the lower edge; at grazing rays most are mirrored
USUAL_HEIGHTS = (0.1, 0.6)  # heights, m, between which walls have their usual point density


@dataclass(frozen=True)
class Walls:
    """Pieces of wall: lines at the waterline with a batter.

    Attributes
    ----------
    foot : (k, 3) float64 array
        Points of the walls at the water level, m.
    normal : (k, 2) float64 array
        Horizontal unit normals, towards the water.
    batter : (k,) float64 array
        Inclination of the wall, backwards per metre of height: it lies at ``-batter * z`` along the normal.
    sigma, sigma_batter : (k,) float64 arrays
        Standard deviations of the foot along the normal, m, and of the batter.
    side : (k,) int64 array
        Index of the wall that a piece belongs to.
    rough : (k,) bool array
        True for rock: the wall does not continue below the water as a plane.
    profile : Profile
        Plan of the walls at the waterline, with its piers and recesses.
    course : (k, 2) float64 array
        Unit normals of the course of the wall. A piece's own normal follows dents of the wall and errors of its fit, which
        tell nothing about the place along it.
    along : (k,) bool array
        True for pieces along the canal. A change of batter of a side below the water is theirs; ends, flanks and noses of piers
        across the canal are other structures.
    """

    foot: Float
    normal: Float
    batter: Float
    sigma: Float
    sigma_batter: Float
    side: Int64
    rough: Bool
    profile: Profile
    course: Float
    along: Bool

    @cached_property
    def tree(self) -> cKDTree:
        """Search tree of the feet in plan."""
        return cKDTree(self.foot[:, :2])

    def some(self, keep: Bool) -> Walls:
        """Return the pieces of a mask (k,)."""
        return Walls(
            self.foot[keep], self.normal[keep], self.batter[keep], self.sigma[keep], self.sigma_batter[keep], self.side[keep],
            self.rough[keep], self.profile, self.course[keep], self.along[keep],
        )  # fmt: skip

    def distance(self, points: Float, piece: Int64) -> Float:
        """Return the distance (n,), m, of points (n, 3) in front of the pieces (n,), square to the wall."""
        away = ((points[:, :2] - self.foot[piece, :2]) * self.normal[piece]).sum(axis=1) + self.batter[piece] * points[:, 2]
        return np.asarray(away / np.sqrt(1.0 + self.batter[piece] ** 2))

    def leaning(self, change: Float) -> Walls:
        """Return the walls with a change (2,) of the batter of either side."""
        return replace(self, batter=self.batter + change[self.side] * self.along)

    def normals(self, piece: Int64) -> Float:
        """Return the unit normals (n, 3) of pieces (n,), towards the water."""
        out = np.column_stack([self.normal[piece], self.batter[piece]])
        return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])

    @cached_property
    def widths(self) -> tuple[float, float]:
        """Least and greatest usual distance between the two sides at the waterline, m."""
        distance, opposite = _opposite(self.foot, self.normal)
        low, high = np.quantile(distance[opposite], WIDTH_QUANTILES)
        return float(low), float(high)


def find_walls(points: Float) -> Walls:
    """Fit the walls at the waterline to the laser's points (n, 3).

    Raises
    ------
    UserError
        If no wall reaches down to the water, or only on one side.
    """
    near = points[(points[:, 2] > FOOT) & (points[:, 2] < HEAD)]
    low = near[near[:, 2] < MIN_HEIGHT]
    cells = np.unique(np.floor(low[:, :2] / SPACING), axis=0)
    found = []
    if len(cells):
        tree, low_tree = cKDTree(near[:, :2]), cKDTree(low[:, :2])
        for centre in (cells + 0.5) * SPACING:
            piece = _fit(near, low, tree, low_tree, centre)
            if piece is not None:
                found.append(piece)
    if not found:
        raise UserError(
            "no wall reaches down to the water in the laser's points; check --water-level (in the tunnel's height system)"
        )
    table = np.array(found)
    rough = table[:, 8] > MAX_ROUGHNESS
    foot, normal = table[:, :3], table[:, 3:5]
    walls = Walls(
        foot,
        normal,
        table[:, 5],
        table[:, 6],
        table[:, 7],
        np.zeros(len(foot), np.int64),
        rough | (rough.mean() > MAX_ROUGH_SHARE),
        find_profile(points),
        normal,
        np.ones(len(foot), np.bool_),
    )
    oriented = _orient(walls)
    return replace(oriented, course=_course(oriented), along=_along(oriented))


def lower_edge(points: Float, walls: Walls) -> float:
    """Return the height, m, down to which laser points (n, 3) show the walls: where they become fewer, or end.

    Only ``points`` are examined; mirror images of the walls in the water are fewer than the points of the walls: at
    grazing rays not by much. 0 if there are too few, as on rock.
    """
    low = points[points[:, 2] < USUAL_HEIGHTS[1]]
    away, piece = walls.tree.query(low[:, :2], distance_upper_bound=2.0 * SPACING)
    known = np.isfinite(away)
    low, piece = low[known], piece[known]
    height = low[(np.abs(walls.distance(low, piece)) < MAX_WALL_DISTANCE) & ~walls.rough[piece], 2]
    if len(height) < MIN_EDGE_POINTS:
        return 0.0
    bins = np.arange(np.floor(height.min() / EDGE_BIN), USUAL_HEIGHTS[1] / EDGE_BIN + 0.5) * EDGE_BIN
    count, _ = np.histogram(height, bins)
    usual = float(np.median(count[bins[:-1] > USUAL_HEIGHTS[0]]))
    lowest = int(np.argmax(count > 0.5 * usual))
    if bins[lowest] >= -EDGE_REACH * EDGE_BIN:
        return float(bins[lowest])
    steps = bins[lowest + EDGE_REACH :][_steps(count[lowest:])]
    return float(steps[np.argmin(np.abs(steps))] if len(steps) else bins[lowest])


def _steps(count: Int64) -> Int64:
    """Return the bins, from EDGE_REACH on, from which there are more points than below; their numbers less EDGE_REACH."""
    sums = np.concatenate([[0], np.cumsum(count)])
    at = np.arange(EDGE_REACH, len(count) - EDGE_REACH + 1)
    above, below = sums[at + EDGE_REACH] - sums[at], sums[at] - sums[at - EDGE_REACH]
    ratio = above / np.maximum(below, 1)
    clear = (ratio >= LEAST_STEP) & (above - below > STEP_SIGMA * np.sqrt(above + below))
    return np.flatnonzero(clear & (ratio == maximum_filter1d(ratio, 2 * EDGE_REACH + 1)))


def _fit(near: Float, low: Float, tree: cKDTree, low_tree: cKDTree, centre: Float) -> list[float] | None:
    """Fit a line with batter around a place in plan; return None if there is no wall.

    The result is foot (3), normal (2), batter, their standard deviations (2), and roughness.
    """
    around = low[low_tree.query_ball_point(centre, REACH)]
    if len(around) < MIN_POINTS:
        return None
    middle = around[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(around[:, :2] - middle, full_matrices=False)
    mine = near[tree.query_ball_point(middle, REACH)]
    along = (mine[:, :2] - middle) @ axes[0]
    across = (mine[:, :2] - middle) @ axes[1]
    design = np.column_stack([np.ones(len(mine)), along, mine[:, 2]])
    weight = (mine[:, 2] < MIN_HEIGHT).astype(np.float64)  # not points that begin higher, as behind a towpath
    answer, scale = np.zeros(3), np.inf
    for _ in range(12):
        normal_matrix = design.T @ (design * weight[:, None])
        if np.linalg.cond(normal_matrix) > 1e12:
            return None
        answer = np.linalg.solve(normal_matrix, design.T @ (weight * across))
        residual = across - design @ answer
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(residual[weight > 0.1]))), 1e-3)
        weight = np.clip(1.0 - (residual / (TUKEY * scale)) ** 2, 0.0, None) ** 2
    used = mine[weight > 0.1]
    if len(used) < MIN_POINTS or np.ptp(used[:, 2]) < MIN_HEIGHT or np.ptp(along[weight > 0.1]) < SPACING:
        return None
    if scale > MAX_ROCK_ROUGHNESS or abs(answer[2]) > MAX_BATTER:
        return None
    # Stones are some decimetres wide: their relief averages out with the number of stones, not of points.
    stones = max(np.ptp(used[:, 2]) * np.ptp(along[weight > 0.1]) / 0.3**2, 1.0)
    covariance = np.linalg.inv(design.T @ (design * weight[:, None])) * len(used) * scale**2 / stones
    line = np.array([1.0, answer[1]]) / np.hypot(1.0, answer[1])
    direction = line[0] * axes[0] + line[1] * axes[1]
    normal = np.array([-direction[1], direction[0]])
    foot = middle + answer[0] * axes[1]
    sign = np.sign(normal @ axes[1])
    sigma, sigma_batter = np.sqrt(covariance[[0, 2], [0, 2]])
    return [*foot, 0.0, *normal, -answer[2] * sign * line[0], sigma, sigma_batter, scale]


def _course(walls: Walls) -> Float:
    """Return the mean normals (k, 2) of the pieces within COURSE_REACH of each that face the same way."""
    near = walls.tree.query_pairs(COURSE_REACH, output_type="ndarray")
    i, j = np.concatenate([near, near[:, ::-1]]).T
    same = (walls.normal[i] * walls.normal[j]).sum(axis=1) > COURSE_COSINE
    i, j = i[same], j[same]
    total = walls.normal + np.column_stack([np.bincount(i, walls.normal[j, k], len(walls.normal)) for k in (0, 1)])
    return np.asarray(total / np.linalg.norm(total, axis=1)[:, None])


def _along(walls: Walls) -> Bool:
    """Return True for the pieces (k,) that face across the canal, as most pieces within CANAL_REACH do, on either side."""
    near = walls.tree.query_pairs(CANAL_REACH, output_type="ndarray")
    i, j = np.concatenate([near, near[:, ::-1]]).T
    twice = 2.0 * np.arctan2(walls.normal[:, 1], walls.normal[:, 0])  # opposite normals are the same direction
    own = np.exp(1j * twice)
    count = len(twice)
    total = own + np.bincount(i, own.real[j], count) + 1j * np.bincount(i, own.imag[j], count)
    return np.asarray(np.cos(0.5 * np.angle(own * np.conj(total))) > COURSE_COSINE)


def _opposite(foot: Float, normal: Float) -> tuple[Float, Bool]:
    """Return the distance, m, of each piece to the opposite wall along its normal, and whether there is one."""
    near = cKDTree(foot[:, :2]).query_pairs(MAX_WIDTH + 2.0 * SPACING, output_type="ndarray")
    i, j = np.concatenate([near, near[:, ::-1]]).T
    away = foot[j, :2] - foot[i, :2]
    ahead = (away * normal[i]).sum(axis=1)
    lateral = np.abs(away[:, 0] * -normal[i, 1] + away[:, 1] * normal[i, 0])
    facing = (ahead > MIN_WIDTH) & (ahead < MAX_WIDTH) & (lateral < 2.0 * SPACING)
    distance = np.full(len(foot), np.inf)
    np.minimum.at(distance, i[facing], ahead[facing])
    return distance, np.isfinite(distance)


def _orient(walls: Walls) -> Walls:
    """Turn normals to the water, keep the pieces that face each other, and assign the sides."""
    ahead, some_ahead = _opposite(walls.foot, walls.normal)
    behind, some_behind = _opposite(walls.foot, -walls.normal)
    turn = np.where(behind < ahead, -1.0, 1.0)
    keep = some_ahead | some_behind
    if not keep.any():
        raise UserError("the laser's points show only one of the two walls at the water; both are needed")
    turned = replace(walls, normal=walls.normal * turn[:, None], batter=walls.batter * turn).some(keep)
    pairs = turned.tree.query_pairs(3.0 * SPACING, output_type="ndarray")
    same = (turned.normal[pairs[:, 0]] * turned.normal[pairs[:, 1]]).sum(axis=1) > 0.5
    links = pairs[same]
    count = len(turned.foot)
    _, label = connected_components(coo_array((np.ones(len(links)), links.T), (count, count)), directed=False)
    # Pieces separated by a gap are on the same side if they face the same way.
    main = np.linalg.svd(turned.foot[:, :2] - turned.foot[:, :2].mean(axis=0), full_matrices=False)[2][0]
    left = turned.normal @ np.array([-main[1], main[0]]) > 0.0
    sizes = np.bincount(label)
    keep = sizes[label] >= 3
    if not (keep & left).any() or not (keep & ~left).any():
        raise UserError("the laser's points show only one of the two walls at the water; both are needed")
    return replace(turned, side=left.astype(np.int64)).some(keep)
