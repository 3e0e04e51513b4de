"""What each pixel of the unrolled image shows: lining, lining set back in a recess, what hangs on it, floor."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise

import numpy as np
from numba import njit
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single, UInt8
from tunneldb.geometry.surface import Surface
from tunneldb.geometry.unrolling import bracket
from tunneldb.raster import appendages as appendage
from tunneldb.raster import ring_steps as step
from tunneldb.raster.accumulator import Grid, Whole, Window

HIDDEN = 25
"""So many metres of ground may be hidden by what stands on it, and the floor goes on beneath."""

FLOOR_EDGE = 0.02
"""So much of the wall above the floor goes with it, m: its foot, found from points of survey density, is known no better."""

MOST = 0.4
"""Where a larger part of a section does, it is the tunnel that has another shape."""

OFF_WALL = 0.03
"""Where the surface leaves the wall by more than this within a few degrees, it bends, m."""


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
        left, right = np.where(none[0], -np.inf, left + FLOOR_EDGE), np.where(none[1], np.inf, right - FLOOR_EDGE)
        return cls(start, -_steady(-left), _steady(right))

    def bounds(self, chainage: Float) -> tuple[Float, Float]:
        """Arc at which the floor begins on the left and on the right, m."""
        place = np.where(np.isfinite(chainage), chainage, self.start)
        row = np.clip(np.rint(place - self.start).astype(np.intp), 0, len(self.left) - 1)
        return self.left[row], self.right[row]

    def covers(self, chainage: Float, arc: Float, above: float = 0.0) -> Bool:
        """Tell which places in the unrolled plane are floor, or wall so far ``above`` it; arrays that broadcast, m."""
        left, right = self.bounds(chainage)
        with np.errstate(invalid="ignore"):
            return np.asarray((arc <= left + above) | (arc >= right - above), dtype=np.bool_)


def _steady(arcs: Float) -> Float:
    """Arcs of the foot, no more than FLOOR_EDGE beyond those beside: of a section measured off the wall arcs are longer."""
    beside = ndimage.minimum_filter1d(arcs, 3, mode="nearest")
    return np.minimum(arcs, beside + FLOOR_EDGE)


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

    Such a section stands apart from those beside it, and between them the surface departs from the wall as it does from
    their course.

    Attributes
    ----------
    surface : Surface
        The tunnel.
    apart : (k, 361) float array
        How far each section stands apart from those beside it, m, outwards positive, at each whole degree; 0 where it is
        on the wall.
    """

    surface: Surface
    apart: Float

    @classmethod
    def of(cls, surface: Surface) -> Astray:
        """Take the sections that stand apart from those beside them (:meth:`Surface.astray`)."""
        apart = surface.astray()
        # A tunnel that is wider or narrower all round has no niche.
        apart[(apart != 0.0).mean(axis=1) > MOST] = 0.0
        return cls(surface, apart)

    def level(self, chainage: Float, arc: Float) -> tuple[Single, Bool] | None:
        """Offset of the wall from the surface, m, and where it bends; (rows,) arcs by (columns,) chainages; None: nowhere.

        Where it bends, at the edges of the niche, the surface's normals are not those of the wall.
        """
        at = self.surface.chainages
        if len(at) < 2 or not self.apart.any():
            return None
        after = np.clip(np.searchsorted(at, chainage, side="right"), 1, len(at) - 1)
        columns = np.flatnonzero(self.apart[after].any(axis=1) | self.apart[after - 1].any(axis=1))
        if not len(columns):
            return None
        share = np.clip((chainage - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
        level, bent = np.zeros((len(arc), len(chainage)), np.float32), np.zeros((len(arc), len(chainage)), np.bool_)
        for column in columns.tolist():
            a, b, g = after[column] - 1, after[column], share[column]
            nodes = (1 - g) * self.surface.arcs[a] + g * self.surface.arcs[b]
            apart = (1 - g) * self.apart[a] + g * self.apart[b]
            bend = ndimage.maximum_filter1d(apart, 7) - ndimage.minimum_filter1d(apart, 7)
            level[:, column] = np.interp(arc, nodes, apart)
            bent[:, column] = np.interp(arc, nodes, bend) > OFF_WALL
        return level, bent


def reach(pixel: float) -> int:
    """How far, in pixels, what a pixel's state depends on lies from it at most."""
    return appendage.reach(pixel) + step.reach(pixel)


def states(window: Window, columns: slice, grid: Grid, floor: Floor, astray: Astray, delta: float) -> UInt8:
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
    astray : Astray
        Where the surface leaves the wall.
    delta : float
        Distance from the lining's plane from which a pixel is an appendage, m.

    Returns
    -------
    (rows, columns) uint8 array
        Values of :class:`State`.
    """
    chainage, arc = grid.chainages(window.columns), grid.arcs()
    left, right = floor.bounds(chainage)
    offset, bent = window.offset, None
    if (strayed := astray.level(chainage, arc)) is not None:
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
    surface = astray.surface
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
