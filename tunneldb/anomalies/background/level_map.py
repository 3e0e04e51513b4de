"""Level and standard deviation of the background (dry lining) everywhere in the picture of a kilometre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely.geometry import Polygon

from tunneldb.anomalies.background.level import ROWS, BackgroundLevel
from tunneldb.anomalies.background.model import BackgroundFit
from tunneldb.arrays import Bool, Int64, Single, UInt8
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState

TILE = 0.5
"""Approximate side of a tile, m."""

PASSES = 2
"""Number of passes in which bands, rings and the smooth part are fitted again, each to the residuals of the others."""

MIN_DRY_SHARE = 0.1
"""Minimum share of the lining that must be left for the background if wet pixels are not used."""

SAMPLE_PIXELS = 2_000_000
"""Approximate number of pixels for mean and spread of the kilometre."""


@dataclass(frozen=True)
class BackgroundMap:
    """Local level and standard deviation of the background.

    Attributes
    ----------
    grid : Grid
        The pixels.
    level : BackgroundLevel
        Level: of the kilometre, of each column (rings of other concrete), of each row by blocks of 50 m (soot, grime, stripes),
        and a smooth part by tiles.
    sigma : (tiles down, tiles along) float32 array
        Standard deviation, dB, above 0; for pixel (i, j) in tile (i // level.tile, j // level.tile).
    mean, spread : float
        Medians over the lining of level and standard deviation, dB; NaN without lining.
    count : int
        Number of pixels used; 0 if there is no lining.
    drawn : tuple of Polygon
        Dry regions that the user drew, in the unrolled plane, m.
    """

    grid: Grid
    level: BackgroundLevel
    sigma: Single
    mean: float
    spread: float
    count: int
    drawn: tuple[Polygon, ...] = ()


def map_background(picture: LiningImage, dry_regions: Sequence[Polygon] = (), wet: Bool | None = None) -> BackgroundMap:
    """Map the background of a picture.

    Level and standard deviation are those of the dry part of the lining (`radiometry.robust_statistics`): of a column, of a row
    along 150 m, of windows of tiles. As long as no more than half of each is wet, leaks have no influence. Recessed lining, and
    pixels between profiles, are not used either.

    Parameters
    ----------
    picture : LiningImage
        State and level of the pixels.
    dry_regions : sequence of Polygon
        Dry lining that the user drew, in the unrolled plane, m. Tiles mostly inside it take plain mean and standard deviation
        (Xu et al., 2018, eq. 19) of the pixels in it, however dark these are; other tiles are not affected.
    wet : (rows, columns) bool array, optional
        Pixels that are not used, unless less than MIN_DRY_SHARE of the lining would be left: water, however long.
    """
    spacing = 0.0 if picture.gaps is None else picture.gaps.spacing
    picture = picture.measured()
    if wet is not None:
        picture = _without(picture, wet)
    grid, state = picture.grid, picture.state
    tile, count = _tile_side(grid), int(np.count_nonzero(state == PixelState.LINING))
    if count == 0:
        return _nothing(grid, tile, tuple(dry_regions))
    fit = BackgroundFit(picture, tile, count, dry_regions, spacing)
    for _ in range(PASSES):
        fit.add_bands()
        fit.add_rings()
        fit.add_smooth()
    sigma, level = fit.sigma(), fit.level
    spread = _weighted_median(sigma, fit.lining)
    return BackgroundMap(grid, level, sigma, _mean_level(level, state), spread, count, tuple(dry_regions))


def _without(picture: LiningImage, wet: Bool) -> LiningImage:
    """Return a picture without its wet lining, or as it is if hardly any dry lining would be left."""
    lining = picture.state == PixelState.LINING
    if np.count_nonzero(lining & ~wet) < MIN_DRY_SHARE * np.count_nonzero(lining):
        return picture
    return replace(picture, state=np.where(wet, np.uint8(PixelState.EMPTY), picture.state))


def _tile_side(grid: Grid) -> int:
    """Return the side of a tile, pixels: the divisor of a block nearest to TILE, so that tiles are at fixed chainages."""
    sides = np.arange(1, grid.block_columns + 1)
    sides = sides[grid.block_columns % sides == 0]
    return int(sides[np.argmin(np.abs(sides * grid.pixel - TILE))])


def _nothing(grid: Grid, tile: int, drawn: tuple[Polygon, ...]) -> BackgroundMap:
    """Return the map of a picture without lining."""
    shape = -(-grid.rows // tile), grid.columns // tile
    parts = np.zeros(grid.columns, np.float32), np.zeros((grid.rows, grid.blocks), np.float32), np.zeros(shape, np.float32)
    level = BackgroundLevel(tile, 0.0, *parts)
    return BackgroundMap(grid, level, np.ones(shape, np.float32), np.nan, np.nan, 0, drawn)


def _mean_level(level: BackgroundLevel, state: UInt8) -> float:
    """Return the median over the lining of the background level, from some of its rows, dB; NaN without lining there."""
    rows, columns = state.shape
    every = max(1, rows * columns // SAMPLE_PIXELS)
    levels = []
    for first in range(every // 2, rows, every * ROWS):
        some = slice(first, min(first + every * ROWS, rows), every)
        levels.append(level.levels(some, slice(0, columns))[state[some] == PixelState.LINING])
    values = np.concatenate(levels)
    return float(np.median(values)) if len(values) else np.nan


def _weighted_median(values: Single, weights: Int64) -> float:
    """Return the weighted median of values."""
    order = np.argsort(values, axis=None)
    until = np.cumsum(weights.ravel()[order])
    return float(values.ravel()[order][np.searchsorted(until, 0.5 * until[-1])])
