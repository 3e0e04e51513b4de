"""Inspected and wet lining of a kilometre, along the tunnel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.anomalies.threshold import seen_lining
from tunneldb.anomalies.windows import count_in_columns
from tunneldb.arrays import Bool, Single, UInt8
from tunneldb.raster.grid import BLOCKS, Grid
from tunneldb.raster.state import PixelState

STEP = 0.1
"""Minimum length of a step along the tunnel, m."""


@dataclass(frozen=True)
class Coverage:
    """Areas in the unrolled plane by steps of chainage; the first step begins with the kilometre.

    Attributes
    ----------
    step : float
        Length of a step, m.
    lining, seen, wet : (n,) float32 arrays
        Lining in total; its inspected part; the wet part of that; m².
    """

    step: float
    lining: Single
    seen: Single
    wet: Single


def measure_coverage(state: UInt8, dark: Bool, grid: Grid, size: int) -> Coverage:
    """Sum the lining of a kilometre, its inspected part and its wet part.

    A pixel of lining was inspected if it has points, or if enough pixels around it do for the median filter to decide whether
    it is wet.

    Parameters
    ----------
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`.
    dark : (rows, columns) bool array
        Wet pixels after the median filter.
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
    """Return the columns of a step: the smallest number that reaches STEP and divides a block."""
    columns = max(1, int(np.ceil(STEP / grid.pixel - 1e-6)))
    while grid.block_columns % columns:
        columns += 1
    return columns
