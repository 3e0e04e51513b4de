"""Points of scan files as they are stored, for who works through all of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import CHUNK, Ranges, Raw


def read_raw(
    path: Path, dimension: str | None, size: int = CHUNK, ranges: Ranges | None = None, *, colours: bool = False
) -> Iterator[Raw]:
    """Read a scan file chunk by chunk, without turning its numbers into others.

    Parameters
    ----------
    path : Path
        Scan file, of the format that its suffix says; a COPC file is read as the LAZ file that it is.
    dimension : str or None
        Name of the dimension taken as intensity; None takes none.
    size : int
        Greatest number of points of a chunk.
    ranges : sequence of (int, int), or None
        Half-open ranges of point numbers, from 0, that are read, in this order; None reads the whole file. The numbers
        are those that counting the points of the whole file gives. What lies between ranges is skipped without
        decoding, to the bounds of the file's own chunks (LAZ: 50 000 points by default; E57: the scans; text: blocks of lines).
    colours : bool
        Whether colours are wanted, of the formats whose colours are read (LAS, LAZ, E57).

    Yields
    ------
    Raw
        In file order within a range. `size` points each but the last of a range; fewer where the file comes in
        pieces of varying size (COPC, E57, text).

    Raises
    ------
    InputError
        If the file is missing, truncated or corrupt, has fewer points than the ranges say, or lacks the dimension.
    """
    form = format_of(path)
    if colours and form.has_colours is not None:
        return form.read(path, dimension, size, ranges, True)
    return form.read(path, dimension, size, ranges)
