"""Which pixels of the unrolled image show lining: not the floor, not an appendage, not a niche."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage

from tunneldb.geometry.surface import Surface
from tunneldb.leak.appendage import appendages
from tunneldb.leak.image import Grid, Whole, Window

Float = NDArray[np.float64]

HIDDEN = 25
"""So many metres of ground may be hidden by what stands on it, and the floor goes on beneath."""

FLOOR_EDGE = 0.02
"""So much of the wall above the floor goes with it, m: its foot, found from points of survey density, is known no better."""

MOST = 0.4
"""Where a larger part of a section does, it is the tunnel that has another shape."""

OFF_WALL = 0.03
"""Surface that is farther off the wall is not lining, m."""


class State(IntEnum):
    """What a pixel shows."""

    EMPTY = 0
    LINING = 1
    RECESS = 2  # lining set back behind the wall: the back of a niche, a bolt pocket
    OFF = 3  # an appendage, or the mixed pixels of an edge
    FLOOR = 4


@dataclass(frozen=True)
class Floor:
    """Where the floor begins, on both sides, each metre along the tunnel: at the foot of the walls.

    All that lies beyond, rails or whatever stands there, belongs to it. Where the tunnel has no ground nothing does.

    Attributes
    ----------
    start : int
        Chainage of the first place, m.
    left, right : (k,) float arrays
        Arc at which the floor begins at each metre from there on, m; infinite where it doesn't.
    """

    start: int
    left: Float
    right: Float

    @classmethod
    def of(cls, start: int, left: Float, right: Float) -> Floor:
        """Make a floor of the arcs of the walls' feet (k,), m, NaN for none, at each metre from ``start`` on."""
        left, right = _bridged(left), _bridged(right)
        none = np.isnan(left), np.isnan(right)
        return cls(start, np.where(none[0], -np.inf, left + FLOOR_EDGE), np.where(none[1], np.inf, right - FLOOR_EDGE))

    def bounds(self, chainage: Float) -> tuple[Float, Float]:
        """Arc at which the floor begins on the left and on the right, m."""
        place = np.where(np.isfinite(chainage), chainage, self.start)
        row = np.clip(np.rint(place - self.start).astype(np.intp), 0, len(self.left) - 1)
        return self.left[row], self.right[row]

    def covers(self, chainage: Float, arc: Float, above: float = 0.0) -> NDArray[np.bool_]:
        """Tell which places in the unrolled plane are floor, or wall so far ``above`` it; arrays that broadcast, m."""
        left, right = self.bounds(chainage)
        with np.errstate(invalid="ignore"):
            return np.asarray((arc <= left + above) | (arc >= right - above), dtype=np.bool_)


def _bridged(arcs: Float) -> Float:
    """Fill gaps of up to HIDDEN metres between places."""
    out = arcs.copy()
    known = np.flatnonzero(np.isfinite(arcs))
    for before, after in pairwise(known.tolist()):
        if after - before <= HIDDEN:
            out[before : after + 1] = np.linspace(arcs[before], arcs[after], after - before + 1)
    return out


@dataclass(frozen=True)
class Astray:
    """Where the surface leaves the wall, because a section was measured in a niche or on something hung on the wall.

    Such a section stands apart from those beside it. From one of them to the other the surface is then no
    wall there, and what lies on it no lining.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    apart : (k, 361) float array
        How far each section stands apart from those beside it, m, at each whole degree; 0 where it is on the
        wall.
    """

    surface: Surface
    apart: Float

    @classmethod
    def of(cls, surface: Surface) -> Astray:
        """Take the sections that stand apart from those beside them (:meth:`Surface.astray`)."""
        apart = np.abs(surface.astray())
        # A tunnel that is wider or narrower all round has no niche.
        apart[(apart > 0.0).mean(axis=1) > MOST] = 0.0
        return cls(surface, apart)

    def covers(self, chainage: Float, arc: Float) -> NDArray[np.bool_]:
        """Tell which pixels, (rows,) arcs by (columns,) chainages, lie on surface that left the wall."""
        out = np.zeros((len(arc), len(chainage)), np.bool_)
        at = self.surface.chainages
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1) if len(at) > 1 else None
        if after is None or not self.apart.any():
            return out
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        for pair in np.unique(after):
            if not self.apart[pair - 1 : pair + 1].any():
                continue
            for column in np.flatnonzero(after == pair):
                g = share[column]
                nodes = (1 - g) * self.surface.arcs[pair - 1] + g * self.surface.arcs[pair]
                apart = (1 - g) * self.apart[pair - 1] + g * self.apart[pair]
                out[:, column] = np.interp(arc, nodes, ndimage.maximum_filter1d(apart, 7)) > OFF_WALL
        return out


def states(window: Window, columns: slice, grid: Grid, floor: Floor, astray: Astray, delta: float) -> NDArray[np.uint8]:
    """State of the pixels of some columns.

    Parameters
    ----------
    window : Window
        Those columns and, to both sides, :func:`tunneldb.leak.appendage.reach` more.
    columns : slice
        Columns of the grid.
    grid : Grid
        The pixels.
    floor : Floor
        Where the floor begins.
    astray : Astray
        Where the surface leaves the wall.
    delta : float
        Distance from the lining's plane from which a pixel is an appendage, m.

    Returns
    -------
    (rows, columns) uint8 array
        Values of :class:`State`.
    """
    inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
    corner = (-grid.bottom - grid.rows, grid.first_column + window.columns.start)
    off = appendages(window.offset, grid.pixel, delta, corner)[:, inner]
    chainage, arc = grid.chainages(columns), grid.arcs()
    left, right = floor.bounds(chainage)
    state: NDArray[np.uint8] = _states(window.weight[:, inner], off, astray.covers(chainage, arc), arc, left, right)
    return state


@njit(cache=True, nogil=True)
def _states(
    weight: Whole, off: NDArray[np.bool_], astray: NDArray[np.bool_], arc: Float, left: Float, right: Float
) -> NDArray[np.uint8]:  # pragma: no cover - compiled
    state = np.empty(weight.shape, np.uint8)
    for i in range(weight.shape[0]):
        for j in range(weight.shape[1]):
            if arc[i] <= left[j] or arc[i] >= right[j]:
                state[i, j] = 4
            elif off[i, j] or astray[i, j]:
                state[i, j] = 3
            else:
                state[i, j] = 1 if weight[i, j] > 0 else 0
    return state
