"""Relief of the lining itself, by which it departs from the planes laid through it: rock, sprayed concrete, masonry."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Single
from tunneldb.robust import MAD_TO_SIGMA

STEP = 0.25
"""Side of the tiles in which departures are summed up, m."""

AROUND = 2.0
"""Departures of so much about a tile tell its relief, m: appendages cover less than half of that."""

LIMIT = 3.0
"""Lining departs from its planes by no more than so many standard deviations."""

MOST = 0.25
"""What stands off by more is an appendage whatever the lining is, m: blasted rock departs by so much."""

SAMPLES = 5
"""Of the rows and columns of a tile about so many are looked at."""


def reach(pixel: float) -> int:
    """How far, in pixels, what tells the relief lies from a pixel at most."""
    tile, half = _sides(pixel)
    return (2 * half + 1) * tile


def relief_limit(distance: Single, pixel: float, corner: tuple[int, int], least: float = 0.0) -> Single:
    """By how much the lining departs from its planes about each pixel: LIMIT standard deviations, m, at most MOST.

    The median departure over the tiles about each one, times that of a normal distribution: less than half of the tiles may
    show something else.

    Parameters
    ----------
    distance : (rows, columns) float32 array
        Distance from the planes, m; NaN where there is no point.
    pixel : float
        Side of a pixel, m.
    corner : (int, int)
        Row and column of its first pixel in an image of which this is a part; tiles lie alike in all parts.
    least : float
        What is less than this, m, need not be known: if all is, zeros are returned.

    Returns
    -------
    (rows, columns) float32 array
    """
    tile, half = _sides(pixel)
    (rows, columns), (row, column) = distance.shape, corner
    top, left = row % tile, column % tile
    tall, wide = -(-(top + rows) // tile), -(-(left + columns) // tile)
    every = max(1, tile // SAMPLES)
    padded = np.full((tall * tile, wide * tile), np.nan, np.float32)
    padded[top : top + rows, left : left + columns] = np.abs(distance)
    samples = padded.reshape(tall, tile, wide, tile)[:, ::every, :, ::every].transpose(0, 2, 1, 3).reshape(tall, wide, -1)
    ordered = np.sort(samples, axis=2)  # NaNs come last
    count = np.count_nonzero(~np.isnan(ordered), axis=2)
    median = np.take_along_axis(ordered, np.maximum(count - 1, 0)[:, :, None] // 2, axis=2)[:, :, 0]
    about = _median_about(np.where(count > 0, median, np.nan), half, least / (LIMIT * MAD_TO_SIGMA))
    limit = np.minimum(LIMIT * MAD_TO_SIGMA * about, MOST).astype(np.float32)
    whole = np.repeat(np.repeat(limit, tile, axis=0), tile, axis=1)
    return np.asarray(whole[top : top + rows, left : left + columns])


def _median_about(values: Single, half: int, least: float) -> Single:
    """Median of the tiles about each one; of unknown ones the nearest that is known counts, if it is about them.

    Zeros if no median is greater than the least: smooth lining is most of all that there is, and medians take long.
    """
    known = np.isfinite(values)
    if not known.any():
        return np.zeros_like(values)
    far, place = ndimage.distance_transform_cdt(~known, "chessboard", return_indices=True)
    filled = np.where(far <= half, values[tuple(place)], np.float32(0.0))
    side = 2 * half + 1
    if not (ndimage.uniform_filter((filled > least).astype(np.float64), side, mode="nearest") > 0.5).any():
        return np.zeros_like(values)
    return np.asarray(ndimage.median_filter(filled, side, mode="nearest"))


def _sides(pixel: float) -> tuple[int, int]:
    """Side of a tile, pixels, and tiles to either side of one."""
    return max(1, round(STEP / pixel)), max(1, round(AROUND / STEP))
