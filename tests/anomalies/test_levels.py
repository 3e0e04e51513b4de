"""Regions of two levels."""

import numpy as np
import pytest

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.levels import weaker_parts
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState

ROW, COLUMN = np.mgrid[:200, :300]


def weaker(drop: np.ndarray, dark: np.ndarray, seed: int = 1) -> np.ndarray:
    grid = Grid(0, 0.02, -100, 200)
    steps, state, mask = (np.zeros((200, grid.columns), kind) for kind in (np.int16, np.uint8, bool))
    noisy = drop + np.random.default_rng(seed).normal(0, 0.3, drop.shape)
    steps[:, :300], state[:, :300], mask[:, :300] = np.rint(100 * noisy), PixelState.LINING, dark
    sigma = np.full((8, grid.columns // 25), 0.3, np.float32)
    return weaker_parts(mask, ContrastImage(grid, state, steps, 25, sigma))[:, :300]


def test_a_leak_in_a_darker_segment_is_divided_from_it():
    segment = (np.abs(ROW - 100) < 70) & (np.abs(COLUMN - 150) < 100)
    leak = np.hypot(ROW - 90, COLUMN - 170) < 30
    found = weaker(1.3 * segment + 4.5 * leak, segment)
    assert found[segment & ~leak].mean() > 0.95
    assert found[leak].mean() < 0.05


@pytest.mark.parametrize("drop", [2.0, 6.0])
def test_a_patch_of_one_level_is_not_divided(drop):
    patch = np.hypot(ROW - 100, COLUMN - 150) < 60
    assert not weaker(drop * patch, patch).any()


def test_a_patch_that_is_darker_in_the_middle_is_not_divided():
    far = np.hypot(ROW - 100, COLUMN - 150) / 60
    patch = far < 1
    assert not weaker(6.0 * (1 - 0.5 * far**2) * patch, patch).any()


def test_the_soft_rim_of_a_leak_belongs_to_it():
    far = np.hypot(ROW - 100, COLUMN - 150)
    drop = 5.0 / (1 + np.exp((far - 50) / 1.5))
    assert not weaker(drop, drop > 1.0).any()
