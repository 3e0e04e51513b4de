"""State of each pixel of the unrolled image: lining, recessed lining, fixture, floor, water."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import UInt8
from tunneldb.geometry.section_outliers import SectionOutliers
from tunneldb.raster import appendages as appendage
from tunneldb.raster import relief
from tunneldb.raster import ring_steps as step
from tunneldb.raster.accumulator import Window
from tunneldb.raster.floor import Floor
from tunneldb.raster.grid import Grid
from tunneldb.raster.state import PixelState


def reach(pixel: float) -> int:
    """Return the maximum distance, in pixels, of data that a pixel's state depends on."""
    return appendage.reach(pixel) + relief.reach(pixel) + step.reach(pixel)


def pixel_states(window: Window, columns: slice, grid: Grid, floor: Floor, outliers: SectionOutliers, delta: float) -> UInt8:
    """Return the state of the pixels of some columns.

    Parameters
    ----------
    window : Window
        These columns and, on both sides, :func:`reach` more.
    columns : slice
        Columns of the grid.
    grid : Grid
        The pixels.
    floor : Floor
        Edges of floor and water.
    outliers : SectionOutliers
        Places where the surface is off the wall.
    delta : float
        Distance from the lining's plane from which a pixel is a fixture, m; more if the lining has a relief of its own.

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
    # Context for the planes of the columns, and its context for the steps.
    near = appendage.reach(grid.pixel) + relief.reach(grid.pixel)
    first = max(columns.start - near, window.columns.start)
    offset = np.ascontiguousarray(offset[:, first - window.columns.start : columns.stop + near - window.columns.start])
    distance = appendage.distance_from_plane(offset, grid.pixel, (row, grid.first_column + first))
    # Rough lining is not a fixture: distances are relative to its relief.
    limit = relief.relief_limit(distance, grid.pixel, (row, grid.first_column + first), delta)
    distance /= np.maximum(limit / np.float32(delta), np.float32(1.0))
    recess = appendage.recessed(offset, distance, grid.pixel, delta)
    off = appendage.off_plane(distance, recess, grid.pixel, delta)
    inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
    off, recess = (mask[:, columns.start - first : columns.stop - first] for mask in (off, recess))
    if bent is not None:
        off, recess = off | bent[:, inner], recess & ~bent[:, inner]
    valid = ~np.isnan(window.offset[:, inner])
    rows, low, high = arc[:, None], *outliers.surface.arc_range(chainage[inner])
    with np.errstate(invalid="ignore"):
        # Beyond the ends of the section there is no lining.
        off |= ~valid & ~((low <= rows) & (rows <= high))
    state = np.where(off, PixelState.OFF, np.where(valid, PixelState.LINING, PixelState.EMPTY)).astype(np.uint8)
    state[recess & valid] = PixelState.RECESS
    state[(rows <= left[inner]) | (rows >= right[inner])] = PixelState.FLOOR
    left, right = floor.waterline(chainage[inner])
    state[(rows <= left) | (rows >= right)] = PixelState.SUBMERGED
    return state
