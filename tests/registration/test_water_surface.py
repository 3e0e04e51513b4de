"""The water's surface in a level sonar scan."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.arrays import Float
from tunneldb.registration.underwater.water_surface import find_surface, is_upside_down

WALLS = (-3.0, 3.0)
TOP, BED = 0.9, -1.5


def plane(height: float, spread: float, seed: int, count: int = 8000) -> Float:
    """A surface between the walls, uneven by ``spread`` in waves of some metres, with 1 cm of noise."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-6.0, 6.0, count), rng.uniform(-2.9, 2.9, count)
    wave = spread * np.sqrt(2.0) * np.sin(1.3 * x + seed) * np.cos(0.7 * y)
    return np.column_stack([x, y, height + wave + rng.normal(0.0, 0.01, count)])


@pytest.mark.parametrize("edges", [TOP - 0.12, TOP + 0.1])
def test_the_surface_gives_the_height(edges: float) -> None:
    found = find_surface(np.concatenate([plane(BED, 0.05, 1), plane(TOP, 0.0, 2)]), WALLS, edges)
    assert np.median(found[:, 2]) == pytest.approx(TOP, abs=0.004)


def test_a_mirror_shows_the_bed_above_the_water() -> None:
    below = plane(BED, 0.05, 1)
    above = below[::7] * [1.0, 1.0, -1.0] + [0.0, 0.0, 2.0 * TOP]
    found = find_surface(np.concatenate([below, above]), WALLS, TOP - 0.1)
    assert np.median(found[:, 2]) == pytest.approx(TOP, abs=0.01)


def test_single_echoes_above_are_no_surface() -> None:
    rng = np.random.default_rng(5)
    stray = np.column_stack([rng.uniform(-6, 6, 3000), rng.uniform(-2.9, 2.9, 3000), rng.uniform(0.2, 2.0, 3000)])
    assert len(find_surface(np.concatenate([plane(BED, 0.05, 1), stray]), WALLS, TOP)) == 0
    assert len(find_surface(plane(BED, 0.05, 1), WALLS, TOP)) == 0


def test_a_surface_far_from_the_edges_of_the_walls_is_another() -> None:
    points = np.concatenate([plane(BED, 0.05, 1), plane(TOP + 0.5, 0.0, 2)])
    assert len(find_surface(points, WALLS, TOP)) == 0


def test_a_scan_with_the_bed_above_is_upside_down() -> None:
    points = np.concatenate([plane(BED, 0.06, 1), plane(TOP, 0.0, 2)])
    assert not is_upside_down(points, WALLS)
    assert is_upside_down(points * [1.0, -1.0, -1.0], WALLS)
    level_bed = np.concatenate([plane(BED, 0.0, 1), plane(TOP, 0.0, 2)])
    assert not is_upside_down(level_bed * [1.0, -1.0, -1.0], WALLS)  # nothing tells them apart


def test_a_ring_of_echoes_gives_the_tilt_of_a_scan_that_is_not_level() -> None:
    rng = np.random.default_rng(8)
    reach, turn = rng.uniform(0.3, 0.9, 600), rng.uniform(0.0, 2.0 * np.pi, 600)
    x, y = reach * np.cos(turn), reach * np.sin(turn)
    ring = np.column_stack([x, y, TOP + 0.03 * x - 0.02 * y + rng.normal(0.0, 0.003, 600)])
    rim = np.column_stack([rng.uniform(0.9, 1.0, (5, 2)), np.full(5, TOP + 0.03)])  # few echoes of a wide beam, 3 cm off
    found = find_surface(np.concatenate([plane(BED, 0.05, 1), ring, rim]), WALLS, TOP)
    slope = np.linalg.lstsq(np.column_stack([np.ones(len(found)), found[:, :2]]), found[:, 2], rcond=None)[0]
    assert slope[1:] == pytest.approx([0.03, -0.02], abs=0.002)


def test_the_bottom_of_a_boat_beside_the_water_is_no_surface() -> None:
    water, boat = plane(TOP, 0.0, 2), plane(TOP - 0.17, 0.0, 3)
    ring = water[np.hypot(water[:, 0], water[:, 1]) < 0.8]
    bottom = boat[(np.abs(boat[:, 0]) < 3.0) & (boat[:, 1] < -1.2)]
    found = find_surface(np.concatenate([plane(BED, 0.05, 1), ring, bottom]), WALLS, TOP - 0.1)
    assert len(found) == 0 or np.ptp(found[:, 2]) < 0.03


def test_a_head_close_below_the_surface_sees_a_small_ring_of_it() -> None:
    rng = np.random.default_rng(9)
    reach, turn = rng.uniform(0.3, 0.6, 500), rng.uniform(0.0, 2.0 * np.pi, 500)
    ring = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), 0.5 + rng.normal(0.0, 0.005, 500)])
    found = find_surface(np.concatenate([plane(BED, 0.05, 1), ring]), WALLS, 0.42)
    assert np.median(found[:, 2]) == pytest.approx(0.5, abs=0.002)
