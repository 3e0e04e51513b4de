"""Design axis that rings are compared with, as a polyline."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tunneldb.arrays import Float
from tunneldb.geometry.plan_line import PlanLine


@dataclass(frozen=True)
class DesignAxis:
    """Polyline with chainages at its vertices.

    Attributes
    ----------
    vertices : (k, 3) float array
        m; no two consecutive vertices coincide in plan.
    chainage : (k,) float array
        Increasing, m.
    """

    vertices: Float
    chainage: Float

    @cached_property
    def plan(self) -> PlanLine:
        """Line in plan."""
        return PlanLine.of(self.vertices, self.chainage)

    @cached_property
    def _slope(self) -> Float:
        return np.gradient(self.vertices, self.chainage, axis=0)

    def place(self, xyz: Float) -> tuple[Float, Float, Float]:
        """Return the chainage of points (n, 3), and their offsets to the right of the axis in plan and above it, each (n,), m.

        Right is across the axis in plan, up is vertical, both at the point's chainage. Beyond the ends the chainage exceeds
        that of the vertices, and the height of the end is used.
        """
        along, right = self.plan.place(xyz)
        return along, right, xyz[:, 2] - np.interp(along, self.chainage, self.vertices[:, 2])

    def tangent(self, chainage: Float) -> Float:
        """Return unit vectors (n, 3) up-chainage, at chainages (n,)."""
        slope = np.column_stack([np.interp(chainage, self.chainage, self._slope[:, k]) for k in range(3)])
        return slope / np.linalg.norm(slope, axis=1)[:, None]

    def covers(self, chainage: float) -> bool:
        """Return True if a chainage lies between the ends."""
        return bool(self.chainage[0] <= chainage <= self.chainage[-1])

    @cached_property
    def sagitta(self) -> float:
        """Return the greatest sagitta of the arcs that the polyline approximates, m: the error of straight pieces."""
        step = np.diff(self.vertices, axis=0)
        length = np.linalg.norm(step, axis=1)
        if len(length) < 2:
            return 0.0
        bend = np.linalg.norm(np.diff(step / length[:, None], axis=0), axis=1)
        return float((np.maximum(length[:-1], length[1:]) * bend).max() / 8.0)
