"""Profiles far apart along the tunnel: their distance, and what lies between them."""

import itertools

import numpy as np
import pytest
import shapely
from scipy import ndimage

from tunneldb.anomalies.background.contrast import contrast_image
from tunneldb.anomalies.background.level_map import map_background
from tunneldb.anomalies.coverage import measure_coverage
from tunneldb.anomalies.detect import find_anomalies
from tunneldb.anomalies.joints import crossed_joints
from tunneldb.raster.accumulator import Window
from tunneldb.raster.appendages import distance_from_plane, off_plane, recessed
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import LiningImage
from tunneldb.raster.profiles import ProfileGaps, profile_spacing
from tunneldb.raster.state import PixelState

PIXEL = 0.02


def profiles(rng: np.random.Generator, spacing: float, rows: int = 300, columns: int = 2500, tilt: float = 0.0) -> np.ndarray:
    """Pixels that hold points of profiles so far apart (m), of which each stands askew, and a tenth of each is hidden."""
    held = np.zeros((rows, columns), bool)
    row = np.arange(rows)
    for middle in np.arange(rng.uniform(0, spacing), columns * PIXEL, spacing):
        column = np.floor((middle + tilt * (row - rows / 2) * PIXEL + rng.normal(0, 0.003, rows)) / PIXEL).astype(int)
        hidden = (row - rng.integers(rows)) % rows < rows // 10
        there = (column >= 0) & (column < columns) & ~hidden
        held[row[there], column[there]] = True
    return held


def even(spacing: float, columns: int) -> ProfileGaps:
    return ProfileGaps.of(np.full(columns, spacing), PIXEL)


