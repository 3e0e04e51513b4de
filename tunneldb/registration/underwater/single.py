"""Possible poses of a single sonar scan: from the plan of the walls and from ladders, each with its evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import log_ndtr

from tunneldb.arrays import Bool, Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater.adjustment import SCALE_SIGMA, Scan, fit, scan_of
from tunneldb.registration.underwater.choice import MIN_MARGIN, Cells, Evidence, explained, margin
from tunneldb.registration.underwater.first_pose import Candidate, LevelScan, candidates, level, likeness
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import (
    WATERLINE_NOISE,
    Patches,
    Pose,
    find_patches,
    find_smooth_patches,
)
from tunneldb.registration.underwater.plan_search import COLUMN, PlanPose, find_columns, find_plan_poses, plan_cells
from tunneldb.registration.underwater.results import SonarCloud
from tunneldb.registration.underwater.walls import Walls
from tunneldb.registration.underwater.water_surface import Level, is_upside_down, surface_noise

HEIGHT_TOLERANCE = 0.45  # m between the water in a scan and the laser's water level
MAX_LADDER_CANDIDATES, MAX_PLAN_CANDIDATES = 8, 20  # candidates of a scan that are fitted
FIT_POINTS = 60_000
LEVEL_POINTS = 120_000  # points of a scan that are levelled and compared with ladders and other scans
FIRST_REACHES = (0.35, 0.25, 0.2, 0.15, 0.12)
MIN_LIKENESS = 0.35  # least similarity to a ladder
MAX_SCALE_ERROR = 0.03  # greatest relative error of the sonar's speed of sound: 45 m/s
MIN_LEVEL_POINTS, MAX_WATER_ERROR = 6, 0.2  # least number of points at the water; its greatest error, m (less than a rung)
SURFACE_SIGMA, EDGE_SIGMA = 0.05, 0.15  # standard deviations of the water's level, by its surface and by edges of walls, m
PLACE_TOLERANCE, TURN_TOLERANCE = 0.15, np.radians(3.0)  # differences of two candidates with the same pose
MIN_AIR_HEIGHT, MAX_AIR_SHARE = 0.2, 0.25  # height above the water, m; greatest share of a scan's points above it
MAX_MIRROR_SHARE = 0.4  # greatest share if the water's surface mirrors walls and bed
MAX_LADDER_RANGE = 12.0  # m from the scanner
SIGHT_RANGE = 7.0  # m: a closer ladder must be visible, or the pose is unlikely: its bars are two beams apart
MISSED_LOG_ODDS = float(np.log(0.05))  # of a pose at which a ladder in sight is not seen
MAX_LEVEL_POINTS = 150  # of the water's surface that are used
MIN_PLAN_SCORE = 0.15  # least weighted share of a scan's walls that match the laser's plan
MAX_SLIDE = 1.0  # m by which a fit may move a candidate
SLIDES = np.arange(-0.5, 0.51, 0.04)  # m along a wall, to see a ladder


@dataclass(frozen=True)
class PreparedScan:
    """Scan, level and thinned.

    Attributes
    ----------
    cloud : SonarCloud
    flat : LevelScan
    thin : (n, 3) float64 array
        Evenly thinned points, file's axes.
    upright : (n,) bool array
        True for those on upright surfaces.
    patches, smooth : Patches
        Patches of all of its points.
    columns : Patches
        Columns of its upright walls.
    level : Level
    """

    cloud: SonarCloud
    flat: LevelScan
    thin: Float
    upright: Bool
    patches: Patches
    smooth: Patches
    columns: Patches
    level: Level


@dataclass(frozen=True)
class Hypothesis:
    """Possible pose of a scan.

    Attributes
    ----------
    pose : Pose
    ladders : tuple of int
        Ladders that it sees, by their index in the list of those found.
    log_odds : float
        Log of its odds against the most likely pose of the scan.
    by_plan : bool
        True if the plan of the walls alone excludes other places and the other heading.
    """

    pose: Pose
    ladders: tuple[int, ...]
    log_odds: float = 0.0
    by_plan: bool = False


@dataclass(frozen=True)
class NotStarted:
    """Reason why a scan has no possible pose."""

    reason: str


@dataclass(frozen=True)
class _Fitted:
    """Fitted candidate: visible ladders, and number of ladders in sight that are missing."""

    pose: Pose
    ladders: tuple[int, ...]
    missed: int


def prepare(cloud: SonarCloud, walls: Walls) -> PreparedScan:
    """Level a scan and find its patches.

    Raises
    ------
    UserError
        If it shows no walls or no bed.
    """
    every = max(1, len(cloud.points) // FIT_POINTS)
    flat = level(cloud.points[:: max(1, len(cloud.points) // LEVEL_POINTS)], cloud.up, walls.widths)
    patches, smooth = find_patches(cloud.points), find_smooth_patches(cloud.points)
    water = flat.surface if len(flat.surface) else flat.edges
    noise = surface_noise(flat.surface) if len(flat.surface) else WATERLINE_NOISE
    water = water[:: max(1, -(-len(water) // MAX_LEVEL_POINTS))]
    columns = find_columns(flat, cloud.points)
    level_points = Level(water @ flat.rotation, noise)
    thin = cloud.points[::every]
    return PreparedScan(cloud, flat, thin, _on_columns(thin, columns, flat), patches, smooth, columns, level_points)


def _on_columns(points: Float, columns: Patches, flat: LevelScan) -> Bool:
    """Return True for the points (n, 3) that lie on upright columns, in plan."""
    if len(columns.centre) == 0:
        return np.zeros(len(points), np.bool_)
    plan, own = (columns.centre @ flat.rotation.T)[:, :2], (points @ flat.rotation.T)[:, :2]
    away, _ = cKDTree(plan).query(own, distance_upper_bound=COLUMN)
    return np.isfinite(away)


def start(scan: PreparedScan, walls: Walls, found: Sequence[LaserLadder]) -> list[Hypothesis] | NotStarted:
    """Return the possible poses of a scan, the most likely first; none if nothing that it shows matches the laser's points.

    Raises
    ------
    UserError
        If it is upside down.
    """
    if len(scan.flat.surface) == 0 and is_upside_down(
        scan.flat.points, scan.flat.walls
    ):  # a bed of concrete is as even as water
        raise UserError(f"{scan.cloud.path}: its bed is above it and the water below; check --up")
    fitted = _candidates(scan, walls, found)
    if not fitted:
        return NotStarted("it shows no ladder of the laser scan, nor walls and water that match it")
    high = float(np.median([(one.pose.apply(scan.thin)[:, 2] > MIN_AIR_HEIGHT).mean() for one in fitted]))
    if high > (MAX_MIRROR_SHARE if len(scan.flat.surface) else MAX_AIR_SHARE):
        raise UserError(f"{scan.cloud.path}: {100.0 * high:.0f} % of its points would be above the water; check --up")
    level = [one for one in fitted if _water_error(scan, one.pose) < MAX_WATER_ERROR]
    if not level:
        return NotStarted("its ladder and its walls disagree about the water level")
    weighed = _weighed(scan, _distinct(level), walls, found)
    off = weighed[0].pose.scale - 1.0
    if abs(off) > MAX_SCALE_ERROR:
        return NotStarted(f"its ranges would be wrong by {-100.0 * off:+.1f} %; check the speed of sound (--sound-speed)")
    return [one for one in weighed if abs(one.pose.scale - 1.0) < MAX_SCALE_ERROR]


def _water_error(scan: PreparedScan, pose: Pose) -> float:
    """Return the distance of the water in a scan from the laser's water level, m; 0 if the scan does not show it."""
    if len(scan.level.points) < MIN_LEVEL_POINTS:
        return 0.0
    return abs(float(np.median(pose.apply(scan.level.points)[:, 2])))


