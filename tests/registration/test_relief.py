"""Relief of the bed as sonar scans see it, compared on fields whose shifts are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tunneldb.registration.underwater.first_pose import LevelScan
from tunneldb.registration.underwater.relief import NO_EVIDENCE, PIXEL, height_difference, likelihood, relief_of

WIDTH = 6.0


def bed(seed: int) -> np.ndarray:
    """A field of 60 m × 6 m in pixels of 5 cm, 8 cm high, waves of about a metre, on silt that rises to the walls."""
    field = gaussian_filter(np.random.default_rng(seed).normal(size=(1200, 120)), 10.0)
    across = np.linspace(-1.0, 1.0, 120)
    return np.asarray(0.08 * field / field.std() + 0.3 * across**2)


def seen_from(field: np.ndarray, x: float, up: float, *, turned: bool, seed: int) -> LevelScan:
    """Return the scan of a level scanner at x, ``up`` over the bed and 0.5 m right of the middle."""
    rng = np.random.default_rng(seed)
    place = np.column_stack([rng.uniform(x - 10.0, x + 10.0, 60_000), rng.uniform(-WIDTH / 2.0, WIDTH / 2.0, 60_000)])
    cell = np.floor((place + np.array([0.0, WIDTH / 2.0])) / 0.05).astype(int)
    points = np.column_stack(
        [place - np.array([x, -0.5]), field[cell[:, 0], cell[:, 1]] - up + rng.normal(0.0, 0.02, len(place))]
    )
    walls = (-WIDTH / 2.0 + 0.5, WIDTH / 2.0 + 0.5)
    if turned:
        points, walls = points * np.array([-1.0, -1.0, 1.0]), (-walls[1], -walls[0])
    return LevelScan(np.eye(3), walls, (0.0, 0.0), points, -up, np.zeros((0, 3)), np.zeros((0, 3)), 0.0)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("apart", [5.0, -7.3])
def test_place_and_height_of_another_scanner_are_found(apart: float, turned: bool) -> None:
    field = bed(3)
    one = relief_of(seen_from(field, 30.0, 1.2, turned=False, seed=1))
    other = relief_of(seen_from(field, 30.0 + apart, 1.5, turned=turned, seed=2))
    assert one is not None
    assert other is not None
    right, wrong = (likelihood(one, other.turned() if half else other) for half in (turned, not turned))
    best = int(np.argmax(right)) - len(right) // 2
    assert best * PIXEL == pytest.approx(apart, abs=PIXEL)
    assert right.max() > np.log(100.0)
    assert right.max() > wrong.max() + np.log(100.0)
    assert height_difference(one, other.turned() if turned else other, best) == pytest.approx(0.3, abs=0.01)


def with_false_echoes(scan: LevelScan, seed: int) -> LevelScan:
    """Return the scan with 3 % of its echoes up to half a metre off the bed, more than 6 m away along the canal."""
    rng = np.random.default_rng(seed)
    points = scan.points.copy()
    false = (rng.random(len(points)) < 0.03) & (np.abs(points[:, 0]) > 6.0)
    points[false, 2] += rng.uniform(-0.5, 0.5, int(false.sum()))
    return replace(scan, points=points)


def test_ridges_along_the_canal_do_not_place_a_scan() -> None:
    """Beds of 5 mm of relief with the same ridges along the walls, and some false echoes: the usual best shift is not believed.

    Means of the ridges gave 23 in the median and 90 at most.
    """
    ridges = 0.1 * np.sin(np.linspace(0.0, 40.0, 120))
    highest = []
    for seed in range(10):
        fields = [(bed(2 * seed + k) - 0.3 * np.linspace(-1.0, 1.0, 120) ** 2) / 16.0 + ridges for k in (0, 1)]
        scans = [seen_from(field, 30.0, 1.2, turned=False, seed=2 * seed + k) for k, field in enumerate(fields)]
        one, other = (relief_of(with_false_echoes(scan, 2 * seed + k)) for k, scan in enumerate(scans))
        assert one is not None
        assert other is not None
        highest.append(likelihood(one, other).max())
    assert np.median(highest) < np.log(100.0)
    assert max(highest) < 10.0


@pytest.mark.slow
def test_other_beds_are_not_alike_though_both_rise_to_the_walls() -> None:
    """Over many pairs no shift is believed: 200 shifts of either half turn, of which some ten are independent."""
    highest = []
    for seed in range(20):
        one, other = (relief_of(seen_from(bed(2 * seed + k), 30.0, 1.2, turned=False, seed=k)) for k in (0, 1))
        assert one is not None
        assert other is not None
        highest.append(likelihood(one, other).max())
    assert np.sum(np.array(highest) > np.log(100.0)) == 0


def test_nothing_is_said_where_nothing_is_shared() -> None:
    one = relief_of(seen_from(bed(3), 30.0, 1.2, turned=False, seed=1))
    assert one is not None
    values = likelihood(one, one)
    assert values[0] == values[-1] == NO_EVIDENCE
    empty = LevelScan(np.eye(3), (-3.0, 3.0), (0.0, 0.0), np.zeros((3, 3)), -1.0, np.zeros((0, 3)), np.zeros((0, 3)), 0.0)
    assert relief_of(empty) is None
