"""Size of pixels by the density of points, and sums of small pixels as those of large ones."""

from __future__ import annotations

import numpy as np
import pytest

from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.grid import Grid
from tunneldb.raster.pixel_size import choose_factor, coarse_grid, coarsen
from tunneldb.raster.projection import Pixels

LOW, HIGH = -3.77, 3.77
"""Arcs of the image, m, not whole multiples of its pixels."""


def points_of(density: float, seed: int = 1) -> np.ndarray:
    """Return random places (n, 2) on the first 50 m, m: chainage and arc."""
    rng = np.random.default_rng(seed)
    count = rng.poisson(density * 50.0 * (HIGH - LOW))
    return rng.uniform((0.0, LOW), (50.0, HIGH), (count, 2))


def image_of(grid: Grid, places: np.ndarray) -> Accumulator:
    image = Accumulator(grid)
    row, column = grid.place(places[:, 0], places[:, 1])
    pixels = Pixels.empty(len(places))
    pixels.row[:], pixels.column[:] = row, column
    pixels.weight[:] = 1 + np.arange(len(places)) % 64
    pixels.offset[:] = 0.01 * np.sin(places[:, 0])
    pixels.raw[:], pixels.corrected[:] = places[:, 1], -places[:, 0]
    image.add(pixels, len(places))
    return image


def grid_of(pixel: float, halo: int = 0) -> Grid:
    return Grid.covering(0, pixel, LOW, HIGH, halo, (0.0, 50.0))


@pytest.mark.parametrize(
    ("density", "factor"), [(10_000.0, 1), (1500.0, 1), (500.0, 2), (300.0, 2), (150.0, 4), (60.0, 4), (20.0, 10), (3.0, 10)]
)
def test_fewer_points_have_larger_pixels(density: float, factor: int) -> None:
    chosen, found = choose_factor(image_of(grid_of(0.02), points_of(density)))
    assert chosen == factor
    if 20.0 <= density <= 2000.0:
        assert found == pytest.approx(density, rel=0.15)


def test_the_median_place_decides() -> None:
    """A third of the length is scanned by fewer points, and half of it not at all."""
    places = points_of(2000.0)
    thin = points_of(100.0, seed=2)
    some = np.vstack([places[places[:, 0] < 17.0], thin[(thin[:, 0] > 17.0) & (thin[:, 0] < 25.0)]])
    assert choose_factor(image_of(grid_of(0.02), some))[0] == 1


@pytest.mark.parametrize("factor", [2, 4, 10])
def test_sums_are_those_of_points_sorted_into_large_pixels(factor: int) -> None:
    places = points_of(100.0)
    image = image_of(grid_of(0.02), places)
    grid = coarse_grid(image.grid, factor, 0)
    assert (grid.pixel, grid.bottom, grid.rows) == (0.02 * factor, *_rows(0.02 * factor))
    large = Accumulator(grid)
    coarsen(image, large)
    expected = image_of(grid, places)
    assert large.blocks() == expected.blocks() == [0]
    assert np.array_equal(large.sums(0), expected.sums(0))


def _rows(pixel: float) -> tuple[int, int]:
    bottom = int(np.floor(LOW / pixel))
    return bottom, int(np.ceil(HIGH / pixel)) - bottom
