"""Box in the header of a scan file, compared with the box of its points.

Writers leave the box of an earlier file, of the first points, or zeros. So it is only a hint, and a difference is reported.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float
from tunneldb.pointcloud.points import MAX_COORDINATE, ScanHeader

TOLERANCE = 1.0
"""Difference of a bound that is not reported, m: half of a voxel or a rounded box is no error of a writer."""


def has_box(header: ScanHeader) -> bool:
    """Return True if the header states a box that points can have: finite, and not inverted."""
    return bool(np.isfinite([header.low, header.high]).all() and np.all(header.low <= header.high))


def in_box(header: ScanHeader, xyz: Float) -> bool:
    """Return True if all points (n, 3) lie in the header's box, up to the tolerance."""
    return bool(np.all((xyz >= header.low - TOLERANCE) & (xyz <= header.high + TOLERANCE)))


def describe_box_difference(header: ScanHeader, box: Float) -> str | None:
    """Return a note if the header's box is not that of the points, with both values of each axis that differs.

    Parameters
    ----------
    header : ScanHeader
    box : (6,) float array
        Least and greatest x, y, z of all points with valid coordinates, m; infinite if there are none.

    Returns
    -------
    str or None
        None if no bound differs by more than `TOLERANCE`. A box that is not tight may be larger by as much as a rotation can
        enlarge it.
    """
    low, high = box[:3], box[3:]
    if not np.isfinite(box).all():
        return None
    room = TOLERANCE if header.tight else TOLERANCE + float(np.linalg.norm(high - low))
    with np.errstate(invalid="ignore"):
        same = (header.low <= low + TOLERANCE) & (header.low >= low - room)
        same &= (header.high >= high - TOLERANCE) & (header.high <= high + room)
    axes = np.flatnonzero(~same)
    if not len(axes):
        return None
    stated, found = (
        ", ".join(f"{'xyz'[axis]} {_number(ends[0][axis])} to {_number(ends[1][axis])}" for axis in axes)
        for ends in ((header.low, header.high), (low, high))
    )
    return f"its header states the box {stated}, but its points lie in {found}; the points are used"


def _number(value: float) -> str:
    return f"{value:.1f}" if abs(value) < MAX_COORDINATE else f"{value:.3g}"
