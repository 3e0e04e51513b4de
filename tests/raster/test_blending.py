"""Limits of range and incidence, and how the views of two stations are blended."""

from __future__ import annotations

import numpy as np
import pytest
from support.straight_tunnel import straight

from tunneldb.geometry.section_outliers import MAX_GIRTH_SHARE, SectionOutliers
from tunneldb.pointcloud.points import Points
from tunneldb.pointcloud.poses import PoseModel
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.floor import Floor
from tunneldb.raster.grid import Grid
from tunneldb.raster.observation import Observer, Radiometer
from tunneldb.raster.pixel_state import pixel_states, reach
from tunneldb.raster.projection import WEIGHT, pixel_weight
from tunneldb.raster.rasterize import Projector
from tunneldb.raster.state import PixelState

PIXEL, RADIUS, ROUGHNESS = 0.05, 4.0, 12.0
ROUND = straight(np.full(361, RADIUS))
FLOOR = Floor.of(0, np.full(61, np.nan), np.full(61, np.nan))
GRID = Grid.covering(0, PIXEL, -1.0, 1.0)


def scan(stations: list[float], lean: float, max_range: float = 40.0) -> tuple[Window, Points, np.ndarray]:
    """Image of a strip at the crown, seen from stations on the axis; its normal leans along the tunnel by ``lean``, rad.

    The level of the surface is 0 dB; the surface that is given does not lean.
    """
    rng = np.random.default_rng(1)
    count = 300_000
    x, arc = rng.uniform(2.0, 58.0, count), rng.uniform(-1.0, 1.0, count)
    which = rng.integers(0, len(stations), count)
    xyz = np.column_stack([x, -RADIUS * np.sin(arc / RADIUS), 100.0 + RADIUS * np.cos(arc / RADIUS)])
    ray = np.array(stations)[which] - x
    distance = np.hypot(ray, RADIUS)
    true = np.maximum((ray * np.sin(lean) + RADIUS * np.cos(lean)) / distance, 0.01)
    raw = incidence_db(true, ROUGHNESS).astype(np.float32)
    points = Points(xyz, np.zeros(count), which.astype(np.int32), raw, np.zeros(count, np.uint8))
    place = np.column_stack([stations, np.zeros(len(stations)), np.full(len(stations), 100.0)])
    poses = PoseModel.from_stations(np.arange(len(stations)), place)
    observer = Observer.of(ROUND, 0, (0.5, 1.2), Radiometer("reflectance", poses, None, 75.0, max_range, 0.0), FLOOR)
    with Accumulator(GRID) as image:
        pixels, _ = Projector.of(observer, GRID, ROUGHNESS).project(points)
        image.add(pixels, count)
        return image.window(0, 1200), points, np.where(pixels.column[:count] >= 0, pixels.corrected[:count], np.nan)


def step(x: np.ndarray, level: np.ndarray, at: float) -> float:
    """Change of the mean level at a place, from half a metre before it to half a metre behind."""
    return float(np.nanmean(level[(x > at) & (x < at + 0.5)]) - np.nanmean(level[(x < at) & (x > at - 0.5)]))


@pytest.mark.slow
def test_no_seam_shows_where_the_view_of_a_station_ends() -> None:
    window, points, corrected = scan([10.0, 25.0], np.radians(3.0))
    chainage = GRID.chainages(slice(0, 1200))
    both = (chainage > 3.0) & (chainage < 39.0)
    end = 10.0 + RADIUS * np.tan(np.radians(75.0))
    # From the first station alone the level there is off by some tenths of a decibel; equal weights would show it.
    plain = step(points.xyz[:, 0], corrected, end)
    blended = step(chainage[both], np.nanmean(window.corrected[:, both], axis=0), end)
    assert abs(plain) > 0.2
    assert abs(blended) < 0.05
    assert np.isfinite(window.corrected[:, both]).mean() > 0.95


def test_what_is_seen_beyond_the_limits_only_is_not_seen() -> None:
    chainage = GRID.chainages(slice(0, 1200))
    for window, limit in ((scan([30.0], 0.0)[0], RADIUS * np.tan(np.radians(75.0))), (scan([30.0], 0.0, 8.0)[0], 48.0**0.5)):
        columns = slice(150, 1050)
        state = pixel_states(window, columns, GRID, FLOOR, SectionOutliers.of(ROUND, MAX_GIRTH_SHARE), 0.03)
        off = np.abs(chainage[columns] - 30.0)
        assert reach(PIXEL) < 150
        assert (window.weight[:, np.abs(chainage - 30.0) > limit + PIXEL] == 0).all()
        assert (state[1:-1, off > limit + PIXEL] == PixelState.EMPTY).all()
        assert (state[1:-1, off < limit - PIXEL] == PixelState.LINING).mean() > 0.99


@pytest.mark.parametrize("far", [5.0, 40.0])
def test_weights_fall_from_the_greatest_to_one_at_either_limit(far: float) -> None:
    least = np.cos(np.radians(75.0))
    weight = pixel_weight.py_func
    assert weight(1.0, 0.0, least, far) == WEIGHT
    assert weight(least, 0.0, least, far) == weight(1.0, far, least, far) == 1
    slanting = [weight(np.cos(angle), far / 4, least, far) for angle in np.radians(np.arange(0.0, 75.0))]
    distant = [weight(0.9, r, least, far) for r in np.linspace(0.0, far, 100)]
    assert (np.diff(slanting) <= 0).all()
    assert (np.diff(distant) <= 0).all()
    # Nowhere does a weight change by much at once.
    assert np.abs(np.diff(slanting)).max() <= 2
    assert np.abs(np.diff(distant)).max() <= 2
