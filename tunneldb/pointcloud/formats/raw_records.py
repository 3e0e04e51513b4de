"""Points of files other than LAS and E57 as LAS records, for writing LAZ.

Source: ASPRS LAS 1.4 R15, tables 3, 15 and 16 (formats 6 and 7), 26 (extra bytes).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float, UInt8
from tunneldb.errors import InputError
from tunneldb.pointcloud.formats.e57_records import extra_bytes, new_header, spread
from tunneldb.pointcloud.formats.las_header import Head
from tunneldb.pointcloud.formats.las_records import fields, record_size
from tunneldb.pointcloud.formats.raw import read_raw
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import COLOURS

_SCALE = 1e-4  # m; finer than any scanner measures, and an int32 of it reaches 214 km
_STANDARD = ("gps_time", "scan_id", "classification")
_SCAN_ID_LIMIT = 2**16


class RawRecords:
    """Points of a PTX, PTS, PLY or other table of points as records of LAS format 6, or 7 if they have a colour.

    `point_source_id` is the scan number, or, if that has more than 16 bits, the number of the scan in the file, from 1. All
    other columns are stored in extra bytes, as 64-bit floats under their own names, the intensity as `source_intensity`;
    colours are scaled to 16 bits.

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
        header = format_of(path).header(path)
        self.columns = [name for name in header.dimensions if name not in _STANDARD]
        coloured = set(COLOURS) <= set(self.columns)
        self.format = 7 if coloured else 6
        self.extras = [name for name in self.columns if not (coloured and name in COLOURS)]
        self.scale = _SCALE
        with np.errstate(invalid="ignore"):
            while np.max(header.high - header.low) / self.scale > 2**30:
                self.scale *= 10
        self.offsets = np.floor(header.low)
        described = [(name, _extra_name(name), "f8") for name in self.extras]
        size = record_size(self.format) + 8 * len(self.extras)
        records = (extra_bytes(described, format_of(path).name),) if described else ()
        start = new_header(self.scale, self.offsets, None, self.format, size, timed=False)
        self.head = Head(start, records, timed=False).with_crs(header.crs)
        self.scans: dict[int, int] = {}
        self.count = 0
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)

    def read(self, size: int) -> Iterator[UInt8]:
        """Read the points once, in chunks of at most `size`, without those that have no coordinates.

        Raises
        ------
        InputError
            If they cannot be read.
        """
        # One pass for each column: readers return one at a time, and tables have few.
        passes = [read_raw(self.path, name, size) for name in self.columns] or [read_raw(self.path, None, size)]
        before = record_size(self.format)
        for parts in zip(*passes, strict=True):
            raw = parts[0]
            xyz = np.column_stack([raw.x, raw.y, raw.z]) * raw.scales + raw.offsets
            placed = np.flatnonzero(np.isfinite(xyz).all(axis=1))
            if not len(placed):
                continue
            xyz = xyz[placed]
            stored = np.rint((xyz - self.offsets) / self.scale)
            if np.abs(stored).max() >= 2**31:
                raise InputError(f"{self.path}: the file was changed while it was read")
            out: UInt8 = np.zeros((len(xyz), before + 8 * len(self.extras)), np.uint8)
            point = fields(out, self.format)
            for column, axis in enumerate("XYZ"):
                point[axis] = stored[:, column]
            point["bit_fields"] = 1 | 1 << 4  # the first of one return
            point["point_source_id"] = self._numbers(np.asarray(raw.scan_id)[placed])
            if raw.time is not None:
                point["gps_time"] = raw.time[placed]
            values = {
                name: np.asarray(part.intensity, np.float64)[placed] for name, part in zip(self.columns, parts, strict=False)
            }
            if "intensity" in values:
                point["intensity"] = spread(values["intensity"], *_limits(values["intensity"]))
            for name in COLOURS if self.format == 7 else ():
                point[name] = spread(values[name], *_limits(values[name]))
            for place, name in enumerate(self.extras):
                extra: Float = np.ndarray((len(out),), "<f8", out.data, before + 8 * place, (out.shape[1],))
                extra[:] = values[name]
            self._count(stored)
            yield out

    def patches(self) -> tuple[int, bytes]:
        """Return place and bytes of the part of the header that is known after reading all points: bounding box and counts."""
        corners = np.column_stack([self.high, self.low]).ravel()
        returns = [self.count, *[0] * 14]
        return 179, struct.pack("<6d", *corners) + bytes(247 - 227) + struct.pack("<Q15Q", self.count, *returns)

    def _numbers(self, scan_id: np.ndarray[tuple[int, ...], np.dtype[np.integer]]) -> Float:
        scans, places = np.unique(scan_id, return_inverse=True)
        for scan in scans.tolist():
            self.scans.setdefault(scan, len(self.scans) + 1)
        found = [scan if scan < _SCAN_ID_LIMIT else min(self.scans[scan], _SCAN_ID_LIMIT - 1) for scan in scans.tolist()]
        return np.array(found, np.float64)[places]

    def _count(self, stored: Float) -> None:
        self.count += len(stored)
        self.low = np.minimum(self.low, stored.min(axis=0) * self.scale + self.offsets)
        self.high = np.maximum(self.high, stored.max(axis=0) * self.scale + self.offsets)


def _extra_name(name: str) -> str:
    return "source_intensity" if name == "intensity" else name.encode("ascii", "replace").decode()[:32]


def _limits(values: Float) -> tuple[float, float]:
    """Return the range of 0–1, 8 bits or 16 bits that holds the values; 12 bits may be shifted below zero, as by Leica."""
    values = values[np.isfinite(values)]
    maximum = float(values.max(initial=0.0))
    if float(values.min(initial=0.0)) < 0.0:
        return -2048.0, 2047.0
    return 0.0, next((float(end) for end in (1, 2**8 - 1, 2**16 - 1) if maximum <= end), maximum)
