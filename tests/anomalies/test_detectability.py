"""Detectability: the logistic model against closed forms, blocks and unknown places, and pieces chosen by place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import expit, logit

from tunneldb.anomalies.background.contrast import contrast_image
from tunneldb.anomalies.background.level_map import map_background
from tunneldb.anomalies.detect import Detection, find_anomalies
from tunneldb.anomalies.detectability.blocks import DROPS, Detectability, measure_detectability
from tunneldb.anomalies.detectability.chance import PRIOR, Chance
from tunneldb.anomalies.detectability.conditions import Conditions, measure_conditions
from tunneldb.anomalies.detectability.pieces import Pieces, choose_rounds
from tunneldb.anomalies.detectability.trials import Trials
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState

GRID = Grid(12, 0.1, -100, 200, 5, (2, 5))  # 150 m by 20 m
BARE = slice(0, 40)  # rows without points, of arc 6 to 10 m


def picture(noise: float) -> LiningImage:
    """Return dry lining with normal noise, dB, without points in some rows."""
    rng = np.random.default_rng(3)
    state = np.full((GRID.rows, GRID.columns), PixelState.OFF, np.uint8)
    state[:, GRID.near] = PixelState.LINING
    state[BARE, GRID.near] = PixelState.EMPTY
    level = np.rint(-1200.0 + 100.0 * noise * rng.standard_normal(state.shape)).astype(np.int16)
    level[state != PixelState.LINING] = NODATA
    return LiningImage(GRID, state, level)


def search(image: LiningImage) -> tuple[Conditions, Detection]:
    background = map_background(image)
    contrast = contrast_image(image, background)
    found = find_anomalies(contrast, background, 0.05)
    return measure_conditions(contrast, found.dark, found.size), found


def detectability(noise: float) -> tuple[Conditions, Trials, Detectability]:
    image = picture(noise)
    pieces = Pieces.of(image)
    conditions, found = search(image)
    trials = pieces.try_out(found.dark, conditions, lambda other: search(other)[1].wet)
    return conditions, trials, measure_detectability(GRID, conditions, trials, 0.3, 3.0)


@pytest.fixture(scope="module")
def quiet() -> tuple[Conditions, Trials, Detectability]:
    return detectability(0.3)


def drawn_trials(count: int, slopes: tuple[float, float], seed: int = 1) -> Trials:
    """Return trials whose chance depends on the logarithms of area and darkening alone."""
    rng = np.random.default_rng(seed)
    area, drop = np.exp(rng.uniform(np.log(0.05), np.log(3.0), count)), np.exp(rng.uniform(np.log(0.7), np.log(9.0), count))
    chance = expit(0.5 + slopes[0] * np.log(area) + slopes[1] * np.log(drop))
    conditions = np.column_stack([rng.normal(-1.0, 0.1, count), rng.normal(-0.5, 0.1, count), rng.uniform(0.0, 0.1, count)])
    return Trials(area, drop, conditions, rng.random(count) < chance)


def test_the_model_is_the_most_probable_one() -> None:
    """Compared with the minimum of the negative logarithm of the posterior, by a general minimizer."""
    trials = drawn_trials(300, (1.5, 2.0))
    chance = Chance.fit(trials)
    raw = np.column_stack([np.log(trials.area), np.log(trials.drop), trials.conditions])
    x = np.column_stack([np.ones(len(raw)), (raw - raw.mean(axis=0)) / raw.std(axis=0)])
    used = np.concatenate([[True], chance.coefficients[1:] != 0.0])
    sign = np.where(trials.found, 1.0, -1.0)
    penalty = np.concatenate([[1e-3], np.full(used.sum() - 1, 1.0 / PRIOR**2)])

    def loss(w: np.ndarray) -> float:
        return float(np.logaddexp(0.0, -sign * (x[:, used] @ w)).sum() + 0.5 * (penalty * w**2).sum())

    found = minimize(loss, np.zeros(used.sum()), method="BFGS", options={"gtol": 1e-7})
    assert chance.coefficients[used] == pytest.approx(found.x, abs=1e-4)


def test_the_smallest_leak_is_that_of_the_closed_form() -> None:
    """In conditions that are the same everywhere, logit 0.9 determines the area."""
    trials = drawn_trials(2000, (1.5, 2.0))
    trials = replace(trials, conditions=np.tile([-1.0, -0.5, 0.0], (2000, 1)))
    conditions = Conditions(5, np.full((40, 50 * 10 * 5 // 5), 25), np.tile([[[-1.0]], [[-0.5]], [[0.0]]], (1, 40, 500)))
    grid = Grid(12, 0.1, -100, 200, 5, (2, 5))
    found = measure_detectability(grid, conditions, trials, 0.3, 3.0)
    chance = Chance.fit(trials)
    constant = chance.coefficients[0] - (chance.coefficients[1:3] * chance.centre[:2] / chance.scale[:2]).sum()
    slope = chance.coefficients[1:3] / chance.scale[:2]
    for k, drop in enumerate(DROPS):
        area = np.exp((logit(0.9) - constant - slope[1] * np.log(drop)) / slope[0])
        expected = np.nan if area > 3.0 else max(area, 0.05)
        assert found.smallest[k] == pytest.approx(expected, rel=0.01, nan_ok=True)
    assert found.probability == pytest.approx(expit(constant + slope @ np.log([0.3, 3.0])), abs=1e-6)
    assert found.lining.sum() == pytest.approx(150.0 * 20.0)


@pytest.mark.parametrize("slopes", [(-1.5, 2.0), (1.5, -2.0)])
def test_larger_and_darker_leaks_are_not_found_less_often(slopes: tuple[float, float]) -> None:
    trials = drawn_trials(300, slopes)
    chance = Chance.fit(trials)
    assert chance.coefficients[1 + slopes.index(min(slopes))] == 0.0
    assert chance.coefficients[1 + slopes.index(max(slopes))] > 1.0


def test_blocks_cover_the_inspected_lining_and_no_more(quiet: tuple[Conditions, Trials, Detectability]) -> None:
    _, trials, found = quiet
    assert found.trials == len(trials.found) >= 60
    assert found.lining.sum() == pytest.approx(150.0 * 16.0, rel=0.02), "not the rows without points"
    assert found.arc_to.max() == pytest.approx(6.0, abs=0.5)
    assert (found.chainage_from.min(), found.chainage_to.max()) == (12_100.0, 12_250.0)
    assert (found.chainage_to - found.chainage_from).max() <= 10.0
    assert (found.arc_to - found.arc_from).max() <= 3.0


def test_more_noise_hides_larger_leaks(quiet: tuple[Conditions, Trials, Detectability]) -> None:
    noisy = detectability(1.5)[2]
    area = [np.where(np.isnan(found.smallest[1]), 9.0, found.smallest[1]) for found in (quiet[2], noisy)]
    assert np.median(area[1]) > 2.0 * np.median(area[0])
    assert np.median(noisy.probability) < np.median(quiet[2].probability)


def test_what_is_worse_than_all_trials_is_unknown(quiet: tuple[Conditions, Trials, Detectability]) -> None:
    conditions, trials, _ = quiet
    values = conditions.values.copy()
    west = slice(0, values.shape[2] // 2)
    values[0, :, west] += np.log(4.0)
    found = measure_detectability(GRID, replace(conditions, values=values), trials, 0.3, 3.0)
    middle = GRID.west + 0.5 * GRID.columns * GRID.pixel
    assert np.isnan(found.probability[found.chainage_to <= middle]).all()
    assert np.isnan(found.smallest[:, found.chainage_to <= middle]).all()
    assert np.isfinite(found.probability[found.chainage_from >= middle]).any()


def test_with_few_trials_all_is_unknown(quiet: tuple[Conditions, Trials, Detectability]) -> None:
    conditions, trials, _ = quiet
    few = Trials(trials.area[:59], trials.drop[:59], trials.conditions[:59], trials.found[:59])
    assert np.isnan(measure_detectability(GRID, conditions, few, 0.3, 3.0).probability).all()


def test_a_short_tunnel_has_no_trials() -> None:
    image = picture(0.3)
    image.state[:, GRID.inner.start + 250 :] = PixelState.OFF  # 25 m by 20 m are left
    assert Pieces.of(image).rounds == []


def test_trials_do_not_depend_on_the_neighbouring_kilometres(quiet: tuple[Conditions, Trials, Detectability]) -> None:
    """The picture beyond the ends of a kilometre, and what is copied of it, has no influence on the pieces."""
    image = picture(0.3)
    pieces = Pieces.of(image)
    beyond = np.ones(GRID.columns, bool)
    beyond[GRID.inner] = False
    image.state[:, beyond] = PixelState.OFF
    again = Pieces.of(image)
    assert pieces.rounds == again.rounds
    assert all((pieces.levels[k] == again.levels[k]).all() for k in pieces.levels)


def test_pieces_are_spread_and_few() -> None:
    rounds = choose_rounds(range(240, 260))
    assert rounds[0] == [(241, 0), (245, 0), (249, 0), (253, 0), (257, 0)]
    assert sum(map(len, rounds)) == 6
    assert choose_rounds([7]) == [[(7, 0)], [(7, 1)]]
    assert choose_rounds([]) == []
