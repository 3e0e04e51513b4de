"""Profiles that lie farther apart along the tunnel than pixels: how far, told from the image, and what lies between them.

A mobile profiler measures closely around the section and, the faster it goes, the more sparsely along the tunnel. Each profile
then stands for the lining half-way to the next one: a pixel without a point takes what the nearest profile shows at its arc.
As every place along the tunnel is as likely to be hit as any other, areas that are made so are right in the mean.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Int16, Int64, Intp
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.geotiff import NODATA

LEAST = 0.08
"""Profiles that are closer leave no gap, m: a joint, the narrowest that its shape tells, is as wide (`anomalies.joints`)."""

GREATEST = 1.25
"""What is farther apart than that are no profiles of one pass, but scans with gaps between them, m."""

ANISOTROPY = 3.0
"""In a profile points lie closer than profiles do, by so many times at least; where the beam meets the lining slantingly, far
from a static scanner, they may be as far apart in both directions."""

JOINED = 1.5
"""A gap is closed where it is no longer than so many spacings: one that lacks a profile is not."""

BLOCKS = 4
"""Blocks of the image that the spacing is told from."""

ROWS = 64
"""Rows that are worked on at a time."""


@dataclass(frozen=True)
class ProfileGaps:
    """Gaps between profiles that are closed along the rows of an image.

    Attributes
    ----------
    spacing : float
        Distance of the profiles along the tunnel, m.
    pixel : float
        Side of a pixel, m.
    """

    spacing: float
    pixel: float

    @property
    def longest(self) -> int:
        """Columns from one profile to the next at most for what lies between them to be closed."""
        return max(1, round(JOINED * self.spacing / self.pixel))

    @property
    def half(self) -> int:
        """Columns that a profile stands for to either side of it, where the next one is farther away than that."""
        return max(1, round(0.5 * self.spacing / self.pixel))

    def nearest(self, held: Bool) -> Intp:
        """Column that each pixel takes its value from.

        Parameters
        ----------
        held : (rows, columns) bool array
            Pixels that hold points.

        Returns
        -------
        (rows, columns) int array
            The pixel's own column where it holds points, that of the nearest in its row that does where it lies between
            profiles, -1 elsewhere.
        """
        columns = held.shape[1]
        place, far = np.arange(columns), 2 * (columns + self.longest)
        before = np.maximum.accumulate(np.where(held, place, -far), axis=1)
        after = np.minimum.accumulate(np.where(held, place, far)[:, ::-1], axis=1)[:, ::-1]
        nearest = np.where(place - before <= after - place, before, after)
        closed = (after - before <= self.longest) | (np.abs(nearest - place) <= self.half)
        return np.where(closed, nearest, -1)

    def close(self, window: Window) -> Window:
        """Give the pixels between profiles offset and intensity; their weight stays 0, which says that no point lies there."""
        column = self.nearest(window.weight > 0)
        empty, column = column < 0, np.maximum(column, 0)
        values = []
        for measured in (window.offset, window.raw, window.corrected):
            value = np.take_along_axis(measured, column, axis=1)
            value[empty] = np.nan
            values.append(value)
        return Window(window.columns, window.weight, *values)

    def close_levels(self, level: Int16) -> None:
        """Give the pixels (rows, columns) between profiles, which are NODATA, a value, in place."""
        for top in range(0, len(level), ROWS):
            part = level[top : top + ROWS]
            column = self.nearest(part != NODATA)
            part[:] = np.where(column < 0, np.int16(NODATA), np.take_along_axis(part, np.maximum(column, 0), axis=1))


def find_gaps(image: Accumulator, wanted: float) -> ProfileGaps | None:
    """Find the gaps between the profiles of a kilometre; None where points lie as close as pixels, or in no profiles.

    Parameters
    ----------
    image : Accumulator
        The sums of all points.
    wanted : float
        Distance of the profiles, m, if it is given; 0 if it is to be found.
    """
    pixel = image.grid.pixel
    spacing = wanted or profile_spacing(_held(image), pixel)
    return ProfileGaps(spacing, pixel) if spacing > pixel else None


def profile_spacing(masks: Iterable[Bool], pixel: float) -> float:
    """Distance of profiles along the tunnel, m, told from the pixels that hold points; 0 where they lie in no profiles.

    It is the median over the length of the tunnel of the distance between pixels with points that follow each other in a row.

    Parameters
    ----------
    masks : iterable of (rows, columns) bool arrays
        Parts of the image.
    pixel : float
        Side of a pixel, m.
    """
    along, across = np.zeros((2, round(GREATEST / pixel) + 2), np.int64)
    for mask in masks:
        along += _distances(mask, len(along))
        across += _distances(mask.T, len(across))
    if not along.any() or not across.any():
        return 0.0
    spacing = _median(along * np.arange(len(along))) * pixel
    alike = ANISOTROPY * _median(across) * pixel
    return spacing if max(LEAST, alike) - 1e-9 <= spacing <= GREATEST + 1e-9 else 0.0


def _held(image: Accumulator) -> Iterable[Bool]:
    """Which pixels hold points, of some blocks of the kilometre, spread evenly."""
    blocks, width = image.inner_blocks(), image.grid.block_columns
    for number in np.unique(np.linspace(0, len(blocks) - 1, BLOCKS).round().astype(int)).tolist():
        start = blocks[number] * width
        yield image.held(start, start + width)


def _distances(mask: Bool, count: int) -> Int64:
    """How often pixels of a mask that follow each other in a row are 1, 2 … apart; the last of so many counts all farther."""
    row, column = np.nonzero(mask)
    apart = np.diff(column)[row[1:] == row[:-1]]
    return np.bincount(np.minimum(apart, count - 1), minlength=count)


def _median(weights: Int64) -> int:
    """Median of 0, 1, 2 … that count so often."""
    until = np.cumsum(weights)
    return int(np.searchsorted(until, 0.5 * until[-1]))
