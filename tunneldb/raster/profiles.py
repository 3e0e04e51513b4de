"""Profiles that lie farther apart along the tunnel than pixels: how far, told from the image, and what lies between them.

A mobile profiler measures closely around the section and, the faster it goes, the more sparsely along the tunnel. Each profile
then stands for the lining half-way to the next one: a pixel without a point takes what the nearest profile shows at its arc.
As every place along the tunnel is as likely to be hit as any other, areas that are made so are right in the mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int16, Int64, Intp
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.geotiff import NODATA

LEAST = 0.08
"""Profiles that are closer leave no gap, m: a joint, the narrowest that its shape tells, is as wide (`anomalies.joints`)."""

GREATEST = 1.25
"""What is farther apart than that are no profiles of one pass, but scans with gaps between them, m."""

ANISOTROPY = 3
"""In a profile points lie closer than profiles do, by so many times at least. Far from a static scanner, where the beam meets
the lining slantingly, they may be apart in both directions."""

CLOSE = 3
"""In a profile half of the points have another one within so many rows of pixels."""

ALONE = 0.15
"""Of the pixels of profiles no larger share has another one two or three columns away; of points strewn at random as far apart
as that, more have."""

JOINED = 1.5
"""A gap is closed where it is no longer than so many spacings: one that lacks a profile is not."""

EVERY = 8
"""Of the rows and columns of an image one in so many is enough to tell the spacing from."""

ROWS = 64
"""Rows that are worked on at a time."""


@dataclass(frozen=True)
class ProfileGaps:
    """Gaps between profiles that are closed along the rows of an image.

    Attributes
    ----------
    spacing : float
        Distance of the profiles along the tunnel, the median over the image, m.
    longest : (columns,) int array
        Columns from one profile to the next, at most, for what lies between them to be closed.
    half : (columns,) int array
        Columns that a profile stands for to either side of it where the next one is farther away than that.
    """

    spacing: float
    longest: Int64
    half: Int64

    @classmethod
    def of(cls, spacing: Float, pixel: float) -> ProfileGaps:
        """Make them of the distance of the profiles, m, at each column (columns,)."""
        return cls(float(np.median(spacing)), _columns(JOINED * spacing, pixel), _columns(0.5 * spacing, pixel))

    def nearest(self, held: Bool, first: int = 0) -> Intp:
        """Column that each pixel takes its value from.

        Parameters
        ----------
        held : (rows, columns) bool array
            Pixels that hold points.
        first : int
            Column of the image with which it begins.

        Returns
        -------
        (rows, columns) int array
            The pixel's own column where it holds points, that of the nearest in its row that does where it lies between
            profiles, -1 elsewhere; counted from ``first``.
        """
        columns = held.shape[1]
        longest, half = (limit[first : first + columns] for limit in (self.longest, self.half))
        place, far = np.arange(columns), 2 * columns + 2 * int(self.longest.max())
        before = np.maximum.accumulate(np.where(held, place, -far), axis=1)
        after = np.minimum.accumulate(np.where(held, place, far)[:, ::-1], axis=1)[:, ::-1]
        nearest = np.where(place - before <= after - place, before, after)
        closed = (after - before <= longest) | (np.abs(nearest - place) <= half)
        return np.where(closed, nearest, -1)

    def close(self, window: Window) -> Window:
        """Give the pixels between profiles offset and intensity; their weight stays 0, which says that no point lies there."""
        column = self.nearest(window.weight > 0, window.columns.start)
        empty, column = column < 0, np.maximum(column, 0)
        values = []
        for measured in (window.offset, window.raw, window.corrected):
            value = np.take_along_axis(measured, column, axis=1)
            value[empty] = np.nan
            values.append(value)
        return Window(window.columns, window.weight, *values)

    def close_levels(self, level: Int16) -> None:
        """Give the pixels (rows, columns) of the image between profiles, which are NODATA, a value, in place."""
        for top in range(0, len(level), ROWS):
            part = level[top : top + ROWS]
            column = self.nearest(part != NODATA)
            part[:] = np.where(column < 0, np.int16(NODATA), np.take_along_axis(part, np.maximum(column, 0), axis=1))


def farthest(pixel: float) -> int:
    """Columns that a gap is long, at most, which is closed."""
    return int(_columns(np.array([JOINED * GREATEST]), pixel)[0])


def find_gaps(image: Accumulator, wanted: float) -> ProfileGaps | None:
    """Find the gaps between the profiles of a kilometre, block by block: scanners go now faster, now more slowly.

    Parameters
    ----------
    image : Accumulator
        The sums of all points.
    wanted : float
        Distance of the profiles, m, if it is given; 0 if it is to be found.

    Returns
    -------
    ProfileGaps or None
        None where most blocks show points as close as pixels, or in no profiles.
    """
    grid, width = image.grid, image.grid.block_columns
    if wanted:
        return ProfileGaps.of(np.full(grid.columns, wanted), grid.pixel) if wanted > grid.pixel else None
    blocks = np.array(image.inner_blocks())
    spacing = np.array([profile_spacing(image.held(block), grid.pixel) for block in blocks.tolist()])
    told = spacing > 0.0
    if 2 * np.count_nonzero(told) <= len(blocks):
        return None
    # A block that tells nothing, and what lies beyond the ends, is taken for what the nearest one that does is.
    nearest = np.abs(np.arange(grid.blocks)[:, None] - blocks[told]).argmin(axis=1)
    return ProfileGaps.of(np.repeat(spacing[told][nearest], width), grid.pixel)


def profile_spacing(held: Bool, pixel: float) -> float:
    """Distance of profiles along the tunnel, m, told from the pixels that hold points; 0 where they lie in no profiles.

    It is the median over the length of the tunnel of the distance between pixels with points that follow each other in a row.

    Parameters
    ----------
    held : (rows, columns) bool array
        Pixels that hold points.
    pixel : float
        Side of a pixel, m.
    """
    across = _rows_between(held)
    if not across:
        return 0.0
    # Of so many rows together each profile has a point.
    here = np.arange(0, len(held) - CLOSE, EVERY)
    some = np.logical_or.reduce([held[here + rows] for rows in range(across)])
    apart = _distances(some, round(GREATEST / pixel) + 2)
    if not apart.any():
        return 0.0
    spacing = _median(apart * np.arange(len(apart)))
    profiles = spacing >= ANISOTROPY * across and _beside(some) <= ALONE
    return spacing * pixel if profiles and LEAST - 1e-9 <= spacing * pixel <= GREATEST + 1e-9 else 0.0


def _rows_between(held: Bool) -> int:
    """Rows from half of the pixels with points, at most, to the next one in the same column or beside it; 0 if above CLOSE."""
    near = held.copy()
    near[:, 1:] |= held[:, :-1]
    near[:, :-1] |= held[:, 1:]
    here = np.arange(0, len(held) - CLOSE, EVERY)
    followed = np.zeros((len(here), held.shape[1]), np.bool_)
    for rows in range(1, CLOSE + 1):
        followed |= near[here + rows]
        if 2 * np.count_nonzero(held[here] & followed) >= np.count_nonzero(held[here]) > 0:
            return rows
    return 0


def _beside(held: Bool) -> float:
    """Share of the pixels with points that have another one in their row, two or three columns away."""
    other = np.zeros_like(held)
    for columns in (2, 3):
        other[:, columns:] |= held[:, :-columns]
        other[:, :-columns] |= held[:, columns:]
    return float(np.count_nonzero(held & other) / np.count_nonzero(held))


def _columns(length: Float, pixel: float) -> Int64:
    """Lengths, m, in whole columns, one at least."""
    return np.maximum(1, np.rint(length / pixel)).astype(np.int64)


def _distances(mask: Bool, count: int) -> Int64:
    """How often pixels of a mask that follow each other in a row are 1, 2 … apart; the last of so many counts all farther."""
    row, column = np.nonzero(mask)
    apart = np.diff(column)[row[1:] == row[:-1]]
    return np.bincount(np.minimum(apart, count - 1), minlength=count)


def _median(weights: Int64) -> int:
    """Median of 0, 1, 2 … that count so often."""
    until = np.cumsum(weights)
    return int(np.searchsorted(until, 0.5 * until[-1]))
