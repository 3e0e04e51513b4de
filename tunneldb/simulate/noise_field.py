"""Pseudo-random fields over a plane, reproducible at each position."""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import inner, kernel

_PART = 1.0 / 65535.0
_MASK = np.uint64(0xFFFF)
# Standard deviation of uniform nodes in [-1, 1], interpolated by w = 3t² - 2t³: the mean of w² + (1 - w)² along each
# axis is 26/35, a uniform number's variance 1/3.
_SPREAD = 26.0 / 35.0 / math.sqrt(3.0)


@inner
def mix(i: int, j: int, salt: int) -> np.uint64:
    """Hash a cell's indices (splitmix64)."""
    h = np.uint64(i) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(j) * np.uint64(0xC2B2AE3D27D4EB4F) + np.uint64(salt)
    h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return h ^ (h >> np.uint64(31))


@inner
def value_noise(x: float, y: float, salt: int) -> float:
    """Return a smooth field of mean 0 and standard deviation 1 over a plane with unit cells (value noise)."""
    i, j = math.floor(x), math.floor(y)
    tx, ty = x - i, y - j
    tx, ty = tx * tx * (3.0 - 2.0 * tx), ty * ty * (3.0 - 2.0 * ty)
    total = 0.0
    for a in range(2):
        for b in range(2):
            value = 2.0 * _PART * float((mix(i + a, j + b, salt) >> np.uint64(32)) & _MASK) - 1.0
            total += value * (tx if a else 1.0 - tx) * (ty if b else 1.0 - ty)
    return total / _SPREAD


@kernel
def _value_noise(x: Float, y: Float, salt: int, out: Float) -> None:
    for i in range(x.shape[0]):
        out[i] = value_noise(x[i], y[i], salt)


def smooth_field(x: Float, y: Float, salt: int) -> Float:
    """Return the field of :func:`value_noise` at positions (n,), in sides of a cell."""
    out = np.empty(x.size)
    _value_noise(x, y, salt, out)
    return out


@kernel
def _normal(i: Int64, j: Int64, salt: int, out: Float) -> None:
    for k in range(i.shape[0]):
        h = mix(i[k], j[k], salt)
        one = (float(h & _MASK) + 0.5) / 65536.0
        angle = 2.0 * math.pi * _PART * float((h >> np.uint64(16)) & _MASK)
        out[k] = math.sqrt(-2.0 * math.log(one)) * math.cos(angle)


def normal_field(i: Int64, j: Int64, salt: int) -> Float:
    """Return numbers of cells (n,), of the standard normal distribution (Box and Muller, 1958)."""
    out = np.empty(i.size)
    _normal(i, j, salt, out)
    return out