def _candidates(scan: PreparedScan, walls: Walls, found: Sequence[LaserLadder]) -> list[_Fitted]:
    cloud, patches = scan.cloud, find_patches(scan.thin)
    out = []
    placed = [one.placed for one in found if _in_reach(cloud, one)]
    by_ladder = [one for one in candidates(scan.flat, walls, placed, HEIGHT_TOLERANCE) if _may_be(cloud, one)]
    for candidate in by_ladder[:MAX_LADDER_CANDIDATES]:
        one = _fit_to_ladder(scan, patches, candidate, walls, found)
        if one.ladders and np.linalg.norm((one.pose.translation - candidate.translation)[:2]) < MAX_SLIDE:
            out.append(one)
    cells = plan_cells(scan.flat, scan.columns)
    for plan in [one for one in find_plan_poses(cloud, cells, walls.profile) if one.score > MIN_PLAN_SCORE][
        :MAX_PLAN_CANDIDATES
    ]:
        first = _pose_of(plan, scan.flat)
        if not cloud.may_face(first.rotation):
            continue
        fitted = _fit_to_plan(scan, patches, first, walls, found)
        has_height = bool(fitted.ladders) or len(scan.level.points) >= MIN_LEVEL_POINTS
        if has_height and np.linalg.norm((fitted.pose.translation - first.translation)[:2]) < MAX_SLIDE:
            out.append(fitted)
    return out + [other for one in out for other in _one_stile_beside(scan, patches, one, walls, found)]


