"""Materials and small parts that several scenes use."""

from __future__ import annotations

import math

import numpy as np

from .engine import Array, Material, Quad, World

CONCRETE = Material(0.38, 0.95, tex=0.5, grain=0.4)
GRASS = Material(0.40, 0.7, tex=1.2, grain=0.12)
GRAVEL = Material(0.30, 0.8, tex=1.5, grain=0.05)
LEAF = Material(0.45, 0.6, tex=0)
GALVANISED = Material(0.30, 1.3, 3.5, 13.0, tex=0.7, grain=0.02)
BARE = Material(0.16, 1.4, 9.0, 12.0, tex=0.4, grain=0.12)
RUST = Material(0.17, 0.9, tex=0.8, grain=0.05)
RUST_LIGHT = Material(0.24, 0.9, tex=0.6, grain=0.05)
OIL = Material(0.10, 1.0, 2.0, 14.0, tex=0.5, grain=0.12)
WET = Material(0.11, 1.0, 1.2, 12.0, tex=0.5, grain=0.12)
WIRE = Material(0.30, 1.0, tex=0)


def fence(w: World, x0: float, x1: float, y: float, top: float) -> None:
    """A chain-link fence with posts along x at y."""
    q = Quad(((x0 + x1) / 2, y, 0.05), (0, -1, 0), (0, 0, 1), x1 - x0, top - 0.05, WIRE)
    q.two_sided = True
    pitch, wire = 0.05, 0.0032

    def mesh(u: Array, v: Array) -> Array:
        a, b = (u + v) / math.sqrt(2), (u - v) / math.sqrt(2)
        return (
            (np.abs((a / pitch) % 1 - 0.5) * pitch > (pitch - wire) / 2)
            | (np.abs((b / pitch) % 1 - 0.5) * pitch > (pitch - wire) / 2)
            | (v > top - 0.055)
        )

    q.mask = mesh
    w.add(q, False)
    for x in np.arange(x0, x1 + 0.1, 2.5):
        w.cyl((x, y + 0.03, 0), (x, y + 0.03, top + 0.05), 0.024, GALVANISED)


def bush(w: World, x: float, y: float, height: float, n: int, wide: float = 0.6) -> None:
    """A bush: thin stems and leaves."""
    for _ in range(5):
        a = w.rng.uniform(-0.3, 0.3, 2) * wide
        p, q = (x + 0.3 * a[0], y + 0.3 * a[1], 0), (x + 2 * a[0], y + 2 * a[1], height)
        w.cyl(p, q, 0.007, Material(0.3, tex=0), smooth=False)

    def draw(rng: np.random.Generator) -> Array:
        z = height * rng.beta(2.2, 1.8)
        r = wide * math.sin(math.pi * min(0.95, 0.1 + 0.85 * z / height)) ** 0.6
        return np.array([x, y, z]) + np.array([*(rng.standard_normal(2) * 0.45 * r), 0.0])

    w.leaves(n, draw, (0.035, 0.085), LEAF)


def blades(w: World, x0: float, x1: float, y0: float, y1: float, n: int, tall: float = 0.5) -> None:
    """Tall grass."""
    w.leaves(n, lambda rng: np.array([rng.uniform(x0, x1), rng.uniform(y0, y1), 0.0]), (0.4 * tall, tall), LEAF, 0.035, True)


def ground(w: World, mat: Material, half: float = 24.0) -> None:
    """Rough ground at z = 0, no smooth surface."""
    g = Quad((0, -half, 0), (0, 0, 1), (0, 1, 0), 2 * half, 2 * half, mat)
    g.big = True
    n = w.pool[2][1]
    g.height = lambda u, v: 0.02 * n(u, v)
    w.add(g, False)


def studs_along(u: list[float], v: Array, r: float = 0.014, h: float = 0.011) -> Array:
    """Rows of bolts at each u, along v."""
    return np.array([(a, b, r, h) for a in u for b in v])


def flange(
    w: World,
    c: tuple[float, float, float],
    axis: tuple[float, float, float],
    r: float,
    mat: Material,
    thick: float = 0.06,
    ref: tuple[float, float, float] = (0, -1, 0),
):
    """A pair of flanges as one short drum with bolts on its faces; gives the rim and the two rings."""
    a, c = np.array(axis, float), np.array(c, float)
    rim = w.cyl(c - thick / 2 * a, c + thick / 2 * a, 1.42 * r, mat, ref=ref)
    rim.design(lambda u, v: 1.0 * (np.abs(v - thick / 2) < 0.004), -5.0)
    rings = []
    for k in (1, -1):
        q = w.disc(c + k * thick / 2 * a, k * a, 1.42 * r, mat, r)
        n = 12
        ang = np.arange(n) * 2 * math.pi / n
        q.studs = np.c_[1.21 * r * np.cos(ang), 1.42 * r + 1.21 * r * np.sin(ang), np.full(n, 0.016), np.full(n, 0.018)]
        rings.append(q)
    return rim, rings
