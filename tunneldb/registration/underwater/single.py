"""Pose of a sonar scan by itself: from the ladders that it sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater.adjustment import fit, scan_of
from tunneldb.registration.underwater.choice import DECIDED, explained, margin
from tunneldb.registration.underwater.first_pose import Candidate, LevelScan, candidates, level, likeness
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import Patches, Pose, find_patches, find_smooth_patches
from tunneldb.registration.underwater.results import SonarCloud
from tunneldb.registration.underwater.walls import Walls

HEIGHT_TOLERANCE = 0.45  # between the top of a scan's walls and the water, m
TRIED = 8  # candidates of a scan that are fitted
TRIED_POINTS = 60_000
LEVEL_POINTS = 120_000  # of a scan that are levelled, and compared with ladders and with other scans'
FIRST_REACHES = (0.35, 0.25, 0.2, 0.15, 0.12)
LEAST_LIKENESS = 0.35  # of a ladder that is taken for one
TIE = 0.92  # of the best likelihood, from which rungs are not told apart
MOST_SCALE = 0.03  # by which sound may be faster or slower than the sonar took it to be: 45 m/s
OTHER_PLACE = 0.6  # of the best likelihood, under which another place is none: of two ladders it sees one
WATERLINE_SIGMA = 0.15  # of the top of a scan's walls, m
SOME_EDGES, MOST_OFF_WATER = 6, 0.2  # edges of walls that tell where the water is, and by how much less than a rung, m
SAME_PLACE, SAME_TURN = 0.15, np.radians(3.0)  # of two candidates that came to the same pose
AIR, MOST_IN_AIR = 0.2, 0.15  # above the water, m: share of a scan that echoes by way of the surface may put there
FARTHEST_LADDER = 12.0  # m from the scanner
IN_SIGHT = 7.0  # m: a ladder nearer than that is seen, or the pose is wrong: each of its bars is two beams off the next


@dataclass(frozen=True)
class PreparedScan:
    """A scan, level and thinned.

    Attributes
    ----------
    cloud : SonarCloud
    flat : LevelScan
    thin : (n, 3) float64 array
        Some of its points, evenly, file's axes.
    patches, smooth : Patches
        Of all of its points.
    edges : (k, 3) float64 array
        Where its walls end, at the water's level, file's axes.
    """

    cloud: SonarCloud
    flat: LevelScan
    thin: Float
    patches: Patches
    smooth: Patches
    edges: Float


@dataclass(frozen=True)
class StartedScan:
    """A scan's first pose, and the ladders that it sees, by their places in the list of those found."""

    pose: Pose
    ladders: tuple[int, ...]


@dataclass(frozen=True)
class NotStarted:
    """Why a scan has no first pose."""

    reason: str


@dataclass(frozen=True)
class _Fitted:
    """A fitted candidate: the ladders that it sees, how many in sight it does not, how like ladders they look."""

    pose: Pose
    ladders: tuple[int, ...]
    missed: int
    likeness: float

    def likelihood(self, top: float) -> float:
        """Likeness, the less the farther the water is from the top ``top`` of the scan's walls above the sonar, m."""
        return self.likeness * float(np.exp(-0.5 * ((self.pose.translation[2] + top) / WATERLINE_SIGMA) ** 2))


