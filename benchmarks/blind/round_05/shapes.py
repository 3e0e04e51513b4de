"""Outlines of leaks and stains on the unrolled lining, as polygons in (chainage, arc)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from shapely import MultiPoint, Point, Polygon, segmentize, transform, unary_union
from shapely.geometry.base import BaseGeometry

from .geometry import Array

Rng = np.random.Generator


def blob(rng: Rng, c: float, s: float, half_c: float, half_s: float, rough: float = 0.16) -> BaseGeometry:
    """A closed, uneven patch."""
    a = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    radius = np.ones_like(a)
    for k in range(2, 12):
        radius += rough * rng.normal() / k**0.9 * np.cos(k * a + rng.uniform(0, 2 * np.pi))
    radius = np.maximum(radius, 0.35)
    return Polygon(np.stack([c + half_c * radius * np.cos(a), s + half_s * radius * np.sin(a)], axis=1)).buffer(0)


def ribbon(points: Array, widths: Array) -> BaseGeometry:
    """A band of changing width along a line."""
    discs = [Point(*p).buffer(w / 2, quad_segs=6) for p, w in zip(points, widths, strict=True)]
    links = [MultiPoint([*a.exterior.coords, *b.exterior.coords]).convex_hull for a, b in pairwise(discs)]
    return unary_union(links)


def walk(rng: Rng, count: int, step: float) -> Array:
    """A smoothed random walk that begins at 0."""
    path = np.cumsum(rng.normal(0, step, count + 8))
    smooth = np.convolve(path, np.ones(5) / 5, mode="valid")[:count]
    return smooth - smooth[0]


def run(rng: Rng, c: float, s: float, length: float, top: float, bottom: float, wander: float = 0.02) -> BaseGeometry:
    """Water running down the lining from a point; ``top`` and ``bottom`` are its widths."""
    down = 1.0 if s >= 0 else -1.0
    count = max(int(length / 0.06), 4)
    share = np.linspace(0, 1, count)
    width = (top + (bottom - top) * share) * np.clip(1 + 0.3 * walk(rng, count, 0.4), 0.5, 1.6)
    width *= (1 + np.exp(-share * length / 0.12)) * np.clip((1.03 - share) / rng.uniform(0.15, 0.5), 0.2, 1)
    return ribbon(np.stack([c + walk(rng, count, wander), s + down * length * share], axis=1), np.maximum(width, 0.03))


def line(rng: Rng, a: tuple[float, float], b: tuple[float, float], width: float, wander: float = 0.0) -> BaseGeometry:
    """A wet joint or crack from one point to another, uneven in width."""
    count = max(int(np.hypot(b[0] - a[0], b[1] - a[1]) / 0.06), 4)
    share = np.linspace(0, 1, count)[:, None]
    points = np.asarray(a) * (1 - share) + np.asarray(b) * share
    side = np.array([-(b[1] - a[1]), b[0] - a[0]]) / np.hypot(b[0] - a[0], b[1] - a[1])
    points = points + side * walk(rng, count, wander)[:, None]
    swell = np.clip(1 + 0.3 * walk(rng, count, 0.4), 0.45, 1.7)
    return ribbon(points, np.maximum(width * swell, 0.03))


def join(*parts: BaseGeometry, smooth: float = 0.06) -> BaseGeometry:
    """One outline of several; its inner corners are rounded as water does."""
    return unary_union(parts).buffer(smooth).buffer(-smooth)


def curtain(rng: Rng, c0: float, c1: float, s: float, joint: float, runs: Sequence[float], width: float) -> BaseGeometry:
    """A wet longitudinal joint with runs below it; ``runs`` are their lengths, spread over the joint."""
    count = len(runs)
    places = c0 + (c1 - c0) * (np.arange(count) + rng.uniform(0.15, 0.85, count)) / max(count, 1)
    falls = [
        run(rng, float(c), s, length, width * rng.uniform(0.6, 1.3), width * rng.uniform(0.4, 1.2))
        for c, length in zip(places, runs, strict=True)
    ]
    down = 1.0 if s >= 0 else -1.0
    veil = [
        blob(rng, float(c), s + down * 0.08, rng.uniform(0.15, 0.35), rng.uniform(0.08, 0.22), 0.25)
        for c in rng.uniform(c0 + 0.2, c1 - 0.2, count)
    ]
    return join(line(rng, (c0, s), (c1, s), joint, 0.004), *falls, *veil, smooth=0.05)


def warp(rng: Rng, shape: BaseGeometry) -> BaseGeometry:
    """Make an outline uneven, as water spreads on rough concrete."""
    waves = [
        (rng.uniform(0, 2 * np.pi, 2), rng.uniform(0.6, 1.4, 2) * 2 * np.pi / length, height)
        for length, height in ((0.5, 0.022), (0.22, 0.012), (0.11, 0.007))
        for _ in range(2)
    ]

    def bend(xy: Array) -> Array:
        out = xy.copy()
        for phase, rate, height in waves:
            out[:, 0] += height * np.sin(rate[0] * xy[:, 1] + phase[0]) * np.cos(rate[1] * xy[:, 0] + phase[1])
            out[:, 1] += height * np.sin(rate[1] * xy[:, 0] + phase[0]) * np.cos(rate[0] * xy[:, 1] - phase[1])
        return out

    return transform(segmentize(shape, 0.02), bend).buffer(0)
