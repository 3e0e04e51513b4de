"""Dark pixels: three-sigma threshold and median filter (Xu et al., 2018, eq. 19–20 and fig. 9c)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.texture import windowed
from tunneldb.anomalies.windows import count_about, on_lining, row_blocks
from tunneldb.arrays import Bool, Int16, UInt8
from tunneldb.raster.geotiff import STEP
from tunneldb.raster.image import MAX_MEDIAN
from tunneldb.raster.polygons import mask_of_polygons
from tunneldb.raster.state import PixelState

MEDIAN = 5
"""Side of the median filter if every pixel has points, pixels."""

MEDIAN_PIXELS = 12
"""Mean number of pixels with points to which the filter is widened."""

MIN_VOTE_SHARE = 0.2
"""Minimum share of those pixels for the filter to decide about its middle."""


def filter_size(filled: float) -> int:
    """Return the side of the median filter, pixels (odd), for an image with the share ``filled`` of pixels with points.

    If profiles are farther apart than pixels are wide, a filter of five pixels would have only a handful of values.
    """
    size = MEDIAN
    while size * size * filled < MEDIAN_PIXELS and size < MAX_MEDIAN:
        size += 2
    return size


def dark_pixels(contrast: ContrastImage, size: int) -> Bool:
    """Mark dark pixels.

    A lining pixel more than three local standard deviations below the local level of the background is dark (eq. 20). Then the
    median of dark and other pixels around each one decides: single ones disappear, and pixels without a point take the state of
    their surroundings. Fixtures and floor are never dark, nor are drawn dry regions.

    Parameters
    ----------
    contrast : ContrastImage
        Picture relative to its background.
    size : int
        Side of the median filter, pixels.

    Returns
    -------
    (rows, columns) bool array
    """
    state, tile = contrast.state, contrast.tile
    limit = np.minimum(np.floor(3.0 * contrast.sigma / STEP["corrected"]), 32767).astype(np.int16)
    limit = np.repeat(limit, tile, axis=1)[:, : state.shape[1]]
    out = np.empty(state.shape, np.bool_)
    for rows, about in row_blocks(len(state), size // 2):
        lining = on_lining(state[about])
        dark = lining & (averaged(contrast, about) > limit[np.arange(about.start, about.stop) // tile])
        votes, dark_votes = (count_about(mask, rows, about, size // 2) for mask in (lining, dark))
        out[rows] = (2 * dark_votes > votes) & (votes > _least_votes(size)) & (state[rows] <= PixelState.RECESS)
    for columns, mask in mask_of_polygons(contrast.grid, contrast.drawn):
        out[:, columns][mask] = False
    return out


def averaged(contrast: ContrastImage, rows: slice) -> Int16:
    """Return the darkening of some rows, over the windows of their tiles; see :mod:`tunneldb.anomalies.background.texture`."""
    half = None if contrast.texture is None else contrast.texture.half
    if half is None or not (reach := int(half[rows.start // contrast.tile : (rows.stop - 1) // contrast.tile + 1].max())):
        return contrast.drop[rows]
    about = slice(max(rows.start - reach, 0), min(rows.stop + reach, len(contrast.drop)))
    return windowed(contrast.state, contrast.drop, half, contrast.tile, rows, about)


def seen_lining(state: UInt8, size: int) -> Iterator[tuple[slice, Bool]]:
    """Yield the inspected lining: with points, or enough of them around it for the median filter to decide if it is dark.

    Parameters
    ----------
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`.
    size : int
        Side of the median filter, pixels.

    Yields
    ------
    rows : slice
        Some of the rows, in order.
    seen : (rows, columns) bool array
    """
    for rows, about in row_blocks(len(state), size // 2):
        lining = on_lining(state[about])
        votes = count_about(lining, rows, about, size // 2)
        empty = state[rows] == PixelState.EMPTY
        yield rows, lining[rows.start - about.start :][: len(empty)] | (empty & (votes > _least_votes(size)))


def _least_votes(size: int) -> int:
    """Return the number of pixels of a filter up to which it cannot decide about its middle."""
    return int(MIN_VOTE_SHARE * min(size * size, MEDIAN_PIXELS))
