"""Ladders as cylinders: where their axes lie, and how far points are from them.

A ladder's own axes: across (along the rungs), up (along the stiles), out (from the wall to the water); its origin is the
middle between the stiles at height zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float, Int64
from tunneldb.registration.underwater.results import Ladder

BEYOND = 0.15  # of the stiles beyond the outermost rungs, m: half a gap, for what they end in is not stated


@dataclass(frozen=True)
class PlacedLadder:
    """A ladder where it stands.

    Attributes
    ----------
    ladder : Ladder
    origin : (3,) float64 array
    axes : (3, 3) float64 array
        Rows: across, up, out.
    gap : float
        Between the middles of the stiles, m.
    """

    ladder: Ladder
    origin: Float
    axes: Float
    gap: float

    def to_ladder(self, points: Float) -> Float:
        """Points (n, 3) in the ladder's own axes."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def to_space(self, points: Float) -> Float:
        """Inverse of `to_ladder`."""
        return np.asarray(points @ self.axes + self.origin)

    def moved(self, turn: Float, shift: Float, wider: float = 0.0) -> PlacedLadder:
        """Turned by a rotation vector (3,) about its origin, then shifted (3,), with a gap that is wider by some metres."""
        axes = np.asarray(Rotation.from_rotvec(turn).apply(self.axes))
        return replace(self, origin=self.origin + shift, axes=axes, gap=self.gap + wider)

    def elements(self) -> tuple[Float, Float]:
        """Ends (r + 2, 3) and (r + 2, 3) of the axes of the stiles, then of the rungs, in the ladder's own axes."""
        height, half = self.ladder.height, self.gap / 2.0
        low, high = height[0] - BEYOND, height[-1] + BEYOND
        zero = np.zeros(len(height))
        begin = np.vstack([[-half, low, 0.0], [half, low, 0.0], np.column_stack([zero - half, height, zero])])
        end = np.vstack([[-half, high, 0.0], [half, high, 0.0], np.column_stack([zero + half, height, zero])])
        return begin, end


def nearest_element(own: Float, placed: PlacedLadder) -> tuple[Int64, Float]:
    """Which axis each point (n, 3), in the ladder's own axes, is nearest to, and the vector (n, 3) from there to it.

    Elements are numbered as in `PlacedLadder.elements`.
    """
    begin, end = placed.elements()
    span = end - begin
    share = np.einsum("nej,ej->ne", own[:, None] - begin[None], span) / (span**2).sum(axis=1)
    foot = begin + np.clip(share, 0.0, 1.0)[..., None] * span
    away = own[:, None] - foot
    which = np.argmin((away**2).sum(axis=2), axis=1)
    return which.astype(np.int64), np.asarray(away[np.arange(len(own)), which])
