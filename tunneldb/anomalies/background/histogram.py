"""Mean and standard deviation of the background, from histograms of the residuals of a picture from a model of its level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tunneldb.anomalies.background.level import BackgroundLevel
from tunneldb.arrays import Bool, Float, Int16, Int32, Int64, Single, UInt8, UInt16
from tunneldb.compiled import kernel
from tunneldb.radiometry.robust_statistics import CLIP, CLIPPED_SIGMA
from tunneldb.raster.geotiff import STEP
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState
from tunneldb.robust import MAD_TO_SIGMA

BIN = 0.05
"""Width of a bin, dB: half the standard deviation of pixels that average many points; means are far more precise."""

BINS = 384
"""Number of bins of the histograms of rows and columns; the middle one begins at 0."""

TILE_BINS = 160
"""Number of bins of the histograms of tiles."""

SHORTH = 0.25
"""Share of all values in the shortest run of bins that locates the background.

It is less than that of `radiometry.robust_statistics`, 0.4, because a column, a row or a tile may be half wet, while all
values of a kilometre are not. Up to 30 % of darker pixels both give the same from some hundred values on; with a hundred
values, 0.4 scatters less. At 50 % the mean is less wrong with 0.25, and even less with LENGTH_TOLERANCE. At 60 % neither works.
"""

LENGTH_TOLERANCE = 1.5
"""Factor on the shortest run; among runs up to that length the brightest is used: if half is wet, it is the dry one."""

PER_LEVEL = STEP["corrected"] / BIN

CHUNK = 10
"""Number of rows, or tiles along the tunnel, processed together: their histograms fit a processor's cache."""

LINING = int(PixelState.LINING)


