"""Heights, feet and the corner before a wall, against planes and wedges of known shape; errors of a filter by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.classification.ground.accuracy import Agreement
from tunneldb.classification.ground.model import Ground


def _sloping(gamma: float = 0.05, foot: tuple[float, float] = (-2.0, 2.0), lean: tuple[float, float] = (0.0, 0.0)) -> Ground:
    """z = 100 + 0.04 along + 0.02 across, 10 m long, from 2.5 m left to 2.5 m right."""
    rows, columns = np.arange(11), 0.1 * np.arange(-25, 26)
    height = 100 + 0.04 * (50 + rows)[:, None] + 0.02 * columns
    return Ground(50, -25, height, np.full(11, gamma), np.tile(foot, (11, 1)), np.tile(lean, (11, 1)))


def test_height_between_rows_and_columns_is_that_of_the_plane_and_none_outside():
    rng = np.random.default_rng(4)
    a, x = rng.uniform(50, 60, 500), rng.uniform(-2.5, 2.5, 500)
    np.testing.assert_allclose(_sloping().height_at(a, x), 100 + 0.04 * a + 0.02 * x, atol=1e-9)
    outside = _sloping().height_at(np.array([49.9, 60.1, 55.0, 55.0, np.nan]), np.array([0, 0, -2.6, 2.6, 0]))
    assert np.isnan(outside).all()


def test_missing_heights_do_not_spread_beyond_their_cells():
    ground = _sloping()
    ground.height[:, 30:] = np.nan  # from 0.5 m right on
    x = np.array([0.39, 0.41, 0.45, 0.51])
    assert np.isfinite(ground.height_at(np.full(4, 55.3), x)).tolist() == [True, True, True, False]


def test_ground_reaches_gamma_up_and_down():
    ground = _sloping(foot=(np.nan, np.nan))
    up = np.array([-0.06, -0.045, 0.0, 0.045, 0.06])
    assert ground.is_ground(np.full(5, 53.7), np.full(5, 0.33), 100 + 0.04 * 53.7 + 0.02 * 0.33 + up).tolist() == [
        False, True, True, True, False,
    ]  # fmt: skip


@pytest.mark.parametrize("lean", [0.0, 1.0, -0.3])
def test_in_the_corner_a_point_belongs_to_the_nearer_surface(lean):
    """Points on the wall, and on the ground, of a wedge; the wall on the right leans outward by 45°, or inward."""
    rows, columns = np.arange(3), 0.1 * np.arange(-30, 31)
    ground = Ground(
        0, -30, np.zeros((3, len(columns))), np.full(3, 0.08), np.tile([-2.0, 2.0], (3, 1)), np.tile([-lean, lean], (3, 1))
    )
    assert len(rows) == len(ground.height)
    up = np.array([0.01, 0.03, 0.07])
    for side in (-1.0, 1.0):
        on_wall = ground.is_ground(np.ones(3), side * (2.0 + lean * up), up)
        on_ground = ground.is_ground(np.ones(3), side * (2.0 - up), np.zeros(3))
        assert not on_wall.any()
        assert on_ground.all()
    # In a niche behind the wall there is no ground of the tunnel.
    assert not ground.is_ground(np.ones(1), np.array([2.5]), np.zeros(1))[0]


def test_face_of_a_kerb_is_ground_but_not_what_stands_on_it():
    height = np.zeros((3, 21))
    height[:, 10:] = 0.3
    ground = Ground(0, 0, height, np.full(3, 0.02), np.full((3, 2), np.nan), np.full((3, 2), np.nan))
    face = np.array([0.05, 0.15, 0.25])
    assert ground.is_ground(np.ones(3), np.full(3, 0.95), face).all()
    assert not ground.is_ground(np.ones(2), np.array([0.95, 1.5]), np.array([0.4, 0.35])).any()
    assert not ground.is_ground(np.ones(1), np.array([0.5]), np.array([0.1]))[0]


def test_rows_of_a_part_give_the_same_ground():
    ground = _sloping()
    part = ground.rows(53, 57)
    assert (part.start, len(part.height)) == (53, 4)
    a, x = np.linspace(53, 56, 20), np.linspace(-1, 1, 20)
    np.testing.assert_array_equal(part.height_at(a, x), ground.height_at(a, x))
    assert len(ground.rows(0, 10).height) == 0
    assert len(ground.rows(0, 1000).height) == 11


def test_a_single_row_is_a_ground():
    part = _sloping().rows(55, 56)
    assert part.height_at(np.array([55.0]), np.array([0.0]))[0] == pytest.approx(102.2)
    assert np.isnan(part.height_at(np.array([55.5]), np.array([0.0]))[0])


def test_errors_and_kappa_of_the_papers_scene():
    """Li et al. 2023, table 3, scene 2, their method: 0.20, 1.44, 1.16, 96.71 %."""
    a = Agreement(868328, 1735, 43540, 2981234)
    assert [round(100 * v, 2) for v in (a.type_one, a.type_two, a.total)] == [0.20, 1.44, 1.16]
    assert 100 * a.kappa == pytest.approx(96.71, abs=0.02)


def test_agreement_counts_points_and_gives_cohens_kappa():
    rng = np.random.default_rng(5)
    truth = rng.random(2000) < 0.3
    found = truth ^ (rng.random(2000) < 0.05)
    a = Agreement.of(truth, found)
    assert (a.ground, a.missed, a.false_ground, a.other) == (
        (truth & found).sum(), (truth & ~found).sum(), (~truth & found).sum(), (~truth & ~found).sum(),
    )  # fmt: skip
    sklearn = pytest.importorskip("sklearn.metrics")
    assert a.kappa == pytest.approx(sklearn.cohen_kappa_score(truth, found))
    assert (a + a).total == pytest.approx(a.total)
    with pytest.raises(ValueError, match="do not match"):
        Agreement.of(truth, found[:5])
    assert np.isnan(Agreement.of([], []).kappa)
