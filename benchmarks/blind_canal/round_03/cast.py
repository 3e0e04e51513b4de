"""Rays against a canal: an implicit surface (rock, masonry, mud, boats), thin bars (ladders, ropes) and the water.

All casting is done in the canal's frame: x along the canal, y to the left of it, z up, z = 0 at the water of the laser scan.
A field f(x, y, z) is positive in air and water and negative in the solid; its value is about the
distance to the nearest surface.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as default
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS
from scipy.ndimage import gaussian_filter

Field = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
NOTHING, SOLID, BAR = 0, 1, 2


# ---------------------------------------------------------------- rasters


class Raster2:
    """A raster over (u, v) that is read bilinearly; beyond its rim the rim's values hold."""

    def __init__(self, values: np.ndarray, low: tuple[float, float], step: float) -> None:
        self.v, self.low, self.step = np.ascontiguousarray(values, dtype=np.float64), low, step
        self.flat, self.width = self.v.ravel(), self.v.shape[1]

    def __call__(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        a = np.clip((u - self.low[0]) / self.step, 0.0, self.v.shape[0] - 1.001)
        b = np.clip((v - self.low[1]) / self.step, 0.0, self.v.shape[1] - 1.001)
        i, j = a.astype(np.int64), b.astype(np.int64)
        a -= i
        b -= j
        k = i * self.width + j
        f = self.flat
        top = f[k] * (1 - b) + f[k + 1] * b
        bottom = f[k + self.width] * (1 - b) + f[k + self.width + 1] * b
        return top * (1 - a) + bottom * a


class Raster3:
    """The same over (x, y, z), trilinear."""

    def __init__(self, values: np.ndarray, low: Sequence[float], step: float) -> None:
        self.v, self.low, self.step = np.ascontiguousarray(values, dtype=np.float32), low, step
        self.flat = self.v.ravel()

    def __call__(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        n = self.v.shape
        a = np.clip((x - self.low[0]) / self.step, 0.0, n[0] - 1.001)
        b = np.clip((y - self.low[1]) / self.step, 0.0, n[1] - 1.001)
        c = np.clip((z - self.low[2]) / self.step, 0.0, n[2] - 1.001)
        i, j, k = a.astype(np.int64), b.astype(np.int64), c.astype(np.int64)
        a, b, c = a - i, b - j, c - k
        q = (i * n[1] + j) * n[2] + k
        f, dx, dy = self.flat, n[1] * n[2], n[2]

        def line(o: np.ndarray) -> np.ndarray:
            first = f[o]
            return first + (f[o + 1] - first) * c

        low = line(q) * (1 - b) + line(q + dy) * b
        high = line(q + dx) * (1 - b) + line(q + dx + dy) * b
        return low * (1 - a) + high * a


def noise(rng: np.random.Generator, shape: Sequence[int], step: float, octaves: Sequence[tuple[float, float]]) -> np.ndarray:
    """Smooth random relief: the sum of octaves (smoothing length in m, standard deviation in m)."""
    total = np.zeros(shape)
    for length, sigma in octaves:
        layer = gaussian_filter(rng.standard_normal(shape), length / step, mode="reflect", truncate=3.0)
        total += layer * (sigma / layer.std())
    return total


def noise_raster(
    rng: np.random.Generator,
    low: tuple[float, float],
    high: tuple[float, float],
    step: float,
    octaves: Sequence[tuple[float, float]],
) -> Raster2:
    """A raster of noise over a rectangle."""
    shape = [int(round((b - a) / step)) + 1 for a, b in zip(low, high)]
    return Raster2(noise(rng, shape, step, octaves), low, step)


# ---------------------------------------------------------------- a canal


@dataclass
class Canal:
    """What can be hit, and where it lies in the world."""

    field: Field
    low: np.ndarray
    high: np.ndarray
    bearing: float
    place: np.ndarray
    epsg: int
    bars: list[tuple[np.ndarray, np.ndarray, float]] = default(default_factory=list)
    rungs: list[tuple[int, int, float, float, float]] = default(default_factory=list)
    ladder_boxes: list[tuple[np.ndarray, np.ndarray]] = default(default_factory=list)

    @property
    def turn(self) -> np.ndarray:
        c, s = np.cos(self.bearing), np.sin(self.bearing)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def world(self, p: np.ndarray) -> np.ndarray:
        return np.asarray(p) @ self.turn.T + self.place

    def bar(self, points: np.ndarray, radius: float) -> None:
        """A chain of round bars."""
        for a, b in zip(points[:-1], points[1:]):
            self.bars.append((np.asarray(a, float), np.asarray(b, float), radius))

    def ladder(
        self,
        rng: np.random.Generator,
        foot: np.ndarray,
        up: np.ndarray,
        across: np.ndarray,
        length: float,
        gap: float,
        diameter: float,
        heights: np.ndarray,
        missing: Sequence[int] = (),
        bent: dict[int, np.ndarray] | None = None,
        zero: float = 0.0,
    ) -> None:
        """A ladder; the surveyor's list has the rungs that are there, measured to the millimetre."""
        up, across = np.asarray(up, float), np.asarray(across, float)
        up, across = up / np.linalg.norm(up), across / np.linalg.norm(across)
        foot = np.asarray(foot, float)
        number = 1 + max((r[0] for r in self.rungs), default=0)
        for side in (-0.5, 0.5):
            self.bar(np.array([foot + side * gap * across, foot + side * gap * across + length * up]), diameter / 2)
        row = 0
        for i, h in enumerate(heights):
            if i in missing:
                continue
            slope = rng.normal(0.0, 0.002)
            a = foot + (h - slope) * up - 0.5 * gap * across
            b = foot + (h + slope) * up + 0.5 * gap * across
            middle = h
            if bent and i in bent:
                m = bent[i]
                self.bar(
                    np.array([a, 0.7 * a + 0.3 * b + 0.8 * m, 0.5 * (a + b) + m, 0.3 * a + 0.7 * b + 0.8 * m, b]), diameter / 2
                )
                middle = h + float(m @ up)
            else:
                self.bar(np.array([a, b]), diameter / 2)
            row += 1
            self.rungs.append((number, row, round(middle + zero + rng.normal(0, 0.0007), 3), gap, diameter))
        ends = np.array([foot + s * gap * across + h * up for s in (-0.6, 0.6) for h in (0.0, length)])
        self.ladder_boxes.append((ends.min(axis=0), ends.max(axis=0)))


def gradient(f: Field, p: np.ndarray, h: float = 0.02) -> np.ndarray:
    """Direction into the free space."""
    x, y, z = p.T
    base = f(x, y, z)
    g = np.stack([f(x + h, y, z) - base, f(x, y + h, z) - base, f(x, y, z + h) - base], axis=1)
    return g / np.maximum(np.linalg.norm(g, axis=1, keepdims=True), 1e-9)


def march(canal: Canal, o: np.ndarray, d: np.ndarray, start: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Distance to the solid along each ray, infinite where there is none before reach."""
    n = len(d)
    found = np.full(n, np.inf)
    index = np.arange(n)
    at, before = start.astype(float).copy(), start.astype(float).copy()
    last = np.full(n, 1.0)
    dd = d
    crossings: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
    for _ in range(260):
        if not len(index):
            break
        p = o + dd * at[:, None]
        f = canal.field(p[:, 0], p[:, 1], p[:, 2])
        outside = ((p < canal.low) | (p > canal.high)).any(axis=1)
        hit = (f <= 0.0) & ~outside
        if hit.any():
            crossings.append((index[hit], before[hit], at[hit], last[hit], f[hit]))
        gone = (at > reach[index]) | outside
        go = ~(hit | gone)
        index, dd, before, last = index[go], dd[go], at[go], f[go]
        at = before + np.maximum(0.62 * last, 0.012)
    if crossings:
        index, a, b, fa, fb = (np.concatenate(c) for c in zip(*crossings))
        dd = d[index]
        for k in range(6):
            # the first steps are secants, kept off the ends; the others halve
            w = np.clip(fa / np.maximum(fa - fb, 1e-12), 0.05, 0.95) if k % 2 == 0 else 0.5
            m = a + (b - a) * w
            p = o + dd * m[:, None]
            f = canal.field(p[:, 0], p[:, 1], p[:, 2])
            free = f > 0
            a, fa = np.where(free, m, a), np.where(free, f, fa)
            b, fb = np.where(free, b, m), np.where(free, fb, f)
        r = a + (b - a) * np.clip(fa / np.maximum(fa - fb, 1e-12), 0, 1)
        found[index] = np.where(r <= reach[index], r, np.inf)
    return found


def bars(canal: Canal, o: np.ndarray, d: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance to the nearest bar along each ray, and the number of the bar."""
    best, which = np.full(len(d), np.inf), np.full(len(d), -1)
    for k, (a, b, r) in enumerate(canal.bars):
        middle, ba, oa = (a + b) / 2 - o, b - a, o - a
        size, far = np.linalg.norm(ba) / 2 + r, np.linalg.norm(middle)
        if far > 26.0:
            continue
        cosine = np.sqrt(max(0.0, 1 - (size / far) ** 2)) if far > size else -1.0
        near = np.flatnonzero(d @ (middle / far) >= cosine)
        if not len(near):
            continue
        e = d[near]
        baba, bard, baoa, rdoa = ba @ ba, e @ ba, ba @ oa, e @ oa
        aa = baba - bard * bard
        bb = baba * rdoa - baoa * bard
        cc = baba * (oa @ oa) - baoa * baoa - r * r * baba
        h = bb * bb - aa * cc
        t = (-bb - np.sqrt(np.maximum(h, 0.0))) / np.maximum(aa, 1e-12)
        y = baoa + t * bard
        ok = (h > 0) & (y > 0) & (y < baba) & (t > start[near]) & (t < best[near])
        best[near[ok]], which[near[ok]] = t[ok], k
    return best, which


def cast(
    canal: Canal, o: np.ndarray, d: np.ndarray, start: np.ndarray, reach: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance, kind and bar of what each ray meets first."""
    solid = march(canal, o, d, start, reach)
    thin, which = bars(canal, o, d, start)
    thin = np.where(thin <= reach, thin, np.inf)
    r = np.minimum(solid, thin)
    kind = np.where(~np.isfinite(r), NOTHING, np.where(thin < solid, BAR, SOLID))
    return r, kind, which


# ---------------------------------------------------------------- the laser


def fresnel(cosine: np.ndarray) -> np.ndarray:
    """Share of the light that the water's surface mirrors."""
    c = np.clip(cosine, 1e-3, 1.0)
    inner = np.sqrt(1 - (1 - c * c) / 1.333**2)
    s, p = (c - 1.333 * inner) / (c + 1.333 * inner), (inner - 1.333 * c) / (inner + 1.333 * c)
    return 0.5 * (s * s + p * p)


def laser_window(
    canal: Canal,
    o: np.ndarray,
    azimuth: tuple[float, float],
    elevation: tuple[float, float],
    step: float,
    rng: np.random.Generator,
    reach: float = 28.0,
) -> np.ndarray:
    """Points of one window of a laser scan (degrees), in the canal's frame."""
    az = np.radians(np.arange(azimuth[0], azimuth[1], step))
    el = np.radians(np.arange(elevation[0], elevation[1], step))
    a, e = (g.ravel() for g in np.meshgrid(az + rng.uniform(0, 1e-3), el + rng.uniform(0, 1e-3)))
    d = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1)
    n = len(d)
    water = np.where(d[:, 2] < -1e-4, -o[2] / np.minimum(d[:, 2], -1e-4), np.inf)
    limit = np.minimum(water, reach)
    r, kind, _ = cast(canal, o, d, np.full(n, 0.4), limit)
    blur = np.full(n, 0.002)

    # mirror images: the ray goes on from the mirrored station, upwards
    under = np.flatnonzero((kind == NOTHING) & (water < reach))
    share = fresnel(-d[under, 2])
    under = under[rng.random(len(under)) < np.clip(2.0 * share - 0.07, 0.0, 0.8)]
    if len(under):
        ripple = np.concatenate([rng.normal(0, 0.0012, (len(under), 2)), np.zeros((len(under), 1))], axis=1)
        up = d[under] * [1, 1, -1] + ripple
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        image, _, _ = cast(canal, o * [1, 1, -1], up, water[under] + 0.002, np.full(len(under), reach))
        r[under], blur[under] = image, 0.005
    # a few echoes of the surface itself: dust and leaves that float
    float_ = (water < 8) & ~np.isfinite(r) & (rng.random(n) < 0.004)
    r[float_] = water[float_] + rng.normal(0, 0.004, float_.sum())

    # mixed points where neighbours in a row lie at different depths
    grid = r.reshape(len(el), len(az))
    other = np.roll(grid, 1, axis=1)
    with np.errstate(invalid="ignore"):
        edge = np.isfinite(grid) & np.isfinite(other) & (np.abs(grid - other) > 0.05) & (np.abs(grid - other) < 1.5)
    edge[:, 0] = False
    mixed = edge & (rng.random(grid.shape) < 0.18)
    blend = rng.uniform(0.05, 0.95, grid.shape)
    r = np.where(mixed, grid + (np.where(mixed, other, 0.0) - np.where(mixed, grid, 0.0)) * blend, grid).ravel()
    keep = np.isfinite(r)
    r = r[keep] + rng.normal(0.0, 1.0, keep.sum()) * blur[keep]
    return o + d[keep] * r[:, None]


def laser(
    canal: Canal,
    stations: np.ndarray,
    step: float,
    rng: np.random.Generator,
    fine: float = 0.08,
    band: tuple[float, float] | None = None,
    fine_reach: float = 9.0,
) -> tuple[np.ndarray, np.ndarray]:
    """All stations: a dome, a finer band of elevations if asked for, and finer windows at the ladders."""
    points, sources = [], []
    for number, o in enumerate(stations, start=1):
        parts = [laser_window(canal, o, (0.0, 360.0), (-62.0, 88.0), step, rng)]
        if band:
            parts.append(laser_window(canal, o, (0.0, 360.0), band, step / 2, rng))
        for low, high in canal.ladder_boxes:
            corners = (
                np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (max(low[2], 0.0), high[2])])
                - o
            )
            if np.linalg.norm(corners.mean(axis=0)) > fine_reach:
                continue
            az = np.degrees(np.arctan2(corners[:, 1], corners[:, 0]))
            middle = np.degrees(np.arctan2(corners[:, 1].mean(), corners[:, 0].mean()))
            az = middle + (az - middle + 180) % 360 - 180
            el = np.degrees(np.arctan2(corners[:, 2], np.hypot(corners[:, 0], corners[:, 1])))
            parts.append(laser_window(canal, o, (az.min() - 1, az.max() + 1), (el.min() - 1, el.max() + 1), fine, rng))
        p = np.concatenate(parts)
        points.append(p)
        sources.append(np.full(len(p), number))
    return np.concatenate(points), np.concatenate(sources)


# ---------------------------------------------------------------- the sonar


@dataclass
class Sonar:
    """A multibeam head on a tripod: a fan of beams in a plane that is upright in the head, panned right round (degrees, m)."""

    at: np.ndarray
    heading: float
    tilt: float
    tilt_towards: float
    scale: float
    level: float = 0.0
    fan: tuple[float, float] = (-75.0, 80.0)
    beam_step: float = 1.0
    pan_step: float = 1.2
    sigma: float = 0.014
    reach: float = 30.0
    down: bool = False
    steel: float = 6.0
    slow_step: float = 0.3
    slow_reach: float = 9.0

    @property
    def level_rotation(self) -> np.ndarray:
        """From the head's axes with z up to the canal's."""
        h, t, w = np.radians([self.heading, self.tilt, self.tilt_towards])
        k = np.array([-np.sin(w), np.cos(w), 0.0])
        cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        lean = np.eye(3) + np.sin(t) * cross + (1 - np.cos(t)) * cross @ cross
        turn = np.array([[np.cos(h), -np.sin(h), 0], [np.sin(h), np.cos(h), 0], [0, 0, 1]])
        return lean @ turn

    @property
    def flip(self) -> np.ndarray:
        return np.diag([1.0, -1.0, -1.0]) if self.down else np.eye(3)


COARSE = ((0.0, 1), (0.40, 6))
FINE = ((0.0, 1), (0.20, 6), (0.40, 12), (0.60, 12))


def footprint(u: np.ndarray, rings: tuple[tuple[float, int], ...], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Rays on rings about the middle of each beam of 1 degree (angle, number), and their two-way weights."""
    n = len(u)
    side = np.where(np.abs(u[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    v = np.cross(u, side)
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    w = np.cross(u, v)
    ring = np.concatenate([np.full(k, a) for a, k in rings])
    angle = np.concatenate([(np.arange(k) + 0.5 * (i % 2)) * 2 * np.pi / k for i, (_, k) in enumerate(rings)])
    angle = angle[None, :] + rng.uniform(0, np.pi / 3, (n, 1))
    r = np.radians(ring)[None, :]
    rays = u[:, None, :] + (r * np.cos(angle))[..., None] * v[:, None, :] + (r * np.sin(angle))[..., None] * w[:, None, :]
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    # each ring stands for the annulus about it, shared by its rays
    spacing = rings[1][0]
    area = np.concatenate([np.full(k, (a / spacing * 8.0 if a else 1.0) / k) for a, k in rings])
    weight = area * np.exp(-np.log(2.0) * 2 * (ring / 0.5) ** 2)
    return rays, weight / weight.sum()


def strength(
    canal: Canal, o: np.ndarray, d: np.ndarray, r: np.ndarray, kind: np.ndarray, which: np.ndarray, steel: float
) -> np.ndarray:
    """Backscatter of what each ray has met: mud is weak, walls middling, bars strong where hit square."""
    s = np.zeros(len(d))
    solid = np.flatnonzero(kind == SOLID)
    if len(solid):
        normal = gradient(canal.field, o + d[solid] * (r[solid] - 0.003)[:, None])
        c = np.clip(-(normal * d[solid]).sum(axis=1), 0.0, 1.0)
        s[solid] = np.where(normal[:, 2] > 0.75, 0.5, 1.0) * (0.06 + 0.94 * c**1.3)
    thin = np.flatnonzero(kind == BAR)
    if len(thin):
        axes = np.array([(b - a) / np.linalg.norm(b - a) for a, b, _ in canal.bars])
        radii = np.array([radius for _, _, radius in canal.bars])
        along = np.abs((d[thin] * axes[which[thin]]).sum(axis=1))
        full = np.where(radii[which[thin]] < 0.0115, 1.2, steel)  # a rope is weaker than a bar
        s[thin] = full * (0.35 + np.exp(-((along / 0.4) ** 2)))  # rust and limescale: not only the glint
    return s


def echo(
    canal: Canal, head: Sonar, real: np.ndarray, rings: tuple[tuple[float, int], ...], rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of each beam: distance, energy and origin of its echo, and the distance along its middle to a solid (or 0).

    Origins: 0 nothing, 1 something real, 2 the water's surface from below, 3 a mirror image in it.
    """
    o = np.asarray(head.at, float)
    rays, weight = footprint(real, rings, rng)
    n, m = rays.shape[:2]
    d = rays.reshape(-1, 3)
    water = np.where(d[:, 2] > 1e-4, (head.level - o[2]) / np.maximum(d[:, 2], 1e-4), np.inf)
    r, kind, which = cast(canal, o, d, np.full(n * m, 0.35), np.minimum(water, head.reach))
    s = strength(canal, o, d, r, kind, which, head.steel)
    label = np.where(kind == NOTHING, 0, 1)

    # the water from below: an echo of its own where the ray is steep, and a mirror where it is not
    wet = np.flatnonzero((kind == NOTHING) & (water < head.reach))
    slope = np.hypot(d[wet, 0], d[wet, 1]) / d[wet, 2]
    own = 2.0 * np.exp(-((slope / 0.55) ** 2))
    s[wet], r[wet], label[wet] = own, water[wet], 2
    flat = wet[own < 0.10]
    if len(flat):
        some = flat[rng.random(len(flat)) < 0.35]  # the rest is lost
        s[flat] = 0.0
        mirrored = o * [1, 1, -1] + [0, 0, 2 * head.level]
        back = d[some] * [1, 1, -1]
        rr, kk, ww = cast(canal, mirrored, back, water[some] + 0.002, np.full(len(some), head.reach))
        s[some] = 0.25 * strength(canal, mirrored, back, rr, kk, ww, head.steel)
        r[some], label[some] = rr, 3
    middle = np.where(kind == SOLID, r, 0.0).reshape(n, m)[:, 0]
    r = np.where(s > 0, r, 1e3).reshape(n, m)
    s = (s.reshape(n, m) * weight) * np.exp(-np.minimum(r, 40.0) / 30.0)
    label = label.reshape(n, m)

    # the strongest cell of ranges is the echo
    cell = np.exp(-0.5 * ((r[:, :, None] - r[:, None, :]) / 0.022) ** 2) * s[:, None, :]
    energy = cell.sum(axis=2)
    best = energy.argmax(axis=1)
    row = np.arange(n)
    total = energy[row, best]
    distance = (cell[row, best] * r).sum(axis=1) / np.maximum(total, 1e-12)
    return distance, total, label[row, best], middle


def sonar(canal: Canal, head: Sonar, rng: np.random.Generator) -> tuple[np.ndarray, dict]:
    """The file's points and the entry of truth.json."""
    o = np.asarray(head.at, float)
    turns = [np.arange(0.0, 360.0, head.pan_step)]
    for low, high in canal.ladder_boxes:  # the operator pans slowly over ladders that are near
        deep = 0.5 * (min(low[2], 0.0) + min(high[2], 0.0))
        ends = np.array([[x, y, deep] for x in (low[0], high[0]) for y in (low[1], high[1])]) - o
        if np.hypot(*ends[:, :2].mean(axis=0)) < head.slow_reach:
            seen_at = ends @ head.level_rotation
            to = np.arctan2(seen_at[:, 1].mean(), seen_at[:, 0].mean())
            off = np.degrees(np.angle(np.exp(1j * (np.arctan2(seen_at[:, 1], seen_at[:, 0]) - to))))
            turns.append(np.degrees(to) + np.arange(off.min() - 3.0, off.max() + 3.0, head.slow_step))
    pan = np.radians(np.concatenate(turns))
    el = np.radians(np.arange(head.fan[0], head.fan[1], head.beam_step))
    a, e = (g.ravel() for g in np.meshgrid(pan, el, indexing="ij"))
    thin = rng.random(len(a)) < np.maximum(np.cos(e) * 1.15, 0.16)  # the poles are not needed so densely
    a, e = a[thin], e[thin]
    u = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1)
    rotation = head.level_rotation
    real = u @ rotation.T
    n = len(u)
    # beams that pass within a degree or so of a bar need more rays
    thick = [(p, q, radius + 0.019 * max(np.linalg.norm(p - o), np.linalg.norm(q - o))) for p, q, radius in canal.bars]
    wide, _ = bars(replace(canal, bars=thick), o, real, np.full(n, 0.2))
    distance, total, label, middle = np.zeros(n), np.zeros(n), np.zeros(n, dtype=int), np.zeros(n)
    for part, rings in ((np.flatnonzero(np.isinf(wide)), COARSE), (np.flatnonzero(np.isfinite(wide)), FINE)):
        if len(part):
            distance[part], total[part], label[part], middle[part] = echo(canal, head, real[part], rings, rng)
    seen = rng.random(n) < np.clip((total - 0.015) / 0.06, 0.0, 0.985)
    seen &= (label != 3) | (rng.random(n) < 0.22)
    seen &= (label != 0) & (distance < head.reach) & (distance > 0.35)

    # false echoes: twice to the wall and back, and single random ranges
    twice = (label == 1) & (np.abs(real[:, 2]) < 0.3) & (total > 0.55) & (rng.random(n) < 0.02)
    distance = np.where(twice & (2 * distance < head.reach), 2 * distance, distance)
    stray = rng.random(n) < 0.009
    distance = np.where(stray, rng.uniform(0.5, 12.0, n), distance)
    seen |= stray
    label = np.where(stray, 5, np.where(twice, 4, label))

    jitter = rng.normal(0, np.radians(0.08), u.shape)
    shown = u + jitter
    shown /= np.linalg.norm(shown, axis=1, keepdims=True)
    measured = (distance + rng.normal(0, head.sigma, n))[seen]
    local = shown[seen] * measured[:, None] / head.scale @ head.flip.T

    # check points: the middle rays of beams that meet the real, thinned so that near places do not prevail
    p = o + real * middle[:, None]
    ok = np.flatnonzero((middle > 0) & (middle < 9.9) & seen & (label == 1) & (np.abs(distance - middle) < 0.1))
    _, one = np.unique(np.floor(p[ok] / 0.25).astype(int), axis=0, return_index=True)
    one = rng.permutation(ok[one])[:400]
    world_rotation = canal.turn @ rotation @ head.flip.T
    origin = canal.world(o)
    check = canal.world(p[one])
    entry = {
        "rotation": world_rotation.tolist(),
        "origin": origin.tolist(),
        "scale": head.scale,
        "check_local": ((check - origin) @ world_rotation / head.scale).tolist(),
        "check_world": check.tolist(),
        "determined": True,
        "open": "",
    }
    entry["_share"] = {k: float(np.mean(label[seen] == k)) for k in range(1, 6)}
    return local, entry


# ---------------------------------------------------------------- the files


def write(
    folder: Path,
    canal: Canal,
    points: np.ndarray,
    sources: np.ndarray,
    stations: np.ndarray,
    axis: np.ndarray,
    scans: list[tuple[np.ndarray, dict]],
    up: str,
    extra: dict,
    rng: np.random.Generator,
) -> dict:
    """All files of the contract; returns what may be of interest while building a scene."""
    folder = Path(folder)
    world = canal.world(points)
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = np.full(3, 0.001), np.floor(world.min(axis=0))
    header.add_crs(CRS.from_epsg(canal.epsg))
    las = laspy.LasData(header)
    las.x, las.y, las.z = world.T
    las.point_source_id = sources.astype(np.uint16)
    las.intensity = rng.integers(400, 2600, len(world)).astype(np.uint16)
    las.return_number = las.number_of_returns = np.ones(len(world), dtype=np.uint8)
    las.write(str(folder / "laser.laz"))

    def table(name: str, head: str, rows: Sequence[Sequence]) -> None:
        with open(folder / name, "w", newline="", encoding="utf-8") as out:
            writer = csv.writer(out)
            writer.writerow(head.split(","))
            writer.writerows(rows)

    table("stations.csv", "scan_id,x,y,z", [[i, *(f"{v:.3f}" for v in p)] for i, p in enumerate(canal.world(stations), 1)])
    table("axis.csv", "x,y,z", [[f"{v:.3f}" for v in p] for p in canal.world(axis)])
    table(
        "ladders.csv",
        "ladder,rung,height,stile_gap,diameter",
        [[a, b, f"{h:.3f}", f"{g:.3f}", f"{q:.3f}"] for a, b, h, g, q in canal.rungs],
    )
    shares = []
    for number, (local, entry) in enumerate(scans, start=1):
        np.savetxt(folder / f"sonar_{number}.xyz", local, fmt="%.3f")
        shares.append(entry.pop("_share"))
    described = {"epsg": canal.epsg, "up": up, "water_level": round(float(canal.place[2]), 3), **extra}
    (folder / "scene.json").write_text(json.dumps(described, indent=1), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps({"scans": [entry for _, entry in scans]}), encoding="utf-8")
    return {"shares": shares, "laser": len(world), "sonar": [len(local) for local, _ in scans]}
