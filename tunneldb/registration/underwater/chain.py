"""Poses of sonar scans that see no ladder, from the bed's relief that they share with scans of known pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import find_peaks

from tunneldb.arrays import Float
from tunneldb.registration.underwater.adjustment import Scan, fit
from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import MIN_BED_COSINE, Patches, Pose, overlap_rows
from tunneldb.registration.underwater.relief import NO_EVIDENCE, PIXEL, Relief, height_difference, likelihood, relief_of
from tunneldb.registration.underwater.single import (
    MIN_LEVEL_POINTS,
    Hypothesis,
    PreparedScan,
    missing_ladder_count,
    visible_ladders,
)
from tunneldb.registration.underwater.walls import Walls

MAX_OVERLAP_DISTANCE = 15.0  # m between scanners whose scans are compared
POSE_TOLERANCE = 4  # pixels along the canal: tolerance of poses
MAX_PEAKS = 5  # peaks of a pair's likelihood that are examined
MAX_PLACES = 4  # most likely places, by the bed's relief, that are fitted
MAX_LOG_RATIO = float(np.log(100.0))  # greatest log likelihood ratio of the most likely place to another
MIN_LEAD = float(np.log(20.0))  # likelihood ratio to the next best place from which a place is accepted
MIN_AGREEMENT = float(np.log(5.0))  # likelihood ratio from which two scans agree, or contradict each other
REACHES = (0.3, 0.25, 0.2, 0.15, 0.1, 0.1)
MAX_PATCH_DISTANCE = 0.3  # m; greatest distance between compared patches
MAX_NEIGHBOURS = 3  # known scans that a scan is adjusted with
MAX_SHIFT = 1.0  # m along the canal: greatest shift by the fit; beyond it, the scan has slid to another place
SLIDES = np.arange(-6, 7) * 0.1  # m along the canal: shifts at which a fitted scan is tried again
MIN_LOG_RATIO = float(np.log(30.0 * MAX_PLACES * len(SLIDES)))  # log likelihood ratio of the best trial to no match
PLACE_TOLERANCE = 0.1  # m between two poses that are the same
OUTLIER_SHARE = 0.05  # share of a bed's patches that differ from another scan: objects, false echoes
STRIP_WIDTH = 0.5  # m across: width of strips in which the bed has one height along the canal


@dataclass
class Reliefs:
    """Reliefs of scans, by their index in the list, and agreement of pairs of them, computed on demand."""

    scans: Mapping[int, PreparedScan]
    _reliefs: dict[int, Relief | None] = field(default_factory=dict)
    _pairs: dict[tuple[int, int, bool], Float] = field(default_factory=dict)

    def of(self, i: int) -> Relief | None:
        """Return the relief of a scan."""
        if i not in self._reliefs:
            self._reliefs[i] = relief_of(self.scans[i].flat)
        return self._reliefs[i]

    def likelihood(self, known: int, i: int, *, turned: bool) -> Float:
        """Return the likelihood of each shift of scan ``i``, optionally ``turned`` by 180°, in the level frame of ``known``."""
        if (known, i, turned) not in self._pairs:
            one, other = self.of(known), self.of(i)
            if one is None or other is None:
                self._pairs[known, i, turned] = np.full(1, NO_EVIDENCE)
            else:
                self._pairs[known, i, turned] = likelihood(one, other.turned() if turned else other)
        return self._pairs[known, i, turned]

    def may_overlap(self, one: int, other: int) -> bool:
        """Return True if two scans may show the same bed at some shift."""
        return any(bool((self.likelihood(one, other, turned=turned) > 0.0).any()) for turned in (False, True))

    def near(self, known: int, i: int, shift: float, *, turned: bool) -> Float:
        """Return the likelihoods at shifts within POSE_TOLERANCE pixels of ``shift``, m; 0 where undefined."""
        values = self.likelihood(known, i, turned=turned)
        at = round(shift / PIXEL) + len(values) // 2 + np.arange(-POSE_TOLERANCE, POSE_TOLERANCE + 1)
        inside = (at >= 0) & (at < len(values))
        found = np.where(inside, values[np.clip(at, 0, len(values) - 1)], NO_EVIDENCE)
        return np.where(found > NO_EVIDENCE, found, 0.0)


@dataclass(frozen=True)
class _Place:
    """Possible place of a scan: next to scan ``known``, ``shift`` m along, ``turned`` or not; with its likelihood."""

    known: int
    shift: float
    turned: bool
    point: Float
    direction: Float
    likelihood: float

    def is_at(self, other: _Place) -> bool:
        """Return True if it is the same place, within the tolerance of poses, with the same orientation."""
        return self.along(other) <= POSE_TOLERANCE * PIXEL and float(self.direction @ other.direction) > 0.0

    def along(self, other: _Place) -> float:
        """Return the distance to another place along the canal, m."""
        return abs(float((self.point - other.point) @ self.direction))


def pose_from_neighbours(
    i: int,
    reliefs: Reliefs,
    started: Mapping[int, Hypothesis],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> tuple[Hypothesis, float] | None:
    """Return the pose of scan ``i`` relative to started scans of the same bed, and its likelihood; None if uncertain."""
    tried = (_fitted_pose(i, place, reliefs, started, walls) for place in _likeliest(_places(i, reliefs, started)))
    settled = sorted((one for one in tried if one is not None), key=lambda one: -one[1])
    if not settled or settled[0][1] < MIN_LOG_RATIO:
        return None
    pose, likelihood = settled[0]
    for other, less in settled[1:]:
        if less > likelihood - MIN_LEAD and np.linalg.norm(other.translation - pose.translation) > PLACE_TOLERANCE:
            return None
    seen = visible_ladders(reliefs.scans[i], pose, found)
    return None if missing_ladder_count(pose, seen, found) else (Hypothesis(pose, seen), likelihood)


def _likeliest(places: Sequence[_Place]) -> list[_Place]:
    """Return the places that are worth fitting, without repeats."""
    out: list[_Place] = []
    for one in sorted(places, key=lambda one: -one.likelihood):
        if out and one.likelihood < out[0].likelihood - MAX_LOG_RATIO:
            break
        if not any(one.is_at(other) for other in out):
            out.append(one)
    return out[:MAX_PLACES]


def _fitted_pose(
    i: int, place: _Place, reliefs: Reliefs, started: Mapping[int, Hypothesis], walls: Walls
) -> tuple[Pose, float] | None:
    """Return the pose fitted from a place to neighbouring scans, and its likelihood by the bed; None if it slides away."""
    scans = reliefs.scans
    pose = _pose(i, place, reliefs, started, walls)
    if pose is None:
        return None
    neighbours = sorted(started, key=lambda k: float(np.linalg.norm(started[k].pose.translation - pose.translation)))[
        :MAX_NEIGHBOURS
    ]
    own, others = _levelled(scans[i], pose), [_levelled(scans[k], started[k].pose) for k in neighbours]
    found, likelihood = _fitted_to_neighbours(own, others, walls, place.direction)
    moved = abs(float((found.translation - pose.translation)[:2] @ place.direction))
    return (found, likelihood) if moved < MAX_SHIFT else None


def _fitted_to_neighbours(own: Scan, others: Sequence[Scan], walls: Walls, direction: Float) -> tuple[Pose, float]:
    """Return the pose of a scan fitted to fixed scans, tried at several shifts along the canal, and its likelihood."""
    pairs = [(k, len(others)) for k in range(len(others))]

    def fitted(start: Pose, reaches: Sequence[float]) -> Pose:
        free = replace(own, pose=start)
        return fit([*others, free], walls, (), pairs, reaches, len(others)).poses[-1]

    def likelihood(one: Pose) -> float:
        rough = _roughness(own.smooth, one, direction)
        return sum(bed_likelihood((other.smooth, own.smooth), (other.pose, one), rough) for other in others)

    found = fitted(own.pose, REACHES)
    along = np.array([*direction, 0.0])
    slid = [replace(found, translation=found.translation + slide * along) for slide in SLIDES]
    best = max(slid, key=likelihood)
    if best is not slid[len(slid) // 2]:
        found = fitted(best, REACHES[1:])
    return found, likelihood(found)


def _shows_waterline(scan: PreparedScan) -> bool:
    """Return True if it shows the water's level: that is level, while errors of slope accumulate."""
    return len(scan.level.points) >= MIN_LEVEL_POINTS


