"""Plant scenes: pipe rack, tank wall, switchgear."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .caster import Body, Material, Scanner, World, blotch, both, dots, lines, rect, runs

ZINC = Material(-3.5, lobe=2.2, width=0.3, mottle=0.25, wave=0.2, grain=0.6)
CLADDING = Material(-4.5, power=0.9, lobe=5.0, width=0.27, mottle=0.25, wave=0.5, mirror=0.1)
STAINLESS = Material(-5.5, power=0.9, lobe=8.0, width=0.22, mottle=0.25, wave=0.4, mirror=0.15)
PRIMER = Material(-5.0, lobe=0.3, mottle=0.2)
GREY = Material(-4.0, lobe=0.9, width=0.22, mottle=0.16)
YELLOW = Material(-2.4, lobe=1.2, width=0.2, mottle=0.15)
PVC = Material(-2.8, lobe=1.6, width=0.18, mottle=0.1)
RUBBER = Material(-9.0, power=0.9, lobe=0.2, mottle=0.2)
SLAB = Material(-4.5, power=0.8, mottle=0.5, wave=0.6)


def i_beam(w: World, p0, p1, up, high: float, wide: float, mat: Material) -> list[Body]:
    """An I section: web and two flanges."""
    p0, p1, up = (np.asarray(v, float) for v in (p0, p1, up))
    side = np.cross(up, p1 - p0)
    made = [w.bar(p0, p1, side, high - 0.02, 0.008, mat)]
    for e in (-1, 1):
        d = e * (high / 2 - 0.006) * up
        made.append(w.bar(p0 + d, p1 + d, up, wide, 0.012, mat))
    return made


def elbow(w: World, start, big: float, radius: float, mat: Material, way: int) -> Body:
    """A quarter bend: a pipe that comes along x turns down."""
    x = np.array([way, 0, 0.0])
    y = np.array([0, 0, 1.0])
    return w.add("torus", np.asarray(start, float) - big * y, [x, y, np.cross(x, y)], (big, radius), mat)


def flange(w: World, at, axis, radius: float, mat: Material) -> None:
    """A pair of flanges with a gap for the gasket, and eight bolts."""
    at, axis = np.asarray(at, float), np.asarray(axis, float)
    for e in (-1, 1):
        w.pipe(at + e * 0.004 * axis, at + e * 0.03 * axis, radius + 0.035 + 0.15 * radius, mat)
    a, b = np.cross(axis, (0.3, 0.9, 0.31)), None
    a /= np.linalg.norm(a)
    b = np.cross(axis, a)
    for k in range(8):
        p = at + (radius + 0.02 + 0.1 * radius) * (np.cos(k * np.pi / 4) * a + np.sin(k * np.pi / 4) * b)
        w.pipe(p - 0.05 * axis, p + 0.05 * axis, 0.009, mat, soft=True)


def rack(folder: Path) -> None:
    """Pipe rack."""
    device = Scanner(0.07, 0.25e-3, 0.0014, 0.4, near=2.8, pulsed=False, const=41.5, stripe=0.07)
    w = World(202, device, (382915.0, 5712640.0, 61.0), 148.0)
    tops = (1.0, 2.35, 3.7)
    columns = []
    for x in (-4.4, 0.2, 4.8):
        for y in (0.12, 2.3):
            columns.append(i_beam(w, (x, y, 0), (x, y, 4.3), (0, -1, 0), 0.16, 0.16, GREY))
        for z in tops:
            i_beam(w, (x, 0.22, z - 0.07), (x, 2.2, z - 0.07), (0, 0, 1), 0.14, 0.14, GREY)
        w.box((x - 0.2, -0.1, 0.0), (x + 0.2, 0.32, 0.02), GREY)
    # y, height of the beam, diameter, coating, pitch of lap joints, x of a flange
    spec = [
        (0.45, 0, 0.05, ZINC, 0, None),
        (0.75, 0, 0.10, PRIMER, 0, None),
        (1.05, 0, 0.168, PVC, 0, None),
        (1.60, 0, 0.40, CLADDING, 1.0, None),
        (0.42, 1, 0.08, YELLOW, 0, None),
        (0.80, 1, 0.14, STAINLESS, 0, None),
        (1.22, 1, 0.273, GREY, 0, -1.1),
        (1.80, 1, 0.324, CLADDING, 0.95, None),
        (0.55, 2, 0.06, ZINC, 0, None),
        (1.25, 2, 0.20, PRIMER, 0, 1.6),
    ]
    pipes: list[list[Body]] = []
    for y, level, dia, mat, pitch, joint in spec:
        z = tops[level] + dia / 2 + 0.04
        ends = [-6.2, 6.2] if joint is None else [-6.2, joint, 6.2]
        parts = []
        for a, b in zip(ends[:-1], ends[1:], strict=True):
            p = w.pipe((a, y, z), (b, y, z), dia / 2, mat)
            length = b - a
            if pitch:
                at = list(np.arange(-length / 2 + 0.4, length / 2, pitch))
                w.design(p, 0, lines(at, 0.035), -0.7, height=0.002)
            elif mat is not ZINC:
                w.design(p, 0, lines([-length / 2 + 2.1], 0.016), 0.9)
            parts.append(p)
        if joint is not None:
            flange(w, (joint, y, z), (1, 0, 0), dia / 2, mat)
        for x in (-4.4, 0.2, 4.8):  # shoe and clamp
            w.box((x - 0.06, y - 0.3 * dia, tops[level]), (x + 0.06, y + 0.3 * dia, z - 0.42 * dia), GREY)
            w.pipe((x - 0.02, y, z), (x + 0.02, y, z), dia / 2 + 0.005, ZINC)
        pipes.append(parts)
    # Two pipes on brackets before the columns turn down through elbows.
    z3, z2 = 3.45, 2.0
    big = w.pipe((-1.9, -0.22, z3), (6.2, -0.22, z3), 0.11, RUBBER)
    elbow(w, (-1.9, -0.22, z3), 0.33, 0.11, RUBBER, -1)
    fall = w.pipe((-2.23, -0.22, z3 - 0.33), (-2.23, -0.22, 0.9), 0.11, RUBBER)
    foot = w.pipe((-2.23, -0.22, 0.9), (-2.23, -0.22, 0.0), 0.0845, GREY)
    flange(w, (-2.23, -0.22, 0.78), (0, 0, 1), 0.0845, GREY)
    small = w.pipe((-6.2, -0.16, z2), (2.3, -0.16, z2), 0.057, GREY)
    elbow(w, (2.3, -0.16, z2), 0.171, 0.057, GREY, 1)
    drop = w.pipe((2.471, -0.16, z2 - 0.171), (2.471, -0.16, 0.0), 0.057, GREY)
    flange(w, (2.471, -0.16, 0.75), (0, 0, 1), 0.057, GREY)
    for x in (-4.4, 0.2, 4.8):
        if x > -2:
            w.box((x - 0.04, -0.34, z3 - 0.16), (x + 0.04, 0.04, z3 - 0.11), GREY)
        if x < 2:
            w.box((x - 0.03, -0.24, z2 - 0.1), (x + 0.03, 0.04, z2 - 0.057), GREY)
    w.design(big, 0, rect(-0.2, 0.2, 1.2, 1.5), 4.5)  # label of the medium
    w.design(pipes[6][1], 0, rect(-0.2, 0.2, 2.0, 2.45), 2.6)
    w.design(pipes[3][0], 0, rect(-0.2, 0.15, 1.6, 2.0), 2.0)
    w.wire([(x, 0.0, 2.9 - 0.12 * np.sin(np.pi * (x + 6) / 3) ** 2) for x in np.linspace(-6, 6, 33)], 0.011, RUBBER)
    w.wire([(x, 0.02, 2.86 - 0.15 * np.sin(np.pi * (x + 6) / 3) ** 2) for x in np.linspace(-6, 6, 33)], 0.007, RUBBER)
    w.box((-20, -12, -0.5), (20, 10, 0), SLAB)
    w.box((-20, 7.5, 0), (20, 7.8, 6), Material(-3.0, power=0.85, mottle=0.4))
    w.anomaly(pipes[1][0], 0, blotch(0.02, -1.6, 0.07, 0.36, 21), -2.6, "rust")
    w.anomaly(pipes[2][0], 0, blotch(-0.02, 1.9, 0.14, 0.3, 23), -2.2, "leak stain")
    w.anomaly(pipes[3][0], 0, blotch(0.0, -1.7, 0.33, 0.4, 25, rough=0.3), -2.4, "rust stain on the cladding", lobe=-2.0)
    w.anomaly(pipes[6][0], 0, blotch(0.08, 2.1, 0.2, 0.3, 26), -3.1, "leak stain below the flange", lobe=-0.2)
    w.anomaly(pipes[6][1], 0, blotch(0.1, 0.4, 0.16, 0.4, 27), -2.4, "rust", lobe=-0.5)
    w.anomaly(pipes[7][0], 0, blotch(0.2, 3.0, 0.26, 0.45, 28), -1.9, "damp insulation, stain on the cladding", lobe=-1.5)
    w.anomaly(pipes[9][0], 0, blotch(0.1, 0.6, 0.16, 0.42, 29), -2.0, "rust")
    w.anomaly(big, 0, blotch(0.03, -1.2, 0.14, 0.33, 30), 2.4, "white salt crust of a leak")
    w.anomaly(fall, 0, blotch(0.0, -0.3, 0.12, 0.3, 31), 1.6, "worn foam")
    w.anomaly(drop, 0, blotch(0.0, 0.5, 0.09, 0.2, 32), -2.8, "rust", lobe=-0.5)
    w.anomaly(small, 0, blotch(0.02, 1.2, 0.07, 0.3, 33), -1.5, "rust", lobe=-0.3)
    w.anomaly(columns[0][2], 3, blotch(0.9, 0.0, 0.35, 0.08, 34), -2.5, "rust", lobe=-0.5)
    w.anomaly(columns[2][2], 3, blotch(-1.2, 0.02, 0.3, 0.07, 35), -2.9, "rust", lobe=-0.5)
    w.anomaly(foot, 0, blotch(0.0, -0.15, 0.1, 0.14, 36), -2.2, "rust")
    w.station((-2.7, -5.0, 1.6), 84, 44, -15, 33)
    w.station((2.9, -5.6, 1.62), 98, 42, -13, 30)
    w.write(folder)


def tank(folder: Path) -> None:
    """Tank wall."""
    coat = Material(-2.6, lobe=0.9, width=0.26, mottle=0.16, wave=0.8)
    w = World(303, Scanner(0.085, 0.3e-3, 0.0018, 0.5, near=4.0, const=42.5), (459330.0, 5811752.0, 33.0), 201.0)
    wall = w.pipe((0, 8, 0.25), (0, 8, 10.25), 8.0, coat)
    half = 5.0
    levels = [-3.0, -1.0, 1.0, 3.0]  # courses of 2 m
    w.design(wall, 0, lines(levels, 0.03, along="s"), -0.5, height=0.002)
    for i in range(5):
        lo = -half if i == 0 else levels[i - 1]
        hi = half if i == 4 else levels[i]
        at = list(np.arange(-24, 25, 6.0) + 1.7 * i % 6.0 + 0.4)
        w.design(wall, 0, lines(at, 0.026, lo=lo, hi=hi), -0.5, height=0.002)
    w.design(wall, 0, rect(4.2, 5.6, 1.4, 2.3), -1.9)  # number of the tank, dark field
    w.design(wall, 0, rect(4.5, 4.7, 1.55, 2.15), 1.9)
    w.design(wall, 0, rect(4.95, 5.15, 1.55, 2.15), 1.9)
    w.pipe((0, 8, 0.0), (0, 8, 0.25), 8.12, SLAB)
    w.pipe((0, 8, 10.15), (0, 8, 10.25), 8.09, coat)  # curb
    # Ladder with cage before the wall at x = 1.1.
    x0, y0 = 1.1, -0.2
    for e in (-1, 1):
        w.box((x0 + e * 0.22 - 0.006, y0 - 0.035, 0.5), (x0 + e * 0.22 + 0.006, y0 + 0.03, 10.9), ZINC)
        for z in (1.5, 3.5, 5.5, 7.5, 9.5):
            w.box((x0 + e * 0.22 - 0.02, y0 + 0.03, z), (x0 + e * 0.22 + 0.02, 0.09, z + 0.05), ZINC)
    for z in np.arange(0.7, 10.8, 0.28):
        w.pipe((x0 - 0.22, y0, z), (x0 + 0.22, y0, z), 0.011, ZINC)
    arc = np.radians(np.linspace(0, 180, 11))
    for z in np.arange(2.6, 10.8, 1.1):
        w.wire([(x0 + 0.35 * np.cos(a), y0 - 0.68 * np.sin(a), z) for a in arc], 0.012, ZINC)
    for a in np.radians([40, 90, 140]):
        p = (x0 + 0.35 * np.cos(a), y0 - 0.68 * np.sin(a))
        w.pipe((*p, 2.6), (*p, 10.8), 0.01, ZINC, soft=True)
    # Manhole, nozzle with flange, rising pipe on supports.
    for s, z, r, out in ((-3.2, 1.1, 0.34, 0.25), (-1.9, 6.4, 0.11, 0.3)):
        n = np.array([np.sin(s / 8), -np.cos(s / 8), 0])
        c = np.array([0, 8, z]) + 8 * n
        w.pipe(c - 0.1 * n, c + out * n, r, coat)
        w.pipe(c + out * n, c + (out + 0.035) * n, r + 0.08, coat)
        w.pipe(c + (out + 0.035) * n, c + (out + 0.07) * n, r + 0.075, coat)
    w.pipe((3.4, 0.3, 0.0), (3.4, 0.3, 9.9), 0.08, GREY)
    for z in (2.0, 4.5, 7.0):
        w.box((3.35, 0.35, z), (3.45, 0.9, z + 0.06), GREY)
    w.box((-30, -16, -0.6), (30, 6, 0.0), SLAB)
    w.add("bush", (-6.2, -3.4, 0.4), np.eye(3), (0.7, 0.7, 0.7), Material(-3.0, power=0.5))
    w.wire([(-30, -2.0, 0.9), (-5, -2.0, 0.85), (30, -2.0, 0.9)], 0.012, ZINC)
    rng = np.random.default_rng(33)
    a = [(-0.9 + 0.42 * i + rng.normal(0, 0.05), 4.85, rng.uniform(1.9, 3.3), rng.uniform(0.26, 0.42)) for i in range(-4, 2)]
    w.anomaly(wall, 0, runs(a, 41), -2.5, "rust runs from the curb", lobe=-0.4)
    c = [(3.0 + d, 4.85, length, 0.3) for d, length in ((-0.85, 6.1), (-0.3, 7.8), (-0.05, 5.2), (0.95, 4.6), (1.3, 6.2))]
    w.anomaly(wall, 0, runs(c, 61), -1.7, "rust runs from the curb", lobe=-0.3)
    w.anomaly(wall, 0, rect(-5.5, -3.5, -2.3, -0.5, edge=0.03), 1.5, "repainted patch", lobe=0.5, uneven=0.06)
    d = [(-2.02, 1.05, 5.0, 0.45), (-1.88, 1.05, 5.7, 0.55), (-1.68, 1.05, 3.4, 0.4)]
    w.anomaly(wall, 0, both(runs(d, 71), blotch(-1.85, -4.55, 0.9, 0.35, 72)), -3.0, "product run below the nozzle", lobe=0.3)
    w.station((-4.2, -7.2, 1.65), 70, 46, -6, 50)
    w.station((3.6, -8.0, 1.7), 108, 44, -6, 48)
    w.write(folder)


def switchgear(folder: Path) -> None:
    """Switchgear cabinets in a room; clean."""
    coat = Material(-2.9, lobe=1.1, width=0.2, mottle=0.08, wave=0.6)
    pale = Material(-2.2, lobe=1.0, width=0.2, mottle=0.08, wave=0.6)
    red = Material(-3.9, lobe=1.4, width=0.18, mottle=0.08, wave=0.6)
    plaster = Material(-1.6, power=0.95, mottle=0.12, wave=1.0)
    floor = Material(-4.2, power=0.9, lobe=1.5, width=0.2, mottle=0.2, wave=0.8)
    black = Material(-8.0, lobe=0.8, width=0.2, mottle=0.1)
    device = Scanner(0.1, 0.4e-3, 0.0012, 0.35, near=1.8, pulsed=False, const=38, stripe=0.04)
    w = World(505, device, (611044.0, 5480277.0, 305.0), 12.0)
    w.box((-4.2, -5.0, -0.2), (5.0, 1.6, 0.0), floor)
    w.box((-4.2, -5.0, 3.0), (5.0, 1.6, 3.2), plaster)
    w.box((-4.2, 1.3, 0.0), (5.0, 1.6, 3.0), plaster)
    w.box((-4.4, -5.0, 0.0), (-4.2, 1.6, 3.0), plaster)
    w.box((5.0, -5.0, 0.0), (5.2, 1.6, 3.0), plaster)
    w.box((-4.2, -5.2, 0.0), (5.0, -5.0, 3.0), plaster)
    w.box((-3.0, -0.95, 0.0), (2.9, -0.12, 0.006), Material(-7.5, power=0.8, mottle=0.25))  # rubber mat
    widths = [0.8, 0.8, 0.6, 0.8, 1.0, 0.8, 0.8]
    kinds = [coat, coat, pale, coat, coat, red, coat]
    x = -2.9
    for i, (wide, mat) in enumerate(zip(widths, kinds, strict=True)):
        w.box((x + 0.004, 0.02, 0.1), (x + wide - 0.004, 0.62, 2.15), coat)
        w.box((x, 0.05, 0.0), (x + wide, 0.6, 0.1), black)
        two = i in (1, 4)
        cuts = [0.12, 1.1, 2.13] if two else [0.12, 2.13]
        for a, b in zip(cuts[:-1], cuts[1:], strict=True):
            door = w.box((x + 0.012, 0.0, a + 0.006), (x + wide - 0.012, 0.02, b - 0.006), mat)
            h, r = (b - a) / 2, wide / 2
            top = h - 0.18
            w.design(door, 2, rect(-0.16, 0.16, top - 0.035, top + 0.035), 1.6)  # name plate
            if i in (0, 2, 3, 5):
                w.design(door, 2, lambda s, t, z=top - 0.3: ((t > z) & (t - z + 1.7 * np.abs(s) < 0.14)).astype(float), 2.3)
            if i in (1, 3, 6):  # instrument behind glass, lamps
                w.design(door, 2, rect(-0.19, -0.05, top - 0.3, top - 0.16), -5.0, lobe=2.0, drop=0.5)
                w.design(door, 2, rect(0.05, 0.19, top - 0.3, top - 0.16), -5.0, lobe=2.0, drop=0.5)
                lamps = [(-0.12, top - 0.4), (0.0, top - 0.4), (0.12, top - 0.4)]
                w.design(door, 2, dots(lamps, 0.015), 3.0, height=0.012, soft=True)
            if i in (0, 4, 5):  # louvres: slots 12 mm high
                slots = list(np.arange(-h + 0.12, -h + 0.36, 0.03))
                w.design(door, 2, lines(slots, 0.012, along="s", lo=-0.22, hi=0.22), -4.0, height=-0.01, soft=True)
            if i == 3:  # painted stripe of the busbar section
                w.design(door, 2, rect(-r, r, -0.55, -0.49), -1.8)
            if i == 6:  # reflecting sticker
                w.design(door, 2, rect(-0.1, 0.1, -0.2, -0.1), 5.0)
            hx = x + wide - 0.09
            w.box((hx - 0.016, -0.045, (a + b) / 2 - 0.11), (hx + 0.016, -0.012, (a + b) / 2 + 0.11), black)
            for z in ((a + b) / 2 - 0.08, (a + b) / 2 + 0.08):
                w.box((hx - 0.012, -0.014, z - 0.012), (hx + 0.012, 0.0, z + 0.012), black)
            for z in (a + 0.15, b - 0.15):
                w.pipe((x + 0.016, -0.008, z - 0.04), (x + 0.016, -0.008, z + 0.04), 0.008, ZINC)
        x += wide
    w.box((x + 0.01, 0.0, 0.1), (x + 0.02, 0.62, 2.15), STAINLESS)  # bare end plate

    # Tray of mesh above, conduits, cables that hang before the doors, an extinguisher, a stool.
    def mesh(s, t):
        return (((s % 0.05) > 0.006) & ((t % 0.1) > 0.006)).astype(float)

    w.box((-4.1, -0.35, 2.55), (4.9, 0.05, 2.556), ZINC, soft=True, hole=mesh)
    w.box((-4.1, -0.356, 2.55), (4.9, -0.35, 2.61), ZINC, soft=True, hole=mesh)
    for y, r in ((-0.28, 0.02), (-0.2, 0.014), (-0.12, 0.024), (-0.03, 0.012)):
        w.wire([(u, y + 0.02 * np.sin(3 * u + 9 * y), 2.56 + r) for u in np.linspace(-4.1, 4.9, 19)], r, RUBBER)
    z = np.linspace(0, 1, 12)
    hanging = ((-1.75, -1.55, 0.016, 0.1), (-1.6, -1.2, 0.011, 0.2), (1.0, 0.5, 0.018, 0.15), (1.12, 1.05, 0.009, 0.06))
    for x1, x2, r, sag in hanging:
        along = x1 + (x2 - x1) * z**2 + 0.03 * np.sin(5 * z)
        w.wire(np.c_[along, -0.3 + 0.15 * z - sag * np.sin(np.pi * z), 2.58 - 2.55 * z], r, RUBBER)
    for x1 in (3.3, 3.4, 3.55):
        w.pipe((x1, 1.27, 0.2), (x1, 1.27, 2.9), 0.0125, PVC)
    w.pipe((3.95, 0.9, 0.15), (3.95, 0.9, 0.7), 0.085, red)
    w.pipe((3.95, 0.9, 0.7), (3.95, 0.9, 0.82), 0.025, black)
    w.box((-3.9, -0.1, 0.45), (-3.55, 0.25, 0.48), Material(-3.2, power=0.9, mottle=0.2))
    for e in (-3.88, -3.57):
        for y in (-0.08, 0.23):
            w.pipe((e, y, 0), (e, y, 0.45), 0.012, ZINC)
    w.box((-2.0, -0.3, 2.93), (-0.8, -0.16, 2.99), pale)
    w.box((0.8, -0.3, 2.93), (2.0, -0.16, 2.99), pale)
    w.station((-1.4, -3.5, 1.55), 84, 50, -28, 29)
    w.station((1.9, -3.9, 1.6), 100, 48, -26, 27)
    w.write(folder)
