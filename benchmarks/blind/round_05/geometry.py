"""Axis and section of a tunnel, and the way between their coordinates and the world's.

Coordinates of the tunnel are chainage ``c``, offset to the right ``u`` and height ``w`` above the axis. On the lining ``s`` is
the length of arc from the crown, positive to the right; the middle of the floor is at the two ends of its range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
STRAIGHT = 1.0e7


@dataclass(frozen=True)
class Axis:
    """A circular arc in plan with one gradient.

    Attributes
    ----------
    length : float
        Chainage of the end of the scan in m; its beginning is 0.
    radius : float
        Radius in plan in m; positive bends to the right.
    slope : float
        Rise per metre.
    heading : float
        Direction at chainage 0, from east towards north, in rad.
    origin : tuple of float
        Easting, northing and height at chainage 0.
    """

    length: float
    radius: float = STRAIGHT
    slope: float = 0.0
    heading: float = 0.4
    origin: tuple[float, float, float] = (561000.0, 5934000.0, -12.0)

    def to_frame(self, c: Array, u: Array, w: Array) -> Array:
        """Points (n, 3) in the frame of chainage 0: forward, right, up."""
        angle = c / self.radius
        arm = self.radius - u
        return np.stack([arm * np.sin(angle), self.radius - arm * np.cos(angle), w + self.slope * c], axis=-1)

    def from_frame(self, points: Array) -> tuple[Array, Array, Array]:
        """Chainage, offset and height of points in the frame of chainage 0."""
        sign = np.sign(self.radius)
        across = self.radius - points[..., 1]
        c = self.radius * np.arctan2(sign * points[..., 0], sign * across)
        u = self.radius - sign * np.hypot(points[..., 0], across)
        return c, u, points[..., 2] - self.slope * c

    def direction(self, c: Array, d: Array) -> Array:
        """Directions of the frame as components along (c, u, w) at the chainage."""
        angle = c / self.radius
        forward = d[..., 0] * np.cos(angle) + d[..., 1] * np.sin(angle)
        right = d[..., 1] * np.cos(angle) - d[..., 0] * np.sin(angle)
        return np.stack([forward, right, d[..., 2] - self.slope * forward], axis=-1)

    def to_world(self, frame: Array) -> Array:
        """Easting, northing, height of points in the frame of chainage 0."""
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        east, north, height = self.origin
        x, y = frame[..., 0], frame[..., 1]
        return np.stack([east + x * cos + y * sin, north + x * sin - y * cos, height + frame[..., 2]], axis=-1)


class Section:
    """A closed section, star-shaped about the axis and symmetric, given by its right half from crown to floor."""

    def __init__(self, half: Array, floor: float) -> None:
        outline = np.concatenate([half[::-1] * (-1.0, 1.0), half[1:]])
        step = np.hypot(*np.diff(outline, axis=0).T)
        arc = np.concatenate([[0.0], np.cumsum(step)])
        self.perimeter = float(arc[-1])
        self.half = self.perimeter / 2
        self.s = np.linspace(-self.half, self.half, 8001)
        self.u = np.interp(self.s, arc - self.half, outline[:, 0])
        self.w = np.interp(self.s, arc - self.half, outline[:, 1])
        self.floor = floor
        self.foot = float(np.max(self.s[self.w > floor + 1e-6]))
        tangent = np.stack([np.gradient(self.u), np.gradient(self.w)], axis=1)
        tangent /= np.hypot(*tangent.T)[:, None]
        self.tangent = tangent
        self.angle = np.unwrap(np.arctan2(self.u, self.w))
        self.angle -= self.angle[4000]
        self.reach = np.hypot(self.u, self.w)

    def at(self, s: Array | float) -> tuple[Array, Array]:
        """Offset and height of the lining."""
        return np.interp(s, self.s, self.u), np.interp(s, self.s, self.w)

    def inward(self, s: Array | float) -> tuple[Array, Array]:
        """Unit normal into the tunnel, as (u, w)."""
        return np.interp(s, self.s, self.tangent[:, 1]), -np.interp(s, self.s, self.tangent[:, 0])

    def arc(self, u: Array, w: Array) -> Array:
        """Position ``s`` on the lining behind a point, as seen from the axis."""
        return np.interp(np.arctan2(u, w), self.angle, self.s)

    def clearance(self, u: Array, w: Array) -> Array:
        """Distance to the lining along the line from the axis; negative behind it."""
        return np.interp(np.arctan2(u, w), self.angle, self.reach) - np.hypot(u, w)

    def height_at(self, height: float, side: int) -> float:
        """Position ``s`` on one side (1 right, -1 left) where the lining has a height."""
        walls = (self.s > 0) & (self.s <= self.foot)
        return side * float(np.interp(-height, -self.w[walls], self.s[walls]))


def _close(points: Array, floor: float) -> Section:
    """Cut the half at the floor and lead it to the middle."""
    below = int(np.argmax(points[:, 1] <= floor)) or len(points) - 1
    a, b = points[below - 1], points[below]
    corner = a + (b - a) * ((a[1] - floor) / max(a[1] - b[1], 1e-9))
    return Section(np.concatenate([points[:below], corner[None], [[0.0, floor]]]), floor)


def circle(radius: float, floor: float) -> Section:
    """A shield tunnel with a flat track bed or deck."""
    a = np.linspace(0.0, np.pi, 2000)
    return _close(np.stack([radius * np.sin(a), radius * np.cos(a)], axis=1), floor)


def three_centred(crown: float, side: float, turn: float, floor: float) -> Section:
    """A mined tunnel: crown of one radius to the angle ``turn``, sides of another, tangent to it."""
    a = np.linspace(0.0, turn, 800)
    top = np.stack([crown * np.sin(a), crown * np.cos(a)], axis=1)
    b = np.linspace(turn, np.pi * 0.9, 1200)[1:]
    shift = (crown - side) * np.array([np.sin(turn), np.cos(turn)])
    low = shift + np.stack([side * np.sin(b), side * np.cos(b)], axis=1)
    return _close(np.concatenate([top, low]), floor)


def horseshoe(radius: float, floor: float) -> Section:
    """Half a circle on upright walls."""
    a = np.linspace(0.0, np.pi / 2, 1000)
    top = np.stack([radius * np.sin(a), radius * np.cos(a)], axis=1)
    return _close(np.concatenate([top, [[radius, floor - 0.01]]]), floor)


def box(width: float, top: float, floor: float, haunch: float) -> Section:
    """A cut-and-cover frame with haunches under its roof."""
    half = width / 2
    return _close(np.array([[0.0, top], [half - haunch, top], [half, top - haunch], [half, floor - 0.01]]), floor)
