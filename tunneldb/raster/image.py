"""State and corrected intensity of each pixel of a kilometre, from its sums block by block."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Int16, UInt8
from tunneldb.geometry.section_outliers import SectionOutliers
from tunneldb.geometry.surface import Surface
from tunneldb.raster.accumulator import Accumulator, Window
from tunneldb.raster.geotiff import NODATA, whole
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.observation import Observer
from tunneldb.raster.pixel_state import pixel_states, reach
from tunneldb.raster.profiles import ProfileGaps, farthest
from tunneldb.raster.state import PixelState

CONTEXT = 17.0
"""Length beyond the ends of a kilometre whose lining is seen, m: what the segmentation network sees from 1.28 m beyond."""

WET_EDGE = 3
"""Number of pixels around a wet one that do not count as dry lining."""


@dataclass(frozen=True)
class LiningImage:
    """State and intensity of all pixels of a kilometre and of the context beyond its ends.

    Attributes
    ----------
    grid : Grid
        The pixels.
    state : (rows, columns) uint8 array
        Values of :class:`tunneldb.raster.state.PixelState`.
    level : (rows, columns) int16 array
        Corrected intensity in steps of the stored image, NODATA without a point.
    gaps : ProfileGaps or None
        Gaps between profiles, in which ``state`` is that of the nearest profile; None if profiles are as close as pixels.
    """

    grid: Grid
    state: UInt8
    level: Int16
    gaps: ProfileGaps | None = None

    def measured(self) -> LiningImage:
        """Return the same image without values taken from a nearby profile."""
        if self.gaps is None:
            return self
        between = (self.level == NODATA) & ((self.state == PixelState.LINING) | (self.state == PixelState.RECESS))
        return LiningImage(self.grid, np.where(between, np.uint8(PixelState.EMPTY), self.state), self.level)


def halo(pixel: float) -> int:
    """Return the number of columns beyond the ends of a kilometre whose points affect its own pixels."""
    return _judged(pixel) + reach(pixel)


def halo_of_profiles(pixel: float) -> int:
    """Return the same for profiles at their maximum distance: values from the nearest profile reach farther."""
    return halo(pixel) + 2 * farthest(pixel)


def _judged(pixel: float) -> int:
    """Return the columns beyond the ends whose state matters: CONTEXT, or half a median filter around the last dry pixel."""
    return max(math.ceil(CONTEXT / pixel), MAX_MEDIAN // 2 + WET_EDGE)


def lining_image(
    image: Accumulator,
    gaps: ProfileGaps | None,
    observer: Observer,
    outliers: SectionOutliers,
    delta: float,
    keep: Callable[[Window], None],
) -> LiningImage:
    """Find the state of every pixel, block by block.

    Parameters
    ----------
    image : Accumulator
        Sums of all points.
    gaps : ProfileGaps or None
        Gaps between profiles that are to be closed.
    observer : Observer
        Edges of the floor, and ends of the survey, beyond which there is no lining.
    outliers : SectionOutliers
        Places where the surface is off the wall.
    delta : float
        Distance from the lining's plane from which a pixel is a fixture, m.
    keep : callable
        Receives the means of each block of the kilometre itself.
    """
    grid = image.grid
    state = np.full((grid.rows, grid.columns), PixelState.OFF, np.uint8)
    level = np.full((grid.rows, grid.columns), NODATA, np.int16)
    beyond = 0 if gaps is None else int(gaps.longest.max())
    verdicts, about = min(_judged(grid.pixel) + beyond, grid.halo), reach(grid.pixel) + beyond
    inner = set(image.inner_blocks())
    for block in sorted({*image.blocks(), *_with_surface(grid, outliers.surface)}):
        first = max(block * grid.block_columns, grid.inner.start - verdicts)
        columns = slice(first, min((block + 1) * grid.block_columns, grid.inner.stop + verdicts))
        if columns.start >= columns.stop:
            continue
        window = image.window(columns.start - about, columns.stop + about)
        level[:, columns] = whole(window.cut(columns).corrected, "corrected")
        if gaps is not None:
            window = gaps.close(window)
        state[:, columns] = pixel_states(window, columns, grid, observer.floor, outliers, delta)
        if block in inner:
            keep(window.cut(columns))
    scanned = grid.columns_between(*observer.ends)
    state[:, : scanned.start] = state[:, scanned.stop :] = PixelState.OFF
    return LiningImage(grid, state, level, gaps)


def _with_surface(grid: Grid, surface: Surface) -> range:
    """Return the blocks that contain the tunnel: unscanned parts of them are lining not inspected."""
    west, east = surface.chainages[[0, -1]] + (-surface.reach, surface.reach)
    first, last = np.floor((np.array([west, east]) - grid.west) / BLOCK).astype(int)
    return range(max(int(first), 0), min(int(last), grid.blocks - 1) + 1)


MAX_MEDIAN = 51
"""Side of the widest median filter, pixels."""
