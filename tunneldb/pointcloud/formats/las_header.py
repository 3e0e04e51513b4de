"""What surrounds the points of a LAS file: its header and its variable length records, taken over byte by byte.

laspy reads and writes them too, but turns them into objects on the way: records that it knows are written anew, those of
extra bytes from the first one alone. A file that only gets other classes is to keep what it brought along.

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
    """A variable length record: who defined it, its number, what it says of itself, and its data."""

    user: bytes
    number: int
    description: bytes
    data: bytes
    reserved: bytes = b"\0\0"

    @property
    def key(self) -> tuple[bytes, int]:
        """User and number, which say what it is."""
        return self.user.rstrip(b"\0"), self.number

    def pack(self, *, extended: bool = False) -> bytes:
        """Bytes of it, in a file."""
        head = struct.pack("<2s16sH", self.reserved, self.user, self.number)
        return head + struct.pack("<Q32s" if extended else "<H32s", len(self.data), self.description) + self.data


@dataclass(frozen=True)
class Head:
    """Header and records of a LAS file of version 1.4 or later.

    Attributes
    ----------
    header : bytes
        375 bytes or more.
    records : tuple of Record
        Before the points.
    padding : bytes
        Between them and the points.
    extended : tuple of Record
        Behind the points.
    timed : bool
        Whether the points were given with times; the later formats have a place for one in any case.
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
        """Bytes of a point."""
        return int(struct.unpack_from("<H", self.header, 105)[0])

    @property
    def points(self) -> int:
        """Number of points."""
        return int(struct.unpack_from("<Q", self.header, 247)[0])

    @property
    def scales(self) -> tuple[float, float, float]:
        """Steps of the stored coordinates, m."""
        return struct.unpack_from("<3d", self.header, 131)

    @property
    def offsets(self) -> tuple[float, float, float]:
        """Added to the stored coordinates, m."""
        return struct.unpack_from("<3d", self.header, 155)

    @property
    def holds_waveforms(self) -> bool:
        """Whether packets of waveforms lie in the file itself, behind the points."""
        return bool(struct.unpack_from("<H", self.header, 6)[0] & _INTERNAL_WAVEFORMS)

    @property
    def crs(self) -> CRS | None:
        """Coordinate system that its WKT tells; None if it has none that can be read."""
        for record in self.records + self.extended:
            if record.key == WKT:
                try:
                    return CRS.from_wkt(record.data.rstrip(b"\0").decode())
                except (CRSError, UnicodeDecodeError):
                    return None
        return None

    def with_points(self, point_format: int, record_size: int) -> Head:
        """With points of this format and size."""
        header = bytearray(self.header)
        struct.pack_into("<BH", header, 104, point_format, record_size)
        return replace(self, header=bytes(header))

    def with_crs(self, crs: CRS | None) -> Head:
        """With the coordinate system as WKT, which formats 6 and later ask for, if it has none and one is known."""
        has = any(record.key == WKT for record in self.records + self.extended)
        text = None if has or crs is None else _wkt(crs)
        if not has and text is None:
            return self
        header = bytearray(self.header)
        header[6] |= _WKT_FLAG
        added = () if text is None else (Record(WKT[0], WKT[1], b"OGC WKT", text.encode() + b"\0"),)
        return replace(self, header=bytes(header), records=(*self.records, *added))

    def with_classes(self, names: Mapping[int, str]) -> Head:
        """With the names of the classes, up to 15 ASCII characters each, in the place of those that it brought."""
        table = b"".join(struct.pack("<B15s", code, names.get(code, "").encode("ascii", "replace")) for code in range(256))
        kept = tuple(record for record in self.records if record.key != _LOOKUP)
        return replace(self, records=(*kept, Record(_LOOKUP[0], _LOOKUP[1], b"Classes", table)))

    def with_numbers(self, names: Mapping[str, str], before: int) -> Head:
        """With further dimensions behind all others, whole numbers of 32 bits.

        Parameters
        ----------
        names : mapping of str to str
            Their names, and what they are, up to 32 ASCII characters each.
        before : int
            Bytes of a point's standard fields.

        Raises
        ------
        ValueError
            If a dimension is of one of these names already; it is what the error says.
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
        """All that comes before the compressed points; `laszip` says how they are compressed."""
        records = [*self.records, Record(_LASZIP[0], _LASZIP[1], b"by laszip of LAStools", laszip)]
        packed = b"".join(record.pack() for record in records) + self.padding
        header = bytearray(self.header)
        struct.pack_into("<II", header, 96, len(header) + len(packed), len(records))
        header[104] |= 0x80
        return bytes(header) + packed

    def place_of_extended(self, place: int) -> tuple[int, bytes]:
        """Where in the header the place and number of the extended records stand, and what is to stand there."""
        return 235, struct.pack("<QI", place if self.extended else 0, len(self.extended))


def size_of(kind: int, options: int) -> int:
    """Bytes of a dimension of extra bytes, by its type and options."""
    # Types 11 to 30 are two or three values of 1 to 10.
    return options if kind == 0 else _SIZE_OF[(kind - 1) % 10 + 1] * ((kind - 1) // 10 + 1)


def read_head(path: Path) -> Head:
    """Read header and records of a LAS or LAZ file, as those of version 1.4.

    What says how points are compressed or ordered (LASzip, COPC) is left out.

    Raises
    ------
    OSError, ValueError, struct.error
        If they cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(_SIZES[0])
        if head[:4] != SIGNATURE or head[25] not in _SIZES:
            raise ValueError(f"it is no LAS of a version from 1.0 to 1.5: {head[:4]!r}, 1.{head[25]}")
        size, points_at, count = struct.unpack_from("<HII", head, 94)
        file.seek(0)
        header = file.read(size)
        records = _read_records(file, count)
        if points_at < file.tell() and header[25] > 0:
            raise ValueError(f"its points begin at byte {points_at}, its records end at {file.tell()}")
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
            raise ValueError(f"record {user.rstrip(bytes(1))!r} {number} is cut off")
        records.append(Record(user, number, description, data, reserved))
    return tuple(records)


def _kept(records: tuple[Record, ...]) -> tuple[Record, ...]:
    return tuple(record for record in records if record.key != _LASZIP and record.key[0] != _COPC)


def _of_version_4(header: bytes) -> bytes:
    """Header of an older version as one of 1.4, with what its maker had added at its end."""
    minor, own = header[25], _SIZES[header[25]]
    if len(header) < own:
        raise ValueError(f"the header of LAS 1.{minor} has {own} bytes, this one {len(header)}")
    out = bytearray(header)
    if minor < 4:
        out = bytearray(header[:own].ljust(HEADER_SIZE, b"\0") + header[own:])
        out[25] = 4
        if minor == 0:
            out[4:8] = bytes(4)  # reserved then, a number and flags now
        count, *returns = struct.unpack_from("<I5I", header, 107)
        struct.pack_into("<QI", out, 235, 0, 0)
        struct.pack_into("<Q5Q", out, 247, count, *returns)
        struct.pack_into("<H", out, 94, len(out))
    out[107:131] = bytes(24)  # counts of 32 bits: none in formats 6 and later
    return bytes(out)


def _wkt(crs: CRS) -> str | None:
    """WKT 1, as LAS asks for; WKT 2 of what cannot be said in it."""
    for version in ("WKT1_GDAL", "WKT2_2019"):
        try:
            return crs.to_wkt(version)
        except CRSError:
            continue
    return None
