"""Mean colours of spots, by another pass over the files with coloured points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.pipeline.members import FileMembers, Inputs, find_members, read_all
from tunneldb.pointcloud.colour_depth import EIGHT_BITS
from tunneldb.pointcloud.formats.table import has_colours
from tunneldb.pointcloud.reader import read_header
from tunneldb.progress import StartProgress


def find_coloured_members(inputs: Inputs, begin: StartProgress) -> FileMembers:
    """Find the members of scan files, with the mean colours of spots; see `find_members`.

    Only points with a colour count; exporters write black for a point that has none.
    """
    members = find_members(inputs, begin)
    structures = members.found.structures
    coloured = [path for path in inputs.paths if has_colours(path)] if structures.spots else []
    if not coloured:
        return members
    progress = begin("colours", sum(read_header(path).points for path in coloured))
    sums, counts, notes = np.zeros((len(structures.spots), 3)), np.zeros(len(structures.spots), np.int64), []
    for path in coloured:
        total, count, most = _sums(replace(inputs, paths=(path,)), members, progress)
        if 0 < most <= EIGHT_BITS:
            total *= 65535 // EIGHT_BITS
            notes.append(f"{path.name}: no colour is above {EIGHT_BITS}, so colours are read as 8 bits")
        sums += total
        counts += count
    spots = [
        replace(spot, rgb=_mean(total, int(count))) for spot, total, count in zip(structures.spots, sums, counts, strict=True)
    ]
    found = replace(members.found, structures=replace(structures, spots=spots))
    return replace(members, found=found, notes=(*members.notes, *notes))


def _sums(inputs: Inputs, members: FileMembers, progress: Callable[[float], None]) -> tuple[Float, Int64, int]:
    """Return sums of the colours of each spot's points (k, 3), their number (k,), and the greatest value of all."""
    finder, found = members.segmentation.finder, members.found
    size = len(found.structures.spots) + 1
    sums, counts, most = np.zeros((size, 3)), np.zeros(size, np.int64), 0
    for points, scan, use in read_all(inputs, progress, colours=True):
        if points.colour is None:
            continue
        use = use[points.colour[use].any(axis=1)]
        if not len(use):
            continue
        colour = points.colour[use]
        most = max(most, int(colour.max()))
        spot = found.of_points(*finder.find(points.xyz[use], scan[use]))[2]
        on = np.flatnonzero(spot)
        counts += np.bincount(spot[on], minlength=size)
        # Whole numbers below 2^53 add up exactly, in any order.
        sums += np.column_stack([np.bincount(spot[on], colour[on, k], size) for k in range(3)])
    return sums[1:], counts[1:], most


def _mean(total: Float, count: int) -> tuple[int, int, int] | None:
    if not count:
        return None
    red, green, blue = np.rint(total / count * (EIGHT_BITS / 65535)).astype(int).tolist()
    return red, green, blue
