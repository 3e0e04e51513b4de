"""Relate a picture to its background: water by the segmentation network, the level of dry lining, and the contrast to it."""

from __future__ import annotations

from collections.abc import Sequence

from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage, contrast_image
from tunneldb.anomalies.background.level_map import BackgroundMap, map_background
from tunneldb.raster.image import LiningImage
from tunneldb.segmentation.network import HALF, Network


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
        None: darkness alone counts.
    """
    water = None if network is None else network.water(picture)
    background = map_background(picture, dry_regions, None if water is None else water >= HALF)
    return background, contrast_image(picture, background, water)
