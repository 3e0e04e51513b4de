"""Lining that differs from brick to brick, stone to stone: it is averaged until water stands out."""

import numpy as np
import pytest
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.texture import TYPICAL_DARKENING, measure_texture, windowed
from tunneldb.anomalies.detect import find_dark
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

PIXEL, TILE, NOISE = 0.02, 25, 0.3


def wall(spread: float, along: float, across: float, seed: int = 3) -> np.ndarray:
    """Drop of 8 m by 16 m of bricks of a size, whose means have a standard deviation, dB."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:400, :800] * PIXEL
    course = (row / across).astype(int)
    brick = ((column + 0.5 * along * (course % 2)) / along).astype(int)
    return rng.normal(0, spread, (400, 800))[course, brick] + rng.normal(0, NOISE, row.shape)


def image(drop: np.ndarray, sigma: float) -> ContrastImage:
    grid = Grid(0, PIXEL, -200, 400, covered=(0, 1))
    steps, state = np.full((400, grid.columns), NODATA, np.int16), np.zeros((400, grid.columns), np.uint8)
    steps[:, :800], state[:, :800] = np.rint(100 * drop), PixelState.LINING
    tiles = np.full((16, grid.columns // TILE), sigma, np.float32)
    texture = measure_texture(state, steps, tiles, TILE, PIXEL)
    return ContrastImage(grid, state, steps, TILE, texture.sigma, texture=texture)


def test_plain_lining_is_not_averaged():
    contrast = image(wall(0.0, 1.0, 1.0), NOISE)
    assert not contrast.texture.half.any()
    assert (contrast.sigma == np.float32(NOISE)).all()


@pytest.mark.slow
def test_bricks_are_averaged_until_what_is_told_stands_out():
    contrast = image(wall(1.2, 0.25, 0.075), 1.24)
    half, sigma = contrast.texture.half[:, :32], contrast.sigma[:, :32]
    assert (half > 0).mean() > 0.9
    # A window of 0.3 m holds 4.8 bricks; these overlap it in part, so that fewer count in full.
    assert np.median(sigma) == pytest.approx(1.2 / np.sqrt(4.8), rel=0.35)
    assert np.median(sigma) < TYPICAL_DARKENING / 3


@pytest.mark.slow
@pytest.mark.parametrize(("spread", "along", "across", "drop"), [(1.2, 0.25, 0.075, 4.0), (1.5, 0.5, 0.3, 6.0)])
def test_a_leak_in_masonry_is_found_whole(spread, along, across, drop):
    shown = wall(spread, along, across)
    row, column = np.mgrid[:400, :800] * PIXEL
    wet = np.hypot(row - 4.0, column - 8.0) < 0.7
    sigma = float(np.hypot(spread, NOISE))
    dark = find_dark(image(shown + drop * wet, sigma)).pixels
    part, _ = ndimage.label(dark[:, :800])
    found = part == np.bincount(part[wet])[1:].argmax() + 1  # single dark bricks elsewhere are no part of it
    assert found[wet].mean() > 0.85
    assert (found & ~wet).sum() < 0.15 * wet.sum()


def test_windows_are_plain_means():
    rng = np.random.default_rng(2)
    drop = rng.integers(-300, 600, (60, 90)).astype(np.int16)
    state = rng.choice([PixelState.EMPTY, PixelState.LINING, PixelState.OFF], drop.shape, p=[0.2, 0.7, 0.1]).astype(np.uint8)
    drop[state == PixelState.EMPTY] = NODATA
    half = rng.choice([0, 3, 7], (3, 4)).astype(np.uint8)
    rows = slice(20, 45)
    found = windowed(state, drop, half, TILE, rows, slice(13, 52))
    for i, j in zip(rng.integers(20, 45, 200), rng.integers(0, 90, 200), strict=True):
        h = int(half[i // TILE, j // TILE])
        about = np.s_[max(i - h, 0) : i + h + 1, max(j - h, 0) : j + h + 1]
        held = drop[about][state[about] == PixelState.LINING]
        assert found[i - 20, j] == (drop[i, j] if h == 0 else round(held.mean()))
