"""Types of arrays, and correlated noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, gaussian_filter1d

Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.integer[Any]]
Mask = NDArray[np.bool_]
Rng = np.random.Generator

_BLUR = 1.2
_GAIN = 1.0 / (2.0 * math.sqrt(math.pi) * _BLUR)  # standard deviation of white noise after that blur, in 2D


def _stretch(coarse: Floats, count: int, step: float) -> Floats:
    """Linear interpolation along the first dimension."""
    at = np.arange(count) / step
    low = at.astype(np.int64)
    share = (at - low).astype(np.float32)[:, None]
    return coarse[low] * (1.0 - share) + coarse[low + 1] * share


def smooth_noise(rng: Rng, shape: tuple[int, int], scale: tuple[float, float]) -> Floats:
    """Gaussian noise of unit variance.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    shape : tuple of int
        Cells in both directions.
    scale : tuple of float
        Correlation lengths in cells; below 3 there is no smoothing in that direction.
    """
    steps = [max(1.0, value / 2.5) for value in scale]
    counts = [math.ceil(n / step) + 3 for n, step in zip(shape, steps, strict=True)]
    coarse = rng.standard_normal(counts).astype(np.float32)
    coarse = gaussian_filter(coarse, _BLUR, mode="reflect") / _GAIN
    return _stretch(_stretch(coarse, shape[0], steps[0]).T, shape[1], steps[1]).T


def smooth_line(rng: Rng, count: int, scale: float) -> Floats:
    """Gaussian noise of about unit variance along a line; scale in samples."""
    sigma = max(scale / 2.0, 0.5)
    pad = int(4 * sigma) + 1
    line = gaussian_filter1d(rng.standard_normal(count + 2 * pad), sigma, mode="reflect")[pad : pad + count]
    return line * math.sqrt(2.0 * math.sqrt(math.pi) * sigma)


def smooth_step(value: Floats) -> Floats:
    """0 below 0, 1 above 1, without a kink between them."""
    x = np.clip(value, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
