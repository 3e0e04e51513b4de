"""Lining with too few points about it is left out: points strewn at random at known densities, and what merely has gaps."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.anomalies.sparse import least_density, leave_out_sparse
from tunneldb.anomalies.threshold import MEDIAN_PIXELS
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import MAX_MEDIAN, LiningImage
from tunneldb.raster.state import PixelState

PIXEL = 0.02
GRID = Grid(0, PIXEL, -250, 500)
LENGTH = 2000  # columns that hold points: 40 m
LEAST = least_density(12.0, PIXEL)


def strewn(density: float, seed: int = 1) -> LiningImage:
    """10 m by 40 m of lining with points at random."""
    rng = np.random.default_rng(seed)
    state = np.full((GRID.rows, GRID.columns), PixelState.OFF, np.uint8)
    state[:, :LENGTH] = PixelState.EMPTY
    count = rng.poisson(density * GRID.rows * LENGTH * PIXEL**2)
    state[rng.integers(0, GRID.rows, count), rng.integers(0, LENGTH, count)] = PixelState.LINING
    return picture(state)


def picture(state: np.ndarray) -> LiningImage:
    return LiningImage(GRID, state, np.where(state == PixelState.LINING, 0, NODATA).astype(np.int16))


def left(image: LiningImage) -> float:
    """Share of the pixels with points that stay."""
    before = np.count_nonzero(image.state == PixelState.LINING)
    leave_out_sparse(image, LEAST)
    stays = image.state == PixelState.LINING
    assert ((image.level != NODATA) == stays).all()
    return float(np.count_nonzero(stays) / before)


@pytest.mark.parametrize(
    ("density", "low", "high"), [(5, 0.0, 0.0), (8, 0.0, 0.01), (18, 0.8, 1.0), (30, 0.999, 1.0), (400, 1.0, 1.0)]
)
def test_by_density(density: float, low: float, high: float) -> None:
    assert low <= left(strewn(density)) <= high


def test_the_share_is_that_of_the_lining() -> None:
    image, sparse = strewn(100), strewn(5)
    half = slice(0, LENGTH // 2)
    image.state[:, half], image.level[:, half] = sparse.state[:, half], sparse.level[:, half]
    assert leave_out_sparse(image, LEAST) == pytest.approx(0.5, abs=0.02)
    assert not (image.state[:, : LENGTH // 2 - 2 * MAX_MEDIAN] == PixelState.LINING).any()
    lining = np.count_nonzero(image.state[:, LENGTH // 2 + 2 * MAX_MEDIAN : LENGTH] == PixelState.LINING)
    assert lining * PIXEL**-2 / (500 * (LENGTH // 2 - 2 * MAX_MEDIAN)) == pytest.approx(100, rel=0.05)


def test_shadows_and_narrow_strips_of_a_dense_scan_stay() -> None:
    """Half of the lining behind cables, and a strip of 0.2 m between floor and niche, are seen where points are."""
    state = strewn(2500).state
    state[::10], state[1::10], state[2::10] = PixelState.EMPTY, PixelState.EMPTY, PixelState.EMPTY
    state[:, 800:1000] = PixelState.OFF
    state[:, 890:900] = np.where(np.arange(500)[:, None] % 2, PixelState.LINING, PixelState.EMPTY)
    assert left(picture(state)) == 1.0


def test_profiles_far_apart_stay() -> None:
    """What lies between them is taken from the nearest, as `ProfileGaps.close` has left the states."""
    state = strewn(0).state
    state[::2, :LENGTH] = PixelState.LINING
    assert left(picture(state)) == 1.0


def test_pixels_that_the_widest_filter_cannot_fill_ask_for_more() -> None:
    for pixel in (0.005, 0.01, 0.02):
        assert least_density(0.0, pixel) * (MAX_MEDIAN * pixel) ** 2 == pytest.approx(MEDIAN_PIXELS)
    assert least_density(12.0, 0.1) == 12.0
