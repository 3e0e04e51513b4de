"""Where the scanner stood when it measured a point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import point_inner, point_kernel
from tunneldb.pointcloud.pose_coverage import PoseCoverage
from tunneldb.pointcloud.reader import Points
from tunneldb.threads import in_blocks

# Over a longer interval than both the scanner's place is not interpolated: a trolley that speeds up by 1 m/s² is 0.1 m off
# in the middle of a second.
LONGEST_GAP = 1.0  # s
GAP_INTERVALS = 10  # times the median interval of the trajectory

_BLOCK = 1 << 18  # points at a time


@dataclass(frozen=True)
class PoseModel:
    """Scanner positions: one station a scan, or a trajectory interpolated linearly at ``gps_time``; or none at all.

    Nothing is interpolated over a gap: longer than LONGEST_GAP and than GAP_INTERVALS of the trajectory's own intervals.

    Attributes
    ----------
    scan_id, station : (k,) int64 and (k, 3) float64 arrays
        Stations in growing scan_id, m; empty for a mobile scanner.
    time, track : (m,) and (m, 3) float64 arrays
        Trajectory in growing time, s and m; empty for a static scanner.
    longest : float
        Longest interval of the trajectory that is interpolated over, s.
    """

    scan_id: Int64
    station: Float
    time: Float
    track: Float
    longest: float = LONGEST_GAP

    @classmethod
    def from_stations(cls, scan_id: Int64, station: Float) -> PoseModel:
        """Static scanner: stations (k, 3) of the scans with these numbers (k,)."""
        order = np.argsort(scan_id)
        return cls(np.asarray(scan_id, np.int64)[order], np.asarray(station, np.float64)[order], np.empty(0), np.empty((0, 3)))

    @classmethod
    def from_trajectory(cls, time: Float, track: Float, longest: float | None = None) -> PoseModel:
        """Mobile scanner: positions (m, 3) at these times (m,); of a part of a trajectory ``longest`` is that of the whole."""
        order = np.argsort(time)
        time, track = np.asarray(time, np.float64)[order], np.asarray(track, float)[order]
        return cls(np.empty(0, np.int64), np.empty((0, 3)), time, track, longest_interval(time) if longest is None else longest)

    @classmethod
    def unknown(cls) -> PoseModel:
        """Scanner of which it is known of no point where it was."""
        return cls(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0), np.empty((0, 3)))

    @property
    def empty(self) -> bool:
        """Whether it is known of no point where the scanner was, and so is nothing that any of them lacks."""
        return not len(self.time) and not len(self.scan_id)

    @cached_property
    def gaps(self) -> Float:
        """Gaps of the trajectory: times from and to, (g, 2), s."""
        before = np.flatnonzero(np.diff(self.time) > self.longest)
        return np.column_stack([self.time[before], self.time[before + 1]])

    @property
    def mobile(self) -> bool:
        """Whether positions come from a trajectory."""
        return len(self.time) > 0

    @cached_property
    def coverage(self) -> PoseCoverage:
        """What positions there are."""
        return PoseCoverage(self.scan_id, (float(self.time[0]), float(self.time[-1])) if self.mobile else None, self.gaps)

    def positions(self, points: Points) -> Float:
        """Scanner position of each of n points, (n, 3), in the tunnel's SRID, m; NaN where it is not known."""
        if self.empty:
            return np.full((len(points), 3), np.nan)
        if self.mobile:
            out = np.empty((len(points), 3))
            in_blocks(lambda begin, end: _interpolate(self.time, self.track, points.time, out, begin, end), len(points), _BLOCK)
        else:
            out = self.station[np.minimum(np.searchsorted(self.scan_id, points.scan_id), len(self.scan_id) - 1)]
        known = self.coverage.known(points)
        if not known.all():
            out[~known] = np.nan
        return out


def longest_interval(time: Float) -> float:
    """Longest interval of a trajectory with these growing times (m,) that is interpolated over, s."""
    if len(time) < 2:
        return LONGEST_GAP
    return max(LONGEST_GAP, GAP_INTERVALS * float(np.median(np.diff(time))))


@point_inner
def interval(time: Float, wanted: float, hint: int) -> int:  # pragma: no cover - compiled
    """Number of the last of growing times that is not later than the one wanted, or 0; looked for from a hint on."""
    last = time.shape[0] - 1
    # Points come nearly in order of time, so the last interval, or the next, is mostly the right one.
    if time[hint] <= wanted and (hint == last or wanted < time[hint + 1]):
        return hint
    if hint + 2 <= last and time[hint + 1] <= wanted < time[hint + 2]:
        return hint + 1
    low, high = 0, last + 1
    while low < high:
        middle = (low + high) >> 1
        if wanted < time[middle]:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


@point_inner
def position_at(time: Float, track: Float, wanted: float, k: int) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Place of the trajectory at a time in its interval ``k``."""
    j = min(k + 1, time.shape[0] - 1)
    length = time[j] - time[k]
    share = min(max((wanted - time[k]) / length, 0.0), 1.0) if length > 0.0 else 0.0
    return (
        track[k, 0] + share * (track[j, 0] - track[k, 0]),
        track[k, 1] + share * (track[j, 1] - track[k, 1]),
        track[k, 2] + share * (track[j, 2] - track[k, 2]),
    )


@point_kernel
def _interpolate(
    time: Float, track: Float, wanted: Float, out: Float, begin: int, end: int
) -> None:  # pragma: no cover - compiled
    k = np.int64(0)
    for i in range(begin, end):
        k = interval(time, wanted[i], k)
        out[i, 0], out[i, 1], out[i, 2] = position_at(time, track, wanted[i], k)
