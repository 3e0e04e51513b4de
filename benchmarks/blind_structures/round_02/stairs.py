"""Scene 1: a galvanised stair tower before a rendered facade."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind_structures.round_02.engine import Instrument, Material, Station, World, blob, flakes, foot, streak

ZINC = Material(-4.0, 1.0, 9.0, 9.0, 0.25, 0.6, 0.0, 0.7)
DULL = Material(-4.6, 1.0, 3.0, 14.0, 0.3, 0.5, 0.0, 0.3)
RUST = Material(-8.2, 0.9, 0.0, 10.0, 0.6, 0.10, 0.5)
WHITE_RUST = Material(-1.4, 0.9, 0.0, 10.0, 0.4, 0.08, 0.3)
CONCRETE = Material(-4.2, 1.0, 0.0, 10.0, 0.35, 0.5, 0.3)
RENDER = Material(-2.2, 1.0, 0.0, 10.0, 0.25, 1.2, 0.25)
ASPHALT = Material(-8.5, 0.8, 0.0, 10.0, 0.4, 0.7, 0.5)
SIGN = Material(-1.5, 1.0, 1.5, 8.0, 0.05)
PAINT = Material(-3.2, 1.0, 2.0, 8.0, 0.15)


def bolt(w: World, at, normal, material: Material) -> None:
    """A bolt head; too small to be a surface."""
    n = np.asarray(normal, float)
    s = w.surface(material, none=True)
    w.tube(at, np.asarray(at) + 0.014 * n, 0.013, s)
    w.disc(np.asarray(at) + 0.014 * n, n, 0.013, s)


def column(w: World, x: float, y: float, top: float, rust: float, seed: int) -> dict:
    """A hollow section on a foot plate and a plinth, with rust that rises from the foot on the faces one can see."""
    faces = w.box((x - 0.075, y - 0.075, 0.32), (0.15, 0, 0), (0, 0.15, 0), (0, 0, top - 0.32), ZINC, "z0")
    w.box((x - 0.14, y - 0.14, 0.30), (0.28, 0, 0), (0, 0.28, 0), (0, 0, 0.02), ZINC, "z0")
    plinth = w.box((x - 0.22, y - 0.22, 0), (0.44, 0, 0), (0, 0.44, 0), (0, 0, 0.30), CONCRETE, "z0")
    for i in (-1, 1):
        for j in (-1, 1):
            bolt(w, (x + 0.11 * i, y + 0.11 * j, 0.32), (0, 0, 1), DULL)
    if rust:
        for k, name in enumerate(("x0", "x1", "y0", "y1")):
            h = rust * (0.75, 1.0, 1.15, 0.85)[(k + seed) % 4]
            w.flaw(faces[name], "rust", foot(h, 0.05 + 0.12 * h, seed * 10 + k), RUST)
    return {"faces": faces, "plinth": plinth}


def grating(w: World, o, ex, ey, pitch: float, rods: float, edges: bool) -> None:
    """Bearing bars along ex, 30 mm high and a few millimetres thick, and cross rods along ey. A mesh: no surface."""
    s = w.surface(ZINC, none=True)
    o, ex, ey = (np.asarray(v, float) for v in (o, ex, ey))
    width, length = np.linalg.norm(ey), np.linalg.norm(ex)
    for d in np.arange(0.004, width, pitch):
        q = o + ey * d / width
        w.patch(q, ex, (0, 0, 0.03), s)
        if edges:
            w.patch(q + (0, 0, 0.03), ex, 0.004 * ey / width, s)
            w.patch(q, ex, 0.004 * ey / width, s)
    for d in np.arange(0.04, length, rods):
        q = o + ex * d / length + (0, 0, 0.027)
        w.tube(q, q + ey, 0.003, s)


def rail(w: World, p, q, posts: int) -> None:
    """Hand rail, knee rail and posts between two points at floor level."""
    p, q = np.asarray(p, float), np.asarray(q, float)
    up = np.array([0, 0, 1.0])
    w.tube(p + up, q + up, 0.0212, ZINC)
    w.tube(p + 0.5 * up, q + 0.5 * up, 0.0135, ZINC)
    for f in np.linspace(0.04, 0.96, posts):
        r = p + f * (q - p)
        w.tube(r - 0.1 * up, r + 0.98 * up, 0.0212, ZINC, ref=(1, 0, 0))


def make(folder: Path) -> None:
    """Writes the stair tower."""
    w = World(201)
    w.patch((-9, -9, 0), (20, 0, 0), (0, 14.6, 0), ASPHALT)

    def bays(a: np.ndarray, b: np.ndarray) -> np.ndarray:  # the facade was rendered in three lifts: design
        return np.where(b < 3.4, 0.0, np.where(b < 6.7, 0.35, -0.25)) - 2.5 * (np.abs(b % 3.3 - 0.1) < 0.008)

    wall = w.patch((-3.4, 5.6, 0), (9, 0, 0), (0, 0, 10.5), w.surface(RENDER, bays))
    w.flaw(wall, "moisture", foot(0.65, 0.3, 31, soft=0.15), change=-2.4)
    w.flaw(wall, "stain", streak(6.9, 8.9, 4.4, 0.9, 32), change=-2.0)
    w.flaw(wall, "patched paint", blob(1.9, 5.6, 1.1, 0.85, 0.12, 33, 0.03), change=1.5)
    for z in (0.0, 3.0, 6.0):
        w.box((0.75, 5.56, z), (0.95, 0, 0), (0, 0.04, 0), (0, 0, 2.05), PAINT, "y1 z0")
    cols, seed = {}, 40
    for i, x in enumerate((0.0, 2.4)):
        for j, y in enumerate((0.0, 2.5, 5.0)):
            rust = ((0.34, 0.0, 0.5), (0.55, 0.26, 0.0))[i][j]
            cols[i, j] = column(w, x, y, 10.1 if j != 1 else 9.0, rust, seed)
            seed += 1
    w.flaw(cols[1, 0]["plinth"]["y0"], "stain", streak(0.2, 0.3, 0.28, 0.16, 61), change=-2.6)
    w.flaw(cols[0, 0]["plinth"]["x0"], "moisture", foot(0.1, 0.05, 62), change=-3.0)
    for (i, j), x in (((0, 0), 0.0), ((1, 0), 2.4)):  # site splices with bolts, a label, a reflecting sticker
        w.box((x - 0.06, -0.087, 4.55), (0.12, 0, 0), (0, 0.012, 0), (0, 0, 0.42), DULL, "y1")
        for dx in (-0.035, 0.035):
            for dz in (0.05, 0.14, 0.28, 0.37):
                bolt(w, (x + dx, -0.087, 4.55 + dz), (0, -1, 0), ZINC)
        w.patch((x - 0.05, -0.0765, 1.6), (0.1, 0, 0), (0, 0, 0.15), SIGN)
    w.flaw(cols[0, 0]["faces"]["y0"], "rust", streak(0.075, 4.22, 0.75, 0.13, 63), RUST)
    w.flaw(cols[1, 0]["faces"]["x1"], "white rust", flakes(0.075, 2.1, 0.12, 0.6, 0.09, 64, 0.35), WHITE_RUST)
    w.flaw(cols[0, 2]["faces"]["x0"], "white rust", flakes(0.075, 1.9, 0.12, 0.45, 0.1, 65, 0.35), WHITE_RUST)
    rise, run, n = 1.5, 2.8, 9
    lean = np.array([0, run, rise])
    perp = np.array([0, -rise, run]) / np.hypot(run, rise)
    flight = 0
    for storey in range(3):
        for half in (0, 1):
            z = 3.0 * storey + 1.5 * half
            x0 = 0.2 if half == 0 else 1.3
            y0, sign = (1.1, 1) if half == 0 else (3.9, -1)
            flip = np.array([1, sign, 1])
            for side, x in (("out", x0 - 0.008 if half == 0 else x0 + 0.9), ("in", x0 + 0.9 if half == 0 else x0 - 0.008)):
                o = np.array([x, y0, z - 0.05]) - 0.11 * perp * flip
                f = w.box(o, (0.008, 0, 0), lean * flip, 0.22 * perp * flip, ZINC)
                if side == "out":
                    face = f["x0" if half == 0 else "x1"]
                    if flight in (0, 3, 4):
                        a0, ra = (0.9, 1.9, 2.4)[flight % 3], (0.5, 0.35, 0.4)[flight % 3]
                        w.flaw(face, "white rust", flakes(a0, 0.1, ra, 0.16, 0.12, 70 + flight, 0.3), WHITE_RUST)
                    if flight in (1, 2):
                        w.flaw(face, "rust", blob(0.35 + flight, 0.05, 0.3, 0.13, 0.5, 80 + flight), RUST)
                    w.patch(
                        np.array([x + (-0.0015 if half == 0 else 0.0095), y0 + sign * 1.4, z + 0.62]),
                        0.18 * lean * flip / np.linalg.norm(lean),
                        0.07 * perp * flip,
                        SIGN,
                    )
                xr = x + 0.004
                rail(w, (xr, y0, z + 0.1), (xr, y0 + sign * run, z + rise + 0.1), 4)
            for k in range(1, n):
                yt, zt = y0 + sign * (k - 1) * run / (n - 1) * 0.99, z + k * rise / n
                grating(w, (x0, yt + (0 if sign > 0 else -0.27), zt - 0.03), (0.9, 0, 0), (0, 0.27, 0), 0.034, 0.1, False)
                w.patch((x0, yt, zt + 0.001), (0.9, 0, 0), (0, sign * 0.045, 0), DULL)
            zl, ya = z + rise, (3.9 if half == 0 else 0.0)
            grating(w, (0.08, ya, zl - 0.03), (2.24, 0, 0), (0, 1.1, 0), 0.034, 0.1, True)
            for k, y in enumerate((ya + 0.0, ya + 1.092)):
                f = w.box((0.075, y, zl - 0.2), (2.25, 0, 0), (0, 0.008, 0), (0, 0, 0.17), ZINC)
                if (half, k) == (1, 0):
                    w.flaw(f["y0"], "rust", blob(0.2 + 0.8 * storey, 0.06, 0.28, 0.09, 0.5, 90 + flight), RUST)
            for x in (0.02, 2.372):
                f = w.box((x, ya, zl - 0.2), (0.008, 0, 0), (0, 1.1, 0), (0, 0, 0.17), ZINC)
                if flight in (1, 4):
                    w.flaw(f["x0" if x < 1 else "x1"], "rust", streak(0.5, 0.17, 0.17, 0.22, 95 + flight), RUST)
            yo = 0.02 if half else 4.98
            rail(w, (0.1, yo, zl), (2.3, yo, zl), 3)
            for x in (0.03, 2.37):
                rail(w, (x, ya + 0.1, zl), (x, ya + 1.0, zl), 2)
            flight += 1
    lamp = w.surface(PAINT, none=True)  # cables down one column, a lamp
    for d in (0.0, 0.03):
        w.tube((-0.09, 0.02 + d, 0.4), (-0.09, 0.03 + d, 9.4), 0.009, lamp, ref=(1, 0, 0))
    w.box((1.1, 5.4, 2.5), (0.25, 0, 0), (0, 0.16, 0), (0, 0, 0.12), PAINT)
    ins = Instrument(0.35, 0.0018, 0.45, 24.0, 3.2, 20.0, -17.0)
    stations = [
        Station((0.9, -6.3, 1.72), (62, 115), (-14, 56), 0.0, 0.066),
        Station((6.9, -2.4, 1.68), (98, 172), (-14, 57), 0.9, 0.066),
    ]
    w.write(folder, stations, ins, (564218.4, 5931877.2, 14.6), 37.0, 25832, "stair tower")
