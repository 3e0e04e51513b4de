"""Three silos of 2.2 to 3 m radius: painted steel, corrugated galvanised sheet, concrete; ladders with cages in front."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from .engine import Array, Cylinder, Material, Scanner, View, World, band, blob, deliver, patch, run
from .parts import CONCRETE, GRAVEL, GALVANISED, RUST, WET, blades, ground

WHITE = Material(0.66, 0.85, 0.8, 17.0, tex=0.25, grain=1.2)
SHEET = Material(0.34, 1.2, 2.6, 14.0, tex=0.5, grain=0.02)
BLUE = Material(0.30, 0.85, 0.9, 16.0, tex=0.2, grain=0.4)
WALL = Material(0.40, 0.95, tex=0.5, grain=0.4)
DIRT = Material(0.20, 0.95, tex=0.4, grain=0.12)


def _on(c: tuple[float, float], r: float, deg: float, z: float) -> Array:
    """A point at the angle deg from -y (to the right) around c."""
    a = math.radians(deg)
    return np.array([c[0] + r * math.sin(a), c[1] - r * math.cos(a), z])


def ladder(w: World, c: tuple[float, float], r: float, deg: float, z0: float, z1: float, mat: Material) -> None:
    """A ladder with a cage, 0.2 m off the wall."""
    a = math.radians(deg)
    out, tan = np.array([math.sin(a), -math.cos(a), 0]), np.array([math.cos(a), math.sin(a), 0])
    base = _on(c, r + 0.2, deg, 0)
    for k in (-1, 1):
        p = base + 0.22 * k * tan
        w.box(p + [0, 0, z0], p + [0, 0, z1], 0.012, 0.06, mat, out)
    for z in np.arange(z0 + 0.2, z1, 0.28):
        p = base + np.array([0, 0, z])
        w.cyl(p - 0.21 * tan, p + 0.21 * tan, 0.0125, mat)
    hub = base + 0.32 * out
    for z in np.arange(2.4, z1, 0.9):
        h = w.cyl(hub + [0, 0, z], hub + [0, 0, z + 0.05], 0.36, mat, ref=out)
        h.mask = lambda u, v: np.abs(u) < 0.36 * 2.4
        h = w.cyl(hub + [0, 0, z], hub + [0, 0, z + 0.05], 0.352, mat, ref=out, inside=True)
        h.mask = lambda u, v: np.abs(u) < 0.352 * 2.4
    for d in (-100, -50, 0, 50, 100):
        b = math.radians(d)
        o = math.cos(b) * out + math.sin(b) * tan
        p = hub + 0.349 * o
        w.box(p + [0, 0, 2.4], p + [0, 0, z1], 0.04, 0.006, mat, o, caps=False)
    for z in np.arange(1.5, z1, 2.5):
        for k in (-1, 1):
            p = base + 0.22 * k * tan + np.array([0, 0, z])
            w.box(p, p - 0.2 * out, 0.05, 0.01, mat)


def outlet(w: World, s: Cylinder, c: tuple[float, float], deg: float, z: float, r: float, mat: Material) -> float:
    """A short spout with a flange and a blank cover; returns its arc position on the silo."""
    a = math.radians(deg)
    o = np.array([math.sin(a), -math.cos(a), 0])
    p = _on(c, s.r + s.wave, deg, z)
    w.cyl(p - 0.05 * o, p + 0.22 * o, r, mat)
    w.cyl(p + 0.22 * o, p + 0.25 * o, 1.4 * r, mat)
    d = w.disc(p + 0.25 * o, o, 1.4 * r, mat)
    ang = np.arange(8) * math.pi / 4
    d.studs = np.c_[1.2 * r * np.cos(ang), 1.4 * r + 1.2 * r * np.sin(ang), np.full(8, 0.016), np.full(8, 0.014)]
    return s.r * a


def build() -> World:
    """The silos stand at x = -6.2, 0 and 6.6 on a slab; angles count from -y, towards the stations."""
    w = World(302)
    ground(w, GRAVEL)
    slab = w.box((-10.2, 0.2, 0.1), (11.0, 0.2, 0.1), 7.6, 0.3, CONCRETE)
    slab["+3"].big = True
    ca, cb, cc = (-6.2, 0.0), (0.0, 0.3), (6.6, 0.0)

    # A: painted steel in three courses between ring flanges
    rings = []
    for i in range(3):
        z0 = 0.25 + 2.9 * i
        s = w.cyl((*ca, z0), (*ca, z0 + 2.9), 2.2, WHITE)
        for k in range(-3, 4):
            s.design(lambda u, v, k=k, i=i: 1.0 * (np.abs(u - 1.7 * k - 0.8 * (i % 2)) < 0.006), -1.2)  # weld seams
        s.design(lambda u, v: 1.0 * (np.abs(v - 1.45) < 0.006), -1.2)
        rings.append(s)
        rim = w.cyl((*ca, z0 + 2.85), (*ca, z0 + 2.95), 2.26, WHITE)
        rim.design(lambda u, v: 1.0 * (np.abs(v - 0.05) < 0.004), -4.0)
    rings[2].design(patch(0.5, 1.9, 1.6, 0.35, 21), BLUE)
    ua = outlet(w, rings[1], ca, -14, 0.25 + 2.9 + 2.1, 0.14, WHITE)
    w.anomaly(rings[1], "dark run", run(ua, 1.95, 1.95, 0.36, 710, taper=0.15), DIRT)
    w.anomaly(rings[0], "dark run", run(ua + 0.03, 2.83, 2.3, 0.34, 712, taper=0.5), DIRT)
    ub = outlet(w, rings[2], ca, 20, 0.25 + 5.8 + 1.3, 0.11, WHITE)
    w.anomaly(rings[2], "dark run", run(ub, 1.18, 1.15, 0.42, 714, taper=0.0), -2.2)
    w.anomaly(rings[1], "dark run", run(ub - 0.02, 2.83, 2.3, 0.30, 716), -1.6)
    w.anomaly(rings[0], "rust", blob(1.9, 0.3, 0.8, 0.3, 718, 0.45), RUST)
    w.anomaly(rings[0], "graffiti", patch(-1.75, 1.3, 0.9, 0.5, 720, 8, 0.03), Material(0.33, 0.85, 0.6, 16.0, tex=0.4))

    # B: corrugated sheet, bolted in panels
    b = w.cyl((*cb, 0.25), (*cb, 8.6), 2.6, SHEET, wave=0.009, pitch=0.104)
    b.design(lambda u, v: 1.0 * (np.abs((u + 0.3) % 2.4 - 1.2) < 0.005), -3.0)  # side laps
    b.studs = np.array([(u, v, 0.011, 0.008) for u in np.arange(-3.3, 3.4, 2.4) + 0.04 for v in np.arange(0.13, 8.2, 0.208)])
    for deg in (-48, 34):
        a = math.radians(deg)
        o = np.array([math.sin(a), -math.cos(a), 0])
        p = _on(cb, 2.6 + 0.03, deg, 0.25)
        w.box(p, p + [0, 0, 8.3], 0.12, 0.04, GALVANISED, o)  # stiffeners
    ua = outlet(w, b, cb, -22, 7.3, 0.15, GALVANISED)
    w.anomaly(b, "dark run", run(ua, 6.9, 5.6, 0.42, 730, taper=0.25), DIRT)
    ua = outlet(w, b, cb, 22, 5.4, 0.13, GALVANISED)
    w.anomaly(b, "dark run", run(ua - 0.05, 5.0, 4.6, 0.34, 732, taper=0.3), -2.8)
    w.anomaly(b, "rust", blob(-0.1, 0.55, 1.3, 0.45, 734, 0.4), RUST)

    # C: slip-formed concrete with joints
    c = w.cyl((*cc, 0.25), (*cc, 9.0), 3.0, WALL)
    c.design(lambda u, v: 1.0 * (np.abs((v + 0.6) % 1.2 - 0.6) < 0.007), -1.0)
    c.studs = np.array([(u, v, 0.02, -0.012) for u in np.arange(-4.2, 4.3, 1.2) for v in np.arange(0.3, 8.6, 1.2)])
    ua = outlet(w, c, cc, -30, 6.6, 0.16, BLUE)
    w.anomaly(c, "dark run", run(ua, 6.15, 5.4, 0.55, 740, taper=0.3), DIRT)
    ua = outlet(w, c, cc, 12, 7.9, 0.12, BLUE)
    w.anomaly(c, "dark run", run(ua, 7.5, 5.2, 0.50, 742, taper=0.2), -2.4)
    w.anomaly(c, "moisture", band(0.7, 744, 0.22, 1.2, -2.6, 1.7), WET)
    w.anomaly(c, "efflorescence", blob(1.9, 4.3, 0.4, 1.1, 746, 0.45), Material(0.72, 0.95, tex=0.6, grain=0.12))

    ladder(w, ca, 2.26, 4, 0.3, 9.0, GALVANISED)
    ladder(w, cb, 2.61, 4, 0.3, 8.9, GALVANISED)
    ladder(w, cc, 3.0, -6, 0.3, 9.3, BLUE)
    # catwalk, feed pipe, hose
    w.box((-7.5, -2.9, 6.05), (7.0, -3.35, 6.05), 0.5, 0.06, GALVANISED)
    w.cyl((-8.0, -2.9, 0.2), (-8.0, -2.9, 8.5), 0.08, Material(0.3, 1.2, 3.0, 14.0))
    w.cyl((2.9, -2.6, 0.0), (3.2, -2.3, 6.0), 0.015, Material(0.1, tex=0), smooth=False)
    blades(w, -9, 10, -4.6, -3.8, 350, 0.5)
    return w


def make(folder: Path) -> None:
    """Two stations at 905 nm."""
    tool = Scanner(beam=0.45, sigma=0.0022, noise=0.6, const=29.0, near=2.2, floor=2.0, wiggle=0.1, false=0.0012)
    views = [View((-4.5, -11.0, 1.7), (38, 121), (-6, 42), 0.08), View((5.2, -10.5, 1.75), (56, 146), (-6, 43), 0.08, -0.25)]
    deliver(folder, build(), views, tool, 32, 25833, (391442.6, 5812208.9, 38.4), -61.0)
