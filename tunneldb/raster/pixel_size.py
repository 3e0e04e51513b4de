"""Size of the pixels of a kilometre's image, from the density of its points.

With far fewer points than pixels a leak is a cloud of separate dark pixels, whose edge and shape cannot be measured. Sums of
small pixels add up to those of large ones, so the size is chosen after all points were read.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.block_sums import BlockSums
from tunneldb.raster.grid import Grid

SMALLEST = 0.02
"""Smallest pixel that is chosen, m: as large as a beam."""

FACTORS = (1, 2, 4, 10)
"""Factors by which chosen pixels are larger; they divide the columns of a block."""

MIN_POINTS = 0.35
"""Mean number of points of a pixel for it to be large enough: in 30 % of such pixels random points lie."""

TILE = 25
"""Side of the tiles for the density, pixels: half a metre."""


def choose_factor(image: Accumulator) -> tuple[int, float]:
    """Choose the factor by which the pixels of an image are to be larger.

    The smallest of FACTORS with which pixels have MIN_POINTS points at the median place. Points are counted by the pixels that
    have any, as random ones (Poisson), because scanners hit some pixels hundreds of times.

    Parameters
    ----------
    image : Accumulator
        Sums of all points.

    Returns
    -------
    factor : int
    density : float
        Points per m² at the median place.
    """
    shares = np.concatenate([_shares(image.has_points(block)) for block in image.inner_blocks()] or [np.empty(0)])
    shares = shares[shares > 0.0]
    if not len(shares):
        return 1, 0.0
    per_pixel = float(-np.log1p(-min(float(np.median(shares)), 1.0 - 1e-3)))
    factor = next((factor for factor in FACTORS if per_pixel * factor**2 >= MIN_POINTS), FACTORS[-1])
    return factor, per_pixel / image.grid.pixel**2


def coarse_grid(grid: Grid, factor: int, halo: int) -> Grid:
    """Return the grid of the same blocks with larger pixels, and with so many columns of context beyond the kilometre."""
    bottom, top = grid.bottom // factor, -(-(grid.bottom + grid.rows) // factor)
    return Grid(grid.km, grid.pixel * factor, bottom, top - bottom, halo, grid.covered)


def coarsen(image: BlockSums, large: BlockSums) -> None:
    """Add the sums of an image to those of an empty one of the same blocks, with larger pixels."""
    factor = round(large.grid.pixel / image.grid.pixel)
    first = (large.grid.bottom + large.grid.rows) * factor - image.grid.bottom - image.grid.rows
    for block in image.blocks():
        sums = image.sums(block)
        padded = np.zeros((large.grid.rows * factor, *sums.shape[1:]), np.int64)
        padded[first : first + len(sums)] = sums
        large.put(block, padded.reshape(large.grid.rows, factor, -1, factor, sums.shape[2]).sum(axis=(1, 3)))


def _shares(held: Bool) -> Float:
    """Return the share of pixels with points by tiles."""
    rows, columns = (size // TILE * TILE for size in held.shape)
    tiles = held[:rows, :columns].reshape(rows // TILE, TILE, columns // TILE, TILE)
    return np.asarray(tiles.mean(axis=(1, 3), dtype=np.float64)).ravel()
