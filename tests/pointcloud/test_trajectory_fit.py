"""Profiles of a tube along a straight line, measured from a trajectory whose clock, line or unit is changed."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.pointcloud.clock_offsets import WEEK, explain_offset
from tunneldb.pointcloud.trajectory_fit import Track, fit_trajectory

RADIUS = 3.0  # m
GPS = 1_400_000_000.0  # s
RATE = 10.0  # poses a second


def drive(speeds: list[tuple[float, float]], start: float = GPS) -> Track:
    """A trajectory of stretches of so many seconds at so many m/s."""
    speed = np.concatenate([np.full(round(seconds * RATE), metres) for seconds, metres in speeds])
    along = np.concatenate([[0.0], np.cumsum(speed / RATE)])
    time = start + np.arange(len(along)) / RATE
    return Track(time, np.column_stack([along, 0.0 * along, 0.0 * along]), 1.0)


def measure(track: Track, *, tilt: float = 0.0, reach: float = 0.0, ahead: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and places of points on a tube round the trajectory, of a mirror that turns 50 times a second."""
    rng = np.random.default_rng(1)
    time = np.sort(rng.uniform(track.time[0], track.time[-1], 20_000))
    angle = 100.0 * np.pi * (time - time[0])
    place = track.at(time)
    place[:, 0] += RADIUS * np.tan(tilt) * np.cos(angle) + ahead + rng.uniform(-reach, reach, len(time))
    place[:, 1:] += RADIUS * np.column_stack([np.sin(angle), np.cos(angle)])
    return time, place


def moved(track: Track, seconds: float = 0.0, scale: float = 1.0, aside: float = 0.0) -> Track:
    return Track((track.time + seconds) * scale, track.place + np.array([0.0, aside, 0.0]), track.longest * scale)


STOPS = drive([(30.0, 0.0), (40.0, 1.0), (30.0, 0.0), (20.0, 0.6), (30.0, 0.0)])


@pytest.mark.parametrize(
    ("seconds", "cause"),
    [
        (18.0, "in UTC, the file in GPS time"),
        (-18.0, "in GPS time, the file in UTC"),
        (37.0, "in UTC, the file in TAI"),
        (-37.0, "in TAI, the file in UTC"),
        (19.0, "in GPS time, the file in TAI"),
        (17.0, "in UTC, the file in GPS time"),
        (3600.0, "whole hours: a time zone"),
        (-7200.0, "whole hours: a time zone"),
        (3618.0, "whole hours: a time zone; and 18 s: the trajectory seems to be in UTC, the file in GPS time"),
        (2 * 86_400.0, "whole days: seconds of the day and seconds of the week"),
        (WEEK, "whole GPS weeks: the week is another one"),
        (2314 * WEEK, "in seconds of the GPS week, the file in GPS time"),
        (1e9, "in adjusted GPS time, the file in GPS time"),
        (-315_964_782.0, "in Unix time, the file in GPS time"),
        (315_964_782.0, "in GPS time, the file in Unix time"),
    ],
)
def test_the_offset_and_its_usual_cause_are_found(seconds: float, cause: str) -> None:
    fit = fit_trajectory(*measure(STOPS), moved(STOPS, -seconds))
    assert fit is not None
    assert fit.offset == seconds
    assert fit.cause.endswith(cause)
    assert fit.remaining < 0.05
    assert fit.refused or fit.known < 0.9
    # what the message advises leaves nothing
    fixed = fit_trajectory(*measure(STOPS), moved(STOPS, -seconds + fit.offset))
    assert fixed is not None
    assert not fixed.refused
    assert not fixed.doubtful


def test_an_unusual_offset_has_no_cause() -> None:
    fit = fit_trajectory(*measure(STOPS), moved(STOPS, -12.3))
    assert fit is not None
    assert (fit.offset, fit.cause, fit.refused) == (12.3, "", True)


