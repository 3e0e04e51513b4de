"""Bodies before the lining, as distances from their surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Place:
    """Points in tunnel coordinates, with girth t and depth d from the lining."""

    s: FloatArray
    u: FloatArray
    v: FloatArray
    t: FloatArray
    d: FloatArray

    def part(self, index: IntArray) -> Place:
        """Some of the points."""
        return Place(self.s[index], self.u[index], self.v[index], self.t[index], self.d[index])


class Solid(Protocol):
    """A body: reflectance in dB, how far it stands before the lining, and its distance."""

    @property
    def albedo(self) -> float: ...

    @property
    def reach(self) -> float: ...

    def distance(self, p: Place) -> FloatArray: ...


def _box(*gaps: FloatArray) -> FloatArray:
    """Distance from a box, given how far one is beyond each pair of faces."""
    outside = np.zeros_like(gaps[0])
    for gap in gaps:
        outside += np.maximum(gap, 0) ** 2
    inside = gaps[0]
    for gap in gaps[1:]:
        inside = np.maximum(inside, gap)
    return np.sqrt(outside) + np.minimum(inside, 0)


def _fold(s: FloatArray, start: float, every: float, count: int) -> FloatArray:
    """Chainage relative to the nearest of `count` equal bodies."""
    if count == 1:
        return s - start
    return s - start - every * np.clip(np.rint((s - start) / every), 0, count - 1)


@dataclass(frozen=True)
class Cable:
    """Cable or pipe along the lining, that sags down by `sag` between hooks `span` apart."""

    t: float
    d: float
    radius: float
    albedo: float
    sag: float = 0.0
    span: float = 1.0
    start: float = -50.0
    end: float = 90.0
    phase: float = 0.0

    @property
    def reach(self) -> float:
        """Depth of its inner side."""
        return self.d + self.radius

    def distance(self, p: Place) -> FloatArray:
        """Distance from its surface."""
        x = (p.s / self.span + self.phase) % 1
        middle = self.t + math.copysign(4 * self.sag, self.t) * x * (1 - x)
        across = np.hypot(p.t - middle, p.d - self.d) - self.radius
        return np.maximum(across, np.abs(p.s - (self.start + self.end) / 2) - (self.end - self.start) / 2)


@dataclass(frozen=True)
class Downpipe:
    """Pipe around the lining at a chainage, between two girths."""

    s: float
    t0: float
    t1: float
    d: float
    radius: float
    albedo: float

    @property
    def reach(self) -> float:
        """Depth of its inner side."""
        return self.d + self.radius

    def distance(self, p: Place) -> FloatArray:
        """Distance from its surface."""
        across = np.hypot(p.s - self.s, p.d - self.d) - self.radius
        return np.maximum(across, np.abs(p.t - (self.t0 + self.t1) / 2) - abs(self.t1 - self.t0) / 2)


@dataclass(frozen=True)
class WallBox:
    """Box on the lining (lamp, cabinet, plate, bracket), one or a row of them."""

    s: float
    t: float
    size_s: float
    size_t: float
    d0: float
    d1: float
    albedo: float
    every: float = 1.0
    count: int = 1
    corrugation: float = 0.0

    @property
    def reach(self) -> float:
        """Depth of its inner side."""
        return self.d1 + self.corrugation

    def distance(self, p: Place) -> FloatArray:
        """Distance from its surface."""
        s = _fold(p.s, self.s, self.every, self.count)
        depth = p.d - (self.d0 + self.d1) / 2
        if self.corrugation:
            depth = depth - self.corrugation * np.sin(2 * np.pi * p.s / 0.2)
        gaps = (
            np.abs(s) - self.size_s / 2,
            np.abs(p.t - self.t) - self.size_t / 2,
            np.abs(depth) - (self.d1 - self.d0) / 2,
        )
        return _box(*gaps)


@dataclass(frozen=True)
class Wire:
    """Wire or bar along the tunnel in free space; `stagger` swings it to either side, `sag` lets it hang."""

    u: float
    v: float
    radius: float
    albedo: float
    stagger: float = 0.0
    sag: float = 0.0
    span: float = 30.0

    @property
    def reach(self) -> float:
        """Does not lean on the lining."""
        return math.inf

    def distance(self, p: Place) -> FloatArray:
        """Distance from its surface."""
        x = (p.s / self.span) % 1
        u = self.u + self.stagger * (4 * np.abs(x - 0.5) - 1)
        v = self.v - 4 * self.sag * x * (1 - x)
        return np.hypot(p.u - u, p.v - v) - self.radius


@dataclass(frozen=True)
class Beam:
    """Upright box in free space (rail, trough, dropper), along the whole tunnel or one of a row."""

    u: float
    v: float
    size_u: float
    size_v: float
    albedo: float
    s: float = 0.0
    size_s: float = 1000.0
    every: float = 1.0
    count: int = 1

    @property
    def reach(self) -> float:
        """Does not lean on the lining."""
        return math.inf

    def distance(self, p: Place) -> FloatArray:
        """Distance from its surface."""
        s = _fold(p.s, self.s, self.every, self.count)
        return _box(np.abs(s) - self.size_s / 2, np.abs(p.u - self.u) - self.size_u / 2, np.abs(p.v - self.v) - self.size_v / 2)


def rails(track: float) -> tuple[Solid, ...]:
    """Both rails of a track whose middle lies at offset `track`."""
    return tuple(Beam(track + side * 0.753, 0.085, 0.07, 0.17, -6.0) for side in (-1, 1))
