"""Edges of the floor and of the water in the unrolled plane, along the tunnel."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Int64

MAX_HIDDEN_LENGTH = 25
"""Length of hidden ground over which the floor continues, m."""

FLOOR_EDGE = 0.02
"""Height of the wall above the floor that counts as floor, m: its foot, from survey-density points, is no more accurate."""


@dataclass(frozen=True)
class Floor:
    """Edges of the floor on both sides, each metre along the tunnel: at the foot of the walls, or at the water.

    Everything beyond belongs to the floor, rails and objects included. Without a known ground or water there is no floor.

    Attributes
    ----------
    start : int
        Chainage of the first place, m.
    left, right : (k,) float arrays
        Arc of the floor's edge at each metre from there, m; infinite without one.
    water_left, water_right : (k,) float arrays
        Arc of the water's edge likewise; the laser sees nothing under water.
    """

    start: int
    left: Float
    right: Float
    water_left: Float
    water_right: Float

    @classmethod
    def of(cls, start: int, left: Float, right: Float, water: tuple[Float, Float] | None = None) -> Floor:
        """Make a floor.

        Parameters
        ----------
        start : int
            Chainage of the first place, m.
        left, right : (k,) float arrays
            Arcs of the walls' feet at each metre from there, m, NaN for none.
        water : two (k,) float arrays, optional
            Arcs of the water's edges, left and right, NaN for none.
        """
        left, right = _bridged(left), _bridged(right)
        none = np.isnan(left), np.isnan(right)
        left, right = np.where(none[0], -np.inf, left + FLOOR_EDGE), np.where(none[1], np.inf, right - FLOOR_EDGE)
        left, right = -_steady(-left), _steady(right)
        if water is None:
            return cls(start, left, right, np.full_like(left, -np.inf), np.full_like(right, np.inf))
        water_left, water_right = np.nan_to_num(water[0], nan=-np.inf), np.nan_to_num(water[1], nan=np.inf)
        return cls(start, np.maximum(left, water_left), np.minimum(right, water_right), water_left, water_right)

    def bounds(self, chainage: Float) -> tuple[Float, Float]:
        """Return the arcs of the floor's left and right edges, m."""
        row = self._row(chainage)
        return self.left[row], self.right[row]

    def waterline(self, chainage: Float) -> tuple[Float, Float]:
        """Return the arcs of the water's left and right edges, m; infinite if not known."""
        row = self._row(chainage)
        return self.water_left[row], self.water_right[row]

    def _row(self, chainage: Float) -> Int64:
        place = np.where(np.isfinite(chainage), chainage, self.start)
        return np.clip(np.rint(place - self.start).astype(np.int64), 0, len(self.left) - 1)

    def covers(self, chainage: Float, arc: Float, above: float = 0.0) -> Bool:
        """Return True for places on the floor, or on the wall up to ``above`` it; arrays that broadcast, m."""
        left, right = self.bounds(chainage)
        with np.errstate(invalid="ignore"):
            return np.asarray((arc <= left + above) | (arc >= right - above), dtype=np.bool_)


def _steady(arcs: Float) -> Float:
    """Limit arcs of the foot to FLOOR_EDGE beyond their neighbours: a section measured off the wall has longer arcs."""
    beside = ndimage.minimum_filter1d(arcs, 3, mode="nearest")
    return np.minimum(arcs, beside + FLOOR_EDGE)


def _bridged(arcs: Float) -> Float:
    """Fill gaps of up to MAX_HIDDEN_LENGTH metres between places."""
    out = arcs.copy()
    known = np.flatnonzero(np.isfinite(arcs))
    for before, after in pairwise(known.tolist()):
        if after - before <= MAX_HIDDEN_LENGTH:
            out[before : after + 1] = np.linspace(arcs[before], arcs[after], after - before + 1)
    return out
