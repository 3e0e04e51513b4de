"""Rays: where they go out, and what each meets first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry import FLOOR, LINING, Array, Axis, Bar, DistanceMap, Material, Section, Tube

NEAR = 0.002


@dataclass(frozen=True)
class Box:
    """A box before the lining (lamp, sheet) or, sunk, behind it (niche), at (s, l): sizes along s, l and normal."""

    s: float
    l: float  # noqa: E741
    along: float
    across: float
    depth: float
    material: Material
    gap: float = 0.0
    sunk: bool = False


@dataclass(frozen=True)
class Icicle:
    """Ice that hangs down from the lining."""

    s: float
    l: float  # noqa: E741
    length: float
    r: float


@dataclass
class Hits:
    """What rays met: ranges, place in the tunnel, normal, and number of the material."""

    t: Array
    s: Array
    u: Array
    v: Array
    normal: Array
    what: NDArray[np.int64]


@dataclass(frozen=True)
class Static:
    """Stations (s, u, v) of a scanner on a tripod; step between rays in rad."""

    stations: list[tuple[float, float, float]]
    step: float
    reach: float = 18.0


@dataclass(frozen=True)
class Profiler:
    """A scanner that turns across the tunnel while it is carried along: height, offset, spacing of its lines, points a turn."""

    u: float
    v: float
    spacing: float
    turn: int
    speed: float = 1.2
    yaw: float = 0.02
    reach: float = 15.0

    def path(self, s: Array) -> tuple[Array, Array]:
        """Offset and height of the scanner at a chainage: the trolley sways."""
        return self.u + 0.02 * np.sin(s / 2.1) + 0.008 * np.sin(s / 0.61), self.v + 0.01 * np.sin(s / 3.3)


class World:
    """All that stands in a tunnel."""

    def __init__(
        self, axis: Axis, section: Section, along: list[Tube | Bar], boxes: list[Box], icicles: list[Icicle], ice: Material
    ) -> None:
        self.axis, self.section, self.boxes, self.icicles = axis, section, boxes, icicles
        self.map = DistanceMap(section, along)
        self.first_box = FLOOR + 1 + len(along)
        self.materials = [*(item.material for item in along), *(item.material for item in boxes), ice]
        self.ice = self.first_box + len(boxes)

    def trace(self, origin: Array, ray: Array, reach: float) -> Hits:
        """Follow rays (directions of length 1) to what they meet first; a range of inf where there is nothing."""
        t = self._march(origin, ray, reach)
        s, u, v = self.axis.locate(origin + np.where(np.isfinite(t), t, 0.0)[:, None] * ray)
        what = self.map.nearest(u, v).astype(np.int64)
        nu, nv = self.map.gradient(u, v)
        l = self.section.project(u, v)  # noqa: E741
        wall = what == LINING
        n = self.section.at(l[wall])[1]
        nu[wall], nv[wall] = n[:, 0], n[:, 1]
        right = self.axis.frame(s)[1]
        normal = nu[:, None] * right
        normal[:, 2] += nv
        hits = Hits(t, s, u, v, normal, what)
        for k, item in enumerate(self.boxes):
            self._box(origin, ray, hits, item, self.first_box + k, l)
        if self.icicles:
            self._hang(origin[0], ray, hits)
        hits.t[hits.t > reach] = np.inf
        hits.s, hits.u, hits.v = self.axis.locate(origin + np.where(np.isfinite(hits.t), hits.t, 0.0)[:, None] * ray)
        return hits

    def _march(self, origin: Array, ray: Array, reach: float) -> Array:
        n = len(ray)
        origins = np.broadcast_to(origin, ray.shape)
        t, done = np.full(n, 0.3), np.full(n, np.inf)
        alive = np.arange(n)
        o, d = origins, ray
        for _ in range(90):
            _, u, v = self.axis.locate(o + t[:, None] * d)
            gap = self.map(u, v)
            near = gap < NEAR
            if near.any():
                gu, gv = self.map.gradient(u[near], v[near])
                right = self.axis.frame(self.axis.locate(o[near] + t[near, None] * d[near])[0])[1]
                slope = -(gu * (right * d[near]).sum(1) + gv * d[near, 2])
                done[alive[near]] = t[near] + gap[near] / np.clip(slope, 0.15, 1)
            keep = ~near & (t < reach)
            alive, o, d = alive[keep], o[keep], d[keep]
            t = t[keep] + np.maximum(0.97 * gap[keep], 0.001)
            if not len(alive):
                break
        return done

    def _box(self, origin: Array, ray: Array, hits: Hits, item: Box, number: int, l: Array) -> None:  # noqa: E741
        p, n = self.section.at(item.l)
        out = -item.depth / 2 if item.sunk else item.gap + item.depth / 2
        c = p + out * n
        centre = self.axis.place(np.array(item.s), np.array(c[0]), np.array(c[1]))
        ahead, right = self.axis.frame(np.array(item.s))
        up = np.array([0.0, 0.0, 1.0])
        axes = np.stack([ahead, -n[1] * right + n[0] * up, n[0] * right + n[1] * up], axis=1)
        half = np.array([item.along, item.across, item.depth]) / 2
        o, d = (origin - centre) @ axes, ray @ axes
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (-half - o) / d, (half - o) / d
        first, last = np.minimum(a, b), np.maximum(a, b)
        enter, leave = first.max(axis=1), last.min(axis=1)
        if item.sunk:
            inside = (np.abs(hits.s - item.s) < half[0]) & (np.abs(l - item.l) < half[1]) & (hits.what == LINING)
            hit, t, face = inside & (leave > 0) & np.isfinite(hits.t), leave, last.argmin(axis=1)
        else:
            hit, t, face = (enter < leave) & (enter > 0) & (enter < hits.t), enter, first.argmax(axis=1)
        k = np.flatnonzero(hit)
        hits.t[k], hits.what[k] = t[k], number
        hits.normal[k] = -np.sign(d[k, face[k]])[:, None] * axes[:, face[k]].T

    def _hang(self, origin: Array, ray: Array, hits: Hits) -> None:
        """Let icicles stop rays that all come from one station."""
        azimuth = np.arctan2(ray[:, 1], ray[:, 0])
        order = np.argsort(azimuth)
        azimuth = azimuth[order]
        for item in self.icicles:
            p, _ = self.section.at(item.l)
            away = self.axis.place(np.array(item.s), np.array(p[0]), np.array(p[1])) - origin
            far, towards = float(np.hypot(away[0], away[1])), float(np.arctan2(away[1], away[0]))
            width = float(np.arcsin(min(item.r / far, 1.0)))
            for turn in (-2 * np.pi, 0.0, 2 * np.pi):
                a, b = np.searchsorted(azimuth, [towards + turn - width, towards + turn + width])
                if b > a:
                    self._icicle(order[a:b], ray[order[a:b]], hits, item, away)

    def _icicle(self, rays: NDArray[np.int64], ray: Array, hits: Hits, item: Icicle, away: Array) -> None:
        level = np.maximum(np.hypot(ray[:, 0], ray[:, 1]), 1e-9)
        flat = ray[:, :2] / level[:, None]
        t = flat @ away[:2] / level
        aside = away[0] * flat[:, 1] - away[1] * flat[:, 0]
        below = away[2] - t * ray[:, 2]
        r = item.r * np.clip(1 - below / item.length, 0, 1) ** 0.7
        k = np.flatnonzero((below > -0.05) & (np.abs(aside) < r) & (t > 0.3) & (t - item.r < hits.t[rays]))
        across = np.sqrt(np.maximum(1 - (aside[k] / r[k]) ** 2, 0))
        hits.normal[rays[k], :2] = -flat[k] * across[:, None]
        hits.normal[rays[k], 2] = 0.0
        hits.t[rays[k]] = t[k] - r[k] * across
        hits.what[rays[k]] = self.ice


def sphere(step: float) -> tuple[Array, Array]:
    """Azimuth and elevation of the rays of a tripod scanner, line by line, thinned towards the zenith; blind below."""
    az = np.arange(0, 2 * np.pi, step)
    el = np.arange(-np.radians(62), np.pi / 2, step)
    every = np.rint(1 / np.maximum(np.cos(el), 0.01)).astype(int)
    keep = (np.arange(len(az))[:, None] + (np.arange(len(el)) * 7)[None, :]) % every[None, :] == 0
    i, j = np.nonzero(keep)
    return az[i], el[j]


def direction(az: Array, el: Array) -> Array:
    """Directions of length 1."""
    return np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=1)
