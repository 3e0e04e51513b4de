"""Registration of sonar scans below the water to the laser's model above it.

After Moisan et al. (2015), with other means: walls, ladders and overlaps are adjusted jointly, and each direction that the
geometry leaves open is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.registration.underwater.adjustment import Adjusted, adjust, scan_of
from tunneldb.registration.underwater.choice import DECIDED, explained, margin
from tunneldb.registration.underwater.determined import judge
from tunneldb.registration.underwater.first_pose import Candidate, candidates, level, likeness
from tunneldb.registration.underwater.laser_ladders import LaserLadder, find_laser_ladders
from tunneldb.registration.underwater.observations import Patches, Pose, Rows, cell_keys, find_patches
from tunneldb.registration.underwater.results import Ladder, LadderFit, Registration, Residual, SonarCloud, SonarPose
from tunneldb.registration.underwater.walls import Walls, find_walls

HEIGHT_TOLERANCE = 0.45  # between the top of a scan's walls and the water, m
WALL_VOXEL = 0.03  # m
TRIED = 8  # candidates of a scan that are fitted
TRIED_POINTS = 60_000
FIRST_REACHES = (0.35, 0.25, 0.2, 0.15, 0.12)
LEAST_LIKENESS = 0.35  # of a ladder that is taken for one
TIE = 0.92  # of the best likelihood, from which rungs are not told apart
WATERLINE_SIGMA = 0.15  # of the top of a scan's walls, m
SAME_PLACE, SAME_TURN = 0.15, np.radians(3.0)  # of two candidates that came to the same pose
AIR, MOST_IN_AIR = 0.2, 0.25  # above the water, m: share of a scan that echoes by way of the surface may put there
FARTHEST_LADDER = 12.0  # m from the scanner
OVERLAP = 15.0  # m between scanners whose scans are compared


@dataclass(frozen=True)
class _Started:
    """A scan's first pose, the ladders that it sees, how like ladders they look, how well its points are explained (n,)."""

    pose: Pose
    ladders: tuple[int, ...]
    likeness: float
    explained: Float

    def likelihood(self, top: float) -> float:
        """Likeness, the less the farther the water is from the top ``top`` of the scan's walls above the sonar, m."""
        return self.likeness * float(np.exp(-0.5 * ((self.pose.translation[2] + top) / WATERLINE_SIGMA) ** 2))


def register(laser: Float, clouds: Sequence[SonarCloud], ladders: Sequence[Ladder], water_level: float) -> Registration:
    """Register sonar scans to the laser's points.

    Parameters
    ----------
    laser : (n, 3) float64 array
        Points about the water's level and above, in the tunnel's frame, m.
    clouds : sequence of SonarCloud
    ladders : sequence of Ladder
        Those that stand in the water.
    water_level : float
        Height of the water, m.

    Raises
    ------
    UserError
        Nothing can be said of any scan: there are no walls at the water, or a scan shows none.
    """
    origin = np.array([*np.floor(np.median(laser[:, :2], axis=0)), water_level])
    local = laser - origin
    walls = find_walls(local[np.unique(cell_keys(local, WALL_VOXEL), return_index=True)[1]])
    found = find_laser_ladders(local, walls, ladders)
    starts = [_start(cloud, walls, found) for cloud in clouds]
    seen = {one.placed.ladder.name for one in found}
    notes = [f"ladder {one.name} is not seen by the laser" for one in ladders if one.name not in seen]
    known = [i for i, start in enumerate(starts) if start is not None]
    adjusted = _adjust_all(clouds, starts, known, walls, found)
    scans = []
    for i, cloud in enumerate(clouds):
        if adjusted is None or i not in known:
            scans.append(_unknown(cloud))
            continue
        k = known.index(i)
        pose = adjusted.poses[k]
        state, open_directions = judge(adjusted.covariance[k], _along(walls, pose))
        residuals = _residuals(adjusted.rows, k, [clouds[j].path.name for j in known])
        scans.append(
            SonarPose(
                cloud.path, pose.rotation, pose.translation + origin, pose.scale, adjusted.covariance[k], state,
                open_directions, residuals,
            )
        )  # fmt: skip
    fits = [_fit(one, k, origin, clouds, starts) for k, one in enumerate(found)]
    return Registration(tuple(scans), tuple(fits), water_level, tuple(notes))


