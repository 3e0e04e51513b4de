"""Pseudo-random fields over a plane for the kernels: the same place has the same value, whenever it is asked for."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

_PART = 1.0 / 65535.0
_MASK = np.uint64(0xFFFF)
# Standard deviation of uniform nodes in [-1, 1], interpolated by w = 3t² - 2t³: the mean of w² + (1 - w)² along each
# axis is 26/35, a uniform number's variance 1/3.
_SPREAD = 26.0 / 35.0 / math.sqrt(3.0)


@njit(cache=True, nogil=True, inline="always")
def mix(i: int, j: int, salt: int) -> np.uint64:
    """Scramble a cell's numbers (splitmix64)."""
    h = np.uint64(i) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(j) * np.uint64(0xC2B2AE3D27D4EB4F) + np.uint64(salt)
    h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return h ^ (h >> np.uint64(31))


@njit(cache=True, nogil=True)
def normal(i: int, j: int, salt: int) -> float:
    """Number of a cell, of the standard normal distribution (Box-Muller)."""
    h = mix(i, j, salt)
    one = (float(h & _MASK) + 0.5) / 65536.0
    return math.sqrt(-2.0 * math.log(one)) * math.cos(2.0 * math.pi * _PART * float((h >> np.uint64(16)) & _MASK))


@njit(cache=True, nogil=True)
def clouds(x: float, y: float, salt: int) -> float:
    """Smooth field of mean 0 and standard deviation 1 over a plane whose cells are squares of side 1 (value noise)."""
    fx, fy = math.floor(x), math.floor(y)
    tx, ty = x - fx, y - fy
    tx, ty = tx * tx * (3.0 - 2.0 * tx), ty * ty * (3.0 - 2.0 * ty)
    total = 0.0
    for i in range(2):
        for j in range(2):
            h = mix(int(fx) + i, int(fy) + j, salt)
            value = 2.0 * _PART * float((h >> np.uint64(32)) & _MASK) - 1.0
            total += value * (tx if i else 1.0 - tx) * (ty if j else 1.0 - ty)
    return total / _SPREAD
