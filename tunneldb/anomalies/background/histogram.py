"""Mean and standard deviation of the dry part of a histogram, and histograms of what a picture shows beyond a model.

The model of dry lining is a sum: a base, the level of each column (rings), that of each row by blocks (bands) and that at
the middle of each tile (smooth), between which it is interpolated.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tunneldb.arrays import Bool, Float, Int16, Int32, Single, UInt8, UInt16
from tunneldb.radiometry.robust_statistics import CLIP, CLIPPED_SIGMA
from tunneldb.raster.geotiff import NODATA, STEP

BIN = 0.05
"""Width of a bin, dB: half the standard deviation of pixels that average many points; means come out far finer."""

BINS = 384
"""Bins of the histograms of rows and columns; the middle one begins at 0."""

TILE_BINS = 160
"""Bins of the histograms of tiles."""

SHORTH = 0.25
"""Share of all values in the shortest run of bins that marks where dry lining lies: it may be less than half of them, and is
still denser than what is wet to several degrees."""

LONGER = 1.5
"""Of runs of bins up to so much longer than the shortest the brightest is taken: where half is wet, it is the dry one."""

PER_LEVEL = STEP["corrected"] / BIN
PER_DECIBEL = 1.0 / STEP["corrected"]

CHUNK = 10
"""Tiles along the tunnel whose columns are worked on together: their histograms fit a processor's cache."""


@njit(cache=True, nogil=True)
def settle(histogram: Int32) -> tuple[float, float, int]:  # pragma: no cover - compiled
    """Mean and standard deviation of the dry part of a histogram, as in `radiometry.robust_statistics`.

    Both in bins, the mean from the lower side of the first one, and the number of values; NaN where there are none. Values
    are taken for evenly spread over their bin.
    """
    first, stop = 0, histogram.shape[0]
    while first < stop and histogram[first] == 0:
        first += 1
    while stop > first and histogram[stop - 1] == 0:
        stop -= 1
    if first == stop:
        return np.nan, np.nan, 0
    until = np.zeros((stop - first + 1, 3))  # up to each bin: number, sum, sum of squares
    for k in range(stop - first):
        value = histogram[first + k]
        until[k + 1, 0] = until[k, 0] + value
        until[k + 1, 1] = until[k, 1] + value * (k + 0.5)
        until[k + 1, 2] = until[k, 2] + value * (k * (k + 1.0) + 1.0 / 3.0)
    bins = histogram[first:stop]
    total = until[-1, 0]
    mean = _shorth(until, SHORTH * total)
    number = _until(bins, until, mean)[0]
    sigma = 1.4826 * (_quantile(bins, until, 0.5 * (number + total)) - mean)
    for _ in range(30):
        reach = max(CLIP * sigma, 0.5)
        low, high = _until(bins, until, mean - reach), _until(bins, until, mean + reach)
        number = high[0] - low[0]
        if number <= 0.0:
            break
        centre = (high[1] - low[1]) / number
        wider = np.sqrt(max((high[2] - low[2]) / number - centre * centre, 0.0)) / CLIPPED_SIGMA
        rests = abs(centre - mean) < 0.005 and abs(wider - sigma) < 0.005
        mean, sigma = centre, wider
        if rests:
            break
    # Less Sheppard's correction for the width of the bins.
    return first + mean, np.sqrt(max(sigma * sigma - 1.0 / 12.0, 0.0)), int(total)


@njit(cache=True, nogil=True)
def _shorth(until: Float, wanted: float) -> float:  # pragma: no cover - compiled
    """Mean of the shortest run of bins that holds so many values; of those hardly longer, the brightest."""
    best, mean = float(until.shape[0]), 0.0
    for turn in range(2):
        low = 0
        for k in range(1, until.shape[0]):
            while until[k, 0] - until[low + 1, 0] >= wanted:
                low += 1
            held = until[k, 0] - until[low, 0]
            if held >= wanted:
                # The first turn finds the length, the second one the place.
                if turn == 0:
                    best = min(best, float(k - low))
                elif k - low <= LONGER * best:
                    mean = (until[k, 1] - until[low, 1]) / held
    return mean


