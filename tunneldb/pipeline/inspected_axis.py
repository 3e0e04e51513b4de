"""Comparison of the axis beside a scan file with its points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy  # its modules are imported on first use: they take long

from tunneldb.arrays import Float
from tunneldb.csvfile import read_csv
from tunneldb.errors import UserError
from tunneldb.geometry.misplacement import explain_misplacement

MAX_DISTANCE = 25.0
"""Distance of all points from the axis from which it is not theirs, m: the default distance up to which points are loaded."""

_STEP = 5.0  # m between places of the axis
_MAX_PLACES = 1_000_000
_POINTS = 5000


def doubt_axis(path: Path, xyz: Float) -> str | None:
    """Return why a table of an axis is not that of points (n, 3), m; None if it can be.

    Parameters
    ----------
    path : Path
        Table with x and y.
    xyz : (n, 3) float array
        Sample of the points.
    """
    try:
        table = read_csv(path, ("x", "y"))
    except UserError as error:
        return str(error)
    xy = table.columns(("x", "y"))
    if len(xy) < 2:
        return f"{path}: an axis needs at least 2 rows, this one has {len(xy)}"
    places = _dense(xy)
    some = xyz[np.linspace(0, len(xyz) - 1, min(len(xyz), _POINTS)).astype(int)]
    nearest = float(scipy.spatial.cKDTree(places).query(some[:, :2])[0].min())
    if nearest <= MAX_DISTANCE:
        return None
    guess = explain_misplacement(some, np.column_stack([places, np.zeros(len(places))]), MAX_DISTANCE)
    return (
        f"{path.name}: the axis is not near the points: {nearest:.0f} m at the nearest; "
        f"{guess or 'check that it is of this tunnel, and in its coordinate system'}"
    )


def _dense(xy: Float) -> Float:
    """Return places (k, 2) at most _STEP apart along a line of vertices."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    count = min(int(along[-1] / _STEP) + 2, _MAX_PLACES)
    return np.column_stack([np.interp(np.linspace(0.0, along[-1], count), along, column) for column in xy.T])
