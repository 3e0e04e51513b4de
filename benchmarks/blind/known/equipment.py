"""Things before the wall that give echoes of their own and hide what is behind them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from benchmarks.blind.known.rays import Hits, Index, Rays
from benchmarks.blind.known.section import Array, Section


@dataclass
class Meeting:
    """Rays that meet a thing: which, at what distance, cosine of incidence, share of the beam that it takes."""

    index: Index
    t: Array
    cos: Array
    share: Array


class Item(Protocol):
    """A thing; ``colour`` is its reflectance in dB."""

    @property
    def colour(self) -> float: ...

    def meet(self, rays: Rays, wall: Hits, beam: Array) -> Meeting:
        """Find the rays that meet it; ``beam`` is the beam's radius at the wall."""
        ...


@dataclass(frozen=True)
class Tube:
    """A cable or a pipe along the tunnel, its middle at (y, z), sagging between supports."""

    y: float
    z: float
    radius: float
    colour: float
    start: float
    end: float
    sag: float = 0.0
    span: float = 1.0

    def meet(self, rays: Rays, wall: Hits, beam: Array) -> Meeting:
        """Closest approach in the plane across the tunnel; the sag is found by iteration."""
        index = rays.window(self.y, self.z, self.radius + self.sag + 0.01)
        origin, direction = rays.take(index)
        square = direction[1] ** 2 + direction[2] ** 2
        dy, dz = self.y - origin[1], self.z - origin[2]
        t = (dy * direction[1] + dz * direction[2]) / square
        for _ in range(2 if self.sag else 0):
            part = np.mod((origin[0] + t * direction[0]) / self.span, 1.0)
            dz = self.z - 4.0 * self.sag * part * (1.0 - part) - origin[2]
            t = (dy * direction[1] + dz * direction[2]) / square
        miss = np.abs(dy * direction[2] - dz * direction[1]) / np.sqrt(square)
        u = origin[0] + t * direction[0]
        spot = beam[index]
        near = (miss < self.radius + spot) & (u > self.start) & (u < self.end)
        half = np.sqrt(np.clip(self.radius**2 - miss**2, 0.0, None))
        cos = np.clip(half / self.radius * np.sqrt(square), 0.12, 1.0)
        share = np.clip((self.radius + spot - miss) / (2.0 * spot), 0.0, 1.0)
        t = t - half / np.sqrt(square)
        return Meeting(index[near], t[near], cos[near], share[near])


@dataclass(frozen=True)
class Boxes:
    """Equal boxes along the tunnel on a wall: lamps, brackets, or (a single long one) ducts, kerbs and rails.

    Attributes
    ----------
    y, z, ty, tz : float
        Foot of the frame on the wall and unit tangent there; the normal is ``(-tz, ty)``.
    half, low, high : float
        Half extent along the tangent; extent along the normal.
    first, half_length, pitch, count
        Chainage of the first box's middle, half its length, distance of the next, number.
    """

    y: float
    z: float
    ty: float
    tz: float
    half: float
    low: float
    high: float
    colour: float
    first: float
    half_length: float
    pitch: float = 1.0
    count: int = 1

    def meet(self, rays: Rays, wall: Hits, beam: Array) -> Meeting:
        """Slab test across the tunnel, then for the two boxes that the ray may meet along it."""
        middle = 0.5 * (self.low + self.high)
        reach = float(np.hypot(self.half, 0.5 * (self.high - self.low))) + 0.01
        index = rays.window(self.y - self.tz * middle, self.z + self.ty * middle, reach)
        origin, direction = rays.take(index)
        spot = beam[index]
        oy, oz = origin[1] - self.y, origin[2] - self.z
        across = oy * self.ty + oz * self.tz
        off = -oy * self.tz + oz * self.ty
        d_across = _not_zero(direction[1] * self.ty + direction[2] * self.tz)
        d_off = _not_zero(-direction[1] * self.tz + direction[2] * self.ty)
        d_u = _not_zero(direction[0])
        side_in, side_out = _slab(across, d_across, -self.half - spot, self.half + spot)
        face_in, face_out = _slab(off, d_off, np.full_like(off, self.low), np.full_like(off, self.high))
        enter, leave = np.maximum(side_in, face_in), np.minimum(side_out, face_out)
        t = np.full(len(index), np.inf)
        end_in = np.full(len(index), np.inf)
        centre = np.zeros(len(index))
        length = self.half_length + spot
        for at in (enter, leave):
            number = np.clip(np.rint((origin[0] + at * d_u - self.first) / self.pitch), 0, self.count - 1)
            here = self.first + number * self.pitch
            first, last = _slab(origin[0] - here, d_u, -length, length)
            entry = np.maximum(enter, first)
            better = (entry < np.minimum(leave, last)) & (entry > 0.3) & (entry < t)
            t = np.where(better, entry, t)
            end_in = np.where(better, first, end_in)
            centre = np.where(better, here, centre)
        met = np.isfinite(t)
        cos = np.where(t == end_in, np.abs(d_u), np.where(t == side_in, np.abs(d_across), np.abs(d_off)))
        t_met = np.where(met, t, 0.0)
        rest = np.minimum(
            self.half + spot - np.abs(across + t_met * d_across), length - np.abs(origin[0] + t_met * d_u - centre)
        )
        share = np.where(t == face_in, np.clip(rest / (2.0 * spot), 0.0, 1.0), 1.0)
        return Meeting(index[met], t[met], np.clip(cos[met], 0.05, 1.0), share[met])


