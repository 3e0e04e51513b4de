"""What each pixel of the unrolled image shows: lining, lining set back in a recess, what hangs on it, floor."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numba import njit

from tunneldb.arrays import Bool, Float, UInt8, Whole
from tunneldb.geometry.section_outliers import SectionOutliers
from tunneldb.geometry.unrolling import bracket
from tunneldb.raster import appendages as appendage
from tunneldb.raster import ring_steps as step
from tunneldb.raster.accumulator import Window
from tunneldb.raster.floor import Floor
from tunneldb.raster.grid import Grid


class PixelState(IntEnum):
    """What a pixel shows."""

    EMPTY = 0
    LINING = 1
    RECESS = 2  # lining set back behind the wall: the back of a niche, a bolt pocket
    OFF = 3  # an appendage, or the mixed pixels of an edge
    FLOOR = 4


def reach(pixel: float) -> int:
    """How far, in pixels, what a pixel's state depends on lies from it at most."""
    return appendage.reach(pixel) + step.reach(pixel)


def pixel_states(window: Window, columns: slice, grid: Grid, floor: Floor, outliers: SectionOutliers, delta: float) -> UInt8:
    """State of the pixels of some columns.

    Parameters
    ----------
    window : Window
        Those columns and, to both sides, :func:`reach` more.
    columns : slice
        Columns of the grid.
    grid : Grid
        The pixels.
    floor : Floor
        Where the floor begins.
    outliers : SectionOutliers
        Where the surface leaves the wall.
    delta : float
        Distance from the lining's plane from which a pixel is an appendage, m.

    Returns
    -------
    (rows, columns) uint8 array
        Values of :class:`PixelState`.
    """
    chainage, arc = grid.chainages(window.columns), grid.arcs()
    left, right = floor.bounds(chainage)
    offset, bent = window.offset, None
    if (strayed := outliers.level(chainage, arc)) is not None:
        offset, bent = offset - strayed[0], strayed[1]
    row = -grid.bottom - grid.rows
    jumps = step.steps(offset, grid.pixel, row, arc, left, right)
    if jumps.any():
        offset = offset - jumps
    # What counts for the planes of the columns, of what counts for the steps.
    near = appendage.reach(grid.pixel)
    first = max(columns.start - near, window.columns.start)
    offset = offset[:, first - window.columns.start : columns.stop + near - window.columns.start]
    distance = appendage.distance_from_plane(offset, grid.pixel, (row, grid.first_column + first))
    recess = appendage.recessed(offset, distance, grid.pixel, delta)
    off = appendage.off_plane(distance, recess, grid.pixel, delta)
    inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
    off, recess = (mask[:, columns.start - first : columns.stop - first] for mask in (off, recess))
    if bent is not None:
        off, recess = off | bent[:, inner], recess & ~bent[:, inner]
    surface = outliers.surface
    state: UInt8 = _states(
        window.weight[:, inner], off, recess, arc,
        left[inner], right[inner], *_ends(surface.chainages, surface.arcs, surface.reach, chainage[inner]),
    )  # fmt: skip
    return state


@njit(cache=True, nogil=True)
def _ends(at: Float, arcs: Float, reach: float, chainage: Float) -> tuple[Float, Float]:  # pragma: no cover - compiled
    """Arcs at which the section at each chainage begins and ends, m; infinite, so that nothing lies between, where none is."""
    low, high = np.full(chainage.shape[0], np.inf), np.full(chainage.shape[0], -np.inf)
    for j in range(chainage.shape[0]):
        a, b, g = bracket(at, chainage[j], reach)
        if a >= 0:
            low[j] = (1.0 - g) * arcs[a, 0] + g * arcs[b, 0]
            high[j] = (1.0 - g) * arcs[a, -1] + g * arcs[b, -1]
    return low, high


@njit(cache=True, nogil=True)
def _states(
    weight: Whole,
    off: Bool,
    recess: Bool,
    arc: Float,
    left: Float,
    right: Float,
    low: Float,
    high: Float,
) -> UInt8:  # pragma: no cover - compiled
    state = np.empty(weight.shape, np.uint8)
    for i in range(weight.shape[0]):
        for j in range(weight.shape[1]):
            if arc[i] <= left[j] or arc[i] >= right[j]:
                state[i, j] = 4
            elif weight[i, j] == 0:
                # Beyond the ends of the section there is no lining to be seen.
                state[i, j] = 0 if low[j] <= arc[i] <= high[j] and not off[i, j] else 3
            elif recess[i, j]:
                state[i, j] = 2
            else:
                state[i, j] = 3 if off[i, j] else 1
    return state
