"""Dark pixels by the local threshold and the median filter, and statistics of dry lining."""

import numpy as np
import pytest
from shapely.geometry import box

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.threshold import dark_pixels, filter_size
from tunneldb.radiometry.robust_statistics import plain_statistics, robust_statistics
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

TILE = 25


def spotted(seed=5):
    """60 % of 200 by 300 pixels hold lining, within ±0.3 dB, but for a disc 3 dB darker; by tiles sigma is 0.3 to 1.2 dB."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:200, :300]
    disc = np.hypot(row - 99.5, column - 149.5) < 60
    state = np.where(
        rng.random(disc.shape) < 0.6, rng.choice([PixelState.LINING, PixelState.RECESS], disc.shape), PixelState.EMPTY
    )
    drop = np.where(state > 0, np.rint(100 * (rng.normal(0, 0.3, disc.shape) + 3.0 * disc)), NODATA).astype(np.int16)
    sigma = rng.uniform(0.3, 1.2, (8, 12)).astype(np.float32)
    return ContrastImage(Grid(0, 0.02, 0, 200), state.astype(np.uint8), drop, TILE, sigma), disc


@pytest.mark.parametrize("size", [5, 7, 11])
def test_a_pixel_is_dark_by_the_vote_of_the_lining_about_it(size):
    contrast, _ = spotted()
    state, drop = contrast.state, contrast.drop
    state[50:60, 20:90] = PixelState.OFF
    state[:30] = PixelState.FLOOR
    found = dark_pixels(contrast, size)
    rng, half = np.random.default_rng(1), size // 2
    limit = 3.0 * np.kron(contrast.sigma, np.ones((TILE, TILE)))
    for i, j in zip(rng.integers(0, 200, 500), rng.integers(0, 300, 500), strict=True):
        about = np.s_[max(i - half, 0) : i + half + 1, max(j - half, 0) : j + half + 1]
        lining = (state[about] == PixelState.LINING) | (state[about] == PixelState.RECESS)
        dark = lining & (drop[about] / 100.0 > limit[about])
        assert found[i, j] == (2 * dark.sum() > lining.sum() > 0.2 * 12 and state[i, j] <= PixelState.RECESS)


def test_what_is_dark_here_is_not_where_the_lining_varies_more():
    contrast, disc = spotted()
    for sigma, dark in ((0.4, True), (0.8, True), (1.2, False)):
        contrast.sigma[:] = sigma
        assert (dark_pixels(contrast, 5)[disc].mean() > 0.95) == dark
        assert not dark_pixels(contrast, 5)[~disc].any() or dark


def test_an_appendage_is_never_dark():
    contrast, disc = spotted()
    contrast.sigma[:] = 0.4
    contrast.state[:, 140:145] = PixelState.OFF
    found = dark_pixels(contrast, 5)
    closed = contrast.state == PixelState.OFF
    assert not found[closed].any()
    assert found[disc & ~closed].mean() > 0.95


def test_nothing_in_a_drawn_dry_region_is_dark():
    small, _ = spotted()
    grid, shape = small.grid, (small.grid.rows, small.grid.columns)
    state, drop = np.zeros(shape, np.uint8), np.full(shape, NODATA, np.int16)
    state[:, :300], drop[:, :300] = small.state, small.drop
    sigma = np.full((8, grid.columns // TILE), 0.4, np.float32)
    before = dark_pixels(ContrastImage(grid, state, drop, TILE, sigma), 5)
    found = dark_pixels(ContrastImage(grid, state, drop, TILE, sigma, (box(2.0, 1.0, 3.0, 3.0),)), 5)
    inside = np.zeros(shape, bool)
    inside[50:150, 100:150] = True
    assert before[inside].any()
    assert not found[inside].any()
    np.testing.assert_array_equal(found[~inside], before[~inside])


def test_filter_widens_where_pixels_are_sparse():
    assert filter_size(1.0) == 5
    assert filter_size(0.5) == 5
    assert filter_size(0.1) == 11
    assert filter_size(0.0) % 2 == 1


@pytest.mark.parametrize("wet", [0.0, 0.1, 0.2, 0.3])
def test_wet_lining_does_not_shift_the_dry_statistics(wet):
    rng = np.random.default_rng(3)
    values = rng.normal(2.0, 0.4, 100_000)
    values[: int(wet * len(values))] -= rng.uniform(1.0, 5.0, int(wet * len(values)))
    dry = robust_statistics(np.append(values, [np.nan, np.inf, -np.inf]))
    assert dry.mean == pytest.approx(2.0, abs=0.02)
    assert dry.sigma == pytest.approx(0.4, rel=0.05)
    assert dry.threshold == pytest.approx(0.8, abs=0.08)


def test_statistics_of_nothing():
    assert plain_statistics(np.array([np.nan])).count == 0
    assert np.isnan(robust_statistics(np.zeros(0)).mean)
    assert robust_statistics(np.full(10, 3.0)).threshold == pytest.approx(3.0)
