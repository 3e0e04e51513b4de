"""Seconds of the GPS week that begin anew during a survey."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float
from tunneldb.pointcloud.clock_offsets import WEEK
from tunneldb.pointcloud.pose_checks import MAX_SPEED, MIN_JUMP

_ROUNDING = 1e-6  # s


def continue_week(time: Float, xyz: Float | None = None) -> Float:
    """Return times (n,) that continue to grow after the end of the GPS week, s; unchanged if they do not begin anew.

    Parameters
    ----------
    time : (n,) float array
        Times in the order of measurement, or sorted, s.
    xyz : (n, 3) float array or None
        Positions of a trajectory, m: sorted times continue at the week's end only if the scanner can have moved from the last
        position to the first one.
    """
    if len(time) < 2 or time.min() < 0.0 or time.max() > WEEK:
        return time
    steps = np.diff(time)
    backwards = np.flatnonzero(steps <= 0.0)
    if len(backwards) == 1 and steps[backwards[0]] < -WEEK / 2.0:
        return np.where(np.arange(len(time)) > backwards[0], time + WEEK, time)
    if len(backwards) or steps.max() < WEEK / 2.0:
        return time
    if xyz is not None:
        between = time[0] + WEEK - time[-1]
        if np.linalg.norm(xyz[0] - xyz[-1]) > MIN_JUMP + MAX_SPEED * between:
            return time
    return np.where(np.arange(len(time)) <= int(np.argmax(steps)), time + WEEK, time)


def cover_week_end(time: Float, xyz: Float, longest: float) -> tuple[Float, Float]:
    """Return a trajectory that has poses for scans whose times begin anew at the week's end, and for others.

    Poses after the end are repeated a week earlier, from the position at the end on.

    Parameters
    ----------
    time, xyz : (n,) and (n, 3) float arrays
        Trajectory with ascending times, s, and positions, m.
    longest : float
        Longest interval that is interpolated over, s.
    """
    if not (0.0 <= time[0] < WEEK < time[-1] < time[0] + WEEK):
        return time, xyz
    later = time > WEEK
    first = int(np.argmax(later))
    if time[first] - time[first - 1] <= longest:
        at_end = np.array([[np.interp(WEEK, time, column) for column in xyz.T]])
        if time[first - 1] < WEEK:
            time, xyz = np.insert(time, first, WEEK), np.insert(xyz, first, at_end, axis=0)
            later = np.insert(later, first, True)
        else:
            later[first - 1] = True
    return np.concatenate([time[later] - WEEK, time]), np.concatenate([xyz[later], xyz])


def count_repeats(time: Float) -> int:
    """Return how many of the first poses of a trajectory, with ascending times (n,), `cover_week_end` has repeated."""
    if not len(time) or not (0.0 <= time[0] < WEEK < time[-1] < 2.0 * WEEK):
        return 0
    count = int(np.searchsorted(time, time[-1] - WEEK + _ROUNDING))
    repeated = 0 < count < len(time) and time[count - 1] > time[-1] - WEEK - _ROUNDING
    return count if repeated and time[count] > time[count - 1] + WEEK / 2.0 else 0