@pytest.mark.parametrize("spacing", [0.1, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_the_distance_of_profiles_is_told_from_the_image(spacing: float, tilt: float) -> None:
    for seed in range(3):
        held = profiles(np.random.default_rng(seed), spacing, tilt=tilt)
        assert profile_spacing(held, PIXEL) == pytest.approx(spacing, abs=PIXEL)


def test_points_as_close_as_pixels_and_points_as_sparse_both_ways_are_no_profiles() -> None:
    rng = np.random.default_rng(1)
    for mask in (profiles(rng, 0.018), profiles(rng, 0.03), rng.random((300, 2500)) < 0.02, np.zeros((300, 2500), bool)):
        assert profile_spacing(mask, PIXEL) == 0.0


def test_a_pixel_takes_the_nearest_profile_and_none_where_one_is_missing() -> None:
    """Against a search pixel by pixel: gaps of up to one and a half distances close; of others half a distance."""
    held, gaps = profiles(np.random.default_rng(2), 0.2, 40, 200), even(0.2, 200)
    held[:, 95:118] = False
    found = gaps.nearest(held)
    assert (found[:, 100:108] == -1).any()
    for i, j in np.ndindex(held.shape):
        there = np.flatnonzero(held[i])
        before, after = there[there <= j].max(initial=-1000), there[there >= j].min(initial=1000)
        near = before if j - before <= after - j else after
        assert found[i, j] == (near if after - before <= 15 or abs(near - j) <= 5 else -1)


def test_areas_are_those_of_the_truth_wherever_profiles_lie() -> None:
    chainage, arc = (np.arange(400) + 0.5) * PIXEL - 4, (np.arange(200) + 0.5) * PIXEL - 2
    disc = np.hypot(*np.meshgrid(chainage, arc)) < 0.8
    areas = []
    for phase in range(25):
        level = np.where(disc, 100, 0).astype(np.int16)
        level[:, np.arange(400) % 25 != phase] = NODATA
        even(0.5, 400).close_levels(level)
        assert ndimage.label(level == 100)[1] == 1
        areas.append((level == 100).sum() * PIXEL**2)
    assert np.mean(areas) == pytest.approx(disc.sum() * PIXEL**2, rel=0.005)
    assert np.std(areas) < 0.1 * np.mean(areas)


def test_a_cable_along_the_tunnel_hangs_on_the_lining_between_profiles_too() -> None:
    rng = np.random.default_rng(3)
    offset = rng.normal(0, 0.003, (200, 500)).astype(np.float32)
    offset[100:102] += 0.06
    offset[:, np.arange(500) % 25 != 7] = np.nan
    weight = np.where(np.isnan(offset), 0, 9)
    closed = even(0.5, 500).close(Window(slice(0, 500), weight, offset, offset, offset))
    assert (closed.weight == weight).all()
    distance = distance_from_plane(closed.offset, PIXEL)
    off = off_plane(distance, recessed(closed.offset, distance, PIXEL), PIXEL)
    assert off[98:104, 20:480].all()  # with the mixed pixels beside it
    assert off[:, 20:480].mean() < 0.05


@pytest.mark.slow
def test_a_leak_over_several_profiles_is_one_leak_and_says_how_they_lie() -> None:
    """Seen on profiles 0.5 m apart; a joint that a profile hits is none, and no more is seen than profiles stand for."""
    rng = np.random.default_rng(4)
    grid = Grid.covering(0, PIXEL, -2.0, 2.0)
    state = np.full((grid.rows, grid.columns), PixelState.EMPTY, np.uint8)
    level = np.full(state.shape, NODATA, np.int16)
    chainage, arc = grid.chainages(slice(0, 4000)), grid.arcs()
    wet = [shapely.Point(x, y).buffer(r) for x, y, r in ((10.1, 0.5, 0.9), (30.3, -0.7, 1.1), (60.0, 0.0, 0.7))]
    for column in range(9, 4000, 25):
        dry = rng.normal(0.0, 0.3, grid.rows) - (2.5 if column == 1009 else 0.0)
        drop = 4.0 * shapely.contains_xy(shapely.union_all(wet), np.full(grid.rows, chainage[column]), arc)
        level[:, column] = np.rint(100 * (dry - drop))
    gaps = even(0.5, grid.columns)
    between = gaps.nearest(level[:, :4000] != NODATA) >= 0
    state[:, :4000][between] = PixelState.LINING
    picture = LiningImage(grid, state, level, gaps)
    background = map_background(picture)
    found = find_anomalies(contrast_image(picture, background), background, 0.05)
    assert [anomaly.verdict.kind for anomaly in found.anomalies] == ["leak"] * 3
    for anomaly, leak in zip(found.anomalies, wet, strict=True):
        assert anomaly.outline.area == pytest.approx(leak.area, rel=0.15)
        assert anomaly.image_share == pytest.approx(0.04, rel=0.1)
    coverage = measure_coverage(state, found.wet, grid, found.size)
    assert coverage.seen.sum() == pytest.approx(80.0 * 4.0, rel=0.01)
    assert coverage.lining.sum() == pytest.approx(1000.0 * 4.0)


def test_spots_that_come_back_as_rings_do_are_joints_and_others_are_not() -> None:
    """Joints every 1.4 m that profiles 0.5 m apart cross now and then, among leaks that lie anywhere."""
    rng = np.random.default_rng(5)
    joints = (np.arange(70) * 1.4 + rng.normal(0, 0.08, 70))[rng.random(70) < 0.6]
    leaks = rng.uniform(0, 100, 12)
    at_profiles = np.rint(np.concatenate([joints, leaks]) / 0.5) * 0.5 + 3000.0
    found = crossed_joints(at_profiles, 0.5) > 0
    assert found[: len(joints)].mean() > 0.8
    assert found[len(joints) :].sum() <= 6  # a third of what lies anywhere lies near a joint
    for spacing, seed in itertools.product((0.25, 0.5, 1.0), range(20)):
        anywhere = np.rint(np.random.default_rng(seed).uniform(0, 300, 90) / spacing) * spacing
        assert not crossed_joints(anywhere, spacing).any()
    assert len(crossed_joints(np.empty(0), 0.5)) == 0
