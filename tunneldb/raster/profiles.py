"""Profiles farther apart along the tunnel than pixels: their spacing, from the image, and the values between them.

A mobile profiler measures densely around the section and, the faster it moves, the more sparsely along the tunnel. Each profile
then represents the lining half-way to the next one: a pixel without a point takes the value of the nearest profile at its arc.
Every place along the tunnel is hit with equal probability, so areas computed in this way are right on average.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int16, Int64, Intp
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.geotiff import NODATA

MIN_GAP = 0.08
"""Minimum gap between profiles that is closed, m: the width of a joint, the narrowest shape used (`anomalies.joints`)."""

MAX_GAP = 1.25
"""Maximum gap between profiles, m: larger ones separate scans, not profiles of one pass."""

MIN_ANISOTROPY = 3
"""Minimum ratio of the profile spacing to the point spacing in a profile. Far from a static scanner, where the beam is oblique,
points may be apart in both directions."""

MAX_ROW_DISTANCE = 3
"""Distance, in rows of pixels, within which half of the points of a profile have another one."""

MAX_NEIGHBOUR_SHARE = 0.15
"""Maximum share of the pixels of profiles with another one two or three columns away; random points at that distance have
more."""

MAX_CLOSED_SPACINGS = 1.5
"""Maximum length of a closed gap, in spacings: a gap with a missing profile is not closed."""

SAMPLE_INTERVAL = 8
"""Interval of the rows and columns of an image used for the spacing."""

ROWS = 64
"""Number of rows processed at a time."""


@dataclass(frozen=True)
class ProfileGaps:
    """Gaps between profiles that are closed along the rows of an image.

    Attributes
    ----------
    spacing : float
        Distance of the profiles along the tunnel, the median over the image, m.
    longest : (columns,) int array
        Maximum number of columns between two profiles for the gap to be closed.
    half : (columns,) int array
        Columns that a profile represents on either side if the next one is farther away.
    """

    spacing: float
    longest: Int64
    half: Int64

    @classmethod
    def of(cls, spacing: Float, pixel: float) -> ProfileGaps:
        """Make gaps from the distance of the profiles, m, at each column (columns,)."""
        return cls(float(np.median(spacing)), _columns(MAX_CLOSED_SPACINGS * spacing, pixel), _columns(0.5 * spacing, pixel))

    def nearest(self, held: Bool, first: int = 0) -> Intp:
        """Return the column from which each pixel takes its value.

        Parameters
        ----------
        held : (rows, columns) bool array
            Pixels with points.
        first : int
            Column of the image at which it begins.

        Returns
        -------
        (rows, columns) int array
            The pixel's own column if it has points; the nearest column with points in its row if it is between profiles; else
            -1. Counted from ``first``.
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
        """Fill offset and intensity of the pixels between profiles; their weight stays 0, because no point is there."""
        column = self.nearest(window.weight > 0, window.columns.start)
        empty, column = column < 0, np.maximum(column, 0)
        values = []
        for measured in (window.offset, window.raw, window.corrected):
            value = np.take_along_axis(measured, column, axis=1)
            value[empty] = np.nan
            values.append(value)
        return Window(window.columns, window.weight, *values)

    def close_levels(self, level: Int16) -> None:
        """Fill the pixels (rows, columns) of the image between profiles, which are NODATA, in place."""
        for top in range(0, len(level), ROWS):
            part = level[top : top + ROWS]
            column = self.nearest(part != NODATA)
            part[:] = np.where(column < 0, np.int16(NODATA), np.take_along_axis(part, np.maximum(column, 0), axis=1))


def farthest(pixel: float) -> int:
    """Return the maximum number of columns of a closed gap."""
    return int(_columns(np.array([MAX_CLOSED_SPACINGS * MAX_GAP]), pixel)[0])


