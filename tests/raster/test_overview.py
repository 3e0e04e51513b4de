"""Overviews are means of whole pixels, in their place."""

from __future__ import annotations

import numpy as np
import pytest
from affine import Affine

from tunneldb.raster.geotiff import Raster
from tunneldb.raster.overview import Overview, overview_factor
from tunneldb.raster.state import PixelState
from tunneldb.raster.tiles import FILL_DISTANCE, Tile, display, reduce, sample


@pytest.mark.parametrize(("pixel", "factor"), [(0.02, 20), (0.04, 10), (0.08, 5), (0.2, 2), (0.5, 1), (0.01, 40), (0.05, 8)])
def test_pixels_are_of_forty_centimetres_and_divide_a_block(pixel: float, factor: int) -> None:
    assert overview_factor(pixel) == factor
    assert round(50.0 / pixel) % factor == 0


def test_each_pixel_is_the_mean_of_what_it_covers() -> None:
    rng = np.random.default_rng(1)
    overview = Overview("corrected")
    blocks = {}
    for number in (3, 4, 6):  # block 5 has no points
        values = rng.normal(size=(47, 250)).astype(np.float32)
        values[rng.random(values.shape) < 0.3] = np.nan
        blocks[number] = values
        overview.add(Raster(values, Affine(0.2, 0, number * 50.0, 0, -0.2, 4.6)))
    found = overview.raster()
    assert found is not None
    assert found.values.shape == (24, 500)
    assert found.transform == Affine(0.4, 0, 150.0, 0, -0.4, 4.6)
    assert np.isnan(found.values[:, 250:375]).all()
    for row, column, block in ((0, 0, 3), (5, 124, 3), (22, 130, 4), (11, 400, 6)):
        across = (column - (block - 3) * 125) * 2
        assert found.values[row, column] == pytest.approx(
            np.nanmean(blocks[block][2 * row : 2 * row + 2, across : across + 2]), rel=1e-6
        )


def test_states_keep_the_most_frequent_code() -> None:
    values = np.full((4, 250), PixelState.LINING, np.float32)
    values[0, 0] = values[0, 1] = values[1, 0] = PixelState.DARK
    overview = Overview("state")
    overview.add(Raster(values, Affine(0.2, 0, 0, 0, -0.2, 1)))
    found = overview.raster()
    assert found is not None
    assert found.values[0, 0] == PixelState.DARK
    assert (np.delete(found.values.ravel(), 0) == PixelState.LINING).all()


def test_without_blocks_there_is_none() -> None:
    assert Overview("raw").raster() is None


def test_reduced_image_covers_the_same_place() -> None:
    raster = Raster(np.arange(1000, dtype=np.float32).reshape(10, 100), Affine(0.5, 0, 100.0, 0, -0.5, 2.0))
    smaller = reduce(raster, 1.0, codes=False)
    assert smaller.values.shape == (5, 50)
    assert smaller.transform == Affine(1.0, 0, 100.0, 0, -1.0, 2.0)
    assert smaller.values[0, 0] == np.mean([0, 1, 100, 101])
    assert reduce(raster, 0.4, codes=False) is raster


def test_tile_shows_the_pixel_at_its_place() -> None:
    tile = Tile(20, 2**19, 2**19)  # begins at 0, 0, and goes to the right and down
    assert (tile.west, tile.north) == pytest.approx((0.0, 0.0), abs=1e-6)
    image = Raster(np.arange(12, dtype=np.float32).reshape(3, 4), Affine(10.0, 0, 0.0, 0, -10.0, 0.0))
    values = sample(tile, [image])
    for row, column in ((0, 0), (100, 200), (255, 255), (67, 66)):
        x, y = (column + 0.5) * tile.pixel, (row + 0.5) * tile.pixel
        expected = image.values[int(y // 10), int(x // 10)] if x < 40 and y < 30 else np.nan
        np.testing.assert_equal(values[row, column], expected)


def test_narrow_gaps_are_filled_for_display_and_wide_ones_stay() -> None:
    values = np.ones((100, 300), np.float32)
    values[20:22] = np.nan  # 4 cm
    values[50:70] = np.nan  # 40 cm
    tile = Tile(23, 2**22, 2**22)
    image = Raster(values, Affine(0.02, 0, -1.0, 0, -0.02, 0.0))
    plain, shown = sample(tile, [image]), display(tile, [image], codes=False)
    row = (np.array([0.42, 1.2]) / tile.pixel).astype(int)
    assert np.isnan(plain[row, 100]).all()
    assert shown[row[0], 100] == 1.0
    assert np.isnan(shown[row[1], 100])
    assert np.isnan(shown[:99]).mean() < np.isnan(plain[:99]).mean()
    assert np.array_equal(display(tile, [image], codes=True), plain, equal_nan=True)
    far = Tile(18, 2**17, 2**17)
    assert far.pixel > FILL_DISTANCE
    assert np.array_equal(display(far, [image], codes=False), sample(far, [image]), equal_nan=True)
