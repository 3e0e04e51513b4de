"""LAZ files, written chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import lazrs
import numpy as np

from tunneldb.arrays import UInt8
from tunneldb.pointcloud.formats.las_header import Head
from tunneldb.pointcloud.formats.las_records import record_size
from tunneldb.threads import threads


class LazWriter:
    """Writer of the points of one LAZ file.

    Parameters
    ----------
    file : binary file
        Empty file, open for writing.
    head : Head
        Header and records around the points; its point format is that of the points.
    """

    def __init__(self, file: BinaryIO, head: Head) -> None:
        self.file = file
        self.head = head
        vlr = lazrs.LazVlr.new_for_compression(head.point_format, head.record_size - record_size(head.point_format))
        file.write(head.before_points(vlr.record_data()))
        self.compressor = (lazrs.LasZipCompressor if threads() == 1 else lazrs.ParLasZipCompressor)(file, vlr)

    def write(self, records: UInt8) -> None:
        """Write points (n, size)."""
        self.compressor.compress_many(np.ascontiguousarray(records).reshape(-1))

    def close(self, patch: tuple[int, bytes] | None = None) -> None:
        """End the points, write the records after them, and update the header."""
        self.compressor.done()
        self.file.seek(0, 2)
        at, packed = self.head.place_of_extended(self.file.tell())
        for record in self.head.extended:
            self.file.write(record.pack(extended=True))
        for place, data in [patch, (at, packed)] if patch else [(at, packed)]:
            self.file.seek(place)
            self.file.write(data)


@contextmanager
def writing(path: Path, head: Head) -> Iterator[LazWriter]:
    """Write a new file, which is complete once the writer is closed.

    Raises
    ------
    OSError
        If the disk is full or fails.
    """
    with path.open("xb") as plain, write_errors_raised(plain) as file:
        yield LazWriter(file, head)


@contextmanager
def write_errors_raised(plain: BinaryIO) -> Iterator[BinaryIO]:
    """Yield a file to compress into; an error of the block is raised as the cause of the failed write.

    Raises
    ------
    OSError
        If the disk is full or fails.
    """
    file = _ErrorKeepingFile(plain)
    try:
        yield file  # type: ignore[misc]  # has all methods that are needed
    except lazrs.LazrsError as error:
        raise file.error or error from error


class _ErrorKeepingFile:
    """File that stores the error of a failed write, which the compressor does not pass on."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.error: OSError | None = None
        self.seek, self.tell, self.read = file.seek, file.tell, file.read

    def write(self, data: bytes) -> int:
        try:
            return self.file.write(data)
        except OSError as error:
            self.error = error
            raise

    def flush(self) -> None:
        try:
            self.file.flush()
        except OSError as error:
            self.error = error
            raise
