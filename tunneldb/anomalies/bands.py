"""Dark bands along the tunnel that the background contains: whether they are wet or dirty is not decided.

The background has a level for each row along 150 m, since soot and grime are as long. Damp at the foot of a wall can be so
long, and is then the level with which lining is compared. So the level of each row is itself compared with those about it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.windows import on_lining
from tunneldb.arrays import Bool, Float
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.polygons import mask_of_polygons

MAX_WIDTH = 2.0
"""Maximum width of a band, m: soot in the crown, and what depends on the distance from the scanner, are wider and even."""

MIN_WIDTH = 0.1
"""Minimum width of a band, m: joints and the shadows of cables are narrower."""

MIN_DROP = 2.0
"""Minimum darkening of the darkest row of a band, dB; its other rows have at least half of it."""

CELL = 1.0
"""Length of the parts of a band that are examined one by one, m."""

MIN_SEEN_SHARE = 0.1
"""Minimum share of a part's pixels that show lining."""


@dataclass(frozen=True)
class DarkBand:
    """A dark band within a block, as a rectangle of the unrolled plane.

    Attributes
    ----------
    chainage_from, chainage_to, arc_from, arc_to : float
        m.
    darkening : float
        Mean difference from the brightest rows beside it, dB.
    area : float
        Lining in it that was seen, m².
    """

    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    darkening: float
    area: float


def find_bands(contrast: ContrastImage, background: BackgroundMap) -> list[DarkBand]:
    """Find the dark bands of a kilometre.

    Parameters
    ----------
    contrast : ContrastImage
        State and darkening of its pixels.
    background : BackgroundMap
        Background that they are relative to.

    Returns
    -------
    list of DarkBand
        By block and row. None where the user drew dry regions.
    """
    grid = background.grid
    if not background.count:
        return []
    decided = np.zeros(contrast.state.shape, np.bool_)
    for columns, mask in mask_of_polygons(grid, contrast.drawn):
        decided[:, columns] |= mask
    bands: list[DarkBand] = []
    for block in range(grid.inner.start // grid.block_columns, grid.inner.stop // grid.block_columns):
        columns = slice(block * grid.block_columns, (block + 1) * grid.block_columns)
        lining = on_lining(contrast.state[:, columns]) & (contrast.drop[:, columns] != NODATA) & ~decided[:, columns]
        levels = _row_levels(background, block)
        below = _below_brightest(levels, lining.any(axis=1), grid.pixel)
        for rows in _strips(below, round(MIN_WIDTH / grid.pixel)):
            here = background.level.levels(rows, columns) - background.level.base - background.level.rings[columns]
            dark = contrast.drop[rows, columns] * STEP["corrected"] + (levels + below)[rows, None] - here
            bands += _parts(np.where(lining[rows], dark, np.nan), grid, rows, columns)
    return bands


def _row_levels(background: BackgroundMap, block: int) -> Float:
    """Return the mean level of each row over a block, without base and rings, dB."""
    level = background.level
    tiles = level.smooth.shape[1] // level.bands.shape[1]
    smooth = level.smooth[:, block * tiles : (block + 1) * tiles].mean(axis=1)
    middles = (np.arange(len(smooth)) + 0.5) * level.tile - 0.5
    levels: Float = level.bands[:, block] + np.interp(np.arange(len(level.bands)), middles, smooth)
    return levels


def _below_brightest(levels: Float, seen: Bool, pixel: float) -> Float:
    """Return by how much rows are darker than the brightest rows beside them, dB; 0 where no lining was seen."""
    below = np.zeros(len(levels))
    rows = np.flatnonzero(seen)
    if not len(rows):
        return below
    known = np.interp(np.arange(rows[0], rows[-1] + 1), rows, levels[rows])
    below[rows[0] : rows[-1] + 1] = close_rows(known[:, None], round(MAX_WIDTH / pixel / 2))[:, 0] - known
    return below


def close_rows(levels: Float, half: int) -> Float:
    """Raise levels (rows, columns) where a column is dark over at most 2 half + 1 rows, or half + 1 at its ends.

    A morphological closing, dB.
    """
    far, size = 1e3, (2 * half + 1, 1)
    padded = np.pad(levels, ((half, half), (0, 0)), constant_values=-far)
    bright = ndimage.grey_dilation(padded, size, mode="constant", cval=-far)[half : half + len(levels)]
    closed: Float = ndimage.grey_erosion(bright, size, mode="constant", cval=far)
    return closed


def _strips(below: Float, least: int) -> Iterator[slice]:
    """Yield runs of dark rows that are long enough and have one that is dark enough."""
    label, _ = ndimage.label(below >= 0.5 * MIN_DROP)
    for (rows,) in ndimage.find_objects(label):
        if rows.stop - rows.start >= least and below[rows].max() >= MIN_DROP:
            yield rows


def _parts(dark: Float, grid: Grid, rows: slice, columns: slice) -> Iterator[DarkBand]:
    """Yield the parts of a strip along a block that are dark, from the darkening of its pixels; NaN: no lining."""
    cells = round(BLOCK / CELL)
    seen = np.isfinite(dark).reshape(len(dark), cells, -1)
    count = seen.sum(axis=(0, 2))
    total = np.nansum(dark.reshape(seen.shape), axis=(0, 2))
    mean = total / np.maximum(count, 1)
    enough = count >= MIN_SEEN_SHARE * dark.size / cells
    label, _ = ndimage.label(enough & (mean >= 0.5 * MIN_DROP))
    start = grid.west + columns.start * grid.pixel
    top = (grid.bottom + grid.rows) * grid.pixel
    for (run,) in ndimage.find_objects(label):
        yield DarkBand(
            start + run.start * CELL,
            start + run.stop * CELL,
            top - rows.stop * grid.pixel,
            top - rows.start * grid.pixel,
            float(total[run].sum() / count[run].sum()),
            float(count[run].sum() * grid.pixel**2),
        )
