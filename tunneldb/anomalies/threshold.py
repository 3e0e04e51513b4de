"""Which pixels are dark: three-sigma threshold and median filter (Xu et al., 2018, eq. 19–20 and fig. 9c)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from tunneldb.arrays import Bool, Int16, Int32, UInt8
from tunneldb.raster.geotiff import STEP
from tunneldb.raster.image import MAX_MEDIAN
from tunneldb.raster.polygons import mask_of_polygons

if TYPE_CHECKING:
    from tunneldb.anomalies.background.contrast import ContrastImage


MEDIAN = 5
"""Side of the median filter where every pixel holds points, pixels."""

MEDIAN_PIXELS = 12
"""The filter is widened until it holds so many pixels with points on average."""


def filter_size(filled: float) -> int:
    """Side of the median filter, pixels (odd), for an image of whose pixels the share ``filled`` hold points.

    Where profiles are farther apart than pixels are wide, a filter of five pixels would hold a handful of
    values.
    """
    size = MEDIAN
    while size * size * filled < MEDIAN_PIXELS and size < MAX_MEDIAN:
        size += 2
    return size


def dark_pixels(relative: ContrastImage, size: int) -> Bool:
    """Mark dark pixels.

    A lining pixel that lies more than three local standard deviations below the local level of dry lining is dark
    (eq. 20). The median of the dark and other ones about each pixel then decides: single ones go, and pixels without a
    point take the state of those about them. Appendages and floor are never dark, nor is what lies in a drawn dry region.

    Parameters
    ----------
    relative : ContrastImage
        The picture relative to dry lining.
    size : int
        Side of the median filter, pixels.

    Returns
    -------
    (rows, columns) bool array
    """
    limit = np.minimum(np.floor(3.0 * relative.sigma / STEP["corrected"]), 32767).astype(np.int16)
    enough = 0.2 * min(size * size, MEDIAN_PIXELS)
    dark: Bool = _dark(relative.state, relative.drop, limit, relative.tile, size // 2, enough)
    for columns, mask in mask_of_polygons(relative.grid, relative.drawn):
        dark[:, columns][mask] = False
    return dark


@njit(cache=True, nogil=True)
def _dark(state: UInt8, drop: Int16, limit: Int16, tile: int, half: int, enough: float) -> Bool:  # pragma: no cover - compiled
    rows, columns = state.shape
    out = np.zeros((rows, columns), np.bool_)
    # Lining and dark pixels of each column in the rows of the filter, with zeros beyond both ends.
    lining, dark = np.zeros(columns + 2 * half + 1, np.int32), np.zeros(columns + 2 * half + 1, np.int32)
    for i in range(-half, rows):
        if i + half < rows:
            _vote(state[i + half], drop[i + half], limit[(i + half) // tile], tile, 1, lining, dark, half)
        if i - half - 1 >= 0:
            _vote(state[i - half - 1], drop[i - half - 1], limit[(i - half - 1) // tile], tile, -1, lining, dark, half)
        if i < 0:
            continue
        votes, dark_votes = 0, 0
        for j in range(2 * half):
            votes += lining[j]
            dark_votes += dark[j]
        for j in range(columns):
            votes += lining[j + 2 * half]
            dark_votes += dark[j + 2 * half]
            out[i, j] = 2 * dark_votes > votes and votes > enough and state[i, j] <= 2
            votes -= lining[j]
            dark_votes -= dark[j]
    return out


@njit(cache=True, nogil=True)
def _vote(
    state: UInt8,
    drop: Int16,
    limit: Int16,
    tile: int,
    sign: int,
    lining: Int32,
    dark: Int32,
    half: int,
) -> None:  # pragma: no cover - compiled
    """Add a row to the sums of columns, or take it away; of the limits of its tiles."""
    step = np.int32(sign)
    for t in range(limit.shape[0]):
        for j in range(t * tile, min((t + 1) * tile, state.shape[0])):
            here = step if 1 <= state[j] <= 2 else np.int32(0)
            lining[j + half] += here
            dark[j + half] += here if drop[j] > limit[t] else np.int32(0)
