"""Counts of pixels in windows and in columns, block by block of the rows of an image."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

import numpy as np

from tunneldb.arrays import Bool, Int64, UInt8, UInt16
from tunneldb.raster.state import PixelState

Counts = TypeVar("Counts", UInt8, UInt16)

ROWS = 64
"""Number of rows processed at a time: their data stay in a processor's cache."""


def row_blocks(count: int, half: int) -> Iterator[tuple[slice, slice]]:
    """Yield blocks of so many rows, and the rows of each with up to ``half`` more to either side."""
    size = max(ROWS, 2 * half)
    for top in range(0, count, size):
        stop = min(top + size, count)
        yield slice(top, stop), slice(max(top - half, 0), min(stop + half, count))


def on_lining(state: UInt8) -> Bool:
    """Return True for pixels with points on lining, recessed or not."""
    lining: Bool = (state == PixelState.LINING) | (state == PixelState.RECESS)
    return lining


def count_about(mask: Bool, rows: slice, about: slice, half: int) -> UInt16:
    """Count the pixels of a mask in the square around each pixel.

    Parameters
    ----------
    mask : (m, columns) bool array
        Rows ``about`` of an image, beyond which nothing counts.
    rows, about : slice
        Rows to count around, and those of the mask, from `row_blocks`.
    half : int
        Half-width of the square, pixels, at most 127.

    Returns
    -------
    (n, columns) uint16 array
    """
    size, above = 2 * half + 1, half - (rows.start - about.start)
    selected = np.zeros((rows.stop - rows.start + 2 * half, mask.shape[1]), np.uint8)
    selected[above : above + len(mask)] = mask
    columns: UInt16 = np.zeros((rows.stop - rows.start, mask.shape[1] + 2 * half), np.uint16)
    columns[:, half : half + mask.shape[1]] = _sum_along(selected, size)
    # The image is transposed, so that one function serves both axes.
    counts: UInt16 = _sum_along(columns.T, size).T
    return counts


def count_in_columns(mask: Bool) -> Int64:
    """Count the pixels of each column of a mask (rows, columns)."""
    counts = np.zeros(mask.shape[1], np.int64)
    for top in range(0, len(mask), 255):  # as many as a byte can count
        counts += np.add.reduce(mask[top : top + 255].view(np.uint8), axis=0, dtype=np.uint8)
    return counts


def _sum_along(values: Counts, size: int) -> Counts:
    """Sum each value and the next ``size`` - 1 (even) along the first axis, from sums of 1, 2, 4 … of them."""
    count = len(values) - size + 1
    total, at, power = values[:count].copy(order="K"), 1, 1
    while 2 * power <= size:
        values = values[:-power] + values[power:]
        power *= 2
        if size & power:
            total += values[at : at + count]
            at += power
    return total
