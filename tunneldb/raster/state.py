"""Codes of the image of states."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from tunneldb.arrays import Bool, Single


class PixelState(IntEnum):
    """State of a pixel."""

    EMPTY = 0
    LINING = 1
    RECESS = 2  # lining set back behind the wall: the back of a niche, a bolt pocket
    OFF = 3  # a fixture, or the mixed pixels of an edge
    FLOOR = 4
    DARK = 5  # only in the stored image of states: lining that is dark
    SUBMERGED = 6  # below the water


def shows_lining(state: Single) -> Bool:
    """Return True for pixels of a stored image of states that show lining, dark or not."""
    return np.asarray((state == PixelState.LINING) | (state == PixelState.DARK))
