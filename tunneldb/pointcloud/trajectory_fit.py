"""Comparison of a trajectory with the points measured from it: distances along the tunnel, and the time offset that fits."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tunneldb.arrays import Float
from tunneldb.pointcloud.clock_offsets import explain_offset, guess_clocks
from tunneldb.pointcloud.pose_checks import MAX_SPEED
from tunneldb.pointcloud.week_end import continue_week, count_repeats

MIN_POINTS = 500
"""Number of points below which nothing is concluded."""

WRONG = 5.0
"""Distance along the tunnel of a profile's points from the scanner from which the pose is certainly not theirs, m."""

DOUBTFUL = 1.0
"""Distance from which a usual clock difference that removes it is reported, m."""

MAX_WRONG_SHARE = 0.2
"""Share of profiles with a wrong pose from which a scan does not fit its trajectory."""

MIN_WRONG_SHARE = 0.01
"""Share of profiles with a wrong pose from which it is reported."""

_GROUP = 60  # least number of points that are compared together
_GROUPS = 3000
_SECONDS = 2.0  # in which a mirror turns at least once
_SECTORS = 12  # of a section that points close
_CLOSED_LIMIT = 1.5  # m outside a closed section from which a scanner cannot have measured it
_OPEN_LIMIT = 6.0  # m, the same for a part of a section: a scanner that measures the crown or one wall only is outside it
_LENGTH = 5.0  # m of tunnel whose points span a section
_SPREAD = (5.0, 95.0)  # percentiles of the points along the tunnel between which the scanner may be
_CAP = 20.0  # m; greater distances count as this one
_SEARCH_POINTS, _FINE_POINTS = 160, 2000
_SEARCH_STEPS = 8000
_SEARCH_STEP = 2.0  # m that the scanner moves at its typical speed
_MIN_REDUCTION = 0.4  # of the mean distance, for a time offset to be the cause
_SAME = 0.1  # m by which two explanations differ that explain the points equally well
_MIN_SPEED = 0.002  # m/s, standing included; slower ones are of times in another unit
_SCALES = ((1e-3, "milliseconds", "divide them by 1000"), (1e-6, "microseconds", "divide them by 1000000"),
           (1e-9, "nanoseconds", "divide them by 1000000000"))  # fmt: skip


@dataclass(frozen=True)
class Track:
    """Trajectory relative to a tunnel's line.

    Attributes
    ----------
    time : (m,) float64 array
        Ascending, s.
    place : (m, 3) float64 array
        Distance along the line, to its right, and height, m.
    longest : float
        Longest interval that is interpolated over, s.
    """

    time: Float
    place: Float
    longest: float

    def at(self, time: Float, columns: int = 3) -> Float:
        """Return the first columns of the place at times (n,), (n, columns); NaN where it is unknown."""
        out = np.column_stack([np.interp(time, self.time, self.place[:, column]) for column in range(columns)])
        after = np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1)
        gap = self.time[after] - self.time[after - 1] > self.longest
        out[gap | (time < self.time[0]) | (time > self.time[-1])] = np.nan
        return out


@dataclass(frozen=True)
class TrajectoryFit:
    """Comparison of a scan with its trajectory.

    Attributes
    ----------
    distance, greatest : float
        Median and 95th percentile of the distance along the tunnel between the scanner and the points of its time, m.
    wrong : float
        Share of profiles that are farther than WRONG from their pose, or have none.
    known : float
        Share of points with a pose.
    outside : float
        Median distance of the scanner outside the section that the points near it span, m; 0 if it is possible.
    offset : float or None
        Seconds to add to the trajectory's times, so that it fits; None if there is none, or it fits.
    cause : str
        Probable cause of the offset; empty if unknown.
    clocks : str
        Clocks that the times seem to be of, if the offset is not a usual one.
    scale : str
        Unit of the trajectory's times, if it is not the second, and the conversion.
    remaining : float
        Mean distance with this offset, m.
    shift : float
        Distance along the tunnel from the trajectory to the points, m, if it explains them as well; else 0.
    """

    distance: float
    greatest: float
    wrong: float
    known: float
    outside: float
    offset: float | None = None
    cause: str = ""
    clocks: str = ""
    scale: str = ""
    remaining: float = 0.0
    shift: float = 0.0

    @property
    def refused(self) -> bool:
        """True if results from this trajectory would be wrong."""
        return self.wrong > MAX_WRONG_SHARE or self.outside > 0.0 or (bool(self.cause) and self.distance > WRONG / 2.0)

    @property
    def doubtful(self) -> bool:
        """True if a part of the poses, or their time by a little, is wrong."""
        return self.wrong > MIN_WRONG_SHARE or (bool(self.cause) and self.distance > DOUBTFUL)


