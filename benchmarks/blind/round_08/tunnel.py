"""Axis and cross-section of a tunnel, and the way between tunnel coordinates and those of the land survey."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Axis:
    """A circular arc (or a straight line) of constant grade.

    Tunnel coordinates are chainage ``s``, offset ``h`` to the right, and height ``v`` above rail or road. Sections
    are vertical.

    Attributes
    ----------
    origin : tuple of float
        Easting, northing and height at chainage 0.
    bearing : float
        Direction at chainage 0, in radians counterclockwise from east.
    curvature : float
        Per metre, positive to the left.
    grade : float
        Rise per metre.
    """

    origin: tuple[float, float, float]
    bearing: float
    curvature: float = 0.0
    grade: float = 0.0

    def frame(self, s: Array) -> tuple[Array, Array]:
        """Horizontal unit vectors along the axis and to its right, (n, 3) each."""
        angle = self.bearing + self.curvature * np.asarray(s, dtype=float)
        zero = np.zeros_like(angle)
        ahead = np.stack([np.cos(angle), np.sin(angle), zero], axis=-1)
        right = np.stack([np.sin(angle), -np.cos(angle), zero], axis=-1)
        return ahead, right

    def to_local(self, s: Array, h: Array, v: Array) -> Array:
        """Coordinates relative to the origin, (…, 3)."""
        s, h, v = np.broadcast_arrays(np.asarray(s, dtype=float), h, v)
        k = self.curvature
        if k == 0.0:
            ahead, left = s, -h
        else:
            ahead = np.sin(k * s) / k + h * np.sin(k * s)
            left = (1.0 - np.cos(k * s)) / k - h * np.cos(k * s)
        c, d = np.cos(self.bearing), np.sin(self.bearing)
        return np.stack([ahead * c - left * d, ahead * d + left * c, v + self.grade * s], axis=-1)

    def to_tunnel(self, local: Array) -> tuple[Array, Array, Array]:
        """Chainage, offset and height of points relative to the origin."""
        c, d = np.cos(self.bearing), np.sin(self.bearing)
        ahead = local[..., 0] * c + local[..., 1] * d
        left = local[..., 1] * c - local[..., 0] * d
        k = self.curvature
        if k == 0.0:
            s, h = ahead, -left
        else:
            s = np.arctan2(k * ahead, 1.0 - k * left) / k
            h = (np.hypot(k * ahead, 1.0 - k * left) - 1.0) / k
        return s, h, local[..., 2] - self.grade * s


@dataclass(frozen=True)
class Section:
    """A closed cross-section: lining from the left foot over the crown to the right foot, and the floor back.

    ``u`` is the length along it from the left foot. Seen from ``centre`` the outline has one point in each direction.

    Attributes
    ----------
    outline : array of (n, 2)
        Offset and height of the lining, left foot to right foot.
    centre_height : float
        Height of the centre above rail or road.
    """

    outline: Array
    centre_height: float
    girth: float = field(init=False)
    lined: float = field(init=False)
    crown: float = field(init=False)
    _points: Array = field(init=False, repr=False)
    _along: Array = field(init=False, repr=False)
    _normals: Array = field(init=False, repr=False)
    _polar: tuple[Array, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Resample the outline every centimetre and tabulate it by direction from the centre."""
        closed = np.vstack([self.outline, self.outline[:1]])
        corner = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
        count = int(np.ceil(corner[-1] / 0.01))
        along = np.linspace(0.0, corner[-1], count + 1)
        points = np.stack([np.interp(along, corner, closed[:, k]) for k in range(2)], axis=1)
        ahead = np.roll(points[:-1], -3, axis=0) - np.roll(points[:-1], 3, axis=0)
        ahead /= np.hypot(*ahead.T)[:, None]
        # The outline runs clockwise as seen along the axis, so that the inside is to the right of it.
        normals = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
        bearing = np.arctan2(points[:-1, 0], points[:-1, 1] - self.centre_height)
        order = np.argsort(bearing)
        radius = np.hypot(points[:-1, 0], points[:-1, 1] - self.centre_height)
        polar = (bearing[order], radius[order], along[:-1][order], normals[order, 0], normals[order, 1])
        values = {
            "girth": corner[-1],
            "lined": corner[-2],
            "crown": along[int(np.argmax(points[:, 1]))],
            "_points": points,
            "_along": along,
            "_normals": np.vstack([normals, normals[:1]]),
            "_polar": polar,
        }
        if abs(self.outline[0, 0] + self.outline[-1, 0]) < 0.05:
            values["crown"] = corner[-2] / 2.0
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def at(self, u: Array) -> tuple[Array, Array, Array, Array]:
        """Offset and height of points of the outline, and the normal into the tunnel."""
        u = np.mod(u, self.girth)
        columns = (self._points[:, 0], self._points[:, 1], self._normals[:, 0], self._normals[:, 1])
        return tuple(np.interp(u, self._along, column) for column in columns)

    def nearest(self, h: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        """Place along the outline in the direction of points, how far they are inside of it, and the normal there."""
        bearing, radius, along, normal_h, normal_v = self._polar
        dh, dv = h, v - self.centre_height
        direction = np.arctan2(dh, dv)
        reach = np.interp(direction, bearing, radius, period=2.0 * np.pi)
        cell = np.searchsorted(bearing, direction) % bearing.size
        inside = reach - np.hypot(dh, dv)
        lean = np.abs(normal_h[cell] * np.sin(direction) + normal_v[cell] * np.cos(direction))
        return along[cell], inside * lean, normal_h[cell], normal_v[cell]

    def reach(self, h: float, v: float, direction: Array) -> Array:
        """Distance to the outline from a point inside of it, in directions counted from the zenith to the right."""
        dh, dv = self._points[:-1, 0] - h, self._points[:-1, 1] - v
        bearing = np.arctan2(dh, dv)
        order = np.argsort(bearing)
        return np.interp(direction, bearing[order], np.hypot(dh, dv)[order], period=2.0 * np.pi)

    def place(self, v: float, side: int) -> float:
        """``u`` of the lining at a height, on the left (-1) or on the right (1)."""
        lining = self._along <= self.lined
        half = lining & ((self._along < self.crown) if side < 0 else (self._along >= self.crown))
        index = np.flatnonzero(half)
        return float(self._along[index[np.argmin(np.abs(self._points[index, 1] - v))]])


def circle(radius: float, centre_height: float) -> Section:
    """A bored tube whose floor lies at height 0."""
    foot = np.arccos(-centre_height / radius)
    angle = np.linspace(-foot, foot, 400)
    return Section(np.stack([radius * np.sin(angle), centre_height + radius * np.cos(angle)], axis=1), centre_height)


def horseshoe(radius: float, springing: float, foot: float) -> Section:
    """A half circle on walls that curve in to the half-width ``foot`` at the floor."""
    angle = np.linspace(-np.pi / 2.0, np.pi / 2.0, 300)
    arch = np.stack([radius * np.sin(angle), springing + radius * np.cos(angle)], axis=1)
    height = np.linspace(0.0, springing, 60)[:-1]
    wall = radius - (radius - foot) * (1.0 - height / springing) ** 2
    left = np.stack([-wall, height], axis=1)
    right = np.stack([wall, height], axis=1)[::-1]
    return Section(np.vstack([left, arch, right]), springing)


def box_section(half_width: float, wall: float, rise: float) -> Section:
    """Vertical walls beneath a flat, slightly cambered ceiling."""
    offset = np.linspace(-half_width, half_width, 200)
    ceiling = np.stack([offset, wall + rise * (1.0 - (offset / half_width) ** 2)], axis=1)
    left = np.array([[-half_width, 0.0]])
    right = np.array([[half_width, 0.0]])
    return Section(np.vstack([left, ceiling, right]), wall * 0.6)
