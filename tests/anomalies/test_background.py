"""Dry lining as a map: what it follows and what not, on made-up pictures whose truth is known."""

import numpy as np
import pytest
from shapely.geometry import box

from tunneldb.anomalies.background.contrast import contrast_image
from tunneldb.anomalies.background.level_map import map_background
from tunneldb.anomalies.bands import find_bands
from tunneldb.anomalies.threshold import dark_pixels
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState

pytestmark = pytest.mark.slow

PIXEL = 0.02
NOISE = 0.35


class Lining:
    """Lining from chainage 400 m on, 8 m of arc: a truth without noise, and pictures of it."""

    def __init__(self, length=60.0, arc=8.0, pixel=PIXEL, start=400.0, km=0):
        self.grid = Grid.covering(km, pixel, -arc / 2, arc / 2, round(0.5 / pixel), (start, start + length))
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
        return LiningImage(self.grid, state, level)

    def map(self, drawn=(), **how):
        """Error of the level, dB, and the standard deviation, (rows, columns) of the lining; and the map."""
        dry = map_background(self.picture(**how), drawn)
        error = dry.level.levels(slice(0, self.grid.rows), self.columns) - self.dry
        sigma = np.kron(dry.sigma, np.ones((dry.level.tile, dry.level.tile)))[: self.grid.rows, self.columns]
        return error, sigma, dry


def test_uniform_lining():
    error, sigma, dry = Lining().map()
    assert np.abs(error).max() < 0.1
    assert np.abs(error).mean() < 0.02
    assert np.abs(sigma / NOISE - 1).max() < 0.05
    assert dry.mean == pytest.approx(2.0, abs=0.01)
    assert dry.spread == pytest.approx(NOISE, rel=0.02)
    assert dry.count == error.size


def test_rings_are_followed_to_the_pixel_and_joints_are_not():
    lining = Lining()
    number = ((lining.chainage - 400) / 1.5).astype(int)
    ring = np.random.default_rng(3).normal(0, 0.8, 40)
    lining.dry += ring[number]
    joint = np.flatnonzero(np.diff(number))  # the last column of each ring
    lining.wet[:, joint] = 3.0
    error, _, _ = lining.map()
    clear = np.ones(len(number), bool)
    clear[joint] = False
    assert np.abs(np.median(error, axis=0))[clear].max() < 0.1
    # In a joint the level is that of the one ring or the other, or between them.
    level = np.median(error + lining.dry, axis=0)[joint] - 2.0
    assert (level > np.minimum(ring[:-1], ring[1:]) - 0.15).all()
    assert (level < np.maximum(ring[:-1], ring[1:]) + 0.15).all()


def test_soot_that_changes_along_the_tunnel_is_followed():
    lining = Lining(length=200.0)
    strength = 3.0 * (0.5 + 0.5 * np.cos(2 * np.pi * lining.chainage / 80.0))
    lining.dry -= strength * np.exp(-0.5 * (lining.arc / 1.2) ** 2)
    error, sigma, _ = lining.map()
    assert np.abs(error).mean() < 0.05
    assert (np.abs(error) > NOISE).mean() < 0.001
    assert np.median(sigma) == pytest.approx(NOISE, rel=0.05)


def test_a_stripe_along_the_tunnel_is_followed():
    lining = Lining()
    lining.dry[lining.within(0, 1000, 1.0, 1.16)] -= 2.0
    error, _, _ = lining.map()
    assert np.abs(error).max() < 0.12


@pytest.mark.parametrize("size", [(1.0, 1.0), (4.0, 5.0), (9.0, 4.0)])
def test_a_large_leak_is_not_swallowed(size):
    lining = Lining(arc=16.0)
    lining.leak(420.0, 420.0 + size[0], -3.9, -3.9 + size[1])
    error, sigma, _ = lining.map()
    assert np.abs(error).max() < 0.15
    assert np.abs(sigma / NOISE - 1).max() < 0.1


def test_bright_salts_change_nothing_elsewhere():
    """Salts of 4 dB on 4 % of the lining, in blotches: water is told beside them as where there are none."""
    lining, plain = Lining(), Lining()
    rng = np.random.default_rng(7)
    bright = np.zeros(lining.dry.shape, bool)
    while bright.mean() < 0.04:
        s, a, half = rng.uniform(400, 460), rng.uniform(-4, 4), rng.uniform(0.1, 0.45)
        bright |= np.hypot(lining.chainage - s, lining.arc - a) < half
    lining.wet[bright] = -4.0
    (error, sigma, _), (_, usual, _) = lining.map(), plain.map()
    assert np.abs(error[~bright]).mean() < 0.03
    assert np.abs(sigma / usual - 1).max() < 0.2
    assert np.median(sigma) == pytest.approx(NOISE, rel=0.05)


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
    assert np.abs(error - 3 * (sigma - NOISE)).mean() < 0.1


