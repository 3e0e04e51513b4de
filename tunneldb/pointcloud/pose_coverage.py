"""Coverage of points by known scanner positions."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.counted import counted
from tunneldb.pointcloud.clock_offsets import guess_clocks
from tunneldb.pointcloud.points import Points

# Tolerance for times beyond the ends of the trajectory, s: times in a CSV are rounded.
TIME_TOLERANCE = 0.001


@dataclass
class PoseFaults:
    """Points with unknown scanner position; faults of several chunks are added with `+`.

    Attributes
    ----------
    outside : int
        Number of points whose time lies outside the trajectory.
    gap : int
        Number of points in gaps of the trajectory.
    before, after : float
        Greatest time before its start and after its end, s.
    unknown : dict of int to int
        Number of points of each scan_id without a station.
    guess : str
        Guess why the times differ.
    """

    outside: int = 0
    gap: int = 0
    before: float = 0.0
    after: float = 0.0
    unknown: dict[int, int] = field(default_factory=dict)
    guess: str = ""

    @property
    def points(self) -> int:
        """Total number of these points."""
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
        """Return the message for the user: the fault and what to do."""
        if self.unknown:
            scans = ", ".join(f"{scan} ({counted(count, 'point')})" for scan, count in sorted(self.unknown.items())[:10])
            more = f" and {len(self.unknown) - 10} more" if len(self.unknown) > 10 else ""
            return (
                f"no station for scan_id {scans}{more}; add them to the survey's stations "
                "(scan_id is a LAS file's point_source_id; E57 and PTX files have their own: survey add … --stations FILE.e57)"
            )
        where = [
            f"up to {seconds:.3f} s {side}"
            for seconds, side in ((self.before, "before its start"), (self.after, "after its end"))
            if seconds > 0
        ]
        lost = (
            [f"gps_time of {counted(self.outside, 'point')} is outside the trajectory, {' and '.join(where)}"]
            if self.outside
            else []
        )
        lost += [f"{counted(self.gap, 'point lies', 'points lie')} in gaps of the trajectory"] if self.gap else []
        whole = "give the whole trajectory, in the time system of the file"
        return f"{' and '.join(lost)}; {self.guess + '; convert one of them' if self.guess else whole}"


@dataclass(frozen=True)
class PoseCoverage:
    """Available scanner positions: stations of some scans, a trajectory with gaps, or none.

    Attributes
    ----------
    scan_id : (k,) int64 array
        Scans that have a station, ascending; empty for a mobile scanner.
    ends : (float, float) or None
        Start and end time of the trajectory, s; None for a static scanner.
    gaps : (g, 2) float64 array
        Start and end times of gaps, ascending, s.
    """

    scan_id: Int64
    ends: tuple[float, float] | None
    gaps: Float

    @property
    def empty(self) -> bool:
        """True if no scanner position is known for any point, so that none is required."""
        return not self.mobile and not len(self.scan_id)

    @property
    def mobile(self) -> bool:
        """True if positions come from a trajectory."""
        return self.ends is not None

    def faults(self, points: Points) -> PoseFaults:
        """Count the points whose scanner position is unknown."""
        if len(points) == 0 or self.empty:
            return PoseFaults()
        if self.ends is not None:
            outside = points.time[~_covers(self.ends, points.time)]
            gap = int(np.count_nonzero(_in_gap(self.gaps, points.time)))
            before, after = (float(np.nanmax(off, initial=0.0)) for off in (self.ends[0] - outside, outside - self.ends[1]))
            guess = guess_clocks(sum(self.ends) / 2.0, float(np.median(outside))) if len(outside) else ""
            return PoseFaults(len(outside), gap, before, after, guess=guess)
        scans, counts = _count_scans(points.scan_id)
        known = np.isin(scans, self.scan_id)
        return PoseFaults(unknown=dict(zip(scans[~known].tolist(), counts[~known].tolist(), strict=True)))

    def known(self, points: Points) -> Bool:
        """Return True for points with a known scanner position; all True if none is required."""
        if self.empty:
            return np.ones(len(points), np.bool_)
        if self.ends is not None:
            return _covers(self.ends, points.time) & ~_in_gap(self.gaps, points.time)
        return np.isin(points.scan_id, self.scan_id)


def _covers(ends: tuple[float, float], time: Float) -> Bool:
    return (time >= ends[0] - TIME_TOLERANCE) & (time <= ends[1] + TIME_TOLERANCE)


def _in_gap(gaps: Float, time: Float) -> Bool:
    """Return True for times (n,) in gaps; there can be thousands."""
    if not len(gaps):
        return np.zeros(len(time), np.bool_)
    last = np.searchsorted(gaps[:, 0] + TIME_TOLERANCE, time) - 1  # last gap that begins before
    return np.asarray((last >= 0) & (time < gaps[last, 1] - TIME_TOLERANCE))


def _count_scans(scan_id: Int32) -> tuple[Int64, Int64]:
    low, high = int(scan_id.min()), int(scan_id.max())
    if high - low > 1_000_000:
        scans, counts = np.unique(scan_id, return_counts=True)
        return scans.astype(np.int64), counts
    counts = np.bincount(scan_id - low)
    present = np.flatnonzero(counts)
    return present + low, counts[present]
