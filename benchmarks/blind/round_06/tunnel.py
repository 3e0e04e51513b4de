"""Section and axis of a tunnel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .fields import Array

STEP = 0.01
"""Distance of the points that make up a section (m)."""


class Section:
    """Inner outline of a tunnel, symmetric, convex.

    ``u`` runs round it from the crown, positive to the right; ``n`` points right, ``z`` up, both from the axis.

    Parameters
    ----------
    *pieces : tuple
        From the crown down the right side: ``("arc", radius, degrees)`` and ``("line", length)``; ``("turn", degrees)`` bends
        at a corner. The floor closes it.
    axis_height : float
        Height of the axis above the floor (m).
    """

    def __init__(
        self, *pieces: tuple[Literal["arc"], float, float] | tuple[Literal["line", "turn"], float], axis_height: float
    ):
        heading, n, z = 0.0, [0.0], [0.0]
        for piece in pieces:
            if piece[0] == "turn":
                heading += np.radians(piece[1])
                continue
            length = piece[1] * np.radians(piece[2]) if piece[0] == "arc" else piece[1]
            count = max(2, round(length / STEP))
            bend = np.radians(piece[2]) / count if piece[0] == "arc" else 0.0
            for _ in range(count):
                n.append(n[-1] + length / count * np.cos(heading + bend / 2))
                z.append(z[-1] - length / count * np.sin(heading + bend / 2))
                heading += bend
        self.foot = float(np.hypot(np.diff(n), np.diff(z)).sum())
        right_n = np.append(n, 0.0)
        right_z = np.append(z, z[-1]) - z[-1] - axis_height
        line_n, line_z = np.r_[-right_n[:0:-1], right_n], np.r_[right_z[:0:-1], right_z]
        along = np.r_[0, np.hypot(np.diff(line_n), np.diff(line_z)).cumsum()]
        self.around = float(along[-1])
        self.u = np.linspace(-self.around / 2, self.around / 2, round(self.around / STEP) + 1)
        self.n, self.z = (np.interp(self.u + self.around / 2, along, values) for values in (line_n, line_z))
        tangent = np.stack([np.gradient(self.n, self.u), np.gradient(self.z, self.u)])
        self.tangent = tangent / np.hypot(*tangent)
        self.floor = -axis_height

    def at(self, u: Array) -> Array:
        """Position, inward normal and tangent: rows ``n``, ``z``, ``mn``, ``mz``, ``tn``, ``tz``."""
        tn, tz = self.tangent
        table = np.stack([self.n, self.z, tz, -tn, tn, tz])
        x = (u + self.around / 2) / (self.u[1] - self.u[0])
        i = np.clip(x.astype(np.int64), 0, len(self.u) - 2)
        f = x - i
        return np.asarray(table[:, i] * (1 - f) + table[:, i + 1] * f)

    def towards(self, n0: float, z0: float, dn: Array, dz: Array) -> Array:
        """Where rays from a point inside meet the outline: ``u``."""
        angle = np.unwrap(np.arctan2(self.n - n0, self.z - z0))
        ray = np.mod(np.arctan2(dn, dz) - angle[0], 2 * np.pi) + angle[0]
        return np.interp(ray, angle, self.u)

    def height(self, h: float) -> float:
        """Distance from the crown, down the wall, of the place ``h`` above the floor."""
        wall = (self.u >= 0) & (self.u <= self.foot)
        return float(np.interp(-(self.floor + h), -self.z[wall], self.u[wall]))

    def point(self, h: float, side: int, off: float) -> tuple[float, float]:
        """``n`` and ``z`` of a place ``off`` before the lining, ``h`` above the floor, right (1) or left (-1)."""
        return self.before(side * self.height(h), off)

    def before(self, u: float, off: float) -> tuple[float, float]:
        """``n`` and ``z`` of a place ``off`` before the lining at ``u``."""
        n, z, mn, mz, _, _ = self.at(np.array([u]))[:, 0]
        return float(n + off * mn), float(z + off * mz)


@dataclass(frozen=True)
class Axis:
    """Straight line or circular arc in plan, with a constant grade; chainage 0 at ``origin``."""

    origin: tuple[float, float, float]
    azimuth: float
    radius: float = np.inf
    grade: float = 0.0

    def frame(self, s: Array) -> tuple[Array, Array, Array]:
        """Points of the axis, unit vectors along and to the right (both level)."""
        start = np.radians(self.azimuth)
        turn = s / self.radius
        bearing = start + turn
        chord = s * np.sinc(turn / 2 / np.pi)
        x = self.origin[0] + chord * np.sin(start + turn / 2)
        y = self.origin[1] + chord * np.cos(start + turn / 2)
        zero = np.zeros_like(bearing)
        return (
            np.stack([x, y, self.origin[2] + self.grade * s], -1),
            np.stack([np.sin(bearing), np.cos(bearing), zero], -1),
            np.stack([np.cos(bearing), -np.sin(bearing), zero], -1),
        )
