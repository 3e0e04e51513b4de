"""Image of the change between two surveys: Cloud Optimized GeoTIFFs, one a kilometre."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.database import snapshot
from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.files import replacing
from tunneldb.measures.change.rows import load_images, older_compared
from tunneldb.raster.geotiff import CHANGE
from tunneldb.store.survey import Survey


def export_change(conn: psycopg.Connection[Any], survey: Survey, km: int, folder: Path) -> list[Path]:
    """Write the change of a kilometre since the last older survey that it was compared with; its path, if there is any.

    It is ``SURVEY-kmNNN-change.tif``, beside the images of the lining. The connection must be idle.
    """
    with snapshot(conn):
        old = older_compared(conn, survey)
        path = folder / f"{survey.name}-km{km:03d}-{CHANGE}.tif"
        written = None if old is None else write_change(conn, old, survey, km, path)
    return [] if written is None else [written]


def write_change(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, path: Path) -> Path | None:
    """Write the change of each cell of a kilometre, m, positive inwards; NaN where one of the surveys has no measurement.

    x is the chainage, y the arc, of the older survey, m. None where nothing was compared.
    """
    image = load_images(conn, old, new, km).get(CHANGE)
    if image is None:
        return None
    rows, columns = image.values.shape
    extent = Extent(image.transform, rows, columns)
    with replacing(path) as temporary:
        parts = iter([(0, np.ascontiguousarray(image.values, np.float32))])
        write_cog(temporary, CHANGE, extent, parts, f"change since {old.name}, positive inwards")
    return path
