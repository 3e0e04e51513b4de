"""What is fixed to a lining or stands before it, as a beam meets it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from .section import Array, Point, Section


class Shape(Protocol):
    """Body that rays can meet."""

    def corners(self) -> list[Point]:
        """Points of the cross-section's plane about the body."""
        ...

    def meet(self, origin: Array, rays: Array) -> tuple[Array, Array]:
        """Distance along each ray, infinite where it misses, and the outward normals."""
        ...


@dataclass(frozen=True)
class Fitting:
    """A body with its surface.

    Attributes
    ----------
    shape : Shape
        Its form.
    level : float
        Reflectance, in dB on the scale of the lining.
    sheen : float
        Lobe about the normal.
    retro : bool
        Whether it throws light back where it came from.
    """

    shape: Shape
    level: float
    sheen: float = 0.0
    retro: bool = False


@dataclass(frozen=True)
class Cuboid:
    """Cuboid whose edges run along the tunnel, along ``across`` and square to both.

    Attributes
    ----------
    centre : tuple of float
        Chainage, offset, height.
    size : tuple of float
        Along the tunnel, along ``across`` and square to both.
    across : tuple of float
        Direction in the cross-section.
    """

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    across: Point = (1.0, 0.0)

    def corners(self) -> list[Point]:
        """Points of the cross-section's plane about the body."""
        (cy, cz), (ty, tz) = self.centre[1:], self.across
        halves = [(a * self.size[1] / 2, b * self.size[2] / 2) for a in (-1, 1) for b in (-1, 1)]
        return [(cy + a * ty - b * tz, cz + a * tz + b * ty) for a, b in halves]

    def meet(self, origin: Array, rays: Array) -> tuple[Array, Array]:
        """Distance along each ray, infinite where it misses, and the outward normals."""
        ty, tz = self.across
        axes = np.array([[1, 0, 0], [0, ty, tz], [0, -tz, ty]])
        start, way = (origin - np.array(self.centre)) @ axes.T, rays @ axes.T
        way = np.where(np.abs(way) < 1e-12, 1e-12, way)
        half = np.array(self.size) / 2
        near, far = (-np.sign(way) * half - start) / way, (np.sign(way) * half - start) / way
        side = np.argmax(near, axis=1)
        enter = near[np.arange(len(rays)), side]
        hit = (enter < far.min(axis=1)) & (enter > 0)
        normals = -np.sign(way[np.arange(len(rays)), side])[:, None] * axes[side]
        return np.where(hit, enter, np.inf), normals


@dataclass(frozen=True)
class Rod:
    """Round bar, pipe or rail between two points.

    Attributes
    ----------
    start, stop : tuple of float
        Chainage, offset, height of its ends.
    radius : float
        In metres.
    """

    start: tuple[float, float, float]
    stop: tuple[float, float, float]
    radius: float

    def corners(self) -> list[Point]:
        """Points of the cross-section's plane about the body."""
        return _square(self.start[1:], self.radius) + _square(self.stop[1:], self.radius)

    def meet(self, origin: Array, rays: Array) -> tuple[Array, Array]:
        """Distance along each ray, infinite where it misses, and the outward normals."""
        begin = np.array(self.start)
        axis = np.array(self.stop) - begin
        length = float(np.linalg.norm(axis))
        axis /= length
        offset = origin - begin
        flat_rays = rays - (rays @ axis)[:, None] * axis
        flat_offset = offset - (offset @ axis)[:, None] * axis
        distance = _circle(flat_offset, flat_rays, self.radius)
        at = np.where(np.isfinite(distance), distance, 0.0)
        along = (offset + at[:, None] * rays) @ axis
        normals = (flat_offset + at[:, None] * flat_rays) / self.radius
        return np.where((along >= 0) & (along <= length), distance, np.inf), normals


