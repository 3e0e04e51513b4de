"""Scanner position for each point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import inner, lower_bound, point_inner, point_kernel
from tunneldb.pointcloud.pose_coverage import TIME_TOLERANCE, PoseCoverage
from tunneldb.pointcloud.reader import Points
from tunneldb.threads import in_blocks

# Positions are not interpolated over an interval longer than both: a trolley that accelerates by 1 m/s² deviates 0.1 m
# in the middle of a second.
MAX_GAP = 1.0  # s
MAX_GAP_INTERVALS = 10  # times the median interval of the trajectory

_BLOCK = 1 << 18  # points at a time


@dataclass(frozen=True)
class PoseModel:
    """Scanner positions: one station per scan, a trajectory interpolated linearly at ``gps_time``, or none.

    Positions are not interpolated over gaps: intervals longer than MAX_GAP and than MAX_GAP_INTERVALS median intervals.

    Attributes
    ----------
    scan_id, station : (k,) int64 and (k, 3) float64 arrays
        Stations in ascending scan_id, m; empty for a mobile scanner.
    time, track : (m,) and (m, 3) float64 arrays
        Trajectory in ascending time, s and m; empty for a static scanner.
    longest : float
        Longest interval of the trajectory that is interpolated, s.
    """

    scan_id: Int64
    station: Float
    time: Float
    track: Float
    longest: float = MAX_GAP

    @classmethod
    def from_stations(cls, scan_id: Int64, station: Float) -> PoseModel:
        """Return a static scanner with stations (k, 3) of the scans with these numbers (k,)."""
        order = np.argsort(scan_id)
        return cls(np.asarray(scan_id, np.int64)[order], np.asarray(station, np.float64)[order], np.empty(0), np.empty((0, 3)))

    @classmethod
    def from_trajectory(cls, time: Float, track: Float, longest: float | None = None) -> PoseModel:
        """Return a mobile scanner with positions (m, 3) at times (m,); ``longest`` is that of the whole trajectory."""
        order = np.argsort(time)
        time, track = np.asarray(time, np.float64)[order], np.asarray(track, float)[order]
        return cls(np.empty(0, np.int64), np.empty((0, 3)), time, track, longest_interval(time) if longest is None else longest)

    @classmethod
    def unknown(cls) -> PoseModel:
        """Return a scanner without any known position."""
        return cls(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0), np.empty((0, 3)))

    @property
    def empty(self) -> bool:
        """True if no scanner position is known for any point, so that none is required."""
        return not len(self.time) and not len(self.scan_id)

    @cached_property
    def gaps(self) -> Float:
        """Return the gaps of the trajectory: times from and to, (g, 2), s."""
        before = np.flatnonzero(np.diff(self.time) > self.longest)
        return np.column_stack([self.time[before], self.time[before + 1]])

    @property
    def mobile(self) -> bool:
        """True if positions come from a trajectory."""
        return len(self.time) > 0

    @cached_property
    def coverage(self) -> PoseCoverage:
        """Return the available positions."""
        return PoseCoverage(self.scan_id, (float(self.time[0]), float(self.time[-1])) if self.mobile else None, self.gaps)

    def positions(self, points: Points) -> Float:
        """Return the scanner position of each of n points, (n, 3), in the tunnel's SRID, m; NaN if unknown."""
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
    """Return the longest interval of a trajectory with ascending times (m,) that is interpolated, s."""
    if len(time) < 2:
        return MAX_GAP
    return max(MAX_GAP, MAX_GAP_INTERVALS * float(np.median(np.diff(time))))


@point_inner
def interval(time: Float, moment: float, hint: int) -> int:  # pragma: no cover - compiled
    """Return the index of the last of ascending times that is not after ``moment``, or 0; the search begins at ``hint``."""
    last = time.shape[0] - 1
    # Points are nearly in order of time, so the previous interval or the next one is mostly right.
    if time[hint] <= moment and (hint == last or moment < time[hint + 1]):
        return hint
    if hint + 2 <= last and time[hint + 1] <= moment < time[hint + 2]:
        return hint + 1
    low, high = 0, last + 1
    while low < high:
        middle = (low + high) >> 1
        if moment < time[middle]:
            high = middle
        else:
            low = middle + 1
    return max(low - 1, 0)


@point_inner
def position_at(time: Float, track: Float, moment: float, k: int) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return the position of the trajectory at a time in its interval ``k``."""
    j = min(k + 1, time.shape[0] - 1)
    length = time[j] - time[k]
    share = min(max((moment - time[k]) / length, 0.0), 1.0) if length > 0.0 else 0.0
    return (
        track[k, 0] + share * (track[j, 0] - track[k, 0]),
        track[k, 1] + share * (track[j, 1] - track[k, 1]),
        track[k, 2] + share * (track[j, 2] - track[k, 2]),
    )


@point_inner
def known_interval(time: Float, longest: float, wanted: float, hint: int) -> tuple[int, bool]:  # pragma: no cover - compiled
    """Return the trajectory's interval at a time, and True if the position there is known: between its ends, not in a gap."""
    if not (time[0] - TIME_TOLERANCE <= wanted <= time[-1] + TIME_TOLERANCE):
        return hint, False
    k = interval(time, wanted, hint)
    if k + 1 < time.shape[0]:
        since, until = wanted - time[k], time[k + 1] - wanted
        if since + until > longest and since > TIME_TOLERANCE and until > TIME_TOLERANCE:
            return k, False
    return k, True


@inner
def station_of(scans: Int64, scan: int) -> int:  # pragma: no cover - compiled
    """Return the number of a scan's station in the increasing ``scans``, -1 if it has none."""
    station = lower_bound(scans, scan, 0, scans.shape[0])
    return station if station < scans.shape[0] and scans[station] == scan else -1


@point_kernel
def _interpolate(
    time: Float, track: Float, moments: Float, out: Float, begin: int, end: int
) -> None:  # pragma: no cover - compiled
    k = np.int64(0)
    for i in range(begin, end):
        k = interval(time, moments[i], k)
        out[i, 0], out[i, 1], out[i, 2] = position_at(time, track, moments[i], k)
