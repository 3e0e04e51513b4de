"""Sample of a scan file: short runs of points, spread evenly over the file, which are read without reading the rest."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.geometry.units import IN_METRES, Units
from tunneldb.pointcloud.formats.e57 import read_e57_beginnings
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.points import CHUNK, Points

BLOCK = 50_000
"""Points of a chunk of LAZ: a run that begins with a chunk is decoded without the points before it."""


def read_runs(path: Path, points: int, runs: int, length: int, units: Units = IN_METRES) -> Iterator[Float]:
    """Read runs of consecutive points, the first at the beginning of the file.

    Parameters
    ----------
    path : Path
    points : int
        Number of points in the file.
    runs, length : int
        Greatest number of runs, and of points of a run. E57 has no access by number, so these are beginnings of its scans.
    units : Units
        Units of the file's coordinates.

    Yields
    ------
    (n, 3) float64 array
        Coordinates of a run, m, without invalid ones; may be empty.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    form = format_of(path)
    if form.name == "E57":
        for raw in read_e57_beginnings(path, runs, length):
            yield Points.of(raw.in_metres(units)).located().xyz
        return
    blocks = max(-(-points // BLOCK), 1)
    begins = np.unique(np.linspace(0, blocks - 1, min(runs, blocks)).astype(int)) * BLOCK
    ranges = [(begin, min(begin + length, points)) for begin in begins.tolist()]
    parts, missing = [np.empty((0, 3))], iter([end - begin for begin, end in ranges])
    left = next(missing)
    for raw in form.read(path, None, CHUNK, ranges):  # a range may come in parts
        parts.append(Points.of(raw.in_metres(units)).located().xyz)
        left -= len(raw)
        if left <= 0:
            yield np.concatenate(parts)
            parts, left = [np.empty((0, 3))], next(missing, 0)
