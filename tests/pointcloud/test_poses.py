import numpy as np
import pytest

from tunneldb.errors import UserError
from tunneldb.pointcloud.poses import PoseFaults, PoseModel
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
    with pytest.raises(UserError, match=r"a\.laz: gps_time of 3 points .* 2\.500 s before .* 10\.000 s after"):
        TRACK.positions(points([7.5, 9.0, 15.0, 50.0]), "a.laz")


def test_rounding_of_times_is_borne() -> None:
    np.testing.assert_array_equal(TRACK.positions(points([9.9995, 40.0005])), TRACK.track[[0, 2]])


def test_unknown_scan_is_named() -> None:
    with pytest.raises(UserError, match=r"no station for scan_id 4 \(1 points\), 9 \(2 points\)"):
        STATIONS.positions(points([0] * 4, [9, 3, 4, 9]))


def test_scan_numbers_far_apart() -> None:
    faults = STATIONS.faults(points([0, 0, 0], [-2_000_000_000, 3, 2_000_000_000]))
    assert faults.unknown == {-2_000_000_000: 1, 2_000_000_000: 1}


def test_faults_of_chunks_add_up() -> None:
    total = sum((STATIONS.faults(points([0, 0], scans)) for scans in ([1, 3], [1, 2])), PoseFaults())
    assert total.unknown == {1: 2, 2: 1}
    total = sum((TRACK.faults(points(times)) for times in ([9.0, 11.0], [8.0, 41.0], [])), PoseFaults())
    assert (total.outside, total.before, total.after) == (3, 2.0, 1.0)
    assert not TRACK.faults(points([12.0]))
