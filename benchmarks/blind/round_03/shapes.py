"""Outlines of wet places and stains, as fields that are positive inside.

Each shape lies about a place on the lining: ``x`` along the tunnel, ``y`` down the wall (away from the crown), in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .arrays import Floats, Rng, smooth_line, smooth_noise


class Shape(Protocol):
    """What can be laid on the lining."""

    def extent(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y."""

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        """Field over a grid (n × 1 and 1 × m)."""


def _noise(x: Floats, y: Floats, rng: Rng, scale: float) -> Floats:
    cell = float(x[1, 0] - x[0, 0])
    return smooth_noise(rng, (x.shape[0], y.shape[1]), (scale / cell, scale / cell))


@dataclass(frozen=True)
class Blob:
    """Ellipse with a ragged rim.

    Attributes
    ----------
    rx, ry : float
        Half axes.
    rough : float
        Raggedness, as a share of the smaller half axis.
    scale : float
        Length of the lobes of its rim.
    lean : float
        Metres along the tunnel per metre down the wall.
    """

    rx: float
    ry: float
    rough: float = 0.25
    scale: float = 0.3
    lean: float = 0.0

    def extent(self) -> tuple[float, float, float, float]:
        grow = 1.0 + 2.2 * self.rough
        x = grow * (self.rx + abs(self.lean) * self.ry)
        return -x, x, -grow * self.ry, grow * self.ry

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        away = np.hypot((x - self.lean * y) / self.rx, y / self.ry)
        return min(self.rx, self.ry) * (1.0 - away + self.rough * _noise(x, y, rng, self.scale))


@dataclass(frozen=True)
class Rect:
    """Rectangle with straight rims, such as a repair, a missing tile, a poster; ``rough`` in metres."""

    width: float
    height: float
    rough: float = 0.0
    turn: float = 0.0

    def extent(self) -> tuple[float, float, float, float]:
        reach = 0.5 * np.hypot(self.width, self.height) if self.turn else 0.0
        x, y = max(reach, self.width / 2) + 3 * self.rough, max(reach, self.height / 2) + 3 * self.rough
        return -x - 0.03, x + 0.03, -y - 0.03, y + 0.03

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        c, n = np.cos(self.turn), np.sin(self.turn)
        inside = np.minimum(self.width / 2 - np.abs(x * c + y * n), self.height / 2 - np.abs(y * c - x * n))
        return inside + (self.rough * _noise(x, y, rng, 0.1) if self.rough else 0.0)


