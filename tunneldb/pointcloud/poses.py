"""Where the scanner stood when it measured a point."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.compiled import point_inner, point_kernel
from tunneldb.pointcloud.reader import Points
from tunneldb.threads import in_blocks

# Times in a CSV are rounded; beyond the ends of the trajectory they may be off by this much, s.
TIME_TOLERANCE = 0.001

# Over a longer interval than both the scanner's place is not interpolated: a trolley that speeds up by 1 m/s² is 0.1 m off
# in the middle of a second.
LONGEST_GAP = 1.0  # s
GAP_INTERVALS = 10  # times the median interval of the trajectory

_WEEK = 604_800.0  # s
_UNIX_TO_GPS = 315_964_800.0  # s from 1970 to the beginning of GPS time, without leap seconds

_BLOCK = 1 << 18  # points at a time


@dataclass
class PoseFaults:
    """Points whose scanner position is unknown; add those of several chunks with `+`.

    Attributes
    ----------
    outside : int
        Number of points whose time lies outside the trajectory.
    gap : int
        Number of points in its gaps.
    before, after : float
        How far the worst of them lie before its start and after its end, s.
    unknown : dict of int to int
        Number of points of each scan_id that has no station.
    guess : str
        Why the times may differ.
    """

    outside: int = 0
    gap: int = 0
    before: float = 0.0
    after: float = 0.0
    unknown: dict[int, int] = field(default_factory=dict)
    guess: str = ""

    @property
    def points(self) -> int:
        """All of them."""
        return self.outside + self.gap + sum(self.unknown.values())

    def __bool__(self) -> bool:
        return self.points > 0

    def __add__(self, other: PoseFaults) -> PoseFaults:
        unknown = dict(self.unknown)
        for scan_id, count in other.unknown.items():
            unknown[scan_id] = unknown.get(scan_id, 0) + count
        return PoseFaults(
            self.outside + other.outside,
            self.gap + other.gap,
            max(self.before, other.before),
            max(self.after, other.after),
            unknown,
            self.guess or other.guess,
        )

    def text(self) -> str:
        """What is wrong and what to do, for the user."""
        if self.unknown:
            scans = ", ".join(f"{scan} ({count} points)" for scan, count in sorted(self.unknown.items())[:10])
            more = f" and {len(self.unknown) - 10} more" if len(self.unknown) > 10 else ""
            return (
                f"no station for scan_id {scans}{more}; add them to the stations of the survey "
                "(scan_id is a LAS file's point_source_id; an E57 or PTX file brings its own: survey add … --stations FILE.e57)"
            )
        where = [
            f"up to {seconds:.3f} s {side}"
            for seconds, side in ((self.before, "before its start"), (self.after, "after its end"))
            if seconds > 0
        ]
        lost = [f"gps_time of {self.outside} points is outside the trajectory, {' and '.join(where)}"] if self.outside else []
        lost += [f"{self.gap} points were measured in gaps of the trajectory"] if self.gap else []
        return f"{' and '.join(lost)}; {self.guess or 'give the whole trajectory, in the time that the file uses'}"


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
    """

    scan_id: Int64
    station: Float
    time: Float
    track: Float

    @classmethod
    def from_stations(cls, scan_id: Int64, station: Float) -> PoseModel:
        """Static scanner: stations (k, 3) of the scans with these numbers (k,)."""
        order = np.argsort(scan_id)
        return cls(np.asarray(scan_id, np.int64)[order], np.asarray(station, np.float64)[order], np.empty(0), np.empty((0, 3)))

    @classmethod
    def from_trajectory(cls, time: Float, track: Float) -> PoseModel:
        """Mobile scanner: positions (m, 3) at these times (m,)."""
        order = np.argsort(time)
        return cls(
            np.empty(0, np.int64), np.empty((0, 3)), np.asarray(time, np.float64)[order], np.asarray(track, float)[order]
        )

    @classmethod
    def unknown(cls) -> PoseModel:
        """Scanner of which it is known of no point where it was."""
        return cls(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0), np.empty((0, 3)))

    @property
    def empty(self) -> bool:
        """Whether it is known of no point where the scanner was, and so is nothing that any of them lacks."""
        return not len(self.time) and not len(self.scan_id)

    @cached_property
    def longest(self) -> float:
        """Longest interval that is interpolated over, s."""
        if len(self.time) < 2:
            return LONGEST_GAP
        return max(LONGEST_GAP, GAP_INTERVALS * float(np.median(np.diff(self.time))))

    @cached_property
    def gaps(self) -> Float:
        """Gaps of the trajectory: times from and to, (g, 2), s."""
        before = np.flatnonzero(np.diff(self.time) > self.longest)
        return np.column_stack([self.time[before], self.time[before + 1]])

    @property
    def mobile(self) -> bool:
        """Whether positions come from a trajectory."""
        return len(self.time) > 0

    def faults(self, points: Points) -> PoseFaults:
        """Count the points whose scanner position is unknown."""
        if len(points) == 0 or self.empty:
            return PoseFaults()
        if self.mobile:
            outside = points.time[~self._covers(points.time)]
            gap = int(np.count_nonzero(self._in_gap(points.time)))
            before, after = (float(np.nanmax(off, initial=0.0)) for off in (self.time[0] - outside, outside - self.time[-1]))
            guess = _clocks(self.time, outside) if len(outside) else ""
            return PoseFaults(len(outside), gap, before, after, guess=guess)
        scans, counts = _count_scans(points.scan_id)
        known = np.isin(scans, self.scan_id)
        return PoseFaults(unknown=dict(zip(scans[~known].tolist(), counts[~known].tolist(), strict=True)))

    def known(self, points: Points) -> Bool:
        """Which points' scanner position is known; all, where none is asked for."""
        if self.empty:
            return np.ones(len(points), np.bool_)
        if self.mobile:
            return self._covers(points.time) & ~self._in_gap(points.time)
        return np.isin(points.scan_id, self.scan_id)

    def positions(self, points: Points) -> Float:
        """Scanner position of each of n points, (n, 3), in the tunnel's SRID, m; NaN where it is not known."""
        if self.empty:
            return np.full((len(points), 3), np.nan)
        if self.mobile:
            out = np.empty((len(points), 3))
            in_blocks(lambda begin, end: _interpolate(self.time, self.track, points.time, out, begin, end), len(points), _BLOCK)
        else:
            out = self.station[np.minimum(np.searchsorted(self.scan_id, points.scan_id), len(self.scan_id) - 1)]
        if self.faults(points):
            out[~self.known(points)] = np.nan
        return out

    def _covers(self, time: Float) -> Bool:
        return (time >= self.time[0] - TIME_TOLERANCE) & (time <= self.time[-1] + TIME_TOLERANCE)

    def _in_gap(self, time: Float) -> Bool:
        inside = np.zeros(len(time), np.bool_)
        for begin, end in self.gaps:
            inside |= (time > begin + TIME_TOLERANCE) & (time < end - TIME_TOLERANCE)
        return inside


def _clocks(track: Float, points: Float) -> str:
    """Which clocks a trajectory and points outside of it seem to have, where these are others; said as a guess."""
    one, other = float(np.median(track)), float(np.median(points))
    in_week = [0.0 <= time <= _WEEK for time in (one, other)]
    if in_week[0] != in_week[1]:
        names = ("seconds of the GPS week", "time since an epoch")
        return f"the trajectory seems to be in {names[in_week[1]]}, the file in {names[in_week[0]]}: bring them to one"
    for seconds, names in ((1e9, ("adjusted GPS time", "GPS time")), (_UNIX_TO_GPS, ("GPS time", "Unix time"))):
        if abs(abs(other - one) - seconds) < _WEEK:
            return f"the trajectory seems to be in {names[one > other]}, the file in {names[other > one]}: bring them to one"
    return ""


def _count_scans(scan_id: Int32) -> tuple[Int64, Int64]:
    low, high = int(scan_id.min()), int(scan_id.max())
    if high - low > 1_000_000:
        scans, counts = np.unique(scan_id, return_counts=True)
        return scans.astype(np.int64), counts
    counts = np.bincount(scan_id - low)
    present = np.flatnonzero(counts)
    return present + low, counts[present]


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
