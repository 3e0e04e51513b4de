"""What was seen of the lining of a kilometre, and what of that is wet, along the tunnel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tunneldb.anomalies.threshold import MEDIAN_PIXELS
from tunneldb.arrays import Bool, Int64, Single, UInt8
from tunneldb.raster.grid import Grid

STEP = 0.1
"""Least length of a step along the tunnel, m."""


@dataclass(frozen=True)
class Coverage:
    """Areas in the unrolled plane by steps of chainage, the first of which begins with the kilometre.

    Attributes
    ----------
    step : float
        Length of a step, m.
    lining, seen, wet : (n,) float32 arrays
        Lining, seen or not; what was seen of it; what of that is wet; m².
    """

    step: float
    lining: Single
    seen: Single
    wet: Single


def measure_coverage(state: UInt8, dark: Bool, grid: Grid, size: int) -> Coverage:
    """Add up the lining of a kilometre, what was seen of it and what is wet.

    A pixel of lining was seen when it holds points, or when enough pixels about it do for the median filter to tell
    whether it is wet.

    Parameters
    ----------
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.pixel_state.PixelState`.
    dark : (rows, columns) bool array
        Wet pixels, as the median filter left them.
    grid : Grid
        The pixels.
    size : int
        Side of the median filter, pixels.
    """
    wide = _wide(grid)
    inner = grid.inner
    enough = 0.2 * min(size * size, MEDIAN_PIXELS)
    counts = _cover(state, dark, inner.start, inner.stop, size // 2, enough).reshape(3, -1, wide).sum(axis=2)
    areas = (counts * grid.pixel**2).astype(np.float32)
    return Coverage(wide * grid.pixel, areas[0], areas[1], areas[2])


def _wide(grid: Grid) -> int:
    """Columns of a step: as few as make STEP and divide a block."""
    wide = max(1, int(np.ceil(STEP / grid.pixel - 1e-6)))
    while grid.block_columns % wide:
        wide += 1
    return wide


@njit(cache=True, nogil=True)
def _cover(state: UInt8, dark: Bool, first: int, stop: int, half: int, enough: float) -> Int64:  # pragma: no cover - compiled
    """Pixels of each column from ``first`` to ``stop`` that are lining, were seen, are wet."""
    rows, columns = state.shape
    out = np.zeros((3, stop - first), np.int64)
    # Lining that holds points in each column, in the rows of the filter, with zeros beyond both ends.
    held = np.zeros(columns + 2 * half + 1, np.int32)
    for i in range(-half, rows):
        if i + half < rows:
            for j in range(columns):
                held[j + half] += 1 <= state[i + half, j] <= 2
        if i - half - 1 >= 0:
            for j in range(columns):
                held[j + half] -= 1 <= state[i - half - 1, j] <= 2
        if i < 0:
            continue
        votes = 0
        for j in range(first, first + 2 * half):
            votes += held[j]
        for j in range(first, stop):
            votes += held[j + 2 * half]
            if state[i, j] <= 2:
                seen = state[i, j] > 0 or votes > enough
                out[0, j - first] += 1
                out[1, j - first] += seen
                out[2, j - first] += seen and dark[i, j]
            votes -= held[j]
    return out
