"""Planes by RANSAC (Fischler and Bolles, 1981), for the ground with a check that inliers' normals are near the vertical."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float, Int64

_TRIALS, _MIN_TRIALS = 1000, 30
_MISS = 1e-3  # accepted probability that no sample is on the plane alone
_BATCH = 60  # trials measured together
_SCORED = 2000  # points used to measure a plane
_CHECKED = 60  # minimum number of points with an estimated normal
_MIN_INLIERS = 12  # minimum number of inliers
_MIN_NORMAL_POINTS = 5  # minimum number of points for a normal
_PROFILE = 0.1  # ratio of the second to the first principal variance below which points are on a line
_MIN_AREA = 1e-4  # minimum area of the parallelogram of three points in plan, m²
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


class Planes(NamedTuple):
    """Planes of some groups of points.

    Attributes
    ----------
    coefficients : (g, 3) float array
        z = c0 + c1 u + c2 v of each group; NaN without a plane.
    inliers : (g,) int array
        Number of points within τ of it, among those used to measure it.
    """

    coefficients: Float
    inliers: Int64


def ransac_planes(
    points: Float, bounds: Int64, distance: float, angle: float, radius: float, seed: Int64, check: bool = True
) -> Planes:
    """Find the best plane of each group of points (Li et al. 2023, section 2.1).

    A plane through three random points is better the more points are within τ of it (step 2). A better one is accepted only if
    the normals of its inliers, by principal components of the points within R, deviate from the vertical by less than δ in the
    median (step 3). The inliers of the best one are fitted by least squares.

    Parameters
    ----------
    points : (n, 3) float array
        u, v and height, m, from an origin near the group.
    bounds : (g, 2) int array
        First point of each group and one after its last.
    distance, angle, radius : float
        τ in m, δ in degrees, R in m.
    seed : (g,) int array
        Seed of the random numbers of each group.
    check : bool
        True to check normals.
    """
    out = np.full((len(bounds), 3), np.nan)
    inliers = np.zeros(len(bounds), np.int64)
    slope = math.tan(math.radians(angle))

    def reach(planes: Float) -> Float:
        steep = np.sqrt(planes[:, 1] ** 2 + planes[:, 2] ** 2)
        return np.where(check & (steep > slope), 0.0, distance * np.sqrt(1.0 + steep * steep))

    for g, (begin, end) in enumerate(bounds.tolist()):
        group = points[begin:end]
        if len(group) < _MIN_INLIERS:
            continue
        normals = _Normals(group, radius)
        accept = (lambda plane, near=normals: near.are_upright(plane, distance, slope)) if check else None
        step = max(1, len(group) // _SCORED)
        plane, number = best_plane(
            group, int(seed[g]), reach, _TRIALS, min_inliers=_MIN_INLIERS, step=step, miss=_MISS, accept=accept
        )
        if number:
            for _ in range(2):
                plane, inliers[g] = _fitted(group, plane, distance)
            out[g] = plane
    return Planes(out, inliers)


def best_plane(
    points: Float, seed: int, reach: Callable[[Float], Float], trials: int, *,
    min_inliers: int, step: int = 1, miss: float = 0.0, accept: Callable[[Float], bool] | None = None,
) -> tuple[Float, int]:  # fmt: skip
    """Find the plane w = c0 + c1 u + c2 v through three random points that has the most inliers.

    Parameters
    ----------
    points : (n, 3) float array
        u, v, w.
    seed : int
        Seed of the random numbers.
    reach : callable
        Returns the maximum distance in w of an inlier for some planes (t, 3); 0 or NaN for an unacceptable plane.
    trials : int
        Maximum number of planes tried.
    min_inliers : int
        Minimum number of inliers.
    step : int
        Inliers are counted among every ``step``-th point.
    miss : float
        Probability that no sample consists of inliers only, at which the search may end early; 0 for all trials.
    accept : callable, optional
        Returns True if a plane (3,) with more inliers than any before is acceptable.

    Returns
    -------
    plane : (3,) float array
        Coefficients.
    inliers : int
        Number of its inliers; 0 if there is no plane.
    """
    u, v, w = np.ascontiguousarray(points[::step].T)
    best, best_count, done = np.full(3, np.nan), min_inliers - 1, 0
    while done < trials:
        planes = _sampled(points, seed, done, min(_BATCH, trials - done))
        counts = np.zeros(len(planes), np.int64)
        limit = reach(planes)
        possible = np.flatnonzero(limit > 0.0)
        c0, c1, c2 = planes[possible].T[:, :, None]
        away = w - c0
        away -= c1 * u
        away -= c2 * v
        counts[possible] = np.count_nonzero(np.abs(away, out=away) < limit[possible, None], axis=1)
        for trial in np.flatnonzero(counts > best_count).tolist():
            if done + trial >= trials:
                break
            number = int(counts[trial])
            if number <= best_count or (accept is not None and not accept(planes[trial])):
                continue
            best, best_count = planes[trial], number
            if miss > 0.0:
                share = min(number * step / len(points), 0.999)
                needed = int(math.log(miss) / math.log(1.0 - share**3 + 1e-12)) + 1
                trials = min(trials, max(_MIN_TRIALS, needed))
        done += len(planes)
    return best, best_count if best_count >= min_inliers else 0


def _sampled(points: Float, seed: int, first: int, count: int) -> Float:
    """Return planes (count, 3) through three random points each; NaN if these are collinear."""
    index = (_uniform(seed, 3 * first, 3 * count) * len(points)).astype(np.int64).reshape(count, 3)
    p, q, r = points[index[:, 0]], points[index[:, 1]], points[index[:, 2]]
    (u1, v1, w1), (u2, v2, w2) = (q - p).T, (r - p).T
    area = u1 * v2 - u2 * v1
    area[np.abs(area) < _MIN_AREA] = np.nan
    c1 = (w1 * v2 - w2 * v1) / area
    c2 = (u1 * w2 - u2 * w1) / area
    return np.column_stack([p[:, 2] - c1 * p[:, 0] - c2 * p[:, 1], c1, c2])


def _uniform(seed: int, first: int, count: int) -> Float:
    """Return random numbers from 0 to 1 of a seed, from the ``first`` on (splitmix64; Steele et al., 2014)."""
    z = np.arange(first + 1, first + count + 1, dtype=np.uint64) * _GOLDEN + np.uint64(seed % (1 << 64))
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return (z >> np.uint64(11)) / 9007199254740992.0


class _Normals:
    """Deviation of the normals of a group's points from the vertical, at evenly chosen points of it."""

    def __init__(self, points: Float, radius: float) -> None:
        self._points, self._radius = points, radius
        self._chosen = points[:: max(1, len(points) // _CHECKED)]
        self._tree: cKDTree | None = None
        self._tilts: list[Float] = []

    def are_upright(self, plane: Float, distance: float, slope: float) -> bool:
        """Return True if the normals of a plane's inliers are near the vertical, in the median of those with a normal."""
        inlier = _off(self._chosen, plane) < distance
        for wider in range(3):
            if wider == len(self._tilts):
                self._tilts.append(self._tilt(self._radius * (1 << wider)))
            tilt = self._tilts[wider][inlier]
            known = tilt[np.isfinite(tilt)]
            # Profiles may be farther apart than R: use a larger radius.
            if 2 * len(known) > len(tilt):
                return bool(np.median(known) < slope)
        return False

    def _tilt(self, radius: float) -> Float:
        """Return the tangent of the angle between normals and the vertical; infinite if too few points are near.

        For a surface that is not steep the principal plane is that of least squares in height.
        """
        if self._tree is None:
            self._tree = cKDTree(self._points)
        pairs = cKDTree(self._chosen).sparse_distance_matrix(self._tree, radius, output_type="ndarray")
        at, count = pairs["i"], len(self._chosen)
        apart = (self._points[pairs["j"]] - self._chosen[at]).T
        number = np.bincount(at, minlength=count)
        sums = [np.bincount(at, axis, count) for axis in apart]
        scatter = np.empty((count, 3, 3))
        for i in range(3):
            for j in range(i + 1):
                scatter[:, i, j] = scatter[:, j, i] = np.bincount(at, apart[i] * apart[j], count) - sums[i] * sums[j] / number
        values, vectors = np.linalg.eigh(scatter)
        up = np.abs(vectors[:, 2, 0])
        with np.errstate(divide="ignore"):
            tilt = np.sqrt(np.maximum(1.0 - up * up, 0.0)) / up
        # Nearly collinear points are one profile.
        vague = (number < _MIN_NORMAL_POINTS) | (values[:, 1] < _PROFILE * values[:, 2]) | (up <= 1e-9)
        return np.where(vague, np.inf, tilt)


def _off(points: Float, plane: Float) -> Float:
    """Return the distance in height of points (n, 3) from a plane, m."""
    return np.abs(points[:, 2] - plane[0] - plane[1] * points[:, 0] - plane[2] * points[:, 1])


def _fitted(points: Float, plane: Float, distance: float) -> tuple[Float, int]:
    """Fit a plane to the inliers of another by least squares, and count these."""
    inliers = points[_off(points, plane) < distance]
    if len(inliers) < _MIN_INLIERS:
        return plane, len(inliers)
    design = np.column_stack([np.ones(len(inliers)), inliers[:, :2]])
    # Not by BLAS, whose sums depend on the number of threads.
    normal, right = np.einsum("ki,kj->ij", design, design), np.einsum("ki,k->i", design, inliers[:, 2])
    return np.asarray(np.linalg.solve(normal + 1e-9 * np.eye(3), right), dtype=np.float64), len(inliers)
