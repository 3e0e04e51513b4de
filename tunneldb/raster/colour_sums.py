"""Colours of the lining by pixel, accumulated from points in any order in limited memory.

A pixel has the weighted mean colour of its points that have one, by the weights of the intensity
(:func:`tunneldb.raster.projection.pixel_weight`). Black means no colour, as exporters write it.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Int32, Single, UInt16, Whole
from tunneldb.compiled import inner, kernel, point_kernel
from tunneldb.pointcloud.points import MAX_COLOUR
from tunneldb.raster.block_sums import MAX_STEPS, BlockSums
from tunneldb.raster.grid import Grid
from tunneldb.raster.profiles import ProfileGaps
from tunneldb.raster.projection import Pixels

MEMORY = 200_000_000
"""Bytes of memory for sums."""

CHANNELS = 4
"""Number of sums of a pixel: weight and, weighted, red, green and blue."""

SHIFT = 2
"""Number of lowest bits of a 16-bit colour that are left out, so that full colour is MAX_STEPS."""

FULL = 255.0
"""Full red, green or blue of an image."""


class ColourSums(BlockSums):
    """Sums of the colours of a kilometre by pixel.

    Parameters
    ----------
    grid : Grid
        The pixels.
    memory : int
        Bytes of memory for sums, at least those of one block.
    """

    def __init__(self, grid: Grid, memory: int = MEMORY) -> None:
        super().__init__(grid, CHANNELS, memory)

    def add(self, pixels: Pixels, colour: UInt16, maximum: int) -> None:
        """Add points.

        Colours are summed as whole numbers. So sums are exact, and independent of the order of the points, as long as no pixel
        is full.

        Parameters
        ----------
        pixels : Pixels
            Pixels of the points; those with column -1 are skipped.
        colour : (n, 3) uint16 array
            Red, green and blue of the points; black points are skipped.
        maximum : int
            Value of full colour; greater ones count as full.

        Raises
        ------
        UserError
            If the temporary folder has no space for the blocks that do not fit in memory.
        """
        pixels = pixels.part(0, len(colour))
        colour = np.ascontiguousarray(colour)

        def add(sums: Whole, first: int, part: int, parts: int) -> None:
            _add(sums, first, pixels.row, pixels.column, pixels.weight, colour, maximum, self._full, part, parts)

        self._add_points(pixels, add)

    def rgb(self, block: int, gaps: ProfileGaps | None) -> Single:
        """Return the mean colours (rows, columns of a block, 3) of a block with points, 0 to 255; NaN without a colour.

        Parameters
        ----------
        block : int
            Block, counted from 0.
        gaps : ProfileGaps or None
            Gaps between profiles that are to be closed.
        """
        width = self.grid.block_columns
        start, stop = block * width, (block + 1) * width
        if gaps is None:
            return self._means(start, stop)
        around = int(gaps.longest[start:stop].max())
        first, last = max(start - around, 0), min(stop + around, self.grid.columns)
        means = self._means(first, last)
        held: Bool = np.isfinite(means[:, :, 0])
        column = gaps.nearest(held, first)[:, start - first : stop - first]
        closed = np.take_along_axis(means, np.maximum(column, 0)[:, :, None], axis=1)
        closed[column < 0] = np.nan
        return closed

    def _means(self, start: int, stop: int) -> Single:
        """Return the mean colours of the columns from ``start`` up to ``stop``."""
        width = self.grid.block_columns
        means: Single = np.full((self.grid.rows, stop - start, 3), np.nan, np.float32)
        selected = set(self.blocks())
        for block in range(start // width, (stop - 1) // width + 1):
            if block in selected:
                first, last = max(block * width, start), min((block + 1) * width, stop)
                _means(self._fetch(block), first - block * width, means, first - start, last - start)
        return means


@kernel
def _add(
    sums: Whole,
    first: int,
    row: Int32,
    column: Int32,
    weight: Int32,
    colour: UInt16,
    maximum: int,
    full: int,
    part: int,
    parts: int,
) -> None:  # pragma: no cover - compiled
    """Add the points of a block, into every ``parts``-th of its rows."""
    width = sums.shape[1]
    for i in range(row.shape[0]):
        r, c = row[i], column[i] - first
        if 0 <= c < width and r % parts == part and sums[r, c, 0] <= full:
            red, green, blue = colour[i, 0], colour[i, 1], colour[i, 2]
            if red > 0 or green > 0 or blue > 0:
                sums[r, c, 0] += weight[i]
                sums[r, c, 1] += weight[i] * _steps(red, maximum)
                sums[r, c, 2] += weight[i] * _steps(green, maximum)
                sums[r, c, 3] += weight[i] * _steps(blue, maximum)


@inner
def _steps(value: int, maximum: int) -> int:  # pragma: no cover - compiled
    """Return red, green or blue as steps for summing, MAX_STEPS for the maximum."""
    return (min(int(value), maximum) * (MAX_COLOUR // maximum)) >> SHIFT


@point_kernel
def _means(sums: Whole, skip: int, means: Single, first: int, stop: int) -> None:  # pragma: no cover - compiled
    """Divide the sums of a block, from column ``skip`` on, into columns ``first`` to ``stop``."""
    for i in range(means.shape[0]):
        for j in range(first, stop):
            k = j - first + skip
            if sums[i, k, 0] > 0:
                per = FULL / (MAX_STEPS * float(sums[i, k, 0]))
                means[i, j, 0] = sums[i, k, 1] * per
                means[i, j, 1] = sums[i, k, 2] * per
                means[i, j, 2] = sums[i, k, 3] * per
