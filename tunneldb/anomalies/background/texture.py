"""Size of the windows over which lining is averaged before detection, for walls of bricks, stones or rock facets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.histogram import BIN, TILE_BINS, window_statistics
from tunneldb.anomalies.background.smooth import extrapolate
from tunneldb.arrays import Bool, Float, Int16, Int32, Int64, Single, UInt8
from tunneldb.compiled import kernel
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.state import PixelState

TYPICAL_DARKENING = 2.0
"""Darkening that should be three standard deviations of dry lining, dB: wet lining is rarely less dark (Xu et al., 2018)."""

CELL = 0.1
"""Side of the cells that windows are made of, m."""

WINDOWS = (3, 5)
"""Sides of the windows, cells: a brick is 0.25 m long, most stones of a wall and rock facets are not much larger."""

SCATTER_HALF_WIDTH = 4.0
"""Half the side of the windows for the variation of lining, m."""

MIN_CELLS = 100
"""Minimum number of cells for the variation."""

RECESS = int(PixelState.RECESS)


@dataclass(frozen=True)
class Texture:
    """Averaging windows by tile (tiles down, tiles along).

    Attributes
    ----------
    half : uint8 array
        Half the side of the windows over which the lining is averaged, pixels; 0: single pixels.
    sigma : float32 array
        Standard deviation of dry lining after averaging, dB.
    pixel_sigma : float32 array
        Standard deviation of single pixels, dB.
    """

    half: UInt8
    sigma: Single
    pixel_sigma: Single


def measure_texture(state: UInt8, drop: Int16, sigma: Single, tile: int, pixel: float) -> Texture:
    """Choose for each tile the smallest window in which TYPICAL_DARKENING stands out from the variation of lining.

    Noise of pixels decreases with their number. The differences between bricks, stones or facets decrease only if a window
    contains several. Where single pixels vary little, nothing is averaged.

    Parameters
    ----------
    state, drop : (rows, columns) arrays
        State of the pixels, and their darkening relative to the background, steps of the image.
    sigma : (tiles down, tiles along) float32 array
        Standard deviation of pixels of dry lining, dB.
    tile : int
        Side of a tile, pixels.
    pixel : float
        Side of a pixel, m.
    """
    limit = TYPICAL_DARKENING / 3.0
    half = np.zeros(sigma.shape, np.uint8)
    open_ = ndimage.median_filter(sigma, 5, mode="nearest") > limit
    if not open_.any():
        return Texture(half, sigma, sigma)
    side = max(1, round(CELL / pixel))
    total, count = _cells(state, drop, side)
    out = sigma.copy()
    for cells in WINDOWS:
        means, known = _means(total, count, cells)
        found = _spread(means, known, side, tile, sigma.shape, round(SCATTER_HALF_WIDTH / (tile * pixel)))
        better = open_ & np.isfinite(found) & (found < out)
        half[better], out[better] = (cells * side) // 2, found[better]
        open_ &= ndimage.median_filter(out, 5, mode="nearest") > limit
    return Texture(half, out, sigma)


def windowed(state: UInt8, drop: Int16, half: UInt8, tile: int, rows: slice, about: slice) -> Int16:
    """Return the darkening of some rows, averaged over the windows of their tiles.

    Parameters
    ----------
    state, drop : (rows, columns) arrays
    half : (tiles down, tiles along) uint8 array
    tile : int
    rows, about : slice
        The rows, and those that the largest window covers.

    Returns
    -------
    (n, columns) int16 array
        Steps of the image; NODATA where a window has no lining.
    """
    # Sums may overflow: their differences over windows are right nevertheless.
    total, count = np.zeros((2, about.stop - about.start + 1, state.shape[1] + 1), np.int32)
    _integrate(state[about], drop[about], total, count)
    out = drop[rows].copy()
    _average(total, count, half, tile, rows.start, about.start, out)
    return out


@kernel
def _integrate(state: UInt8, drop: Int16, total: Int32, count: Int32) -> None:  # pragma: no cover - compiled
    """Compute sum of the darkening and number of lining pixels above and before each pixel corner (rows + 1, columns + 1)."""
    for i in range(state.shape[0]):
        added, selected = np.int32(0), np.int32(0)
        for j in range(state.shape[1]):
            if 0 < state[i, j] <= RECESS and drop[i, j] != NODATA:
                added += np.int32(drop[i, j])
                selected += np.int32(1)
            total[i + 1, j + 1] = total[i, j + 1] + added
            count[i + 1, j + 1] = count[i, j + 1] + selected


@kernel
def _average(
    total: Int32, count: Int32, half: UInt8, tile: int, first: int, top: int, out: Int16
) -> None:  # pragma: no cover - compiled
    """Replace darkenings (rows, columns), the first in row ``first`` of the image, by their means over windows."""
    rows, columns = total.shape[0] - 1, total.shape[1] - 1
    for i in range(out.shape[0]):
        of_row = half[(first + i) // tile]
        for begin in range(0, columns, tile):
            h = int(of_row[min(begin // tile, len(of_row) - 1)])
            if h == 0:
                continue
            m, n = max(first + i - top - h, 0), min(first + i - top + h + 1, rows)
            for j in range(begin, min(begin + tile, columns)):
                k, q = max(j - h, 0), min(j + h + 1, columns)
                selected = np.int32(count[n, q] - count[m, q] - count[n, k] + count[m, k])
                if selected:
                    out[i, j] = round(np.int32(total[n, q] - total[m, q] - total[n, k] + total[m, k]) / selected)
                else:
                    out[i, j] = NODATA


@kernel
def _cell_sums(state: UInt8, drop: Int16, side: int, total: Int64, count: Int64) -> None:  # pragma: no cover - compiled
    for i in range(state.shape[0]):
        for j in range(state.shape[1]):
            if 0 < state[i, j] <= RECESS and drop[i, j] != NODATA:
                total[i // side, j // side] += drop[i, j]
                count[i // side, j // side] += 1


def _cells(state: UInt8, drop: Int16, side: int) -> tuple[Int64, Int64]:
    """Return the sum of the darkening over the lining of each cell, steps, and its number of pixels."""
    total, count = np.zeros((2, -(-state.shape[0] // side), -(-state.shape[1] // side)), np.int64)
    _cell_sums(state, drop, side, total, count)
    return total, count


def _means(total: Int64, count: Int64, cells: int) -> tuple[Float, Bool]:
    """Return the mean darkening over windows of so many cells a side, dB, and True for those at least half full."""
    around = [ndimage.uniform_filter(part.astype(np.float64), cells, mode="constant") for part in (total, count)]
    full = float(np.median(count[count > 0])) if (count > 0).any() else 1.0
    return STEP["corrected"] * around[0] / np.maximum(around[1], 1e-9), around[1] > 0.5 * full


def _spread(means: Float, known: Bool, side: int, tile: int, shape: tuple[int, int], half: int) -> Single:
    """Return the standard deviation of windows around each tile, dB; NaN where too few are known."""
    row, column = np.nonzero(known)
    bins = np.floor(means[row, column] / BIN).astype(np.int64) + TILE_BINS // 2
    inside = (bins >= 0) & (bins < TILE_BINS)
    down, along = ((at[inside] * side + side // 2) // tile for at in (row, column))
    along = np.minimum(along, shape[1] - 1)
    place = (np.minimum(down, shape[0] - 1) * shape[1] + along) * TILE_BINS + bins[inside]
    histograms = np.bincount(place, minlength=shape[0] * shape[1] * TILE_BINS).astype(np.uint16).reshape(*shape, TILE_BINS)
    _, sigma, count = window_statistics(histograms, np.ones(shape, np.bool_), half)
    return extrapolate(np.where((count >= MIN_CELLS) & (sigma > 0.0), sigma, np.nan).astype(np.float32))