def test_half_of_the_perimeter_wet_along_30_m():
    lining = Lining(200.0, arc=16.0)
    lining.leak(480.0, 510.0, -8.0, -0.5)
    error, sigma, _ = lining.map()
    assert np.abs(error).max() < 0.2
    assert np.abs(sigma / NOISE - 1).max() < 0.15


def test_a_leak_within_soot_is_not_swallowed():
    lining = Lining(150.0, arc=16.0)
    lining.dry -= 3.0 * np.exp(-0.5 * (lining.arc / 1.5) ** 2)
    lining.leak(470.0, 473.0, -1.0, 1.0)
    error, _, _ = lining.map()
    assert np.abs(error).max() < 0.2


def test_sigma_follows_the_texture():
    lining = Lining(90.0)
    rough = lining.chainage > 430
    noise = np.where(rough, 0.8, 0.25)[None, :]
    _, sigma, dry = lining.map(noise=noise)
    clear = np.abs(lining.chainage - 430) > 3.0  # half a window, and a tile
    assert np.abs(sigma / noise - 1)[:, clear].max() < 0.1
    assert dry.spread == pytest.approx(0.8, rel=0.1)


def test_half_empty_pixels_and_a_gap():
    lining = Lining(100.0)
    rng = np.random.default_rng(8)
    lining.dry += rng.normal(0, 0.5, 67)[((lining.chainage - 400) / 1.5).astype(int)]
    lining.held = rng.random(lining.held.shape) < 0.3
    lining.held[:, 2000:3000] = False
    error, sigma, dry = lining.map()
    seen = np.zeros(error.shape, bool)
    seen[:, :1990] = seen[:, 3010:] = True
    assert dry.count == lining.held.sum()
    assert np.abs(error[lining.held]).mean() < 0.05
    assert np.abs(sigma / NOISE - 1)[seen].max() < 0.1
    assert np.isfinite(error).all()
    assert (dry.sigma > 0).all()


def test_profiles_farther_apart_than_pixels():
    lining = Lining(100.0)
    lining.leak(450.0, 452.0, 0.0, 2.0)
    lining.held[:] = False
    lining.held[np.random.default_rng(8).random(lining.held.shape[0]) < 0.5, ::5] = True
    error, sigma, _ = lining.map()
    assert np.abs(error).max() < 0.3
    assert np.abs(sigma / NOISE - 1).max() < 0.2


def test_a_short_tunnel_and_hardly_any_lining():
    short = Lining(20.0)
    short.leak(408.0, 411.0, -2.0, 0.0)
    error, _, _ = short.map()
    assert np.abs(error).max() < 0.15
    scrap = Lining(1.0)
    scrap.held[:] = False
    scrap.held[100:103, 10:20] = True
    error, sigma, dry = scrap.map()
    assert np.abs(error[scrap.held]).max() < 1.0
    assert np.isfinite(sigma).all()
    assert dry.count == 30


def test_no_lining():
    lining = Lining(1.0)
    lining.held[:] = False
    picture = lining.picture()
    dry = map_background(picture)
    assert dry.count == 0
    assert np.isnan(dry.mean)
    assert (dry.sigma > 0).all()
    assert (contrast_image(picture, dry).drop == NODATA).all()


def test_recesses_do_not_count():
    lining = Lining()
    picture = lining.picture()
    recess = lining.within(420.0, 423.0, -2.0, 2.0)
    picture.level[:, lining.columns][recess] -= 400
    picture.state[:, lining.columns][recess] = PixelState.RECESS
    dry = map_background(picture)
    level = dry.level.levels(slice(0, lining.grid.rows), lining.columns)
    assert np.abs(level - 2.0).max() < 0.1
    assert dry.count == recess.size - recess.sum()


def test_the_map_is_the_same_on_both_sides_of_the_end_of_a_kilometre():
    """A tunnel over the end of kilometre 0, of which each kilometre sees the first 0.5 m beyond it."""
    both = Lining(100.0, start=950.0, km=0)  # beyond the end lies one more block
    both.dry += np.random.default_rng(3).normal(0, 0.5, 80)[((both.chainage - 950) / 1.5).astype(int)]
    both.dry = both.dry - 2.0 * np.exp(-0.5 * (both.arc / 1.2) ** 2)
    whole = both.picture()
    before, after = Grid(0, PIXEL, -200, 400, 25), Grid(1, PIXEL, -200, 400, 25)
    levels = []
    for grid in (before, after):
        state, level = np.zeros((grid.rows, grid.columns), np.uint8), np.full((grid.rows, grid.columns), NODATA, np.int16)
        # Columns, counted from the end at 1000 m.
        end, here = whole.grid.inner.stop, grid.inner.stop if grid is before else grid.inner.start
        far = (2500, 25) if grid is before else (25, 2500)
        state[:, here - far[0] : here + far[1]] = whole.state[:, end - far[0] : end + far[1]]
        level[:, here - far[0] : here + far[1]] = whole.level[:, end - far[0] : end + far[1]]
        dry = map_background(LiningImage(grid, state, level))
        levels.append(dry.level.levels(slice(0, grid.rows), slice(here - 25, here + 25)))
    np.testing.assert_allclose(levels[0], levels[1], atol=0.15)


