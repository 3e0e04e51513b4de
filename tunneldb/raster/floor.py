"""Where the floor begins in the unrolled plane, along the tunnel."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float

HIDDEN = 25
"""So many metres of ground may be hidden by what stands on it, and the floor goes on beneath."""

FLOOR_EDGE = 0.02
"""So much of the wall above the floor goes with it, m: its foot, found from points of survey density, is known no better."""


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
