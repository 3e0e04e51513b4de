"""Model of the background, fitted to a picture step by step: base, rings, bands and a smooth part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage
from shapely.geometry import Polygon

from tunneldb.anomalies.background.histogram import BIN, TILE_BINS, Residuals, window_statistics
from tunneldb.anomalies.background.level import BackgroundLevel
from tunneldb.anomalies.background.smooth import extrapolate, smooth_level
from tunneldb.anomalies.windows import count_in_columns
from tunneldb.arrays import Bool, Float, Int16, Int64, Single, UInt8, UInt16
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.raster.geotiff import STEP
from tunneldb.raster.image import LiningImage
from tunneldb.raster.polygons import mask_of_polygons
from tunneldb.raster.state import PixelState

SAMPLE, LINES = 15_000_000, 6_000_000
"""Approximate number of pixels used for tiles; rows and columns use the same, and have far more each."""

BLOCKS_TO_EITHER_SIDE = 1
"""Number of blocks to either side for a band: with the block itself 150 m, much more than a leak."""

ROW_MEDIAN_LENGTH = 0.1
"""Length of the running median across bands, m: joints along the tunnel are narrower than half of it."""

RING_MEDIAN_LENGTH = 0.3
"""Length of the running median along rings, m: joints are narrower than half of it, steps stay sharp."""

PROFILE_SPACINGS = 0.5
"""Distance, in spacings, up to which columns belong to one profile, which need not be perpendicular to the axis."""

MIN_RING_LENGTH = 0.6
"""Minimum length of a ring, m: a narrower dark one is a joint that leaks all round."""

GOOD_VALUES = 100
"""Number of values that give the background level to about a tenth of their standard deviation."""

MIN_VALUES = 10
"""Minimum number of values for a level."""

MIN_VALUE_SHARE = 0.15
"""Minimum number of values of a row or a column for a level, as a share of the mean number."""

SIGMA_HALF_WIDTH = 2.0
"""Half the side of the windows for the standard deviation, m: they contain a few segments of a ring."""

TILE_SCATTER_HALF_WIDTH = 5.0
"""Half the side of the windows for the differences between tiles, m: they contain several segments and blocks."""

MIN_TILES = 50
"""Minimum number of tiles for these differences."""

MIN_SIGMA_PERCENTILE = 10.0
"""Percentile of the kilometre's standard deviations that is the lower limit of all."""

MIN_DRAWN_SHARE = 0.5
"""Minimum share of a tile's lining in drawn dry regions for these to determine its level."""

SORTED_AT_A_TIME = 4_000_000
"""Maximum number of values sorted at a time."""


