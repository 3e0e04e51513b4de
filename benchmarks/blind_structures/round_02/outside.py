"""Scene 3: a formwork concrete wall with plants; scene 4: a footbridge from below after rain."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind_structures.round_02.engine import (
    Instrument,
    Material,
    Station,
    World,
    _hash,
    blob,
    flakes,
    foot,
    noise,
    streak,
    strokes,
    unit,
)
from benchmarks.blind_structures.round_02.stairs import ASPHALT, CONCRETE, RUST, SIGN, ZINC, bolt

GRASS = Material(-2.6, 0.6, 0.0, 10.0, 0.8, 0.3, 0.8, 0.0, 0.03)
GRAVEL = Material(-5.6, 0.8, 0.0, 10.0, 0.6, 0.4, 1.2, 0.0, 0.015)
PAVING = Material(-4.8, 1.0, 0.0, 10.0, 0.3, 1.0, 0.3)
LEAF = Material(-1.6, 0.8, 0.7, 14.0, 0.3, 0.05)
BARK = Material(-4.6, 0.8, 0.0, 10.0, 0.5, 0.05)
PLASTIC = Material(-4.0, 1.0, 1.5, 8.0, 0.1)
SPRAY = Material(-8.6, 1.0, 0.4, 8.0, 0.3, 0.1)
SILVER = Material(-1.3, 1.0, 1.2, 12.0, 0.3, 0.1)
DECK = Material(-3.4, 1.0, 2.0, 7.0, 0.2, 0.8)
WEB = Material(-4.6, 1.0, 1.8, 7.0, 0.2, 0.7)
WET = Material(-8.4, 1.0, 14.0, 4.0, 0.3, 0.25)
PUDDLE = Material(-13.0, 1.0, 40.0, 2.0, 0.3, 0.2)


def formwork(width: float, height: float, seed: int):
    """Panels of slightly unlike tone, their joints and the tie holes: design."""

    def tone(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        i, j = np.floor(a / width), np.floor(b / height)
        t = 0.9 * (_hash(i, j, seed) - 0.5) + 0.4 * (_hash(i + 0 * j, 0 * j, seed + 1) - 0.5)
        x, y = a - i * width, b - j * height
        joint = (np.minimum(x, width - x) < 0.003) | (np.minimum(y, height - y) < 0.003)
        hole = np.hypot(np.abs(x - width / 2) - width / 4, np.abs(y - height / 2) - height / 4) < 0.013
        return t - 1.0 * joint - 4.0 * hole

    return tone


def both(*levels):
    """Several places as one anomaly."""
    return lambda a, b: np.maximum.reduce([f(a, b) for f in levels])


def leaves(w: World, centres: np.ndarray, normals: np.ndarray, sizes: np.ndarray, shades: list, rng) -> None:
    """Lobed blades, each with its own tilt."""
    for c, n, r in zip(centres, normals, sizes, strict=True):
        n = unit(n)
        u = unit(np.cross(n, rng.normal(size=3)))
        v = np.cross(n, u)

        def mask(a: np.ndarray, b: np.ndarray, r: float = r) -> np.ndarray:
            x, y = a / r - 1, (b / r - 1) / 0.8
            return np.hypot(x, y) < 0.78 + 0.2 * np.cos(3 * np.arctan2(y, x))

        w.patch(c - r * u - r * v, 2 * r * u, 2 * r * v, shades[rng.integers(len(shades))], mask=mask)


def wall(folder: Path) -> None:
    """Writes the wall."""
    w = World(203)
    rng = np.random.default_rng(33)
    w.patch((-3, -2.4, 0.0), (18, 0, 0), (0, 2.5, 0), w.surface(GRASS, none=True))

    def slabs(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        i, j = np.floor(a / 0.5), np.floor(b / 0.5)
        gap = (np.minimum(a - i * 0.5, b - j * 0.5) < 0.006) * -1.5
        return gap + 0.8 * (_hash(i, j, 9) - 0.5)

    w.patch((-3, -8.5, -0.03), (18, 0, 0), (0, 6.1, 0), w.surface(PAVING, slabs))
    parts = []
    for k in range(4):  # sections between expansion joints, each second one set back
        y = 0.06 * (k % 2)
        s = w.surface(CONCRETE, formwork(1.0, 1.35, 300 + k), 0.15)
        w.patch((3.1 * k, y, -0.1), (3.08, 0, 0), (0, 0, 4.1), s)
        for x in (3.1 * k, 3.1 * k + 3.08):
            w.patch((x, y, -0.1), (0, 0.3, 0), (0, 0, 4.1), CONCRETE)
        w.box((3.1 * k - 0.01, y - 0.05, 4.0), (3.09, 0, 0), (0, 0.45, 0), (0, 0, 0.12), PAVING)
        parts.append(s)
    a, b, c, d = parts
    tag = [
        [(0.5, 1.0), (0.55, 2.1), (0.95, 2.15), (1.0, 1.65), (0.6, 1.55), (1.1, 0.95)],
        [(1.3, 0.95), (1.35, 1.7), (1.75, 1.75), (1.8, 1.0), (1.3, 0.98)],
        [(2.0, 1.75), (2.15, 0.95), (2.4, 1.5), (2.55, 0.95), (2.75, 1.9)],
        [(0.4, 0.75), (1.5, 0.66), (2.8, 0.8)],
    ]
    w.flaw(a, "graffiti", strokes(tag, 0.062, 41), SPRAY)
    tag = [
        [(0.5, 1.3), (0.9, 2.0), (1.3, 1.3), (0.7, 1.55)],
        [(1.5, 2.0), (1.5, 1.3), (1.95, 1.3)],
        [(2.6, 2.0), (2.1, 1.95), (2.15, 1.65), (2.6, 1.6), (2.6, 1.28), (2.1, 1.3)],
    ]
    w.flaw(c, "graffiti", strokes(tag, 0.085, 42), SILVER)
    runs = [streak(x, 3.55 - 0.02 * k, 0.75 + 0.4 * (k % 3), 0.15, 50 + k) for k, x in enumerate((0.7, 0.85, 1.0, 1.15))]
    w.flaw(a, "stain", both(*runs), change=-2.6)
    w.flaw(b, "rust", both(*(streak(x, 3.2, 1.1 + 0.25 * k, 0.2, 60 + k) for k, x in enumerate((1.7, 1.9, 2.12)))), change=-3.2)
    w.flaw(b, "efflorescence", both(streak(0.45, 3.5, 1.9, 0.26, 64), blob(0.5, 1.6, 0.3, 0.3, 0.6, 65)), change=2.3)
    w.flaw(b, "moisture", foot(0.55, 0.25, 66, soft=0.12), change=-2.6)
    w.flaw(c, "moisture", foot(0.4, 0.2, 67, soft=0.12), change=-2.2)
    w.flaw(c, "patched paint", blob(1.5, 3.1, 0.62, 0.42, 0.06, 68, 0.03), change=1.6)
    w.flaw(d, "rust", both(*(streak(x, 3.7, 1.3, 0.2, 70 + k) for k, x in enumerate((0.3, 0.5, 0.66)))), change=-2.8)
    w.flaw(d, "stain", blob(0.55, 1.0, 0.4, 0.45, 0.5, 74), change=-2.0)
    w.flaw(
        c,
        "crack",
        strokes([[(0.25, 0.9), (0.3, 1.5), (0.22, 2.2), (0.34, 3.0), (0.3, 3.9)]], 0.006, 75),
        change=-2.0,
        limit="The crack is narrower than one beam and one step of the scan.",
    )
    # furniture: a down pipe with clamps, a sign, a lamp post, its cable
    w.tube((9.25, -0.07, -0.1), (9.25, -0.07, 4.0), 0.05, PLASTIC, ref=(0, -1, 0))
    for z in (0.6, 2.0, 3.4):
        w.tube((9.25, -0.07, z), (9.25, -0.07, z + 0.03), 0.055, w.surface(ZINC, none=True), ref=(0, -1, 0))
    w.box((5.5, 0.03, 2.6), (0.5, 0, 0), (0, 0.004, 0), (0, 0, 0.35), SIGN)
    w.tube((2.7, -3.0, 0), (2.7, -3.0, 5.0), 0.06, ZINC, ref=(0, -1, 0))
    for p, q in (((2.7, -3.0, 4.7), (6.0, -2.1, 4.3)), ((6.0, -2.1, 4.3), (10.0, -1.2, 4.4))):
        w.tube(p, q, 0.008, w.surface(PLASTIC, none=True))
    # ivy: grows from the right foot, thins out towards its edge; stems on the wall
    shades = [w.surface(LEAF, spread=0.9, none=True) for _ in range(10)]
    bark = w.surface(BARK, none=True)
    n = 0
    centres = []
    while n < 3000:
        x, z = rng.uniform(8.0, 12.4), rng.uniform(0, 4.15)
        edge = 9.9 + 0.5 * (z - 1.5) + 0.7 * float(noise(np.array([x]), np.array([z]), 0.7, 80, 3)[0])
        if rng.random() < 1 / (1 + np.exp(-(x - edge) / 0.16)):
            y = 0.06 * (int(x / 3.1) % 2) - 0.015 - rng.gamma(2, 0.022)
            centres.append((x, y, z))
            n += 1
    nor = np.column_stack([rng.normal(0, 0.35, n), -np.ones(n), rng.normal(0.45, 0.35, n)])
    leaves(w, np.array(centres), nor, rng.uniform(0.025, 0.052, n), shades, rng)
    for k in range(14):
        x, z = rng.uniform(10.4, 12.2), 0.0
        for _ in range(9):
            x2, z2 = x + rng.normal(-0.08, 0.13), z + rng.uniform(0.2, 0.5)
            y = 0.06 * (int(x / 3.1) % 2) - 0.008
            if z2 < 4 and int(x / 3.1) == int(x2 / 3.1):
                w.tube((x, y, z), (x2, y, z2), 0.006, bark, ref=(0, -1, 0))
            x, z = x2, z2
    for x0, y0, high, wide, count in ((4.7, -1.5, 1.25, 0.75, 750), (7.4, -1.9, 0.9, 0.6, 500), (0.1, -1.2, 1.6, 0.6, 600)):
        q = rng.normal(size=(count, 3))
        q = q / np.linalg.norm(q, axis=1)[:, None] * rng.uniform(0.35, 1, count)[:, None] ** (1 / 2.2)
        p = np.array([x0, y0, 0.55 * high]) + q * (wide, wide * 0.8, 0.5 * high)
        leaves(w, p, q + rng.normal(0, 0.6, (count, 3)) + (0, -0.2, 0.5), rng.uniform(0.018, 0.04, count), shades, rng)
        for _ in range(14):
            d = rng.normal(size=3) * (0.5 * wide, 0.4 * wide, 0)
            w.tube((x0 + 0.05 * d[0], y0, 0), (x0 + d[0], y0 + d[1], high * rng.uniform(0.6, 1.0)), 0.006, bark, ref=(1, 0, 0))
    ins = Instrument(0.4, 0.0025, 0.6, 27.0, 3.5, 20.0, -14.0, True)
    stations = [Station((5.6, -9.2, 1.74), (50, 132), (-12, 19), 0.0, 0.05)]
    w.write(folder, stations, ins, (688407.2, 5336120.6, 512.7), 64.0, 25832, "formwork wall")


def footbridge(folder: Path) -> None:
    """Writes the footbridge."""
    w = World(204)
    length, zd = 14.0, 4.4
    path = w.patch((0.3, -2.2, -0.9), (13.4, 0, 0), (0, 4.4, 0), ASPHALT)
    for y in (-7.2, 2.2):
        w.patch((-1, y, -0.93), (16, 0, 0), (0, 5.0, 0), w.surface(GRAVEL, none=True))
    w.flaw(path, "moisture", both(blob(4.6, 1.4, 1.2, 0.5, 0.4, 11, 0.06), blob(6.3, 1.1, 0.5, 0.3, 0.4, 12, 0.06)), PUDDLE)
    w.flaw(path, "moisture", blob(9.6, 3.0, 1.1, 0.45, 0.4, 13, 0.06), PUDDLE)
    w.mirror = (path, -0.9, "moisture")
    for k, x in enumerate((0.3, 13.7)):  # abutments, each with a bench and bearings

        def lifts(a: np.ndarray, b: np.ndarray) -> np.ndarray:
            return 0.4 * (_hash(np.floor(a / 1.25), np.floor(b / 1.2), 5) - 0.5) - 1.0 * ((b % 1.2) < 0.006)

        s = w.patch((x, -3, -0.9), (0, 6, 0), (0, 0, 4.35), w.surface(CONCRETE, lifts))
        w.flaw(s, "moisture", streak(1.7 + 2.2 * k, 4.35, 2.9, 0.75, 20 + k), change=-3.4)
        if k:
            w.flaw(s, "moisture", foot(0.3, 0.15, 24, soft=0.1), change=-3.0)
            w.flaw(s, "efflorescence", blob(1.2, 2.9, 0.55, 0.5, 0.6, 25), change=2.0)
        else:
            tag = [[(2.6, 1.1), (2.9, 1.9), (3.2, 1.1), (3.5, 1.9), (3.8, 1.1)], [(4.1, 1.5), (4.6, 1.8), (4.5, 1.1)]]
            w.flaw(s, "graffiti", strokes(tag, 0.13, 26), SPRAY)
        w.patch((x, -3, 3.45), (-0.6 if k == 0 else 0.6, 0, 0), (0, 6, 0), CONCRETE)
        w.patch((x + (-0.6 if k == 0 else 0.6), -3, 3.45), (0, 6, 0), (0, 0, 1.2), CONCRETE)
        for y in (-1.5, 1.5):
            w.box((x - (0.35 if k == 0 else 0), y - 0.15, 3.45), (0.35, 0, 0), (0, 0.3, 0), (0, 0, 0.13), PLASTIC, "z0 z1")

    # deck plate, weld seams across (design), longitudinal flats, cross girders
    def seams(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return -0.9 * (np.abs(a - 5.05) < 0.008) - 0.9 * (np.abs(a - 9.9) < 0.008)

    deck = w.patch((-0.2, -1.5, zd), (length + 0.4, 0, 0), (0, 3.0, 0), w.surface(DECK, seams))
    w.flaw(deck, "moisture", blob(4.6, 1.4, 1.5, 0.62, 0.4, 31, 0.08), WET)
    w.flaw(deck, "moisture", blob(10.9, 2.1, 0.9, 0.5, 0.4, 32, 0.08), WET)
    w.flaw(deck, "rust", blob(7.5, 1.9, 0.75, 0.5, 0.6, 33, 0.1), RUST)
    w.flaw(deck, "rust", blob(2.6, 2.2, 1.0, 0.62, 0.6, 34, 0.1), RUST)
    for k, y in enumerate(np.arange(-1.2, 1.21, 0.3)):
        f = w.box((-0.1, y - 0.004, zd - 0.1), (length + 0.2, 0, 0), (0, 0.008, 0), (0, 0, 0.1), DECK, "z1 x0 x1")
        if k % 3 == 0:
            for g, name in enumerate(("y0", "y1")):
                w.flaw(f[name], "rust", blob(3.0 + 1.1 * k + 0.6 * g, 0.03, 0.8, 0.07, 0.6, 40 + 2 * k + g), RUST)
        elif k % 3 == 1:
            w.flaw(f["y0" if k < 5 else "y1"], "moisture", blob(4.6, 0.05, 1.3, 0.09, 0.5, 60 + k), WET)
    for k, x in enumerate(np.arange(0.9, length, 2.44)):
        low = zd - 0.36
        f = w.box((x - 0.005, -1.49, low), (0.01, 0, 0), (0, 2.98, 0), (0, 0, 0.36), WEB, "z0 z1 y0 y1")
        g = w.box((x - 0.08, -1.49, low - 0.012), (0.16, 0, 0), (0, 2.98, 0), (0, 0, 0.012), WEB, "y0 y1")
        if k in (1, 4):
            for n, name in enumerate(("x0", "x1")):
                w.flaw(f[name], "rust", foot(0.06, 0.05, 70 + 2 * k + n), RUST)
            w.flaw(g["z0"], "rust", blob(0.08, 1.2, 0.09, 0.5, 0.5, 80 + k), RUST)
        if k in (2, 4):
            w.flaw(f["x0"], "moisture", blob(1.9, 0.25, 0.6, 0.2, 0.4, 82 + k), WET)
            w.flaw(f["x1"], "moisture", blob(1.2, 0.25, 0.6, 0.2, 0.4, 86 + k), WET)
        if k == 2:
            w.flaw(g["z0"], "moisture", blob(0.08, 1.5, 0.1, 0.6, 0.4, 90), WET)
    # main girders with bolted splices, stiffeners and a service pipe below the deck
    for side in (-1, 1):
        m = w.ibeam((-0.2, 1.5 * side, 3.58), (length + 0.4, 0, 0), (0, 0, 1), (0, 1, 0), 1.2, 0.3, 0.012, 0.02, WEB)
        inner = m["web-" if side > 0 else "web+"]
        w.flaw(inner, "rust", blob(5.0 if side > 0 else 8.2, 0.25, 1.6, 0.3, 0.5, 100 + side), RUST)
        w.flaw(inner, "moisture", streak(8.2 if side > 0 else 4.2, 0.8, 0.8, 0.9, 104 + side), WET)
        w.flaw(m["low"], "rust", blob(6.0 + 2 * side, 0.15, 0.9, 0.16, 0.5, 106 + side), RUST)
        w.flaw(m["low"], "moisture", blob(8.4 + 3 * side, 0.15, 0.8, 0.13, 0.4, 108 + side), WET)
        if side > 0:
            w.flaw(m["web+"], "peeled paint", flakes(6.0, 0.5, 1.4, 0.5, 0.2, 112, 0.2), change=-3.0)
        yi = 1.5 * side - side * 0.006
        for x in np.arange(2.12, length, 2.44):
            w.patch((x, 1.5 * side + side * 0.006, 3.6), (0, side * 0.14, 0), (0, 0, 1.16), WEB)
        w.box((6.7, yi - (0.01 if side > 0 else 0), 3.62), (0.5, 0, 0), (0, 0.01, 0), (0, 0, 0.66), DECK)  # splice, other paint
        for dx in (0.08, 0.18, 0.32, 0.42):
            for dz in np.arange(0.06, 0.64, 0.1):
                bolt(w, (6.7 + dx, yi - side * 0.01, 3.62 + dz), (0, -side, 0), ZINC)
        for z in (5.3, 5.85):
            w.tube((-0.2, 1.45 * side, z), (length + 0.2, 1.45 * side, z), 0.024, ZINC)
        for x in np.arange(0.2, length, 1.7):
            w.tube((x, 1.45 * side, 4.78), (x, 1.45 * side, 5.85), 0.02, ZINC, ref=(1, 0, 0))
    w.tube((-0.1, 0.75, zd - 0.47), (length, 0.75, zd - 0.47), 0.055, PLASTIC, ref=(0, 0, -1))
    for x in np.arange(0.9, length, 2.44):
        w.tube((x - 0.02, 0.75, zd - 0.47), (x + 0.02, 0.75, zd - 0.47), 0.062, w.surface(ZINC, none=True), ref=(0, 0, -1))
    w.tube((-0.1, -0.5, zd - 0.385), (length, -0.45, zd - 0.39), 0.011, w.surface(PLASTIC, none=True))
    w.patch((3.0, -1.4935, 3.75), (0.4, 0, 0), (0, 0, 0.25), SIGN)
    ins = Instrument(0.3, 0.0015, 0.45, 23.0, 2.6, 20.0, -22.0, False, 1.2e-3)
    stations = [
        Station((1.35, -0.95, 0.73), (-52, 60), (-31, 74), 0.0, 0.12),
        Station((12.4, 0.25, 0.8), (122, 236), (-31, 74), 1.4, 0.12),
    ]
    w.write(folder, stations, ins, (452090.7, 5478811.3, 103.4), 151.0, 25832, "footbridge")
