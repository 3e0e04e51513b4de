"""Axis, cross-sections and the distance map that rays are traced in.

Lengths in metres. A point in the tunnel is (s, u, v): chainage, to the right of the axis, up from rail or road level. On the
lining it is (s, l): l is measured along the section from the crown, positive on the right.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.floating[Any]]
STEP = 0.002
CELL = 0.01
LINING, FLOOR = 0, 1


@dataclass(frozen=True)
class Axis:
    """A straight line or a circular arc in plan (radius > 0: to the right), with a slope."""

    east: float
    north: float
    height: float
    heading: float
    radius: float = np.inf
    slope: float = 0.0

    def place(self, s: Array, u: Array, v: Array) -> Array:
        """Give x (ahead), y (left), z of points in the tunnel."""
        if np.isinf(self.radius):
            x, y = s + 0.0 * u, -u + 0.0 * s
        else:
            phi, rho = s / self.radius, self.radius - u
            x, y = rho * np.sin(phi), -self.radius + rho * np.cos(phi)
        return np.stack([x, y, v + self.slope * s], axis=-1)

    def locate(self, xyz: Array) -> tuple[Array, Array, Array]:
        """Give (s, u, v) of points x, y, z."""
        x, y, z = xyz[..., 0], xyz[..., 1], xyz[..., 2]
        if np.isinf(self.radius):
            return x, -y, z - self.slope * x
        sign = np.sign(self.radius)
        s = self.radius * np.arctan2(sign * x, sign * (y + self.radius))
        return s, self.radius - sign * np.hypot(x, y + self.radius), z - self.slope * s

    def frame(self, s: Array) -> tuple[Array, Array]:
        """Give the directions ahead and to the right at a chainage."""
        phi = np.asarray(s) / self.radius
        zero = np.zeros_like(phi)
        return np.stack([np.cos(phi), -np.sin(phi), zero], -1), np.stack([-np.sin(phi), -np.cos(phi), zero], -1)

    def to_map(self, xyz: Array) -> Array:
        """Turn x, y, z into coordinates on the map."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        east = self.east + c * xyz[..., 0] - s * xyz[..., 1]
        return np.stack([east, self.north + s * xyz[..., 0] + c * xyz[..., 1], self.height + xyz[..., 2]], axis=-1)


@dataclass(frozen=True)
class Material:
    """What reflects: 10 lg of its diffuse reflectance, roughness (rad) and strength of its gloss."""

    level: float
    rough: float = 0.3
    gloss: float = 0.0


@dataclass(frozen=True)
class Tube:
    """A cable or a pipe along the tunnel."""

    u: float
    v: float
    r: float
    material: Material

    def distance(self, u: Array, v: Array) -> Array:
        """Distance of points in the section from its surface."""
        return np.hypot(u - round(self.u / CELL) * CELL, v - round(self.v / CELL) * CELL) - self.r


@dataclass(frozen=True)
class Bar:
    """A rail, a duct, a trough along the tunnel: a rectangle turned by an angle."""

    u: float
    v: float
    width: float
    height: float
    material: Material
    angle: float = 0.0

    def distance(self, u: Array, v: Array) -> Array:
        """Distance of points in the section from its surface."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        a = np.abs(c * (u - self.u) + s * (v - self.v)) - self.width / 2
        b = np.abs(-s * (u - self.u) + c * (v - self.v)) - self.height / 2
        return np.hypot(np.maximum(a, 0), np.maximum(b, 0)) + np.minimum(np.maximum(a, b), 0)


def arcs(crown: float, parts: list[tuple[float, float]], foot: float) -> Array:
    """Right half of a section: arcs (radius, degrees) from the crown, tangent to one another, then straight to the foot."""
    turns = [np.full(max(int(r * np.radians(a) / STEP), 1), STEP / r) for r, a in parts]
    turn = np.concatenate([*turns, np.zeros(int(8 / STEP))])
    angle = np.cumsum(turn) - turn / 2
    u, v = np.cumsum(STEP * np.cos(angle)), crown - np.cumsum(STEP * np.sin(angle))
    end = int(np.argmax(v < foot))
    return np.stack([np.r_[0.0, u[:end]], np.r_[crown, v[:end]]], axis=1)


def box(width: float, height: float, haunch: float, foot: float = 0.0) -> Array:
    """Right half of a frame's section, with a haunch in the corner."""
    corners = np.array([[0, height], [width / 2 - haunch, height], [width / 2, height - haunch], [width / 2, foot]])
    return _densify(corners)


def _densify(line: Array) -> Array:
    length = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
    at = np.linspace(0, length[-1], int(length[-1] / STEP) + 2)
    return np.stack([np.interp(at, length, line[:, 0]), np.interp(at, length, line[:, 1])], axis=1)


