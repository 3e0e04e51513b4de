"""Elements of a design alignment, with points along them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tunneldb.arrays import Float

PlanKind = Literal["line", "arc", "clothoid"]
ProfileKind = Literal["grade", "parabola", "circle"]

# 24-point Gauss-Legendre rule on [0, 1]. It integrates the cosine of a quadratic over a full circle to 1e-13 of
# the length; a clothoid of a road or a railway turns by a fraction of that.
_NODE, _WEIGHT = np.polynomial.legendre.leggauss(24)
_NODE, _WEIGHT = 0.5 * (_NODE + 1.0), 0.5 * _WEIGHT


@dataclass(frozen=True)
class PlanElement:
    """Element in plan; its curvature is linear in the distance along it.

    Attributes
    ----------
    kind : str
        line, arc or clothoid.
    length : float
        Length in plan, m.
    x, y : float
        Start point, m.
    bearing : float
        Direction at its start, radians from the x axis towards y.
    curvature_from, curvature_to : float
        Curvature at both ends, 1/m, positive to the left.
    """

    kind: PlanKind
    length: float
    x: float
    y: float
    bearing: float
    curvature_from: float = 0.0
    curvature_to: float = 0.0

    def bearing_at(self, distance: Float) -> Float:
        """Return the direction at distances (m) from its start, radians from the x axis towards y."""
        change = (self.curvature_to - self.curvature_from) / self.length
        return self.bearing + distance * (self.curvature_from + 0.5 * change * distance)

    def position(self, distance: Float) -> Float:
        """Return points (n, 2) at distances (n,) from its start, m; extrapolated beyond its ends."""
        distance = np.asarray(distance, dtype=np.float64)
        bearing = self.bearing_at(distance[:, None] * _NODE)
        return np.column_stack([
            self.x + distance * (np.cos(bearing) @ _WEIGHT),
            self.y + distance * (np.sin(bearing) @ _WEIGHT),
        ])  # fmt: skip

    @property
    def end(self) -> Float:
        """End point, (2,), m."""
        return self.position(np.array([self.length]))[0]


@dataclass(frozen=True)
class ProfileElement:
    """Element in profile.

    Attributes
    ----------
    kind : str
        grade (constant), parabola (the grade is linear in the distance) or circle.
    distance : float
        Start: distance in plan from the start of the alignment, m.
    length : float
        Length in plan, m.
    z : float
        Height at its start, m.
    grade_from, grade_to : float
        Rise per metre in plan at both ends.
    """

    kind: ProfileKind
    distance: float
    length: float
    z: float
    grade_from: float
    grade_to: float

    def height(self, distance: Float) -> Float:
        """Return heights (n,) at distances (n,) in plan from the start of the alignment, m."""
        along = np.asarray(distance, dtype=np.float64) - self.distance
        if self.kind != "circle" or self.grade_from == self.grade_to:
            return self.z + along * (self.grade_from + 0.5 * (self.grade_to - self.grade_from) * along / self.length)
        # A circle's sine of slope is linear in plan; its height follows from the cosine.
        sine_from, sine_to = (grade / np.hypot(1.0, grade) for grade in (self.grade_from, self.grade_to))
        sine = sine_from + (sine_to - sine_from) * along / self.length
        radius = self.length / (sine_to - sine_from)
        return self.z + radius * (np.sqrt(1.0 - sine_from**2) - np.sqrt(1.0 - sine**2))


def clothoid_from_chord(
    start: tuple[float, float], end: tuple[float, float], length: float, curvature_from: float, curvature_to: float
) -> tuple[PlanElement, float]:
    """Return a clothoid (or arc) of given length and curvatures, turned so that its chord points from start to end.

    Returns
    -------
    The element, and the distance from start to end minus the length of its chord, m.
    """
    local = PlanElement("clothoid", length, 0.0, 0.0, 0.0, curvature_from, curvature_to)
    reach, given = local.end, np.subtract(end, start)
    bearing = math.remainder(math.atan2(given[1], given[0]) - math.atan2(reach[1], reach[0]), 2.0 * math.pi)
    excess = float(np.hypot(*given) - np.hypot(*reach))
    return PlanElement("clothoid", length, *start, bearing, curvature_from, curvature_to), excess
