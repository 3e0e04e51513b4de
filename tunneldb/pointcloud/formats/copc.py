"""Cloud Optimized Point Clouds: LAZ whose chunks are the nodes of an octree.

lazrs compresses the chunks, as in every LAZ file. A record before the points states the octree's cube, and a record after
them states the chunk of each node.

Source: COPC 1.0 (https://copc.io), sections *info VLR* and *hierarchy VLR*; ASPRS LAS 1.4 R15, table 3.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import lazrs
import numpy as np

from tunneldb.arrays import Float, UInt8
from tunneldb.pointcloud.formats.las_header import HEADER_SIZE, Head, Record
from tunneldb.pointcloud.formats.las_records import coordinates, fields, record_size
from tunneldb.pointcloud.formats.laz import write_errors_raised

FORMATS = (6, 7, 8)
"""Point formats that a COPC file may have."""

_INFO_SIZE = 160
_VLR_HEAD, _EVLR_HEAD = 54, 60
_AT_ONCE = 1_000_000  # points that are compressed together, one thread per node


class CopcWriter:
    """Writer of the nodes of a COPC file, in any order.

    Parameters
    ----------
    file : binary file
        Empty file, open for writing.
    head : Head
        Header and records around the points, for a format of `FORMATS`.
    low : (3,) float array
        Lower corner of the octree's cube, m.
    edge : float
        Edge of the cube, m.
    spacing : float
        Distance between points of the root, m.
    """

    def __init__(self, file: BinaryIO, head: Head, low: Float, edge: float, spacing: float) -> None:
        self.file = file
        header = bytearray(head.header[:HEADER_SIZE])
        header[25] = 4
        struct.pack_into("<H", header, 94, HEADER_SIZE)
        info = Record(b"copc", 1, b"COPC info VLR", bytes(_INFO_SIZE))
        self.head = replace(head, header=bytes(header), records=(info, *head.records), padding=b"")
        self.cube = (*(low + edge / 2.0).tolist(), edge / 2.0, spacing)
        vlr = lazrs.LazVlr.new_for_compression(head.point_format, head.record_size - record_size(head.point_format), True)
        self.vlr = vlr
        file.write(self.head.before_points(vlr.record_data()))
        self.begin = file.tell()
        self.compressor = lazrs.ParLasZipCompressor(file, vlr)
        self.pending: list[UInt8] = []
        self.nodes: list[tuple[int, int, int, int]] = []
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        self.times = (np.inf, -np.inf)
        self.returns = np.zeros(16, np.int64)

    def write(self, key: tuple[int, int, int, int], records: UInt8) -> None:
        """Write a node with its points (n, size), n > 0."""
        stored = fields(records, self.head.point_format)
        xyz = coordinates(records, self.head.scales, self.head.offsets)
        self.low, self.high = np.minimum(self.low, xyz.min(axis=0)), np.maximum(self.high, xyz.max(axis=0))
        self.times = min(self.times[0], stored["gps_time"].min()), max(self.times[1], stored["gps_time"].max())
        self.returns += np.bincount(stored["bit_fields"] & 0b1111, minlength=16)
        self.nodes.append(key)
        self.pending.append(np.ascontiguousarray(records).reshape(-1))
        if sum(map(len, self.pending)) >= _AT_ONCE * self.head.record_size:
            self._compress()

    def close(self) -> None:
        """Complete the file: write the hierarchy, and update header and info record."""
        self._compress()
        self.compressor.done()
        self.file.flush()
        hierarchy = self._hierarchy()
        self.file.seek(0, 2)
        head = replace(self.head, extended=(Record(b"copc", 1000, b"EPT hierarchy", hierarchy), *self.head.extended))
        place = self.file.tell()
        for record in head.extended:
            self.file.write(record.pack(extended=True))
        corners = np.column_stack([self.high, self.low]).ravel().tolist()
        counts = self.returns[1:].tolist()
        info = struct.pack("<5dQQ2d", *self.cube, place + _EVLR_HEAD, len(hierarchy), *self.times)
        patches = [
            (179, struct.pack("<6dQ", *corners, 0)),
            head.place_of_extended(place),
            (247, struct.pack("<16Q", int(self.returns.sum()), *counts)),
            (HEADER_SIZE + _VLR_HEAD, info),
        ]
        for at, data in patches:
            self.file.seek(at)
            self.file.write(data)

    def _compress(self) -> None:
        if self.pending:
            self.compressor.compress_chunks(self.pending)
            self.pending = []

    def _hierarchy(self) -> bytes:
        """Return the hierarchy: key, offset and length of the chunk, and number of points of each node."""
        self.file.seek(self.begin)
        table = np.array(lazrs.read_chunk_table(self.file, self.vlr), np.int64).reshape(-1, 2)
        entries = np.zeros(len(self.nodes), np.dtype([("key", "<4i4"), ("place", "<u8"), ("size", "<i4"), ("points", "<i4")]))
        entries["key"] = self.nodes
        entries["points"], entries["size"] = table.T
        entries["place"] = self.begin + 8 + np.concatenate([[0], np.cumsum(table[:-1, 1])])
        return entries.tobytes()


@contextmanager
def writing_copc(path: Path, head: Head, low: Float, edge: float, spacing: float) -> Iterator[CopcWriter]:
    """Write a new file, which is complete when the block succeeds; parameters as for `CopcWriter`.

    Raises
    ------
    OSError
        If the disk is full or fails.
    """
    with path.open("x+b") as plain, write_errors_raised(plain) as file:
        writer = CopcWriter(file, head, low, edge, spacing)
        yield writer
        writer.close()
