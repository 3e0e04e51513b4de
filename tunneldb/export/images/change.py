"""Image of the change between two surveys: Cloud Optimized GeoTIFFs, one a kilometre."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.files import replacing
from tunneldb.store.change import load_images
from tunneldb.store.survey import Survey


def write_change(conn: psycopg.Connection[Any], old: Survey, new: Survey, km: int, path: Path) -> Path | None:
    """Write the change of each cell of a kilometre, m, positive inwards; NaN where one of the surveys did not see it.

    x is the chainage, y the arc, of the older survey, m. None where nothing was compared.
    """
    image = load_images(conn, old, new, km).get("change")
    if image is None:
        return None
    rows, columns = image.values.shape
    extent = Extent(image.transform, rows, columns)
    with replacing(path) as temporary:
        parts = iter([(0, np.ascontiguousarray(image.values, np.float32))])
        write_cog(temporary, "change", extent, parts, f"change since {old.name}, positive inwards")
    return path
