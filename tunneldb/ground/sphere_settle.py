"""Moving candidates to where a sphere of the radius fits best, all at once and quickly; most lead nowhere."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tunneldb.ground.sphere_vote import NEAR, Scattered, around

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

# In radii of the spheres:
WIDE = 0.25  # points so near the sphere draw at first,
NARROW = 0.1  # and at last
PASSES = 12


def settle(points: Scattered, centres: Float, radius: float) -> tuple[Float, Int64, Int64]:
    """Fit spheres of a radius by Gauss-Newton steps with Tukey's weights, whose reach shrinks pass by pass.

    Parameters
    ----------
    points : Scattered
    centres : (k, 3) float64 array
        Where to begin, m.
    radius : float
        m.

    Returns
    -------
    centres : (k, 3) float64 array
        NaN where it led away by a radius or there is nothing to fit to.
    on, off : (k,) int arrays
        Points within `NARROW` radii of the sphere; and others near it, in it or behind it.
    """
    moved, on, off = _settle(points.xyz, points.key, points.span, points.edge, centres - points.low, radius)
    return moved + points.low, on, off


@njit(cache=True, nogil=True, parallel=True)
def _settle(
    xyz: Float, key: Int64, span: Int64, edge: float, centres: Float, radius: float
) -> tuple[Float, Int64, Int64]:  # pragma: no cover - compiled
    count = len(centres)
    moved = np.full((count, 3), np.nan)
    on, off = np.zeros(count, np.int64), np.zeros(count, np.int64)
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
        for i in near:
            far = math.sqrt(np.sum((xyz[i] - centre) ** 2))
            if abs(far - radius) <= NARROW * radius:
                on[k] += 1
            elif far <= NEAR * radius:
                off[k] += 1
    return moved, on, off
