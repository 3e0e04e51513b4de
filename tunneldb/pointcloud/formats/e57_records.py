"""Points of E57 files as LAS records, for writing LAZ.

Source: ASTM E2807-11 (fields of a point); ASPRS LAS 1.4 R15, tables 3, 16 (format 7), 26 (extra bytes).
"""

from __future__ import annotations

import datetime as dt
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Float, UInt8, UInt16
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57 import (
    KIND,
    Scan,
    good_of,
    open_e57,
    own_coordinates,
    read_e57_header,
    read_fields,
    require_good,
    scans_of,
    value_of,
)
from tunneldb.pointcloud.formats.faults import decoding
from tunneldb.pointcloud.formats.las_header import HEADER_SIZE, Head, Record
from tunneldb.pointcloud.formats.las_records import fields, record_size

FORMAT = 7
"""Point format: with time and colour."""

_SCALE = 1e-4  # m; finer than any scanner measures, and an int32 of it reaches 214 km
_EXTRAS = (("intensity", "e57_intensity", "f4"), ("rowIndex", "row_index", "i4"), ("columnIndex", "column_index", "i4"))
_TYPE_NUMBER = {"f4": 9, "i4": 6, "f8": 10}
_COLOURS = (("colorRed", "red"), ("colorGreen", "green"), ("colorBlue", "blue"))
_GPS_EPOCH = dt.datetime(1980, 1, 6)
_ADJUSTED = 1e9  # s that LAS subtracts from GPS time
_STANDARD_TIME_FLAG = 1


