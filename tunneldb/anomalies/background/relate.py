"""Relate a picture to its background: water by the segmentation network, the level of dry lining, and the contrast to it."""

from __future__ import annotations

from collections.abc import Sequence

from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage, contrast_image
from tunneldb.anomalies.background.level_map import BackgroundMap, map_background
from tunneldb.raster.image import LiningImage
from tunneldb.segmentation.channels import PIXEL
from tunneldb.segmentation.network import HALF, Network

MAX_PIXEL = 2.0 * PIXEL
"""Maximum size of an image's pixels for the network, m: larger ones, of scans with less than some 150 points per m², show it no
shapes."""


def relate(
    picture: LiningImage, dry_regions: Sequence[Polygon], network: Network | None
) -> tuple[BackgroundMap, ContrastImage]:
    """Map the background of a picture, and subtract its pixels from it.

    Pixels that are more likely wet than not, by the network, are no part of the background, however long the wet area is.

    Parameters
    ----------
    picture : LiningImage
        Its levels are overwritten.
    dry_regions : sequence of Polygon
        Dry lining that the user drew, in the unrolled plane, m.
    network : Network or None
        None: darkness alone counts, as in images with larger pixels than MAX_PIXEL.
    """
    network = usable(network, picture.grid.pixel)
    water = None if network is None else network.water(picture)
    background = map_background(picture, dry_regions, None if water is None else water >= HALF)
    return background, contrast_image(picture, background, water)


def usable(network: Network | None, pixel: float) -> Network | None:
    """Return a network if pixels of this size, m, show it enough, else None."""
    return network if pixel <= MAX_PIXEL * (1.0 + 1e-9) else None