def _one_stile_beside(
    scan: PreparedScan, patches: Patches, one: _Fitted, walls: Walls, found: Sequence[LaserLadder]
) -> list[_Fitted]:
    """Return the fits next to a fit at which a ladder is seen better with one of its stiles as the other.

    A fit does not get there by itself.
    """
    out = []
    space = one.pose.apply(scan.thin)
    for k in one.ladders:
        placed = found[k].placed
        here = likeness(space, one.pose.translation, placed)
        for gap in (-placed.gap, placed.gap):
            shift = gap * placed.axes[0]
            if likeness(space + shift, one.pose.translation + shift, placed) > here:
                pose = replace(one.pose, translation=one.pose.translation + shift)
                beside = scan_of(scan.thin, patches, scan.smooth, scan.columns, scan.level, pose, one.ladders, found)
                out.append(_seen(scan, _fit(beside, walls, found, FIRST_REACHES[-3:]), found))
    return out


def _may_be(cloud: SonarCloud, candidate: Candidate) -> bool:
    return cloud.may_stand(candidate.translation) and cloud.may_face(candidate.rotation)


def _pose_of(plan: PlanPose, flat: LevelScan) -> Pose:
    """Return the pose of a level scan at a place in plan, at the height given by the water."""
    turn = np.eye(3)
    turn[:2, :2] = plan.turn()
    return Pose(turn @ flat.rotation, np.array([*plan.place, -plan.scale * flat.top]), plan.scale)


def _fit_to_ladder(
    scan: PreparedScan, patches: Patches, candidate: Candidate, walls: Walls, found: Sequence[LaserLadder]
) -> _Fitted:
    """Fit a candidate from a ladder: its height is the ladder's, and is compared with the water's afterwards."""
    first = tuple(k for k, one in enumerate(found) if one.placed.ladder.name == candidate.ladder)
    no_level = Level(np.zeros((0, 3)), np.inf)
    pose = Pose(candidate.rotation, candidate.translation, 1.0)
    pose = _fit(scan_of(scan.thin, patches, patches, scan.columns, no_level, pose, first, found), walls, found, FIRST_REACHES)
    near = _near(pose, found)
    pose = _fit(
        scan_of(scan.thin, patches, patches, scan.columns, no_level, pose, near, found), walls, found, FIRST_REACHES[-3:]
    )
    if _water_error(scan, pose) < MAX_WATER_ERROR:
        near = visible_ladders(scan, pose, found) or near
        with_level = scan_of(scan.thin, patches, scan.smooth, scan.columns, scan.level, pose, near, found)
        pose = _fit(with_level, walls, found, FIRST_REACHES[-3:])
    return _seen(scan, pose, found)


def _fit_to_plan(scan: PreparedScan, patches: Patches, pose: Pose, walls: Walls, found: Sequence[LaserLadder]) -> _Fitted:
    """Fit a candidate from the plan, first without ladders, then with those that it sees."""
    pose = _fit(Scan(patches, scan.smooth, scan.columns, scan.level, pose, {}), walls, found, FIRST_REACHES)
    seen = _seen(scan, pose, found)
    slid = _seen(scan, _slid_to_ladder(scan, pose, found), found) if seen.missed and not seen.ladders else seen
    if not slid.ladders:
        return seen
    with_ladders = scan_of(scan.thin, patches, scan.smooth, scan.columns, scan.level, slid.pose, slid.ladders, found)
    return _seen(scan, _fit(with_ladders, walls, found, FIRST_REACHES[-3:]), found)


def _slid_to_ladder(scan: PreparedScan, pose: Pose, found: Sequence[LaserLadder]) -> Pose:
    """Return the pose moved along the wall to where a ladder in sight is seen best: the plan may not determine that."""
    space = pose.apply(scan.thin)
    best, moved = MIN_LIKENESS, pose
    for k in _near(pose, found):
        placed = found[k].placed
        own = placed.to_ladder(space)
        mine = (np.abs(own[:, 0]) < placed.gap / 2.0 + 2.0 * SLIDES[-1]) & (np.abs(own[:, 2]) < SLIDES[-1])
        for slide in SLIDES:
            shift = slide * placed.axes[0] * [1.0, 1.0, 0.0]
            like = likeness(space[mine] + shift, pose.translation + shift, placed)
            if like > best:
                best, moved = like, replace(pose, translation=pose.translation + shift)
    return moved


def _fit(scan: Scan, walls: Walls, found: Sequence[LaserLadder], reaches: Sequence[float]) -> Pose:
    return fit([scan], walls, found, [], reaches).poses[0]


