"""Scanner positions that cannot be: too far from the axis, or a jump there and back."""

from __future__ import annotations

import numpy as np

from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.pose_checks import far_from_axis, jumps

AXIS = Alignment.from_polyline(np.array([[0.0, 0.0, 50.0], [1000.0, 0.0, 50.0]]), 0.0, 10.0)


def test_far_aside_and_far_beyond_are_told_by_their_distance() -> None:
    xyz = np.array([[500.0, 3, 51], [500, 24.9, 50], [500, 30, 50], [-400, 60, 50], [-600, 0, 50], [0, 0, 0]])
    xyz[-1] -= [1e6, 0, 0]
    found = far_from_axis(xyz, AXIS)
    np.testing.assert_allclose(found[:5], [0, 0, 30, 0, 600])
    assert found[5] > 9e5


def test_a_pose_that_jumps_there_and_back_is_told_and_its_neighbours_are_not() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    xyz = np.column_stack([8.0 * time, np.zeros_like(time), np.full_like(time, 50.0)])
    xyz += np.random.default_rng(1).normal(0.0, 0.02, xyz.shape)  # jitter: 2 cm in 10 ms
    wild = [400, 900, 901]
    xyz[wild[0]] += [0, 12, 0]
    xyz[wild[1]] = 0.0
    assert np.flatnonzero(jumps(time, xyz)).tolist() == wild[:2]
    assert not jumps(time[:2], xyz[:2]).any()


def test_a_train_after_a_break_of_its_trajectory_does_not_jump() -> None:
    time = np.concatenate([np.arange(0.0, 5.0, 0.1), np.arange(60.0, 65.0, 0.1)])
    xyz = np.column_stack([33.0 * time, 0 * time, 0 * time])
    assert not jumps(time, xyz).any()
