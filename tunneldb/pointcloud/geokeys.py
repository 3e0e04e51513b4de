"""Coordinate systems in GeoTIFF keys, as LAS files before 1.4 state them; read by GDAL from a TIFF of one pixel.

Source: OGC 19-008r4, *GeoTIFF Standard 1.1*, annex B (keys); ASPRS LAS 1.4 R15, records 34735 to 34737.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Mapping
from dataclasses import dataclass

from pyproj import CRS
from pyproj.exceptions import CRSError

DIRECTORY, DOUBLES, ASCII = 34735, 34736, 34737
"""Numbers of the records, which are those of the TIFF's tags."""

USER_DEFINED = 32767
UNIT_NAMES = {9001: "metre", 9002: "foot", 9003: "US survey foot"}

MODEL, CITATION, PROJECTED_CODE, PROJECTED_UNIT = 1024, 1026, 3072, 3076
VERTICAL_CODE, VERTICAL_DATUM, VERTICAL_UNIT = 4096, 4098, 4099
_NAMES = {
    1024: "GTModelType", 1026: "GTCitation", 2048: "GeodeticCRS", 2049: "GeodeticCitation", 2050: "GeodeticDatum",
    2054: "GeogAngularUnits", 2056: "Ellipsoid", 3072: "ProjectedCRS", 3073: "ProjectedCitation", 3074: "Projection",
    3075: "ProjMethod", 3076: "ProjLinearUnits", 4096: "Vertical", 4097: "VerticalCitation", 4098: "VerticalDatum",
    4099: "VerticalUnits",
}  # fmt: skip
_STATEMENTS = {2048, 2050, 3072, 3074, 3075, 3076, 4096, 4098, 4099}  # keys without which nothing is stated
_SHORT, _LONG, _ASCII_TYPE, _DOUBLE = 3, 4, 2, 12  # types of TIFF
_MAX_DESCRIBED = 8


@dataclass(frozen=True)
class GeoKeys:
    """Keys of a file, with their texts and numbers.

    Attributes
    ----------
    values : mapping of int to int, float or str
        Value of each key; the first one, where there are several.
    directory, doubles, ascii : bytes
        Contents of the three records.
    """

    values: Mapping[int, int | float | str]
    directory: bytes
    doubles: bytes
    ascii: bytes

    def code(self, key: int) -> int | None:
        """Return a code; None if it is missing, undefined (0) or user-defined."""
        value = self.values.get(key)
        return value if isinstance(value, int) and value not in (0, USER_DEFINED) else None

    @property
    def described(self) -> str:
        """Keys with their values, for a message."""
        shown = [f"{key} {_NAMES[key]} = {value}" for key, value in self.values.items() if key in _NAMES]
        more = f" and {len(shown) - _MAX_DESCRIBED} more" if len(shown) > _MAX_DESCRIBED else ""
        return ", ".join(shown[:_MAX_DESCRIBED]) + more


