"""Dry lining as a map: what it follows and what not, on made-up pictures whose truth is known."""

import numpy as np
import pytest
import shapely
from shapely.geometry import box

from tunneldb.leak.dry_map import map_dry
from tunneldb.leak.image import Grid
from tunneldb.leak.lining import State
from tunneldb.leak.picture import Picture
from tunneldb.leak.raster import NODATA
from tunneldb.leak.relative import relative
from tunneldb.leak.threshold import dark_pixels

PIXEL = 0.02
NOISE = 0.35


class Lining:
    """Lining from chainage 400 m on, 8 m of arc: a truth without noise, and pictures of it."""

    def __init__(self, length=60.0, arc=8.0, pixel=PIXEL, start=400.0, km=0):
        self.grid = Grid(km, pixel, round(-arc / 2 / pixel), round(arc / pixel), round(0.5 / pixel))
        first = round((start - self.grid.west) / pixel)
        self.columns = slice(first, first + round(length / pixel))
        self.chainage, self.arc = self.grid.chainages(self.columns), self.grid.arcs()[:, None]
        self.dry = np.full((self.grid.rows, len(self.chainage)), 2.0)
        self.wet = np.zeros_like(self.dry)
        self.held = np.ones(self.dry.shape, bool)

    def within(self, first, last, low, high):
        return (self.chainage >= first) & (self.chainage < last) & (self.arc >= low) & (self.arc < high)

    def leak(self, first, last, low, high, drop=3.0):
        self.wet[self.within(first, last, low, high)] = drop

    def picture(self, noise=NOISE, seed=1):
        shown = self.dry - self.wet + noise * np.random.default_rng(seed).normal(size=self.dry.shape)
        state = np.zeros((self.grid.rows, self.grid.columns), np.uint8)
        level = np.full(state.shape, NODATA, np.int16)
        state[:, self.columns] = self.held
        level[:, self.columns] = np.where(self.held, np.rint(100 * shown), NODATA)
        return Picture(self.grid, state, level)

    def map(self, drawn=(), **how):
        """Error of the level, dB, and the standard deviation, (rows, columns) of the lining; and the map."""
        dry = map_dry(self.picture(**how), drawn)
        error = dry.levels(slice(0, self.grid.rows), self.columns) - self.dry
        sigma = np.kron(dry.sigma, np.ones((dry.tile, dry.tile)))[: self.grid.rows, self.columns]
        return error, sigma, dry


def test_uniform_lining():
    error, sigma, dry = Lining().map()
    assert np.abs(error).max() < 0.05
    assert np.abs(sigma / NOISE - 1).max() < 0.05
    assert dry.mean == pytest.approx(2.0, abs=0.01)
    assert dry.spread == pytest.approx(NOISE, rel=0.02)
    assert dry.count == error.size


def test_rings_are_followed_to_the_pixel_and_joints_are_not():
    lining = Lining()
    ring = np.random.default_rng(3).normal(0, 0.8, 41)[((lining.chainage - 400) / 1.5).astype(int)]
    lining.dry += ring
    joint = np.abs((lining.chainage - 400 + 0.75) % 1.5 - 0.75) < 0.02
    lining.wet[:, joint] = 3.0
    error, _, _ = lining.map()
    # A pixel to either side of the joint may lie in the ring beyond it.
    edge = np.convolve(joint, np.ones(3), "same") > 0
    assert np.abs(error[:, ~edge]).max() < 0.1
    assert np.abs(np.median(error, axis=0))[~edge].max() < 0.06
    assert np.abs(error[:, joint]).max() < 3.0


def test_soot_that_changes_along_the_tunnel_is_followed():
    lining = Lining(length=200.0)
    strength = 3.0 * (0.5 + 0.5 * np.cos(2 * np.pi * lining.chainage / 80.0))
    lining.dry -= strength * np.exp(-0.5 * (lining.arc / 1.2) ** 2)
    error, sigma, _ = lining.map()
    assert np.abs(error).mean() < 0.06
    assert np.abs(error).max() < NOISE
    assert np.median(sigma) == pytest.approx(NOISE, rel=0.05)


def test_a_stripe_along_the_tunnel_is_followed():
    lining = Lining()
    lining.dry[lining.within(0, 1000, 1.0, 1.16)] -= 2.0
    error, _, _ = lining.map()
    assert np.abs(error).max() < 0.12


@pytest.mark.parametrize("size", [(1.0, 1.0), (4.0, 5.0), (9.0, 4.0)])
def test_a_large_leak_is_not_swallowed(size):
    lining = Lining()
    lining.leak(420.0, 420.0 + size[0], -3.9, -3.9 + size[1])
    error, sigma, _ = lining.map()
    assert np.abs(error).max() < 0.15
    assert np.abs(sigma / NOISE - 1).max() < 0.1


def test_a_patch_is_not_followed():
    lining = Lining()
    lining.leak(420.0, 422.0, 0.0, 1.5, 1.5)
    error, _, _ = lining.map()
    assert np.abs(error).max() < 0.1


def wet_by(lining, share, seed=5):
    rng = np.random.default_rng(seed)
    while (lining.wet > 0).mean() < share:
        first, low = rng.uniform(lining.chainage[0], lining.chainage[-1]), rng.uniform(-4, 4)
        far = np.hypot((lining.chainage - first) / rng.uniform(0.3, 2.0), (lining.arc - low) / rng.uniform(0.3, 1.5))
        lining.wet = np.maximum(lining.wet, np.clip((1.1 - far) / 0.1, 0, 1) * rng.uniform(1.5, 5.0))


def test_a_quarter_wet_does_not_raise_the_threshold():
    dry, wet = Lining(100.0), Lining(100.0)
    wet_by(wet, 0.25)
    for lining in (dry, wet):
        lining.dry -= 1.0 * np.exp(-0.5 * (lining.arc / 1.2) ** 2)
    (_, _, before), (error, sigma, after) = dry.map(), wet.map()
    assert after.mean - 3 * after.spread == pytest.approx(before.mean - 3 * before.spread, abs=0.1)
    assert np.abs((error - 3 * (sigma - NOISE))).mean() < 0.1


def test_half_of_the_perimeter_wet_along_30_m():
    lining = Lining(200.0, arc=16.0)
    lining.leak(480.0, 510.0, -8.0, -0.5)
    error, sigma, _ = lining.map()
    assert np.abs(error).max() < 0.2
    assert np.abs(sigma / NOISE - 1).max() < 0.15
