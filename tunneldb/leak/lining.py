"""Which pixels of the unrolled image show lining: not the floor, not an appendage, not a niche."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from tunneldb.geometry.surface import Surface
from tunneldb.leak.appendage import appendages
from tunneldb.leak.image import Accumulator, Grid

FLOOR_SLOPE = np.cos(np.radians(45.0))
"""Surface whose normal points up more steeply than this, below the axis, is floor."""

HALO = 1.0
"""Width of the neighbouring strips that a block's planes look at, m."""

_ALONG, _ACROSS = 1.0, 0.05


class State(IntEnum):
    """What a pixel shows."""

    EMPTY = 0
    LINING = 1
    APPENDAGE = 2
    FLOOR = 3


def floor(surface: Surface, chainage: NDArray[np.float64], arc: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the floor at pixel centres: surface that looks up by more than 45° and lies below the axis.

    Parameters
    ----------
    surface : Surface
        The tunnel.
    chainage : (columns,) float array
        Chainage of the columns, m, growing.
    arc : (rows,) float array
        Arc of the rows, m, falling.

    Returns
    -------
    (rows, columns) bool array
        True as well beyond the ends of the section and where there is no surface.
    """
    along = np.arange(chainage[0], chainage[-1] + _ALONG, _ALONG).clip(max=chainage[-1])
    across = np.arange(arc[-1], arc[0] + _ACROSS, _ACROSS)
    c, a = (grid.ravel() for grid in np.meshgrid(along, across))
    marked = _is_floor(surface, c, a).reshape(len(across), len(along))
    row = np.clip(np.rint((arc - across[0]) / _ACROSS).astype(np.intp), 0, len(across) - 1)
    column = np.clip(np.rint((chainage - along[0]) / _ALONG).astype(np.intp), 0, len(along) - 1)
    return np.asarray(marked[np.ix_(row, column)])


def floor_points(surface: Surface, chainage: NDArray[np.float64], arc: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark points of the unrolled plane, (n,) chainage and arc in m, below which the surface is floor."""
    known = np.isfinite(chainage) & np.isfinite(arc)
    marked = np.ones(len(chainage), np.bool_)
    marked[known] = _is_floor(surface, chainage[known], arc[known])
    return marked


def _is_floor(surface: Surface, chainage: NDArray[np.float64], arc: NDArray[np.float64]) -> NDArray[np.bool_]:
    points = surface.roll(chainage, arc, np.zeros(len(chainage)))
    normal = surface.unroll(points).normal[:, 2]
    level = np.unique(np.rint(chainage / _ALONG)) * _ALONG
    axis = np.interp(chainage, level, _finite(surface.frames(level)[:, 0, 2]))
    with np.errstate(invalid="ignore"):
        return np.asarray(((normal > FLOOR_SLOPE) & (points[:, 2] < axis)) | np.isnan(normal), dtype=np.bool_)


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Replace NaN by the nearest number."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) == 0:
        return values
    return np.asarray(np.interp(np.arange(len(values)), known, values[known]))


def states(image: Accumulator, surface: Surface, delta: float) -> NDArray[np.uint8]:
    """State of every pixel of a kilometre, found block by block.

    Parameters
    ----------
    image : Accumulator
        The sums of all points.
    surface : Surface
        The tunnel.
    delta : float
        Distance from the lining's plane from which a pixel is an appendage, m.

    Returns
    -------
    (rows, columns) uint8 array
        Values of :class:`State`.
    """
    grid = image.grid
    out = np.zeros((grid.rows, grid.columns), np.uint8)
    for block in image.blocks():
        out[:, block_columns(grid, block)] = _block_states(image, surface, delta, block)
    return out


def block_columns(grid: Grid, block: int) -> slice:
    """Columns of a block, counted from 0."""
    return slice(block * grid.block_columns, (block + 1) * grid.block_columns)


def _block_states(image: Accumulator, surface: Surface, delta: float, block: int) -> NDArray[np.uint8]:
    grid = image.grid
    columns = block_columns(grid, block)
    halo = round(HALO / grid.pixel)
    window = image.window(columns.start - halo, columns.stop + halo)
    inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
    off = appendages(window.offset, grid.pixel, delta)[:, inner]
    state = np.where(window.count[:, inner] > 0, State.LINING, State.EMPTY).astype(np.uint8)
    state[off] = State.APPENDAGE
    state[floor(surface, grid.chainages(columns), grid.arcs())] = State.FLOOR
    return state