class E57Records:
    """Valid points of an E57 file as records of LAS format 7, with the pose of their scan applied.

    The intensity is scaled to 16 bits by its limits in the file; the original value is in the extra bytes `e57_intensity`, and
    the place in the scanner's grid in `row_index` and `column_index`. `point_source_id` is the number of the scan in the
    file, from 1.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        If the file cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        header = read_e57_header(path)
        with open_e57(path) as image, decoding(path, KIND):
            scans = scans_of(path, image)
            created = value_of(image.root(), "creationDateTime/dateTimeValue")
        self.scale = _SCALE
        with np.errstate(invalid="ignore"):
            while np.max(header.high - header.low) / self.scale > 2**30:
                self.scale *= 10
        self.offsets = np.floor(header.low)
        self.extras = [extra for extra in _EXTRAS if any(extra[0] in scan.fields for scan in scans)]
        size = record_size(FORMAT) + 4 * len(self.extras)
        date = _GPS_EPOCH + dt.timedelta(seconds=created) if created else None
        timed = any(scan.has_time for scan in scans)
        records = (extra_bytes(self.extras, "E57"),) if self.extras else ()
        start = new_header(self.scale, self.offsets, date, FORMAT, size, timed)
        self.head = Head(start, records, timed=timed).with_crs(header.crs)
        self.count = 0
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        self.returns = np.zeros(15, np.uint64)

    def read(self, size: int) -> Iterator[UInt8]:
        """Read the points once, in chunks of at most `size`.

        Raises
        ------
        InputError
            If they cannot be read, a point has no coordinates, or all are marked as invalid.
        """
        with open_e57(self.path) as image:
            with decoding(self.path, KIND):
                scans = scans_of(self.path, image)
            for scan in scans:
                with decoding(self.path, KIND):
                    yield from self._read_scan(image, scan, size)
        require_good(self.path, scans, self.count)

    def patches(self) -> tuple[int, bytes]:
        """Return place and bytes of the part of the header that is known after reading all points: bounding box and counts."""
        corners = np.column_stack([self.high, self.low]).ravel() if self.count else np.zeros(6)
        middle = bytes(247 - 227)  # no waveforms, no extended records
        return 179, struct.pack("<6d", *corners) + middle + struct.pack("<Q15Q", self.count, *map(int, self.returns))

    def _read_scan(self, image: Any, scan: Scan, size: int) -> Iterator[UInt8]:
        node = image.root()["data3D"][scan.index]
        flags = scan.flags(None)
        wanted = [name for name in (*_names(), *(name for name, _, _ in self.extras)) if name in scan.fields]
        names = list(dict.fromkeys([*scan.coordinates, *flags, *wanted, *(["timeStamp"] if scan.has_time else [])]))
        for values in read_fields(image, scan, names, size):
            good = good_of(values, flags) if flags else np.ones(len(values[names[0]]), np.bool_)
            if good.any():
                yield self._records(scan, node, {name: column[good] for name, column in values.items()})

    def _records(self, scan: Scan, node: Any, values: dict[str, NDArray[Any]]) -> UInt8:
        xyz = own_coordinates(scan, values) @ scan.rotation.T
        if scan.position is not None:
            xyz += scan.position
        if not np.isfinite(xyz).all():
            raise InputError(f"{self.path}: a coordinate of scan {scan.name!r} is NaN or infinite; export the file again")
        stored = np.rint((xyz - self.offsets) / self.scale)
        if np.abs(stored).max() >= 2**31:
            raise InputError(f"{self.path}: scan {scan.name!r} lies outside the bounds in its header; export the file again")
        before = record_size(FORMAT)
        out: UInt8 = np.zeros((len(xyz), before + 4 * len(self.extras)), np.uint8)
        point = fields(out, FORMAT)
        for column, axis in enumerate("XYZ"):
            point[axis] = stored[:, column]
        number = np.clip(values.get("returnIndex", np.zeros(1)) + 1, 1, 15).astype(np.uint8)
        point["bit_fields"] = number | np.clip(values.get("returnCount", np.ones(1)), 1, 15).astype(np.uint8) << 4
        point["point_source_id"] = min(scan.index + 1, 2**16 - 1)
        if "intensity" in values:
            point["intensity"] = spread(values["intensity"], *_limits(node, "intensityLimits/intensity", values["intensity"]))
        for name, channel in _COLOURS:
            if name in values:
                point[channel] = spread(values[name], *_limits(node, f"colorLimits/{name}", values[name]))
        if scan.has_time:
            point["gps_time"] = values["timeStamp"] + scan.start - _ADJUSTED
        for place, (name, _, kind) in enumerate(self.extras):
            extra: NDArray[Any] = np.ndarray((len(out),), f"<{kind}", out.data, before + 4 * place, (out.shape[1],))
            extra[:] = values.get(name, np.nan if kind == "f4" else -1)
        self._count(stored, np.broadcast_to(number, len(out)))
        return out

    def _count(self, stored: Float, number: UInt8) -> None:
        self.count += len(stored)
        self.low = np.minimum(self.low, stored.min(axis=0) * self.scale + self.offsets)
        self.high = np.maximum(self.high, stored.max(axis=0) * self.scale + self.offsets)
        self.returns += np.bincount(number, minlength=16)[1:].astype(np.uint64)


def _names() -> Iterator[str]:
    yield from ("returnIndex", "returnCount", *(name for name, _ in _COLOURS))


def _limits(node: Any, name: str, values: Float) -> tuple[float, float]:
    """Return limits from the header; without them 0 to 1, 8 or 16 bits, the smallest range that holds the values."""
    low, high = (value_of(node, f"{name}{end}") for end in ("Minimum", "Maximum"))
    if low is not None and high is not None and high > low:
        return low, high
    maximum = float(np.nanmax(values, initial=0.0))
    return 0.0, next((float(end) for end in (1, 2**8 - 1, 2**16 - 1) if maximum <= end), maximum)


def spread(values: Float, low: float, high: float) -> UInt16:
    """Scale values from low to high to 16 bits; NaN becomes 0."""
    share = np.nan_to_num((values - low) / (high - low), nan=0.0, posinf=1.0, neginf=0.0)
    return np.rint(np.clip(share, 0.0, 1.0) * (2**16 - 1)).astype(np.uint16)


def new_header(scale: float, offsets: Float, date: dt.datetime | None, point_format: int, size: int, timed: bool) -> bytes:
    """Return a LAS 1.4 header without bounding box and counts; `timed`: times are adjusted standard GPS time."""
    header = bytearray(HEADER_SIZE)
    flags = _STANDARD_TIME_FLAG if timed else 0
    struct.pack_into("<4sHH16sBB32s32s", header, 0, b"LASF", 0, flags, bytes(16), 1, 4, b"OTHER", b"tunneldb")
    day, year = (0, 0) if date is None else (date.timetuple().tm_yday, date.year)
    struct.pack_into("<HHH", header, 90, day, year, HEADER_SIZE)
    struct.pack_into("<BH", header, 104, point_format, size)
    struct.pack_into("<6d", header, 131, *[scale] * 3, *offsets)
    return bytes(header)


def extra_bytes(extras: Sequence[tuple[str, str, str]], source: str) -> Record:
    """Return the record that describes extra bytes (table 26), each given as name in the source, own name and type."""
    data = b"".join(
        struct.pack(
            "<2sBB32s4s120s32s", b"", _TYPE_NUMBER[kind], 0, name.encode(), b"", b"", f"{field} of {source}".encode()[:32]
        )
        for field, name, kind in extras
    )
    return Record(b"LASF_Spec", 4, b"Extra bytes", data)