def parse_geokeys(directory: bytes, doubles: bytes, ascii_text: bytes) -> GeoKeys:
    """Return the keys of the three records.

    Raises
    ------
    ValueError
        If a key refers beyond a record, or the directory is shorter than it states.
    """
    if len(directory) < 8:
        raise ValueError("the GeoTIFF key directory is shorter than its header")
    count = struct.unpack_from("<H", directory, 6)[0]
    if len(directory) < 8 * (count + 1):
        raise ValueError(f"the GeoTIFF key directory states {count} keys, but has space for {len(directory) // 8 - 1}")
    values: dict[int, int | float | str] = {}
    for at in range(8, 8 * (count + 1), 8):
        key, place, number, value = struct.unpack_from("<4H", directory, at)
        if place == 0:
            values[key] = value
        elif place == DOUBLES:
            if len(doubles) < 8 * (value + max(number, 1)):
                raise ValueError(f"GeoTIFF key {key} is beyond the record of numbers (34736)")
            values[key] = struct.unpack_from("<d", doubles, 8 * value)[0]
        elif place == ASCII:
            if len(ascii_text) < value + number - 1:
                raise ValueError(f"GeoTIFF key {key} is beyond the record of texts (34737)")
            values[key] = ascii_text[value : value + number].decode("latin-1").strip("|\0 ")
    return GeoKeys(values, directory[: 8 * (count + 1)], doubles[: len(doubles) // 8 * 8], ascii_text)


def read_crs(keys: GeoKeys) -> CRS | None:
    """Return the coordinate system of keys, compound if they state heights; None if they state none.

    The linear unit of key 3076 has precedence over that of the code in 3072; see `unit_contradiction`.

    Raises
    ------
    ValueError
        If they state one that cannot be read; with the keys.
    """
    stated = {key for key, value in keys.values.items() if value not in (0, "")}
    if not stated & _STATEMENTS and keys.values.get(MODEL) != USER_DEFINED:
        return None
    found = _plain_code(keys) or _by_gdal(keys)
    named = keys.values.get(CITATION) and keys.values.get(PROJECTED_CODE) != USER_DEFINED  # such as local grids by GDAL
    if found is None or (found.is_engineering and not named):
        raise ValueError(f"GeoTIFF keys {keys.described}")
    return found


def unit_contradiction(keys: GeoKeys) -> str:
    """Return a statement of both units if key 3076 has another linear unit than the code in 3072; empty if not."""
    return _contradiction(keys, PROJECTED_CODE, PROJECTED_UNIT)


def height_contradiction(keys: GeoKeys) -> str:
    """Return a statement of both units if key 4099 has another unit than the height system in 4096; empty if not."""
    return _contradiction(keys, VERTICAL_CODE, VERTICAL_UNIT)


def _contradiction(keys: GeoKeys, code_key: int, unit_key: int) -> str:
    code, unit = keys.code(code_key), keys.code(unit_key)
    if code is None or unit is None:
        return ""
    try:
        crs = CRS.from_epsg(code)
    except CRSError:
        return ""
    axes = [axis for axis in crs.axis_info if axis.unit_code.isdigit()]
    if not axes or crs.is_geographic or int(axes[0].unit_code) == unit:
        return ""
    other = UNIT_NAMES.get(unit, f"unit {unit}")
    return f"GeoTIFF key {code_key} states EPSG:{code} ({crs.name}), in {axes[0].unit_name}, but key {unit_key} states {other}"


def _plain_code(keys: GeoKeys) -> CRS | None:
    """Return the system of a code alone; its other keys, if any, repeat it."""
    code = keys.code(PROJECTED_CODE)
    if code is None or unit_contradiction(keys) or {VERTICAL_CODE, VERTICAL_UNIT, VERTICAL_DATUM} & set(keys.values):
        return None
    try:
        return CRS.from_epsg(code)
    except CRSError:
        return None


def _by_gdal(keys: GeoKeys) -> CRS | None:
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError
    from rasterio.io import MemoryFile

    with (
        warnings.catch_warnings(),
        rasterio.Env(GTIFF_REPORT_COMPD_CS=True, GTIFF_SRS_SOURCE="GEOKEYS" if unit_contradiction(keys) else "EPSG"),
        MemoryFile(_tiff(keys)) as memory,
    ):
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        try:
            with memory.open() as image:
                text = image.crs.to_wkt(version="WKT2_2019") if image.crs else ""
            return CRS.from_wkt(text) if text else None
        except (RasterioError, CRSError):
            return None


def _tiff(keys: GeoKeys) -> bytes:
    """Return a TIFF of one pixel with these keys."""
    arrays = [(DIRECTORY, _SHORT, keys.directory, len(keys.directory) // 2)]
    if keys.doubles:
        arrays.append((DOUBLES, _DOUBLE, keys.doubles, len(keys.doubles) // 8))
    if keys.ascii:
        arrays.append((ASCII, _ASCII_TYPE, keys.ascii, len(keys.ascii)))
    # width, height, bits, no compression, black is zero, place of the pixel, samples, rows, bytes of the pixel
    numbers = [(256, 1), (257, 1), (258, 8), (259, 1), (262, 1), (273, 8), (277, 1), (278, 1), (279, 1)]
    pixel = bytes(8)
    begin = 8 + len(pixel)
    place = begin + 2 + 12 * (len(numbers) + len(arrays)) + 4
    entries = [struct.pack("<HHII", tag, _LONG, 1, value) for tag, value in numbers]
    data = b""
    for tag, kind, content, count in arrays:
        if len(content) <= 4:
            entries.append(struct.pack("<HHI4s", tag, kind, count, content.ljust(4, b"\0")))
            continue
        entries.append(struct.pack("<HHII", tag, kind, count, place + len(data)))
        data += content + bytes(len(content) % 2)
    head = struct.pack("<2sHI", b"II", 42, begin) + pixel
    return head + struct.pack("<H", len(entries)) + b"".join(entries) + bytes(4) + data