@pytest.mark.parametrize(("scale", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
def test_times_in_another_unit(scale: float, unit: str) -> None:
    fit = fit_trajectory(*measure(STOPS), moved(STOPS, scale=scale))
    assert fit is not None
    assert fit.scale.startswith(unit)
    assert fit.offset == 0.0


@pytest.mark.parametrize("aside", [14.0, -6.0])
def test_a_parallel_tube_is_outside_the_section(aside: float) -> None:
    fit = fit_trajectory(*measure(STOPS), moved(STOPS, aside=aside))
    assert fit is not None
    assert fit.refused
    assert fit.outside == pytest.approx(abs(aside) - RADIUS, abs=0.1)


def test_a_scanner_below_the_crown_that_it_measures_is_possible() -> None:
    time, place = measure(STOPS)
    place[:, 2] = np.abs(place[:, 2]) + 3.0
    fit = fit_trajectory(time, place, STOPS)
    assert fit is not None
    assert not fit.refused


def test_a_shift_along_the_tunnel_is_no_time_offset() -> None:
    fit = fit_trajectory(*measure(STOPS, ahead=10.0), STOPS)
    assert fit is not None
    assert fit.refused
    assert fit.shift == pytest.approx(10.0, abs=0.01)
    assert fit.offset is None


def test_another_trajectory_is_explained_by_no_offset() -> None:
    other = drive([(20.0, 3.0), (20.0, -3.0)] * 4)
    fit = fit_trajectory(*measure(STOPS), Track(other.time, other.place, 1.0))
    assert fit is not None
    assert fit.refused
    assert fit.offset is None


@pytest.mark.parametrize(
    ("track", "scanner", "error"),
    [
        (drive([(200.0, 0.3)]), {}, 0.2),  # slow, and 0.2 s late
        (drive([(60.0, 1.0), (120.0, 0.0), (60.0, 1.0)]), {}, 0.1),  # stood still
        (drive([(100.0, -1.0)]), {}, 0.0),  # backwards
        (drive([(60.0, 1.0), (20.0, 0.0), (60.0, -1.0)]), {}, 0.0),  # there and back
        (drive([(30.0, 20.0)]), {}, 0.02),  # a train
        (STOPS, {"tilt": np.radians(45.0)}, 0.0),  # a tilted mirror
        (STOPS, {"reach": 30.0}, 0.0),  # sees along the tunnel
        (STOPS, {"ahead": 12.0, "reach": 10.0}, 0.0),  # sees ahead only
        (STOPS, {"ahead": -0.8}, 0.0),  # the trajectory is of the axle
    ],
    ids=["slow", "stood", "backwards", "twice", "train", "tilted", "wide", "ahead", "lever"],
)
def test_what_real_scanners_do_is_no_fault(track: Track, scanner: dict[str, float], error: float) -> None:
    time, place = measure(track, **scanner)
    jitter = np.random.default_rng(2).normal(0.0, 0.01, len(time))
    fit = fit_trajectory(np.clip(time + jitter, time[0], time[-1]), place, moved(track, error))
    assert fit is not None
    assert not fit.refused
    assert not fit.doubtful


def test_points_in_a_gap_are_not_compared() -> None:
    time, place = measure(STOPS)
    kept = (STOPS.time < GPS + 40.0) | (STOPS.time > GPS + 48.0)
    fit = fit_trajectory(time, place, Track(STOPS.time[kept], STOPS.place[kept], 1.0))
    assert fit is not None
    assert not fit.refused
    assert fit.known == pytest.approx(1.0 - 8.0 / 150.0, abs=0.01)


def test_a_clock_that_jumped_for_a_part_is_doubtful() -> None:
    track = drive([(200.0, 1.0)])
    time, place = measure(track)
    place[time > GPS + 180.0, 0] -= 8.0
    fit = fit_trajectory(time, place, track)
    assert fit is not None
    assert fit.doubtful
    assert not fit.refused
    assert fit.wrong == pytest.approx(0.1, abs=0.02)


def test_a_week_that_ends_is_no_offset() -> None:
    track = drive([(60.0, 1.0)], start=WEEK - 30.0)
    time, place = measure(track)
    for seconds, expected in ((0.0, None), (-18.0, 18.0)):
        late = moved(track, seconds)
        later = late.time > WEEK
        times, places = [late.time[later] - WEEK, late.time], [late.place[later], late.place]
        fit = fit_trajectory(time % WEEK, place, Track(np.concatenate(times), np.concatenate(places), 1.0))
        assert fit is not None
        assert fit.offset == expected


def test_few_points_say_nothing() -> None:
    time, place = measure(STOPS)
    assert fit_trajectory(time[:100], place[:100], moved(STOPS, 18.0)) is None


def test_causes_are_near_and_exact() -> None:
    assert [seconds for seconds, _ in explain_offset(18.2, 0.6)] == [18.0]
    assert explain_offset(12.0, 0.6) == []
    assert [seconds for seconds, _ in explain_offset(16.6, 0.6)] == []
