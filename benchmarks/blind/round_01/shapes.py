"""Outlines as water, dirt and repairs draw them on a lining."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .canvas import Canvas, Shape
from .frames import Array

MARGIN = 0.35


@dataclass(frozen=True)
class Patch:
    """A spot with an irregular rim, which hangs down where the wall is steep enough for water to run.

    Attributes
    ----------
    u, v : float
        Its middle.
    ru, rv : float
        Half axes along the tunnel and along the girth, m.
    ragged : float
        How far the rim strays, as a part of the mean half axis.
    """

    u: float
    v: float
    ru: float
    rv: float
    ragged: float = 0.25

    def bounds(self) -> tuple[float, float, float, float]:
        reach = 2.3
        du, dv = reach * self.ru + MARGIN, reach * self.rv + MARGIN
        return self.u - du, self.u + du, self.v - dv, self.v + dv

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        mean = np.sqrt(self.ru * self.rv)
        warp_u, warp_v = (0.22 * mean * canvas.noise.field(1.3 * mean)(u, v) for _ in range(2))
        down = (v - self.v) * np.sign(self.v) / self.rv
        steep = np.clip(abs(self.v) - 1.0, 0.0, 1.0)
        narrow = 1 + 0.35 * steep * np.clip(down, -0.5, 1.2)
        tall = 1 + steep * np.where(down > 0, 0.3, -0.25)
        radius = np.hypot((u - self.u + warp_u) / self.ru * narrow, (v - self.v + warp_v) / self.rv / tall)
        coarse = canvas.noise.field(0.9 * mean)(u, v)
        fine = canvas.noise.field(0.2 * mean + 0.03)(u, v)
        stray = np.clip(self.ragged * (0.7 * coarse + 0.3 * fine), -0.5, 0.4)
        return (1 - radius + stray) * mean


@dataclass(frozen=True)
class Run:
    """A streak that water leaves as it runs down a wall.

    Attributes
    ----------
    u : float
        Chainage.
    top, bottom : float
        Girths, of one sign.
    above, below : float
        Widths at the top and at the bottom, m.
    wander : float
        How far it strays sideways, m.
    """

    u: float
    top: float
    bottom: float
    above: float
    below: float
    wander: float = 0.05

    def bounds(self) -> tuple[float, float, float, float]:
        reach = max(self.above, self.below) + 3 * self.wander + MARGIN
        low, high = sorted((self.top, self.bottom))
        return self.u - reach, self.u + reach, low - MARGIN, high + MARGIN

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        length = abs(self.bottom) - abs(self.top)
        down = v * np.sign(self.bottom) - abs(self.top)
        part = np.clip(down / length, 0.0, 1.0)
        sway = self.wander * canvas.noise.field(0.8)(np.zeros_like(v), v)
        pulse = 1 + 0.3 * canvas.noise.field(0.25, 3.0)(u, v)
        half = 0.5 * (self.above + (self.below - self.above) * part) * pulse
        field = half - np.abs(u - self.u - sway)
        return np.minimum(field, np.minimum(0.6 * down + 0.3 * half, 0.22 * (length - down)))


@dataclass(frozen=True)
class RingJoint:
    """Damp lips of a joint that runs round the tunnel, wider on one side here, on the other there.

    Attributes
    ----------
    u : float
        Chainage of the joint.
    start, end : float
        Girths between which it is damp.
    width : float
        Mean width of the band, m.
    """

    u: float
    start: float
    end: float
    width: float

    def bounds(self) -> tuple[float, float, float, float]:
        reach = 1.5 * self.width + MARGIN
        return self.u - reach, self.u + reach, self.start - MARGIN, self.end + MARGIN

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        swell = np.clip(1 + 0.45 * canvas.noise.field(0.5)(np.sign(u - self.u) * 3.0, v), 0.25, 2.0)
        grain = 0.12 * self.width * canvas.noise.field(0.07)(u, v)
        field = 0.5 * self.width * swell + grain - np.abs(u - self.u)
        return np.minimum(field, 0.6 * np.minimum(v - self.start, self.end - v))


@dataclass(frozen=True)
class LongJoint:
    """Water from a joint along the tunnel: a narrow band above it, tongues below it.

    Attributes
    ----------
    v : float
        Girth of the joint.
    start, end : float
        Chainages between which it leaks.
    above, below : float
        Width above the joint and mean length of the tongues below it, m.
    """

    v: float
    start: float
    end: float
    above: float
    below: float

    def bounds(self) -> tuple[float, float, float, float]:
        reach = 3.2 * self.below + self.above + MARGIN
        return self.start - MARGIN, self.end + MARGIN, self.v - reach, self.v + reach

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        down = (v - self.v) * np.sign(self.v)
        tongue = 0.7 * canvas.noise.field(0.4, 9.0)(u, v) + 0.35 * canvas.noise.field(0.16, 20.0)(u, v)
        inside = np.minimum(u - self.start, self.end - u)
        length = self.below * np.clip(0.7 + 0.8 * tongue, 0.1, 3.0) * np.clip(inside / 0.5, 0.1, 1.0)
        top = self.above * np.clip(1 + 0.5 * canvas.noise.field(0.3)(u, v), 0.3, 2.0)
        across = np.minimum(0.25 * (length - down), down + top)
        return np.minimum(across, 0.3 * inside)


@dataclass(frozen=True)
class Foot:
    """Damp or dirt that rises from the floor on one side (-1 left, +1 right) to an uneven height."""

    side: int
    start: float
    end: float
    height: float
    foot: float
    ragged: float = 0.3

    def bounds(self) -> tuple[float, float, float, float]:
        low, high = sorted((self.side * (self.foot - 2 * self.height - MARGIN), self.side * self.foot))
        return self.start - MARGIN, self.end + MARGIN, low, high

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        swell = canvas.noise.field(0.9)(u, v) + 0.3 * canvas.noise.field(0.12)(u, v)
        height = self.height * np.clip(1 + self.ragged * swell, 0.1, 1.9)
        inside = np.minimum(u - self.start, self.end - u) + 0.25 * self.height * canvas.noise.field(0.4)(u, v)
        taper = np.clip(inside / (0.8 * self.height), -0.5, 1.0)
        return 0.7 * (height * taper - (self.foot - self.side * v))


@dataclass(frozen=True)
class Slab:
    """A rectangle with straight edges: a repair, a plate, a stencilled mark."""

    u: float
    v: float
    du: float
    dv: float

    def bounds(self) -> tuple[float, float, float, float]:
        du, dv = self.du / 2 + 0.1, self.dv / 2 + 0.1
        return self.u - du, self.u + du, self.v - dv, self.v + dv

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        return np.minimum(self.du / 2 - np.abs(u - self.u), self.dv / 2 - np.abs(v - self.v))


@dataclass(frozen=True)
class Disc:
    """A circle: a plug, a tie hole, a packer."""

    u: float
    v: float
    radius: float

    def bounds(self) -> tuple[float, float, float, float]:
        reach = self.radius + 0.08
        return self.u - reach, self.u + reach, self.v - reach, self.v + reach

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        return self.radius - np.hypot(u - self.u, v - self.v)


@dataclass(frozen=True)
class Crack:
    """A narrow band along a wandering line from one point to another."""

    start: tuple[float, float]
    end: tuple[float, float]
    width: float
    wander: float = 0.08

    def bounds(self) -> tuple[float, float, float, float]:
        reach = 3 * self.wander + self.width + 0.2
        u0, u1 = sorted((self.start[0], self.end[0]))
        v0, v1 = sorted((self.start[1], self.end[1]))
        return u0 - reach, u1 + reach, v0 - reach, v1 + reach

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        way = np.subtract(self.end, self.start)
        length = float(np.hypot(*way))
        unit = way / length
        along = (u - self.start[0]) * unit[0] + (v - self.start[1]) * unit[1]
        aside = (v - self.start[1]) * unit[0] - (u - self.start[0]) * unit[1]
        line = canvas.noise.field(0.5)(along, np.zeros_like(along))
        field = 0.5 * self.width * (1 + 0.4 * canvas.noise.field(0.3)(u, v)) - np.abs(aside - self.wander * line)
        return np.minimum(field, np.minimum(along, length - along))


@dataclass(frozen=True)
class Joined:
    """Several shapes as one."""

    parts: tuple[Shape, ...]

    def bounds(self) -> tuple[float, float, float, float]:
        edges = np.array([part.bounds() for part in self.parts])
        return float(edges[:, 0].min()), float(edges[:, 1].max()), float(edges[:, 2].min()), float(edges[:, 3].max())

    def field(self, u: Array, v: Array, canvas: Canvas) -> Array:
        fields: Array = np.max([part.field(u, v, canvas) for part in self.parts], axis=0)
        return fields
