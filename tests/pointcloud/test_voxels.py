"""Voxels against sums by NumPy; chunks and bounds."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.pointcloud.voxels import Voxels


def _cloud(n: int = 50_000) -> np.ndarray:
    rng = np.random.default_rng(3)
    return rng.uniform(0, 1, (n, 3)) * [6.0, 4.0, 2.0] + [500_000.0, 4_700_000.0, -1.0]


def test_centroids_counts_and_spread_are_those_of_the_points_in_each_voxel():
    points = _cloud()
    voxels = Voxels(0.25)
    voxels.add(points)
    number = voxels.index(points)
    keys, own = np.unique(np.floor(points / 0.25), axis=0, return_inverse=True)
    assert len(voxels) == len(keys)
    # One voxel of the grid is one number, and the other way round.
    assert len(np.unique(np.column_stack([number, own.ravel()]), axis=0)) == len(keys)
    count = np.bincount(number)
    np.testing.assert_array_equal(count, voxels.counts())
    for axis in range(3):
        mean = np.bincount(number, points[:, axis] - points[0, axis]) / count + points[0, axis]
        assert np.abs(mean - voxels.centroids()[:, axis]).max() < 0.25 / 1024
    z = points[:, 2]
    variance = np.bincount(number, z**2) / count - (np.bincount(number, z) / count) ** 2
    assert np.abs(np.sqrt(np.maximum(variance, 0)) - voxels.spread()).max() < 0.25 / 512


@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_chunks_do_not_show(chunk):
    points = _cloud(3000)
    whole, parts = Voxels(0.1), Voxels(0.1)
    whole.add(points)
    for begin in range(0, len(points), chunk):
        parts.add(points[begin : begin + chunk])
    np.testing.assert_array_equal(whole.centroids(), parts.centroids())
    np.testing.assert_array_equal(whole.counts(), parts.counts())
    np.testing.assert_array_equal(whole.spread(), parts.spread())


def test_many_more_voxels_than_there_is_room_for_at_first():
    points = np.column_stack([np.arange(200_000.0), np.zeros(200_000), np.zeros(200_000)])
    voxels = Voxels(0.5)
    voxels.add(points)
    assert len(voxels) == 200_000
    np.testing.assert_array_equal(voxels.index(points[::1000]), np.arange(0, 200_000, 1000))


def test_points_elsewhere_and_not_finite_have_no_voxel():
    voxels = Voxels(0.1)
    voxels.add(np.array([[np.nan, 0, 0], [1.0, 2.0, 3.0], [np.inf, 0, 0]]))
    np.testing.assert_array_equal(voxels.index(np.array([[1.01, 2.01, 3.01], [9, 9, 9], [np.nan, 0, 0]])), [0, -1, -1])


def test_empty():
    voxels = Voxels(0.1)
    voxels.add(np.empty((0, 3)))
    assert voxels.centroids().shape == (0, 3)
    assert voxels.index(np.zeros((2, 3))).tolist() == [-1, -1]


def test_points_too_far_apart_and_an_edge_of_nothing_are_refused():
    voxels = Voxels(0.01)
    voxels.add(np.zeros((1, 3)))
    with pytest.raises(ValueError, match="million voxels"):
        voxels.add(np.full((1, 3), 1e6))
    with pytest.raises(ValueError, match="edge"):
        Voxels(0.0)