def find_gaps(image: Accumulator, wanted: float) -> ProfileGaps | None:
    """Find the gaps between the profiles of a kilometre, block by block, because scanner speed varies.

    Parameters
    ----------
    image : Accumulator
        Sums of all points.
    wanted : float
        Distance of the profiles, m, if given; 0 if it is to be determined.

    Returns
    -------
    ProfileGaps or None
        None if most blocks have points as close as pixels, or no profiles.
    """
    grid, width = image.grid, image.grid.block_columns
    if wanted:
        return ProfileGaps.of(np.full(grid.columns, wanted), grid.pixel) if wanted > grid.pixel else None
    blocks = np.array(image.inner_blocks())
    spacing = np.array([profile_spacing(image.has_points(block), grid.pixel) for block in blocks.tolist()])
    determined = spacing > 0.0
    if 2 * np.count_nonzero(determined) <= len(blocks):
        return None
    # A block without a result, and the parts beyond the ends, take that of the nearest block with one.
    nearest = np.abs(np.arange(grid.blocks)[:, None] - blocks[determined]).argmin(axis=1)
    return ProfileGaps.of(np.repeat(spacing[determined][nearest], width), grid.pixel)


def profile_spacing(held: Bool, pixel: float) -> float:
    """Return the distance of profiles along the tunnel, m, from the pixels with points; 0 if there are no profiles.

    It is the median over the length of the tunnel of the distance between consecutive pixels with points in a row.

    Parameters
    ----------
    held : (rows, columns) bool array
        Pixels with points.
    pixel : float
        Side of a pixel, m.
    """
    across = _rows_between(held)
    if not across:
        return 0.0
    # In so many rows together each profile has a point.
    here = np.arange(0, len(held) - MAX_ROW_DISTANCE, SAMPLE_INTERVAL)
    some = np.logical_or.reduce([held[here + rows] for rows in range(across)])
    apart = _distances(some, round(MAX_GAP / pixel) + 2)
    if not apart.any():
        return 0.0
    spacing = _median(apart * np.arange(len(apart)))
    profiles = spacing >= MIN_ANISOTROPY * across and _beside(some) <= MAX_NEIGHBOUR_SHARE
    return spacing * pixel if profiles and MIN_GAP - 1e-9 <= spacing * pixel <= MAX_GAP + 1e-9 else 0.0


def _rows_between(held: Bool) -> int:
    """Return the median distance, in rows, to the next pixel in the same or next column; 0 if above MAX_ROW_DISTANCE."""
    near = held.copy()
    near[:, 1:] |= held[:, :-1]
    near[:, :-1] |= held[:, 1:]
    here = np.arange(0, len(held) - MAX_ROW_DISTANCE, SAMPLE_INTERVAL)
    followed = np.zeros((len(here), held.shape[1]), np.bool_)
    for rows in range(1, MAX_ROW_DISTANCE + 1):
        followed |= near[here + rows]
        if 2 * np.count_nonzero(held[here] & followed) >= np.count_nonzero(held[here]) > 0:
            return rows
    return 0


def _beside(held: Bool) -> float:
    """Return the share of pixels with points that have another one in their row, two or three columns away."""
    other = np.zeros_like(held)
    for columns in (2, 3):
        other[:, columns:] |= held[:, :-columns]
        other[:, :-columns] |= held[:, columns:]
    return float(np.count_nonzero(held & other) / np.count_nonzero(held))


def _columns(length: Float, pixel: float) -> Int64:
    """Convert lengths, m, to whole columns, at least one."""
    return np.maximum(1, np.rint(length / pixel)).astype(np.int64)


def _distances(mask: Bool, count: int) -> Int64:
    """Count distances 1, 2 … between consecutive pixels of a mask in a row; the last count includes all larger ones."""
    row, column = np.nonzero(mask)
    apart = np.diff(column)[row[1:] == row[:-1]]
    return np.bincount(np.minimum(apart, count - 1), minlength=count)


def _median(weights: Int64) -> int:
    """Return the median of 0, 1, 2 … with these counts."""
    until = np.cumsum(weights)
    return int(np.searchsorted(until, 0.5 * until[-1]))
