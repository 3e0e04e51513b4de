"""Joint robust adjustment of all sonar scans: poses, scales, ladders and the walls' batter below the water.

Gauss-Newton with Geman-McClure weights. Rows of one group (a stretch of wall, a rung) have correlated errors, which the
covariance takes into account (Liang and Zeger, 1986, cluster-robust sandwich estimate; Bell and McCaffrey, 2002, for few
groups).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float, Int64
from tunneldb.registration.underwater.ladder_shape import PlacedLadder
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import (
    POSE,
    Patches,
    Pose,
    Rows,
    ladder_rows,
    overlap_rows,
    profile_rows,
    wall_rows,
    waterline_rows,
)
from tunneldb.registration.underwater.sound_speed import sound_rows
from tunneldb.registration.underwater.walls import Walls
from tunneldb.registration.underwater.water_surface import Level

SCALE_SIGMA = 0.01  # prior standard deviation of the range scale: 15 m/s of 1480
BATTER_SIGMA = 0.05  # prior standard deviation of the change of batter at the water
# Share of a bar's radius between its near surface and the origin of its echo: the mean of Lambert's law over a round bar,
# 1 - (4/3) / (pi/2); and its uncertainty under other laws.
DEPTH_SHARE, DEPTH_SPREAD = 1.0 - (4.0 / 3.0) / (np.pi / 2.0), 0.2
WATERLINE_SIGMA = 0.03  # m: common offset of the water in all scans from the level that is given
WATERLINE_FREEDOM = 3.0  # degrees of freedom of that offset
WATERLINE_FIRM_SIGMA = 0.0003  # m: nearly fixed where no ladder shows it; its uncertainty enters the covariance only
# Prior standard deviations of the sonar's zero on masonry, from stones and joints in its beam, m: some of RELIEF. Walls
# separate it from scale as poorly as ladders do, so it is nearly fixed, and its uncertainty enters the covariance only.
ZERO_SIGMA, ZERO_PRIOR_SIGMA = 0.0015, 0.0003
# Slant effect of walls and of the bed (nearer_by_slant): between none and that of the strongest cell on a smooth surface.
SLANT_USUAL, SLANT_SIGMA = 1.5, 1.0
NEARER_SIGMA = (0.0005, 0.002)  # of the shares by which relief of walls and of the bed seems nearer along the canal
# Parameters common to all scans except those of ladders: changes of batter of either side, depth behind a bar's near
# surface, height of the waterline, zero on masonry, two slants, two of those shares, mean range scale less 1
COMMON = 10
LADDER_TURN, LADDER_SHIFT = 0.0005, 0.002  # least standard deviations of a ladder by the laser, rad and m
# rad: common error of slanting beams on a rough wall, 0.6 mm over 2 m of its height; not visible in a single scan
SLANT = 0.0003
QUARTER_WEIGHT_SIGMA = 3.0  # standard deviations at which the weight of a row is a quarter
REACHES = (0.3, 0.2, 0.15, 0.12, *[0.1] * 30)  # greatest distance of rows, round by round, m
MAX_CHANGE = 1e-5
MAX_DRIFT = 0.15  # m of plan in one round, of a direction that is hardly determined (Marquardt, 1963)
SURROUNDINGS = 0.6  # m around a ladder, more than the error of a first pose
FIXED_PRECISION = 1e8  # precision of fixed parameters
MAX_SINGULAR_SHARE = 1e-12  # share of the largest eigenvalue up to which a direction is undetermined
UNKNOWN_VARIANCE = 1e4  # variance of such a direction
STATED_KINDS = ("waterline", "sound")  # kinds whose last row has a stated error: the water's mean height, the scale
KEYS_OF_PLACES = {"wall": 0, "scan": 0, "profile": 1}  # kinds whose groups are places, the same in all scans


@dataclass(frozen=True)
class Scan:
    """Sonar scan to be adjusted.

    Attributes
    ----------
    patches, smooth : Patches
        Patches for the comparison with walls, and with other scans.
    columns : Patches
        Columns of upright walls, for the comparison with the plan of the walls.
    level : Level
        Points at the water's level: its surface from below, or the upper edges of the walls.
    pose : Pose
    ladders : mapping of int to (n, 3) float64 array
        Points around each ladder that it sees, file's axes.
    """

    patches: Patches
    smooth: Patches
    columns: Patches
    level: Level
    pose: Pose
    ladders: Mapping[int, Float]


def scan_of(
    points: Float,
    patches: Patches,
    smooth: Patches,
    columns: Patches,
    level: Level,
    pose: Pose,
    ladders: Iterable[int],
    found: Sequence[LaserLadder],
) -> Scan:
    """Return a scan with those of its points (n, 3) that are near some of the ladders found."""
    space = pose.apply(points)
    near = {}
    for k in ladders:
        placed = found[k].placed
        own = placed.to_ladder(space)
        half = placed.gap / 2.0 + SURROUNDINGS
        near[k] = points[(np.abs(own[:, 0]) < half) & (np.abs(own[:, 2]) < SURROUNDINGS)]
    return Scan(patches, smooth, columns, level, pose, near)


@dataclass(frozen=True)
class Adjusted:
    """Result of the adjustment.

    Attributes
    ----------
    poses : tuple of Pose
    covariance : (s, 7, 7) float64 array
        Covariance of the changes of each pose.
    information : (s, 7, 7) float64 array
        Information of the rows alone about each pose, without prior, other poses fixed.
    rows : tuple of Rows
        Rows of the last comparison.
    ladders : tuple of PlacedLadder
        Ladders of the laser, after the adjustment.
    batter : tuple of float
        Change of the batter of each side below the water.
    """

    poses: tuple[Pose, ...]
    covariance: Float
    information: Float
    rows: tuple[Rows, ...]
    ladders: tuple[PlacedLadder, ...]
    batter: tuple[float, float]


@dataclass(frozen=True)
class Fitted:
    """Fitted scans, as in `Adjusted` but without covariance; common parameters, normal matrix, precision of the prior."""

    poses: tuple[Pose, ...]
    rows: tuple[Rows, ...]
    ladders: tuple[PlacedLadder, ...]
    common: Float
    normal: Float
    precision: Float


def adjust(scans: Sequence[Scan], walls: Walls, ladders: Sequence[LaserLadder], pairs: Sequence[tuple[int, int]]) -> Adjusted:
    """Adjust scans to walls and ladders, and to each other for overlapping ``pairs``."""
    fitted = fit(scans, walls, ladders, pairs, REACHES)
    spread = fitted.precision.copy()  # precision of the prior, for the covariance
    zero, water = POSE * len(scans) + 4, POSE * len(scans) + 3
    spread[zero, zero] *= (ZERO_SIGMA / ZERO_PRIOR_SIGMA) ** 2
    spread[water, water] *= max((WATERLINE_SIGMA * np.sqrt(spread[water, water])) ** 2, 1.0)
    covariance = _sandwich(fitted.rows, fitted.normal, fitted.precision, spread)
    blocks = [slice(POSE * i, POSE * (i + 1)) for i in range(len(scans))]
    for block in blocks:
        turns = range(block.start, block.start + 3)
        covariance[turns, turns] += SLANT**2
    return Adjusted(
        fitted.poses,
        np.array([covariance[b, b] for b in blocks]).reshape(-1, POSE, POSE),
        np.array([fitted.normal[b, b] for b in blocks]).reshape(-1, POSE, POSE),
        fitted.rows,
        fitted.ladders,
        (float(fitted.common[0]), float(fitted.common[1])),
    )


def fit(
    scans: Sequence[Scan],
    walls: Walls,
    ladders: Sequence[LaserLadder],
    pairs: Sequence[tuple[int, int]],
    reaches: Sequence[float],
    fixed: int = 0,
) -> Fitted:
    """Fit scans to walls, ladders and each other, within decreasing distances, round by round.

    The first ``fixed`` scans are fixed.
    """
    poses = [scan.pose for scan in scans]
    placed = [ladder.placed for ladder in ladders]
    count = POSE * len(scans) + COMMON + 6 * len(ladders)
    radius = max((ladder.placed.ladder.diameter / 2.0 for ladder in ladders), default=0.0)
    usual = np.array([0.0, 0.0, DEPTH_SHARE * radius, 0.0, 0.0, SLANT_USUAL, SLANT_USUAL, 0.0, 0.0, 0.0])
    common = usual.copy()
    common[9] = float(np.median([pose.scale for pose in poses])) - 1.0 if poses else 0.0
    precision = _prior(len(scans), ladders, radius)
    firm, water = not any(scan.ladders for scan in scans), POSE * len(scans) + 3
    plan = np.add.outer(POSE * np.arange(len(scans)), [3, 4]).ravel()
    damping = np.zeros((count, count))
    damping[plan, plan] = 1.0 / MAX_DRIFT**2
    stay = np.arange(POSE * fixed)
    normal, rows = np.eye(count), []
    for reach in reaches:
        rows = _all_rows(scans, poses, walls.leaning(common[:2]), placed, common, pairs, reach, fixed)
        normal, right = _normal_equations(rows, count)
        normal[stay, stay] += FIXED_PRECISION
        offset = _prior_offset(poses, placed, ladders, common - usual)
        offset[stay] = 0.0
        precision[water, water] = 1.0 / WATERLINE_FIRM_SIGMA**2 if firm else _water_precision(float(common[3]))
        change = -_inverse(normal + precision + damping, 0.0) @ (right + precision @ offset)
        change[stay] = 0.0
        for i, pose in enumerate(poses):
            poses[i] = _moved(pose, change[POSE * i : POSE * (i + 1)])
        common += change[POSE * len(scans) : POSE * len(scans) + COMMON]
        for k in range(len(placed)):
            first = POSE * len(scans) + COMMON + 6 * k
            placed[k] = placed[k].moved(change[first : first + 3], change[first + 3 : first + 6])
        if reach == reaches[-1] and np.abs(change).max() < MAX_CHANGE:
            break
    return Fitted(tuple(poses), tuple(rows), tuple(placed), common, normal, precision)


def _all_rows(
    scans: Sequence[Scan],
    poses: Sequence[Pose],
    walls: Walls,
    placed: Sequence[PlacedLadder],
    common: Float,
    pairs: Sequence[tuple[int, int]],
    reach: float,
    fixed: int,
) -> list[Rows]:
    rows: list[Rows] = []
    first = POSE * len(scans)
    for i, scan in enumerate(scans[fixed:], fixed):
        rows += wall_rows(scan.patches, poses[i], walls, common[4:6], i, first + np.array([0, 1, 4, 5]), reach)
        for k, points in scan.ladders.items():
            found = ladder_rows(points, poses[i], placed[k], float(common[2]), i, (first + 2, first + COMMON + 6 * k), reach)
            rows += [found] if found is not None else []
        found = profile_rows(scan.columns, poses[i], walls, i, first + np.arange(2), reach)
        rows += [found] if found is not None else []
        found = waterline_rows(scan.level, poses[i], float(common[3]), i, first + 3, firm=not scan.ladders)
        rows += [found] if found is not None else []
    if len(scans) > 1:
        rows += [sound_rows(pose, float(common[9]), i, first + np.array([9])) for i, pose in enumerate(poses)]
    for i, j in pairs:
        together = (poses[i], poses[j])
        columns = first + np.arange(5, 9)
        found = overlap_rows(scans[i].smooth, scans[j].smooth, together, common[5:9], (i, j), columns, reach)
        rows += [found] if found is not None else []
    return rows


def _design(rows: Rows) -> tuple[Float, Int64]:
    """Return the design matrix of rows over the columns (c,) that they have."""
    parts = [rows.poses]
    columns = [POSE * rows.scan + np.arange(POSE)]
    if rows.other is not None and rows.other_poses is not None:
        parts.append(rows.other_poses)
        columns.append(POSE * rows.other + np.arange(POSE))
    parts.append(rows.common)
    columns.append(rows.columns)
    return np.hstack(parts), np.concatenate(columns)


def weights_of(rows: Rows) -> Float:
    """Return the weights (n,) of rows, 1/m², by Geman and McClure.

    The mean height of the water is no outlier: it was compared with the walls. Its weight is constant, since walls hardly
    separate height from scale, and many rows with a small misfit would overrule one row that may be dropped.
    """
    weight = 1.0 / (1.0 + (_deviation(rows) / QUARTER_WEIGHT_SIGMA) ** 2) ** 2
    if rows.kind == "waterline":
        weight[-1] = 1.0
    return np.asarray(weight / rows.sigma**2)


def _deviation(rows: Rows) -> Float:
    """Return the residuals (n,) in standard deviations; those of a point across and along the beam are combined."""
    z = np.abs(rows.residual / (rows.sigma if rows.scatter is None else rows.scatter))
    if rows.kind == "ladder":
        half = len(z) // 2
        z = np.tile(np.hypot(z[:half], z[half:]), 2) / np.sqrt(2.0)
    return z


def _normal_equations(rows: Sequence[Rows], count: int) -> tuple[Float, Float]:
    normal, right = np.zeros((count, count)), np.zeros(count)
    for one in rows:
        design, columns = _design(one)
        weighted = design * weights_of(one)[:, None]
        normal[np.ix_(columns, columns)] += weighted.T @ design
        right[columns] += weighted.T @ one.residual
    return normal, right


def _prior(scans: int, ladders: Sequence[LaserLadder], radius: float) -> Float:
    """Return the precision of the prior: scales, common parameters, ladders."""
    sigma = np.full(POSE * scans + COMMON + 6 * len(ladders), np.inf)
    sigma[POSE - 1 : POSE * scans : POSE] = SCALE_SIGMA
    sigma[POSE * scans : POSE * scans + COMMON] = (
        BATTER_SIGMA,
        BATTER_SIGMA,
        max(DEPTH_SPREAD * radius, 1e-4),
        WATERLINE_SIGMA,
        ZERO_PRIOR_SIGMA,
        SLANT_SIGMA,
        SLANT_SIGMA,
        *NEARER_SIGMA,
        SCALE_SIGMA,
    )
    for k, ladder in enumerate(ladders):
        first = POSE * scans + COMMON + 6 * k
        own = np.sqrt(np.diag(ladder.covariance)[:6])
        sigma[first : first + 6] = np.hypot(own, [LADDER_TURN] * 3 + [LADDER_SHIFT] * 3)
    return np.diag(1.0 / sigma**2)


def _water_precision(offset: float) -> float:
    """Return the weight of the given water level, 1/m², once ladders show its offset, m: that of Student's t.

    Water usually stands within centimetres of its level on another day, and sometimes decimetres off.
    """
    return 1.0 / (WATERLINE_SIGMA**2 * (1.0 + (offset / WATERLINE_SIGMA) ** 2 / WATERLINE_FREEDOM))


def _prior_offset(
    poses: Sequence[Pose], placed: Sequence[PlacedLadder], ladders: Sequence[LaserLadder], common: Float
) -> Float:
    """Return the difference of scales, batters and ladders from their prior values."""
    out = np.zeros(POSE * len(poses) + COMMON + 6 * len(placed))
    for i, pose in enumerate(poses):
        out[POSE * (i + 1) - 1] = pose.scale - 1.0
    out[POSE * len(poses) : POSE * len(poses) + COMMON] = common
    for k, (now, before) in enumerate(zip(placed, ladders, strict=True)):
        first = POSE * len(poses) + COMMON + 6 * k
        out[first : first + 3] = Rotation.from_matrix(now.axes.T @ before.placed.axes).as_rotvec()
        out[first + 3 : first + 6] = now.origin - before.placed.origin
    return out


def _moved(pose: Pose, change: Float) -> Pose:
    turn = Rotation.from_rotvec(change[:3]).as_matrix()
    return Pose(np.asarray(turn @ pose.rotation), pose.translation + change[3:6], pose.scale + float(change[6]))


def _sandwich(rows: Sequence[Rows], normal: Float, precision: Float, spread: Float) -> Float:
    """Return the covariance of all parameters from the spread of the groups' sums, corrected for their own influence."""
    inverse = _inverse(normal + precision, 0.0)
    keys, sums = [], []
    for place, one in enumerate(rows):
        design, columns = _design(one)
        weighted = design * weights_of(one)[:, None]
        score = weighted * one.residual[:, None]
        own = inverse[np.ix_(columns, columns)]
        names, number = np.unique(one.group, return_inverse=True)
        for group, name in enumerate(names):
            mine = number == group
            leverage = weighted[mine].T @ design[mine] @ own
            scores = np.zeros((2, len(normal)))
            if one.kind not in STATED_KINDS or name < len(one.residual) - 1:
                scores[0, columns] = np.linalg.solve(np.eye(len(columns)) - leverage, score[mine].sum(axis=0))
            scores[1, columns] = weighted[mine].T @ one.shared[mine]
            keys.append((KEYS_OF_PLACES.get(one.kind, place + 2), int(name)))
            sums.append(scores)
    order = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    total = np.zeros((len(order), 2, len(normal)))
    np.add.at(total, [order[key] for key in keys], np.array(sums).reshape(-1, 2, len(normal)))
    flat = total.reshape(-1, len(normal))
    middle = spread + flat.T @ flat
    unknown = _inverse(normal + precision, UNKNOWN_VARIANCE) - inverse
    return np.asarray(inverse @ middle @ inverse + unknown)


def _inverse(matrix: Float, unknown: float) -> Float:
    """Return the inverse of a symmetric matrix; undetermined directions get the variance ``unknown``."""
    value, vector = np.linalg.eigh(matrix)
    known = value > MAX_SINGULAR_SHARE * value[-1]
    inverse = np.where(known, 1.0 / np.where(known, value, 1.0), unknown)
    return np.asarray((vector * inverse) @ vector.T)
