"""Cross-sections: a lining from foot to foot over the crown, closed by a flat floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 0.004
TABLE = 24_000


def lerp(table: Array, position: Array) -> Array:
    """Interpolate a table at fractional indices, clamped to its ends."""
    clipped = np.clip(position, 0.0, len(table) - 1.000001)
    low = clipped.astype(np.int32)
    part = clipped - low
    value: Array = table[low] * (1.0 - part) + table[low + 1] * part
    return value


def _half_outline(parts: Sequence[tuple[float, float]]) -> Array:
    """Trace the right half from the crown down; a radius of 0 stands for a straight piece of the given length."""
    y, z, heading = 0.0, 0.0, 0.0
    points = [(y, z)]
    for radius, extent in parts:
        length = extent if radius == 0.0 else radius * np.radians(extent)
        count = max(2, int(np.ceil(length / STEP)))
        ds = length / count
        turn = 0.0 if radius == 0.0 else ds / radius
        for _ in range(count):
            middle = heading + 0.5 * turn
            y -= ds * float(np.cos(middle))
            z -= ds * float(np.sin(middle))
            heading += turn
            points.append((y, z))
    return np.array(points)


class Section:
    """A closed outline in the plane across the tunnel: y to the left, z upwards, floor at z = 0.

    The coordinate ``s`` runs from the left foot over the crown to the right foot (0 to ``lining``), then back along the floor
    (to ``total``). The lining is described by tangent arcs from the crown down, as ``(radius, degrees)`` or ``(0, length)``.
    """

    def __init__(self, parts: Sequence[tuple[float, float]]) -> None:
        right = _half_outline(parts)
        right[:, 1] -= right[-1, 1]
        left = right[::-1] * np.array([-1.0, 1.0])
        lining = np.vstack([left, right[1:]])
        width = lining[0, 0] - lining[-1, 0]
        floor = np.linspace(lining[-1], lining[0], int(width / STEP) + 2)
        raw = np.vstack([lining, floor[1:]])
        run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(raw, axis=0).T))])
        self.lining = float(run[len(lining) - 1])
        self.total = float(run[-1])
        self.crown = 0.5 * self.lining
        self.height = float(lining[:, 1].max())
        self.half_width = float(lining[:, 0].max())
        self.count = int(self.total / STEP)
        self.s = np.linspace(0.0, self.total, self.count + 1)
        self.y = np.interp(self.s, run, raw[:, 0])
        self.z = np.interp(self.s, run, raw[:, 1])
        ty, tz = np.gradient(self.y, self.s), np.gradient(self.z, self.s)
        norm = np.hypot(ty, tz)
        self.ty, self.tz = ty / norm, tz / norm
        self.centre = 0.45 * self.height
        self._build_polar()

    def _build_polar(self) -> None:
        phi = np.unwrap(np.arctan2(self.z - self.centre, self.y))
        self.phi0 = float(phi[0])
        grid = self.phi0 + np.linspace(0.0, 2.0 * np.pi, TABLE + 1)
        self.polar_s = np.interp(grid, phi, self.s)
        self.polar_r = np.interp(grid, phi, np.hypot(self.y, self.z - self.centre))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Points of the outline."""
        index = s * (self.count / self.total)
        return lerp(self.y, index), lerp(self.z, index)

    def tangent(self, s: Array) -> tuple[Array, Array]:
        """Unit tangents in the direction of growing s; the inward normal is ``(-tz, ty)``."""
        index = np.clip(np.rint(s * (self.count / self.total)), 0, self.count).astype(np.int32)
        return self.ty[index], self.tz[index]

    def locate(self, y: Array, z: Array) -> tuple[Array, Array]:
        """Outline coordinate on the radial line through points, and how far beyond the outline they lie on it."""
        dz = z - self.centre
        turn = np.mod(np.arctan2(dz, y) - self.phi0, 2.0 * np.pi) * (TABLE / (2.0 * np.pi))
        return lerp(self.polar_s, turn), np.hypot(y, dz) - lerp(self.polar_r, turn)

    def cast(self, y: float, z: float, phi: Array) -> tuple[Array, Array]:
        """Outline coordinate and distance hit by rays in the plane from an inner point in the directions phi."""
        seen = np.unwrap(np.arctan2(self.z - z, self.y - y))
        turn = seen[0] + np.mod(phi - seen[0], 2.0 * np.pi)
        s = np.interp(turn, seen, self.s)
        hit_y, hit_z = self.at(s)
        return s, np.hypot(hit_y - y, hit_z - z)

    def s_at(self, height: float, left: bool) -> float:
        """Outline coordinate of the lining at a height above the floor on one side."""
        half = self.s <= self.crown if left else (self.s >= self.crown) & (self.s <= self.lining)
        s, z = self.s[half], self.z[half]
        return float(s[np.argmin(np.abs(z - height))])
