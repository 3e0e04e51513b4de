"""Check of the counts and offsets of a LAS or LAZ file that a decoder uses before it reads the data.

If one of them is damaged, the LAZ decoder may request more memory than the machine has, which ends the process without
an error that can be caught. So they are first compared with the size of the file.

Source: ASPRS LAS 1.4 R15, tables 3 and 24; LASzip's layout of the chunk table.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

_VLR_BYTES = 54
_LASZIP_ID = 22204
_VARIABLE_CHUNKS = 0xFFFFFFFF
POINTWISE = 1
"""Compressor of LASzip before 2.0: one run of points, without a chunk table."""

_INTERNAL_WAVEFORMS = 1 << 1  # of the header's flags
_STREAMED = -1  # the offset of the chunk table is in the file's last 8 bytes
_MAX_CHUNK = 1 << 32  # bytes
_MAX_APPENDED = 1 << 30  # bytes after the points that no record describes
_FULL_HEADER = 375  # bytes, of version 1.4
_LEGACY_COUNT_AT, _COUNT_AT = 107, 247
_BOX_AT = 179
_BOX = struct.Struct("<6d")  # max x, min x, max y, min y, max z, min z


def header_box(path: Path) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    """Read least and greatest coordinates from the header of a LAS or LAZ file, even if the rest is damaged.

    Returns
    -------
    tuple or None
        Two corners (x, y, z), m; None if the file is not LAS or LAZ, too short, or its box is invalid.
    """
    with path.open("rb") as file:
        head = file.read(_BOX_AT + _BOX.size)
    if head[:4] != b"LASF" or len(head) < _BOX_AT + _BOX.size:
        return None
    high_x, low_x, high_y, low_y, high_z, low_z = _BOX.unpack_from(head, _BOX_AT)
    if not (-math.inf < low_x <= high_x < math.inf and -math.inf < low_y <= high_y < math.inf):
        return None
    return (low_x, low_y, low_z), (high_x, high_y, high_z)


def point_counts(head: bytes) -> tuple[int, int]:
    """Return the number of points by a header, and that of its legacy field of 32 bits; 375 bytes.

    Version 1.4 has a field of 64 bits, which counts; if it is 0, the legacy field does, which some writers fill alone.
    """
    (legacy,) = struct.unpack_from("<I", head, _LEGACY_COUNT_AT)
    if head[25] < 4:  # minor version
        return legacy, legacy
    (count,) = struct.unpack_from("<Q", head, _COUNT_AT)
    return count or legacy, legacy


def count_contradiction(path: Path) -> str:
    """Return a statement of both numbers of points if the header of a LAS file has two; empty if not."""
    with path.open("rb") as file:
        count, legacy = point_counts(file.read(_FULL_HEADER))
    if legacy in (0, count):
        return ""
    return f"its header states {count} points in its field of 64 bits, which counts, but {legacy} in that of 32 bits"


def check_envelope(path: Path) -> None:
    """Compare counts and offsets with the size of the file.

    Raises
    ------
    ValueError, struct.error
        If the file is too short for them, or they contradict each other.
    OSError
        If the file cannot be read.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_FULL_HEADER)
        if head[:4] != b"LASF":
            raise ValueError("it does not begin with LASF")
        (header_size,) = struct.unpack_from("<H", head, 94)
        points_at, vlrs, point_format, record = struct.unpack_from("<IIBH", head, 96)
        count, _ = point_counts(head)
        if not header_size + vlrs * _VLR_BYTES <= points_at <= size:
            raise ValueError(f"its header states {vlrs} records before byte {points_at}, but the file has {size} bytes")
        if point_format < 128:  # not compressed
            if points_at + count * record > size:
                raise ValueError(f"its header states {count} points, but the file has space for {(size - points_at) // record}")
            _require_all_stated(count, _end_of_points(head, size) - points_at, record)
            return
        place, fixed = header_size, None
        for _ in range(vlrs):
            file.seek(place)
            number, length = struct.unpack_from("<HH", file.read(_VLR_BYTES), 18)
            place += _VLR_BYTES
            if number == _LASZIP_ID:
                file.seek(place)
                body = file.read(length)
                (compressor,) = struct.unpack_from("<H", body, 0)
                if compressor == POINTWISE:
                    return
                (chunk,) = struct.unpack_from("<I", body, 12)
                (items,) = struct.unpack_from("<H", body, 32)
                if sum(struct.unpack_from("<HHH", body, 34 + 6 * item)[1] for item in range(items)) != record:
                    raise ValueError(f"the items of its points do not make up {record} bytes")
                if chunk != _VARIABLE_CHUNKS and chunk * record > _MAX_CHUNK:
                    raise ValueError(f"its chunks would have {chunk} points")
                fixed = chunk if 0 < chunk < _VARIABLE_CHUNKS else None
            place += length
        file.seek(points_at)
        (table_at,) = struct.unpack("<q", file.read(8))
        if table_at == _STREAMED:
            file.seek(size - 8)
            (table_at,) = struct.unpack("<q", file.read(8))
        if not points_at + 8 <= table_at <= size - 8:
            raise ValueError(f"its chunk table would be at byte {table_at}, but the file has {size} bytes")
        file.seek(table_at)
        version, chunks = struct.unpack("<II", file.read(8))
        if version != 0 or chunks > max(count, 1):
            raise ValueError(f"its chunk table is damaged: version {version}, {chunks} chunks for {count} points")
        if fixed is not None and chunks > max(-(-count // fixed), 1):
            raise ValueError(f"its header states {count} points, but it has {chunks} chunks of {fixed} points; export it again")


def _end_of_points(head: bytes, size: int) -> int:
    """Return the offset at which uncompressed points end at the latest: before extended records or waveforms."""
    ends = [size]
    (points_at,) = struct.unpack_from("<I", head, 96)
    if head[25] >= 3 and struct.unpack_from("<H", head, 6)[0] & _INTERNAL_WAVEFORMS:
        ends += struct.unpack_from("<Q", head, 227)
    if head[25] >= 4:
        place, number = struct.unpack_from("<QI", head, 235)
        ends += [place] if number else []
    return min(end for end in ends if end >= points_at)


def _require_all_stated(count: int, room: int, record: int) -> None:
    """Refuse a file with more points than its header states: its writer was interrupted before it wrote the number.

    Other bytes may follow the points; they count as points if they make up whole ones, if the header states none, or if they
    are more than any program appends.
    """
    there = room // max(record, 1)
    if there > count and (count == 0 or room % record == 0 or room - count * record > max(_MAX_APPENDED, count * record)):
        raise ValueError(f"its header states {count} points, but it contains {there}; export it again")