@dataclass(frozen=True)
class Cable:
    """Cable along the tunnel that sags between its hangers.

    Attributes
    ----------
    start, stop : float
        Chainages of its ends.
    offset, height : float
        Where its hangers hold it.
    radius : float
        In metres.
    spacing : float
        Of the hangers, in metres.
    sag : float
        In metres.
    """

    start: float
    stop: float
    offset: float
    height: float
    radius: float
    spacing: float = 1.5
    sag: float = 0.0

    def corners(self) -> list[Point]:
        """Points of the cross-section's plane about the body."""
        low = _square((self.offset, self.height - self.sag), self.radius)
        return low + _square((self.offset, self.height), self.radius)

    def meet(self, origin: Array, rays: Array) -> tuple[Array, Array]:
        """Distance along each ray, infinite where it misses, and the outward normals."""
        flat = np.maximum((rays[:, 1:] ** 2).sum(axis=1), 1e-12)
        drop = np.zeros(len(rays))
        # The height of the cable depends on where the ray passes it, and that hardly on the height: two rounds settle it.
        for _ in range(2):
            y, z = self.offset - origin[:, 1], self.height - drop - origin[:, 2]
            passed = origin[:, 0] + (y * rays[:, 1] + z * rays[:, 2]) / flat * rays[:, 0]
            phase = np.mod(passed - self.start, self.spacing) / self.spacing
            drop = 4 * self.sag * phase * (1 - phase)
        offset = np.column_stack([np.zeros(len(rays)), origin[:, 1] - self.offset, origin[:, 2] - self.height + drop])
        flat_rays = rays * np.array([0.0, 1.0, 1.0])
        distance = _circle(offset, flat_rays, self.radius)
        at = np.where(np.isfinite(distance), distance, 0.0)
        u = origin[:, 0] + at * rays[:, 0]
        normals = (offset + at[:, None] * flat_rays) / self.radius
        return np.where((u >= self.start) & (u <= self.stop), distance, np.inf), normals


def _square(centre: Iterable[float], half: float) -> list[Point]:
    y, z = centre
    return [(y + a * half, z + b * half) for a in (-1, 1) for b in (-1, 1)]


def _circle(offset: Array, rays: Array, radius: float) -> Array:
    """Distance to a cylinder of vectors that are square to its axis."""
    a = np.maximum((rays**2).sum(axis=1), 1e-12)
    b = (offset * rays).sum(axis=1)
    root = b * b - a * ((offset**2).sum(axis=1) - radius**2)
    distance = (-b - np.sqrt(np.maximum(root, 0))) / a
    return np.where((root > 0) & (distance > 0), distance, np.inf)


def mounted(section: Section, u: float, s: float, size: tuple[float, float, float], gap: float = 0.0) -> Cuboid:
    """Cuboid on the lining.

    Parameters
    ----------
    section : Section
        The tunnel's cross-section.
    u, s : float
        Chainage and place on the girth of its middle.
    size : tuple of float
        Along the tunnel, along the girth, and from the lining.
    gap : float
        Between it and the lining, in metres.

    Returns
    -------
    Cuboid
    """
    chord = section.segment(s)
    ty, tz = section.tangents[chord]
    ny, nz = section.normals[chord]
    y, z = section.locate(s)
    reach = gap + size[2] / 2
    return Cuboid((u, float(y + reach * ny), float(z + reach * nz)), size, (float(ty), float(tz)))


def before(section: Section, s: float, gap: float) -> Point:
    """Offset and height of a point before the lining."""
    y, z = section.locate(s) + gap * section.normals[section.segment(s)]
    return float(y), float(z)


def hung(section: Section, u0: float, u1: float, s: float, radius: float, gap: float, spacing: float, sag: float) -> Cable:
    """Cable or pipe along the tunnel, its surface a gap before the lining."""
    y, z = before(section, s, gap + radius)
    return Cable(u0, u1, y, z, radius, spacing, sag)


def upright(section: Section, u: float, s0: float, s1: float, radius: float, gap: float = 0.02) -> list[Rod]:
    """Pipe or cable that follows the girth from one place to another, in straight pieces."""
    stops = np.linspace(s0, s1, max(2, round(abs(s1 - s0) / 0.5) + 1))
    points = [before(section, float(s), gap + radius) for s in stops]
    return [Rod((u, *a), (u, *b), radius) for a, b in pairwise(points)]
