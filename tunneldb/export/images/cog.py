"""Blocks of an unrolled image, side by side in a Cloud Optimized GeoTIFF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import rasterio.shutil
from affine import Affine
from numpy.typing import NDArray
from rasterio.windows import Window

from tunneldb.export.images.palette import PALETTES
from tunneldb.pointcloud.points import COLOURS
from tunneldb.raster.geotiff import UNIT


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


def write_cog(
    path: Path,
    kind: str,
    extent: Extent,
    blocks: Iterable[tuple[int, NDArray[Any]]],
    name: str = "",
    *,
    colour: bool = False,
    unit: str | None = None,
    tags: Mapping[str, str] | None = None,
) -> None:
    """Write an image; places without a block are empty (GDAL fills them with the nodata value).

    Parameters
    ----------
    path : Path
        File to write.
    kind : str
        Values are written in single precision, NaN for nothing; classes and states in 8 bits with a colour table; colours in
        8 bits with opacity.
    extent : Extent
        Place and size of the image.
    blocks : iterable of (int, (rows, columns) array)
        First column and pixels of each block; (rows, columns, 4) for colours.
    name : str
        Name of the band, if not its kind; added to those of colours.
    colour : bool
        True if the blocks are colours.
    unit : str, optional
        Unit of the values, if the kind is not one of the survey's own images.
    tags : mapping of str to str, optional
        Metadata of the file.
    """
    plain = path.with_name(f"plain-{path.name}")
    palette = PALETTES.get(kind)
    if colour:
        nodata, bands, options = None, 4, {"photometric": "RGB", "alpha": "YES", "interleave": "pixel"}
    else:
        nodata, bands, options = palette.nodata if palette else np.nan, 1, {}
    with rasterio.open(
        plain, "w", driver="GTiff", height=extent.rows, width=extent.columns, count=bands, transform=extent.transform,
        dtype="uint8" if palette or colour else "float32", nodata=nodata,
        tiled=True, blockxsize=256, blockysize=256, bigtiff="if_safer", **options,
    ) as image:  # fmt: skip
        if colour:
            for band, what in enumerate((*COLOURS, "opacity"), start=1):
                image.set_band_description(band, f"{what}, {name}" if name else what)
        else:
            image.set_band_description(1, name or kind)
        if palette:
            image.write_colormap(1, {code: (*colour, 255) for code, (_, colour) in palette.entries.items()})
            image.update_tags(1, **{f"{kind.upper()}_{code}": name for code, (name, _) in palette.entries.items()})
        elif not colour:
            image.units = (UNIT[kind] if unit is None else unit,)
        image.update_tags(**(tags or {}))
        for column, pixels in blocks:
            bands_of = np.moveaxis(np.atleast_3d(pixels), 2, 0)
            image.write(bands_of, window=Window(column, 0, pixels.shape[1], extent.rows))
    rasterio.shutil.copy(
        str(plain), str(path), driver="COG", compress="DEFLATE", predictor="NO" if palette else "YES",
        overview_resampling="MODE" if palette else "AVERAGE", bigtiff="IF_SAFER",
    )  # fmt: skip
    plain.unlink()
