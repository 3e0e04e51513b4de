"""Image in colour of the example survey."""

from __future__ import annotations

import numpy as np
import psycopg

from tunneldb.raster.geotiff import RGB, Raster, decode, encode
from tunneldb.raster.overview import Overview
from tunneldb.store.images import insert_image, save_overview
from tunneldb.store.survey import get_survey

ABOVE, BELOW = (255, 0, 0), (20, 90, 160)
"""Colours of pixels with a measurement, above and below arc 0; one has bands of 0."""


def add_image_in_colour(conn: psycopg.Connection, survey: str) -> None:
    """Store an image in colour with its overview, with the pixels of the corrected intensity; commits."""
    found = get_survey(conn, survey)
    rows = conn.execute(
        "SELECT km, block, tiff FROM tunnel.image WHERE survey_id = %s AND kind = 'corrected' ORDER BY block",
        [found.id],
        binary=True,
    ).fetchall()
    overviews: dict[int, Overview] = {}
    for km, block, tiff in rows:
        like = decode(tiff)
        _, arc = like.places()
        colours = np.where(arc[:, None, None] < 0, np.float32(BELOW), np.float32(ABOVE))
        raster = Raster(np.where(np.isnan(like.values)[..., None], np.float32(np.nan), colours), like.transform)
        overviews.setdefault(km, Overview(RGB)).add(raster)
        insert_image(conn, found, km, RGB, block, encode(raster, RGB))
    for km, overview in overviews.items():
        save_overview(conn, found, km, overview)
    conn.commit()
