"""Points of scan files as they are stored, for who works through all of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tunneldb.pointcloud.formats.e57 import is_e57, read_e57
from tunneldb.pointcloud.formats.las import read_las
from tunneldb.pointcloud.points import CHUNK, Ranges, Raw


def read_raw(path: Path, dimension: str | None, size: int = CHUNK, ranges: Ranges | None = None) -> Iterator[Raw]:
    """Read a scan file chunk by chunk, without turning its numbers into others.

    Parameters
    ----------
    path : Path
        LAS, LAZ or E57 file (``.e57``); a COPC file is read as the LAZ file that it is.
    dimension : str or None
        Name of the dimension taken as intensity; None takes none.
    size : int
        Greatest number of points of a chunk.
    ranges : sequence of (int, int), or None
        Half-open ranges of point numbers, from 0, that are read, in this order; None reads the whole file. The numbers
        are those that counting the points of the whole file gives. What lies between ranges is skipped without
        decoding, to the bounds of the file's own chunks (LAZ: 50 000 points by default; E57: the scans).

    Yields
    ------
    Raw
        In file order within a range. `size` points each but the last of a range; fewer where the file comes in
        pieces of varying size (COPC, E57).

    Raises
    ------
    UserError
        If the file is missing, truncated or corrupt, has fewer points than the ranges say, or lacks the dimension.
    """
    read = read_e57 if is_e57(path) else read_las
    return read(path, dimension, size, ranges)
