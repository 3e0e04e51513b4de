"""Images of other instruments as Cloud Optimized GeoTIFFs, one a kilometre."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psycopg
from numpy.typing import NDArray

from tunneldb.export.images.cog import Extent, write_cog
from tunneldb.export.images.tile_png import opaque
from tunneldb.files import replacing
from tunneldb.store.images import image_blocks, load_block
from tunneldb.store.imported_images import StoredImage, read_imported
from tunneldb.store.survey import Survey


def export_imported(conn: psycopg.Connection[Any], survey: Survey, km: int, folder: Path) -> list[Path]:
    """Write the imported images of a kilometre, ``SURVEY-kmNNN-imported-NAME.tif``, and return their paths.

    Values are single-precision numbers in the unit of the image, NaN without a value; colours are in 8 bits with opacity. The
    tags of the file have kind, unit, range of the values, source file, and the accuracy of the placement.
    """
    written = (_export(conn, survey, km, image, folder) for image in read_imported(conn, survey))
    return [path for path in written if path is not None]


def _export(conn: psycopg.Connection[Any], survey: Survey, km: int, image: StoredImage, folder: Path) -> Path | None:
    kind = image.image_kind
    blocks = image_blocks(conn, survey, km, kind)
    if not blocks:
        return None
    first = load_block(conn, survey, km, kind, blocks[0])
    rows, width = first.values.shape[:2]
    extent = Extent(first.transform, rows, width * (blocks[-1] - blocks[0] + 1))

    def pixels() -> Iterator[tuple[int, NDArray[Any]]]:
        for block in blocks:
            values = load_block(conn, survey, km, kind, block).values
            yield (block - blocks[0]) * width, opaque(values) if image.colour else values

    path = folder / f"{survey.name}-km{km:03d}-imported-{image.name}.tif"
    with replacing(path) as temporary:
        write_cog(
            temporary, image.kind, extent, pixels(), image.name, colour=image.colour, unit=image.unit, tags=image_tags(image)
        )
    return path


def image_tags(image: StoredImage) -> dict[str, str]:
    """Return the metadata of an imported image, for files."""
    tags = {
        "TUNNELDB_KIND": image.kind,
        "TUNNELDB_NAME": image.name,
        "TUNNELDB_UNIT": image.unit,
        "TUNNELDB_VALUES": f"{image.value_from:g} {image.value_to:g}",
        "TUNNELDB_SOURCE": image.source,
        "TUNNELDB_PLACEMENT": image.placement,
    }
    if image.residual is not None:
        tags["TUNNELDB_RESIDUAL"] = f"{image.residual:.4f} m"
    return tags