@dataclass(frozen=True)
class Section:
    """Lining (both halves alike) and floor (corners between the feet, from right to left)."""

    half: Array
    floor: list[tuple[float, float]] = field(default_factory=list)

    @cached_property
    def lining(self) -> Array:
        """Points u, v from the left foot over the crown to the right foot."""
        return np.concatenate([self.half[:0:-1] * [-1, 1], self.half])

    @cached_property
    def lengths(self) -> Array:
        """Coordinate l of these points."""
        l = np.r_[0.0, np.cumsum(np.hypot(*np.diff(self.half, axis=0).T))]  # noqa: E741
        return np.r_[-l[:0:-1], l]

    @property
    def end(self) -> float:
        """Length from the crown to a foot."""
        return float(self.lengths[-1])

    @cached_property
    def normals(self) -> Array:
        """Directions u, v inwards at these points, smoothed over 4 cm."""
        wide = 10
        padded = np.pad(self.lining, ((wide, wide), (0, 0)), mode="edge")
        t = padded[2 * wide :] - padded[: -2 * wide]
        t /= np.hypot(t[:, 0], t[:, 1])[:, None]
        return np.stack([t[:, 1], -t[:, 0]], axis=1)

    def at(self, l: Array | float) -> tuple[Array, Array]:  # noqa: E741
        """Give point and inward normal at l."""
        p = [np.interp(l, self.lengths, self.lining[:, k]) for k in (0, 1)]
        n = [np.interp(l, self.lengths, self.normals[:, k]) for k in (0, 1)]
        return np.stack(p, axis=-1), np.stack(n, axis=-1)

    def l_at(self, side: int, v: float) -> float:
        """Give l on a side (-1, 1) at a height, the lowest such place."""
        above = np.flatnonzero(self.half[:, 1] >= v)
        return float(side * self.lengths[len(self.half) - 1 + above[-1]])

    def left(self, v: float) -> float:
        """Give l on the left at a height."""
        return self.l_at(-1, v)

    def right(self, v: float) -> float:
        """Give l on the right at a height."""
        return self.l_at(1, v)

    @cached_property
    def centre(self) -> float:
        """Height from which all of the lining is seen."""
        return float(self.half[0, 1] + self.half[-1, 1]) / 2

    @cached_property
    def _polar(self) -> tuple[Array, Array]:
        angle = np.arctan2(self.lining[:, 0], self.lining[:, 1] - self.centre)
        return np.maximum.accumulate(angle), self.lengths

    def project(self, u: Array, v: Array) -> Array:
        """Coordinate l of points on the lining."""
        return np.interp(np.arctan2(u, v - self.centre), *self._polar)

    def off_wall(self, side: int, height: float, gap: float) -> tuple[float, float]:
        """Give u, v at a distance before the wall."""
        p, n = self.at(self.l_at(side, height))
        return float(p[0] + gap * n[0]), float(p[1] + gap * n[1])


class DistanceMap:
    """Distance to the nearest surface in the section, and which it is."""

    def __init__(self, section: Section, along: list[Tube | Bar]) -> None:
        lining = section.lining
        floor = _densify(np.array([lining[-1], *section.floor, lining[0]]))
        self.u0, self.v0 = lining[:, 0].min() - 0.3, min(floor[:, 1].min(), lining[:, 1].min()) - 0.3
        self.u0, self.v0 = np.floor(self.u0 / CELL) * CELL, np.floor(self.v0 / CELL) * CELL
        nu = int((lining[:, 0].max() + 0.3 - self.u0) / CELL) + 1
        nv = int((lining[:, 1].max() + 0.3 - self.v0) / CELL) + 1
        u, v = np.meshgrid(self.u0 + CELL * np.arange(nu), self.v0 + CELL * np.arange(nv), indexing="ij")
        nodes = np.stack([u.ravel(), v.ravel()], axis=1)
        wall, ground = cKDTree(lining).query(nodes)[0], cKDTree(floor).query(nodes)[0]
        area = shapely.Polygon(np.concatenate([lining, floor[1:-1]]))
        shapely.prepare(area)
        sign = np.where(shapely.contains_xy(area, nodes[:, 0], nodes[:, 1]), 1.0, -1.0)
        best, what = sign * np.minimum(wall, ground), np.where(wall <= ground, LINING, FLOOR)
        for k, item in enumerate(along):
            d = item.distance(nodes[:, 0], nodes[:, 1])
            what = np.where(d < best, FLOOR + 1 + k, what)
            best = np.minimum(best, d)
        self.shape = (nu, nv)
        self.distance = best.astype(np.float32)
        self.what = what.astype(np.int16)

    def __call__(self, u: Array, v: Array) -> Array:
        """Distance at points, between nodes linearly."""
        fu, fv = (u - self.u0) / CELL, (v - self.v0) / CELL
        iu = np.clip(fu.astype(np.int64), 0, self.shape[0] - 2)
        iv = np.clip(fv.astype(np.int64), 0, self.shape[1] - 2)
        fu, fv = np.clip(fu - iu, 0, 1), np.clip(fv - iv, 0, 1)
        k, d, n = iu * self.shape[1] + iv, self.distance, self.shape[1]
        low = d[k] * (1 - fv) + d[k + 1] * fv
        return low * (1 - fu) + (d[k + n] * (1 - fv) + d[k + n + 1] * fv) * fu

    def nearest(self, u: Array, v: Array) -> NDArray[np.int16]:
        """Which surface is nearest."""
        iu = np.clip(np.rint((u - self.u0) / CELL).astype(np.int64), 0, self.shape[0] - 1)
        iv = np.clip(np.rint((v - self.v0) / CELL).astype(np.int64), 0, self.shape[1] - 1)
        return self.what[iu * self.shape[1] + iv]

    def gradient(self, u: Array, v: Array) -> tuple[Array, Array]:
        """Direction away from the nearest surface."""
        e = 0.006
        gu, gv = self(u + e, v) - self(u - e, v), self(u, v + e) - self(u, v - e)
        norm = np.maximum(np.hypot(gu, gv), 1e-9)
        return gu / norm, gv / norm
