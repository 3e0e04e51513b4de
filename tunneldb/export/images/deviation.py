"""Image of the deviation from the design: Cloud Optimized GeoTIFFs, one a kilometre."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Single
from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.files import replacing
from tunneldb.pipeline.deviation import deviation_blocks, load_design_of
from tunneldb.store.survey import Survey


def write_deviation(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str, path: Path) -> Path | None:
    """Write the deviation of each pixel of lining of a kilometre, m, positive inside; NaN elsewhere. None without images.

    x is the chainage, y the arc, m, as in the other images of the survey, whose pixels these are.
    """
    design = load_design_of(conn, survey, km, layer)
    blocks: list[tuple[float, Single]] = []
    transform = None
    for offset, _, found in deviation_blocks(conn, survey, km, design):
        transform = transform or offset.transform
        blocks.append((offset.transform.c, np.ascontiguousarray(found.distance.T, np.float32)))
    if transform is None:
        return None
    columns = [round((west - transform.c) / transform.a) for west, _ in blocks]
    pixels = [values for _, values in blocks]
    extent = Extent(transform, pixels[0].shape[0], columns[-1] + pixels[-1].shape[1])
    with replacing(path) as temporary:
        write_cog(temporary, "deviation", extent, zip(columns, pixels, strict=True), f"deviation from {layer}, positive inside")
    return path
