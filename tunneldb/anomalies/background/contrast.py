"""The picture of a kilometre relative to its background: by how much each pixel is darker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.background.texture import Texture, measure_texture
from tunneldb.arrays import Bool, Int16, Single, UInt8
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import PixelGrid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.polygons import mask_of_polygons


@dataclass(frozen=True)
class ContrastImage:
    """State of all pixels of a picture, and how much darker than the background they are.

    Attributes
    ----------
    grid : PixelGrid
        The pixels.
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.pixel_state.PixelState`.
    drop : (rows, columns) int16 array
        Level of the background there less that of the pixel, in steps of 0.01 dB, positive where it is darker; NODATA where
        there is no point. What lies in drawn dry regions is at most 0.
    tile : int
        Side of the tiles of ``sigma``, pixels.
    sigma : (tiles down, tiles along) float32 array
        Standard deviation of the background, dB; of pixel (i, j) in tile (i // tile, j // tile).
    drawn : tuple of Polygon
        Dry regions that the user drew, in the unrolled plane, m.
    spacing : float
        Distance of profiles along the tunnel, m, where pixels between them show what the nearest one does; 0 where profiles lie
        as close as pixels.
    between : (rows, columns) bool array or None
        Those pixels.
    texture : Texture or None
        The windows over which lining is averaged before it is told whether it is dark, and that ``sigma`` is of. None: pixels
        by themselves.
    """

    grid: PixelGrid
    state: UInt8
    drop: Int16
    tile: int
    sigma: Single
    drawn: tuple[Polygon, ...] = ()
    spacing: float = 0.0
    between: Bool | None = None
    texture: Texture | None = None


def contrast_image(picture: LiningImage, background: BackgroundMap) -> ContrastImage:
    """Take the level of the background from that of all pixels, in the memory of ``picture.level``, which is lost."""
    drop = picture.level
    background.level.subtract(drop)
    spacing, between = 0.0, None
    if picture.gaps is not None:
        spacing, between = picture.gaps.spacing, drop == NODATA
        picture.gaps.close_levels(drop)
        between &= drop != NODATA
    for block, mask in mask_of_polygons(picture.grid, background.drawn):
        here = drop[:, block]
        here[mask] = np.minimum(here[mask], 0)
    tile, texture, sigma = background.level.tile, None, background.sigma
    if not spacing and background.count:
        texture = measure_texture(picture.state, drop, sigma, tile, picture.grid.pixel)
        sigma = texture.sigma
    return ContrastImage(picture.grid, picture.state, drop, tile, sigma, background.drawn, spacing, between, texture)
