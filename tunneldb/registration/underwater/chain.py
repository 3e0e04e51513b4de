"""Poses of sonar scans that see no ladder, beside others whose poses are known: by the relief of the bed that they see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import find_peaks

from tunneldb.arrays import Float
from tunneldb.registration.underwater.adjustment import adjust, scan_of
from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.registration.underwater.laser_ladders import LaserLadder
from tunneldb.registration.underwater.observations import Pose, Rows
from tunneldb.registration.underwater.relief import NOWHERE, PIXEL, Relief, height_difference, likelihood, relief_of
from tunneldb.registration.underwater.single import PreparedScan, StartedScan, misses, sees
from tunneldb.registration.underwater.walls import Walls

OVERLAP = 15.0  # m between scanners whose scans are compared
LOOSE = 4  # pixels along by which poses may be off
PEAKS = 5  # of a pair's likelihood that are followed
SURE = float(np.log(30.0))  # likelihood of a place over that of none, from which it is taken
AHEAD = float(np.log(20.0))  # and over that of the next best
SAID = float(np.log(5.0))  # likelihood from which two scans agree, or contradict each other
ELSEWHERE = 10  # pixels along from which a place is another
REACHES = (0.3, 0.25, 0.2, 0.15, *[0.1] * 8)
BESIDE = 3  # known scans that it is adjusted with
MOST_MOVED = 0.5  # m along by which that may move it: farther, it has slid to another place
SAME_PLACE = 0.1  # m: of two poses that are one
AGREEING = 0.02  # m: median distance of patches that show the same
LEAST_SHARED = 60  # patches


@dataclass
class Reliefs:
    """Reliefs of scans, by their places in the list, and how well pairs of them agree, worked out when they are asked for."""

    scans: Mapping[int, PreparedScan]
    _reliefs: dict[int, Relief | None] = field(default_factory=dict)
    _pairs: dict[tuple[int, int, bool], Float] = field(default_factory=dict)

    def of(self, i: int) -> Relief | None:
        """Relief of a scan."""
        if i not in self._reliefs:
            self._reliefs[i] = relief_of(self.scans[i].flat)
        return self._reliefs[i]

    def likelihood(self, known: int, i: int, *, turned: bool) -> Float:
        """That of each shift along of scan ``i``, or of it ``turned`` by half a turn, in the level frame of scan ``known``."""
        if (known, i, turned) not in self._pairs:
            one, other = self.of(known), self.of(i)
            if one is None or other is None:
                self._pairs[known, i, turned] = np.full(1, NOWHERE)
            else:
                self._pairs[known, i, turned] = likelihood(one, other.turned() if turned else other)
        return self._pairs[known, i, turned]

    def near(self, known: int, i: int, shift: float, *, turned: bool) -> Float:
        """Likelihoods at shifts LOOSE pixels either way about one, m; 0 where nothing can be said."""
        values = self.likelihood(known, i, turned=turned)
        at = round(shift / PIXEL) + len(values) // 2 + np.arange(-LOOSE, LOOSE + 1)
        inside = (at >= 0) & (at < len(values))
        found = np.where(inside, values[np.clip(at, 0, len(values) - 1)], NOWHERE)
        return np.where(found > NOWHERE, found, 0.0)


@dataclass(frozen=True)
class _Place:
    """Where a scan may stand: beside scan ``known``, ``shift`` m along, ``turned`` or not; and the likelihood of that."""

    known: int
    shift: float
    turned: bool
    point: Float
    direction: Float
    likelihood: float

    def elsewhere(self, other: _Place) -> bool:
        """Whether it is another place, or another way round."""
        return self.along(other) > ELSEWHERE * PIXEL or float(self.direction @ other.direction) < 0.0

    def along(self, other: _Place) -> float:
        """Distance to another place along the canal, m."""
        return abs(float((self.point - other.point) @ self.direction))


def place_beside(
    i: int,
    reliefs: Reliefs,
    started: Mapping[int, StartedScan],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> StartedScan | None:
    """Pose of scan ``i`` beside those started that it shares the bed with; None if it isn't sure."""
    scans = reliefs.scans
    places = sorted(_places(i, reliefs, started), key=lambda one: -one.likelihood)
    if not places or places[0].likelihood < SURE:
        return None
    best = places[0]
    rivals = [one for one in places if one.likelihood > best.likelihood - AHEAD]
    if any(one.elsewhere(best) for one in rivals):
        return None
    settled = [_settled(i, one, reliefs, started, walls, found) for one in _apart(rivals)]
    first = settled[0]
    # what is settled from beside it must be the same
    if first is None or any(
        one is not None and np.linalg.norm(one.translation - first.translation) > SAME_PLACE for one in settled[1:]
    ):
        return None
    seen = sees(scans[i], first, found)
    return None if misses(first, seen, found) else StartedScan(first, seen)


