"""Level and standard deviation of the background, lining that is dry, everywhere in the picture of a kilometre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from tunneldb.anomalies.background.level import BackgroundLevel
from tunneldb.anomalies.background.model import BackgroundFit
from tunneldb.arrays import Int64, Single, UInt8
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.pixel_state import PixelState

TILE = 0.5
"""Side of a tile, about, m."""

PASSES = 2
"""How often bands, rings and what changes slowly are told apart anew, each from what the others leave."""

SHOWN = 2_000_000
"""Pixels, about, that mean and spread of the kilometre are told from."""


@dataclass(frozen=True)
class BackgroundMap:
    """Level and standard deviation of the background, locally.

    Attributes
    ----------
    grid : Grid
        The pixels.
    level : BackgroundLevel
        The level: that of the kilometre, of each column (rings of other concrete), of each row by blocks of 50 m (soot,
        grime, stripes), and what changes slowly, by tiles.
    sigma : (tiles down, tiles along) float32 array
        Standard deviation, dB, above 0; of pixel (i, j) in tile (i // level.tile, j // level.tile).
    mean, spread : float
        Medians over the lining of level and standard deviation, dB; NaN without lining.
    count : int
        Pixels that it rests on; 0: there is no lining.
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


def map_background(picture: LiningImage, dry_regions: Sequence[Polygon] = ()) -> BackgroundMap:
    """Map the background of a picture.

    Level and standard deviation are those of the dry part of the lining (`radiometry.robust_statistics`):
    of a column, of a row along 150 m, of windows of tiles. As long as no more than half of each is wet, leaks don't count.
    Lining set back behind the wall doesn't count either, nor what lies between profiles.

    Parameters
    ----------
    picture : LiningImage
        State and level of the pixels.
    dry_regions : sequence of Polygon
        Dry lining that the user drew, in the unrolled plane, m. Tiles that lie in it for the larger part take plain mean
        and standard deviation (Xu et al., 2018, eq. 19) of the pixels in it, however dark these are; others are left alone.
    """
    spacing = 0.0 if picture.gaps is None else picture.gaps.spacing
    picture = picture.measured()
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


def _tile_side(grid: Grid) -> int:
    """Side of a tile, pixels: what divides a block and is nearest to TILE, so that tiles always lie at the same chainages."""
    sides = np.arange(1, grid.block_columns + 1)
    sides = sides[grid.block_columns % sides == 0]
    return int(sides[np.argmin(np.abs(sides * grid.pixel - TILE))])


def _nothing(grid: Grid, tile: int, drawn: tuple[Polygon, ...]) -> BackgroundMap:
    """Map of a picture without lining."""
    shape = -(-grid.rows // tile), grid.columns // tile
    parts = np.zeros(grid.columns, np.float32), np.zeros((grid.rows, grid.blocks), np.float32), np.zeros(shape, np.float32)
    level = BackgroundLevel(tile, 0.0, *parts)
    return BackgroundMap(grid, level, np.ones(shape, np.float32), np.nan, np.nan, 0, drawn)


def _mean_level(level: BackgroundLevel, state: UInt8) -> float:
    """Median over the lining of the level of the background, from some of its rows, dB; NaN without lining there."""
    rows, columns = state.shape
    every = max(1, rows * columns // SHOWN)
    levels = []
    for row in range(every // 2, rows, every):
        here = state[row] == PixelState.LINING
        levels.append(level.levels(slice(row, row + 1), slice(0, columns))[0, here])
    values = np.concatenate(levels)
    return float(np.median(values)) if len(values) else np.nan


def _weighted_median(values: Single, weights: Int64) -> float:
    """Median of values that count so often."""
    order = np.argsort(values, axis=None)
    until = np.cumsum(weights.ravel()[order])
    return float(values.ravel()[order][np.searchsorted(until, 0.5 * until[-1])])
