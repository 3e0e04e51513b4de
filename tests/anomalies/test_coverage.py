"""Lining, what was seen of it and what is wet along a kilometre, against a plain count."""

import numpy as np
import pytest
from scipy import ndimage

from tunneldb.anomalies.coverage import measure_coverage
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState


def picture(rng, grid):
    """States in patches, and patches that are dark."""
    coarse = (grid.rows // 5 + 1, grid.columns // 5 + 1)
    state = np.kron(rng.choice([0, 0, 1, 1, 1, 2, 3, 4], coarse), np.ones((5, 5), int))[: grid.rows, : grid.columns]
    state = np.where((state > 0) & (state < 3) & (rng.random(state.shape) < 0.4), 0, state).astype(np.uint8)
    dark = np.kron(rng.random(coarse) < 0.2, np.ones((5, 5), bool))[: grid.rows, : grid.columns]
    return state, dark & (state <= PixelState.RECESS)


@pytest.mark.parametrize(("pixel", "halo", "step"), [(0.5, 0, 0.5), (0.1, 12, 0.1), (0.04, 5, 0.2), (0.05, 7, 0.1)])
@pytest.mark.parametrize("size", [5, 9])
def test_areas_are_those_of_the_pixels(pixel, halo, step, size):
    grid = Grid.covering(3, pixel, -30 * pixel, 30 * pixel, halo)
    state, dark = picture(np.random.default_rng(1), grid)
    found = measure_coverage(state, dark, grid, size)
    assert found.step == pytest.approx(step)
    assert len(found.lining) == round(1000 / step)
    lining = state <= PixelState.RECESS
    held = (state == PixelState.LINING) | (state == PixelState.RECESS)
    votes = ndimage.convolve(held.astype(int), np.ones((size, size), int), mode="constant")
    seen = lining & (held | (votes > 0.2 * min(size * size, 12)))
    assert 0 < (seen & ~held).sum() < (lining & ~held).sum()
    for areas, mask in ((found.lining, lining), (found.seen, seen), (found.wet, seen & dark)):
        counts = mask[:, grid.inner].sum(axis=0).reshape(len(areas), -1).sum(axis=1)
        np.testing.assert_allclose(areas, counts * pixel**2, rtol=1e-5)


def test_steps_begin_with_the_kilometre_where_the_grid_does_not():
    grid = Grid.covering(3, 0.1, -3.0, 3.0, 12, (3120.0, 3190.0))
    state, dark = picture(np.random.default_rng(2), grid)
    found = measure_coverage(state, dark, grid, 5)
    assert len(found.lining) == 10_000
    lining = (state <= PixelState.RECESS)[:, grid.inner].sum(axis=0) * 0.01
    np.testing.assert_allclose(found.lining[1000:2000], lining, rtol=1e-5)
    assert not np.delete(found.lining, np.arange(1000, 2000)).any()


def test_floor_and_appendages_do_not_count_and_what_was_not_scanned_is_not_seen():
    grid = Grid.covering(0, 0.1, 0.0, 1.0)
    state = np.zeros((grid.rows, grid.columns), np.uint8)
    state[:, :5000] = PixelState.LINING
    state[:2], state[2:4] = PixelState.FLOOR, PixelState.OFF
    found = measure_coverage(state, np.zeros(state.shape, bool), grid, 5)
    np.testing.assert_allclose(found.lining, 0.06, rtol=1e-5)
    np.testing.assert_allclose(found.seen[:5000], 0.06, rtol=1e-5)
    assert not found.seen[5002:].any()
    assert not found.wet.any()