def _levelled(scan: PreparedScan, pose: Pose) -> Scan:
    """Return the scan without ladders, at the height given by the water."""
    if _shows_waterline(scan):
        over = float(np.median(pose.apply(scan.level.points)[:, 2]))
        pose = replace(pose, translation=pose.translation - [0.0, 0.0, over])
    return Scan(scan.patches, scan.smooth, scan.columns, scan.level, pose, {})


def _roughness(patches: Patches, pose: Pose, direction: Float) -> float:
    """Return the spread of the bed's height, m, about the part that is constant along the canal, from a scan's patches."""
    place = pose.apply(patches.centre)[(patches.normal @ pose.rotation.T)[:, 2] > MIN_BED_COSINE]
    across = np.floor((place[:, :2] @ [-direction[1], direction[0]]) / STRIP_WIDTH).astype(np.int64)
    order = np.lexsort([place[:, 2], across])
    _, begin, number, count = np.unique(across[order], return_index=True, return_inverse=True, return_counts=True)
    height = place[order, 2]
    away = np.abs(height - height[begin + count // 2][number])
    return float(1.4826 * np.median(away)) if len(away) else 0.0


def bed_likelihood(patches: tuple[Patches, Patches], poses: tuple[Pose, Pose], roughness: float) -> float:
    """Return the log likelihood ratio that two scans show the same bed where they overlap, or different beds.

    Heights of the same bed differ by errors of patches, those of different beds also by the bed's roughness. The patches of a
    stretch are correlated, so their mean counts.
    """
    rows = overlap_rows(*patches, poses, np.zeros(4), (0, 1), np.arange(4), MAX_PATCH_DISTANCE)
    if rows is None:
        return 0.0
    bed = rows.poses[:, 5] > MIN_BED_COSINE
    square, same = rows.residual[bed] ** 2, rows.sigma[bed] ** 2
    other = same + 2.0 * roughness**2
    ratio = 0.5 * (np.log(other / same) - square / same + square / other)
    log_ratio = np.log((1.0 - OUTLIER_SHARE) * np.exp(ratio) + OUTLIER_SHARE)
    _, stretch, count = np.unique(rows.group[bed], return_inverse=True, return_counts=True)
    return float((np.bincount(stretch, log_ratio) / count).sum())


def direction_of(scan: PreparedScan, pose: Pose) -> Float:
    """Return the direction (2,) of the x axis of a scan's level frame in the tunnel."""
    along = (pose.rotation @ scan.flat.rotation.T)[:2, 0]
    return np.asarray(along / np.linalg.norm(along))


def _places(i: int, reliefs: Reliefs, started: Mapping[int, Hypothesis]) -> list[_Place]:
    """Return possible places of scan ``i``, from each of its pairs, with the likelihood by all scans around them."""
    stand = {k: one.pose.translation[:2] for k, one in started.items()}
    look = {k: direction_of(reliefs.scans[k], one.pose) for k, one in started.items()}
    out = []
    for k in started:
        for turned in (False, True):
            values = reliefs.likelihood(k, i, turned=turned)
            peaks, _ = find_peaks(values, height=0.0)
            for peak in peaks[np.argsort(-values[peaks])][:MAX_PEAKS]:
                shift = (int(peak) - len(values) // 2) * PIXEL
                point, direction = stand[k] + shift * look[k], look[k] * (-1.0 if turned else 1.0)
                if not reliefs.scans[i].cloud.may_stand(point):
                    continue
                total = np.zeros(2 * POSE_TOLERANCE + 1)
                for other in started:
                    if np.linalg.norm(point - stand[other]) < MAX_OVERLAP_DISTANCE:
                        along = float((point - stand[other]) @ look[other])
                        same = float(direction @ look[other]) > 0.0
                        near = reliefs.near(other, i, along, turned=not same)
                        total += near if float(look[k] @ look[other]) > 0.0 else near[::-1]
                out.append(_Place(k, shift, turned, point, direction, float(total.max())))
    return out


def _pose(i: int, place: _Place, reliefs: Reliefs, started: Mapping[int, Hypothesis], walls: Walls) -> Pose | None:
    """Return the pose of a level scan at a place, at its own distance from the wall and at the bed's height."""
    flat: LevelScan = reliefs.scans[i].flat
    across = np.array([-place.direction[1], place.direction[0]])
    facing = np.flatnonzero(walls.normal @ across > 0.0)  # walls behind the scanner, where y is least
    if len(facing) == 0:
        return None
    piece = facing[np.argmin(np.linalg.norm(walls.foot[facing, :2] - place.point, axis=1))]
    normal = walls.normal[piece]
    along = np.array([normal[1], -normal[0]])
    basis = np.column_stack([[*along, 0.0], [*normal, 0.0], [0.0, 0.0, 1.0]])
    one, other = reliefs.of(place.known), reliefs.of(i)
    assert one is not None
    assert other is not None
    over = height_difference(one, other.turned() if place.turned else other, round(place.shift / PIXEL))
    height = started[place.known].pose.translation[2] + over
    foot = walls.foot[piece, :2]
    plan = foot + ((place.point - foot) @ along) * along - flat.walls[0] * normal
    return Pose(basis @ flat.rotation, np.array([*plan, height]), 1.0)


def agreement(one: int, other: int, poses: tuple[Pose, Pose], reliefs: Reliefs, walls: Walls) -> int:
    """Compare the bed of two scans where their poses overlap: 1 the same, -1 different, 0 undecided.

    If the relief is not sufficient, the second scan is fitted to the first from its given pose.
    """
    first, second = poses
    look = direction_of(reliefs.scans[one], first)
    same = float(look @ direction_of(reliefs.scans[other], second)) > 0.0
    along = float((second.translation - first.translation)[:2] @ look)
    evidence = float(reliefs.near(one, other, along, turned=not same).max())
    if abs(evidence) > MIN_AGREEMENT:
        return int(np.sign(evidence))
    scans = reliefs.scans
    own, neighbour = _levelled(scans[other], second), _levelled(scans[one], first)
    _, closely = _fitted_to_neighbours(own, [neighbour], walls, look)
    return int(np.sign(closely)) if abs(closely) > MIN_LOG_RATIO else 0
