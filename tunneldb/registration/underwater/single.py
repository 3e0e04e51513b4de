"""Pose of a single sonar scan, from the ladders that it sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater.adjustment import fit, scan_of
from tunneldb.registration.underwater.choice import MIN_MARGIN, explained, margin
from tunneldb.registration.underwater.first_pose import Candidate, LevelScan, candidates, level, likeness
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import Patches, Pose, find_patches, find_smooth_patches
from tunneldb.registration.underwater.results import SonarCloud
from tunneldb.registration.underwater.walls import Walls

HEIGHT_TOLERANCE = 0.45  # m between the top of a scan's walls and the water
MAX_CANDIDATES = 8  # candidates of a scan that are fitted
FIT_POINTS = 60_000
LEVEL_POINTS = 120_000  # points of a scan that are levelled and compared with ladders and other scans
FIRST_REACHES = (0.35, 0.25, 0.2, 0.15, 0.12)
MIN_LIKENESS = 0.35  # least similarity to a ladder
MIN_TIE_RATIO = 0.92  # share of the best likelihood from which rungs are ambiguous
MAX_SCALE_ERROR = 0.03  # greatest relative error of the sonar's speed of sound: 45 m/s
MIN_OTHER_PLACE_RATIO = 0.6  # share of the best likelihood below which another place is rejected
WATERLINE_SIGMA = 0.15  # standard deviation of the top of a scan's walls, m
MIN_EDGES, MAX_WATER_ERROR = 6, 0.2  # least number of wall edges; greatest error of the water level, m (less than a rung)
PLACE_TOLERANCE, TURN_TOLERANCE = 0.15, np.radians(3.0)  # differences of two candidates with the same pose
MIN_AIR_HEIGHT, MAX_AIR_SHARE = 0.2, 0.15  # height above the water, m; greatest share of a scan's points above it
MAX_LADDER_RANGE = 12.0  # m from the scanner
SIGHT_RANGE = 7.0  # m: a closer ladder must be visible, or the pose is wrong: its bars are two beams apart


@dataclass(frozen=True)
class PreparedScan:
    """Scan, level and thinned.

    Attributes
    ----------
    cloud : SonarCloud
    flat : LevelScan
    thin : (n, 3) float64 array
        Evenly thinned points, file's axes.
    patches, smooth : Patches
        Patches of all of its points.
    edges : (k, 3) float64 array
        Upper edges of its walls, at the water level, file's axes.
    """

    cloud: SonarCloud
    flat: LevelScan
    thin: Float
    patches: Patches
    smooth: Patches
    edges: Float


@dataclass(frozen=True)
class StartedScan:
    """First pose of a scan, and the ladders that it sees, by their index in the list of those found."""

    pose: Pose
    ladders: tuple[int, ...]


@dataclass(frozen=True)
class NotStarted:
    """Reason why a scan has no first pose."""

    reason: str


@dataclass(frozen=True)
class _Fitted:
    """Fitted candidate: visible ladders, number of ladders in sight that are missing, and their similarity."""

    pose: Pose
    ladders: tuple[int, ...]
    missed: int
    likeness: float

    def likelihood(self, top: float) -> float:
        """Return the similarity, reduced by the distance of the water from the ``top`` of the walls, m above the sonar."""
        return self.likeness * float(np.exp(-0.5 * ((self.pose.translation[2] + top) / WATERLINE_SIGMA) ** 2))


def prepare(cloud: SonarCloud, walls: Walls) -> PreparedScan:
    """Level a scan and find its patches.

    Raises
    ------
    UserError
        If it shows no two walls at the distance of the laser's.
    """
    every = max(1, len(cloud.points) // FIT_POINTS)
    flat = level(cloud.points[:: max(1, len(cloud.points) // LEVEL_POINTS)], cloud.up, walls.width)
    patches, smooth = find_patches(cloud.points), find_smooth_patches(cloud.points)
    return PreparedScan(cloud, flat, cloud.points[::every], patches, smooth, flat.edges @ flat.rotation)


def start(scan: PreparedScan, walls: Walls, found: Sequence[LaserLadder]) -> StartedScan | NotStarted:
    """Return the most likely pose of a single scan; none if it sees no ladder, or several poses fit equally well.

    Raises
    ------
    UserError
        If it is upside down.
    """
    cloud, flat, thin = scan.cloud, scan.flat, scan.thin
    placed = [one.placed for one in found if _in_reach(cloud, one)]
    may_be = candidates(flat, walls, placed, HEIGHT_TOLERANCE)
    tried = [one for one in may_be if cloud.may_stand(one.translation)][:MAX_CANDIDATES]
    patches = find_patches(thin)
    fitted = [one for one in (_try(thin, patches, one, walls, found) for one in tried) if one.ladders]
    if not fitted:
        return NotStarted("it shows no ladder of the laser scan")
    high = float(np.median([(one.pose.apply(thin)[:, 2] > MIN_AIR_HEIGHT).mean() for one in fitted]))
    if high > MAX_AIR_SHARE:
        raise UserError(f"{cloud.path}: {100.0 * high:.0f} % of its points would be above the water; check --up")
    scaled = [one for one in fitted if abs(one.pose.scale - 1.0) < MAX_SCALE_ERROR]
    best = max(scaled, key=lambda one: one.likelihood(flat.top), default=None)
    if best is None:
        off = 100.0 * (float(np.median([one.pose.scale for one in fitted])) - 1.0)
        return NotStarted(f"its ranges would be wrong by {-off:+.1f} %; check the speed of sound (--sound-speed)")
    if len(flat.edges) >= MIN_EDGES and abs(best.pose.translation[2] + flat.top) > MAX_WATER_ERROR:
        return NotStarted("its ladder and its walls disagree about the water level")
    if best.missed:
        return NotStarted("at its likely place it should show another ladder")
    for other in scaled:
        if other.missed or _same(best.pose, other.pose):
            continue
        less = other.likelihood(flat.top) / best.likelihood(flat.top)
        # a wall fits as well one rung lower; elsewhere, or turned by 180°, it is another wall
        if _same_place(best.pose, other.pose):
            if less > MIN_TIE_RATIO:
                return NotStarted("two of its ladder's rungs fit as well")
        elif less > MIN_OTHER_PLACE_RATIO:
            explanations = (_explained(thin, one.pose, walls, found) for one in (best, other))
            if margin(thin, *explanations) < MIN_MARGIN:
                return NotStarted("two places, or two orientations, fit equally well; give its place by --start")
    return StartedScan(best.pose, best.ladders)


def _try(points: Float, patches: Patches, candidate: Candidate, walls: Walls, found: Sequence[LaserLadder]) -> _Fitted:
    """Fit a candidate, and compute its similarity to the ladders."""
    pose = Pose(candidate.rotation, candidate.translation, 1.0)
    first = tuple(k for k, one in enumerate(found) if one.placed.ladder.name == candidate.ladder)
    no_edges = np.zeros((0, 3))  # the height comes from the ladder only, and is then compared with the water's
    pose = fit([scan_of(points, patches, patches, no_edges, pose, first, found)], walls, found, [], FIRST_REACHES).poses[0]
    near = _near(pose, found)
    pose = fit([scan_of(points, patches, patches, no_edges, pose, near, found)], walls, found, [], FIRST_REACHES[-3:]).poses[0]
    space = pose.apply(points)
    likenesses = [(likeness(space, pose.translation, found[k].placed), k) for k in near]
    seen = tuple(k for value, k in likenesses if value > MIN_LIKENESS)
    alike = sum(value for value, k in likenesses if value > MIN_LIKENESS or k in first)
    missed = missing_ladder_count(pose, seen, found)
    return _Fitted(pose, seen, missed, alike)


def _explained(points: Float, pose: Pose, walls: Walls, found: Sequence[LaserLadder]) -> Float:
    return explained(points, pose, walls, [found[k].placed for k in _near(pose, found)])


def missing_ladder_count(pose: Pose, seen: Sequence[int], found: Sequence[LaserLadder]) -> int:
    """Return the number of ladders in sight of a pose that are not among those seen."""
    return sum(k not in seen and _away(pose, found[k]) < SIGHT_RANGE for k in _near(pose, found))


def _same(one: Pose, other: Pose) -> bool:
    turn = np.arccos(np.clip((np.trace(one.rotation @ other.rotation.T) - 1.0) / 2.0, -1.0, 1.0))
    return bool(np.linalg.norm(one.translation - other.translation) < PLACE_TOLERANCE and turn < TURN_TOLERANCE)


def _same_place(one: Pose, other: Pose) -> bool:
    """Return True if two poses are the same except for the height."""
    return _same(one, Pose(other.rotation, np.array([*other.translation[:2], one.translation[2]]), other.scale))


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