@dataclass(frozen=True)
class Residuals:
    """Residuals of the lining of a picture from a model of the background.

    Attributes
    ----------
    picture : LiningImage
        State and level of the pixels.
    model : BackgroundLevel
        Model of the background.
    used : (tiles down, tiles along) bool array
        Tiles to use.
    every : int
        Use only every n-th row or tile.
    """

    picture: LiningImage
    model: BackgroundLevel
    used: Bool
    every: int

    def of_rows(self, beside: int, enough: int) -> tuple[Single, Single]:
        """Return the mean of the background in each row: around each block, from blocks up to ``beside`` away, and everywhere.

        (rows, blocks) and (rows,), dB; NaN if there are not enough values.
        """
        rows, blocks = self.model.bands.shape
        tiles = self.model.smooth.shape[1]
        found = np.empty((rows, blocks + 1), np.float32)
        for top in range(0, rows, CHUNK):
            here = np.arange(top, min(top + CHUNK, rows))
            cells = np.arange(len(here)) * blocks, np.arange(tiles) // (tiles // blocks)
            histograms = self._count(here, -here % self.every, tiles, self.every, cells, 0, len(here) * blocks, BINS)
            histograms = histograms.reshape(len(here), blocks, BINS)
            sums = [*_windows(np.moveaxis(histograms, 1, 0), beside), histograms.sum(axis=1, dtype=np.int32)]
            mean, _, count = histogram_statistics(np.concatenate(sums))
            found[here] = np.where(count >= enough, mean, np.nan).reshape(blocks + 1, len(here)).T
        return found[:, :-1], found[:, -1]

    def of_columns(self, enough: int) -> Single:
        """Return the mean of the background in each column (columns,), dB; NaN if there are not enough values."""
        tile, tiles = self.model.tile, self.model.smooth.shape[1]
        rows = self._rows()
        lines = self.model.lines(rows)
        found = np.empty(tiles * tile, np.float32)
        for start in range(0, tiles, CHUNK):
            stop = min(start + CHUNK, tiles)
            cells = np.zeros(len(rows), np.int64), (np.arange(tiles) - start) * tile
            begin = np.full(len(rows), start)
            histograms = self._count(rows, begin, stop, 1, cells, 1, (stop - start) * tile, BINS, lines)
            mean, _, count = histogram_statistics(histograms)
            found[start * tile : stop * tile] = np.where(count >= enough, mean, np.nan)
        return found

    def of_tiles(self) -> UInt16:
        """Return the histograms (tiles down, tiles along, bins)."""
        down, along = self.model.smooth.shape
        rows = self._rows()
        found = np.empty((down, along, TILE_BINS), np.uint16)
        for r in range(down):
            here = rows[rows // self.model.tile == r]
            cells = np.zeros(len(here), np.int64), np.arange(along)
            found[r] = self._count(here, np.zeros(len(here), np.int64), along, 1, cells, 0, along, TILE_BINS)
        return found

    @cached_property
    def _weights(self) -> tuple[Int64, Single]:
        return self.model.weights()

    def _rows(self) -> Int64:
        return np.arange(self.every // 2, len(self.picture.state), self.every)

    def _count(
        self,
        rows: Int64,
        begin: Int64,
        stop: int,
        step: int,
        cells: tuple[Int64, Int64],
        stride: int,
        count: int,
        bins: int,
        lines: Single | None = None,
    ) -> Int32:
        """Return histograms (count, bins) of some rows; see :func:`_add`."""
        histograms = np.zeros((count, bins), np.int32)
        model = self.model.lines(rows) if lines is None else lines, self.model.rings, *self._weights
        pixels = self.picture.state, self.picture.level, self.used
        _add(*pixels, *model, rows, begin, stop, step, *cells, stride, bins, histograms.ravel())
        return histograms


def window_statistics(histograms: UInt16, used: Bool, half: int) -> tuple[Single, Single, Int32]:
    """Compute mean and standard deviation of the background in windows of 2 ``half`` + 1 tiles a side around each tile.

    Parameters
    ----------
    histograms : (tiles down, tiles along, bins) uint16 array
        Histograms of the tiles.
    used : (tiles down, tiles along) bool array
        True for tiles to include.
    half : int
        Tiles.

    Returns
    -------
    mean, sigma : (tiles down, tiles along) float32 arrays
        dB; NaN if there is no value.
    count : (tiles down, tiles along) int32 array
        Number of values.
    """
    down, along, bins = histograms.shape
    mean, sigma = np.empty((2, down, along), np.float32)
    count = np.empty((down, along), np.int32)
    columns = np.zeros((along, bins), np.int32)
    for r in range(-half, down):
        if r + half < down:
            np.add(columns, histograms[r + half], out=columns, where=used[r + half][:, None])
        if r - half - 1 >= 0:
            np.subtract(columns, histograms[r - half - 1], out=columns, where=used[r - half - 1][:, None])
        if r >= 0:
            mean[r], sigma[r], count[r] = histogram_statistics(_windows(columns, half))
    return mean, sigma, count


def _windows(histograms: Int32, half: int) -> Int32:
    """Sum over so many places to either side along the first axis."""
    if half == 0:
        return histograms
    until = np.zeros((len(histograms) + 1, *histograms.shape[1:]), np.int32)
    np.cumsum(histograms, axis=0, out=until[1:])
    place = np.arange(len(histograms))
    return until[np.minimum(place + half + 1, len(histograms))] - until[np.maximum(place - half, 0)]


def histogram_statistics(histograms: Int32) -> tuple[Float, Float, Int64]:
    """Compute mean and standard deviation of the background in histograms, as `radiometry.robust_statistics` does.

    Values are treated as evenly spread over their bin.

    Parameters
    ----------
    histograms : (n, bins) int32 array
        The middle bin begins at 0.

    Returns
    -------
    mean, sigma : (n,) float arrays
        dB; NaN if there is no value.
    count : (n,) int array
        Number of values.
    """
    bins = histograms.shape[1]
    found = np.empty((3, len(histograms)))
    _statistics(np.ascontiguousarray(histograms), np.empty((bins + 1, 3)), found)
    return (found[0] - bins // 2) * BIN, found[1] * BIN, found[2].astype(np.int64)


@kernel
def _statistics(histograms: Int32, until: Float, found: Float) -> None:  # pragma: no cover - compiled
    """Compute mean and standard deviation, in bins, and number of values of each histogram.

    The shortest interval with a share SHORTH of the values locates the background (Rousseeuw and Leroy, 1988: shorth). The
    smaller of the median deviations above and below its mean is its standard deviation. Then values within CLIP of it are
    averaged, until both converge.
    ``until`` (bins + 1, 3) is working memory: number, sum and sum of squares up to each bin.
    """
    for n in range(histograms.shape[0]):
        first, stop = 0, histograms.shape[1]
        while first < stop and histograms[n, first] == 0:
            first += 1
        while stop > first and histograms[n, stop - 1] == 0:
            stop -= 1
        bins = stop - first
        found[0, n], found[1, n], found[2, n] = np.nan, np.nan, 0.0
        if bins == 0:
            continue
        until[0, 0], until[0, 1], until[0, 2] = 0.0, 0.0, 0.0
        for k in range(bins):
            value = histograms[n, first + k]
            until[k + 1, 0] = until[k, 0] + value
            until[k + 1, 1] = until[k, 1] + value * (k + 0.5)
            until[k + 1, 2] = until[k, 2] + value * (k * (k + 1.0) + 1.0 / 3.0)
        total = until[bins, 0]
        # The first pass finds the length of the shortest run of bins, the second the brightest run that is hardly longer.
        wanted, shortest, mean = SHORTH * total, float(bins + 1), 0.0
        for turn in range(2):
            low = 0
            for k in range(1, bins + 1):
                while until[k, 0] - until[low + 1, 0] >= wanted:
                    low += 1
                selected = until[k, 0] - until[low, 0]
                if selected >= wanted:
                    if turn == 0:
                        if k - low < shortest:
                            shortest = float(k - low)
                    elif k - low <= LENGTH_TOLERANCE * shortest:
                        mean = (until[k, 1] - until[low, 1]) / selected
        # Water makes the dark side wider, salts the bright one: the narrower side gives the standard deviation.
        below = until[int(mean), 0] + histograms[n, first + int(mean)] * (mean - int(mean))
        median = [float(bins), 0.0]
        for turn, wanted in enumerate((0.5 * (below + total), 0.5 * below)):
            for k in range(bins):
                if until[k + 1, 0] >= wanted and histograms[n, first + k] > 0:
                    median[turn] = k + (wanted - until[k, 0]) / histograms[n, first + k]
                    break
        sigma = MAD_TO_SIGMA * min(median[0] - mean, mean - median[1])
        for _ in range(30):
            reach = CLIP * sigma
            if reach < 0.5:
                reach = 0.5
            number, total_in, squares = 0.0, 0.0, 0.0
            for sign in (-1.0, 1.0):
                x = mean + sign * reach
                k = int(x)
                if x <= 0.0:
                    continue
                if k >= bins:
                    x, k = float(bins), bins
                value = histograms[n, first + k] if k < bins else 0
                number += sign * (until[k, 0] + value * (x - k))
                total_in += sign * (until[k, 1] + value * (x * x - k * k) / 2.0)
                squares += sign * (until[k, 2] + value * (x * x * x - k * k * k) / 3.0)
            if number <= 0.0:
                break
            centre = total_in / number
            variance = squares / number - centre * centre
            wider = math.sqrt(variance) / CLIPPED_SIGMA if variance > 0.0 else 0.0
            rests = abs(centre - mean) < 0.005 and abs(wider - sigma) < 0.005
            mean, sigma = centre, wider
            if rests:
                break
        # Minus Sheppard's correction for the width of the bins.
        variance = sigma * sigma - 1.0 / 12.0
        found[0, n], found[1, n], found[2, n] = first + mean, math.sqrt(variance) if variance > 0.0 else 0.0, total


@kernel
def _add(
    state: UInt8,
    level: Int16,
    used: Bool,
    lines: Single,
    rings: Single,
    middles: Int64,
    weights: Single,
    rows: Int64,
    begin: Int64,
    stop: int,
    step: int,
    row_cell: Int64,
    tile_cell: Int64,
    stride: int,
    bins: int,
    histograms: Int32,
) -> None:  # pragma: no cover - compiled
    """Add the residuals of lining in some rows (n,) to histograms (cells * bins,).

    Every ``step``-th tile from ``begin`` (n,) to ``stop`` is included, if used. The model is ``rings`` and, interpolated by
    ``middles`` and ``weights``, ``lines`` (n, tiles). Pixels of a tile are counted in the histogram of cell ``row_cell`` (n,)
    + ``tile_cell`` (tiles,), and ``stride`` further for each column of the tile.
    """
    per_bin, half, tiles = np.float32(1.0 / BIN), bins // 2, used.shape[1]
    tile = state.shape[1] // tiles
    for r in range(rows.shape[0]):
        i = rows[r]
        for t in range(begin[r], stop, step):
            if not used[i // tile, t]:
                continue
            middle = (row_cell[r] + tile_cell[t]) * bins + half
            for m in range(t, t + 2):  # before the middle of the tile, and behind it
                before = lines[r, m - 1 if m > 0 else 0]
                rise = lines[r, m if m < tiles else tiles - 1] - before
                for j in range(max(middles[m], t * tile), min(middles[m + 1], (t + 1) * tile)):
                    if state[i, j] == LINING:
                        expected = rings[j] + before + weights[j] * rise
                        k = int(np.floor(np.float32(level[i, j] * PER_LEVEL) - per_bin * expected))
                        if -half <= k < half:
                            histograms[middle + k] += 1
                    middle += stride * bins