@dataclass(frozen=True)
class Hoop:
    """A flat band around the tunnel over the lining, between two distances off the wall."""

    first: float
    last: float
    low: float
    high: float
    colour: float
    lining: float

    def meet(self, rays: Rays, wall: Hits, beam: Array) -> Meeting:
        """Slab test in chainage and distance from the wall, the wall taken as flat there."""
        reach = 3.0 + self.high
        index = np.flatnonzero((wall.u > self.first - reach) & (wall.u < self.last + reach) & (wall.s < self.lining))
        cos = np.maximum(wall.cos[index], 0.03)
        t_wall, spot = wall.t[index], beam[index]
        face_in, face_out = t_wall - self.high / cos, t_wall - self.low / cos
        d_u = _not_zero(rays.direction[index, 0])
        side_in, side_out = _slab(rays.origin[index, 0], d_u, self.first - spot, self.last + spot)
        t = np.maximum(face_in, side_in)
        met = t < np.minimum(face_out, side_out)
        u = rays.origin[index, 0] + t * d_u
        rest = np.minimum(u - self.first, self.last - u) + spot
        share = np.where(t == face_in, np.clip(rest / (2.0 * spot), 0.0, 1.0), 1.0)
        cos = np.where(t == face_in, cos, np.abs(d_u))
        return Meeting(index[met], t[met], np.clip(cos[met], 0.05, 1.0), share[met])


def _not_zero(value: Array) -> Array:
    safe: Array = np.where(np.abs(value) < 1e-9, 1e-9, value)
    return safe


def _slab(start: Array, slope: Array, low: Array, high: Array) -> tuple[Array, Array]:
    one, two = (low - start) / slope, (high - start) / slope
    return np.minimum(one, two), np.maximum(one, two)


def frame(section: Section, s: float) -> tuple[float, float, float, float]:
    """Point and tangent of the outline."""
    where = np.array([s])
    y, z = section.at(where)
    ty, tz = section.tangent(where)
    return float(y[0]), float(z[0]), float(ty[0]), float(tz[0])


def off_wall(section: Section, s: float, distance: float) -> tuple[float, float]:
    """A point some distance off the wall."""
    y, z, ty, tz = frame(section, s)
    return y - distance * tz, z + distance * ty


def boxes(
    section: Section,
    s: float,
    half: float,
    off: tuple[float, float],
    colour: float,
    along: tuple[float, float],
    row: tuple[float, int] = (1.0, 1),
) -> Boxes:
    """Boxes on the wall at s; ``along`` is the middle and half the length of the first, ``row`` pitch and count."""
    y, z, ty, tz = frame(section, s)
    return Boxes(y, z, ty, tz, half, off[0], off[1], colour, along[0], along[1], row[0], row[1])


def tube(
    section: Section, s: float, gap: float, radius: float, colour: float, along: tuple[float, float], sag: float = 0.0
) -> Tube:
    """A cable or pipe whose back is ``gap`` off the wall at s, from and to a chainage."""
    y, z = off_wall(section, s, gap + radius)
    return Tube(y, z, radius, colour, along[0], along[1], sag)
