"""Level and standard deviation of dry lining everywhere in the picture of a kilometre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.intensity.dry import robust_statistics
from tunneldb.leak.image import Grid
from tunneldb.leak.picture import Picture
from tunneldb.leak.raster import STEP

Single = NDArray[np.float32]

TILE = 0.5
"""Side of a tile, about, m."""


@dataclass(frozen=True)
class DryMap:
    """Level and standard deviation of dry lining, locally.

    Attributes
    ----------
    grid : Grid
        The pixels.
    tile : int
        Side of a tile, pixels; divides a block.
    sigma : (tiles down, tiles along) float32 array
        Standard deviation, dB, above 0; of pixel (i, j) in tile (i // tile, j // tile).
    mean, spread : float
        Medians over the lining of level and standard deviation, dB; NaN without lining.
    count : int
        Pixels that it rests on; 0: there is no lining.
    drawn : tuple of Polygon
        Dry regions that the user drew, in the unrolled plane, m.
    """

    grid: Grid
    tile: int
    sigma: Single
    mean: float
    spread: float
    count: int
    drawn: tuple[Polygon, ...] = ()

    def levels(self, rows: slice, columns: slice) -> Single:
        """Level of dry lining in some rows and columns, dB."""
        return np.full((rows.stop - rows.start, columns.stop - columns.start), self.mean, np.float32)


def map_dry(picture: Picture, dry_regions: Sequence[Polygon] = ()) -> DryMap:
    """Map the dry lining of a picture."""
    grid = picture.grid
    tile = tile_side(grid)
    values = picture.level[(picture.state >= 1) & (picture.state <= 2)]
    dry = robust_statistics(values[:: max(1, len(values) // 1_000_000)] * STEP["corrected"])
    sigma = np.full((-(-grid.rows // tile), grid.columns // tile), dry.sigma if dry.count and dry.sigma > 0 else 1.0)
    return DryMap(grid, tile, sigma.astype(np.float32), dry.mean, dry.sigma, dry.count, tuple(dry_regions))


def tile_side(grid: Grid) -> int:
    """Side of a tile, pixels: what divides a block and is nearest to TILE, so that tiles always lie at the same chainages."""
    sides = np.arange(1, grid.block_columns + 1)
    sides = sides[grid.block_columns % sides == 0]
    return int(sides[np.argmin(np.abs(sides * grid.pixel - TILE))])
