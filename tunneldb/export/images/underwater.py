"""Rasters of sonar scans below the water: the bed on the map, and the submerged part of the unrolled lining."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import rasterio
import rasterio.shutil
from affine import Affine
from rasterio.crs import CRS
from rasterio.windows import Window
from scipy.spatial import cKDTree

from tunneldb.arrays import Float, Single
from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.files import replacing
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.local import LOCAL_NAME
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.store.catalog import crs_text
from tunneldb.store.sonar import BedCells, load_bed, load_sonar_points
from tunneldb.store.surface import load_alignment, load_surface
from tunneldb.store.survey import Survey

PIXEL = 0.1
"""Side of a pixel, m: of the bed's cells across; a beam is as wide 6 m away."""

BANDS = ("height", "depth", "sigma")
"""Bounds of the raster of the bed, all in m."""

_TILE = 256  # pixels
_MARGIN = 50.0  # m of the surface beyond a kilometre's ends


def export_bed(conn: psycopg.Connection[Any], survey: Survey, km: int, folder: Path) -> Path | None:
    """Write the bed of a kilometre on the map, ``SURVEY-kmNNN-bed.tif``; return its path, or None if no sonar saw any.

    A Cloud Optimized GeoTIFF in the tunnel's SRID of three bands, BANDS, m; NaN where no sonar saw the bed.
    """
    cells = load_bed(conn, survey, km)
    if len(cells.chainage) == 0:
        return None
    alignment, crs = load_alignment(conn, survey), crs_text(conn, survey.srid)
    path = folder / f"{survey.name}-km{km:03d}-bed.tif"
    with replacing(path) as temporary:
        _write_bed(temporary, cells, alignment, crs)
    return path


def _write_bed(path: Path, cells: BedCells, alignment: Alignment, crs: str) -> None:
    middles = alignment.plan_points(cells.chainage, cells.across)
    west, south = np.floor(middles.min(axis=0) - 1.0)
    east, north = np.ceil(middles.max(axis=0) + 1.0)
    columns, rows = (round(float(length) / PIXEL) for length in (east - west, north - south))
    transform = Affine(PIXEL, 0.0, float(west), 0.0, -PIXEL, float(north))
    plain = path.with_name(f"plain-{path.name}")
    with rasterio.open(
        plain, "w", driver="GTiff", height=rows, width=columns, count=len(BANDS), transform=transform, dtype="float32",
        nodata=np.nan, crs=None if crs == LOCAL_NAME else CRS.from_user_input(crs), tiled=True, blockxsize=_TILE,
        blockysize=_TILE, sparse_ok=True, bigtiff="if_safer",
    ) as image:  # fmt: skip
        for k, name in enumerate(BANDS, start=1):
            image.set_band_description(k, name)
        image.units = ("m",) * len(BANDS)
        for window, values in _tiles(cells, alignment, middles, transform, (rows, columns)):
            image.write(values, window=window)
    rasterio.shutil.copy(
        str(plain), str(path), driver="COG", compress="DEFLATE", predictor="YES", overview_resampling="AVERAGE",
        bigtiff="IF_SAFER", sparse_ok=True,
    )  # fmt: skip
    plain.unlink()


def _tiles(
    cells: BedCells, alignment: Alignment, middles: Float, transform: Affine, shape: tuple[int, int]
) -> Iterator[tuple[Window, Single]]:
    """Return the tiles of the raster with cells: a canal fills little of its bounding box."""
    tree = cKDTree(middles)
    height = float(np.median(cells.values[:, 0]))
    for top in range(0, shape[0], _TILE):
        for left in range(0, shape[1], _TILE):
            rows, columns = min(_TILE, shape[0] - top), min(_TILE, shape[1] - left)
            middle = transform @ (left + columns / 2, top + rows / 2)
            if tree.query(middle)[0] > PIXEL * _TILE:
                continue
            x, y = np.meshgrid(left + np.arange(columns) + 0.5, top + np.arange(rows) + 0.5)
            east, north = transform @ (x.ravel(), y.ravel())
            chainage, across = alignment.places(np.column_stack([east, north, np.full(len(east), height)]))
            values = cells.at(chainage, across).T.reshape(len(BANDS), rows, columns)
            yield Window(left, top, columns, rows), values.astype(np.float32)


def export_submerged(conn: psycopg.Connection[Any], survey: Survey, km: int, folder: Path) -> Path | None:
    """Write the sonar scans of a kilometre, unrolled, ``SURVEY-kmNNN-submerged.tif``; return its path, or None if none.

    A Cloud Optimized GeoTIFF of the distance of the submerged lining and of the bed from the section surface, m, positive
    into the tunnel: x is the chainage, y the arc, m, as in all images; NaN where no sonar saw anything.
    """
    points = load_sonar_points(conn, survey, km)
    if len(points) == 0:
        return None
    surface = load_surface(conn, survey, km * KILOMETRE - _MARGIN, (km + 1) * KILOMETRE + _MARGIN)
    unrolled = surface.unroll(points)
    inside = np.isfinite(unrolled.offset)
    if not inside.any():
        return None
    column = np.floor(unrolled.chainage[inside] / PIXEL).astype(np.int64)
    row = np.floor(-unrolled.arc[inside] / PIXEL).astype(np.int64)
    left, top = column.min(), row.min()
    shape = int(row.max() - top) + 1, int(column.max() - left) + 1
    pixel = (row - top) * shape[1] + column - left
    count = np.bincount(pixel, minlength=shape[0] * shape[1])
    total = np.bincount(pixel, unrolled.offset[inside], minlength=len(count))
    values = np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(shape).astype(np.float32)
    path = folder / f"{survey.name}-km{km:03d}-submerged.tif"
    extent = Extent(Affine(PIXEL, 0.0, float(left * PIXEL), 0.0, -PIXEL, float(-top * PIXEL)), *shape)
    with replacing(path) as temporary:
        write_cog(temporary, "offset", extent, [(0, values)], "offset of submerged lining and bed")
    return path
