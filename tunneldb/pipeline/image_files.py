"""Image files of other instruments: pixels, own coordinates, control points, and tables of frames."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import rasterio
from affine import Affine
from pyproj import CRS
from pyproj.exceptions import CRSError
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.windows import Window

from tunneldb.arrays import Float, Single
from tunneldb.csvfile import find_column, read_csv, read_header, read_texts, row_lines
from tunneldb.errors import InputError
from tunneldb.files import gdal_fault, require_regular
from tunneldb.geometry.crs import is_local
from tunneldb.pipeline.findings import read_chainage
from tunneldb.raster.overview import shrink
from tunneldb.raster.placement.mapping import AffineMapping
from tunneldb.raster.placement.resample import Frame
from tunneldb.store.survey import Survey
from tunneldb.threads import threads

DRIVERS = {
    b"II*\0": "GTiff",
    b"MM\0*": "GTiff",
    b"II+\0": "GTiff",
    b"MM\0+": "GTiff",
    b"\x89PNG": "PNG",
    b"\xff\xd8\xff": "JPEG",
}
"""Formats of images by their first bytes; others, such as VRT, could make GDAL read other files."""

COLOUR_SCALES = {"uint8": 1.0, "uint16": 1.0 / 257.0}
"""Factors that bring colours to 0 to 255, by the type of the file's numbers."""

MAX_POINTS = 2000
"""Maximum number of control points."""

_PART = 1 << 24  # pixels that are read at once


