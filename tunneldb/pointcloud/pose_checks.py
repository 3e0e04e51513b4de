"""Whether scanner positions can be those of a scan of a tunnel: what lies elsewhere is an error of the list."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.alignment import Alignment

FARTHEST_ASIDE = 25.0
"""A scanner stands no farther from the axis, m: as far as the points that are loaded, unless that is set otherwise."""

FARTHEST_BEYOND = 500.0
"""Nor farther from the nearest vertex of the axis where it stands beyond its ends, m: from there it does not see in."""

FASTEST = 50.0
"""Nor does it move faster, m/s; a measuring train drives 120 km/h."""

JUMP = 1.0
"""What is nearer to where its neighbours lead is no jump, however short the time between, m."""


def far_from_axis(xyz: Float, alignment: Alignment) -> Float:
    """How far positions that cannot be those of a scanner in the tunnel are from the axis.

    Parameters
    ----------
    xyz : (n, 3) float array
        Positions, in the tunnel's frame, m.
    alignment : Alignment
        The given axis.

    Returns
    -------
    (n,) float array
        m; 0 for positions that can be.
    """
    aside = alignment.distance(xyz)
    beyond = np.isnan(aside)
    distance = np.where(beyond, 0.0, aside)
    limit = np.where(beyond, FARTHEST_BEYOND, FARTHEST_ASIDE)
    ends = alignment.vertices[[0, -1]]
    distance[beyond] = np.linalg.norm(xyz[beyond, None] - ends, axis=2).min(axis=1)
    return np.where(distance > limit, distance, 0.0)


def jumps(time: Float, xyz: Float) -> Bool:
    """Which poses (n,) of a trajectory lie off where those before and after lead, farther than a scanner can have moved.

    Parameters
    ----------
    time : (n,) float array
        Growing, s.
    xyz : (n, 3) float array
        m.
    """
    found = np.zeros(len(time), np.bool_)
    if len(time) < 3:
        return found
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    between = xyz[:-2] + share * (xyz[2:] - xyz[:-2])
    speed = np.linalg.norm(np.diff(xyz, axis=0), axis=1) / np.diff(time)
    off = np.linalg.norm(xyz[1:-1] - between, axis=1) > JUMP
    found[1:-1] = off & (speed[:-1] > FASTEST) & (speed[1:] > FASTEST)
    return found
