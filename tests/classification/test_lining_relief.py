"""Relief of the lining: planes that appendages and niches don't draw to themselves, with the spread of the lining's own."""

import numpy as np
import pytest

from tunneldb.classification.lining_relief import CELL, Relief, Wall
from tunneldb.geometry.robust_plane import DELTA

LENGTH, HALF = 40.0, 6.0


def wall(seed: int, sigma: float, density: float = 100.0) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Chainage, arc, offset of points on a lining that swells, and its true offset there."""
    rng = np.random.default_rng(seed)
    count = int(density * LENGTH * 2 * HALF)
    chainage, arc = rng.uniform(0, LENGTH, count), rng.uniform(-HALF, HALF, count)
    truth = swelling(chainage, arc)
    return chainage, arc, truth + sigma * rng.standard_normal(count), truth


def swelling(chainage: np.ndarray, arc: np.ndarray) -> np.ndarray:
    return 0.06 * np.sin(chainage / 3.0) + 0.04 * np.cos(arc / 2.0)


def off_lining(relief: Relief, chainage: np.ndarray, arc: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Distance from the lining's local plane, in tolerances: up to 1 to both sides it is lining."""
    plane, tolerance = relief.level(chainage, arc)
    return (offset - plane) / tolerance


@pytest.mark.parametrize("sigma", [0.003, 0.02, 0.04])
def test_plane_and_spread_are_the_linings(sigma: float) -> None:
    chainage, arc, offset, truth = wall(1, sigma)
    relief = Relief.of(chainage, arc, offset)
    plane, tolerance = relief.level(chainage, arc)
    assert np.sqrt(np.mean((plane - truth) ** 2)) < 0.002 + sigma / 3
    # The plane's own misfit to the swelling, 3 mm over the fit's metre, adds to a small spread.
    assert np.median(tolerance) == pytest.approx(max(DELTA, 3 * np.hypot(sigma, 0.002)), rel=0.15)
    assert (np.abs(off_lining(relief, chainage, arc, offset)) <= 1).mean() > 0.99


@pytest.mark.parametrize("height", [0.06, 0.12, 0.3])
def test_what_hangs_on_the_wall_is_off_it(height: float) -> None:
    chainage, arc, offset, _ = wall(2, 0.003)
    tray = np.abs(arc - 2.0) < 0.15
    box = (np.abs(chainage - 20) < 0.3) & (np.abs(arc + 3) < 0.25)
    offset[tray | box] += height
    off = off_lining(Relief.of(chainage, arc, offset), chainage, arc, offset)
    assert (off[tray | box] > 1).mean() > 0.998
    assert (np.abs(off[~(tray | box)]) <= 1).mean() > 0.999


@pytest.mark.parametrize("depth", [0.3, 0.9])
def test_a_niche_is_behind_the_wall(depth: float) -> None:
    chainage, arc, offset, _ = wall(3, 0.003)
    niche = (np.abs(chainage - 20) < 1.0) & (np.abs(arc - 3) < 1.1)
    offset[niche] -= depth
    off = off_lining(Relief.of(chainage, arc, offset), chainage, arc, offset)
    assert (off[niche] < -1).mean() > 0.99
    assert (np.abs(off[~niche]) <= 1).mean() > 0.995


def test_relief_ends_at_the_feet_of_the_walls() -> None:
    chainage, arc, offset, _ = wall(4, 0.003)
    feet = Wall(np.array([0.0, LENGTH]), np.array([-4.0, -4.0]), np.array([3.0, 5.0]))
    relief = Relief.of(chainage, arc, offset, feet)
    plane, _ = relief.level(chainage, arc)
    right = 3.0 + chainage / LENGTH * 2.0
    assert np.isfinite(plane[(arc > -4.0) & (arc < right)]).all()
    assert np.isnan(plane[(arc < -4.0 - CELL) | (arc > right + CELL)]).all()


def test_a_part_of_the_points_gives_the_same_relief_inside() -> None:
    chainage, arc, offset, _ = wall(5, 0.01)
    whole = Relief.of(chainage, arc, offset)
    part = chainage < 30.0
    some = Relief.of(chainage[part], arc[part], offset[part])
    columns = slice(0, int(20.0 / CELL))
    assert np.array_equal(whole.offset[:, columns], some.offset[:, columns])
    assert np.array_equal(whole.spread[:, columns], some.spread[:, columns])


def test_no_points_no_lining() -> None:
    nothing = np.empty(0)
    relief = Relief.of(nothing, nothing, nothing)
    assert relief.offset.size == 0
    assert np.isnan(off_lining(relief, np.array([1.0]), np.array([0.0]), np.array([0.0]))).all()
    far = Relief.of(np.arange(9.0), np.zeros(9), np.full(9, 5.0))
    assert far.offset.size == 0
