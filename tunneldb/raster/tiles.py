"""Tiles of the unrolled plane: the grid of web maps, in plain metres of chainage and arc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Single
from tunneldb.raster.gap_fill import fill_gaps
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.overview import shrink, shrink_codes

SIZE = 256
"""Pixels of a side of a tile."""

EDGE = 20037508.342789244
"""Half of the side of the only tile of zoom 0, m, as in web maps: so their programs show these tiles in their place."""

ZOOMS = (10, 23)
"""First and last zoom: pixels of 153 m and of 19 mm."""

FILL_DISTANCE = 0.05
"""Maximum distance of the value that fills a pixel without a point, m."""


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


def display(tile: Tile, images: list[Raster], codes: bool) -> Single:
    """Return the values (256, 256) of a tile as shown: gaps between neighbouring points are filled, except in codes."""
    reach = FILL_DISTANCE / tile.pixel
    if codes or reach < 1.0:
        return sample(tile, images)
    margin = int(np.ceil(reach))
    return fill_gaps(sample(tile, images, margin), reach)[margin:-margin, margin:-margin]


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


def sample(tile: Tile, images: list[Raster], margin: int = 0) -> Single:
    """Return the values of a tile, those of the nearest pixels of images; NaN without a value.

    Parameters
    ----------
    tile : Tile
    images : list of Raster
    margin : int
        Number of further pixels on each side.

    Returns
    -------
    (256 + 2 margin, 256 + 2 margin) float32 array
        With a third dimension for images in colour.
    """
    middle: Float = np.asarray((np.arange(-margin, SIZE + margin) + 0.5) * tile.pixel, np.float64)
    chainage, arc = tile.west + middle, tile.north - middle
    bands = images[0].values.shape[2:] if images else ()
    out = np.full((len(middle), len(middle), *bands), np.nan, np.float32)
    for image in images:
        rows, columns = image.values.shape[:2]
        column = np.floor((chainage - image.transform.c) / image.transform.a).astype(np.int64)
        row = np.floor((image.transform.f - arc) / image.transform.a).astype(np.int64)
        across, along = (row >= 0) & (row < rows), (column >= 0) & (column < columns)
        out[np.ix_(across, along)] = image.values[np.ix_(row[across], column[along])]
    return out