def fit_trajectory(time: Float, place: Float, track: Track) -> TrajectoryFit | None:
    """Compare a sample of a mobile scanner's points with its trajectory; None if there are too few points.

    Points of a profiler lie at the scanner's pose along the tunnel; those of a scanner that sees ahead and back lie on both
    sides of it, or ahead. Only the distance outside the `_SPREAD` percentiles of the points measured together is counted.

    Parameters
    ----------
    time : (n,) float array
        Times of the points, s.
    place : (n, 3) float array
        Their distance along the tunnel's line, to its right, and height, m.
    track : Track
        Trajectory.
    """
    finite = np.isfinite(time)
    time, place = time[finite], place[finite]
    if len(time) < MIN_POINTS or len(track.time) < 2:
        return None
    order = np.argsort(time, kind="stable")
    time, place = time[order], place[order]
    scanner = track.at(time)
    unknown = 1.0 - float(np.isfinite(scanner[:, 0]).mean())
    distance = _distances(time, place[:, 0], scanner[:, 0])
    posed = np.isfinite(distance)
    wrong = (float((distance[posed] > WRONG).mean()) if posed.any() else 0.0) * (1.0 - unknown)
    median, greatest = np.percentile(distance[posed], [50.0, 95.0]) if posed.any() else (np.nan, np.nan)
    outside = outside_section(place, scanner)
    fit = TrajectoryFit(float(median), float(greatest), wrong, 1.0 - unknown, outside)
    if unknown < MIN_WRONG_SHARE and wrong <= MIN_WRONG_SHARE and fit.distance <= DOUBTFUL:
        return fit
    return _explained(time, place[:, 0], track, fit)


def _distances(time: Float, along: Float, at: Float) -> Float:
    """Return the distance along the tunnel of groups of points, ascending in time, from the scanner (g,), m; NaN without one.

    A group spans whole profiles: a part of a profile of a tilted mirror lies ahead of the scanner or behind it.
    """
    covered = float(np.minimum(np.diff(time), 1.0).sum())
    size = min(max(_GROUP, math.ceil(len(time) * _SECONDS / max(covered, _SECONDS)), math.ceil(len(time) / _GROUPS)), len(time))
    count = len(time) // size
    away = (along - at)[: count * size].reshape(count, size)
    whole = np.isfinite(away).all(axis=1)
    distance = np.full(count, np.nan)
    if whole.any():
        least, most = np.percentile(away[whole], _SPREAD, axis=1)
        distance[whole] = np.maximum(np.maximum(least, -most), 0.0)
    return distance


def outside_section(place: Float, scanner: Float) -> float:
    """Return the median distance of scanner positions from the section that the points near them span, m; 0 if possible.

    Parameters
    ----------
    place, scanner : (n, 3) float arrays
        Points, and the scanner's position of each: distance along the tunnel, to the right, and height, m; NaN if unknown.
    """
    known = np.isfinite(scanner[:, 0])
    place, scanner = place[known], scanner[known]
    part = np.floor(place[:, 0] / _LENGTH).astype(np.int64)
    order = np.argsort(part, kind="stable")
    found = []
    for chosen in np.split(order, np.flatnonzero(np.diff(part[order])) + 1):
        if len(chosen) < _GROUP:
            continue
        least, most = np.percentile(place[chosen, 1:], [2.0, 98.0], axis=0)
        where = np.median(scanner[chosen, 1:], axis=0)
        beyond = float(np.linalg.norm(np.maximum(np.maximum(least - where, where - most), 0.0)))
        closed = _closed(place[chosen, 1:] - (least + most) / 2.0)
        limit = _CLOSED_LIMIT if closed else max(_OPEN_LIMIT, float(np.linalg.norm(most - least)))
        found.append(beyond if beyond > limit else 0.0)
    return float(np.median(found)) if found else 0.0


def _closed(away: Float) -> bool:
    """Return True if points (n, 2), relative to the middle of their section, lie all round it."""
    sector = np.floor(np.arctan2(away[:, 1], away[:, 0]) / np.pi * _SECTORS / 2.0).astype(np.int64) % _SECTORS
    return bool(np.count_nonzero(np.bincount(sector, minlength=_SECTORS)) == _SECTORS)


