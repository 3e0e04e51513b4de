"""LAZ files with chunks of variable size, for example COPC.

lazrs reads them in order, but its `seek` arrives at wrong points (version 0.8.2, one thread and several). So the chunks
with the requested points are found here by the file's chunk table.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

import laspy
import lazrs
import numpy as np
from laspy import DecompressionSelection
from numpy.typing import NDArray

LAYERED = 6
"""First point format whose chunks state their number of points."""


def count_points(source: BinaryIO, header: laspy.LasHeader) -> int | None:
    """Return the number of points in the chunks of a LAZ file, whatever its header states; None if they do not state it.

    Source: LASzip, chunks of layered points: the first point as it is, then the number of points, 32 bits.
    """
    if not header.are_points_compressed or header.point_format.id < LAYERED or VariedChunks.has(header):
        return None
    vlr = lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data)
    source.seek(header.offset_to_point_data)
    sizes = [size for _, size in lazrs.read_chunk_table(source, vlr)]
    if not sizes:
        return 0
    source.seek(header.offset_to_point_data + 8 + sum(sizes[:-1]) + header.point_format.size)
    return (len(sizes) - 1) * int(vlr.chunk_size()) + int.from_bytes(source.read(4), "little")


class VariedChunks:
    """Chunks of a LAZ file.

    Parameters
    ----------
    source : binary file
        File open for reading; it is not closed here.
    header : LasHeader
        Header of the file, with its LASzip record.
    selection : DecompressionSelection
        Parts of a point to decompress.
    """

    def __init__(self, source: BinaryIO, header: laspy.LasHeader, selection: DecompressionSelection) -> None:
        self.source, self.header, self.selection = source, header, selection
        self.vlr = header.vlrs.get("LasZipVlr")[0].record_data
        source.seek(header.offset_to_point_data)
        table = np.array(lazrs.read_chunk_table(source, lazrs.LazVlr(self.vlr)), np.int64).reshape(-1, 2)
        self.sizes = table
        self.points = np.concatenate([[0], np.cumsum(table[:, 0])])
        self.places = header.offset_to_point_data + 8 + np.concatenate([[0], np.cumsum(table[:, 1])])
        if self.points[-1] != header.point_count:
            raise ValueError(f"its chunks hold {self.points[-1]} points, but its header states {header.point_count}")

    @staticmethod
    def has(header: laspy.LasHeader) -> bool:
        """Return True if a file's chunks vary in size."""
        if not header.are_points_compressed:
            return False
        return bool(lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data).uses_variable_size_chunks())

    def read(self, begin: int, end: int, size: int) -> Iterator[laspy.ScaleAwarePointRecord]:
        """Read points begin to end (half-open), in chunks of at most `size`."""
        chunk = int(np.searchsorted(self.points, begin, side="right")) - 1
        while begin < end:
            last = chunk + 1  # whole chunks with at most `size` points in total, or one chunk
            while last < len(self.sizes) and self.points[last] < end and self.points[last + 1] - self.points[chunk] <= size:
                last += 1
            array = self._decompress(chunk, last)
            first = int(self.points[chunk])
            stop = min(int(self.points[last]), end)
            for at in range(begin, stop, size):
                part = array[at - first : min(at + size, stop) - first]
                yield laspy.ScaleAwarePointRecord(part, self.header.point_format, self.header.scales, self.header.offsets)
            begin, chunk = stop, last

    def _decompress(self, chunk: int, last: int) -> NDArray[np.void]:
        dtype = self.header.point_format.dtype()
        out = np.zeros(int(self.points[last] - self.points[chunk]), dtype)
        self.source.seek(int(self.places[chunk]))
        data = self.source.read(int(self.places[last] - self.places[chunk]))
        table = [(int(points), int(length)) for points, length in self.sizes[chunk:last] if points]
        lazrs.decompress_points_with_chunk_table(data, self.vlr, out.view(np.uint8), table, self.selection.to_lazrs())
        return out
