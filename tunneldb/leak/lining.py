"""Which pixels of the unrolled image show lining: not the floor, not an appendage, not a niche."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tunneldb.geometry.surface import Surface
from tunneldb.leak.appendage import appendages
from tunneldb.leak.image import Accumulator, Grid

Float = NDArray[np.float64]

FLOOR_SLOPE = np.cos(np.radians(45.0))
"""Surface whose normal points up more steeply than this, below the axis, is floor."""

FLOOR_EDGE = 0.1
"""So much of the wall above the floor goes with it, m: there the section is rounded, and dirt lies."""

NICHE = 0.1
"""A section that stands back by more from those beside it was measured in a niche, m."""

STANDS_BACK = 0.03
"""Surface that stands back by more is not lining, m."""

MIN_SECTIONS = 4
"""With fewer sections there is nothing to compare with."""

HALO = 1.0
"""Width of the neighbouring strips that a block's planes look at, m."""

_ALONG, _ACROSS = 1.0, 0.05


class State(IntEnum):
    """What a pixel shows."""

    EMPTY = 0
    LINING = 1
    OFF = 2  # an appendage or a niche
    FLOOR = 3


@dataclass(frozen=True)
class Floor:
    """Where the floor begins, on both sides, each metre along the tunnel.

    The floor is the surface below the axis that looks up by more than 45°. Going down a wall it begins where
    that holds for 0.3 m, and all that lies beyond, rails or whatever stands there, belongs to it.

    Attributes
    ----------
    chainage : (k,) float array
        m, growing.
    left, right : (k,) float arrays
        Arc at which the floor begins, m; the middle where there is no surface.
    """

    chainage: Float
    left: Float
    right: Float

    @classmethod
    def of(cls, surface: Surface, start: float, stop: float) -> Floor:
        """Find the floor of a surface between two chainages, m."""
        chainage = np.arange(start, stop + _ALONG, _ALONG)
        arc = np.arange(float(surface.arcs[:, 0].min()), float(surface.arcs[:, -1].max()) + _ACROSS, _ACROSS)
        c, a = (grid.ravel() for grid in np.meshgrid(chainage, arc, indexing="ij"))
        points = surface.roll(c, a, np.zeros(len(c)))
        normal = surface.unroll(points).normal[:, 2].reshape(len(chainage), len(arc))
        axis = surface.frames(chainage)[:, 0, 2]
        height = points[:, 2].reshape(normal.shape) - axis[:, None]
        with np.errstate(invalid="ignore"):
            looks_up = ((normal > FLOOR_SLOPE) & (height < 0)) | np.isnan(normal)
        crown = int(np.argmin(np.abs(arc)))
        right = arc[crown + _begin(looks_up[:, crown:])] - FLOOR_EDGE
        left = arc[crown - _begin(looks_up[:, crown::-1])] + FLOOR_EDGE
        # What a single metre shows that its neighbours don't is not the tunnel's shape.
        return cls(chainage, ndimage.median_filter(left, 5), ndimage.median_filter(right, 5))

    def covers(self, chainage: Float, arc: Float) -> NDArray[np.bool_]:
        """Tell which places in the unrolled plane are floor; arrays that broadcast, m."""
        place = np.where(np.isfinite(chainage), chainage, self.chainage[0])
        row = np.clip(np.rint((place - self.chainage[0]) / _ALONG).astype(np.intp), 0, len(self.chainage) - 1)
        with np.errstate(invalid="ignore"):
            return np.asarray((arc <= self.left[row]) | (arc >= self.right[row]), dtype=np.bool_)


@dataclass(frozen=True)
class Recess:
    """Where the surface runs into a niche: a section that was measured in one stands back from those beside it.

    Up to the next sections the surface is then no wall, and what lies on it no lining.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    depth : (k, 361) float array
        How far each section stands back, m, at each whole degree; 0 where it is less than 0.1 m.
    """

    surface: Surface
    depth: Float

    @classmethod
    def of(cls, surface: Surface) -> Recess:
        """Compare each section with the median of the seven about it, itself included."""
        count = len(surface.chainages)
        if count < MIN_SECTIONS:
            return cls(surface, np.zeros_like(surface.radius))
        first = np.clip(np.arange(count) - 3, 0, max(count - 7, 0))
        beside = first[:, None] + np.arange(min(7, count))[None, :]
        depth = surface.radius - np.median(surface.radius[beside], axis=1)
        # A tunnel that is wider all round is no niche.
        deep = (depth > NICHE) & (np.mean(depth > NICHE, axis=1) < 0.4)[:, None]
        return cls(surface, np.where(deep, depth, 0.0))

    def covers(self, chainage: Float, arc: Float) -> NDArray[np.bool_]:
        """Tell which pixels, (rows,) arcs by (columns,) chainages, lie on surface that stands back."""
        out = np.zeros((len(arc), len(chainage)), np.bool_)
        at = self.surface.chainages
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1) if len(at) > 1 else None
        if after is None or not self.depth.any():
            return out
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        for pair in np.unique(after):
            if not self.depth[pair - 1 : pair + 1].any():
                continue
            for column in np.flatnonzero(after == pair):
                g = share[column]
                nodes = (1 - g) * self.surface.arcs[pair - 1] + g * self.surface.arcs[pair]
                depth = (1 - g) * self.depth[pair - 1] + g * self.depth[pair]
                out[:, column] = np.interp(arc, nodes, ndimage.maximum_filter1d(depth, 7)) > STANDS_BACK
        return out


def _begin(looks_up: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Index in each row from which on it holds for 0.3 m, or the last one."""
    run = round(0.3 / _ACROSS)
    kept = np.asarray(np.lib.stride_tricks.sliding_window_view(looks_up, run, axis=1)).all(axis=-1)
    return np.where(np.any(kept, axis=1), np.argmax(kept, axis=1), looks_up.shape[1] - 1)


def states(image: Accumulator, floor: Floor, recess: Recess, delta: float) -> NDArray[np.uint8]:
    """State of every pixel of a kilometre, found block by block.

    Parameters
    ----------
    image : Accumulator
        The sums of all points.
    floor : Floor
        Where the floor begins.
    recess : Recess
        Where the surface runs into a niche.
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
        out[:, block_columns(grid, block)] = _block_states(image, floor, recess, delta, block)
    return out


def block_columns(grid: Grid, block: int) -> slice:
    """Columns of a block, counted from 0."""
    return slice(block * grid.block_columns, (block + 1) * grid.block_columns)


def _block_states(image: Accumulator, floor: Floor, recess: Recess, delta: float, block: int) -> NDArray[np.uint8]:
    grid = image.grid
    columns = block_columns(grid, block)
    halo = round(HALO / grid.pixel)
    window = image.window(columns.start - halo, columns.stop + halo)
    inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
    off = appendages(window.offset, grid.pixel, delta)[:, inner]
    state = np.where(window.count[:, inner] > 0, State.LINING, State.EMPTY).astype(np.uint8)
    state[off | recess.covers(grid.chainages(columns), grid.arcs())] = State.OFF
    state[floor.covers(grid.chainages(columns)[None, :], grid.arcs()[:, None])] = State.FLOOR
    return state
