"""Channels of the segmentation network against values that are known from the picture."""

import numpy as np
import pytest

from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.channels import CONTRAST, NAMES, REACH, channels


def picture(rows=600, columns=1200, pixel=0.02, noise=0.2, seed=1):
    """Lining of -20 dB with noise."""
    rng = np.random.default_rng(seed)
    level = np.rint(100 * (-20.0 + noise * rng.normal(size=(rows, columns)))).astype(np.int16)
    return np.full((rows, columns), PixelState.LINING, np.uint8), level


def seen(state, level, pixel=0.02, bottom=-300, first_column=0):
    images, margins = channels(state, level, pixel, bottom, first_column)
    assert images.shape[0] == len(NAMES)
    return dict(zip(NAMES, images, strict=True)), margins


def test_a_common_shift_of_the_intensity_changes_nothing():
    state, level = picture()
    before, _ = channels(state, level, 0.02, -300, 0)
    after, _ = channels(state, level + 1234, 0.02, -300, 0)
    np.testing.assert_allclose(after, before, atol=2e-4)


def test_a_patch_and_a_band_without_end_are_dark_by_as_much_as_they_are():
    state, level = picture(noise=0.05)
    level[300:350, 500:550] -= 300  # 1 m x 1 m, 3 dB
    level[540:, :] -= 400  # the foot of a wall along the whole picture, 4 dB
    now, margins = seen(state, level)
    inside = np.s_[margins.above // 2 : margins.above // 2 + 300, :600]
    ring = now["level of 0.08 m to the ring"][inside] * CONTRAST
    assert ring[162, 262] == pytest.approx(-3.0, abs=0.15)
    assert np.median(ring[285:, :]) == pytest.approx(-4.0, abs=0.15)
    assert np.median(ring[100:140, :]) == pytest.approx(0.0, abs=0.15)
    # within 0.2 m the patch is its own surroundings, and so is the band
    assert now["level to 0.2 m"][inside][162, 262] * CONTRAST == pytest.approx(0.0, abs=0.2)


def test_noise_is_that_of_the_picture():
    levels = []
    for noise in (0.3, 0.6):
        state, level = picture(noise=2 * noise, seed=3)  # of a mean of four
        levels.append(np.median(seen(state, level)[0]["noise"]))
    assert np.exp(levels[0]) * 0.3 == pytest.approx(0.3, rel=0.1)
    assert levels[1] - levels[0] == pytest.approx(np.log(2.0), abs=0.05)


def test_states_place_and_floor():
    state, level = picture()
    state[:, 600:604], level[:, 600:604] = PixelState.EMPTY, NODATA
    state[400:420], state[100:120, 200:240], state[560:] = PixelState.OFF, PixelState.RECESS, PixelState.FLOOR
    now, margins = seen(state, level)
    assert (margins.above, margins.below, margins.left, margins.right) == (20, 20, 0, 16)  # to multiples of 32
    top = margins.above // 2
    now = {name: image[:, :600] for name, image in now.items()}
    assert now["fixture"][top + 200 : top + 210].all()
    assert not now["fixture"][top + 211 : top + 280].any()
    assert now["recess"][top + 50 : top + 60, 100:120].all()
    assert now["recess"].sum() == 200
    assert now["floor"][top + 280 : top + 300].all()
    assert (now["filled"][top : top + 280, 300:302] == 0).all()
    # downwards: away from the crown, which is at arc 0, 300 rows below the top
    assert now["downwards"][top, 0] == 1.0
    assert now["downwards"][top + 150 - 1, 0] == pytest.approx(0.02)
    assert now["distance to the floor"][top + 280 - 38, 5] == pytest.approx(0.5, abs=0.06)  # 1.52 m of 3


@pytest.mark.parametrize(("pixel", "times"), [(0.04, 2), (0.08, 4)])
def test_larger_pixels_show_the_same(pixel, times):
    """A picture whose fine pixels repeat gives the same at any size of pixels."""
    rng = np.random.default_rng(5)
    large = np.rint(100 * (-20 + rng.normal(0, 0.3, (600 // times, 1200 // times)))).astype(np.int16)
    large[40 // times * 4 : 80 // times * 4, 100 : 100 + 160 // times] -= 350
    fine = large.repeat(times, 0).repeat(times, 1)
    images, _ = channels(np.full(fine.shape, 1, np.uint8), fine, 0.02, -320, 0)
    again, _ = channels(np.full(large.shape, 1, np.uint8), large, pixel, -320 // times, 0)
    assert again.shape == images.shape
    np.testing.assert_allclose(again, images, atol=1e-3)


def test_what_is_out_of_reach_changes_nothing():
    state, level = picture(columns=2400)
    before, _ = channels(state, level, 0.02, -300, 0)
    level[:, :400] -= 700
    state[100:200, :400] = PixelState.OFF
    after, _ = channels(state, level, 0.02, -300, 0)
    far = 200 + REACH  # of the network's pixels
    np.testing.assert_allclose(after[:, :, far:], before[:, :, far:], atol=1e-5)
    assert np.abs(after[:, :, : 200 + REACH // 2] - before[:, :, : 200 + REACH // 2]).max() > 0.5


def test_nothing_is_seen_where_there_are_no_points():
    state, level = picture()
    images, _ = channels(np.full_like(state, PixelState.EMPTY), np.full_like(level, NODATA), 0.02, -300, 0)
    assert np.isfinite(images).all()
    assert not images[:6].any()
    assert not images[6].any()