def _start(cloud: SonarCloud, walls: Walls, found: Sequence[LaserLadder]) -> _Started | None:
    """Most likely pose of a scan by itself; None if no ladder is seen, or more than one pose fits as well."""
    try:
        flat = level(cloud.points, cloud.up, walls.width())
    except UserError as error:
        raise UserError(f"{cloud.path}: {error}") from error
    placed = [one.placed for one in found]
    tried = candidates(flat, walls, placed, HEIGHT_TOLERANCE)[:TRIED]
    every = max(1, len(cloud.points) // TRIED_POINTS)
    thin = cloud.points[::every]
    patches = find_patches(thin)
    fitted = [one for one in (_try(thin, patches, one, walls, found) for one in tried) if one.ladders]
    if not fitted:
        return None
    best = _best(thin, fitted)
    high = float((best.pose.apply(thin)[:, 2] > AIR).mean())
    if high > MOST_IN_AIR:
        raise UserError(f"{cloud.path}: {100.0 * high:.0f} % of its points would lie above the water: is --up right?")
    for other in fitted:
        if _same(best.pose, other.pose):
            continue
        if _same_place(best.pose, other.pose):
            told = other.likelihood(flat.top) < TIE * best.likelihood(flat.top)
        else:
            told = margin(thin, best.explained, other.explained) > DECIDED
        if not told:
            return None
    return best


def _best(points: Float, fitted: Sequence[_Started]) -> _Started:
    """Likeliest pose: of those a rung apart the one under which the ladders look most like ladders.

    Of those at other places or turned the other way it is the one that explains more of the points; that says nothing of
    rungs, for a wall is as good a wall a rung lower.
    """
    leaders: list[_Started] = []
    for one in sorted(fitted, key=lambda one: -one.likeness):
        if not any(_same_place(one.pose, other.pose) for other in leaders):
            leaders.append(one)
    return max(leaders, key=lambda one: float(one.explained.sum()))


def _try(points: Float, patches: Patches, candidate: Candidate, walls: Walls, found: Sequence[LaserLadder]) -> _Started:
    """Fit a candidate, and tell how like the ladders look then."""
    pose = Pose(candidate.rotation, candidate.translation, 1.0)
    first = tuple(k for k, one in enumerate(found) if one.placed.ladder.name == candidate.ladder)
    pose = adjust([scan_of(points, patches, pose, first, found)], walls, found, [], FIRST_REACHES).poses[0]
    near = tuple(
        k for k, one in enumerate(found) if np.linalg.norm(one.placed.origin[:2] - pose.translation[:2]) < FARTHEST_LADDER
    )
    pose = adjust([scan_of(points, patches, pose, near, found)], walls, found, [], FIRST_REACHES[-3:]).poses[0]
    likenesses = [(likeness(pose.apply(points), pose.translation, found[k].placed), k) for k in near]
    seen = tuple(k for value, k in likenesses if value > LEAST_LIKENESS)
    alike = sum(value for value, k in likenesses if value > LEAST_LIKENESS or k in first)
    return _Started(pose, seen, alike, explained(points, pose, walls, [found[k].placed for k in near]))


def _same(one: Pose, other: Pose) -> bool:
    turn = np.arccos(np.clip((np.trace(one.rotation @ other.rotation.T) - 1.0) / 2.0, -1.0, 1.0))
    return bool(np.linalg.norm(one.translation - other.translation) < SAME_PLACE and turn < SAME_TURN)


def _same_place(one: Pose, other: Pose) -> bool:
    """Whether two poses are the same but for the height."""
    return _same(one, Pose(other.rotation, np.array([*other.translation[:2], one.translation[2]]), other.scale))


def _adjust_all(
    clouds: Sequence[SonarCloud],
    starts: Sequence[_Started | None],
    known: Sequence[int],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> Adjusted | None:
    scans = []
    for i in known:
        start = starts[i]
        assert start is not None
        scans.append(scan_of(clouds[i].points, find_patches(clouds[i].points), start.pose, start.ladders, found))
    if not scans:
        return None
    place = np.array([scan.pose.translation for scan in scans])
    pairs = [
        (a, b) for a in range(len(scans)) for b in range(a + 1, len(scans)) if np.linalg.norm(place[a] - place[b]) < OVERLAP
    ]
    return adjust(scans, walls, found, pairs)


def _along(walls: Walls, pose: Pose) -> Float:
    """Direction along the canal at a scanner, (2,)."""
    _, piece = walls.tree.query(pose.translation[:2])
    normal = walls.normal[piece]
    return np.array([-normal[1], normal[0]])


def _unknown(cloud: SonarCloud) -> SonarPose:
    nothing = np.full((7, 7), np.nan)
    return SonarPose(
        cloud.path, np.full((3, 3), np.nan), np.full(3, np.nan), np.nan, nothing, "undetermined",
        ("along the tunnel", "height", "half turn"), (),
    )  # fmt: skip


def _residuals(rows: Sequence[Rows], scan: int, names: Sequence[str]) -> tuple[Residual, ...]:
    out = []
    for one in rows:
        if scan not in (one.scan, one.other):
            continue
        name = one.name
        if one.other is not None:
            name = names[one.other if one.scan == scan else one.scan]
        absolute = np.abs(one.residual)
        out.append(Residual(one.kind, name, len(absolute), float(np.median(absolute)), float(np.percentile(absolute, 95))))
    return tuple(out)


def _fit(one: LaserLadder, k: int, origin: Float, clouds: Sequence[SonarCloud], starts: Sequence[_Started | None]) -> LadderFit:
    placed = one.placed
    scans = tuple(
        cloud.path.name for cloud, start in zip(clouds, starts, strict=True) if start is not None and k in start.ladders
    )
    across, up, out = placed.axes
    return LadderFit(placed.ladder.name, placed.origin + origin, up, across, out, one.rms, one.rungs, scans)
