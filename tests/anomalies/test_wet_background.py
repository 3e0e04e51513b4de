"""The background without what a network found wet."""

import numpy as np
import pytest

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.level_map import map_background
from tunneldb.anomalies.detect import find_dark, find_dark_regions
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState

DRY, DARKER = -20.0, 4.0


@pytest.fixture(scope="module")
def picture() -> tuple[LiningImage, np.ndarray]:
    """Lining of 50 m with noise, and a band of 1 m at its lower edge that is darker along all of it."""
    grid = Grid(0, 0.02, -200, 400, 0, (0, 1))
    level = DRY + np.random.default_rng(1).normal(0, 0.3, (400, grid.columns))
    band = np.zeros(level.shape, np.bool_)
    band[350:] = True
    level[band] -= DARKER
    return LiningImage(grid, np.full(level.shape, PixelState.LINING, np.uint8), np.rint(100 * level).astype(np.int16)), band


def level_of(image: LiningImage, wet: np.ndarray | None, rows: slice) -> float:
    background = map_background(image, [], wet)
    return float(np.median(background.level.levels(rows, slice(0, image.grid.columns))))


def test_a_band_along_the_whole_tunnel_is_part_of_the_background_unless_it_is_wet(picture):
    image, band = picture
    assert level_of(image, None, slice(360, 400)) == pytest.approx(DRY - DARKER, abs=0.3)
    assert level_of(image, band, slice(360, 400)) == pytest.approx(DRY, abs=0.3)
    assert level_of(image, band, slice(0, 340)) == pytest.approx(DRY, abs=0.1)


def test_where_hardly_any_dry_lining_would_be_left_all_of_it_counts(picture):
    image, band = picture
    wet = np.ones_like(band)
    wet[:20] = False
    background = map_background(image, [], wet)
    assert background.count == image.state.size
    assert level_of(image, wet, slice(0, 340)) == pytest.approx(DRY, abs=0.1)


@pytest.mark.parametrize("by", [-2, 2, 4])
def test_water_that_a_network_outlines_too_tight_or_too_wide_ends_where_it_is_half_as_dark(by):
    """A disc of 0.6 m, 3 dB: outlined by 4 cm too small, and by 4 and 8 cm too large."""
    grid = Grid(0, 0.02, -200, 400, 0, (0, 1))
    rows, columns = np.mgrid[:400, : grid.columns]
    distance = np.hypot(rows - 200, columns - 1000)
    drop = np.rint(100 * (3.0 * (distance < 15) + np.random.default_rng(2).normal(0, 0.2, distance.shape))).astype(np.int16)
    water = np.where(distance < 15 + by, 255, 0).astype(np.uint8)
    sigma = np.full((16, grid.columns // 25), 0.2, np.float32)
    image = ContrastImage(grid, np.full(drop.shape, PixelState.LINING, np.uint8), drop, 25, sigma, water=water)
    (found,) = (region for region in find_dark_regions(find_dark(image), image, 0.05) if region.area > 0.05)
    assert found.area == pytest.approx(np.pi * 0.3**2, rel=0.1)
