"""What each pixel of the unrolled image shows: lining, lining set back in a recess, what hangs on it, floor, water."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from tunneldb.arrays import Bool, Single, UInt8
from tunneldb.geometry.section_outliers import SectionOutliers
from tunneldb.raster import appendages as appendage
from tunneldb.raster import relief
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
    DARK = 5  # in the stored image of states only: lining that is dark
    SUBMERGED = 6  # below the water


def shows_lining(state: Single) -> Bool:
    """Which pixels of a stored image of states show lining, dark or not."""
    return np.asarray((state == PixelState.LINING) | (state == PixelState.DARK))


def reach(pixel: float) -> int:
    """How far, in pixels, what a pixel's state depends on lies from it at most."""
    return appendage.reach(pixel) + relief.reach(pixel) + step.reach(pixel)


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
        Where floor and water begin.
    outliers : SectionOutliers
        Where the surface leaves the wall.
    delta : float
        Distance from the lining's plane from which a pixel is an appendage, m; more where the lining has a relief of its own.

    Returns
    -------
    (rows, columns) uint8 array
        Values of :class:`PixelState`.
    """
    chainage, arc = grid.chainages(window.columns), grid.arcs()
    left, right = floor.bounds(chainage)
    offset, bent = window.offset, None
    if (departure := outliers.offset_and_bends(chainage, arc)) is not None:
        offset, bent = offset - departure[0], departure[1]
    row = -grid.bottom - grid.rows
    jumps = step.steps(offset, grid.pixel, row, arc, left, right)
    if jumps.any():
        offset = offset - jumps
    # What counts for the planes of the columns, of what counts for the steps.
    near = appendage.reach(grid.pixel) + relief.reach(grid.pixel)
    first = max(columns.start - near, window.columns.start)
    offset = np.ascontiguousarray(offset[:, first - window.columns.start : columns.stop + near - window.columns.start])
    distance = appendage.distance_from_plane(offset, grid.pixel, (row, grid.first_column + first))
    # Lining that is rough by itself is no appendage: distances count in parts of its relief.
    limit = relief.relief_limit(distance, grid.pixel, (row, grid.first_column + first), delta)
    distance /= np.maximum(limit / np.float32(delta), np.float32(1.0))
    recess = appendage.recessed(offset, distance, grid.pixel, delta)
    off = appendage.off_plane(distance, recess, grid.pixel, delta)
    inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
    off, recess = (mask[:, columns.start - first : columns.stop - first] for mask in (off, recess))
    if bent is not None:
        off, recess = off | bent[:, inner], recess & ~bent[:, inner]
    held = ~np.isnan(window.offset[:, inner])
    rows, low, high = arc[:, None], *outliers.surface.arc_range(chainage[inner])
    with np.errstate(invalid="ignore"):
        # Beyond the ends of the section there is no lining to be seen.
        off |= ~held & ~((low <= rows) & (rows <= high))
    state = np.where(off, PixelState.OFF, np.where(held, PixelState.LINING, PixelState.EMPTY)).astype(np.uint8)
    state[recess & held] = PixelState.RECESS
    state[(rows <= left[inner]) | (rows >= right[inner])] = PixelState.FLOOR
    left, right = floor.waterline(chainage[inner])
    state[(rows <= left) | (rows >= right)] = PixelState.SUBMERGED
    return state
