"""Smooth random fields on rasters."""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from .arrays import FloatArray

# Standard deviation of a field of cubic B-splines with white coefficients of unit variance.
SPLINE_STD = 0.479


def _weights(count: int, cell: float, scale: float, shift: float) -> sparse.csr_matrix:
    """Matrix that spreads coefficients `scale` apart onto `count` cells by cubic B-splines."""
    x = (np.arange(count) + 0.5) * cell / scale + shift
    base = np.floor(x).astype(int)
    f = x - base
    values = np.stack([(1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3], axis=1) / 6
    columns = base[:, None] + np.arange(4)
    rows = np.repeat(np.arange(count), 4)
    return sparse.csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(count, int(base.max()) + 4))


def smooth(
    rng: np.random.Generator, shape: tuple[int, int], cell: float, scale: float, scale_t: float | None = None
) -> FloatArray:
    """Random field of unit variance whose features are about `scale` metres long (`scale_t` across)."""
    along = _weights(shape[0], cell, scale, rng.random())
    across = _weights(shape[1], cell, scale_t or scale, rng.random())
    coefficients = rng.standard_normal((along.shape[1], across.shape[1]))
    return np.asarray((across @ (along @ coefficients).T).T / SPLINE_STD, dtype=np.float32)


def fractal(
    rng: np.random.Generator, shape: tuple[int, int], cell: float, scales: tuple[float, ...], weights: tuple[float, ...]
) -> FloatArray:
    """Sum of smooth fields of several scales, each with its standard deviation."""
    total = np.zeros(shape, dtype=np.float32)
    for scale, weight in zip(scales, weights, strict=True):
        total += np.float32(weight) * smooth(rng, shape, cell, scale)
    return total


def line(rng: np.random.Generator, x: FloatArray, scale: float) -> FloatArray:
    """Random curve of unit variance over positions `x`."""
    low = float(x.min())
    knots = np.arange(math.ceil((float(x.max()) - low) / scale) + 3) * scale + low
    heights = rng.standard_normal(knots.size)
    f = (x - low) / scale
    base = np.floor(f).astype(int)
    blend = f - base
    blend = blend * blend * (3 - 2 * blend)
    return np.asarray((heights[base] * (1 - blend) + heights[base + 1] * blend) / 0.86)


def ramp(x: FloatArray) -> FloatArray:
    """Smooth step from 0 at x = -0.5 to 1 at x = 0.5."""
    y = np.clip(x + 0.5, 0, 1)
    return np.asarray(y * y * (3 - 2 * y))