def _apart(places: Sequence[_Place]) -> list[_Place]:
    """Those of some places, the likeliest first, that are not the same but for what poses may be off."""
    out: list[_Place] = []
    for one in places:
        if all(one.along(other) > LOOSE * PIXEL for other in out):
            out.append(one)
    return out


def _settled(
    i: int,
    place: _Place,
    reliefs: Reliefs,
    started: Mapping[int, StartedScan],
    walls: Walls,
    found: Sequence[LaserLadder],
) -> Pose | None:
    """Pose of a scan adjusted from a place together with those beside it; None if it slides away or shows something else."""
    scans = reliefs.scans
    pose = _pose(i, place, reliefs, started, walls)
    if pose is None:
        return None
    beside = sorted(started, key=lambda k: float(np.linalg.norm(started[k].pose.translation - pose.translation)))[:BESIDE]
    together = [
        scan_of(scans[k].thin, scans[k].patches, scans[k].edges, started[k].pose, started[k].ladders, found) for k in beside
    ]
    together.append(scan_of(scans[i].thin, scans[i].patches, scans[i].edges, pose, (), found))
    pairs = [(a, b) for a in range(len(together)) for b in range(a + 1, len(together))]
    adjusted = adjust(together, walls, found, pairs, REACHES)
    moved = abs(float((adjusted.poses[-1].translation - pose.translation)[:2] @ place.direction))
    return adjusted.poses[-1] if moved < MOST_MOVED and _agree(adjusted.rows, len(beside)) else None


def _direction(scan: PreparedScan, pose: Pose) -> Float:
    """Way (2,) in which the x axis of a scan's level frame points in the tunnel."""
    along = (pose.rotation @ scan.flat.rotation.T)[:2, 0]
    return np.asarray(along / np.linalg.norm(along))


def _places(i: int, reliefs: Reliefs, started: Mapping[int, StartedScan]) -> list[_Place]:
    """Places where scan ``i`` may stand, by each pair of it, with what all scans about them say."""
    stand = {k: one.pose.translation[:2] for k, one in started.items()}
    look = {k: _direction(reliefs.scans[k], one.pose) for k, one in started.items()}
    out = []
    for k in started:
        for turned in (False, True):
            values = reliefs.likelihood(k, i, turned=turned)
            peaks, _ = find_peaks(values, height=0.0)
            for peak in peaks[np.argsort(-values[peaks])][:PEAKS]:
                shift = (int(peak) - len(values) // 2) * PIXEL
                point, direction = stand[k] + shift * look[k], look[k] * (-1.0 if turned else 1.0)
                if not reliefs.scans[i].cloud.may_stand(point):
                    continue
                total = np.zeros(2 * LOOSE + 1)
                for other in started:
                    if np.linalg.norm(point - stand[other]) < OVERLAP:
                        along = float((point - stand[other]) @ look[other])
                        same = float(direction @ look[other]) > 0.0
                        near = reliefs.near(other, i, along, turned=not same)
                        total += near if float(look[k] @ look[other]) > 0.0 else near[::-1]
                out.append(_Place(k, shift, turned, point, direction, float(total.max())))
    return out


def _pose(i: int, place: _Place, reliefs: Reliefs, started: Mapping[int, StartedScan], walls: Walls) -> Pose | None:
    """Pose of a level scan at a place: as far from its wall as it sees it to be, as high as the bed says."""
    flat: LevelScan = reliefs.scans[i].flat
    across = np.array([-place.direction[1], place.direction[0]])
    facing = np.flatnonzero(walls.normal @ across > 0.0)  # those behind the scanner, where y is least
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


def _agree(rows: Sequence[Rows], i: int) -> bool:
    """Whether scan ``i`` shows the same as those before it where they overlap."""
    shared = [one.residual for one in rows if one.kind == "scan" and one.other == i]
    residual = np.abs(np.concatenate([*shared, np.zeros(0)]))
    return len(residual) > LEAST_SHARED and float(np.median(residual)) < AGREEING


def agreement(one: int, other: int, poses: tuple[Pose, Pose], reliefs: Reliefs) -> int:
    """Whether two scans show the same bed where their poses say that they see the same: 1 yes, -1 no, 0 it can't be told."""
    first, second = poses
    look = _direction(reliefs.scans[one], first)
    same = float(look @ _direction(reliefs.scans[other], second)) > 0.0
    along = float((second.translation - first.translation)[:2] @ look)
    said = float(reliefs.near(one, other, along, turned=not same).max())
    return int(np.sign(said)) if abs(said) > SAID else 0
