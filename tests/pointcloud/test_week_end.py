"""Seconds of the GPS week that begin anew in a trajectory, in the order of measurement or sorted."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.pointcloud.clock_offsets import WEEK
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.week_end import continue_week, count_repeats, cover_week_end

TRUE = WEEK - 20.05 + np.arange(0.0, 42.0, 0.1)
XYZ = np.column_stack([TRUE - TRUE[0], 0.0 * TRUE, 0.0 * TRUE])  # 1 m/s


def test_times_continue_in_either_order() -> None:
    written = TRUE % WEEK
    np.testing.assert_allclose(continue_week(written, XYZ), TRUE, atol=1e-6)
    order = np.argsort(written)
    np.testing.assert_allclose(np.sort(continue_week(written[order], XYZ[order])), TRUE, atol=1e-6)


@pytest.mark.parametrize(
    ("time", "x"),
    [
        ([100.0, 101.0, 600_000.0, 600_001.0], [0.0, 1.0, 900.0, 901.0]),  # two nights of a week
        ([10.0, 12.0, 11.0, 13.0], [0.0, 1.0, 2.0, 3.0]),  # not sorted
        ([1.4e9, 1.4e9 + 1.0, 1.4e9 + WEEK], [0.0, 1.0, 2.0]),  # no seconds of the week
    ],
)
def test_other_times_stay(time: list[float], x: list[float]) -> None:
    xyz = np.column_stack([x, np.zeros((len(x), 2))]) * [1e5, 1.0, 1.0]
    np.testing.assert_array_equal(continue_week(np.array(time), xyz), time)


def test_every_time_of_both_weeks_has_its_pose() -> None:
    time, xyz = cover_week_end(TRUE, XYZ, 1.0)
    assert np.all(np.diff(time) > 0.0)
    model = PoseModel.from_trajectory(time, xyz, 1.0)
    for moment in (WEEK - 15.0, WEEK - 0.02, WEEK, WEEK + 0.03, WEEK + 20.0):
        for stated in {moment, moment % WEEK}:
            assert not model.gaps.size or not ((model.gaps[:, 0] < stated) & (stated < model.gaps[:, 1])).any()
            assert np.interp(stated, time, xyz[:, 0]) == pytest.approx(moment - TRUE[0], abs=1e-6)
    repeats = count_repeats(time)
    np.testing.assert_array_equal(time[repeats:][time[repeats:] != WEEK], TRUE)


def test_a_trajectory_within_a_week_is_as_it_was() -> None:
    time = TRUE - 100.0
    assert cover_week_end(time, XYZ, 1.0)[0] is time
    assert count_repeats(time) == count_repeats(TRUE) == 0
