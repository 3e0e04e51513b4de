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

from tunneldb.arrays import Float, Int16, Single
from tunneldb.compiled import kernel
from tunneldb.errors import UserError

IMPORTED = "imported_"
"""Beginning of the kinds of images of other instruments; their names follow."""

COLOURS = ("red", "green", "blue")
"""Bands of an imported colour image; each is an image of kind imported_NAME:BAND."""

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

STEP = {
    "raw": 0.01, "corrected": 0.01, "offset": 0.001, "state": 1.0, CHANGE: 1e-4, "lod": 1e-4,
    **dict.fromkeys(DEVIATION_KINDS.values(), 0.001),
}  # fmt: skip
"""Size of one stored step: dB, dB, m; of the state of pixels itself, m."""

UNIT = {
    "raw": "dB", "corrected": "dB", "offset": "m", "state": "", CHANGE: "m", "lod": "m",
    **dict.fromkeys(DEVIATION_KINDS.values(), "m"),
}  # fmt: skip

NODATA = -32768


@dataclass(frozen=True)
class Raster:
    """Values of an image, NaN without a point, and their position.

    Attributes
    ----------
    values : (rows, columns) float32 array
        dB or m.
    transform : Affine
        From (column, row) to (chainage, arc), m.
    """

    values: Single
    transform: Affine

    def places(self) -> tuple[Float, Float]:
        """Return the chainage of the columns and the arc of the rows, middles, m."""
        rows, columns = self.values.shape
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
    """Write an image of a kind as a GeoTIFF, by its step and unit."""
    return encode_values(raster, kind, STEP[kind], UNIT[kind])


def encode_values(raster: Raster, name: str, step: float, unit: str) -> bytes:
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


def decode(tiff: bytes) -> Raster:
    """Read an image that :func:`encode` wrote.

    Bytes of other origin, for example from an archive, are read as GeoTIFF only: a VRT could make GDAL read other files.

    Raises
    ------
    UserError
        If it is not a GeoTIFF.
    """
    with warnings.catch_warnings(), _told():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with MemoryFile(tiff) as memory, memory.open(driver="GTiff") as image:
            steps = image.read(1)
            values = np.empty(steps.shape, np.float32)
            np.multiply(steps, image.scales[0], out=values, casting="same_kind")  # no array of doubles
            values[steps == image.nodata] = np.nan
            return Raster(values, image.transform)


@contextmanager
def _told() -> Iterator[None]:
    try:
        yield
    except RasterioIOError as error:
        raise UserError(f"an image in the database is not a GeoTIFF; run stage detect again: {error}") from error


def laid(raster: Raster, like: Raster) -> Single:
    """Return the values of a block in the rows of another one with the same pixels."""
    down = round((like.transform.f - raster.transform.f) / like.transform.a)
    values = np.full((len(like.values), raster.values.shape[1]), np.nan, np.float32)
    rows = slice(max(down, 0), min(down + len(raster.values), len(values)))
    values[rows] = raster.values[rows.start - down : rows.stop - down]
    return values


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


def imported_kinds(name: str, colour: bool) -> tuple[str, ...]:
    """Return the kinds of the images of an imported image: one, or one for each colour."""
    return tuple(f"{IMPORTED}{name}:{band}" for band in COLOURS) if colour else (f"{IMPORTED}{name}",)


def imported_label(name: str, kind: str) -> str:
    """Return the title of an imported image: of its kind, with its name if that is another."""
    return f"Imported: {kind}" if name == kind else f"Imported: {kind}, {name}"
