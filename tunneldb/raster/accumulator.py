"""Unrolled image of a kilometre, accumulated from points in any order in limited memory.

A pixel has weighted sums over its points: several stations are blended by the weights of their views
(:func:`tunneldb.raster.projection.pixel_weight`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Int32, Single, Whole
from tunneldb.compiled import kernel, point_inner, point_kernel
from tunneldb.raster.block_sums import MAX_STEPS, BlockSums
from tunneldb.raster.grid import Grid
from tunneldb.raster.projection import Pixels

MEMORY = 400_000_000
"""Bytes of memory for sums."""

CHANNELS = 4
"""Number of sums of a pixel: weight and, weighted, offset, raw and corrected intensity."""

OFFSET, LEVEL = 2.0**-11, 2.0**-7
"""Steps of offset (m) and intensity (dB) for summing whole numbers, half a millimetre and less than a stored
step; a point adds at most MAX_STEPS of them per unit of its weight: 8 m, 128 dB."""


@dataclass(frozen=True)
class Window:
    """Weighted means over a few columns of the image; (rows, columns) arrays, NaN in pixels without a point.

    Attributes
    ----------
    columns : slice
        Columns of the grid.
    weight : int array
        Weights of the points in the pixel, 0 without a point.
    offset : float32 array
        Mean offset from the section surface, m.
    raw, corrected : float32 arrays
        Mean raw and corrected intensity, dB.
    """

    columns: slice
    weight: Whole
    offset: Single
    raw: Single
    corrected: Single

    def cut(self, columns: slice) -> Window:
        """Return the part of the columns within a slice of the grid's columns."""
        here = slice(columns.start - self.columns.start, columns.stop - self.columns.start)
        return Window(columns, self.weight[:, here], self.offset[:, here], self.raw[:, here], self.corrected[:, here])


class Accumulator(BlockSums):
    """Sums of all points of a kilometre by pixel.

    Parameters
    ----------
    grid : Grid
        The pixels.
    memory : int
        Bytes of memory for sums, at least those of one block.
    """

    def __init__(self, grid: Grid, memory: int = MEMORY) -> None:
        super().__init__(grid, CHANNELS, memory)

    def add(self, pixels: Pixels, count: int) -> None:
        """Add points.

        Offset and intensity are rounded to OFFSET and LEVEL and summed as whole numbers. So sums are exact, and independent of
        the order of the points, as long as no pixel is MAX_WEIGHT_SUM.

        Parameters
        ----------
        pixels : Pixels
            Pixels and values of the points; those with column -1 are skipped.
        count : int
            Number of its points to add.

        Raises
        ------
        UserError
            If the temporary folder has no space for the blocks that do not fit in memory.
        """
        pixels = pixels.part(0, count)

        def add(sums: Whole, first: int, part: int, parts: int) -> None:
            _add(sums, first, *pixels, self._full, part, parts)

        self._add_points(pixels, add)

    def window(self, start: int, stop: int) -> Window:
        """Return the means over the columns from ``start`` up to ``stop``, limited to the grid."""
        start, stop = max(start, 0), min(stop, self.grid.columns)
        width = self.grid.block_columns
        selected = set(self.blocks())
        weight = np.zeros((self.grid.rows, stop - start), self._type)
        means = np.empty((CHANNELS - 1, *weight.shape), np.float32)
        for block in range(start // width, (stop - 1) // width + 1):
            first, last = max(block * width, start), min((block + 1) * width, stop)
            if block in selected:
                _means(self._fetch(block), first - block * width, weight, means, first - start, last - start)
            else:
                means[:, :, first - start : last - start] = np.nan
        return Window(slice(start, stop), weight, *means)


@kernel
def _add(
    sums: Whole,
    first: int,
    row: Int32,
    column: Int32,
    weight: Int32,
    offset: Single,
    raw: Single,
    corrected: Single,
    full: int,
    part: int,
    parts: int,
) -> None:  # pragma: no cover - compiled
    """Add the points of a block, into every ``parts``-th of its rows."""
    width = sums.shape[1]
    for i in range(row.shape[0]):
        r, c = row[i], column[i] - first
        if 0 <= c < width and r % parts == part and sums[r, c, 0] <= full:
            sums[r, c, 0] += weight[i]
            sums[r, c, 1] += weight[i] * _multiple(offset[i] * np.float32(1.0 / OFFSET))
            sums[r, c, 2] += weight[i] * _multiple(raw[i] * np.float32(1.0 / LEVEL))
            sums[r, c, 3] += weight[i] * _multiple(corrected[i] * np.float32(1.0 / LEVEL))


@point_inner
def _multiple(value: np.float32) -> np.int32:  # pragma: no cover - compiled
    most = np.float32(MAX_STEPS)
    return np.int32(np.rint(most if value > most else (value if value > -most else -most)))


@point_kernel
def _means(sums: Whole, skip: int, weight: Whole, means: Single, first: int, stop: int) -> None:  # pragma: no cover - compiled
    """Divide the sums of a block, from column ``skip`` on, into columns ``first`` to ``stop`` of a window."""
    for i in range(weight.shape[0]):
        for j in range(first, stop):
            k = j - first + skip
            total = sums[i, k, 0]
            weight[i, j] = total
            per = 1.0 / total if total > 0 else np.nan
            means[0, i, j] = sums[i, k, 1] * (per * OFFSET)
            means[1, i, j] = sums[i, k, 2] * (per * LEVEL)
            means[2, i, j] = sums[i, k, 3] * (per * LEVEL)
