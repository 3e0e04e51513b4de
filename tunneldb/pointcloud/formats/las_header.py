"""Header and variable length records of a LAS file, copied byte by byte.

laspy converts them into objects: it writes known records anew, and those of extra bytes from the first one only. A file
that is only reclassified should keep all its records.

Source: ASPRS LAS 1.4 R15, tables 3 (header), 24 and 25 (variable length records), 31 (classification lookup).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

from pyproj import CRS
from pyproj.exceptions import CRSError

HEADER_SIZE = 375
_SIZES = {0: 227, 1: 227, 2: 227, 3: 235, 4: 375, 5: 393}
SIGNATURE = b"LASF"
_WKT_FLAG = 1 << 4
_INTERNAL_WAVEFORMS = 1 << 1
_TIMELESS = (0, 2)  # point formats
_LASZIP = (b"laszip encoded", 22204)
_LOOKUP = (b"LASF_Spec", 0)
WKT = (b"LASF_Projection", 2112)
EXTRA_BYTES = (b"LASF_Spec", 4)
_EXTRA = struct.Struct("<2sBB32s4s24s24s24s24s24s32s")  # table 26: 192 bytes
_UINT32 = 5
_SIZE_OF = (0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8)  # bytes of the data types of extra bytes
_COPC = b"copc"


@dataclass(frozen=True)
class Record:
    """Variable length record: user, number, description and data."""

    user: bytes
    number: int
    description: bytes
    data: bytes
    reserved: bytes = b"\0\0"

    @property
    def key(self) -> tuple[bytes, int]:
        """User and number, which identify its type."""
        return self.user.rstrip(b"\0"), self.number

    def pack(self, *, extended: bool = False) -> bytes:
        """Return its bytes as stored in a file."""
        head = struct.pack("<2s16sH", self.reserved, self.user, self.number)
        return head + struct.pack("<Q32s" if extended else "<H32s", len(self.data), self.description) + self.data


@dataclass(frozen=True)
class Head:
    """Header and records of a LAS file of version 1.4 or later.

    Attributes
    ----------
    header : bytes
        At least 375 bytes.
    records : tuple of Record
        Records before the points.
    padding : bytes
        Bytes between the records and the points.
    extended : tuple of Record
        Records after the points.
    timed : bool
        True if the original points have times; formats 6 and later always have a field for them.
    """

    header: bytes
    records: tuple[Record, ...]
    padding: bytes = b""
    extended: tuple[Record, ...] = ()
    timed: bool = True

    @property
    def point_format(self) -> int:
        """Format of the points."""
        return self.header[104] & 0x3F

    @property
    def record_size(self) -> int:
        """Size of a point, bytes."""
        return int(struct.unpack_from("<H", self.header, 105)[0])

    @property
    def points(self) -> int:
        """Number of points."""
        return int(struct.unpack_from("<Q", self.header, 247)[0])

    @property
    def scales(self) -> tuple[float, float, float]:
        """Resolution of the stored coordinates, m."""
        return struct.unpack_from("<3d", self.header, 131)

    @property
    def offsets(self) -> tuple[float, float, float]:
        """Offsets of the stored coordinates, m."""
        return struct.unpack_from("<3d", self.header, 155)

    @property
    def holds_waveforms(self) -> bool:
        """True if waveform packets are in the file itself, after the points."""
        return bool(struct.unpack_from("<H", self.header, 6)[0] & _INTERNAL_WAVEFORMS)

    @property
    def crs(self) -> CRS | None:
        """Coordinate system of its WKT; None if it has none that can be read."""
        for record in self.records + self.extended:
            if record.key == WKT:
                try:
                    return CRS.from_wkt(record.data.rstrip(b"\0").decode())
                except (CRSError, UnicodeDecodeError):
                    return None
        return None

    def with_points(self, point_format: int, record_size: int) -> Head:
        """Return a copy with points of this format and size."""
        header = bytearray(self.header)
        struct.pack_into("<BH", header, 104, point_format, record_size)
        return replace(self, header=bytes(header))

    def with_crs(self, crs: CRS | None) -> Head:
        """Return a copy with the coordinate system as WKT, required by formats 6 and later, if it has none and one is known."""
        has = any(record.key == WKT for record in self.records + self.extended)
        text = None if has or crs is None else _wkt(crs)
        if not has and text is None:
            return self
        header = bytearray(self.header)
        header[6] |= _WKT_FLAG
        added = () if text is None else (Record(WKT[0], WKT[1], b"OGC WKT", text.encode() + b"\0"),)
        return replace(self, header=bytes(header), records=(*self.records, *added))

    def with_classes(self, names: Mapping[int, str]) -> Head:
        """Return a copy with these class names, up to 15 ASCII characters each, instead of its own."""
        table = b"".join(struct.pack("<B15s", code, names.get(code, "").encode("ascii", "replace")) for code in range(256))
        kept = tuple(record for record in self.records if record.key != _LOOKUP)
        return replace(self, records=(*kept, Record(_LOOKUP[0], _LOOKUP[1], b"Classes", table)))

    def with_numbers(self, names: Mapping[str, str], before: int) -> Head:
        """Return a copy with additional dimensions after all others, 32-bit integers.

        Parameters
        ----------
        names : mapping of str to str
            Names and descriptions, up to 32 ASCII characters each.
        before : int
            Size of a point's standard fields, bytes.

        Raises
        ------
        ValueError
            If a dimension already has one of these names; the message is that name.
        """
        described = b"".join(record.data for record in self.records if record.key == EXTRA_BYTES)
        entries = [_EXTRA.unpack_from(described, at) for at in range(0, len(described) - _EXTRA.size + 1, _EXTRA.size)]
        for entry in entries:
            if (name := entry[3].rstrip(b"\0").decode("latin-1")) in names:
                raise ValueError(name)
        told = sum(size_of(entry[1], entry[2]) for entry in entries)
        blank = [b""] * 5
        extra = self.record_size - before
        unsaid = b"".join(
            _EXTRA.pack(b"", 0, min(extra - at, 255), f"unsaid{at}".encode(), b"", *blank, b"")
            for at in range(told, extra, 255)
        )
        added = b"".join(
            _EXTRA.pack(b"", _UINT32, 0, name.encode(), b"", *blank, text.encode()) for name, text in names.items()
        )
        kept = tuple(record for record in self.records if record.key != EXTRA_BYTES)
        record = Record(EXTRA_BYTES[0], EXTRA_BYTES[1], b"Extra bytes", described + unsaid + added)
        return replace(self, records=(*kept, record)).with_points(self.point_format, self.record_size + 4 * len(names))

    def before_points(self, laszip: bytes) -> bytes:
        """Return all bytes before the compressed points; `laszip` is the record of the compression."""
        records = [*self.records, Record(_LASZIP[0], _LASZIP[1], b"by laszip of LAStools", laszip)]
        packed = b"".join(record.pack() for record in records) + self.padding
        header = bytearray(self.header)
        struct.pack_into("<II", header, 96, len(header) + len(packed), len(records))
        header[104] |= 0x80
        return bytes(header) + packed

    def place_of_extended(self, place: int) -> tuple[int, bytes]:
        """Return the place in the header of the offset and number of extended records, and the bytes to write there."""
        return 235, struct.pack("<QI", place if self.extended else 0, len(self.extended))


def size_of(kind: int, options: int) -> int:
    """Return the size of a dimension of extra bytes, by its type and options, bytes."""
    # Types 11 to 30 are two or three values of 1 to 10.
    return options if kind == 0 else _SIZE_OF[(kind - 1) % 10 + 1] * ((kind - 1) // 10 + 1)


def read_head(path: Path) -> Head:
    """Read header and records of a LAS or LAZ file, converted to version 1.4.

    Records about the compression or order of points (LASzip, COPC) are omitted.

    Raises
    ------
    OSError, ValueError, struct.error
        If they cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(_SIZES[0])
        if head[:4] != SIGNATURE or head[25] not in _SIZES:
            raise ValueError(f"it is not LAS 1.0 to 1.5: {head[:4]!r}, 1.{head[25]}")
        size, points_at, count = struct.unpack_from("<HII", head, 94)
        file.seek(0)
        header = file.read(size)
        records = _read_records(file, count)
        if points_at < file.tell() and header[25] > 0:
            raise ValueError(f"its points begin at byte {points_at}, but its records end at {file.tell()}")
        padding = file.read(points_at - file.tell()) if header[25] > 0 else b""
        extended: tuple[Record, ...] = ()
        if header[25] >= 4:
            place, number = struct.unpack_from("<QI", header, 235)
            if number:
                file.seek(place)
                extended = _read_records(file, number, extended=True)
    timed = header[104] & 0x3F not in _TIMELESS
    return Head(_of_version_4(header), _kept(records), padding, _kept(extended), timed)


