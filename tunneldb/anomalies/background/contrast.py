"""Picture of a kilometre relative to its background: darkening of each pixel."""

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
from tunneldb.segmentation.network import HALF


@dataclass(frozen=True)
class ContrastImage:
    """State of all pixels of a picture, and their darkening relative to the background.

    Attributes
    ----------
    grid : PixelGrid
        The pixels.
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`.
    drop : (rows, columns) int16 array
        Darkening: level of the background minus that of the pixel, in steps of 0.01 dB, positive where the pixel is darker;
        NODATA where there is no point. In drawn dry regions it is at most 0.
    tile : int
        Side of the tiles of ``sigma``, pixels.
    sigma : (tiles down, tiles along) float32 array
        Standard deviation of the background, dB; for pixel (i, j) in tile (i // tile, j // tile).
    drawn : tuple of Polygon
        Dry regions that the user drew, in the unrolled plane, m.
    spacing : float
        Distance of profiles along the tunnel, m, if pixels between them take the value of the nearest profile; 0 if profiles
        are as close as pixels.
    between : (rows, columns) bool array or None
        True for those pixels.
    water : (rows, columns) uint8 array or None
        Probability of water of each pixel by a segmentation network, in steps of 1/255; None if none was asked.
    texture : Texture or None
        Windows over which lining is averaged before dark lining is detected, and to which ``sigma`` refers. None: single
        pixels.
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
    water: UInt8 | None = None

    def wet(self) -> Bool | None:
        """Return the pixels that are more likely wet than not, by the network; None if none was asked."""
        return None if self.water is None else self.water >= HALF


def contrast_image(picture: LiningImage, background: BackgroundMap, water: UInt8 | None = None) -> ContrastImage:
    """Subtract all pixels from the background level, in the memory of ``picture.level``, which is overwritten.

    Parameters
    ----------
    picture : LiningImage
    background : BackgroundMap
    water : (rows, columns) uint8 array, optional
        Probability of water by a segmentation network, in steps of 1/255.
    """
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
        if water is not None:
            water[:, block][mask] = 0
    tile, texture, sigma = background.level.tile, None, background.sigma
    if not spacing and background.count:
        texture = measure_texture(picture.state, drop, sigma, tile, picture.grid.pixel)
        sigma = texture.sigma
    return ContrastImage(picture.grid, picture.state, drop, tile, sigma, background.drawn, spacing, between, texture, water)
