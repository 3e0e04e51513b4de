"""Tunnels as curves: an axis of one line or arc with a grade, a section swept along it upright, and the way back.

``s`` is the distance along the axis in plan, ``u`` to the right looking along it, ``w`` upwards from the axis, ``a`` the length
along the section from its crown, positive to the right: all m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Section:
    """A closed outline, clockwise from the crown; the floor lies at its lowest height."""

    outline: Array
    """(n, 2) u, w; the last row is the first."""

    @property
    def floor(self) -> float:
        return float(self.outline[:, 1].min())

    @property
    def lengths(self) -> Array:
        steps = np.hypot(*np.diff(self.outline, axis=0).T)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def perimeter(self) -> float:
        return float(self.lengths[-1])

    def at(self, a: Array) -> tuple[Array, Array]:
        """Return the (n, 2) points and inward normals at arcs `a`."""
        lengths, along = self.lengths, np.mod(a, self.perimeter)
        piece = np.clip(np.searchsorted(lengths, along, side="right") - 1, 0, len(lengths) - 2)
        tangent = np.diff(self.outline, axis=0)[piece]
        tangent = tangent / np.hypot(*tangent.T)[:, None]
        points = self.outline[piece] + tangent * (along - lengths[piece])[:, None]
        return points, np.column_stack([tangent[:, 1], -tangent[:, 0]])

    def arc(self, points: Array) -> Array:
        """Return the arcs of the places of the outline nearest to (n, 2) `points`, -P/2 to P/2."""
        fine = np.arange(0.0, self.perimeter, 0.01)
        places, _ = self.at(fine)
        gaps = np.hypot(points[:, None, 0] - places[None, :, 0], points[:, None, 1] - places[None, :, 1])
        found = fine[np.argmin(gaps, axis=1)]
        return np.where(found > self.perimeter / 2, found - self.perimeter, found)


def circular(radius: float = 4.0, floor: float = 2.6) -> Section:
    """Make a circle with a flat floor `floor` below its centre."""
    end = np.pi - np.arccos(floor / radius)
    angle = np.linspace(0.0, end, 120)
    right = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    return _both_sides(right)


def horseshoe(radius: float = 4.0, wall: float = 2.5) -> Section:
    """Make half a circle on upright walls, with a flat floor."""
    angle = np.linspace(0.0, np.pi / 2, 90)
    arch = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    return _both_sides(np.vstack([arch, [radius, -wall]]))


def rectangle(width: float = 8.0, height: float = 6.0) -> Section:
    """Make a box about the axis."""
    return _both_sides(np.array([[0.0, height / 2], [width / 2, height / 2], [width / 2, -height / 2]]))


def _both_sides(right: Array) -> Section:
    left = right[::-1] * [-1.0, 1.0]
    return Section(np.vstack([right, left]))


@dataclass(frozen=True)
class Tube:
    """A section along a line, or along an arc that bends to the right by `radius` (0: straight)."""

    section: Section
    length: float = 24.0
    radius: float = 0.0
    grade: float = 0.0
    bend: float = 0.0
    """Change of the grade, 1/m."""
    origin: tuple[float, float, float] = (452000.0, 5401000.0, 310.0)
    azimuth: float = 35.0

    def axis(self, s: Array) -> Array:
        """Return (n, 3) x, y, z of the axis at `s`."""
        return self.place(s, np.zeros_like(s), np.zeros_like(s))

    def heading(self, s: Array) -> Array:
        turn = s / self.radius if self.radius else np.zeros_like(s)
        return np.radians(self.azimuth) + turn

    def height(self, s: Array) -> Array:
        return self.origin[2] + self.grade * s + self.bend * s * s / 2

    def place(self, s: Array, u: Array, w: Array) -> Array:
        """Return (n, 3) x, y, z."""
        start = np.radians(self.azimuth)
        heading = self.heading(s)
        if self.radius:
            east = self.radius * (np.cos(start) - np.cos(heading))
            north = self.radius * (np.sin(heading) - np.sin(start))
        else:
            east, north = s * np.sin(start), s * np.cos(start)
        x = self.origin[0] + east + u * np.cos(heading)
        y = self.origin[1] + north - u * np.sin(heading)
        return np.column_stack([x, y, self.height(s) + w])

    def unplace(self, points: Array) -> tuple[Array, Array, Array]:
        """Return s, u, w of (n, 3) `points`."""
        start = np.radians(self.azimuth)
        east, north = points[:, 0] - self.origin[0], points[:, 1] - self.origin[1]
        if self.radius:
            # The centre lies to the right of the origin by the radius.
            de, dn = east - self.radius * np.cos(start), north + self.radius * np.sin(start)
            u = self.radius - np.sign(self.radius) * np.hypot(de, dn)
            # At s the direction from the centre is -(cos h, -sin h).
            heading = np.arctan2(dn * np.sign(self.radius), -de * np.sign(self.radius))
            s = np.mod(heading - start + np.pi, 2 * np.pi) - np.pi
            s = s * self.radius
        else:
            s = east * np.sin(start) + north * np.cos(start)
            u = east * np.cos(start) - north * np.sin(start)
        return s, u, points[:, 2] - self.height(s)
