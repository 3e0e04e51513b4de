"""Images of the unrolled lining: Cloud Optimized GeoTIFFs and previews, three a kilometre."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psycopg
import rasterio.shutil
import shapely
from affine import Affine
from rasterio.windows import Window
from shapely.geometry import Polygon

from tunneldb.database import Survey
from tunneldb.export import preview
from tunneldb.export.atomic import replacing
from tunneldb.leak.raster import KINDS, UNIT, Raster, decode, write_tiff


@dataclass(frozen=True)
class Extent:
    """The pixels that the blocks of one image cover together.

    Attributes
    ----------
    transform : Affine
        From (column, row) to (chainage, arc), m.
    rows, columns : int
        Size.
    """

    transform: Affine
    rows: int
    columns: int


def image_kilometres(conn: psycopg.Connection, survey: Survey) -> list[int]:
    """Kilometres of a survey that have images."""
    rows = conn.execute("SELECT DISTINCT km FROM tunnel.image WHERE survey_id = %s ORDER BY km", (survey.id,))
    return [km for (km,) in rows]


def export_kilometre(conn: psycopg.Connection, survey: Survey, km: int, folder: Path) -> list[Path]:
    """Write the images of a kilometre: ``SURVEY-kmNNN-KIND.tif`` and ``.png`` for each kind that it has.

    The GeoTIFFs hold dB or m as single-precision numbers, NaN where no point fell; x is the chainage and y
    the arc, m. Each file appears whole.

    Returns
    -------
    list of Path
        Files written.
    """
    written = []
    leaks = _leaks(conn, survey, km)
    for kind in KINDS:
        blocks = _blocks(conn, survey, km, kind)
        if not blocks:
            continue
        stem = f"{survey.name}-km{km:03d}-{kind}"
        extent = _extent(conn, survey, km, kind, blocks)
        tiff, png = folder / f"{stem}.tif", folder / f"{stem}.png"
        with replacing(tiff) as temporary:
            strips = _write_cog(conn, survey, km, kind, blocks, extent, temporary)
        pixel = extent.transform.a * preview_factor(extent.transform.a)
        title = f"{survey.name}  km {km}  {_TITLES[kind]}"
        with replacing(png) as temporary:
            outlines = leaks if kind == "corrected" else []
            preview.draw(temporary, title, kind, strips, extent.transform.f, pixel, outlines)
        written += [tiff, png]
    return written


_TITLES = {"raw": "raw intensity", "corrected": "corrected intensity", "offset": "offset from the section surface"}


def preview_factor(pixel: float) -> int:
    """How many pixels of the image make one of the preview."""
    factor = max(1, round(preview.PIXEL / pixel))
    # A strip must be a whole number of pixels.
    while abs(preview.STRIP / (pixel * factor) - round(preview.STRIP / (pixel * factor))) > 1e-6:
        factor -= 1
    return factor


def _blocks(conn: psycopg.Connection, survey: Survey, km: int, kind: str) -> list[int]:
    rows = conn.execute(
        "SELECT block FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind = %s ORDER BY block",
        (survey.id, km, kind),
    )
    return [block for (block,) in rows]


def _read(conn: psycopg.Connection, survey: Survey, km: int, kind: str, block: int) -> Raster:
    row = conn.execute(
        "SELECT tiff FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind = %s AND block = %s",
        (survey.id, km, kind, block),
        binary=True,
    ).fetchone()
    assert row is not None
    return decode(row[0])


def _extent(conn: psycopg.Connection, survey: Survey, km: int, kind: str, blocks: Sequence[int]) -> Extent:
    first = _read(conn, survey, km, kind, blocks[0])
    rows, columns = first.values.shape
    return Extent(first.transform, rows, columns * (blocks[-1] - blocks[0] + 1))


def _write_cog(
    conn: psycopg.Connection, survey: Survey, km: int, kind: str, blocks: Sequence[int], extent: Extent, path: Path
) -> list[preview.Strip]:
    """Write the blocks side by side as a Cloud Optimized GeoTIFF; return the strips of the preview."""
    plain = path.with_name(f"plain-{path.name}")
    factor = preview_factor(extent.transform.a)
    shrunk = []
    with write_tiff(str(plain), (extent.rows, extent.columns), extent.transform) as image:
        image.units = (UNIT[kind],)
        image.set_band_description(1, kind)
        for block in blocks:
            raster = _read(conn, survey, km, kind, block)
            width = raster.values.shape[1]
            column = (block - blocks[0]) * width
            image.write(raster.values, 1, window=Window(column, 0, width, extent.rows))
            shrunk.append((raster.transform.c, preview.shrink(raster.values, factor)))
        for gap in sorted(set(range(blocks[0], blocks[-1])) - set(blocks)):
            empty = np.full((extent.rows, width), np.nan, np.float32)
            image.write(empty, 1, window=Window((gap - blocks[0]) * width, 0, width, extent.rows))
    rasterio.shutil.copy(
        str(plain),
        str(path),
        driver="COG",
        compress="DEFLATE",
        predictor="YES",
        overview_resampling="AVERAGE",
        bigtiff="IF_SAFER",
    )
    plain.unlink()
    return list(_strips(shrunk, extent.transform.a * factor))


def _strips(blocks: list[tuple[float, preview.Single]], pixel: float) -> Iterator[preview.Strip]:
    """Lay the blocks' previews into strips of a hectometre."""
    width = round(preview.STRIP / pixel)
    by_start: dict[float, preview.Single] = {}
    for west, values in blocks:
        start = np.floor(west / preview.STRIP + 1e-9) * preview.STRIP
        strip = by_start.setdefault(start, np.full((values.shape[0], width), np.nan, np.float32))
        column = round((west - start) / pixel)
        strip[:, column : column + values.shape[1]] = values[:, : width - column]
    for start in sorted(by_start):
        yield preview.Strip(float(start), by_start[start])


def _leaks(conn: psycopg.Connection, survey: Survey, km: int) -> list[Polygon]:
    rows = conn.execute(
        "SELECT public.ST_AsBinary(unrolled) FROM tunnel.leak"
        " WHERE survey_id = %s AND chainage_to > %s AND chainage_from < %s AND detected AND review <> 'rejected' ORDER BY id",
        (survey.id, km * 1000.0, (km + 1) * 1000.0),
    )
    return [shapely.from_wkb(bytes(wkb)) for (wkb,) in rows]
