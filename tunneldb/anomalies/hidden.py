"""Lining hidden behind cables and pipes: where both sides of a narrow strip are dark, the lining behind it counts as dark."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Bool, UInt8
from tunneldb.compiled import kernel
from tunneldb.raster.state import PixelState

MAX_STRIP_WIDTH = 0.25
"""Maximum width of strips, m: a pipe of 0.15 m, and on either side the pixels at its edges that are no lining."""

OFF = int(PixelState.OFF)
EMPTY = int(PixelState.EMPTY)


def behind_strips(dark: Bool, state: UInt8, first: int, stop: int, pixel: float) -> Bool:
    """Mark hidden pixels in narrow strips, vertical or horizontal, with dark pixels on both sides.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels, none of them hidden.
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`.
    first, stop : int
        Range of columns to process.
    pixel : float
        Side of a pixel, m.
    """
    found = np.zeros(dark.shape, np.bool_)
    max_run = round(MAX_STRIP_WIDTH / pixel)
    here = np.s_[:, first:stop]
    _fill_down(dark[here], state[here], max_run, found[here])
    _fill_along(dark[here], state[here], max_run, found[here])
    return found


@kernel
def _fill_down(dark: Bool, state: UInt8, max_run: int, found: Bool) -> None:  # pragma: no cover - compiled
    """Mark runs of up to ``max_run`` hidden pixels down the columns with a dark pixel at both ends.

    At least one pixel of a run shows the hiding object; the others may be empty.
    """
    rows, columns = dark.shape
    last = np.full(columns, -1)  # row of the last dark pixel, -1 if lining that is not dark followed
    hidden = np.zeros(columns, np.bool_)  # True if something that hides the lining followed
    for i in range(rows):
        for j in range(columns):
            if dark[i, j]:
                if last[j] >= 0 and hidden[j] and i - last[j] - 1 <= max_run:
                    found[last[j] + 1 : i, j] = True
                last[j], hidden[j] = i, False
            elif state[i, j] == OFF:
                hidden[j] = True
            elif state[i, j] != EMPTY:
                last[j] = -1


@kernel
def _fill_along(dark: Bool, state: UInt8, max_run: int, found: Bool) -> None:  # pragma: no cover - compiled
    """Do the same along the rows."""
    rows, columns = dark.shape
    for i in range(rows):
        last, hidden = -1, False
        for j in range(columns):
            if dark[i, j]:
                if last >= 0 and hidden and j - last - 1 <= max_run:
                    found[i, last + 1 : j] = True
                last, hidden = j, False
            elif state[i, j] == OFF:
                hidden = True
            elif state[i, j] != EMPTY:
                last = -1