def test_drawn_dry_regions_rule_what_lies_in_them_and_nothing_else():
    plain, drawn = Lining(), Lining()
    for lining in (plain, drawn):
        lining.leak(420.0, 424.0, -2.0, 2.0)
    region = box(420.0, -2.0, 424.0, 0.0)
    picture = drawn.picture()
    dry = map_background(picture, [region])
    level = dry.level.levels(slice(0, drawn.grid.rows), drawn.columns)
    core = drawn.within(421.0, 423.0, -1.5, -0.5)
    assert np.abs(level[core] - (2.0 - 3.0)).max() < 0.1
    other = ~drawn.within(419.0, 425.0, -3.0, 1.0)
    before, _, _ = plain.map()
    assert np.abs(level - drawn.dry - before)[other].max() < 0.05
    dark = dark_pixels(contrast_image(picture, dry), 5)[:, drawn.columns]
    assert not dark[drawn.within(420.0, 424.0, -2.0, 0.0)].any()
    assert dark[drawn.within(420.0, 424.0, 0.6, 2.0)].mean() > 0.97


def test_drop_is_the_level_of_the_background_less_level_in_the_memory_of_the_picture():
    lining = Lining(10.0)
    lining.held[np.random.default_rng(2).random(lining.held.shape) < 0.2] = False
    picture = lining.picture()
    level = picture.level.copy()
    dry = map_background(picture)
    found = contrast_image(picture, dry)
    assert found.drop is picture.level
    assert found.state is picture.state
    held = level != NODATA
    expected = dry.level.levels(slice(0, lining.grid.rows), slice(0, lining.grid.columns)) * 100 - level
    np.testing.assert_allclose(found.drop[held], expected[held], atol=0.51)
    assert (found.drop[~held] == NODATA).all()


def bands_of(lining, drawn=()):
    picture = lining.picture()
    background = map_background(picture, drawn)
    return find_bands(contrast_image(picture, background), background)


def test_a_dark_foot_of_the_wall_is_a_band_where_it_is_dark():
    lining = Lining(pixel=0.05, length=200.0, start=400.0)
    dark = lining.within(430.0, 600.0, -4.0, -3.5)
    lining.dry[dark] -= 4.0
    bands = bands_of(lining)
    assert {(round(band.arc_from, 3), round(band.arc_to, 3)) for band in bands} == {(-4.0, -3.5)}
    assert sorted(band.chainage_from for band in bands) == [430.0, 450.0, 500.0, 550.0]
    assert max(band.chainage_to for band in bands) == 600.0
    assert sum(band.area for band in bands) == pytest.approx(170 * 0.5, rel=0.01)
    assert all(abs(band.darkening - 4.0) < 0.1 for band in bands)


def test_soot_and_joints_are_no_bands():
    lining = Lining(pixel=0.05)
    lining.dry -= 5.0 * np.exp(-((lining.arc / 1.5) ** 2))  # 2.5 m wide at half of its depth
    lining.dry[lining.within(0, 1000, 3.0, 3.05)] -= 4.0
    assert bands_of(lining) == []


def test_a_drawn_dry_region_decides_a_band():
    lining = Lining(pixel=0.05)
    lining.dry[lining.within(0, 1000, -4.0, -3.5)] -= 4.0
    assert len(bands_of(lining)) == 2
    assert [(band.chainage_from, band.chainage_to) for band in bands_of(lining, [box(399.0, -4.0, 431.0, -3.5)])] == [
        (431.0, 450.0),
        (450.0, 460.0),
    ]


def test_the_edge_of_a_band_may_be_ragged():
    """As the upper edge of damp that rises from the foot of a wall."""
    lining = Lining(pixel=0.05)
    height = 0.5 + 0.2 * np.sin(lining.chainage) * np.sin(2.7 * lining.chainage)
    lining.dry[lining.arc < -4.0 + height] -= 4.0
    assert sum(band.area for band in bands_of(lining)) == pytest.approx(60 * 0.5, rel=0.3)
