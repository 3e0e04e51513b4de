"""Images of the unrolled lining: Cloud Optimized GeoTIFFs and previews, of each kind one a kilometre."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from affine import Affine
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.arrays import Single
from tunneldb.database import snapshot
from tunneldb.export.images import preview
from tunneldb.export.images.class_raster import ClassPainter
from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.export.images.imported import export_imported
from tunneldb.export.images.palette import PALETTES
from tunneldb.export.images.tile_png import opaque
from tunneldb.export.images.underwater import export_bed, export_submerged
from tunneldb.files import replacing
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.raster.gap_fill import FILL_NOTE, MAX_FILL_DISTANCE, fill_blocks
from tunneldb.raster.geotiff import DEVIATION_KINDS, KINDS, RGB, laid
from tunneldb.raster.grid import BLOCK
from tunneldb.raster.overview import shrink, shrink_codes
from tunneldb.store.alignment import load_stationing
from tunneldb.store.images import image_blocks, load_block
from tunneldb.store.survey import Survey


def image_kilometres(conn: psycopg.Connection, survey: Survey) -> list[int]:
    """Return the kilometres of a survey that have images."""
    rows = conn.execute("SELECT DISTINCT km FROM tunnel.image WHERE survey_id = %s ORDER BY km", (survey.id,))
    return [km for (km,) in rows]


def export_kilometre(conn: psycopg.Connection, survey: Survey, km: int, folder: Path) -> list[Path]:
    """Write the images of a kilometre: ``SURVEY-kmNNN-KIND.tif`` and ``.png`` for each kind that it has.

    All are of one moment; the connection must be idle.

    The GeoTIFFs have dB or m as single-precision numbers, NaN without a point; or the state of a pixel; or the code of a class,
    0 without a point; or red, green, blue and opacity, if points have colours. x is the chainage and y the arc, m. Each file
    appears when complete. Classes exist if stage ground has run: they are computed from the offset image and the results of
    that stage. Deviation is written for each layer that the survey was compared with. If sonar scans were loaded, the bed and
    their unrolled points are written too. Imported images are written as ``SURVEY-kmNNN-imported-NAME.tif``.

    Returns
    -------
    list of Path
        Files written.
    """
    with snapshot(conn):
        written = [
            path
            for kind in (*KINDS, RGB, *DEVIATION_KINDS.values(), *PALETTES)
            for path in _export_kind(conn, survey, km, kind, folder)
        ]
        below = (export(conn, survey, km, folder) for export in (export_submerged, export_bed))
        return [*written, *(path for path in below if path is not None), *export_imported(conn, survey, km, folder)]


def export_filled(conn: psycopg.Connection, survey: Survey, km: int, folder: Path) -> list[Path]:
    """Write the images of a kilometre with filled gaps, ``SURVEY-kmNNN-KIND-filled.tif``, and return their paths.

    The kinds are corrected intensity, or the offset without intensity, colour, and deviation. Their pixels are those of a
    preview: they are only for display, below the measured image. Name and metadata of the band state this. A profile beyond the
    end of the kilometre fills too. The connection must be idle.
    """
    with snapshot(conn):
        seen = "corrected" if image_blocks(conn, survey, km, "corrected") else "offset"
        written = [_export_filled(conn, survey, km, kind, folder) for kind in (seen, RGB, *DEVIATION_KINDS.values())]
    return [path for path in written if path is not None]


def _export_filled(conn: psycopg.Connection, survey: Survey, km: int, kind: str, folder: Path) -> Path | None:
    """Write an image with filled gaps; return None if there is none."""
    blocks = image_blocks(conn, survey, km, kind)
    if not blocks:
        return None
    first = load_block(conn, survey, km, kind, blocks[0])
    factor = preview_factor(first.transform.a)
    rows, columns = (-(-n // factor) for n in first.values.shape[:2])
    extent = Extent(first.transform @ Affine.scale(factor), rows, columns * (blocks[-1] - blocks[0] + 1))
    around = [
        *_beside(conn, survey, kind, blocks[0] - 1),
        *((km, block) for block in blocks),
        *_beside(conn, survey, kind, blocks[-1] + 1),
    ]

    def shrunk() -> Iterator[tuple[int, Single]]:
        for other, block in around:
            raster = load_block(conn, survey, other, kind, block)
            if raster.transform.a == first.transform.a:
                pixels = raster.values if other == km else laid(raster, first)
                yield (block - blocks[0]) * columns, shrink(pixels, factor)

    path = folder / f"{survey.name}-km{km:03d}-{kind}-filled.tif"
    filled = fill_blocks(shrunk(), MAX_FILL_DISTANCE / extent.transform.a)
    colour = kind == RGB
    blocks_of = ((at, opaque(values) if colour else values) for at, values in filled if 0 <= at < extent.columns)
    with replacing(path) as temporary:
        write_cog(temporary, kind, extent, blocks_of, f"{kind}, {FILL_NOTE}", colour=colour)
    return path


def _beside(conn: psycopg.Connection, survey: Survey, kind: str, block: int) -> list[tuple[int, int]]:
    """Return kilometre and number of a block of a kind, if there is one."""
    query = "SELECT km, block FROM tunnel.image WHERE survey_id = %s AND kind = %s AND block = %s"
    return conn.execute(query, (survey.id, kind, block)).fetchall()


def _export_kind(conn: psycopg.Connection, survey: Survey, km: int, kind: str, folder: Path) -> list[Path]:
    """Write the image of one kind and its preview, if there are any; returns their paths."""
    stored = "offset" if kind == "class" else kind
    blocks = image_blocks(conn, survey, km, stored)
    painter = ClassPainter.load(conn, survey, km) if kind == "class" and blocks else None
    if not blocks or (kind == "class" and painter is None):
        return []
    first = load_block(conn, survey, km, stored, blocks[0])
    rows, width = first.values.shape[:2]
    extent = Extent(first.transform, rows, width * (blocks[-1] - blocks[0] + 1))
    stem = f"{survey.name}-km{km:03d}-{kind}"
    tiff, png = folder / f"{stem}.tif", folder / f"{stem}.png"
    sheet = _Sheet(extent.transform.a)
    with replacing(tiff) as temporary:
        write_cog(temporary, kind, extent, _pixels(conn, survey, km, stored, blocks, painter, sheet), colour=kind == RGB)
    leaks = _leaks(conn, survey, km) if kind == "corrected" else []
    with replacing(png) as temporary:
        title = f"{survey.name}  km {km}  {_TITLES[kind]}"
        stationing = load_stationing(conn, survey.tunnel_id)
        preview.draw(temporary, title, kind, list(sheet.strips()), stationing, extent.transform.f, sheet.pixel, leaks)
    return [tiff, png]


_TITLES = {
    "raw": "raw intensity",
    "corrected": "corrected intensity",
    "offset": "offset from the section surface",
    **{kind: f"deviation from the design of layer {layer}" for layer, kind in DEVIATION_KINDS.items()},
    RGB: "colour",
    "state": "states",
    "class": "classes",
}


class _Sheet:
    """Preview made from the blocks that pass through it.

    Parameters
    ----------
    pixel : float
        Side of the image's pixels, m.
    """

    def __init__(self, pixel: float) -> None:
        self._factor = preview_factor(pixel)
        self.pixel = pixel * self._factor
        self._blocks: list[tuple[float, Single]] = []

    def note(self, west: float, pixels: NDArray[Any]) -> None:
        """Add a block that begins at a chainage, m."""
        smaller: Callable[[NDArray[Any], int], Single] = shrink_codes if pixels.dtype == np.uint8 else shrink
        self._blocks.append((west, smaller(pixels, self._factor)))

    def strips(self) -> Iterator[preview.Strip]:
        """Place the blocks in strips of 100 m."""
        width = round(preview.STRIP / self.pixel)
        by_start: dict[float, Single] = {}
        for west, values in self._blocks:
            start = np.floor(west / preview.STRIP + 1e-9) * preview.STRIP
            strip = by_start.setdefault(start, np.full((values.shape[0], width, *values.shape[2:]), np.nan, np.float32))
            column = round((west - start) / self.pixel)
            strip[:, column : column + values.shape[1]] = values[:, : width - column]
        for start in sorted(by_start):
            yield preview.Strip(float(start), by_start[start])


def _pixels(
    conn: psycopg.Connection,
    survey: Survey,
    km: int,
    kind: str,
    blocks: Sequence[int],
    painter: ClassPainter | None,
    sheet: _Sheet,
) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield first column and pixels of each stored block, as 8-bit codes, classes or colours, and add them to the preview."""
    for block in blocks:
        raster = load_block(conn, survey, km, kind, block)
        pixels: NDArray[Any] = raster.values if painter is None else painter.paint(raster)
        if kind in PALETTES:
            pixels = pixels.astype(np.uint8, copy=False)
        sheet.note(raster.transform.c, pixels)
        if kind == RGB:
            pixels = opaque(raster.values)
        yield (block - blocks[0]) * pixels.shape[1], pixels


def preview_factor(pixel: float) -> int:
    """Return the number of image pixels per preview pixel."""
    factor = max(1, round(preview.PIXEL / pixel))
    # A block must be a whole number of pixels.
    while abs(BLOCK / (pixel * factor) - round(BLOCK / (pixel * factor))) > 1e-6:
        factor -= 1
    return factor


def _leaks(conn: psycopg.Connection, survey: Survey, km: int) -> list[tuple[Polygon, str]]:
    rows = conn.execute(
        "SELECT public.ST_AsBinary(unrolled), review FROM tunnel.finding"
        " WHERE survey_id = %s AND chainage_to > %s AND chainage_from < %s AND detected AND review <> 'rejected'"
        " AND wet AND NOT superseded ORDER BY id",
        (survey.id, km * KILOMETRE, (km + 1) * KILOMETRE),
    )
    return [(shapely.from_wkb(bytes(wkb)), review) for wkb, review in rows]
