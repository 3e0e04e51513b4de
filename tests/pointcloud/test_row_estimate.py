"""Estimated rows of scans whose number of voxels is known, and of those that loading thins."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.file_sample import BLOCK
from tunneldb.pointcloud.row_estimate import FileSample, estimate_rows
from tunneldb.pointcloud.selection import FilterSettings
from tunneldb.pointcloud.thinning import thin, voxel_edge

LENGTH, RADIUS = 200.0, 3.0
AREA = 2.0 * np.pi * RADIUS * LENGTH
AXIS = Alignment.from_polyline(np.array([[0.0, 0, 0], [LENGTH, 0, 0]]), 0.0)
SETTINGS = FilterSettings()


def tube(along: np.ndarray, seed: int = 1) -> np.ndarray:
    """Points on a tube at some chainages and random angles, with range noise."""
    rng = np.random.default_rng(seed)
    angle, radius = rng.uniform(-np.pi, np.pi, len(along)), rng.normal(RADIUS, 0.002, len(along))
    return np.column_stack([along, radius * np.cos(angle), radius * np.sin(angle)])


def sampled(xyz: np.ndarray, runs: int) -> FileSample:
    starts = np.linspace(0, len(xyz) - BLOCK, runs).astype(int)
    return FileSample(len(xyz), [xyz[start : start + BLOCK] for start in starts])


@pytest.mark.parametrize("density", [30.0, 1000.0])
@pytest.mark.parametrize("runs", [5, 2])
def test_a_sample_of_a_scan_in_order_gives_the_rows_of_the_whole(density: float, runs: int) -> None:
    count = max(int(density * AREA), 2 * BLOCK)
    xyz = tube(np.sort(np.random.default_rng(2).uniform(0, LENGTH, count)))
    kept = int(thin(xyz, voxel_edge(100.0)).sum())
    found = estimate_rows([sampled(xyz, runs)], AXIS, SETTINGS)
    assert found.low <= kept <= found.high
    assert found.likely == pytest.approx(kept, rel=0.15)
    assert found.area == pytest.approx(AREA, rel=0.1)
    assert found.near == pytest.approx(count, rel=1e-6)


def test_profiles_far_apart_leave_voxels_between_them_empty() -> None:
    count = int(400 * AREA)
    xyz = tube(np.sort(np.random.default_rng(2).integers(0, int(2 * LENGTH), count) * 0.5 + 0.25))
    kept = int(thin(xyz, voxel_edge(100.0)).sum())
    assert kept < 0.3 * 100 * AREA
    found = estimate_rows([sampled(xyz, 20)], AXIS, SETTINGS)
    assert found.low <= kept <= found.high


def test_points_off_the_tunnel_and_all_points() -> None:
    xyz = tube(np.sort(np.random.default_rng(2).uniform(-LENGTH, LENGTH, 2 * BLOCK)))  # half of them before its beginning
    found = estimate_rows([sampled(xyz, 2)], AXIS, FilterSettings(density=None))
    assert found.near == pytest.approx(BLOCK, rel=0.02)
    assert found.high == found.near
    away = estimate_rows([FileSample(BLOCK, [xyz + 500.0])], AXIS, SETTINGS)
    assert (away.low, away.likely, away.high, away.near) == (0, 0, 0, 0)
