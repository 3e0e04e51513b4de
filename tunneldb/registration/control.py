"""Comparison of target spheres with control points: correspondences, distances, and the best rigid motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float, Int64

MAX_DISTANCE = 0.1
"""Default greatest distance between a control point and its sphere, m."""

MAX_DISTANCE_DIFFERENCE = 0.02
"""Greatest difference between a distance of spheres and a distance of control points that are the same, m."""

MAX_BASES = 3000  # pairs of spheres that are tried as a start, the longest first

MAX_TURN_SIGMA = math.radians(1.0)
"""Standard deviation of a rotation about a line above which the rotation is not determined."""

MIN_NOISE = 0.001  # m; least standard deviation of a centre, since residuals of few points are uncertain


@dataclass(frozen=True)
class Match:
    """Correspondence of spheres and control points.

    Attributes
    ----------
    pairs : (k, 2) int array
        Indices of sphere and control point, from 0.
    how : str
        ``place`` (they are near each other), ``distances`` (they are not, but their mutual distances agree),
        ``ambiguous`` (mutual distances agree in several ways) or ``none``.
    """

    pairs: Int64
    how: str


@dataclass(frozen=True)
class Motion:
    """Rigid motion q = rotation · (p − pivot) + pivot + shift that minimises the distances between points.

    Attributes
    ----------
    rotation : (3, 3) float64 array
    pivot, shift : (3,) float64 arrays
        Centre of gravity of the moved points, and its translation, m.
    angles : (3,) float64 array
        Successive rotations about the x, y and z axes, degrees.
    rms_before, rms_after : float
        Root mean square distance of the pairs, m.
    freedom : int
        Number of coordinates minus number of unknowns.
    determined : str
        ``all``; ``line`` (points on a line: the rotation about it is unknown and set to 0), ``shift`` (one point: the
        rotation is unknown).
    turn_sigma : float
        Standard deviation of the least certain rotation, degrees; NaN if it isn't determined.
    """

    rotation: Float
    pivot: Float
    shift: Float
    angles: Float
    rms_before: float
    rms_after: float
    freedom: int
    determined: str
    turn_sigma: float

    def apply(self, points: Float) -> Float:
        """Return points (n, 3) moved, m."""
        moved: Float = (points - self.pivot) @ self.rotation.T + self.pivot + self.shift
        return moved


def match(spheres: Float, control: Float, within: float = MAX_DISTANCE) -> Match:
    """Find the correspondence of spheres and control points.

    By place, if three pairs, or all possible pairs, are within the distance; the sum of distances is minimal. Otherwise by
    congruence: mutual distances do not depend on the frame. At least three pairs are required, and only one solution.

    Parameters
    ----------
    spheres, control : (n, 3) and (m, 3) float64 arrays
        Centres of spheres, and control points, m.
    within : float
        Greatest distance of a pair, m.
    """
    near = _by_place(spheres, control, within)
    if len(near) >= min(3, len(spheres), len(control)) and len(near):
        return Match(near, "place")
    pairs, ways = _by_distances(spheres, control)
    if ways > 1:
        return Match(np.zeros((0, 2), np.int64), "ambiguous")
    if ways == 1 and len(pairs) > len(near):
        return Match(pairs, "distances")
    return Match(near, "place" if len(near) else "none")


def best_motion(points: Float, onto: Float) -> Motion:
    """Return rotation and shift, without scale, from points (n, 3) to others (n, 3), n ≥ 1, by least squares.

    Source: Kabsch (1976), Acta Crystallographica A32; Umeyama (1991), IEEE PAMI 13(4), for the sign that rules out a mirror.
    """
    pivot, target = points.mean(axis=0), onto.mean(axis=0)
    a, b = points - pivot, onto - target
    count = len(points)
    left, _, right = np.linalg.svd(b.T @ a)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = left @ sign @ right
    rms_before = _rms(onto - points)
    freedom = 3 * count - 6
    noise = max(_rms(b - a @ rotation.T) * math.sqrt(count / max(freedom, 1)), MIN_NOISE)
    across = float(np.linalg.svd(a, compute_uv=False)[1]) if count > 1 else 0.0
    if count == 1:
        determined, rotation, freedom = "shift", np.eye(3), 0
    elif across == 0.0 or noise / across > MAX_TURN_SIGMA:
        determined, rotation, freedom = "line", _turn(_direction(a), _direction(b), a, b), 3 * count - 5
    else:
        determined = "all"
    turn_sigma = math.degrees(noise / across) if determined == "all" else math.nan
    angles = Rotation.from_matrix(rotation).as_euler("xyz", degrees=True)
    rms_after = _rms(b - a @ rotation.T)
    return Motion(rotation, pivot, target - pivot, angles, rms_before, rms_after, freedom, determined, turn_sigma)


def _by_place(spheres: Float, control: Float, within: float) -> Int64:
    """Return the pairs within a distance; a pair farther apart costs the same as two unpaired points."""
    if len(spheres) == 0 or len(control) == 0:
        return np.zeros((0, 2), np.int64)
    gap = np.linalg.norm(spheres[:, None] - control[None], axis=2)
    rows, columns = linear_sum_assignment(np.minimum(gap, 2.0 * within))
    near = gap[rows, columns] <= within
    return np.column_stack([rows[near], columns[near]]).astype(np.int64)


def _by_distances(spheres: Float, control: Float) -> tuple[Int64, int]:
    """Return the largest set of pairs whose distances agree, and the number of sets of that size (0: no three agree)."""
    if min(len(spheres), len(control)) < 3:
        return np.zeros((0, 2), np.int64), 0
    ours = np.linalg.norm(spheres[:, None] - spheres[None], axis=2)
    theirs = np.linalg.norm(control[:, None] - control[None], axis=2)
    begins, ends = np.nonzero(~np.eye(len(control), dtype=bool))
    order = np.argsort(theirs[begins, ends], kind="stable")
    begins, ends = begins[order], ends[order]
    length = theirs[begins, ends]
    i, j = np.triu_indices(len(spheres), 1)
    longest = np.argsort(-ours[i, j], kind="stable")[:MAX_BASES]
    best: dict[tuple[tuple[int, int], ...], Int64] = {}
    size = 2
    for base in longest:
        one, two = int(i[base]), int(j[base])
        low, high = np.searchsorted(length, ours[one, two] + np.array([-MAX_DISTANCE_DIFFERENCE, MAX_DISTANCE_DIFFERENCE]))
        for other in range(low, high):
            pairs = _grow(spheres, control, ours, theirs, (one, two), (int(begins[other]), int(ends[other])))
            if len(pairs) < max(size, 3):
                continue
            if len(pairs) > size:
                best.clear()
                size = len(pairs)
            best[tuple(map(tuple, pairs.tolist()))] = pairs
        if size == min(len(spheres), len(control)):
            break
    if not best:
        return np.zeros((0, 2), np.int64), 0
    return next(iter(best.values())), len(best)


def _grow(spheres: Float, control: Float, ours: Float, theirs: Float, base: tuple[int, int], onto: tuple[int, int]) -> Int64:
    """Return the pairs that agree with two given ones: a third by its distances, then all that the motion brings together."""
    best = np.zeros((0, 2), np.int64)
    fits = (np.abs(ours[base[0]][:, None] - theirs[onto[0]][None]) <= MAX_DISTANCE_DIFFERENCE) & (
        np.abs(ours[base[1]][:, None] - theirs[onto[1]][None]) <= MAX_DISTANCE_DIFFERENCE
    )
    fits[list(base)] = False
    fits[:, list(onto)] = False
    for third, point in np.argwhere(fits):
        if len(best) and (best == [third, point]).all(axis=1).any():
            continue  # already in a set found from an earlier third pair
        motion = best_motion(spheres[[*base, third]], control[[*onto, point]])
        if motion.rms_after > MAX_DISTANCE_DIFFERENCE:
            continue
        pairs = _by_place(motion.apply(spheres), control, 2.0 * MAX_DISTANCE_DIFFERENCE)
        if len(pairs) >= 3:
            refined = best_motion(spheres[pairs[:, 0]], control[pairs[:, 1]])
            pairs = _by_place(refined.apply(spheres), control, 2.0 * MAX_DISTANCE_DIFFERENCE)
        if len(pairs) > len(best):
            best = pairs
    return best


def _direction(centred: Float) -> Float:
    """Return the direction (3,) of a line through centred points (n, 3)."""
    direction: Float = np.linalg.svd(centred)[2][0]
    return direction


def _turn(one: Float, other: Float, a: Float, b: Float) -> Float:
    """Return the least rotation from one direction to another, with the same order of the points."""
    if float((a @ one) @ (b @ other)) < 0.0:
        other = -other
    axis = np.cross(one, other)
    sine, cosine = float(np.linalg.norm(axis)), float(one @ other)
    if sine < 1e-12:
        if cosine > 0.0:
            return np.eye(3)
        axis = np.cross(one, np.eye(3)[int(np.argmin(np.abs(one)))])
        axis /= np.linalg.norm(axis)
        return np.asarray(Rotation.from_rotvec(np.pi * axis).as_matrix())
    return np.asarray(Rotation.from_rotvec(axis / sine * math.atan2(sine, cosine)).as_matrix())


def _rms(difference: Float) -> float:
    return math.sqrt(float((difference**2).sum()) / len(difference))