@dataclass(frozen=True)
class Runs:
    """Water that comes out at the top and runs down in fingers.

    Attributes
    ----------
    length : float
        Of the longest finger.
    width : float
        Mean width of a finger.
    spread : float
        Length of the source along the tunnel; the fingers leave it somewhere.
    fingers : int
        Their number.
    head : float
        Half height of the wet source; 0 leaves it out.
    wander : float
        How far the fingers leave the plumb line, in metres.
    """

    length: float
    width: float
    spread: float = 0.0
    fingers: int = 1
    head: float = 0.1
    wander: float = 0.04

    def extent(self) -> tuple[float, float, float, float]:
        x = self.spread / 2 + 1.6 * self.width + 3 * self.wander
        return -x, x, -2.0 * self.head - 0.05, self.length + 0.1

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        down = y[0]
        cell = float(down[1] - down[0])
        best = np.full((x.shape[0], down.size), -np.inf)
        if self.head > 0:
            reach = self.spread / 2 + 0.7 * self.width
            ragged = 1.0 + 0.35 * _noise(x, y, rng, 0.2)
            level = 0.35 * self.head * smooth_line(rng, x.shape[0], 0.4 / cell)[:, None]
            best = self.head * (ragged - np.hypot(x / reach, (y - level) / self.head))
        starts = np.linspace(-0.5, 0.5, self.fingers) if self.fingers > 1 else np.zeros(1)
        for index, start in enumerate(starts):
            length = self.length * (1.0 if index == self.fingers // 2 else rng.uniform(0.2, 0.95))
            half = 0.5 * self.width * float(np.clip(rng.lognormal(-0.1, 0.45), 0.4, 1.6))
            middle = self.spread * (start + rng.uniform(-0.45, 0.45) / self.fingers)
            path = middle + self.wander * smooth_line(rng, down.size, 0.5 / cell)
            uneven = 1.0 + 0.3 * smooth_line(rng, down.size, 0.25 / cell)
            breadth = half * uneven * np.clip(1.35 - 0.8 * down / length, 0.3, 1.35)
            finger = np.minimum(breadth[None, :] - np.abs(x - path[None, :]), np.minimum(down + 0.03, length - down)[None, :])
            best = np.maximum(best, finger)
        return best + 0.12 * self.width * _noise(x, y, rng, 0.1)


@dataclass(frozen=True)
class Ring:
    """Wet joint across the tunnel: a strip down the wall, of changing width.

    Attributes
    ----------
    length : float
        Down the wall, from its place.
    half : float
        Mean half width.
    bulge : float
        Share by which the half width changes; above 0.6 the strip breaks up here and there.
    lean : float
        Metres along the tunnel per metre down.
    """

    length: float
    half: float
    bulge: float = 0.35
    lean: float = 0.0

    def extent(self) -> tuple[float, float, float, float]:
        x = self.half * (1.0 + 3.0 * self.bulge) + abs(self.lean) * self.length + 0.02
        return -x, x, -0.02, self.length + 0.02

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        down = y[0]
        cell = float(down[1] - down[0])
        left = self.half * (1.0 + self.bulge * smooth_line(rng, down.size, 0.4 / cell))
        right = self.half * (1.0 + self.bulge * smooth_line(rng, down.size, 0.4 / cell))
        away = x - self.lean * down[None, :]
        ends = np.minimum(down, self.length - down)[None, :]
        return np.minimum(np.minimum(left[None, :] + away, right[None, :] - away), ends)


@dataclass(frozen=True)
class Foot:
    """Rising damp or seepage at the foot of the wall; its place is the foot, it reaches up."""

    width: float
    height: float
    rough: float = 0.3
    scale: float = 0.5

    def extent(self) -> tuple[float, float, float, float]:
        return -self.width / 2 - 0.05, self.width / 2 + 0.05, -self.height * (1.0 + 2.5 * self.rough), 0.25

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        along = x[:, 0]
        cell = float(along[1] - along[0])
        bow = np.sqrt(np.clip(1.0 - (2.0 * along / self.width) ** 2, 0.0, 1.0))
        top = self.height * bow**0.7 * (1.0 + self.rough * smooth_line(rng, along.size, self.scale / cell))
        return np.minimum(top[:, None] + y, (self.width / 2 - np.abs(along))[:, None])


@dataclass(frozen=True)
class Line:
    """Strip along a crack or a rock joint: a polyline through points relative to its place."""

    points: tuple[tuple[float, float], ...]
    half: float
    rough: float = 0.4

    def extent(self) -> tuple[float, float, float, float]:
        xs, ys = zip(*self.points, strict=True)
        grow = self.half * (1.0 + 3.0 * self.rough) + 0.1
        return min(xs) - grow, max(xs) + grow, min(ys) - grow, max(ys) + grow

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        warp_x = x + 0.03 * _noise(x, y, rng, 0.3)
        warp_y = y + 0.03 * _noise(x, y, rng, 0.3)
        near = np.full(warp_x.shape, np.inf)
        for (x0, y0), (x1, y1) in zip(self.points[:-1], self.points[1:], strict=True):
            dx, dy = x1 - x0, y1 - y0
            share = np.clip(((warp_x - x0) * dx + (warp_y - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
            near = np.minimum(near, np.hypot(warp_x - x0 - share * dx, warp_y - y0 - share * dy))
        return self.half * (1.0 + self.rough * _noise(x, y, rng, 0.35)) - near


@dataclass(frozen=True)
class Joined:
    """Several shapes which are one, each at an offset (x, y)."""

    parts: tuple[tuple[float, float, Shape], ...]

    def extent(self) -> tuple[float, float, float, float]:
        boxes = [(dx, dy, part.extent()) for dx, dy, part in self.parts]
        return (
            min(dx + e[0] for dx, _, e in boxes),
            max(dx + e[1] for dx, _, e in boxes),
            min(dy + e[2] for _, dy, e in boxes),
            max(dy + e[3] for _, dy, e in boxes),
        )

    def field(self, x: Floats, y: Floats, rng: Rng) -> Floats:
        best = np.full((x.shape[0], y.shape[1]), -np.inf)
        for dx, dy, part in self.parts:
            best = np.maximum(best, part.field(x - dx, y - dy, rng))
        return best
