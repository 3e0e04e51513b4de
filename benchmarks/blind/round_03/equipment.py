"""Equipment before the lining: what a ray meets on its last metres, in local coordinates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .arrays import Floats, Ints, Mask


@dataclass(frozen=True)
class Beams:
    """Rays as straight lines in local coordinates about the points where they would meet the lining.

    Attributes
    ----------
    s, u, v : ndarray
        Where they meet the lining.
    ds, du, dv : ndarray
        Unit direction there.
    reach : ndarray
        Distance from scanner to lining; ``t`` is 0 at the lining and ``-reach`` at the scanner.
    arc, d_arc, cosine : ndarray
        Place on the section, direction along it, cosine of the incidence.
    radius : ndarray
        Half width of the beam.
    """

    s: Floats
    u: Floats
    v: Floats
    ds: Floats
    du: Floats
    dv: Floats
    reach: Floats
    arc: Floats
    d_arc: Floats
    cosine: Floats
    radius: Floats


@dataclass(frozen=True)
class Touch:
    """Rays that meet a thing: their index, where, what share of the beam, at what cosine."""

    index: Ints
    t: Floats
    share: Floats
    cosine: Floats


class Fixture(Protocol):
    """Anything before the wall."""

    @property
    def tone(self) -> float:
        """Reflectance in dB."""

    @property
    def gloss(self) -> float:
        """Specular lobe."""

    def touch(self, beams: Beams) -> Touch:
        """Rays that meet it."""


@dataclass(frozen=True)
class Series:
    """Stretches along the tunnel that a thing takes up: once, or again every ``period``."""

    start: float
    length: float
    period: float = 0.0
    count: int = 1

    def slab(self, s: Floats, ds: Floats, near: Floats) -> tuple[Floats, Floats]:
        """Interval of t within the stretch that lies nearest to chainage ``near``."""
        start = np.full(s.shape, self.start)
        if self.period:
            number = np.rint((near - self.start - self.length / 2) / self.period)
            start += self.period * np.clip(number, 0, self.count - 1)
        safe = np.where(np.abs(ds) < 1e-9, 1e-9, ds)
        one, two = (start - s) / safe, (start + self.length - s) / safe
        return np.minimum(one, two), np.maximum(one, two)


def _crossing(beams: Beams, u: float, v: float, reach: float) -> tuple[Ints, Floats, Floats, Floats]:
    """Rays that pass a place of the section: index, signed distance, t of the nearest point, speed in the section."""
    speed = np.hypot(beams.du, beams.dv)
    safe = np.maximum(speed, 1e-6)
    cross = ((u - beams.u) * beams.dv - (v - beams.v) * beams.du) / safe
    nearest = ((u - beams.u) * beams.du + (v - beams.v) * beams.dv) / safe**2
    index = np.flatnonzero((np.abs(cross) < reach) & (nearest < reach) & (nearest > -beams.reach))
    return index, cross[index], nearest[index], safe[index]


def _share(depth: Floats, size: float, radius: Floats) -> Floats:
    """Share of a beam that meets a thing of full width ``size``, into which its middle comes by ``depth``."""
    return np.clip((depth + radius) / (2.0 * radius), 0.0, np.minimum(1.0, size / (2.0 * radius)))


@dataclass(frozen=True)
class Tube:
    """Cable, pipe, duct or jet fan: a cylinder along the tunnel.

    ``sag`` is how far a cable hangs through between brackets ``bay`` apart.
    """

    u: float
    v: float
    radius: float
    series: Series
    tone: float = -3.0
    gloss: float = 0.0
    sag: float = 0.0
    bay: float = 1.5

    def touch(self, beams: Beams) -> Touch:
        index, cross, nearest, speed = _crossing(beams, self.u, self.v - self.sag / 2, self.radius + self.sag + 0.02)
        s, ds = beams.s[index], beams.ds[index]
        at = s + ds * nearest
        if self.sag:
            part = np.mod(at - self.series.start, self.bay) / self.bay
            low = 4.0 * self.sag * part * (1.0 - part) - self.sag / 2
            cross = cross + low * beams.du[index] / speed
            nearest = nearest - low * beams.dv[index] / speed**2
        radius = beams.radius[index]
        half = np.sqrt(np.clip(self.radius**2 - cross**2, 0.0, None)) / speed
        enter, leave = self.series.slab(s, ds, at)
        first = np.maximum(nearest - half, enter)
        share = _share(self.radius - np.abs(cross), 2 * self.radius, radius)
        cosine = np.sqrt(np.clip(1.0 - (cross / self.radius) ** 2, 0.0, 1.0)) * speed
        cosine = np.where(enter > nearest - half, np.abs(ds), cosine)
        hit = (share > 0.02) & (first < np.minimum(nearest + half, leave) + 1e-9) & (first < 0) & (first > -beams.reach[index])
        return Touch(index[hit], first[hit], share[hit], np.clip(cosine[hit], 0.08, 1.0))


@dataclass(frozen=True)
class Bar:
    """Tray, lamp, box, plate or bracket: a rectangle in the section, of some length along the tunnel.

    ``turn`` is the direction of its depth (from the vertical, clockwise), as ``Profile.point`` gives it.
    """

    u: float
    v: float
    width: float
    depth: float
    turn: float
    series: Series
    tone: float = -2.0
    gloss: float = 0.0

    def touch(self, beams: Beams) -> Touch:
        reach = 0.5 * math.hypot(self.width, self.depth)
        index, cross, nearest, speed = _crossing(beams, self.u, self.v, reach + 0.02)
        s, ds, du, dv = beams.s[index], beams.ds[index], beams.du[index], beams.dv[index]
        normal = (math.sin(self.turn), math.cos(self.turn))
        along = (normal[1], -normal[0])
        enter, leave = self.series.slab(s, ds, s + ds * nearest)
        face = np.abs(ds)
        du0, dv0 = beams.u[index] - self.u, beams.v[index] - self.v
        for axis, half in ((along, self.width / 2), (normal, self.depth / 2)):
            at, step = du0 * axis[0] + dv0 * axis[1], du * axis[0] + dv * axis[1]
            safe = np.where(np.abs(step) < 1e-9, 1e-9, step)
            half_beam = half + 0.8 * beams.radius[index]
            one, two = (-half_beam - at) / safe, (half_beam - at) / safe
            near = np.minimum(one, two)
            face = np.where(near > enter, np.abs(step), face)
            enter, leave = np.maximum(enter, near), np.minimum(leave, np.maximum(one, two))
        corners = [
            (i * self.width * along[0] + j * self.depth * normal[0], i * self.width * along[1] + j * self.depth * normal[1])
            for i in (-0.5, 0.5)
            for j in (-0.5, 0.5)
        ]
        sides = np.stack([cross + (x * dv - y * du) / speed for x, y in corners])
        depth = np.minimum(sides.max(axis=0), -sides.min(axis=0))
        share = _share(depth, min(self.width, self.depth), beams.radius[index])
        hit = (share > 0.02) & (enter < leave) & (enter < 0) & (enter > -beams.reach[index])
        return Touch(index[hit], enter[hit], share[hit], np.clip(face[hit], 0.08, 1.0))


@dataclass(frozen=True)
class Mesh:
    """Wire mesh spanned before the rock: from ``arc`` minus to plus ``half`` about the crown or a place beside it."""

    start: float
    stop: float
    arc: float
    half: float
    stand: float
    pitch: float = 0.1
    wire: float = 0.005
    tone: float = -2.0
    gloss: float = 0.0

    def touch(self, beams: Beams) -> Touch:
        index = np.flatnonzero((np.abs(beams.arc - self.arc) < self.half) & (beams.s > self.start) & (beams.s < self.stop))
        bow = 0.5 + 0.5 * np.sin(2.1 * beams.s[index]) * np.sin(1.7 * beams.arc[index] + 0.6)
        t = -self.stand * (0.3 + bow) / np.maximum(beams.cosine[index], 0.15)
        s = beams.s[index] + t * beams.ds[index]
        arc = beams.arc[index] + t * beams.d_arc[index]
        away = np.minimum(*(np.abs(np.mod(x + self.pitch / 2, self.pitch) - self.pitch / 2) for x in (s, arc)))
        share = _share(self.wire / 2 - away, self.wire, beams.radius[index])
        hit = (share > 0.02) & (t > -beams.reach[index])
        return Touch(index[hit], t[hit], share[hit], np.full(int(hit.sum()), 0.6))


def nearest_front(fixtures: tuple[Fixture, ...], beams: Beams) -> tuple[Floats, Floats, Floats, Ints]:
    """Front of all equipment on each ray: t (0 where there is none), share, cosine, number of the fixture (-1: none)."""
    count = beams.s.size
    t, share, cosine = np.zeros(count), np.zeros(count), np.ones(count)
    number = np.full(count, -1)
    for which, fixture in enumerate(fixtures):
        found = fixture.touch(beams)
        # what covers more than half of the beam wins over the rim of something before it
        better = (found.share > 0.5) & ((share[found.index] <= 0.5) | (found.t < t[found.index]))
        better |= (found.share <= 0.5) & (share[found.index] <= 0.5) & (found.share > share[found.index])
        rows = found.index[better]
        t[rows], share[rows], cosine[rows] = found.t[better], found.share[better], found.cosine[better]
        number[rows] = which
    return t, share, cosine, number


def blocked(fixtures: tuple[Fixture, ...], beams: Beams) -> Mask:
    """Rays whose middle meets equipment before the lining."""
    _, share, _, _ = nearest_front(fixtures, beams)
    return share > 0.5
