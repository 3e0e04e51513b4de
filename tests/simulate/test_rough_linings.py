"""Masonry, rock and rough shotcrete of the simulator: points against the bond and the planes that they lie on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from support.lining_scans import levels, whole_scan

from tunneldb.simulate import Cloud, Simulation

pytestmark = pytest.mark.slow


def bond(simulation: Simulation, s: np.ndarray, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position in a running bond: number in the course, course, distance to the middle of the nearest joint."""
    m = simulation.masonry
    course = np.floor(arc / m.height)
    along = s / m.length + 0.5 * np.mod(course, 2.0)
    rest, up = np.mod(along, 1.0), np.mod(arc / m.height, 1.0)
    return np.floor(along), course, np.minimum(np.minimum(rest, 1 - rest) * m.length, np.minimum(up, 1 - up) * m.height)


def test_bricks_stand_out_of_their_mortar_and_differ_in_level() -> None:
    simulation, cloud = whole_scan(
        lining="brick", length=10.0, straight=2.0, profile_spacing=0.025, profile_points=1000, seed=3
    )
    m, lining = simulation.masonry, cloud.klass == 0
    number, course, edge = bond(simulation, cloud.chainage[lining], cloud.arc[lining].astype(float))
    offset, level = cloud.offset[lining], levels(cloud)[lining]
    mortar, faces = edge < 0.25 * m.joint, edge > 0.5 * m.joint + 0.005  # clear of the sides of bricks
    assert 0.02 < mortar.mean() < faces.mean()
    assert np.median(offset[mortar]) == pytest.approx(-m.depth, abs=5e-4)
    assert np.abs(offset[faces]).max() < m.face + 0.003
    units, unit = np.unique(np.column_stack([number, course])[faces], axis=0, return_inverse=True)
    of_unit = np.bincount(unit.ravel(), level[faces]) / np.bincount(unit.ravel())
    assert len(units) > 3000
    assert of_unit.std() == pytest.approx(m.level, rel=0.3)
    assert level[mortar].mean() == pytest.approx(m.mortar, abs=0.3)


def test_stones_lie_in_courses_and_differ_in_length() -> None:
    simulation, cloud = whole_scan(lining="stone", length=10.0, straight=2.0, profile_spacing=0.02, profile_points=800, seed=4)
    m, lining = simulation.masonry, cloud.klass == 0
    s, arc, offset = cloud.chainage[lining], cloud.arc[lining].astype(float), cloud.offset[lining].astype(float)
    from_course = np.abs(np.mod(arc / m.height + 0.5, 1.0) - 0.5) * m.height
    bed, clear = from_course < 0.25 * m.joint, from_course > 0.5 * m.joint + 0.01
    assert np.median(offset[bed]) == pytest.approx(-m.depth, abs=0.004)
    assert abs(np.median(offset[clear])) < 0.01
    # Upright joints of one course: what lies deep there comes at uneven distances.
    course = clear & (np.floor(arc / m.height) == 3)
    deep = np.sort(s[course & (offset < -0.6 * m.depth - 0.002)])
    ends = deep[np.flatnonzero(np.diff(deep, prepend=-1.0) > 3.0 * m.joint)]
    assert len(ends) > 10
    assert np.diff(ends).std() > 0.05 * m.length


def planes(cloud: Cloud, radius: float, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """About some points of the lining: which they are, the spread off the plane of their neighbours, its normal."""
    lining = np.flatnonzero((cloud.klass == 0) & (cloud.range < 6.0))
    tree = cKDTree(cloud.xyz[lining])
    chosen = np.random.default_rng(0).choice(lining, count, replace=False)
    spread, normal = [], []
    for near in tree.query_ball_point(cloud.xyz[chosen], radius):
        rest = cloud.xyz[lining[near]] - cloud.xyz[lining[near]].mean(axis=0)
        _, size, axes = np.linalg.svd(rest, full_matrices=False)
        spread.append(size[2] / np.sqrt(max(len(near), 1)))
        normal.append(axes[2])
    return chosen, np.array(spread), np.array(normal)


def test_rock_is_made_of_planes_that_turn_the_echo() -> None:
    simulation, cloud = whole_scan(lining="rock", length=10.0, straight=2.0, profile_spacing=0.03, profile_points=1000, seed=5)
    offset = cloud.offset[cloud.klass == 0]
    assert 0.02 < offset.std() < 0.2
    assert abs(offset.mean()) < 0.1
    chosen, near, normal = planes(cloud, 0.06, 400)
    _, far, _ = planes(cloud, 0.5, 60)
    assert np.median(near) < 0.006
    assert np.median(far) > 4.0 * np.median(near)
    trajectory = simulation.scanner.trajectory()
    scanner = np.column_stack([np.interp(cloud.time[chosen], trajectory[:, 0], c) for c in trajectory[:, 1:].T])
    ray = (scanner - cloud.xyz[chosen]) / np.linalg.norm(scanner - cloud.xyz[chosen], axis=1)[:, None]
    turned = np.abs(np.degrees(np.arccos(np.abs(np.sum(ray * normal, axis=1)))) - np.degrees(cloud.incidence[chosen]))
    nominal = np.degrees(np.arccos(np.clip(np.sum(ray * simulation.tunnel.unroll(cloud.xyz[chosen]).normal, axis=1), -1, 1)))
    assert np.median(turned) < 5.0
    assert np.median(np.abs(nominal - np.degrees(cloud.incidence[chosen]))) > 6.0


def test_rough_shotcrete_is_rougher_than_shotcrete() -> None:
    spreads = {}
    for lining in ("shotcrete", "rough_shotcrete"):
        _, cloud = whole_scan(lining=lining, length=10.0, straight=2.0, seed=6)
        spreads[lining] = cloud.offset[cloud.klass == 0].std()
    usual = np.hypot(np.hypot(0.025, 0.010), 0.004)
    assert 0.5 * 0.9 * usual < spreads["rough_shotcrete"] < 1.5 * 1.1 * usual
    assert spreads["shotcrete"] < 0.5 * spreads["rough_shotcrete"]