def prepare(cloud: SonarCloud, walls: Walls) -> PreparedScan:
    """Level a scan and find its patches.

    Raises
    ------
    UserError
        It shows no two walls as far apart as the laser's.
    """
    every = max(1, len(cloud.points) // TRIED_POINTS)
    flat = level(cloud.points[:: max(1, len(cloud.points) // LEVEL_POINTS)], cloud.up, walls.width)
    patches, smooth = find_patches(cloud.points), find_smooth_patches(cloud.points)
    return PreparedScan(cloud, flat, cloud.points[::every], patches, smooth, flat.edges @ flat.rotation)


def start(scan: PreparedScan, walls: Walls, found: Sequence[LaserLadder]) -> StartedScan | NotStarted:
    """Most likely pose of a scan by itself; none if no ladder is seen, or more than one pose fits as well.

    Raises
    ------
    UserError
        It is upside down.
    """
    cloud, flat, thin = scan.cloud, scan.flat, scan.thin
    placed = [one.placed for one in found if _in_reach(cloud, one)]
    may_be = candidates(flat, walls, placed, HEIGHT_TOLERANCE)
    tried = [one for one in may_be if cloud.may_stand(one.translation)][:TRIED]
    patches = find_patches(thin)
    fitted = [one for one in (_try(thin, patches, one, walls, found) for one in tried) if one.ladders]
    if not fitted:
        return NotStarted("it shows no ladder that the laser sees")
    high = float(np.median([(one.pose.apply(thin)[:, 2] > AIR).mean() for one in fitted]))
    if high > MOST_IN_AIR:
        raise UserError(f"{cloud.path}: {100.0 * high:.0f} % of its points would lie above the water: is --up right?")
    scaled = [one for one in fitted if abs(one.pose.scale - 1.0) < MOST_SCALE]
    best = max(scaled, key=lambda one: one.likelihood(flat.top), default=None)
    if best is None:
        off = 100.0 * (float(np.median([one.pose.scale for one in fitted])) - 1.0)
        return NotStarted(f"its ranges would be {-off:+.1f} % off: is the speed of sound right (--sound-speed)?")
    if len(flat.edges) >= SOME_EDGES and abs(best.pose.translation[2] + flat.top) > MOST_OFF_WATER:
        return NotStarted("by its ladder the water is not where its walls end")
    if best.missed:
        return NotStarted("where it seems to stand a ladder would be in sight that it does not show")
    for other in scaled:
        if other.missed or _same(best.pose, other.pose):
            continue
        less = other.likelihood(flat.top) / best.likelihood(flat.top)
        # a wall is as good a wall a rung lower; elsewhere, or turned the other way, it is another
        if _same_place(best.pose, other.pose):
            if less > TIE:
                return NotStarted("two of its ladder's rungs fit as well")
        elif less > OTHER_PLACE:
            explanations = (_explained(thin, one.pose, walls, found) for one in (best, other))
            if margin(thin, *explanations) < DECIDED:
                return NotStarted("two places, or two ways round, fit as well: --start may tell them apart")
    return StartedScan(best.pose, best.ladders)


def _try(points: Float, patches: Patches, candidate: Candidate, walls: Walls, found: Sequence[LaserLadder]) -> _Fitted:
    """Fit a candidate, and tell how like the ladders look then."""
    pose = Pose(candidate.rotation, candidate.translation, 1.0)
    first = tuple(k for k, one in enumerate(found) if one.placed.ladder.name == candidate.ladder)
    no_edges = np.zeros((0, 3))  # the height is to come from the ladder alone, to be compared with the water's
    pose = fit([scan_of(points, patches, patches, no_edges, pose, first, found)], walls, found, [], FIRST_REACHES).poses[0]
    near = _near(pose, found)
    pose = fit([scan_of(points, patches, patches, no_edges, pose, near, found)], walls, found, [], FIRST_REACHES[-3:]).poses[0]
    space = pose.apply(points)
    likenesses = [(likeness(space, pose.translation, found[k].placed), k) for k in near]
    seen = tuple(k for value, k in likenesses if value > LEAST_LIKENESS)
    alike = sum(value for value, k in likenesses if value > LEAST_LIKENESS or k in first)
    missed = misses(pose, seen, found)
    return _Fitted(pose, seen, missed, alike)


def _explained(points: Float, pose: Pose, walls: Walls, found: Sequence[LaserLadder]) -> Float:
    return explained(points, pose, walls, [found[k].placed for k in _near(pose, found)])


def misses(pose: Pose, seen: Sequence[int], found: Sequence[LaserLadder]) -> int:
    """How many ladders that are in sight of a pose are not among those seen."""
    return sum(k not in seen and _away(pose, found[k]) < IN_SIGHT for k in _near(pose, found))


def _same(one: Pose, other: Pose) -> bool:
    turn = np.arccos(np.clip((np.trace(one.rotation @ other.rotation.T) - 1.0) / 2.0, -1.0, 1.0))
    return bool(np.linalg.norm(one.translation - other.translation) < SAME_PLACE and turn < SAME_TURN)


def _same_place(one: Pose, other: Pose) -> bool:
    """Whether two poses are the same but for the height."""
    return _same(one, Pose(other.rotation, np.array([*other.translation[:2], one.translation[2]]), other.scale))


def sees(scan: PreparedScan, pose: Pose, found: Sequence[LaserLadder]) -> tuple[int, ...]:
    """Which ladders a scan with this pose sees."""
    near = _near(pose, found)
    placed = pose.apply(scan.thin)
    return tuple(k for k in near if likeness(placed, pose.translation, found[k].placed) > LEAST_LIKENESS)


def _near(pose: Pose, found: Sequence[LaserLadder]) -> tuple[int, ...]:
    return tuple(k for k, one in enumerate(found) if _away(pose, one) < FARTHEST_LADDER)


def _in_reach(cloud: SonarCloud, ladder: LaserLadder) -> bool:
    """Whether a ladder may be near enough to where the scanner stood."""
    if cloud.near is None:
        return True
    away = float(np.linalg.norm(ladder.placed.origin[:2] - cloud.near.place))
    return away < cloud.near.within + FARTHEST_LADDER


def _away(pose: Pose, ladder: LaserLadder) -> float:
    """Distance in plan between a scanner and a ladder, m."""
    return float(np.linalg.norm(ladder.placed.origin[:2] - pose.translation[:2]))
