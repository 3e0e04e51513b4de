"""Image blocks as GeoTIFF bytes in the unrolled plane: x is the chainage, y the arc, m; no coordinate system."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from affine import Affine
from rasterio.errors import NotGeoreferencedWarning, RasterioIOError
from rasterio.io import MemoryFile

from tunneldb.arrays import Float, Int16, Single, UInt8
from tunneldb.compiled import kernel
from tunneldb.errors import UserError

IMPORTED = "imported_"
"""Beginning of the kinds of images of other instruments; their names follow."""

OVERVIEW = "overview_"
"""Beginning of the kinds of overviews."""

KINDS = ("raw", "corrected", "offset")
"""Kinds of the images of a kilometre: raw and corrected intensity (dB), offset from the surface (m)."""

DEVIATION_KINDS = {
    "lining": "deviation_lining",
    "shotcrete": "deviation_shotcrete",
    "excavation": "deviation_excavation",
}
"""Images of the deviation (m) from the design profiles of each layer, if computed."""

CHANGE = "change"
"""Image of the change (m) since an older survey, positive inwards, if two surveys were compared."""

RGB = "rgb"
"""Image in colour, red, green and blue from 0 to 255, if the points have colours."""

STEP = {
    "raw": 0.01, "corrected": 0.01, "offset": 0.001, "state": 1.0, CHANGE: 1e-4, "lod": 1e-4,
    **dict.fromkeys(DEVIATION_KINDS.values(), 0.001),
}  # fmt: skip
"""Size of one stored step: dB, dB, m; of the state of pixels itself, m."""

UNIT = {
    "raw": "dB", "corrected": "dB", "offset": "m", "state": "", RGB: "", CHANGE: "m", "lod": "m",
    **dict.fromkeys(DEVIATION_KINDS.values(), "m"),
}  # fmt: skip

NODATA = -32768


@dataclass(frozen=True)
class Raster:
    """Values of an image, NaN without a point, and their position.

    Attributes
    ----------
    values : (rows, columns) float32 array
        dB or m. Of an image in colour: (rows, columns, 3), 0 to 255.
    transform : Affine
        From (column, row) to (chainage, arc), m.
    """

    values: Single
    transform: Affine

    def places(self) -> tuple[Float, Float]:
        """Return the chainage of the columns and the arc of the rows, middles, m."""
        rows, columns = self.values.shape[:2]
        place = self.transform
        chainage = np.asarray(place.c + (np.arange(columns) + 0.5) * place.a, dtype=np.float64)
        return chainage, np.asarray(place.f + (np.arange(rows) + 0.5) * place.e, dtype=np.float64)


def whole(values: Single, kind: str) -> Int16:
    """Convert values (rows, columns) to steps of :data:`STEP`, NODATA for NaN."""
    return _steps(values, STEP[kind])


def _steps(values: Single, step: float) -> Int16:
    steps = np.empty(values.shape, np.int16)
    _whole(np.ascontiguousarray(values), 1.0 / step, steps)
    return steps


def encode(raster: Raster, kind: str) -> bytes:
    """Write an image of a kind as a GeoTIFF, by its step and unit; an image in colour in 8 bits."""
    return _encode_colours(raster) if kind == RGB else _encode_values(raster, kind, STEP[kind], UNIT[kind])


def encode_imported(raster: Raster, name: str, step: float, unit: str) -> bytes:
    """Write an imported image as a GeoTIFF, by its step and unit; an image in colour in 8 bits."""
    return _encode_colours(raster) if raster.values.ndim == 3 else _encode_values(raster, name, step, unit)


def _encode_values(raster: Raster, name: str, step: float, unit: str) -> bytes:
    """Write an image as a GeoTIFF of 16-bit whole numbers, with its scale, unit and nodata value.

    The lowest bits are measured noise: fast compression is as good as slow, and differences of neighbours help.
    """
    rows, columns = raster.values.shape
    profile: dict[str, Any] = {
        "driver": "GTiff",
        "height": rows,
        "width": columns,
        "count": 1,
        "dtype": "int16",
        "nodata": NODATA,
        "transform": raster.transform,
        "compress": "zstd",
        "zstd_level": 1,
        "tiled": True,
        "blockxsize": 256,
        "blockysize": 256,
    }
    with MemoryFile() as memory:
        with memory.open(**profile) as image:
            image.write(_steps(raster.values, step), 1)
            image.scales, image.units = (step,), (unit,)
            image.set_band_description(1, name)
        return bytes(memory.read())


def _encode_colours(raster: Raster) -> bytes:
    """Write an image in colour as a GeoTIFF of three bands, black without a colour."""
    rows, columns, bands = raster.values.shape
    profile: dict[str, Any] = {
        "driver": "GTiff",
        "height": rows,
        "width": columns,
        "count": bands,
        "dtype": "uint8",
        "transform": raster.transform,
        "photometric": "RGB",
        "compress": "zstd",
        "zstd_level": 1,
        "predictor": 2,
        "interleave": "pixel",
        "tiled": True,
        "blockxsize": 256,
        "blockysize": 256,
    }
    with MemoryFile() as memory:
        with memory.open(**profile) as image:
            image.write(whole_colours(raster.values))
        return bytes(memory.read())


def whole_colours(values: Single) -> UInt8:
    """Convert colours (rows, columns, 3) to 8 bits (3, rows, columns): black for NaN, the darkest blue for a measured black."""
    rows, columns, bands = values.shape
    whole: UInt8 = np.empty((bands, rows, columns), np.uint8)
    _whole_colours(np.ascontiguousarray(values), whole)
    return whole


def decode(tiff: bytes, kind: str = "") -> Raster:
    """Read an image that :func:`encode` wrote.

    An image in colour is read only if its kind, or that of its overview, is given. An imported image may have colours.

    Bytes of other origin, for example from an archive, are read as GeoTIFF only: a VRT could make GDAL read other files.

    Raises
    ------
    UserError
        If it is not a GeoTIFF, or has other bands than its kind.
    """
    with warnings.catch_warnings(), _told():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with MemoryFile(tiff) as memory, memory.open(driver="GTiff") as image:
            if image.count not in _bands(kind):
                raise UserError(f"an image in the database has {image.count} bands; run stage detect again")
            if image.count == 3:
                bands = np.moveaxis(image.read((1, 2, 3)), 0, 2)
                return Raster(np.where(bands.any(axis=2, keepdims=True), bands, np.float32(np.nan)), image.transform)
            steps = image.read(1)
            values = np.empty(steps.shape, np.float32)
            np.multiply(steps, image.scales[0], out=values, casting="same_kind")  # no array of doubles
            values[steps == image.nodata] = np.nan
            return Raster(values, image.transform)


def _bands(kind: str) -> tuple[int, ...]:
    """Return the numbers of bands that an image of a kind, or its overview, may have."""
    kind = kind.removeprefix(OVERVIEW)
    return (1, 3) if kind.startswith(IMPORTED) else (3,) if kind == RGB else (1,)


@contextmanager
def _told() -> Iterator[None]:
    try:
        yield
    except RasterioIOError as error:
        raise UserError(f"an image in the database is not a GeoTIFF; run stage detect again: {error}") from error


def laid(raster: Raster, like: Raster) -> Single:
    """Return the values of a block in the rows of another one with the same pixels."""
    down = round((like.transform.f - raster.transform.f) / like.transform.a)
    values = np.full((len(like.values), *raster.values.shape[1:]), np.nan, np.float32)
    rows = slice(max(down, 0), min(down + len(raster.values), len(values)))
    values[rows] = raster.values[rows.start - down : rows.stop - down]
    return values


@kernel
def _whole_colours(values: Single, whole: UInt8) -> None:  # pragma: no cover - compiled
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            present = not np.isnan(values[i, j, 0])
            black = True
            for band in range(3):
                value = np.uint8(np.rint(values[i, j, band])) if present else np.uint8(0)
                whole[band, i, j] = value
                black = black and value == 0
            if present and black:
                whole[2, i, j] = 1


@kernel
def _whole(values: Single, per_step: float, steps: Int16) -> None:  # pragma: no cover - compiled
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            step = np.rint(values[i, j] * per_step)
            if step > 32767.0:
                step = 32767.0
            elif not step > NODATA:  # also if it is NaN
                step = NODATA + 1.0 if step <= NODATA else float(NODATA)
            steps[i, j] = np.int16(step)


def imported_label(name: str, kind: str) -> str:
    """Return the title of an imported image: of its kind, with its name if that is another."""
    return f"Imported: {kind}" if name == kind else f"Imported: {kind}, {name}"
