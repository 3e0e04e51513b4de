"""Image of the deviation from the design: Cloud Optimized GeoTIFFs, one a kilometre."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import psycopg

from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.files import replacing
from tunneldb.raster.geotiff import DEVIATION_KINDS
from tunneldb.store.images import image_blocks, load_block
from tunneldb.store.survey import Survey


def write_deviation(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str, path: Path) -> Path | None:
    """Write the stored deviation of each pixel of lining of a kilometre, m, positive inside; NaN elsewhere. None without any.

    x is the chainage, y the arc, m, as in the other images of the survey, whose pixels these are.
    """
    kind = DEVIATION_KINDS[layer]
    blocks = image_blocks(conn, survey, km, kind)
    if not blocks:
        return None
    first = load_block(conn, survey, km, kind, blocks[0])
    rows, width = first.values.shape
    extent = Extent(first.transform, rows, width * (blocks[-1] - blocks[0] + 1))
    pixels = (((block - blocks[0]) * width, load_block(conn, survey, km, kind, block).values) for block in blocks)
    with replacing(path) as temporary:
        write_cog(temporary, kind, extent, pixels, f"deviation from {layer}, positive inside")
    return path