@dataclass(frozen=True)
class ImageFile:
    """Image file whose pixels are read when they are needed.

    Attributes
    ----------
    path : Path
    columns, rows : int
        Size.
    indices : tuple of int
        Bands that are read, from 1: one, or red, green and blue.
    transform : Affine or None
        From (column, row) to (chainage, arc), m, by the file's own coordinates.
    ground : list of (column, row, chainage, arc)
        Control points that the file has itself.
    unit : str
        Unit that it states, or empty.
    scale, offset : float
        Value of a stored number n: scale n + offset.
    """

    path: Path
    columns: int
    rows: int
    indices: tuple[int, ...]
    transform: Affine | None
    ground: tuple[tuple[float, float, float, float], ...]
    unit: str
    scale: float
    offset: float

    @property
    def bands(self) -> int:
        """Number of bands."""
        return len(self.indices)

    def read(self, columns: slice, rows: slice, factor: int) -> Single:
        """Return pixels (bands, rows, columns), averaged over ``factor`` × ``factor``, NaN without a value."""
        count = rows.stop - rows.start
        height = count if factor == 1 else max(1, _PART // (columns.stop - columns.start) // factor) * factor
        indices, parts = list(self.indices), []
        with _opened(self.path) as image:
            masked = any(MaskFlags.all_valid not in image.mask_flag_enums[index - 1] for index in indices)
            for start in range(rows.start, rows.stop, height):
                window = Window(columns.start, start, columns.stop - columns.start, min(height, rows.stop - start))
                found: Single = image.read(indices, window=window, out_dtype="float32")
                if masked:
                    found[image.read_masks(indices, window=window) == 0] = np.nan
                if (self.scale, self.offset) != (1.0, 0.0):
                    found *= np.float32(self.scale)
                    found += np.float32(self.offset)
                parts.append(np.stack([shrink(band, factor) for band in found]) if factor > 1 else found)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def value_range(self) -> tuple[float, float]:
        """Return the least and the greatest value; infinite if it has none."""
        low, high = np.inf, -np.inf
        step = max(1, _PART // self.columns)
        for start in range(0, self.rows, step):
            values = self.read(slice(0, self.columns), slice(start, min(start + step, self.rows)), 1)
            finite = np.isfinite(values)
            low = min(low, float(values.min(where=finite, initial=np.inf)))
            high = max(high, float(values.max(where=finite, initial=-np.inf)))
        return low, high


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        with path.open("rb") as file:
            head = file.read(4)
        driver = next((driver for mark, driver in DRIVERS.items() if head.startswith(mark)), None)
        if driver is None:
            raise InputError(f"{path} is no GeoTIFF, PNG or JPEG; save it as GeoTIFF")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            options = {"num_threads": threads()} if driver == "GTiff" else {}
            with rasterio.open(path, driver=driver, **options) as image:
                yield image
    except RasterioError as error:
        raise InputError(f"{path}: cannot be read as {driver}: {gdal_fault(error.__cause__ or error)}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def open_image(path: Path, band: int | None = None, scale: float | None = None, offset: float | None = None) -> ImageFile:
    """Open an image file.

    Parameters
    ----------
    path : Path
    band : int, optional
        Band to read, from 1; by default the only one, or the colours.
    scale, offset : float, optional
        In place of those that the file states; colours have none.

    Raises
    ------
    InputError
        If it cannot be read, has several bands without meaning, or is in a coordinate system of a map.
    """
    require_regular(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    with _opened(path) as image:
        indices = _bands(path, image, band)
        if any(np.issubdtype(np.dtype(image.dtypes[index - 1]), np.complexfloating) for index in indices):
            raise InputError(f"{path}: its values are complex numbers; save their amplitude")
        first = indices[0] - 1
        if image.crs and not _is_plane(image.crs):
            raise InputError(
                f"{path} has the coordinate system {_crs_name(image.crs)}; images are placed by chainage and arc, without a"
                " coordinate system: give control points (--points)"
            )
        own = image.transform if image.transform != Affine.identity() else None
        points, _ = image.gcps
        if len(indices) > 1:
            scale, offset = _colour_scale(path, image.dtypes[first]), 0.0
        return ImageFile(
            path, image.width, image.height, indices, own, tuple((p.col, p.row, p.x, p.y) for p in points),
            image.units[first] or "", image.scales[first] if scale is None else scale,
            image.offsets[first] if offset is None else offset,
        )  # fmt: skip


def _colour_scale(path: Path, dtype: str) -> float:
    """Return the factor that brings colours to 0 to 255."""
    if dtype not in COLOUR_SCALES:
        raise InputError(f"{path}: its colours have the type {dtype}; save them with 8 or 16 bits, or choose a band by --band")
    return COLOUR_SCALES[dtype]


def _bands(path: Path, image: Any, band: int | None) -> tuple[int, ...]:
    """Return the bands that are read."""
    if band is not None:
        if band > image.count:
            raise InputError(f"{path}: --band {band}: it has {image.count}")
        return (band,)
    meaning = image.colorinterp
    if ColorInterp.palette in meaning:
        raise InputError(f"{path} has a colour table instead of values; save it with red, green and blue, or with values")
    shown = [index for index, what in enumerate(meaning, start=1) if what != ColorInterp.alpha]
    if len(shown) == 1:
        return (shown[0],)
    colours = (ColorInterp.red, ColorInterp.green, ColorInterp.blue)
    if all(colour in meaning for colour in colours) and len(shown) == 3:
        return tuple(meaning.index(colour) + 1 for colour in colours)
    raise InputError(f"{path} has {image.count} bands; choose one by --band")


def _is_plane(crs: Any) -> bool:
    """Return True if a coordinate system is a local one, as of the unrolled plane."""
    try:
        return is_local(CRS.from_wkt(crs.to_wkt()))
    except (CRSError, RasterioError):
        return False


def _crs_name(crs: Any) -> str:
    try:
        return CRS.from_wkt(crs.to_wkt()).name
    except (CRSError, RasterioError):
        return "of a map"


@dataclass(frozen=True)
class Controls:
    """Control points of an image.

    Attributes
    ----------
    names : list of str
        Where each was read, for messages.
    pixels : (n, 2) array
        Column and row.
    places : (n, 2) array
        Chainage and arc, m.
    """

    names: list[str]
    pixels: Float
    places: Float


def read_controls(conn: psycopg.Connection[Any], survey: Survey, path: Path, image: ImageFile) -> Controls:
    """Read control points: column, row, chainage and arc; or the file .points of QGIS's georeferencer.

    A chainage may be a station of the tunnel. In a file of QGIS, x of the map is the chainage and y the arc.

    Raises
    ------
    InputError
        If the file cannot be read, or a point is outside the image.
    """
    if find_column(path, read_header(path), "mapX") is None:
        table = read_csv(path, ("column", "row", "arc"))
        chainage = _chainages(conn, survey, path, "chainage", table.lines)
        pixels, places = table.columns(("column", "row")), np.column_stack([chainage, table["arc"]])
    else:
        table = read_csv(path, ("mapX", "mapY", "sourceX", "sourceY", "enable"), default={"enable": 1.0})
        pixels = table.columns(("sourceX", "sourceY")) * [1.0, -1.0]
        if image.transform is not None:
            back = ~image.transform
            pixels = np.array([back @ tuple(point) for point in table.columns(("sourceX", "sourceY"))]).reshape(-1, 2)
        places = table.columns(("mapX", "mapY"))
    used = np.flatnonzero(table["enable"] != 0) if "enable" in table.names else np.arange(len(table))
    if len(used) > MAX_POINTS:
        raise InputError(f"{path} has {len(used)} points; give at most {MAX_POINTS}")
    for row in used.tolist():
        column, line = pixels[row]
        if not (-1.0 <= column <= image.columns + 1.0 and -1.0 <= line <= image.rows + 1.0):
            raise table.error(
                row,
                f"column {column:g}, row {line:g} is outside the image, which has {image.columns} columns and {image.rows}"
                " rows, counted from its upper left corner",
            )
    return Controls([f"line {table.lines[row]}" for row in used.tolist()], pixels[used], places[used])


def own_controls(image: ImageFile) -> Controls:
    """Return the control points that an image file has itself."""
    table = np.array(image.ground, dtype=np.float64).reshape(-1, 4)
    return Controls([f"point {n}" for n in range(1, len(table) + 1)], table[:, :2], table[:, 2:])


def _chainages(conn: psycopg.Connection[Any], survey: Survey, path: Path, name: str, lines: Sequence[int] | Any) -> Float:
    """Read a column of chainages, m, or stations of the tunnel."""
    out = []
    for line, text in zip(lines, read_texts(path, name), strict=True):
        try:
            out.append(read_chainage(conn, survey, name, text))
        except ValueError as error:
            raise InputError(f"{path}, line {line}: {error}") from None
    return np.array(out, dtype=np.float64)


FRAME_COLUMNS = ("chainage_from", "chainage_to", "arc_from", "arc_to")


def read_frames(
    conn: psycopg.Connection[Any], survey: Survey, path: Path, band: int | None, scale: float | None, offset: float | None
) -> list[Frame]:
    """Read a table of images: file (relative to the table), chainage_from, chainage_to, arc_from, arc_to.

    chainage_from is the chainage of the left edge, arc_to the arc of the upper one. Both pairs may run backwards: the image is
    turned by 180°.

    Raises
    ------
    InputError
        If the table or an image cannot be read, an image has no extent or is mirrored, or their bands differ.
    """
    files, lines = read_texts(path, "file"), row_lines(path)
    table = read_csv(path, ("arc_from", "arc_to"))
    west, east = (_chainages(conn, survey, path, name, lines) for name in FRAME_COLUMNS[:2])
    if not files:
        raise InputError(f"{path} has no rows")
    frames: list[Frame] = []
    for k, name in enumerate(files):
        low, high = table.values[k]
        if west[k] == east[k] or low == high:
            raise table.error(k, "the image has no extent: chainage_from equals chainage_to, or arc_from equals arc_to")
        if (east[k] > west[k]) != (high > low):
            raise table.error(
                k, "the image is mirrored: either chainage or arc runs backwards; exchange from and to of that pair"
            )
        try:
            image = open_image(path.parent / name, band, scale, offset)
        except InputError as error:
            raise table.error(k, str(error)) from None
        if frames and image.bands != frames[0].source.bands:
            raise table.error(k, f"{name} has {image.bands} bands, {files[0]} {frames[0].source.bands}: all must be alike")
        along, around = (east[k] - west[k]) / image.columns, (low - high) / image.rows
        frames.append(Frame(image, AffineMapping(Affine(along, 0.0, float(west[k]), 0.0, float(around), float(high)))))
    return frames
