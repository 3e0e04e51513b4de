import re

import numpy as np

from tunneldb.pointcloud.pose_coverage import PoseFaults
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.pointcloud.reader import Points


def points(time: list[float], scan_id: list[int] | None = None) -> Points:
    n = len(time)
    return Points(
        np.zeros((n, 3)),
        np.array(time),
        np.array(scan_id if scan_id is not None else [0] * n, np.int32),
        np.zeros(n, np.float32),
        np.zeros(n, np.uint8),
    )


TRACK = PoseModel.from_trajectory(np.array([10.0, 20.0, 40.0]), np.array([[0.0, 0, 0], [10.0, 0, 1], [10.0, 40, 1]]))
STATIONS = PoseModel.from_stations(np.array([7, 3]), np.array([[7.0, 0, 0], [3.0, 0, 0]]))


def test_the_trajectory_is_interpolated_linearly_in_any_order() -> None:
    times = np.random.default_rng(0).uniform(10, 40, 1000)
    times[:4] = [10, 20, 40, 30]
    found = TRACK.positions(points(times.tolist()))
    expected = np.column_stack([np.interp(times, TRACK.time, TRACK.track[:, c]) for c in range(3)])
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_stations_by_scan() -> None:
    np.testing.assert_array_equal(STATIONS.positions(points([0, 0, 0], [7, 3, 7]))[:, 0], [7, 3, 7])


def test_times_outside_say_how_much_and_how_many() -> None:
    outside = points([7.5, 9.0, 15.0, 50.0, np.nan])
    faults = TRACK.coverage.faults(outside)
    assert re.search(r"gps_time of 4 points .* 2\.500 s before .* 10\.000 s after", faults.text())
    assert faults.points == 4
    assert TRACK.coverage.known(outside).tolist() == [False, False, True, False, False]
    np.testing.assert_array_equal(np.isnan(TRACK.positions(outside)).all(axis=1), ~TRACK.coverage.known(outside))


def test_nothing_is_interpolated_over_a_gap() -> None:
    time = np.concatenate([np.arange(0.0, 5.0, 0.1), np.arange(9.0, 12.0, 0.1)])
    model = PoseModel.from_trajectory(time, np.column_stack([time, time, time]))
    np.testing.assert_allclose(model.gaps, [[4.9, 9.0]])
    within = points([4.85, 4.9, 5.0, 8.9, 9.0, 11.0])
    assert model.coverage.known(within).tolist() == [True, True, False, False, True, True]
    assert (model.coverage.faults(within).gap, model.coverage.faults(within).outside) == (2, 0)
    assert "2 points lie in gaps" in model.coverage.faults(within).text()
    # a trajectory of a pose each two seconds has no gap of four
    slow = PoseModel.from_trajectory(np.array([0.0, 2, 4, 6, 10, 12]), np.zeros((6, 3)))
    assert len(slow.gaps) == 0


def test_rounding_of_times_is_borne() -> None:
    np.testing.assert_array_equal(TRACK.positions(points([9.9995, 40.0005])), TRACK.track[[0, 2]])


def test_unknown_scan_is_named() -> None:
    unknown = points([0] * 4, [9, 3, 4, 9])
    assert "no station for scan_id 4 (1 point), 9 (2 points)" in STATIONS.coverage.faults(unknown).text()
    assert np.isnan(STATIONS.positions(unknown)[:, 0]).tolist() == [True, False, True, True]


def test_scan_numbers_far_apart() -> None:
    faults = STATIONS.coverage.faults(points([0, 0, 0], [-2_000_000_000, 3, 2_000_000_000]))
    assert faults.unknown == {-2_000_000_000: 1, 2_000_000_000: 1}


def test_faults_of_chunks_add_up() -> None:
    total = sum((STATIONS.coverage.faults(points([0, 0], scans)) for scans in ([1, 3], [1, 2])), PoseFaults())
    assert total.unknown == {1: 2, 2: 1}
    total = sum((TRACK.coverage.faults(points(times)) for times in ([9.0, 11.0], [8.0, 41.0], [])), PoseFaults())
    assert (total.outside, total.before, total.after) == (3, 2.0, 1.0)
    assert not TRACK.coverage.faults(points([12.0]))
