"""Planes of the ground by RANSAC, whose inliers' normals must be near the vertical (Li et al. 2023, section 2.1)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Float, Int64, UInt64

_TRIALS = 1000  # at the most
_MISS = 1e-3  # accepted chance that no sample lies on the plane alone
_SCORED = 2000  # points that a plane is measured with
_CHECKED = 60  # inliers whose normals are estimated
_LEAST = 12  # inliers


class Planes(NamedTuple):
    """Planes of some groups of points.

    Attributes
    ----------
    coefficients : (g, 3) float array
        z = c0 + c1 u + c2 v of each group; NaN where it has no plane.
    inliers : (g,) int array
        Points within τ of it, of those it was measured with.
    """

    coefficients: Float
    inliers: Int64


def ransac_planes(
    points: Float, bounds: Int64, distance: float, angle: float, radius: float, seed: Int64, check: bool = True
) -> Planes:
    """Best plane of each group of points.

    A plane through three points drawn at random is better the more points lie within τ of it (step 2). A better
    one is kept only if the normals of its inliers, by principal components of the points within R, depart from the
    vertical by less than δ in the median (step 3). The inliers of the best one are fitted by least squares.

    Parameters
    ----------
    points : (n, 3) float array
        u, v and height, m, from an origin near the group.
    bounds : (g, 2) int array
        First point of each group and the one after its last.
    distance, angle, radius : float
        τ in m, δ in degrees, R in m.
    seed : (g,) int array
        Start of the random numbers of each group.
    check : bool
        Whether normals are checked.
    """
    out = np.full((len(bounds), 3), np.nan)
    inliers = np.zeros(len(bounds), np.int64)
    slope = math.tan(math.radians(angle))
    _planes(
        np.ascontiguousarray(points),
        bounds.astype(np.int64),
        distance,
        slope,
        radius,
        seed.astype(np.uint64),
        check,
        out,
        inliers,
    )
    return Planes(out, inliers)


@njit(cache=True, nogil=True, inline="always")
def draw(state: Int64) -> float:
    """Next random number, from 0 to 1, of a state that is stepped (splitmix64; Steele et al., 2014)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) / 9007199254740992.0


@njit(cache=True, nogil=True)
def through(p: Float, q: Float, r: Float, out: Float) -> bool:
    """Put the plane w = c0 + c1 u + c2 v through three points (u, v, w); False where they don't span it."""
    u1, v1, w1 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    u2, v2, w2 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    area = u1 * v2 - u2 * v1
    if abs(area) < 1e-4:
        return False
    out[1] = (w1 * v2 - w2 * v1) / area
    out[2] = (u1 * w2 - u2 * w1) / area
    out[0] = p[2] - out[1] * p[0] - out[2] * p[1]
    return True


@njit(cache=True, nogil=True)
def _tilt(points: Float, at: int, radius: float) -> float:
    """Tangent of the angle between the normal at a point and the vertical; infinite where too few points are near.

    Of a surface that is not steep the principal plane is that of least squares in height.
    """
    square = radius * radius
    n, su, sv, sz, suu, suv, svv, suz, svz = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    szz = 0.0
    for k in range(points.shape[0]):
        u, v = points[k, 0] - points[at, 0], points[k, 1] - points[at, 1]
        if u * u + v * v > square:
            continue
        z = points[k, 2] - points[at, 2]
        if u * u + v * v + z * z > square:
            continue
        n += 1
        su, sv, sz = su + u, sv + v, sz + z
        suu, suv, svv = suu + u * u, suv + u * v, svv + v * v
        suz, svz, szz = suz + u * z, svz + v * z, szz + z * z
    if n < 5:
        return np.inf
    m = np.empty((3, 3))
    m[0, 0], m[1, 1], m[2, 2] = suu - su * su / n, svv - sv * sv / n, szz - sz * sz / n
    m[0, 1], m[0, 2], m[1, 2] = suv - su * sv / n, suz - su * sz / n, svz - sv * sz / n
    m[1, 0], m[2, 0], m[2, 1] = m[0, 1], m[0, 2], m[1, 2]
    values, vectors = np.linalg.eigh(m)
    if values[1] < 0.1 * values[2]:
        return np.inf  # points on a line, if a rough one: one profile
    up = abs(vectors[2, 0])
    return math.sqrt(max(1.0 - up * up, 0.0)) / up if up > 1e-9 else np.inf


@njit(cache=True, nogil=True)
def _level(points: Float, plane: Float, distance: float, slope: float, radius: float) -> bool:
    """Tell whether the normals of a plane's inliers are near the vertical, in the median of those that have one."""
    count = points.shape[0]
    step = max(1, count // _CHECKED)
    tilts = np.empty(count // step + 1)
    for wider in range(3):
        n, alone = 0, 0
        for k in range(0, count, step):
            if abs(points[k, 2] - plane[0] - plane[1] * points[k, 0] - plane[2] * points[k, 1]) < distance:
                tilt = _tilt(points, k, radius * (1 << wider))
                if np.isinf(tilt):
                    alone += 1
                else:
                    tilts[n] = tilt
                    n += 1
        # Profiles may lie farther apart than R: look farther.
        if n > alone:
            return np.median(tilts[:n]) < slope
    return False


@njit(cache=True, nogil=True)
def _fitted(points: Float, plane: Float, distance: float) -> int:
    """Fit a plane to its inliers by least squares, in place, and count them."""
    a = np.zeros((3, 3))
    b = np.zeros(3)
    row = np.empty(3)
    n = 0
    for k in range(points.shape[0]):
        row[0], row[1], row[2] = 1.0, points[k, 0], points[k, 1]
        if abs(points[k, 2] - plane[0] * row[0] - plane[1] * row[1] - plane[2] * row[2]) < distance:
            n += 1
            for i in range(3):
                b[i] += row[i] * points[k, 2]
                for j in range(3):
                    a[i, j] += row[i] * row[j]
    if n >= _LEAST:
        for i in range(3):
            a[i, i] += 1e-9
        plane[:] = np.linalg.solve(a, b)
    return n


@njit(cache=True, nogil=True, parallel=True)
def _planes(
    points: Float, bounds: Int64, distance: float, slope: float, radius: float, seed: UInt64, check: bool,
    out: Float, inliers: Int64,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    for g in prange(bounds.shape[0]):
        group = points[bounds[g, 0] : bounds[g, 1]]
        count = group.shape[0]
        if count < _LEAST:
            continue
        step = max(1, count // _SCORED)
        state = seed[g : g + 1].copy()
        plane, best = np.empty(3), np.empty(3)
        most = _LEAST - 1
        trials, done = _TRIALS, 0
        while done < trials:
            done += 1
            i, j, k = int(draw(state) * count), int(draw(state) * count), int(draw(state) * count)
            if not through(group[i], group[j], group[k], plane):
                continue
            steep = math.sqrt(plane[1] ** 2 + plane[2] ** 2)
            if check and steep > slope:
                continue
            n = 0
            reach = distance * math.sqrt(1.0 + steep * steep)
            for m in range(0, count, step):
                if abs(group[m, 2] - plane[0] - plane[1] * group[m, 0] - plane[2] * group[m, 1]) < reach:
                    n += 1
            if n <= most or (check and not _level(group, plane, distance, slope, radius)):
                continue
            most = n
            best[:] = plane
            share = min(n * step / count, 0.999)
            trials = min(_TRIALS, max(30, int(math.log(_MISS) / math.log(1.0 - share**3 + 1e-12)) + 1))
        if most >= _LEAST:
            _fitted(group, best, distance)
            inliers[g] = _fitted(group, best, distance)
            out[g] = best
