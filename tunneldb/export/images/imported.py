"""Images of other instruments as Cloud Optimized GeoTIFFs, one a kilometre."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.arrays import Single
from tunneldb.export.images.cog import Extent, write_cog, write_colour_cog
from tunneldb.export.images.tile_png import opaque
from tunneldb.files import replacing
from tunneldb.store.images import image_blocks, load_kinds
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
    kinds = image.image_kinds
    blocks = image_blocks(conn, survey, km, kinds[0])
    if not blocks:
        return None
    first = load_kinds(conn, survey, km, blocks[0], kinds)[kinds[0]]
    rows, width = first.values.shape
    extent = Extent(first.transform, rows, width * (blocks[-1] - blocks[0] + 1))

    def bands() -> Iterator[tuple[int, list[Single]]]:
        for block in blocks:
            found = load_kinds(conn, survey, km, block, kinds)
            yield (block - blocks[0]) * width, [found[kind].values for kind in kinds]

    path = folder / f"{survey.name}-km{km:03d}-imported-{image.name}.tif"
    with replacing(path) as temporary:
        if image.colour:
            write_colour_cog(temporary, extent, ((column, opaque(values)) for column, values in bands()), image_tags(image))
        else:
            values = ((column, values[0]) for column, values in bands())
            write_cog(temporary, image.kind, extent, values, image.name, image.unit, image_tags(image))
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