def _seen(scan: PreparedScan, pose: Pose, found: Sequence[LaserLadder]) -> _Fitted:
    seen = visible_ladders(scan, pose, found)
    return _Fitted(pose, seen, missing_ladder_count(pose, seen, found))


def _distinct(fitted: Sequence[_Fitted]) -> list[_Fitted]:
    """Return the candidates without repeats; of the same pose the one that sees more ladders."""
    out: list[_Fitted] = []
    for one in sorted(fitted, key=lambda one: one.missed - len(one.ladders)):
        if not any(is_same(one.pose, other.pose) for other in out):
            out.append(one)
    return out


def _weighed(scan: PreparedScan, fitted: Sequence[_Fitted], walls: Walls, found: Sequence[LaserLadder]) -> list[Hypothesis]:
    """Return candidates with their odds against the best one: by all points, the water's level, and ladders in sight."""
    evidence = [_evidence(scan, one.pose, walls, found) for one in fitted]
    other = np.array([_log_prior(scan, one) for one in fitted])

    cells = Cells.of(scan.thin)
    lead = np.zeros((len(fitted), len(fitted)))  # of the first pose over the second
    for k, best in combinations(range(len(fitted)), 2):
        lead[best, k] = margin(cells, evidence[best], evidence[k])
    lead -= lead.T
    table = log_ndtr(-lead) - log_ndtr(lead) + other - other[:, None]
    best = int(np.argmin(table.max(axis=1)))
    away = [k for k in range(len(fitted)) if not _same_plan(fitted[k].pose, fitted[best].pose)]
    by_plan = all(margin(cells, evidence[best].by_walls, evidence[k].by_walls) > MIN_MARGIN for k in away)
    out = [Hypothesis(one.pose, one.ladders, float(table[best, k]), k == best and by_plan) for k, one in enumerate(fitted)]
    return sorted(out, key=lambda one: -one.log_odds)


def _evidence(scan: PreparedScan, pose: Pose, walls: Walls, found: Sequence[LaserLadder]) -> Evidence:
    return explained(scan.thin, scan.upright, pose, walls, [found[k].placed for k in _near(pose, found)])


def _log_prior(scan: PreparedScan, one: _Fitted) -> float:
    sigma = SURFACE_SIGMA if len(scan.flat.surface) else EDGE_SIGMA
    level, scale = _water_error(scan, one.pose) / sigma, (one.pose.scale - 1.0) / SCALE_SIGMA
    return -0.5 * (level**2 + scale**2) + one.missed * MISSED_LOG_ODDS


def missing_ladder_count(pose: Pose, seen: Sequence[int], found: Sequence[LaserLadder]) -> int:
    """Return the number of ladders in sight of a pose that are not among those seen."""
    return sum(k not in seen and _away(pose, found[k]) < SIGHT_RANGE for k in _near(pose, found))


def is_same(one: Pose, other: Pose) -> bool:
    """Return True if two poses differ by less than the tolerance."""
    turn = np.arccos(np.clip((np.trace(one.rotation @ other.rotation.T) - 1.0) / 2.0, -1.0, 1.0))
    return bool(np.linalg.norm(one.translation - other.translation) < PLACE_TOLERANCE and turn < TURN_TOLERANCE)


def _same_plan(one: Pose, other: Pose) -> bool:
    """Return True if two poses are the same except for the height."""
    return is_same(one, Pose(other.rotation, np.array([*other.translation[:2], one.translation[2]]), other.scale))


def visible_ladders(scan: PreparedScan, pose: Pose, found: Sequence[LaserLadder]) -> tuple[int, ...]:
    """Return the ladders that a scan with this pose sees."""
    near = _near(pose, found)
    placed = pose.apply(scan.thin)
    return tuple(k for k in near if likeness(placed, pose.translation, found[k].placed) > MIN_LIKENESS)


def _near(pose: Pose, found: Sequence[LaserLadder]) -> tuple[int, ...]:
    return tuple(k for k, one in enumerate(found) if _away(pose, one) < MAX_LADDER_RANGE)


def _in_reach(cloud: SonarCloud, ladder: LaserLadder) -> bool:
    """Return True if a ladder may be near enough to the scanner's place."""
    if cloud.near is None:
        return True
    away = float(np.linalg.norm(ladder.placed.origin[:2] - cloud.near.place))
    return away < cloud.near.within + MAX_LADDER_RANGE


def _away(pose: Pose, ladder: LaserLadder) -> float:
    """Return the distance in plan between a scanner and a ladder, m."""
    return float(np.linalg.norm(ladder.placed.origin[:2] - pose.translation[:2]))
