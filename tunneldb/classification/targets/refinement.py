"""Moving candidates to where a sphere of the radius fits best, all at once and quickly; most lead nowhere."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Float, Int64
from tunneldb.classification.targets.fit import BANDS, SECTORS
from tunneldb.classification.targets.hough import NEAR, Scattered, around

# In radii of the spheres:
WIDE = 0.25  # points so near the sphere draw at first,
NARROW = 0.1  # and at last
PASSES = 12


class RefinedSpheres(NamedTuple):
    """Where candidates have come to, k of them.

    Attributes
    ----------
    centres : (k, 3) float64 array
        NaN where it led away by a radius or there was nothing to fit to, m.
    on : (k,) int array
        Points within `NARROW` radii of the sphere.
    share : (k,) float64 array
        Of the points in and near the sphere, in the directions in which it is seen, those on it.
    seen : (k,) float64 array
        Share of its surface that is seen, as `tunneldb.classification.targets.fit.coverage` has it, about the mean direction of
        the points on it.
    radius, radius_sigma : (k,) float64 arrays
        Of the best sphere of any radius there, and its standard deviation, m; infinite where there is none.
    """

    centres: Float
    on: Int64
    share: Float
    seen: Float
    radius: Float
    radius_sigma: Float


def refine_spheres(points: Scattered, centres: Float, radius: float) -> RefinedSpheres:
    """Fit spheres of a radius (m) to candidates (k, 3) by Gauss-Newton steps with Tukey's weights, whose reach shrinks."""
    settled = RefinedSpheres(*_settle(points.xyz, points.key, points.span, points.edge, centres - points.low, radius))
    return settled._replace(centres=settled.centres + points.low)


@njit(cache=True, nogil=True, parallel=True)
def _settle(
    xyz: Float, key: Int64, span: Int64, edge: float, centres: Float, radius: float
) -> tuple[Float, Int64, Float, Float, Float, Float]:  # pragma: no cover - compiled
    count = len(centres)
    moved = np.full((count, 3), np.nan)
    on, share, seen = np.zeros(count, np.int64), np.zeros(count), np.zeros(count)
    free, sigma = np.full(count, np.inf), np.full(count, np.inf)
    for k in prange(count):
        near = around(xyz, key, span, edge, centres[k], (NEAR + WIDE) * radius)
        centre = centres[k].copy()
        matrix, vector, unit = np.empty((3, 3)), np.empty(3), np.empty(3)
        lost = False
        for step in range(PASSES):
            reach = radius * max(NARROW, WIDE * 0.85**step)
            matrix[:] = 0.0
            vector[:] = 0.0
            for i in near:
                far = 0.0
                for a in range(3):
                    unit[a] = xyz[i, a] - centre[a]
                    far += unit[a] * unit[a]
                far = math.sqrt(far)
                off_by = far - radius
                if abs(off_by) >= reach or far == 0.0:
                    continue
                weight = (1.0 - (off_by / reach) ** 2) ** 2
                for a in range(3):
                    unit[a] /= far
                for a in range(3):
                    vector[a] += weight * unit[a] * off_by
                    for b in range(3):
                        matrix[a, b] += weight * unit[a] * unit[b]
            trace = matrix[0, 0] + matrix[1, 1] + matrix[2, 2]
            if trace < 4.0:
                lost = True
                break
            for a in range(3):  # across a nearly flat patch nothing holds the centre: let it stay there
                matrix[a, a] += 1e-3 * trace
            centre += np.linalg.solve(matrix, vector)
            if np.sum((centre - centres[k]) ** 2) > radius * radius:
                lost = True
                break
        if lost:
            continue
        moved[k] = centre
        on[k], share[k], seen[k] = _look(xyz, near, centre, radius)
        free[k], sigma[k] = _loosen(xyz, near, centre, radius)
    return moved, on, share, seen, free, sigma


@njit(cache=True, nogil=True)
def _loosen(xyz: Float, near: Int64, centre: Float, radius: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Radius of the best sphere of any radius near one, and its standard deviation; infinite where there is none."""
    state = np.array([centre[0], centre[1], centre[2], radius])
    matrix, vector, unit = np.empty((4, 4)), np.empty(4), np.empty(4)
    reach = WIDE * radius
    count, squares = 0, 0.0
    for _ in range(PASSES):
        matrix[:] = 0.0
        vector[:] = 0.0
        count, squares = 0, 0.0
        for i in near:
            far = 0.0
            for a in range(3):
                unit[a] = xyz[i, a] - state[a]
                far += unit[a] * unit[a]
            far = math.sqrt(far)
            off_by = far - state[3]
            if abs(off_by) >= reach or far == 0.0:
                continue
            weight = (1.0 - (off_by / reach) ** 2) ** 2
            for a in range(3):
                unit[a] /= far
            unit[3] = 1.0
            count += 1
            squares += weight * off_by * off_by
            for a in range(4):
                vector[a] += weight * unit[a] * off_by
                for b in range(4):
                    matrix[a, b] += weight * unit[a] * unit[b]
        if count < 6 or abs(np.linalg.det(matrix / matrix[3, 3])) < 1e-12:
            return math.inf, math.inf
        state += np.linalg.solve(matrix, vector)
        if not 0.2 * radius < state[3] < 5.0 * radius:
            return math.inf, math.inf
        reach = max(0.9 * reach, NARROW * radius)
    return state[3], math.sqrt(np.linalg.inv(matrix)[3, 3] * squares / matrix[3, 3])


@njit(cache=True, nogil=True)
def _look(xyz: Float, near: Int64, centre: Float, radius: float) -> tuple[int, float, float]:  # pragma: no cover - compiled
    """Points on a sphere, their share of those near it where it is seen, and the share of its surface that is seen."""
    far = np.empty(len(near))
    axis = np.zeros(3)
    count = 0
    for j in range(len(near)):
        far[j] = math.sqrt(np.sum((xyz[near[j]] - centre) ** 2))
        if abs(far[j] - radius) <= NARROW * radius:
            count += 1
            axis += xyz[near[j]] - centre
    length = math.sqrt(np.sum(axis**2))
    if count == 0 or length == 0.0:
        return 0, 0.0, 0.0
    axis /= length
    # Any direction across the axis, and the one across both.
    side = np.array([-axis[1], axis[0], 0.0]) if abs(axis[2]) < 0.9 else np.array([0.0, -axis[2], axis[1]])
    side /= math.sqrt(np.sum(side**2))
    other = np.cross(axis, side)
    held, there = np.zeros(BANDS * SECTORS, np.int64), np.zeros(BANDS * SECTORS, np.int64)
    for j in range(len(near)):
        if far[j] > NEAR * radius or far[j] == 0.0:
            continue
        out = (xyz[near[j]] - centre) / far[j]
        band = min(max(int((1.0 - np.dot(out, axis)) * BANDS / 2.0), 0), BANDS - 1)
        angle = math.atan2(np.dot(out, other), np.dot(out, side)) / (2.0 * math.pi) + 0.5
        cell = band * SECTORS + min(int(angle * SECTORS), SECTORS - 1)
        there[cell] += 1
        if abs(far[j] - radius) <= NARROW * radius:
            held[cell] += 1
    among, cells = 0, 0
    for cell in range(len(held)):
        if held[cell]:
            among += there[cell]
            cells += 1
    return count, count / among, cells / len(held)