@njit(cache=True, nogil=True)
def _until(bins: Int32, until: Float, x: float) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Number, sum and sum of squares of the values up to a place."""
    if x <= 0.0:
        return 0.0, 0.0, 0.0
    k = int(x)
    if k >= bins.shape[0]:
        return until[-1, 0], until[-1, 1], until[-1, 2]
    value = bins[k]
    return (
        until[k, 0] + value * (x - k),
        until[k, 1] + value * (x * x - k * k) / 2.0,
        until[k, 2] + value * (x * x * x - k * k * k) / 3.0,
    )


@njit(cache=True, nogil=True)
def _quantile(bins: Int32, until: Float, number: float) -> float:  # pragma: no cover - compiled
    """Place up to which so many values lie."""
    for k in range(bins.shape[0]):
        if until[k + 1, 0] >= number and bins[k] > 0:
            return k + (number - until[k, 0]) / bins[k]
    return float(bins.shape[0])


@njit(cache=True, nogil=True)
def row_line(
    i: int, base: float, bands: Single, smooth: Single, tile: int, first: int, stop: int, line: Single
) -> None:  # pragma: no cover - compiled
    """Base, bands and smooth of a row at the middles of the tiles from ``first`` to ``stop``."""
    down, along = smooth.shape
    y = (i + 0.5) / tile - 0.5
    above = min(max(int(np.floor(y)), 0), down - 1)
    below = min(above + 1, down - 1)
    v = np.float32(min(max(y - above, 0.0), 1.0))
    blocks = bands.shape[1]
    for t in range(first, stop):
        x = (t + 0.5) * blocks / along - 0.5
        before = min(max(int(np.floor(x)), 0), blocks - 1)
        after = min(before + 1, blocks - 1)
        w = np.float32(min(max(x - before, 0.0), 1.0))
        band = bands[i, before] + w * (bands[i, after] - bands[i, before])
        line[t] = np.float32(base) + band + smooth[above, t] + v * (smooth[below, t] - smooth[above, t])


@njit(cache=True, nogil=True)
def dry_level(j: int, line: Single, rings: Single, per_pixel: np.float32) -> np.float32:  # pragma: no cover - compiled
    """Level of dry lining of a column, from the line of its row; ``per_pixel``: 1 / the side of a tile."""
    x = (np.float32(j) + np.float32(0.5)) * per_pixel - np.float32(0.5)
    k = int(max(x, np.float32(0.0)))
    n = min(k + 1, line.shape[0] - 1)
    w = max(x - np.float32(k), np.float32(0.0))
    return rings[j] + line[k] + w * (line[n] - line[k])


@njit(cache=True, nogil=True)
def fill_levels(
    base: float, rings: Single, bands: Single, smooth: Single, tile: int, top: int, left: int, out: Single
) -> None:  # pragma: no cover - compiled
    """Level of dry lining (rows, columns) from a row and a column on, dB."""
    line = np.zeros(smooth.shape[1], np.float32)
    per_pixel = np.float32(1.0 / tile)
    first, stop = max(left // tile - 1, 0), min((left + out.shape[1] - 1) // tile + 2, smooth.shape[1])
    for i in range(out.shape[0]):
        row_line(top + i, base, bands, smooth, tile, first, stop, line)
        for j in range(out.shape[1]):
            out[i, j] = dry_level(left + j, line, rings, per_pixel)


@njit(cache=True, nogil=True)
def take_levels(
    base: float, rings: Single, bands: Single, smooth: Single, tile: int, level: Int16
) -> None:  # pragma: no cover - compiled
    """Put level of dry lining less level in the place of all levels (rows, columns), steps; NODATA stays."""
    line = np.zeros(smooth.shape[1], np.float32)
    per_pixel, per_step = np.float32(1.0 / tile), np.float32(PER_DECIBEL)
    for i in range(level.shape[0]):
        row_line(i, base, bands, smooth, tile, 0, smooth.shape[1], line)
        for j in range(level.shape[1]):
            if level[i, j] != NODATA:
                drop = np.rint(dry_level(j, line, rings, per_pixel) * per_step) - level[i, j]
                level[i, j] = min(max(drop, NODATA + 1), -NODATA - 1)


@njit(cache=True, nogil=True, inline="always")
def _bin(level: int, expected: np.float32, per_bin: np.float32) -> int:  # pragma: no cover - compiled
    """Bin, counted from the middle, of what a pixel shows beyond what is expected there, dB."""
    return int(np.floor(np.float32(level * PER_LEVEL) - per_bin * expected))


@njit(cache=True, nogil=True)
def row_modes(
    state: UInt8,
    level: Int16,
    used: Bool,
    base: float,
    rings: Single,
    bands: Single,
    smooth: Single,
    tile: int,
    every: int,
    beside: int,
    enough: int,
) -> tuple[Single, Single]:  # pragma: no cover - compiled
    """What dry lining shows beyond the model in each row: about each block, from so many blocks beside it, and everywhere.

    (rows, blocks) and (rows,), dB; NaN where there are not enough values. Every n-th of the tiles used is looked at.
    """
    rows, blocks = bands.shape
    tiles = smooth.shape[1]
    per_block = tiles // blocks
    out, whole = np.empty((rows, blocks), np.float32), np.empty(rows, np.float32)
    histogram, window = np.zeros((blocks, BINS), np.int32), np.zeros(BINS, np.int32)
    line = np.zeros(tiles, np.float32)
    per_pixel, per_bin = np.float32(1.0 / tile), np.float32(1.0 / BIN)
    for i in range(rows):
        histogram[:] = 0
        row_line(i, base, bands, smooth, tile, 0, tiles, line)
        for t in range((every - i % every) % every, tiles, every):
            if not used[i // tile, t]:
                continue
            for j in range(t * tile, (t + 1) * tile):
                if state[i, j] == 1:
                    k = _bin(level[i, j], dry_level(j, line, rings, per_pixel), per_bin) + BINS // 2
                    if 0 <= k < BINS:
                        histogram[t // per_block, k] += 1
        for b in range(blocks):
            window[:] = 0
            for n in range(max(b - beside, 0), min(b + beside + 1, blocks)):
                window += histogram[n]
            mean, _, count = settle(window)
            out[i, b] = (mean - BINS // 2) * BIN if count >= enough else np.nan
        window[:] = 0
        for b in range(blocks):
            window += histogram[b]
        mean, _, count = settle(window)
        whole[i] = (mean - BINS // 2) * BIN if count >= enough else np.nan
    return out, whole


@njit(cache=True, nogil=True)
def column_modes(
    state: UInt8,
    level: Int16,
    used: Bool,
    base: float,
    rings: Single,
    bands: Single,
    smooth: Single,
    tile: int,
    every: int,
    enough: int,
) -> Single:  # pragma: no cover - compiled
    """What dry lining shows beyond the model in each column (columns,), dB; NaN where there are not enough values.

    Every n-th row of the tiles used is looked at.
    """
    rows, columns = state.shape
    tiles = smooth.shape[1]
    out = np.empty(columns, np.float32)
    histogram = np.zeros((CHUNK * tile, BINS), np.int32)
    line = np.zeros(tiles, np.float32)
    per_pixel, per_bin = np.float32(1.0 / tile), np.float32(1.0 / BIN)
    for start in range(0, tiles, CHUNK):
        stop = min(start + CHUNK, tiles)
        histogram[:] = 0
        for i in range(every // 2, rows, every):
            row_line(i, base, bands, smooth, tile, max(start - 1, 0), min(stop + 1, tiles), line)
            for t in range(start, stop):
                if not used[i // tile, t]:
                    continue
                for j in range(t * tile, (t + 1) * tile):
                    if state[i, j] == 1:
                        k = _bin(level[i, j], dry_level(j, line, rings, per_pixel), per_bin) + BINS // 2
                        if 0 <= k < BINS:
                            histogram[j - start * tile, k] += 1
        for j in range(start * tile, stop * tile):
            mean, _, count = settle(histogram[j - start * tile])
            out[j] = (mean - BINS // 2) * BIN if count >= enough else np.nan
    return out


@njit(cache=True, nogil=True)
def tile_histograms(
    state: UInt8,
    level: Int16,
    used: Bool,
    base: float,
    rings: Single,
    bands: Single,
    smooth: Single,
    tile: int,
    every: int,
) -> UInt16:  # pragma: no cover - compiled
    """Histograms (tiles down, tiles along, bins) of what lining shows beyond the model; every n-th row of the tiles used."""
    rows = state.shape[0]
    down, along = smooth.shape
    out = np.zeros((down, along, TILE_BINS), np.uint16)
    line = np.zeros(along, np.float32)
    per_pixel, per_bin = np.float32(1.0 / tile), np.float32(1.0 / BIN)
    for i in range(every // 2, rows, every):
        row_line(i, base, bands, smooth, tile, 0, along, line)
        for t in range(along):
            if not used[i // tile, t]:
                continue
            histogram = out[i // tile, t]
            for j in range(t * tile, (t + 1) * tile):
                if state[i, j] == 1:
                    k = _bin(level[i, j], dry_level(j, line, rings, per_pixel), per_bin) + TILE_BINS // 2
                    if 0 <= k < TILE_BINS:
                        histogram[k] += np.uint16(1)
    return out


@njit(cache=True, nogil=True)
def settle_windows(histograms: UInt16, used: Bool, half: int) -> tuple[Single, Single, Int32]:  # pragma: no cover - compiled
    """Mean and standard deviation of dry lining in windows of 2 ``half`` + 1 tiles to a side about each tile.

    Of the tiles that are used. (Tiles down, tiles along) each, dB, NaN where there is nothing; and the number of values.
    """
    down, along, bins = histograms.shape
    mean, sigma = np.full((down, along), np.float32(np.nan)), np.full((down, along), np.float32(np.nan))
    count = np.zeros((down, along), np.int32)
    columns, window = np.zeros((along, bins), np.int32), np.zeros(bins, np.int32)
    for r in range(-half, down):
        for t in range(along):
            if r + half < down and used[r + half, t]:
                columns[t] += histograms[r + half, t]
            if r - half - 1 >= 0 and used[r - half - 1, t]:
                columns[t] -= histograms[r - half - 1, t]
        if r < 0:
            continue
        window[:] = 0
        for t in range(-half, along):
            if t + half < along:
                window += columns[t + half]
            if t - half - 1 >= 0:
                window -= columns[t - half - 1]
            if t >= 0:
                centre, spread, held = settle(window)
                mean[r, t] = (centre - bins // 2) * BIN
                sigma[r, t] = spread * BIN
                count[r, t] = held
    return mean, sigma, count
