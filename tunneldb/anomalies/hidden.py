"""Lining hidden behind cables and pipes: dark on both sides of a narrow strip, it is dark behind it, too."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, UInt8
from tunneldb.compiled import kernel
from tunneldb.raster.pixel_state import PixelState

STRIP = 0.25
"""Strips are no wider, m: a pipe of 0.15 m, and at either side the pixels about its edges that are no lining."""

OFF = int(PixelState.OFF)
EMPTY = int(PixelState.EMPTY)


def behind_strips(dark: Bool, state: UInt8, first: int, stop: int, pixel: float) -> Bool:
    """Mark hidden pixels in narrow strips, upright or level, that end on dark pixels on both sides.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels, none of which is hidden.
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.pixel_state.PixelState`.
    first, stop : int
        Columns that count.
    pixel : float
        Side of a pixel, m.
    """
    found = np.zeros(dark.shape, np.bool_)
    most = round(STRIP / pixel)
    here = np.s_[:, first:stop]
    _fill_down(dark[here], state[here], most, found[here])
    _fill_along(dark[here], state[here], most, found[here])
    return found


@kernel
def _fill_down(dark: Bool, state: UInt8, most: int, found: Bool) -> None:  # pragma: no cover - compiled
    """Mark runs of up to ``most`` hidden pixels down the columns that have a dark one at both ends.

    At least one of a run shows what hides the lining; the others may hold no points.
    """
    rows, columns = dark.shape
    last = np.full(columns, -1)  # row of the last dark pixel, -1 when lining that is not dark came after it
    hidden = np.zeros(columns, np.bool_)  # whether something that hides the lining came after it
    for i in range(rows):
        for j in range(columns):
            if dark[i, j]:
                if last[j] >= 0 and hidden[j] and i - last[j] - 1 <= most:
                    found[last[j] + 1 : i, j] = True
                last[j], hidden[j] = i, False
            elif state[i, j] == OFF:
                hidden[j] = True
            elif state[i, j] != EMPTY:
                last[j] = -1


@kernel
def _fill_along(dark: Bool, state: UInt8, most: int, found: Bool) -> None:  # pragma: no cover - compiled
    """Do the same along the rows."""
    rows, columns = dark.shape
    for i in range(rows):
        last, hidden = -1, False
        for j in range(columns):
            if dark[i, j]:
                if last >= 0 and hidden and j - last - 1 <= most:
                    found[i, last + 1 : j] = True
                last, hidden = j, False
            elif state[i, j] == OFF:
                hidden = True
            elif state[i, j] != EMPTY:
                last = -1
