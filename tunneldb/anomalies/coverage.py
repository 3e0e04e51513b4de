"""What was seen of the lining of a kilometre, and what of that is wet, along the tunnel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.anomalies.threshold import seen_lining
from tunneldb.anomalies.windows import count_in_columns
from tunneldb.arrays import Bool, Single, UInt8
from tunneldb.raster.grid import BLOCKS, Grid
from tunneldb.raster.pixel_state import PixelState

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
    inner = grid.inner
    counts = np.zeros((3, inner.stop - inner.start), np.int64)
    for rows, seen in seen_lining(state, size):
        for k, mask in enumerate((state[rows] <= PixelState.RECESS, seen, seen & dark[rows])):
            counts[k] += count_in_columns(mask[:, inner])
    columns = _columns_of_step(grid)
    steps = grid.block_columns // columns
    areas = np.zeros((3, BLOCKS * steps), np.float32)
    areas[:, steps * grid.covered[0] : steps * grid.covered[1]] = counts.reshape(3, -1, columns).sum(axis=2) * grid.pixel**2
    return Coverage(columns * grid.pixel, areas[0], areas[1], areas[2])


def _columns_of_step(grid: Grid) -> int:
    """Columns of a step: as few as make STEP and divide a block."""
    columns = max(1, int(np.ceil(STEP / grid.pixel - 1e-6)))
    while grid.block_columns % columns:
        columns += 1
    return columns