class BackgroundFit:
    """Model of the background of a picture with lining; see `BackgroundLevel` for its parts.

    Parameters
    ----------
    picture : LiningImage
        State and level of the pixels.
    tile : int
        Side of a tile, pixels.
    count : int
        Number of lining pixels.
    drawn : sequence of Polygon
        Drawn dry regions.
    spacing : float
        Distance of profiles along the tunnel, m; 0 if they are as close as pixels.
    """

    def __init__(self, picture: LiningImage, tile: int, count: int, drawn: Sequence[Polygon], spacing: float = 0.0) -> None:
        grid = self.grid = picture.grid
        self.picture, self.tile, self.drawn, self.spacing = picture, tile, drawn, spacing
        self.every, self.apart = max(1, count // SAMPLE), max(1, count // LINES)
        shape = -(-grid.rows // tile), grid.columns // tile
        total = robust_statistics(_sample(picture.state, picture.level, max(1, count // 500_000)) * STEP["corrected"])
        self.base, self.spread = total.mean, max(total.sigma, STEP["corrected"])
        self.rings = np.zeros(grid.columns, np.float32)
        self.bands = np.zeros((grid.rows, grid.blocks), np.float32)
        self.smooth = np.zeros(shape, np.float32)
        self.outlying = np.zeros(shape, np.bool_)
        self.lining = _lining_pixels(picture.state, tile)
        scanned = self.lining[:, self.lining.any(axis=0)]
        self.per_tile = float(scanned.mean())
        self.fixed = np.zeros(shape, np.bool_)
        if drawn:
            number = self._drawn_moments(self.smooth)[0]
            self.fixed = (number >= MIN_DRAWN_SHARE * self.lining) & (number > 0)

    @property
    def level(self) -> BackgroundLevel:
        """Return the model in its current state."""
        return BackgroundLevel(self.tile, self.base, self.rings, self.bands, self.smooth)

    def add_bands(self) -> None:
        """Add the band of each row: around each block, or if too little of it is seen, over the whole kilometre."""
        scanned, per_block = int(self.lining.any(axis=0).sum()), self.smooth.shape[1] // self.bands.shape[1]
        along = min(scanned, (2 * BLOCKS_TO_EITHER_SIDE + 1) * per_block)
        enough = max(MIN_VALUES, round(MIN_VALUE_SHARE * along * self.per_tile / self.tile / self.apart))
        found, whole = Residuals(self.picture, self.level, self._plain, self.apart).of_rows(BLOCKS_TO_EITHER_SIDE, enough)
        found = np.where(np.isfinite(found), found, whole[:, None])
        rows = np.flatnonzero(np.isfinite(whole))
        if not len(rows):
            return
        for b in range(found.shape[1]):
            found[:, b] = np.interp(np.arange(len(found)), rows, found[rows, b])
        size = _odd(ROW_MEDIAN_LENGTH / self.grid.pixel)
        self.bands += ndimage.median_filter(found, (size, 1), mode="nearest")

    def add_rings(self) -> None:
        """Add the level of each column, without joints.

        Profiles at a distance cannot separate a joint from a ring: each takes its own level.
        """
        pixel = self.grid.pixel
        per_column = self.per_tile * self.lining.shape[0] / self.tile
        enough = max(MIN_VALUES, round(MIN_VALUE_SHARE * per_column / self.apart))
        found = Residuals(self.picture, self.level, self._plain, self.apart).of_columns(enough)
        # Where columns have few values, more of them are combined.
        least = 10.0 * GOOD_VALUES / max(per_column, 1.0)
        size = _odd(PROFILE_SPACINGS * self.spacing / pixel if self.spacing else max(RING_MEDIAN_LENGTH / pixel, least))
        found = _running_median(found, size // 2)
        columns = np.flatnonzero(np.isfinite(found))
        if not len(columns):
            return
        rings = self.rings + np.interp(np.arange(len(found)), columns, found[columns])
        if self.spacing:
            self.rings = rings.astype(np.float32)
            return
        closed = ndimage.grey_closing(rings, _odd(MIN_RING_LENGTH / pixel), mode="nearest")
        self.rings = np.where(closed - rings > 0.5 * self.spread, closed, rings).astype(np.float32)

    def add_smooth(self) -> None:
        """Add the smooth part."""
        selected = max(self.per_tile / self.every, 1e-3)
        half = int(np.ceil((np.sqrt(GOOD_VALUES / selected) - 1) / 2)) if selected < GOOD_VALUES else 0
        histograms = self._histograms()
        used = np.ones(self.smooth.shape, np.bool_)
        mean, sigma, count = window_statistics(histograms, used, half)
        mean[(count == 0) | (self.lining == 0)] = np.nan
        level = self.smooth + mean
        if self.fixed.any():
            number, total, _ = self._drawn_moments(np.zeros_like(self.smooth))
            level[self.fixed] = (total / np.maximum(number, 1))[self.fixed]
        if np.isfinite(sigma).any():
            self.spread = max(float(np.nanmedian(sigma)), STEP["corrected"])
        self.smooth, self.outlying = smooth_level(level, self.smooth, self.spread, self.fixed)

    def sigma(self) -> Single:
        """Compute the standard deviation about the model, by tiles, dB: of pixels, plus the differences between whole tiles."""
        half = max(1, round(SIGMA_HALF_WIDTH / (self.tile * self.grid.pixel)))
        while (2 * half + 1) ** 2 * self.per_tile / self.every < 4 * GOOD_VALUES and half < 10:
            half += 1
        histograms = self._histograms()
        _, sigma, count = window_statistics(histograms, ~self.outlying, half)
        sigma[count < GOOD_VALUES] = np.nan
        known = np.isfinite(sigma) & (sigma > 0)
        seen = known & (self.lining > 0)
        if not seen.any():
            return np.full_like(sigma, self.spread)
        sigma = extrapolate(
            np.where(known, np.maximum(sigma, np.percentile(sigma[seen], MIN_SIGMA_PERCENTILE)), np.nan).astype(np.float32)
        )
        sigma = np.hypot(sigma, self._between(histograms))
        if self.fixed.any():
            number, total, squares = (
                ndimage.uniform_filter(m * self.fixed, 2 * half + 1) for m in self._drawn_moments(self.smooth)
            )
            number = np.maximum(number, 1e-9)
            plain = np.sqrt(np.maximum(squares / number - (total / number) ** 2, STEP["corrected"] ** 2))
            sigma[self.fixed] = plain[self.fixed]
        return sigma

    def _between(self, histograms: UInt16) -> Single:
        """Compute the standard deviation of whole tiles about the model, dB: segments and blocks are darker or brighter.

        It uses the tiles around each one, without those set off by a sharp edge.
        """
        level, _, count = window_statistics(histograms, np.ones(self.smooth.shape, np.bool_), 0)
        known = (count >= GOOD_VALUES) & ~self.fixed & ~self.outlying
        place = np.floor(level / BIN) + TILE_BINS // 2
        known &= (place >= 0) & (place < TILE_BINS)
        levels = np.zeros((*level.shape, TILE_BINS), np.uint16)
        levels[known, place[known].astype(np.int64)] = 1
        _, sigma, number = window_statistics(levels, known, round(TILE_SCATTER_HALF_WIDTH / (self.tile * self.grid.pixel)))
        return extrapolate(np.where(number >= MIN_TILES, sigma, np.nan).astype(np.float32))

    def _histograms(self) -> UInt16:
        return Residuals(self.picture, self.level, self.lining > 0, self.every).of_tiles()

    @property
    def _plain(self) -> Bool:
        """Return the tiles with lining that are not set off."""
        return (self.lining > 0) & ~self.outlying

    def _drawn_moments(self, smooth: Single) -> tuple[Float, Float, Float]:
        """Return number, sum and sum of squares of the residuals of lining pixels in drawn regions, by tiles.

        ``smooth`` replaces the model's smooth part.
        """
        tile, shape = self.tile, self.smooth.shape
        moments = np.zeros((3, *shape))
        for columns, mask in mask_of_polygons(self.grid, self.drawn):
            row, column = np.nonzero(mask & (self.picture.state[:, columns] == PixelState.LINING))
            level = replace(self.level, smooth=smooth).levels(slice(0, self.grid.rows), columns)
            beyond = self.picture.level[:, columns][row, column] * STEP["corrected"] - level[row, column]
            where = row // tile * shape[1] + (column + columns.start) // tile
            for k in range(3):
                moments[k] += np.bincount(where, beyond**k, shape[0] * shape[1]).reshape(shape)
        return moments[0], moments[1], moments[2]


def _odd(length: float) -> int:
    """Return the odd number of pixels nearest to a length in pixels."""
    return 2 * int(length / 2) + 1


def _sample(state: UInt8, level: Int16, every: int) -> Int16:
    """Return the level of every n-th lining pixel, row by row."""
    kept, seen = [], 0
    for row in range(len(state)):
        lining = np.flatnonzero(state[row] == PixelState.LINING)
        kept.append(level[row, lining[-seen % every :: every]])
        seen += len(lining)
    return np.concatenate(kept)


def _lining_pixels(state: UInt8, tile: int) -> Int64:
    """Count the lining pixels of each tile (tiles down, tiles along)."""
    tiles = state.shape[1] // tile
    return np.array(
        [
            count_in_columns(state[top : top + tile, : tiles * tile] == PixelState.LINING).reshape(tiles, tile).sum(axis=1)
            for top in range(0, len(state), tile)
        ]
    )


def _running_median(values: Single, half: int) -> Single:
    """Return the median of the known values (not NaN) within so many places; NaN if there are none."""
    padded = np.pad(values, half, constant_values=np.nan)
    size, out = 2 * half + 1, np.empty_like(values)
    for start in range(0, len(values), max(1, SORTED_AT_A_TIME // size)):
        part = padded[start : start + max(1, SORTED_AT_A_TIME // size) + 2 * half]
        about = np.sort(np.lib.stride_tricks.sliding_window_view(part, size), axis=1)  # NaNs come last
        known = np.count_nonzero(~np.isnan(about), axis=1)
        middle = (np.take_along_axis(about, k[:, None], axis=1)[:, 0] for k in (np.maximum(known - 1, 0) // 2, known // 2))
        out[start : start + len(about)] = sum(middle) / 2
    return out
