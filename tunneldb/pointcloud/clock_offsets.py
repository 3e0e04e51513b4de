"""Usual differences between the clocks of scans and trajectories."""

from __future__ import annotations

WEEK = 604_800.0
"""GPS week, s."""

_DAY, _HOUR = 86_400.0, 3_600.0  # s
_UNIX_TO_GPS = 315_964_800.0  # s from 1970 to the beginning of GPS time, without leap seconds
_ADJUSTED = 1e9  # s that LAS subtracts from GPS time
_MAX_ZONE = 14  # h
_MAX_DAYS = 6
_MIN_WEEKS = 52  # fewer are not a time since 1980
_MAX_WEEKS = 5000  # until 2075

_STEPS: tuple[tuple[float, str, str], ...] = (
    (18.0, "UTC", "GPS time"),
    (37.0, "UTC", "TAI"),
    (19.0, "GPS time", "TAI"),
)
"""Seconds by which the second clock is ahead of the first since 2017 (IERS Bulletin C)."""

_FORMER_STEPS: tuple[tuple[float, str, str], ...] = tuple((seconds, "UTC", "GPS time") for seconds in (17.0, 16.0, 15.0, 14.0))
"""The same for surveys since 2006, before the later leap seconds."""

_FORMER_TOLERANCE = 0.3  # s

_EPOCHS: tuple[tuple[float, str, str], ...] = (
    (_ADJUSTED, "adjusted GPS time", "GPS time"),
    (_UNIX_TO_GPS - 18.0, "GPS time", "Unix time"),
    (_UNIX_TO_GPS, "GPS time", "Unix time without leap seconds"),
    (_UNIX_TO_GPS - 18.0 + _ADJUSTED, "adjusted GPS time", "Unix time"),
)


def explain_offset(seconds: float, tolerance: float) -> list[tuple[float, str]]:
    """Return the usual clock differences near a difference between a trajectory and a scan, the nearest first.

    Parameters
    ----------
    seconds : float
        Seconds to add to the trajectory's times.
    tolerance : float
        Greatest distance from a usual difference, s.

    Returns
    -------
    list of (float, str)
        Exact seconds to add, and the cause.
    """
    found = []
    for ahead, first, second in (*_STEPS, *_EPOCHS):
        found.append((ahead, _differ(first, second)))
        found.append((-ahead, _differ(second, first)))
    for ahead, first, second in _FORMER_STEPS:
        if abs(abs(seconds) - ahead) <= _FORMER_TOLERANCE:
            found.append((ahead, _differ(first, second)))
            found.append((-ahead, _differ(second, first)))
    for unit, limit, cause in (
        (_HOUR, _MAX_ZONE, "whole hours: a time zone"),
        (_DAY, _MAX_DAYS, "whole days: seconds of the day and seconds of the week"),
        (WEEK, _MAX_WEEKS, "whole GPS weeks: {}"),
    ):
        count = round(seconds / unit)
        if not 0 < abs(count) <= limit:
            continue
        order = ("seconds of the GPS week", "GPS time")
        epoch = _differ(*(order if count > 0 else order[::-1])) if abs(count) > _MIN_WEEKS else "the week is another one"
        text = cause.format(epoch)
        found.append((count * unit, text))
        for step, first, second in _STEPS[:2]:
            found += [
                (count * unit + step, f"{text}; and {step:g} s: {_differ(first, second)}"),
                (count * unit - step, f"{text}; and {step:g} s: {_differ(second, first)}"),
            ]
    near = [(exact, text) for exact, text in found if abs(exact - seconds) <= tolerance]
    return sorted(near, key=lambda one: abs(one[0] - seconds))


def guess_clocks(trajectory: float, scan: float) -> str:
    """Return a guess which clocks a trajectory and a scan with these times (s) have, if they differ; else an empty text."""
    in_week = [0.0 <= time <= WEEK for time in (trajectory, scan)]
    if in_week[0] != in_week[1]:
        names = ("seconds of the GPS week", "time since an epoch")
        return _differ(names[in_week[1]], names[in_week[0]])
    for seconds, first, second in _EPOCHS:
        if abs(abs(scan - trajectory) - seconds) < WEEK:
            return _differ(first, second) if scan > trajectory else _differ(second, first)
    return ""


def _differ(trajectory: str, scan: str) -> str:
    return f"the trajectory seems to be in {trajectory}, the file in {scan}"
