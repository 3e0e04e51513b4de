"""Compiled loops over images: means over pixels, weighted means about pixels, and interpolation of large pixels."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Int16, Single, UInt8
from tunneldb.compiled import inner, kernel
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.state import PixelState

LINING, RECESS, FLOOR, SUBMERGED, OFF = (
    int(one) for one in (PixelState.LINING, PixelState.RECESS, PixelState.FLOOR, PixelState.SUBMERGED, PixelState.OFF)
)

MIN_WEIGHT = 1e-3
"""Minimum weight of a mean about a pixel, relative to that of lining all around."""


@kernel
def count_states(state: UInt8, level: Int16, n: int) -> tuple[Single, Single, UInt8]:  # pragma: no cover - compiled
    """Combine pixels n by n.

    Parameters
    ----------
    state, level : (rows, columns) arrays
        See :func:`tunneldb.segmentation.channels.channels`; whole multiples of n.
    n : int
        Number of pixels side by side.

    Returns
    -------
    filled : (rows / n, columns / n) float32 array
        Share of the pixels that are lining with points.
    mean : (rows / n, columns / n) float32 array
        Mean level of these; 0 if there are none.
    mostly : (3, rows / n, columns / n) uint8 array
        1 where more than half of the pixels are fixtures, recess, floor; else 0.
    """
    rows, columns = state.shape[0] // n, state.shape[1] // n
    filled, mean = np.zeros((rows, columns), np.float32), np.zeros((rows, columns), np.float32)
    mostly = np.zeros((3, rows, columns), np.uint8)
    for row in range(rows):
        for column in range(columns):
            count = total = off = recess = floor = 0
            for i in range(row * n, row * n + n):
                for j in range(column * n, column * n + n):
                    here = state[i, j]
                    off += here == OFF
                    recess += here == RECESS
                    floor += here in (FLOOR, SUBMERGED)
                    if here in (LINING, RECESS) and level[i, j] != NODATA:
                        count += 1
                        total += level[i, j]
            filled[row, column] = np.float32(count) / np.float32(n * n)
            if count > 0:
                mean[row, column] = np.float32(total) / np.float32(count)
            mostly[0, row, column] = 2 * off > n * n
            mostly[1, row, column] = 2 * recess > n * n
            mostly[2, row, column] = 2 * floor > n * n
    return filled, mean, mostly


def mean_about(values: Single, weight: Single, sigma: float, reach: float) -> Single:
    """Return the mean about each pixel with weights that fall off as a normal distribution.

    Parameters
    ----------
    values, weight : (rows, columns) float32 arrays
        There is nothing beyond their edges.
    sigma : float
        Standard deviation of the normal distribution, pixels.
    reach : float
        Distance from which nothing counts, standard deviations.

    Returns
    -------
    (rows, columns) float32 array
        NaN where hardly any weight is near.
    """
    far = np.arange(int(reach * sigma + 0.5) + 1)
    bell = np.exp(-0.5 * (far / sigma) ** 2)
    bell /= 2.0 * bell.sum() - bell[0]
    return _mean_about(values, weight, bell.astype(np.float32))


@kernel
def _mean_about(values: Single, weight: Single, bell: Single) -> Single:  # pragma: no cover - compiled
    rows, columns = values.shape
    far = len(bell) - 1
    # Of each row: sums across rows, with an empty margin; then sums along the row. Loops over slices are vectorised.
    sums, weights = np.zeros(columns + 2 * far, np.float32), np.zeros(columns + 2 * far, np.float32)
    out = np.empty((rows, columns), np.float32)
    total = np.empty(columns, np.float32)
    for row in range(rows):
        sums[:] = 0.0
        weights[:] = 0.0
        for i in range(max(row - far, 0), min(row + far, rows - 1) + 1):
            _add_weighted(sums[far : far + columns], weights[far : far + columns], values[i], weight[i], bell[abs(i - row)])
        _sum_along(out[row], sums, bell)
        _sum_along(total, weights, bell)
        mean = out[row]
        for j in range(columns):
            mean[j] = mean[j] / total[j] if total[j] > MIN_WEIGHT else np.nan
    return out


@inner
def _add_weighted(
    sums: Single, weights: Single, values: Single, weight: Single, share: np.float32
) -> None:  # pragma: no cover - compiled
    for j in range(len(values)):
        part = share * weight[j]
        weights[j] += part
        sums[j] += part * values[j]


@inner
def _sum_along(out: Single, image: Single, bell: Single) -> None:  # pragma: no cover - compiled
    """Sum an image with an empty margin along a row."""
    far, columns = len(bell) - 1, len(out)
    middle = image[far : far + columns]
    for j in range(columns):
        out[j] = bell[0] * middle[j]
    for d in range(1, far + 1):
        left, right, share = image[far - d : far - d + columns], image[far + d : far + d + columns], bell[d]
        for j in range(columns):
            out[j] += share * (left[j] + right[j])


@kernel
def enlarged(image: Single, times: int) -> Single:  # pragma: no cover - compiled
    """Interpolate an image of large pixels linearly between their middles, on pixels so many times smaller."""
    rows, columns = image.shape
    out = np.empty((rows * times, columns * times), np.float32)
    line = np.empty(columns, np.float32)
    for row in range(rows * times):
        at = min(max((row + 0.5) / times - 0.5, 0.0), rows - 1.0)
        low = min(int(at), max(rows - 2, 0))
        high, part = min(low + 1, rows - 1), np.float32(at - low)
        for j in range(columns):
            line[j] = image[low, j] * (np.float32(1.0) - part) + image[high, j] * part
        for k in range(times):
            middle = (k + 0.5) / times - 0.5
            step = -1 if middle < 0 else 1
            part = np.float32(abs(middle))
            for j in range(columns):
                other = min(max(j + step, 0), columns - 1)
                out[row, j * times + k] = line[j] * (np.float32(1.0) - part) + line[other] * part
    return out
