"""Merging of several LAS files: a common point format, scales and extra bytes.

Source: ASPRS LAS 1.4 R15, tables 3 (header), 15 to 17 (formats 6 to 8), 26 (extra bytes).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tunneldb.arrays import Float, UInt8
from tunneldb.pointcloud.formats.las_header import EXTRA_BYTES, WKT, Head, Record, size_of
from tunneldb.pointcloud.formats.las_records import coordinates, fields, record_size

_ENTRY = 192  # bytes that describe a dimension of extra bytes
_NAME = slice(4, 36)
_HAS_LIMITS = 0b110
_GEOTIFF = (34735, 34736, 34737)  # records of a coordinate system before WKT
_STANDARD_TIME = 1


@dataclass(frozen=True)
class Placement:
    """Conversion of the points of one file to those of the merged file.

    Attributes
    ----------
    source, target : Head
    extras : tuple of (int, int, int)
        Offset of each dimension of extra bytes in a record of the file, in one of the merged file, and its size, bytes.
    """

    source: Head
    target: Head
    extras: tuple[tuple[int, int, int], ...]

    def records(self, records: UInt8) -> UInt8:
        """Convert records (n, size) of the file to those of the merged file; the same array if nothing differs.

        Coordinates move by half a resolution step at most, and not at all if scales and offsets are equal.

        Raises
        ------
        ValueError
            If a coordinate is too far from the offsets of the merged file.
        """
        if self._keeps_coordinates and self.source.point_format == self.target.point_format and self._keeps_extras:
            return records
        out = np.zeros((len(records), self.target.record_size), np.uint8)
        before, after = fields(records, self.source.point_format), fields(out, self.target.point_format)
        for name in before.dtype.names or ():
            after[name] = before[name]
        for place, target, size in self.extras:
            out[:, target : target + size] = records[:, place : place + size]
        if not self._keeps_coordinates:
            stored = self._stored(coordinates(records, self.source.scales, self.source.offsets))
            for column, axis in enumerate("XYZ"):
                after[axis] = stored[:, column]
        return out

    def coordinates(self, xyz: Float) -> Float:
        """Return coordinates (n, 3) of the file as stored in the merged file, m.

        Raises
        ------
        ValueError
            As for `records`.
        """
        if self._keeps_coordinates:
            return xyz
        return self._stored(xyz) * np.array(self.target.scales) + np.array(self.target.offsets)

    @property
    def _keeps_coordinates(self) -> bool:
        return (self.source.scales, self.source.offsets) == (self.target.scales, self.target.offsets)

    @property
    def _keeps_extras(self) -> bool:
        same = all(place == target for place, target, _ in self.extras)
        return same and self.source.record_size == self.target.record_size

    def _stored(self, xyz: Float) -> Float:
        stored = np.rint((xyz - np.array(self.target.offsets)) / np.array(self.target.scales))
        if len(stored) and np.abs(stored).max() >= 2**31:
            raise ValueError("its points are too far from those of the other files for their coordinate resolution")
        return stored


def merge_heads(heads: Sequence[Head]) -> tuple[Head, list[Placement]]:
    """Return a header for the points of all files, whose formats are 6, 7 or 8, and their placements.

    Header and coordinate system are those of the first file, scales the finest. Dimensions of extra bytes are the same if name,
    type, scale and offset are; if only the names are equal, a number is appended. Other records are stored once. GPS time is of
    the kind of the files that have it.

    Raises
    ------
    ValueError
        If the files have different kinds of GPS time.
    """
    first = heads[0]
    kinds = {head.header[6] & _STANDARD_TIME for head in heads if head.timed}
    if len(kinds) > 1:
        raise ValueError("some files have GPS time by weeks, others adjusted standard GPS time")
    records: list[Record] = []
    for head in heads:
        for record in (*head.records, *head.extended):
            same = (kept.key == record.key and (record.key == WKT or kept.data == record.data) for kept in records)
            if record.key != EXTRA_BYTES and not _is_geotiff(record, head) and not any(same):
                records.append(record)
    point_format = max(head.point_format for head in heads)
    entries: list[bytes] = []
    placements = []
    size = record_size(point_format)
    described: dict[bytes, int] = {}
    for head in heads:
        extras = []
        for entry, place, length in _dimensions(head):
            key = entry if len(heads) == 1 else _without_limits(entry)
            if key not in described:
                described[key] = size
                entries.append(_renamed(key, [other[_NAME] for other in entries]))
                size += length
            extras.append((place, described[key], length))
        placements.append(tuple(extras))
    if entries:
        records.append(Record(EXTRA_BYTES[0], EXTRA_BYTES[1], b"Extra bytes", b"".join(entries)))
    header = bytearray(first.header)
    header[6] = header[6] & ~_STANDARD_TIME | (kinds.pop() if kinds else 0)
    struct.pack_into("<3d", header, 131, *np.min([head.scales for head in heads], axis=0))
    small = tuple(record for record in records if len(record.data) < 2**16)
    large = tuple(record for record in records if len(record.data) >= 2**16)
    merged = replace(
        first, header=bytes(header), records=small, padding=b"", extended=large, timed=any(head.timed for head in heads)
    )
    merged = merged.with_points(point_format, size)
    return merged, [Placement(head, merged, extras) for head, extras in zip(heads, placements, strict=True)]


def _is_geotiff(record: Record, head: Head) -> bool:
    """Return True if a GeoTIFF record repeats the coordinate system of a WKT record in the same file."""
    if record.key[0] != WKT[0] or record.number not in _GEOTIFF:
        return False
    return any(other.key == WKT for other in (*head.records, *head.extended))


def _dimensions(head: Head) -> list[tuple[bytes, int, int]]:
    """Return description, offset in a record, and size (bytes) of each dimension of extra bytes; names for undescribed ones."""
    data = b"".join(record.data for record in (*head.records, *head.extended) if record.key == EXTRA_BYTES)
    place, found = record_size(head.point_format), []
    for at in range(0, len(data) - _ENTRY + 1, _ENTRY):
        length = size_of(data[at + 2], data[at + 3])
        if place + length > head.record_size:
            break
        found.append((data[at : at + _ENTRY], place, length))
        place += length
    while place < head.record_size:
        length = min(head.record_size - place, 255)
        entry = struct.pack("<2sBB32s156s", b"", 0, length, f"unsaid{place}".encode(), b"")
        found.append((entry, place, length))
        place += length
    return found


def _without_limits(entry: bytes) -> bytes:
    if entry[2] == 0:
        return entry
    return entry[:3] + bytes([entry[3] & ~_HAS_LIMITS]) + entry[4:64] + bytes(48) + entry[112:]


def _renamed(entry: bytes, taken: Sequence[bytes]) -> bytes:
    name, number = entry[_NAME], 1
    while name in taken:
        number += 1
        plain = entry[_NAME].rstrip(b"\0")[:29]
        name = (plain + f"_{number}".encode()).ljust(32, b"\0")
    return entry[:4] + name + entry[36:]
