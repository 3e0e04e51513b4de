"""Compiled loops over images against SciPy and NumPy."""

import numpy as np
import pytest
from scipy import ndimage

from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.smoothing import MIN_WEIGHT, count_states, enlarged, mean_about


@pytest.mark.parametrize("sigma", [2.0, 5.0, 18.75])
def test_means_about_pixels_are_those_of_gaussian_filters(sigma):
    rng = np.random.default_rng(1)
    values = rng.normal(-20.0, 3.0, (90, 140)).astype(np.float32)
    weight = (rng.random(values.shape) < 0.4).astype(np.float32)
    weight[:, 30:] = 0.0
    weight[40:50, 100:110] = 3.0
    sums, total = (ndimage.gaussian_filter(one, sigma, truncate=3.0, mode="constant") for one in (values * weight, weight))
    found = mean_about(values, weight, sigma, 3.0)
    far = np.abs(total - MIN_WEIGHT) > 1e-5  # whether weights next to the limit count is open
    np.testing.assert_array_equal(np.isnan(found)[far], (total <= MIN_WEIGHT)[far])
    there = (total > MIN_WEIGHT) & ~np.isnan(found)
    np.testing.assert_allclose(found[there], (sums / np.maximum(total, MIN_WEIGHT))[there], atol=2e-4)


@pytest.mark.parametrize(("shape", "times"), [((7, 5), 4), ((1, 6), 4), ((6, 1), 2), ((8, 9), 1)])
def test_enlarged_images_are_linear_between_the_middles_of_large_pixels(shape, times):
    image = np.random.default_rng(2).normal(size=shape).astype(np.float32)
    expected = image
    for axis in (0, 1):
        middles = (np.arange(expected.shape[axis]) + 0.5) * times
        at = np.arange(expected.shape[axis] * times) + 0.5
        expected = np.apply_along_axis(lambda line, at=at, middles=middles: np.interp(at, middles, line), axis, expected)
    np.testing.assert_allclose(enlarged(image, times), expected, atol=1e-6)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_combined_pixels_have_the_mean_of_lining_with_points(n):
    rng = np.random.default_rng(3)
    state = rng.choice(np.array(list(PixelState), np.uint8), (12, 18))
    level = np.where(rng.random(state.shape) < 0.7, rng.integers(-3000, 0, state.shape), NODATA).astype(np.int16)
    filled, mean, mostly = count_states(state, level, n)
    for (row, column), share in np.ndenumerate(filled):
        part = np.s_[row * n : row * n + n, column * n : column * n + n]
        known = np.isin(state[part], (PixelState.LINING, PixelState.RECESS)) & (level[part] != NODATA)
        assert share == pytest.approx(known.mean())
        assert mean[row, column] == pytest.approx(level[part][known].mean() if known.any() else 0.0, abs=1e-3)
        states = ((PixelState.OFF,), (PixelState.RECESS,), (PixelState.FLOOR, PixelState.SUBMERGED))
        assert mostly[:, row, column].tolist() == [np.isin(state[part], some).mean() > 0.5 for some in states]
