"""Relief of the lining itself, its deviation from fitted planes: rock, sprayed concrete, masonry."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Single
from tunneldb.robust import MAD_TO_SIGMA

STEP = 0.25
"""Side of the tiles over which deviations are summed, m."""

WINDOW = 2.0
"""Distance around a tile that contributes to its relief, m: fixtures cover less than half of it."""

LIMIT_SIGMAS = 3.0
"""Standard deviations within which lining deviates from its planes."""

MAX_RELIEF = 0.25
"""Maximum deviation of lining, m: blasted rock deviates by as much; beyond it a pixel is a fixture."""

SAMPLES = 5
"""Approximate number of rows and columns of a tile that are sampled."""


def reach(pixel: float) -> int:
    """Return the maximum distance, in pixels, of data that the relief at a pixel depends on."""
    tile, half = _sides(pixel)
    return (2 * half + 1) * tile


def relief_limit(distance: Single, pixel: float, corner: tuple[int, int], least: float = 0.0) -> Single:
    """Return the limit of the lining's deviation from its planes around each pixel, LIMIT_SIGMAS deviations, m.

    It is the median deviation over the tiles around each one, scaled as for a normal distribution: less than half of the tiles
    may show something else.

    Parameters
    ----------
    distance : (rows, columns) float32 array
        Distance from the planes, m; NaN without a point.
    pixel : float
        Side of a pixel, m.
    corner : (int, int)
        Row and column of its first pixel in a larger image; tiles are at the same places in all parts.
    least : float
        Limit below which values do not matter, m: if all are below, zeros are returned.

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
    about = _median_about(np.where(count > 0, median, np.nan), half, least / (LIMIT_SIGMAS * MAD_TO_SIGMA))
    limit = np.minimum(LIMIT_SIGMAS * MAD_TO_SIGMA * about, MAX_RELIEF).astype(np.float32)
    whole = np.repeat(np.repeat(limit, tile, axis=0), tile, axis=1)
    return np.asarray(whole[top : top + rows, left : left + columns])


def _median_about(values: Single, half: int, least: float) -> Single:
    """Return the median of the tiles around each one; unknown tiles use the nearest known one, if it is close enough.

    Zeros if no median is greater than ``least``: most lining is smooth, and medians are slow.
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
    """Return the side of a tile, pixels, and the number of tiles to either side."""
    return max(1, round(STEP / pixel)), max(1, round(WINDOW / STEP))
