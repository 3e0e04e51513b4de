"""Points beyond the ends of an axis, by a tube whose ends are known."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.geometry.alignment import Alignment
from tunneldb.pointcloud.beyond_ends import BeyondEnds


def tube(low: float, high: float, count: int) -> np.ndarray:
    rng = np.random.default_rng(int(count))
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    along = rng.uniform(low, high, count)
    # along the direction (0.6, 0.8)
    across = 4.0 * np.cos(angle)
    return np.column_stack([100.0 + 0.6 * along - 0.8 * across, 200.0 + 0.8 * along + 0.6 * across, 4.0 * np.sin(angle)])


@pytest.fixture
def axis() -> Alignment:
    ends = np.array([[100.0, 200.0, 0.0], [130.0, 240.0, 0.0]])
    return Alignment.from_polyline(ends, 0.0, 10.0)


def test_a_tube_that_goes_on(axis: Alignment) -> None:
    beyond = BeyondEnds(axis, 25.0)
    beyond.add(tube(-6.0, 0.0, 6000))
    beyond.add(tube(50.0, 62.5, 5000))
    assert beyond.points == (6000, 5000)
    assert beyond.reach == (6.0, 13.0)


def test_the_axis_ends_between_two_vertices() -> None:
    beyond = BeyondEnds(Alignment.from_polyline(np.array([[100.0, 200.0, 0.0], [127.0, 236.0, 0.0]]), 3.0, 10.0), 25.0)
    beyond.add(tube(-6.0, 0.0, 6000))
    beyond.add(tube(45.0, 51.5, 5000))
    assert beyond.points == (6000, 5000)
    assert beyond.reach == (6.0, 7.0)


def test_what_lies_aside_or_far_away_is_elsewhere(axis: Alignment) -> None:
    beyond = BeyondEnds(axis, 25.0)
    beyond.add(tube(-6.0, 0.0, 100) + np.array([40.0, -30.0, 0.0]))
    beyond.add(tube(300.0, 400.0, 100))
    beyond.add(tube(1.0, 49.0, 100))
    assert beyond.points == (0, 0)
    assert beyond.reach == (0.0, 0.0)


def test_one_stray_does_not_make_the_reach(axis: Alignment) -> None:
    beyond = BeyondEnds(axis, 25.0)
    beyond.add(tube(-6.0, 0.0, 1000))
    beyond.add(tube(-150.0, -149.0, 1))
    assert beyond.points == (1001, 0)
    assert beyond.reach[0] == 6.0
