"""Kilometres that a file probably touches, before it is read: by its header, and by a sample where the header is doubtful.

These order the work: a kilometre waits for the files that are expected there. Which kilometres are processed, the points of
the files decide (`tunnel_internal.queue_request`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.pipeline.load import chainages_near, header_kilometres
from tunneldb.pointcloud.file_sample import read_runs
from tunneldb.pointcloud.formats.las_bounds import header_box
from tunneldb.pointcloud.formats.table import format_of
from tunneldb.pointcloud.header_box import has_box, in_box
from tunneldb.pointcloud.reader import ScanHeader
from tunneldb.pointcloud.stated_crs import StatedCrs

RUNS, RUN_POINTS = 50, 100
"""Number of runs of points that are sampled, and points of a run."""


def expected_kilometres(header: ScanHeader, alignment: Alignment, reach: float, wanted: range | None) -> range | None:
    """Return the kilometres that a readable file may touch, from the first to the last.

    The box in the header is used, unless it would leave the file out: then a sample of its points is read.

    Parameters
    ----------
    header : ScanHeader
    alignment : Alignment
        Given axis.
    reach : float
        Greatest distance of the tunnel from the axis, m.
    wanted : range or None
        Kilometres to which the batch is restricted; None for all.

    Returns
    -------
    range or None
        None if unknown: neither the box nor the sample is near the axis, and they contradict each other.

    Raises
    ------
    UserError
        If its points lie off the axis by both, or cannot be read.
    """
    boxed = header_kilometres(header, alignment, reach) if has_box(header) else range(0)
    if boxed and (wanted is None or set(boxed) & set(wanted)):
        return boxed
    xyz = np.concatenate(list(read_runs(header.path, header.points, RUNS, RUN_POINTS, header.units)))
    sampled = _kilometres(xyz, alignment, reach)
    if boxed or sampled:
        return range(min([*boxed, *sampled]), max([*boxed, *sampled]) + 1)
    if len(xyz) and has_box(header) and in_box(header, xyz):
        raise UserError(f"{header.path}: its points lie off the given axis; does the file belong to this tunnel?")
    return None


def _kilometres(xyz: Float, alignment: Alignment, reach: float) -> range:
    """Return the kilometres of points near the axis, from the first to the last; empty if there are none."""
    chainage, distance = alignment.locate(xyz)
    km = np.floor(chainage[distance <= reach] / KILOMETRE).astype(int)
    return range(int(km.min()), int(km.max()) + 1) if len(km) else range(0)


def damaged_kilometres(path: Path, alignment: Alignment, reach: float) -> range:
    """Return the kilometres that fail with an unreadable file: those of its box, if that is readable.

    They are those in which the axis crosses the box, and not just comes near its ends.
    """
    header = _damaged_header(path)
    ends = None if header is None else extent(header, alignment, reach)
    return range(0) if ends is None else range(int(ends[0] // KILOMETRE), int(ends[1] // KILOMETRE) + 1)


def kilometres_near_damaged(path: Path, alignment: Alignment, reach: float) -> range:
    """Return the kilometres that an unreadable file may touch; they are requested like those of readable files."""
    header = _damaged_header(path)
    return range(0) if header is None else header_kilometres(header, alignment, reach)


def _damaged_header(path: Path) -> ScanHeader | None:
    """Return the header of an unreadable file with its box, if that is readable."""
    box = header_box(path) if format_of(path).is_las else None
    return None if box is None else ScanHeader(path, 0, (), StatedCrs(), np.array(box[0]), np.array(box[1]))


def extent(header: ScanHeader, alignment: Alignment, reach: float) -> tuple[float, float] | None:
    """Return the first and last chainage of a file, by its box; rather too short than too long.

    The part of the axis within the reach of the box is shortened at both ends by 1.5 times the reach, since the box may be
    oblique to the axis, and by one step of the axis.

    Parameters
    ----------
    header : ScanHeader
    alignment : Alignment
        Given axis.
    reach : float
        Greatest distance of the tunnel from the axis, m.

    Returns
    -------
    tuple or None
        Two chainages, m; None if the file is not near the axis.
    """
    chainage = chainages_near(header, alignment, reach)
    if not len(chainage):
        return None
    margin = min(1.5 * reach + alignment.spacing, float(np.ptp(chainage)) / 2.0)
    return float(chainage.min()) + margin, float(chainage.max()) - margin
