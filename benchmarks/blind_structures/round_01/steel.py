"""Steel scenes: lattice girder bridge and weathering box girder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .caster import Material, Scanner, World, blotch, both, dots, lines, rect, runs

PAINT = Material(-4.0, lobe=0.8, width=0.22, mottle=0.18, wave=0.5)
OLD_PAINT = Material(-4.6, lobe=0.5, width=0.28, mottle=0.25, wave=0.4)
GROUND = Material(-6.0, power=0.7, mottle=0.9, wave=0.6, grain=0.4)
LEAVES = Material(-3.0, power=0.5)
CONCRETE = Material(-4.0, power=0.85, mottle=0.4, wave=0.5)


def angle(w: World, p0, p1, leg: float, thick: float, mat: Material, edge: float, front: bool) -> tuple:
    """An angle section of a double angle in the plane y = 0: the leg on the gusset, and the outstanding one."""
    sign = -1.0 if front else 1.0
    y = sign * (0.006 + thick / 2)
    flat = w.bar(p0, p1, (0, 1, 0), leg, thick, mat, out=y)
    out = w.bar(
        p0,
        p1,
        (0, 1, 0),
        thick,
        leg - thick,
        mat,
        out=sign * (0.006 + thick + (leg - thick) / 2),
        shift=edge * (leg - thick) / 2,
    )
    return flat, out


def truss(w: World, y: float, x0: float, panel: float, count: int, z0: float, high: float, mat: Material) -> dict:
    """One truss: chords, posts, diagonals of double angles, gussets with bolts."""
    made: dict = {}
    first = len(w.bodies)
    xs = x0 + panel * np.arange(count + 1)
    for front in (True, False):
        made["bottom", front] = angle(w, (xs[0] - 0.4, 0, z0), (xs[-1] + 0.4, 0, z0), 0.14, 0.013, mat, 1, front)
        made["top", front] = angle(w, (xs[0] - 0.4, 0, z0 + high), (xs[-1] + 0.4, 0, z0 + high), 0.14, 0.013, mat, -1, front)
        for i, x in enumerate(xs):
            made["post", i, front] = angle(w, (x, 0, z0 + 0.08), (x, 0, z0 + high - 0.08), 0.1, 0.01, mat, 1, front)
        for i in range(count):
            a, b = (xs[i], z0), (xs[i + 1], z0 + high)
            if i >= count / 2:
                a, b = (xs[i], z0 + high), (xs[i + 1], z0)
            u = np.array([b[0] - a[0], b[1] - a[1]]) / np.hypot(b[0] - a[0], b[1] - a[1])
            p, q = np.array(a) + 0.24 * u, np.array(b) - 0.24 * u
            made["diagonal", i, front] = angle(w, (p[0], 0, p[1]), (q[0], 0, q[1]), 0.11, 0.011, mat, 1, front)
    for i, x in enumerate(xs):
        for level, z in (("low", z0 + 0.13), ("high", z0 + high - 0.13)):
            g = w.box((x - 0.33, -0.006, z - 0.23), (x + 0.33, 0.006, z + 0.23), mat)
            made["gusset", i, level] = g
    for b in w.bodies[first:]:
        b.centre = b.centre + np.array([0, y, 0])
    # Heads of bolts on the front legs near the joints: 24 mm wide, 12 mm high.
    for key, pair in made.items():
        if key[-1] is True:
            length = pair[0].size[0]
            if key[0] in ("bottom", "top"):
                at = [(x - (xs[0] + xs[-1]) / 2 + dx, 0.0) for x in xs for dx in (-0.24, -0.12, 0.12, 0.24)]
            else:
                at = [(e * (length - d), 0.0) for e in (-1, 1) for d in (0.05, 0.12, 0.19)]
            w.design(pair[0], 2, dots(at, 0.013), -1.0, height=0.012, soft=True)
    return made


def lattice(folder: Path) -> None:
    """Lattice girder bridge, painted, rust."""
    w = World(101, Scanner(0.055, 0.30e-3, 0.0016, 0.45, near=3.5), (567214.0, 5934108.0, 12.0), 33.0)
    z0, high = 2.3, 2.4
    t1 = truss(w, 0.0, -4.8, 2.4, 4, z0, high, PAINT)
    truss(w, 4.2, -4.8, 2.4, 4, z0, high, OLD_PAINT)
    for x in -4.8 + 2.4 * np.arange(5):  # cross beams below the deck
        w.box((x - 0.006, 0.15, z0 - 0.2), (x + 0.006, 4.05, z0 + 0.2), OLD_PAINT)
        w.box((x - 0.09, 0.15, z0 + 0.2), (x + 0.09, 4.05, z0 + 0.214), OLD_PAINT)
        w.box((x - 0.09, 0.15, z0 - 0.214), (x + 0.09, 4.05, z0 - 0.2), OLD_PAINT)
    for y in (0.9, 2.1, 3.3):
        w.box((-5.3, y - 0.06, z0 + 0.214), (5.3, y + 0.06, z0 + 0.4), OLD_PAINT)
    w.box((-5.3, 0.4, z0 + 0.4), (5.3, 3.8, z0 + 0.46), CONCRETE)
    w.box((-6.0, -0.6, -1.0), (-5.1, 4.8, z0 - 0.2), CONCRETE)
    w.box((-25, -14, -1.0), (25, 25, 0.0), GROUND)
    w.add("bush", (3.9, -1.4, 0.9), np.eye(3), (1.0, 0.7, 1.05), LEAVES)
    w.add("bush", (-3.0, 2.0, 0.7), np.eye(3), (1.2, 1.0, 0.9), LEAVES)
    w.wire([(x, -0.16, z0 + 0.52 - 0.1 * np.sin(np.pi * (x + 5) / 2.5) ** 2) for x in np.linspace(-5, 5, 25)], 0.008, OLD_PAINT)
    # A painted stripe on the bottom chord and an enamel plate are design.
    w.design(t1["bottom", True][0], 2, rect(-5.0, -4.5, -0.07, 0.07), 3.0)
    w.design(t1["gusset", 2, "low"], 2, rect(0.17, 0.29, 0.08, 0.16), 2.5)
    rust = "rust"
    pair = both(blotch(-1.1, -0.02, 0.38, 0.06, 11), blotch(-0.75, -0.03, 0.15, 0.05, 12))
    w.anomaly(t1["bottom", True][0], 2, pair, -3.2, rust, lobe=-0.5)
    w.anomaly(t1["bottom", True][0], 2, blotch(3.55, -0.01, 0.26, 0.07, 13), -2.4, rust, lobe=-0.5)
    w.anomaly(t1["gusset", 1, "low"], 2, blotch(0.22, 0.06, 0.13, 0.11, 14), -3.6, rust, lobe=-0.6)
    w.anomaly(t1["gusset", 3, "low"], 2, blotch(-0.2, 0.07, 0.12, 0.12, 15), -2.8, rust, lobe=-0.6)
    w.anomaly(t1["gusset", 2, "high"], 2, blotch(-0.2, -0.12, 0.14, 0.11, 16), -2.4, rust, lobe=-0.5)
    w.anomaly(t1["post", 1, True][0], 2, blotch(-0.55, 0.0, 0.22, 0.05, 17), -3.0, rust, lobe=-0.5)
    w.anomaly(t1["post", 3, True][0], 2, blotch(0.3, 0.01, 0.3, 0.04, 18), -1.7, rust, lobe=-0.3)
    w.anomaly(t1["diagonal", 0, True][0], 2, blotch(-0.7, -0.01, 0.28, 0.05, 19), -2.7, rust, lobe=-0.5)
    w.anomaly(t1["diagonal", 2, True][0], 2, blotch(0.5, 0.0, 0.2, 0.06, 20), 1.9, "peeled paint down to primer")
    w.anomaly(t1["diagonal", 3, True][1], 2, blotch(0.2, 0.0, 0.3, 0.02, 21), -2.0, rust)
    w.anomaly(t1["top", True][0], 2, blotch(1.15, 0.0, 0.3, 0.055, 22), -2.6, rust, lobe=-0.5)
    w.station((-1.8, -6.6, 1.7), 80, 37, -6, 28)
    w.station((2.6, -7.4, 1.75), 104, 35, -6, 25)
    w.write(folder)


def weathering(folder: Path) -> None:
    """Box girder of weathering steel."""
    # The rust layer is rough: no lobe to speak of; the mottle of some tenths of dB runs down the web.
    corten = Material(-5.2, power=0.8, mottle=0.38, wave=0.45, grain=0.25)
    splice = Material(-5.0, power=0.8, mottle=0.35, wave=0.3, grain=0.25)
    w = World(606, Scanner(0.065, 0.35e-3, 0.002, 0.5, near=2.5, const=41), (691480.0, 5336910.0, 518.0), -71.0)
    tilt = np.radians(14)
    side = np.array([0, -np.cos(tilt), -np.sin(tilt)])  # outward normal of the near web, which leans out to the top
    up = np.cross((1, 0, 0), side)
    up = up if up[2] > 0 else -up
    foot = np.array([0, -1.1, 4.0])
    mid = foot + 0.95 * up
    web = w.add("box", mid, [(1, 0, 0), -side, up], (7.5, 0.01, 0.95), corten)  # face 2 looks to the stations
    w.box((-7.5, -1.15, 3.97), (7.5, 1.15, 4.0), corten)
    soffit = w.bodies[-1]
    far = mid * np.array([1, -1, 1])
    w.add("box", far, [(1, 0, 0), (0, -np.cos(tilt), np.sin(tilt)), (0, np.sin(tilt), np.cos(tilt))], (7.5, 0.01, 0.95), corten)
    top = foot + 1.9 * up
    w.box((-7.5, top[1] - 0.9, top[2]), (7.5, 3.2, top[2] + 0.22), CONCRETE)  # deck slab with overhang
    w.box((-7.5, top[1] - 0.9, top[2] + 0.22), (7.5, top[1] - 0.6, top[2] + 0.6), CONCRETE)
    # Field splice with bolted plates, longitudinal stiffener, vertical weld seams, drain pipe: design.
    cover = w.add("box", mid + np.array([2.2, 0, 0]) + side * 0.018, [(1, 0, 0), -side, up], (0.28, 0.008, 0.8), splice)
    grid = [(a, b) for a in (-0.2, -0.11, 0.11, 0.2) for b in np.arange(-0.7, 0.71, 0.14)]
    w.design(cover, 2, dots(grid, 0.018), -0.8, height=0.016, soft=True)
    w.add("box", mid + 0.35 * up + side * 0.07, [(1, 0, 0), -side, up], (7.5, 0.06, 0.008), corten)
    w.design(web, 2, lines([-5.0, -1.5, 5.6], 0.022), 1.1, height=0.0015)
    w.design(soffit, 4, lines([-5.0, -1.5, 5.6], 0.022), 1.0, height=0.0015)
    w.pipe((-3.2, -1.75, 5.9), (-3.2, -1.75, 3.2), 0.055, Material(-3.2, lobe=2.0, width=0.3, grain=0.5))
    for z in (3.5, 5.2):
        w.box((-3.27, -1.83, z), (-3.13, -1.66, z + 0.04), corten)
    w.box((5.0, -1.0, 0), (6.3, 1.0, 3.75), CONCRETE)
    w.box((5.3, -0.9, 3.75), (6.0, -0.4, 3.97), Material(-9.5, mottle=0.2))
    w.box((5.3, 0.4, 3.75), (6.0, 0.9, 3.97), Material(-9.5, mottle=0.2))
    w.box((-25, -16, -1), (25, 20, 0), GROUND)
    w.add("bush", (-5.6, -2.6, 1.5), np.eye(3), (1.1, 1.0, 1.7), LEAVES)
    wet = both(runs([(-0.2, 0.3, 1.22, 0.4), (0.18, 0.3, 1.0, 0.28)], 61), blotch(-0.05, 0.18, 0.35, 0.12, 62))
    w.anomaly(web, 2, wet, -2.9, "wet run", lobe=0.5)
    w.anomaly(web, 2, blotch(4.2, -0.35, 0.62, 0.3, 63, rough=0.35), 2.6, "salt stain")
    w.anomaly(
        web,
        2,
        blotch(-4.5, -0.4, 0.75, 0.36, 64, rough=0.3),
        0.35,
        "thin salt film",
        uneven=0.3,
        limit="The film differs by less than the natural mottle of the rust layer around it.",
    )
    wet = both(blotch(-2.3, -0.75, 0.9, 0.32, 65), blotch(-1.5, -0.6, 0.5, 0.3, 66))
    w.anomaly(soffit, 4, wet, -2.3, "wet run under the edge", lobe=0.4)
    w.anomaly(soffit, 4, blotch(1.7, -0.3, 0.75, 0.38, 67, rough=0.35), 2.1, "salt stain")
    w.station((-4.4, -8.2, 1.6), 66, 33, 4, 36)
    w.station((0.6, -4.9, 1.62), 90, 43, 12, 52)
    w.station((5.2, -8.0, 1.7), 117, 32, 4, 36)
    w.write(folder)
