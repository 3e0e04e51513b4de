"""Relief of the lining: what is rough all over is no appendage, what stands before it still is one."""

import numpy as np
import pytest
from scipy import ndimage

from tunneldb.raster.appendages import distance_from_plane, off_plane, recessed
from tunneldb.raster.relief import LIMIT_SIGMAS, MAX_RELIEF, relief_limit
from tunneldb.raster.relief import reach as relief_reach

PIXEL = 0.02


def test_the_limit_is_three_standard_deviations_of_normal_departures():
    distance = np.random.default_rng(1).normal(0, 0.05, (400, 600)).astype(np.float32)
    limit = relief_limit(distance, PIXEL, (0, 0))
    np.testing.assert_allclose(limit, LIMIT_SIGMAS * 0.05, rtol=0.15)


def test_appendages_on_less_than_half_of_the_lining_hardly_change_it():
    rng = np.random.default_rng(2)
    distance = rng.normal(0, 0.003, (400, 600)).astype(np.float32)
    bare = relief_limit(distance, PIXEL, (0, 0))
    distance[:, (np.arange(600) % 150 > 50) & (np.arange(600) % 150 < 100)] += 0.2
    distance[(rng.random(distance.shape) < 0.3)] = np.nan
    assert bare.max() < relief_limit(distance, PIXEL, (0, 0)).max() < 0.03


def test_what_covers_everything_is_no_relief_of_more_than_a_rock_has():
    distance = np.full((400, 600), 0.4, np.float32)
    assert (relief_limit(distance, PIXEL, (0, 0)) == np.float32(MAX_RELIEF)).all()


def test_it_is_zero_where_there_is_nothing():
    assert not relief_limit(np.full((100, 100), np.nan, np.float32), PIXEL, (0, 0)).any()


@pytest.mark.parametrize("shift", [0, 1, 7, 13])
def test_it_is_the_same_in_whichever_part_a_pixel_is_seen(shift):
    rng = np.random.default_rng(3)
    distance = ndimage.gaussian_filter(rng.normal(0, 1, (700, 1200)), 10).astype(np.float32)
    distance[rng.random(distance.shape) < 0.2] = np.nan
    distance[200:400, 500:700] = np.nan
    whole = relief_limit(distance, PIXEL, (-350, 1000))
    beyond = relief_reach(PIXEL)
    columns = slice(400 + shift, 500 + shift)
    part = relief_limit(
        distance[:, columns.start - beyond : columns.stop + beyond], PIXEL, (-350, 1000 + columns.start - beyond)
    )
    np.testing.assert_array_equal(part[:, beyond:-beyond], whole[:, columns])


def off(offset: np.ndarray, delta: float = 0.03, *, relief: bool = True) -> np.ndarray:
    """What is taken for appendages, with or without regard to the relief."""
    distance = distance_from_plane(offset, PIXEL)
    if relief:
        distance /= np.maximum(relief_limit(distance, PIXEL, (0, 0)) / np.float32(delta), np.float32(1.0))
    return off_plane(distance, recessed(offset, distance, PIXEL, delta), PIXEL, delta)


def test_rough_rock_is_lining_and_a_pipe_before_it_is_not():
    rng = np.random.default_rng(4)
    rock = ndimage.gaussian_filter(rng.normal(0, 1, (400, 600)), 12)
    offset = (rock * 0.06 / rock.std() + rng.normal(0, 0.003, rock.shape)).astype(np.float32)
    offset[200:215] = 0.45
    pipe = np.zeros(offset.shape, bool)
    pipe[200:215] = True
    about = ndimage.binary_dilation(pipe, iterations=6)
    assert off(offset)[pipe].mean() > 0.99
    assert off(offset)[~about].mean() < 0.05
    assert off(offset, relief=False)[~about].mean() > 0.3


def test_on_smooth_lining_nothing_changes():
    rng = np.random.default_rng(5)
    offset = rng.normal(0, 0.003, (400, 600)).astype(np.float32)
    offset[150:160] = 0.05
    offset[:, 300:303] = 0.04
    np.testing.assert_array_equal(off(offset), off(offset, relief=False))


@pytest.mark.parametrize(("spread", "share"), [(0.003, 0.0), (0.01, 0.0), (0.05, 0.0), (0.003, 0.3), (0.003, 0.6)])
def test_what_need_not_be_known_changes_nothing_else(spread, share):
    rng = np.random.default_rng(6)
    distance = rng.normal(0, spread, (400, 600)).astype(np.float32)
    distance[:, : round(share * 600)] += 0.1
    whole, needed = (relief_limit(distance, PIXEL, (3, 5), least) for least in (0.0, 0.03))
    np.testing.assert_array_equal(np.maximum(needed, 0.03), np.maximum(whole, 0.03))
