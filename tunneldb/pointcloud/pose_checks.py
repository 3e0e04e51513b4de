"""Plausibility of scanner positions: positions far from the tunnel, or impossibly fast, are errors of the list."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.alignment import Alignment

MAX_AXIS_DISTANCE = 25.0
"""Greatest distance of a scanner from the axis, m: the default distance up to which points are loaded."""

MAX_END_DISTANCE = 500.0
"""Greatest distance of a scanner beyond the ends of the axis, m; from farther away it cannot see into the tunnel."""

MAX_SPEED = 50.0
"""Greatest speed of a scanner, m/s; a measuring train drives 120 km/h."""

MIN_JUMP = 1.0
"""Greatest deviation from the neighbours' line that is not a jump, m, however short the time between."""


def far_from_axis(xyz: Float, alignment: Alignment) -> Float:
    """Return the distance from the axis of positions that cannot be those of a scanner in the tunnel.

    Parameters
    ----------
    xyz : (n, 3) float array
        Positions, in the tunnel's frame, m.
    alignment : Alignment
        Given axis.

    Returns
    -------
    (n,) float array
        Distance, m; 0 for plausible positions.
    """
    lateral = alignment.distance(xyz)
    beyond = np.isnan(lateral)
    distance = np.where(beyond, 0.0, lateral)
    limit = np.where(beyond, MAX_END_DISTANCE, MAX_AXIS_DISTANCE)
    ends = alignment.vertices[[0, -1]]
    distance[beyond] = np.linalg.norm(xyz[beyond, None] - ends, axis=2).min(axis=1)
    return np.where(distance > limit, distance, 0.0)


def jumps(time: Float, xyz: Float) -> Bool:
    """Return True for poses (n,) of a trajectory that deviate from their neighbours by more than a scanner can have moved.

    Parameters
    ----------
    time : (n,) float array
        Time, ascending, s.
    xyz : (n, 3) float array
        Positions, m.
    """
    found = np.zeros(len(time), np.bool_)
    if len(time) < 3:
        return found
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    between = xyz[:-2] + share * (xyz[2:] - xyz[:-2])
    speed = np.linalg.norm(np.diff(xyz, axis=0), axis=1) / np.diff(time)
    off = np.linalg.norm(xyz[1:-1] - between, axis=1) > MIN_JUMP
    found[1:-1] = off & (speed[:-1] > MAX_SPEED) & (speed[1:] > MAX_SPEED)
    return found
