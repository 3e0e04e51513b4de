"""Points of scan files as stored, for processing all of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import CHUNK, Ranges, Raw


def read_raw(
    path: Path,
    dimension: str | None,
    size: int = CHUNK,
    ranges: Ranges | None = None,
    *,
    units: Units = IN_METRES,
    colours: bool = False,
) -> Iterator[Raw]:
    """Read a scan file chunk by chunk, without converting its numbers.

    Parameters
    ----------
    path : Path
        Scan file, of the format of its suffix; a COPC file is read as LAZ.
    dimension : str or None
        Name of the dimension used as intensity; None for none.
    size : int
        Greatest number of points of a chunk.
    ranges : sequence of (int, int), or None
        Half-open ranges of point numbers, from 0, to read in this order; None for the whole file. Points are numbered as in
        the whole file. Points between ranges are skipped without decoding, up to the bounds of the file's own chunks (LAZ:
        50 000 points by default; E57: scans; text: blocks of lines).
    units : Units
        Units of the coordinates, which become part of scales and offsets.
    colours : bool
        True to read colours, of files that have them.

    Yields
    ------
    Raw
        In file order within a range, with `size` points each except the last of a range; fewer if the file has chunks of
        variable size (COPC, E57, text).

    Raises
    ------
    InputError
        If the file is missing, truncated or corrupt, has fewer points than the ranges say, or lacks the dimension.
    """
    chunks = format_of(path).read(path, dimension, size, ranges, colours)
    return chunks if units.metric else (raw.in_metres(units) for raw in chunks)
