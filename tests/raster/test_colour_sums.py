"""Sums of colours by pixel: exact, in any order, on any number of threads, in little memory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from tunneldb.errors import UserError
from tunneldb.raster.colour_sums import ColourSums
from tunneldb.raster.geotiff import RGB, Raster, decode, encode
from tunneldb.raster.grid import Grid
from tunneldb.raster.overview import Overview
from tunneldb.raster.pixel_size import coarse_grid, coarsen
from tunneldb.raster.profiles import ProfileGaps
from tunneldb.raster.projection import Pixels
from tunneldb.threads import threads, use_threads

GRID = Grid(0, 0.02, -48, 100, 0, (0, 4))


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    before = threads()
    yield
    use_threads(before)


def cloud(count: int, seed: int, full: int) -> tuple[Pixels, np.ndarray]:
    """Points on few pixels, a tenth of them without a colour and a tenth beside the image."""
    rng = np.random.default_rng(seed)
    pixels = Pixels.empty(count)
    pixels.row[:] = rng.integers(0, 8, count)
    pixels.column[:] = rng.integers(0, 4, count) * 2500 + rng.integers(0, 8, count)
    pixels.column[rng.random(count) < 0.1] = -1
    pixels.weight[:] = rng.integers(1, 65, count)
    colour = rng.integers(1, full + 1, (count, 3)).astype(np.uint16)
    colour[rng.random(count) < 0.1] = 0
    return pixels, colour


def mean_by_pixel(pixels: Pixels, colour: np.ndarray, full: int) -> dict[tuple[int, int], np.ndarray]:
    """Weighted means of 64-bit numbers, pixel by pixel."""
    found = {}
    places = np.column_stack([pixels.row, pixels.column])
    for row, column in np.unique(places[pixels.column >= 0], axis=0).tolist():
        inside = (places == (row, column)).all(axis=1) & colour.any(axis=1)
        found[row, column] = np.average(colour[inside] / full * 255.0, axis=0, weights=pixels.weight[inside])
    return found


@pytest.mark.parametrize("full", [255, 65535])
def test_a_pixel_is_the_weighted_mean_of_its_coloured_points(full: int) -> None:
    pixels, colour = cloud(40_000, 1, full)
    with ColourSums(GRID) as sums:
        sums.add(pixels, colour, full)
        images = {block: sums.rgb(block, None) for block in sums.blocks()}
    expected = mean_by_pixel(pixels, colour, full)
    assert len(expected) == 4 * 64
    for (row, column), mean in expected.items():
        np.testing.assert_allclose(images[column // 2500][row, column % 2500], mean, atol=0.02)
    assert sum(np.isfinite(image[:, :, 0]).sum() for image in images.values()) == len(expected)


def test_sums_depend_on_neither_order_nor_threads_nor_memory() -> None:
    pixels, colour = cloud(30_000, 2, 65535)
    images = []
    for count, memory, seed in ((1, 10**9, None), (2, 10**9, 3), (2, 1, 4)):
        use_threads(count)
        order = np.arange(30_000) if seed is None else np.random.default_rng(seed).permutation(30_000)
        with ColourSums(GRID, memory) as sums:
            for part in np.array_split(order, 7):
                sums.add(Pixels(*(array[part] for array in pixels)), colour[part], 65535)
            images.append([sums.sums(block).copy() for block in sums.blocks()])
    for image in images[1:]:
        np.testing.assert_array_equal(image, images[0])


def test_colours_brighter_than_full_are_full() -> None:
    pixels, colour = cloud(1000, 5, 255)
    colour[:] = (300, 255, 0)
    with ColourSums(GRID) as sums:
        sums.add(pixels, colour, 255)
        image = sums.rgb(0, None)
    np.testing.assert_allclose(image[np.isfinite(image[:, :, 0])] - (255, 255, 0), 0, atol=1e-3)


def test_larger_pixels_have_the_same_sums() -> None:
    pixels, colour = cloud(40_000, 6, 255)
    large = coarse_grid(GRID, 4, 0)
    with ColourSums(GRID) as small, ColourSums(large) as few:
        small.add(pixels, colour, 255)
        coarsen(small, few)
        total = [sums.sums(0).reshape(-1, 4).sum(axis=0) for sums in (small, few)]
        np.testing.assert_array_equal(*total)
        assert np.isfinite(few.rgb(0, None)[:, :, 0]).sum() == 4


def test_gaps_between_profiles_are_closed_across_blocks() -> None:
    """A profile every 10 columns: a pixel between two has the colour of the nearest."""
    columns = np.arange(0, 5000, 10)
    pixels = Pixels.empty(len(columns))
    pixels.row[:], pixels.column[:], pixels.weight[:] = 3, columns, 1
    colour = np.column_stack([columns % 251 + 1] * 3).astype(np.uint16)
    gaps = ProfileGaps.of(np.full(GRID.columns, 0.2), GRID.pixel)
    with ColourSums(GRID) as sums:
        sums.add(pixels, colour, 255)
        image = np.concatenate([sums.rgb(0, gaps), sums.rgb(1, gaps)], axis=1)[3, :, 0]
    for column in (13, 2497, 2498, 2503, 4004):
        assert image[column] == pytest.approx((round(column / 10) * 10) % 251 + 1, abs=0.02)


def test_stored_colours_are_those_of_8_bits() -> None:
    """Black is none, so a measured black becomes the darkest blue."""
    rng = np.random.default_rng(7)
    values = rng.integers(0, 256, (70, 130, 3)).astype(np.float32)
    values[5:9, 5:9] = np.nan
    values[20, 20] = 0.3
    raster = Raster(values, GRID.transform())
    found = decode(encode(raster, RGB), RGB)
    with pytest.raises(UserError, match="has 3 bands"):
        decode(encode(raster, RGB))
    with pytest.raises(UserError, match="has 1 bands"):
        decode(encode(Raster(values[:, :, 0], raster.transform), "raw"), RGB)
    assert found.transform == raster.transform
    expected = values.copy()
    expected[20, 20] = (0, 0, 1)
    np.testing.assert_array_equal(found.values, expected)


def test_an_overview_is_the_mean_of_coloured_pixels() -> None:
    values = np.full((40, 2500, 3), np.nan, np.float32)
    values[:20, :20] = (10, 20, 30)
    values[0, 0] = (10, 20, 230)
    overview = Overview(RGB)
    overview.add(Raster(values, GRID.transform()))
    image = overview.raster()
    assert image is not None
    assert image.values.shape == (2, 125, 3)
    np.testing.assert_allclose(image.values[0, 0], (10, 20, 30.5), atol=1e-3)
    assert np.isnan(image.values[1:]).all()
