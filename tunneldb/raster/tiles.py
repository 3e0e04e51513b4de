"""Tiles of the unrolled plane: the grid of web maps, in plain metres of chainage and arc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Single
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.overview import shrink, shrink_codes

SIZE = 256
"""Pixels of a side of a tile."""

EDGE = 20037508.342789244
"""Half of the side of the only tile of zoom 0, m, as in web maps: so their programs show these tiles in their place."""

ZOOMS = (10, 23)
"""First and last zoom: pixels of 153 m and of 19 mm."""


@dataclass(frozen=True)
class Tile:
    """A tile, by zoom, column from the west and row from the greatest arc downwards."""

    zoom: int
    column: int
    row: int

    @property
    def exists(self) -> bool:
        """Return True if the grid has this tile."""
        return ZOOMS[0] <= self.zoom <= ZOOMS[1] and 0 <= self.column < 2**self.zoom and 0 <= self.row < 2**self.zoom

    @property
    def pixel(self) -> float:
        """Side of a pixel, m."""
        return 2.0 * EDGE / SIZE / 2**self.zoom

    @property
    def west(self) -> float:
        """Smallest chainage, m."""
        return -EDGE + self.column * SIZE * self.pixel

    @property
    def east(self) -> float:
        """Greatest chainage, m."""
        return self.west + SIZE * self.pixel

    @property
    def north(self) -> float:
        """Greatest arc, m."""
        return EDGE - self.row * SIZE * self.pixel

    @property
    def south(self) -> float:
        """Smallest arc, m."""
        return self.north - SIZE * self.pixel


def reduce(raster: Raster, pixel: float, codes: bool) -> Raster:
    """Return an image with pixels of at most a side, m: the mean, or the most frequent code, of whole pixels."""
    side = raster.transform.a
    columns = raster.values.shape[1]
    factor = max(n for n in range(1, max(1, int(1.1 * pixel / side)) + 1) if columns % n == 0)
    if factor == 1:
        return raster
    if codes:
        values = shrink_codes(np.nan_to_num(raster.values, nan=0.0).astype(np.uint8), factor)
    else:
        values = shrink(raster.values, factor)
    return Raster(values, raster.transform @ raster.transform.scale(factor))


def sample(tile: Tile, images: list[Raster]) -> Single:
    """Return the values (256, 256) of a tile, those of the nearest pixels of images; NaN without a value."""
    middle: Float = np.asarray((np.arange(SIZE) + 0.5) * tile.pixel, np.float64)
    chainage, arc = tile.west + middle, tile.north - middle
    out = np.full((SIZE, SIZE), np.nan, np.float32)
    for image in images:
        rows, columns = image.values.shape
        column = np.floor((chainage - image.transform.c) / image.transform.a).astype(np.int64)
        row = np.floor((image.transform.f - arc) / image.transform.a).astype(np.int64)
        across, along = (row >= 0) & (row < rows), (column >= 0) & (column < columns)
        out[np.ix_(across, along)] = image.values[np.ix_(row[across], column[along])]
    return out