def _explained(time: Float, along: Float, track: Track, fit: TrajectoryFit) -> TrajectoryFit:
    """Return the comparison with the time offset that fits, if there is one."""
    time = continue_week(time)
    order = np.argsort(time, kind="stable")
    time, along = time[order], along[order]
    random = np.random.default_rng(1)
    fine = np.sort(random.choice(len(time), min(len(time), _FINE_POINTS), replace=False))
    moments, places = time[fine], along[fine]
    here = _mean_distance(moments, places, track, 0.0)
    shift, shifted = _shift(moments, places, track)
    for scale, unit, advice in ((1.0, "", ""), *_SCALES):
        scaled = _without_repeat(Track(track.time * scale, track.place, track.longest * scale))
        duration = scaled.time[-1] - scaled.time[0]
        path = float(np.abs(np.diff(scaled.place[:, 0])).sum())
        if 2.0 * duration < time[-1] - time[0] or not _MIN_SPEED * duration < path < MAX_SPEED * duration:
            continue
        offset = _search(moments, places, scaled)
        remaining = _mean_distance(moments, places, scaled, offset)
        if remaining > _MIN_REDUCTION * here or remaining > WRONG:
            continue
        said = f"{unit}: {advice}" if unit else ""
        for exact, cause in explain_offset(offset, max(0.6, 0.3 / _speed(scaled))):
            if _mean_distance(moments, places, scaled, exact) <= remaining + DOUBTFUL:
                return replace(fit, offset=exact, cause=cause, scale=said, remaining=remaining)
        clocks = guess_clocks(float(np.mean(scaled.time[[0, -1]])), float(np.median(moments)))
        fit = replace(fit, offset=round(offset, 1), clocks=clocks, scale=said, remaining=remaining)
        break
    if shifted <= _MIN_REDUCTION * here and (fit.offset is None or shifted <= fit.remaining + _SAME) and not fit.scale:
        better = fit.offset is not None and fit.remaining > shifted + _SAME
        return replace(fit, shift=shift, offset=None if better else fit.offset)
    return fit


def _without_repeat(track: Track) -> Track:
    """Return a trajectory without the poses that are repeated for the beginning of the week."""
    repeats = count_repeats(track.time)
    return Track(track.time[repeats:], track.place[repeats:], track.longest)


def _shift(time: Float, along: Float, track: Track) -> tuple[float, float]:
    """Return the median distance from a trajectory to its points along the tunnel, and the mean distance that remains, m."""
    away = along - track.at(time, 1)[:, 0]
    if not np.isfinite(away).any():
        return 0.0, _CAP
    shift = float(np.nanmedian(away))
    return shift, float(np.minimum(np.nan_to_num(np.abs(away - shift), nan=_CAP), _CAP).mean())


def _speed(track: Track) -> float:
    """Return the scanner's typical speed along the tunnel where it moves, m/s; at least 0.05."""
    speed = np.abs(np.diff(track.place[:, 0])) / np.maximum(np.diff(track.time), 1e-9)
    moving = speed[speed > 0.05]
    return float(np.median(moving)) if len(moving) else 0.05


def _mean_distance(time: Float, along: Float, track: Track, offset: float) -> float:
    """Return the mean distance of points from the scanner along the tunnel, m, each at most _CAP."""
    away = np.abs(along - track.at(time - offset, 1)[:, 0])
    return float(np.minimum(np.nan_to_num(away, nan=_CAP), _CAP).mean())


def _search(time: Float, along: Float, track: Track) -> float:
    """Return the seconds to add to a trajectory's times that bring it nearest to points."""
    some = np.linspace(0, len(time) - 1, min(len(time), _SEARCH_POINTS)).astype(int)
    few, places = time[some], along[some]
    low, high = float(time[0] - track.time[-1]), float(time[-1] - track.time[0])
    # Half of the points must have a pose.
    middle = float(np.median(time))
    low, high = max(low, middle - float(track.time[-1])), min(high, middle - float(track.time[0]))
    step = max((high - low) / _SEARCH_STEPS, min(_SEARCH_STEP / _speed(track), (high - low) / 200.0), 1e-3)
    tried = np.arange(low, high + step, step)
    if low < 0.0 < high:
        tried = np.append(tried, 0.0)
    best = min(tried.tolist(), key=lambda one: _mean_distance(few, places, track, one))
    while step > 0.02:
        tried = best + step * np.linspace(-1.0, 1.0, 9)
        best = min(tried.tolist(), key=lambda one: _mean_distance(time, along, track, one))
        step /= 4.0
    return float(best)
