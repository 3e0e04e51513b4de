"""Where things are: the tunnel's axis, its section, and the two together.

Three frames are in use. *World* is EPSG:25832. *Site* is metres from the axis at chainage 0: x along the axis there, y to the
left, z up. *Lining* is chainage ``u``, girth ``v`` from the crown (negative on the left, positive on the right, so that water
always runs towards larger ``abs(v)``) and depth outwards from the smooth lining.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TABLE = 1 << 16


@dataclass(frozen=True)
class Axis:
    """An axis of constant curvature and gradient.

    Attributes
    ----------
    east, north, level : float
        World coordinates at chainage 0.
    azimuth : float
        Direction there, degrees from north, clockwise.
    length : float
        Length that is modelled, m.
    curvature : float
        1/m, positive to the left; 0 is straight.
    gradient : float
        Rise per metre; sections stand upright.
    """

    east: float
    north: float
    level: float
    azimuth: float
    length: float
    curvature: float = 0.0
    gradient: float = 0.0

    def to_site(self, u: Array, y: Array, z: Array) -> Array:
        """Site coordinates of points given by chainage, offset to the left and height above the axis."""
        u, y, z = np.broadcast_arrays(u, y, z)
        rise = z + self.gradient * u
        if self.curvature == 0.0:
            return np.stack([u, y, rise], axis=-1)
        radius = 1.0 / self.curvature
        angle = u * self.curvature
        return np.stack([(radius - y) * np.sin(angle), radius - (radius - y) * np.cos(angle), rise], axis=-1)

    def to_local(self, site: Array) -> tuple[Array, Array, Array]:
        """Chainage, offset to the left and height above the axis."""
        x, left, up = site[..., 0], site[..., 1], site[..., 2]
        if self.curvature == 0.0:
            return x, left, up - self.gradient * x
        radius = 1.0 / self.curvature
        sign = np.sign(radius)
        u = np.arctan2(sign * x, sign * (radius - left)) / self.curvature
        return u, radius - sign * np.hypot(x, radius - left), up - self.gradient * u

    def along(self, u: Array) -> Array:
        """Horizontal unit vectors along the axis."""
        angle = u * self.curvature
        return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)

    def across(self, u: Array) -> Array:
        """Horizontal unit vectors to the left."""
        angle = u * self.curvature
        return np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)], axis=-1)

    def to_world(self, site: Array) -> Array:
        """World coordinates of site coordinates."""
        sin, cos = np.sin(np.radians(self.azimuth)), np.cos(np.radians(self.azimuth))
        east = self.east + site[..., 0] * sin - site[..., 1] * cos
        north = self.north + site[..., 0] * cos + site[..., 1] * sin
        return np.stack([east, north, self.level + site[..., 2]], axis=-1)


class Section:
    """A closed cross-section, star-shaped about the axis.

    Parameters
    ----------
    left : Array
        (y, z) from the middle of the floor by the left wall to the crown, y >= 0; the right half is its mirror image.
    foot : int
        Index of the vertex at which the floor ends and the wall begins.
    """

    def __init__(self, left: Array, foot: int) -> None:
        mirrored = left[-2::-1] * np.array([-1.0, 1.0])
        self.outline = np.concatenate([left, mirrored])
        lengths = np.hypot(*np.diff(self.outline, axis=0).T)
        self.run = np.concatenate([[0.0], np.cumsum(lengths)])
        self.half = self.run[-1] / 2
        self.foot = self.half - self.run[foot]
        turn = np.arctan2(self.outline[:, 0], -self.outline[:, 1]) % (2 * np.pi)
        turn[-1] = 2 * np.pi
        angle = (np.arange(TABLE) + 0.5) * (2 * np.pi / TABLE)
        edge = np.clip(np.searchsorted(turn, angle) - 1, 0, len(lengths) - 1)
        start, step = self.outline[edge], self.outline[edge + 1] - self.outline[edge]
        ray = np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
        cross = ray[:, 0] * step[:, 1] - ray[:, 1] * step[:, 0]
        part = (ray[:, 1] * start[:, 0] - ray[:, 0] * start[:, 1]) / cross
        hit = start + part[:, None] * step
        self.radius = np.einsum("ij,ij->i", hit, ray)
        self.girth = self.run[edge] + part * lengths[edge] - self.half
        unit = step / lengths[edge][:, None]
        self.normals = np.stack([unit[:, 1], -unit[:, 0]], axis=-1)
        self.slope = np.einsum("ij,ij->i", self.normals, ray)

    def index(self, y: Array, z: Array) -> NDArray[np.int64]:
        """Entries of the tables that directions from the axis fall to."""
        turn = np.arctan2(y, -z) * (TABLE / (2 * np.pi))
        return np.floor(turn).astype(np.int64) % TABLE

    def point(self, v: Array) -> Array:
        """(y, z) of the smooth lining at a girth."""
        run = np.asarray(v) + self.half
        return np.stack([np.interp(run, self.run, self.outline[:, 0]), np.interp(run, self.run, self.outline[:, 1])], axis=-1)

    def outward(self, v: Array) -> Array:
        """(y, z) of the unit normal away from the axis at a girth."""
        run = np.clip(np.asarray(v) + self.half, 0.0, self.run[-1] - 1e-9)
        edge = np.clip(np.searchsorted(self.run, run, side="right") - 1, 0, len(self.run) - 2)
        step = np.diff(self.outline, axis=0)[edge]
        unit = step / np.hypot(step[..., 0], step[..., 1])[..., None]
        return np.stack([unit[..., 1], -unit[..., 0]], axis=-1)


@dataclass(frozen=True)
class Tunnel:
    """An axis and its section."""

    axis: Axis
    section: Section

    def surface(self, u: Array, v: Array, depth: Array | float = 0.0) -> Array:
        """Site coordinates of points on the lining, or outside of it by a depth."""
        yz = self.section.point(v) + self.section.outward(v) * np.asarray(depth)[..., None]
        return self.axis.to_site(np.asarray(u), yz[..., 0], yz[..., 1])

    def outside(self, site: Array) -> Array:
        """Distance outside the lining as seen from the axis, negative inside."""
        _, y, z = self.axis.to_local(site)
        return np.hypot(y, z) - self.section.radius[self.section.index(y, z)]

    def locate(self, site: Array) -> tuple[Array, Array, Array]:
        """Chainage, girth and depth of points near the lining."""
        u, y, z = self.axis.to_local(site)
        entry = self.section.index(y, z)
        radius = self.section.radius[entry]
        angle = np.arctan2(y, -z) % (2 * np.pi)
        turned = (angle - (entry + 0.5) * (2 * np.pi / TABLE)) * radius
        girth = self.section.girth[entry] + turned / np.maximum(self.section.slope[entry], 0.2)
        return u, girth, (np.hypot(y, z) - radius) * self.section.slope[entry]

    def normals(self, site: Array) -> tuple[Array, Array, Array]:
        """Site vectors along the tunnel, along growing girth and outwards at points near the lining."""
        u, y, z = self.axis.to_local(site)
        flat = self.section.normals[self.section.index(y, z)]
        along, across = self.axis.along(u), self.axis.across(u)
        up = np.array([0.0, 0.0, 1.0])
        out = flat[:, :1] * across + flat[:, 1:] * up
        out = out - (self.axis.gradient * flat[:, 1:]) * along
        girthwise = -flat[:, 1:] * across + flat[:, :1] * up
        return along, girthwise, out / np.linalg.norm(out, axis=1)[:, None]