def _read_records(file: BinaryIO, count: int, *, extended: bool = False) -> tuple[Record, ...]:
    layout = struct.Struct("<2s16sHQ32s" if extended else "<2s16sHH32s")
    records = []
    for _ in range(count):
        reserved, user, number, length, description = layout.unpack(file.read(layout.size))
        data = file.read(length)
        if len(data) < length:
            raise ValueError(f"record {user.rstrip(bytes(1))!r} {number} is truncated")
        records.append(Record(user, number, description, data, reserved))
    return tuple(records)


def _kept(records: tuple[Record, ...]) -> tuple[Record, ...]:
    return tuple(record for record in records if record.key != _LASZIP and record.key[0] != _COPC)


def _of_version_4(header: bytes) -> bytes:
    """Convert a header of an older version to 1.4, with the bytes that its maker added at its end."""
    minor, own = header[25], _SIZES[header[25]]
    if len(header) < own:
        raise ValueError(f"the header of LAS 1.{minor} has {own} bytes, but this one has {len(header)}")
    out = bytearray(header)
    if minor < 4:
        out = bytearray(header[:own].ljust(HEADER_SIZE, b"\0") + header[own:])
        out[25] = 4
        if minor == 0:
            out[4:8] = bytes(4)  # reserved in older versions, a number and flags in 1.4
        count, *returns = struct.unpack_from("<I5I", header, 107)
        struct.pack_into("<QI", out, 235, 0, 0)
        struct.pack_into("<Q5Q", out, 247, count, *returns)
        struct.pack_into("<H", out, 94, len(out))
    elif struct.unpack_from("<Q", header, 247)[0] == 0:  # the legacy fields may be filled alone
        struct.pack_into("<Q5Q", out, 247, *struct.unpack_from("<I5I", header, 107))
    out[107:131] = bytes(24)  # counts of 32 bits: none in formats 6 and later
    return bytes(out)


def _wkt(crs: CRS) -> str | None:
    """Return WKT 1, as LAS requires; WKT 2 where WKT 1 cannot express the system."""
    for version in ("WKT1_GDAL", "WKT2_2019"):
        try:
            return crs.to_wkt(version)
        except CRSError:
            continue
    return None
