"""What cables and pipes hide of dark lining."""

import numpy as np
import pytest

from tunneldb.anomalies.hidden import MAX_STRIP_WIDTH, behind_strips
from tunneldb.raster.state import PixelState

PIXEL = 0.02
MOST = round(MAX_STRIP_WIDTH / PIXEL)


def scene(strip: int, level: bool) -> tuple[np.ndarray, np.ndarray, tuple[slice, slice]]:
    """Dark lining all over, but for a strip of so many pixels that shows a cable; and where that is."""
    state = np.full((60, 80), PixelState.LINING, np.uint8)
    place = (slice(20, 20 + strip), slice(None)) if level else (slice(None), slice(20, 20 + strip))
    state[place] = PixelState.OFF
    return state == PixelState.LINING, state, place


@pytest.mark.parametrize("level", [True, False])
@pytest.mark.parametrize(("strip", "filled"), [(1, True), (MOST, True), (MOST + 1, False)])
def test_a_strip_between_dark_lining_is_dark_if_it_is_narrow(strip, filled, level):
    dark, state, place = scene(strip, level)
    found = behind_strips(dark, state, 0, 80, PIXEL)
    assert found[place].all() == filled
    assert not found[dark].any()


def test_a_strip_beside_dry_lining_is_not():
    dark, state, place = scene(5, True)
    dark[25:] = False  # below the cable it is dry
    assert not behind_strips(dark, state, 0, 80, PIXEL).any()
    dark[25:, 30:50] = True
    found = behind_strips(dark, state, 0, 80, PIXEL)
    assert found[place][:, 30:50].all()
    assert not found[:, :30].any()
    assert not found[:, 50:].any()


def test_places_without_points_alone_hide_nothing():
    dark, state, _ = scene(5, True)
    state[state == PixelState.OFF] = PixelState.EMPTY
    assert not behind_strips(dark, state, 0, 80, PIXEL).any()


def test_columns_beyond_the_ends_do_not_count():
    dark, state, _ = scene(5, True)
    found = behind_strips(dark, state, 10, 70, PIXEL)
    assert found[20:25, 10:70].all()
    assert not found[:, :10].any()
    assert not found[:, 70:].any()
