"""Gaps beneath a straightedge against closed formulas and against the convex hull by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tunneldb.measures.evenness.compute.straightedge import cell_means, gaps_beneath

CELL, LENGTH = 0.1, 2.0


def beneath(height: np.ndarray) -> np.ndarray:
    return gaps_beneath(np.atleast_2d(height), LENGTH, CELL).gap[0]


@pytest.mark.slow
@pytest.mark.parametrize("wave", [1.0, 1.6, 2.0, 4.0, 10.0])
def test_of_a_sinusoid_the_gap_is_that_between_crests_or_of_the_chord(wave: float) -> None:
    """Shorter than the straightedge: from trough to crest; longer: A (1 - cos (π L / λ)), as the chord over the trough has."""
    x = CELL * np.arange(300)
    gap = beneath(0.01 * np.cos(2.0 * np.pi * x / wave))
    wanted = 0.02 if wave <= LENGTH else 0.01 * (1.0 - np.cos(np.pi * LENGTH / wave))
    assert gap.max() == pytest.approx(wanted, abs=1e-9)


@pytest.mark.slow
def test_beside_a_bump_and_below_a_step_it_falls_linearly_to_the_length() -> None:
    bump, step = np.zeros(100), np.where(np.arange(100) < 50, 0.03, 0.0)
    bump[50] = 0.03
    away = np.arange(1, 20)
    wanted = 0.03 * (1.0 - away / 20.0)
    assert beneath(bump)[51:70] == pytest.approx(wanted, abs=1e-12)
    assert beneath(bump)[49:30:-1] == pytest.approx(wanted, abs=1e-12)
    assert beneath(step)[50:69] == pytest.approx(wanted, abs=1e-12)  # from the step's last cell on
    assert beneath(step)[:50] == pytest.approx(np.zeros(50), abs=1e-12)
    assert beneath(0.1 - 0.001 * np.arange(100.0) ** 2) == pytest.approx(np.zeros(100), abs=1e-12)  # it rocks on a vault


def test_waviness_is_depth_over_the_way_to_the_nearer_rim() -> None:
    x = CELL * np.arange(200)
    found = gaps_beneath(np.atleast_2d(0.01 * np.cos(2.0 * np.pi * x / 1.2)), LENGTH, CELL)
    assert np.nanmax(found.waviness) == pytest.approx(0.02 / 0.6, abs=1e-9)


def test_it_is_what_the_convex_hull_says() -> None:
    rng = np.random.default_rng(1)
    height = rng.normal(0.0, 0.01, 120)
    height[rng.random(120) < 0.15] = np.nan
    wanted = np.full(120, np.nan)
    for c in range(10, 110):
        at = np.arange(c - 10, c + 11)
        seen = at[np.isfinite(height[at])]
        hull = ConvexHull(np.column_stack([seen, height[seen]]))
        wanted[seen] = np.fmax(wanted[seen], 0.0)
        for simplex, (_, up, _) in zip(hull.simplices, hull.equations, strict=True):
            i, k = sorted(seen[simplex].tolist())
            if up > 0.0 and i <= c <= k:
                inner = seen[(seen > i) & (seen < k)]
                line = np.interp(inner, [i, k], height[[i, k]])
                wanted[inner] = np.fmax(wanted[inner], line - height[inner])
    assert beneath(height) == pytest.approx(wanted, abs=1e-12, nan_ok=True)


def test_what_was_not_seen_is_not_measured() -> None:
    height = np.zeros(100)
    height[40:46] = np.nan  # 0.6 m, more than a quarter of the straightedge
    gap = beneath(height)
    assert np.isnan(gap[40:46]).all()
    assert (gap[:40] == 0.0).all()
    assert np.isnan(beneath(np.zeros(15))).all()  # shorter than the straightedge
    height[40:44] = 0.0
    assert np.isfinite(np.delete(beneath(height), [44, 45])).all()
    found = cell_means(np.array([[1.0, 3.0, np.nan, 1.0], [1.0, 3.0, np.nan, np.nan]]), 2, 3)
    assert found.mean == pytest.approx(np.array([[2.0, np.nan]]), nan_ok=True)
    assert found.sigma[0, 0] == pytest.approx(np.std([1, 3, 1, 3], ddof=1) / 2.0)
