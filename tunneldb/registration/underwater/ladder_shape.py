"""Ladders as cylinders: positions of their axes, and distances of points from them.

A ladder's own axes: across (along the rungs), up (along the stiles), out (from the wall to the water). Its origin is the
midpoint between the stiles at height zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tunneldb.arrays import Float, Int64
from tunneldb.registration.underwater.results import Ladder

STILE_OVERHANG = 0.15  # m of the stiles beyond the outermost rungs: half a gap, since their ends are not given


@dataclass(frozen=True, eq=False)
class PlacedLadder:
    """Ladder with its position.

    Attributes
    ----------
    ladder : Ladder
    origin : (3,) float64 array
    axes : (3, 3) float64 array
        Rows: across, up, out.
    gap : float
        Distance between the stiles' axes, m.
    stile : float
        Diameter of the stiles, m; often they are thicker than the rungs.
    """

    ladder: Ladder
    origin: Float
    axes: Float
    gap: float
    stile: float

    def to_ladder(self, points: Float) -> Float:
        """Return points (n, 3) in the ladder's own axes."""
        return np.asarray((points - self.origin) @ self.axes.T)

    def to_space(self, points: Float) -> Float:
        """Return points in space, the inverse of `to_ladder`."""
        return np.asarray(points @ self.axes + self.origin)

    def moved(self, turn: Float, shift: Float, wider: float = 0.0, thicker: float = 0.0) -> PlacedLadder:
        """Return it turned by a rotation vector (3,) about its origin, then shifted (3,).

        Its gap is wider by ``wider`` m, its stiles are thicker by ``thicker`` m.
        """
        axes = np.asarray(Rotation.from_rotvec(turn).apply(self.axes))
        return replace(self, origin=self.origin + shift, axes=axes, gap=self.gap + wider, stile=self.stile + thicker)

    def radius(self, element: Int64) -> Float:
        """Return the radius of elements (n,), numbered as in `elements`, m."""
        return np.where(element < 2, self.stile / 2.0, self.ladder.diameter / 2.0)

    def elements(self) -> tuple[Float, Float]:
        """Return the ends (r + 2, 3), (r + 2, 3) of the axes of the stiles, then of the rungs, in the ladder's own axes."""
        height, half = self.ladder.height, self.gap / 2.0
        low, high = height[0] - STILE_OVERHANG, height[-1] + STILE_OVERHANG
        zero = np.zeros(len(height))
        begin = np.vstack([[-half, low, 0.0], [half, low, 0.0], np.column_stack([zero - half, height, zero])])
        end = np.vstack([[-half, high, 0.0], [half, high, 0.0], np.column_stack([zero + half, height, zero])])
        return begin, end


def nearest_element(own: Float, placed: PlacedLadder) -> tuple[Int64, Float]:
    """Return the axis nearest to each point (n, 3), in the ladder's own axes, and the vector (n, 3) from there to it.

    Elements are numbered as in `PlacedLadder.elements`.
    """
    height, half = placed.ladder.height, placed.gap / 2.0
    x, y, z = own.T
    side = np.where(x < 0.0, -half, half)
    rung = np.searchsorted(0.5 * (height[1:] + height[:-1]), y)  # the rung at the nearest height
    along_stile = y - np.clip(y, height[0] - STILE_OVERHANG, height[-1] + STILE_OVERHANG)
    to_stile = np.column_stack([x - side, along_stile, z])
    to_rung = np.column_stack([x - np.clip(x, -half, half), y - height[rung], z])
    stile = (to_stile[:, :2] ** 2).sum(axis=1) <= (to_rung[:, :2] ** 2).sum(axis=1)
    which = np.where(stile, np.where(x < 0.0, 0, 1), rung + 2)
    return which.astype(np.int64), np.where(stile[:, None], to_stile, to_rung)
