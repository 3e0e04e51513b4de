"""Concrete scene: a bridge abutment with two elastomeric bearings."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .caster import Material, Scanner, World, blotch, both, dots, lines, runs

WALL = Material(-3.6, power=0.9, mottle=0.32, wave=0.6, grain=0.15)
GIRDER = Material(-3.0, power=0.9, lobe=0.15, mottle=0.22, wave=0.5)
SHELF = Material(-4.6, power=0.8, mottle=0.5, wave=0.4)
PLATE = Material(-4.2, lobe=1.2, width=0.3, mottle=0.2, wave=0.1)
RUBBER = Material(-9.3, power=0.9, lobe=0.3, mottle=0.15, wave=0.1)
EARTH = Material(-6.0, power=0.7, mottle=0.9, wave=0.5, grain=0.5)


def abutment(folder: Path) -> None:
    """Abutment under the end of a bridge, seen from below the span."""
    w = World(404, Scanner(0.06, 0.28e-3, 0.0015, 0.4, near=3.2), (533870.0, 5402615.0, 271.0), 78.0)
    left = w.box((-4.6, 0.0, -0.4), (-0.01, 1.6, 2.3), WALL)
    right = w.box((0.01, 0.0, -0.4), (4.6, 1.6, 2.3), WALL)
    for wall in (left, right):
        wall.mats[5] = SHELF
        # Joints of the formwork, each board a little different, and tie holes with plugs.
        w.design(wall, 2, lines([-1.1, 1.3], 0.012), -0.8, height=0.002)
        w.design(wall, 2, lines([0.1], 0.010, along="s"), -0.6, height=0.002)
        ties = [(a, b) for a in (-1.7, -0.5, 0.7, 1.9) for b in (-0.5, 0.7)]
        w.design(wall, 2, dots(ties, 0.016), -2.5, height=-0.012, soft=True)
    back = w.box((-4.6, 0.95, 2.3), (4.6, 1.3, 4.4), WALL)
    w.design(back, 2, lines([-2.4, 0.0, 2.4], 0.012), -0.7)
    # A wing wall that comes forward on the left.
    a = np.radians(62)
    n = np.array([np.sin(a), -np.cos(a), 0])  # towards the stream
    along = np.array([-np.cos(a), -np.sin(a), 0])
    mid = np.array([-4.6, 0.02, 1.5]) + 2.2 * along - 0.2 * n
    wing = w.add("box", mid, [along, n, np.cross(along, n)], (2.2, 0.2, 1.9), WALL)
    up = np.sign(np.cross(along, n)[2])
    w.design(wing, 3, lines([-0.7, 0.9], 0.012), -0.7)
    w.design(wing, 3, dots([(p, q) for p in (-1.4, 0.1, 1.6) for q in (-1.0, 0.6)], 0.016), -2.5, height=-0.012, soft=True)
    plates = []
    for x in (-1.9, 1.9):
        w.box((x - 0.42, 0.16, 2.3), (x + 0.42, 0.78, 2.42), GIRDER)  # pedestal
        low = w.box((x - 0.31, 0.2, 2.42), (x + 0.31, 0.7, 2.46), PLATE)
        pad = w.box((x - 0.25, 0.25, 2.46), (x + 0.25, 0.65, 2.6), RUBBER)
        w.design(pad, 2, lines([-0.035, 0.0, 0.035], 0.005, along="s"), 0.5)  # bulges between the inner plates
        high = w.box((x - 0.31, 0.2, 2.6), (x + 0.31, 0.7, 2.64), PLATE)
        w.box((x - 0.4, -13, 2.64), (x + 0.4, 0.85, 2.86), GIRDER)
        w.box((x - 0.1, -13, 2.86), (x + 0.1, 0.85, 3.75), GIRDER)
        w.box((x - 0.5, -13, 3.75), (x + 0.5, 0.85, 3.87), GIRDER)
        plates.append((low, high))
    w.box((-1.8, 0.3, 2.95), (1.8, 0.6, 3.75), GIRDER)  # end cross beam
    w.box((-4.4, -13, 3.87), (4.4, 0.9, 4.1), GIRDER)
    w.pipe((-3.9, -0.09, 3.8), (-3.9, -0.09, 0.1), 0.055, Material(-2.8, lobe=1.5, width=0.2))
    for z in (0.7, 2.0):
        w.box((-3.98, -0.16, z), (-3.82, 0.0, z + 0.03), PLATE)
    w.wire([(x, 0.85, 3.5 - 0.1 * np.sin(np.pi * (x + 4.6) / 2.3) ** 2) for x in np.linspace(-4.6, 4.6, 25)], 0.01, RUBBER)
    w.box((-20, -14, -1.4), (20, 0.5, -0.25), EARTH)
    w.add("bush", (3.6, -0.9, 0.0), np.eye(3), (0.8, 0.5, 0.6), Material(-3.0, power=0.5))
    w.add("bush", (-5.4, -2.6, -0.1), np.eye(3), (0.5, 0.6, 0.4), Material(-3.0, power=0.5))
    # s from the middle of each half wall, t from its mid height (0.95 m).
    rng = np.random.default_rng(44)
    bars = []
    for i in range(6):
        s = -1.25 + 0.2 * i + rng.normal(0, 0.02)
        bars.append((s, 0.75 + rng.normal(0, 0.08), rng.uniform(0.5, 1.0), rng.uniform(0.10, 0.16)))
    w.anomaly(left, 2, runs(bars, 81), -2.1, "rebar stains")
    wet = both(blotch(1.75, 0.75, 0.45, 0.45, 82), runs([(1.6, 0.6, 1.7, 0.5), (2.0, 0.6, 1.3, 0.35)], 83))
    w.anomaly(left, 2, wet, -3.0, "moisture at the joint", lobe=0.2)
    drips = runs([(-0.9, 0.5, 0.8, 0.14), (-0.5, 0.5, 1.1, 0.16), (-0.2, 0.5, 0.6, 0.1)], 85)
    w.anomaly(right, 2, both(blotch(-0.6, 0.5, 0.55, 0.16, 84, rough=0.4), drips), 2.4, "efflorescence")
    w.anomaly(right, 2, both(blotch(1.1, -0.55, 0.42, 0.3, 86), blotch(0.7, -0.65, 0.3, 0.18, 87)), -2.3, "moisture")
    bars = [(1.5 + 0.18 * i, 1.1 + rng.normal(0, 0.06), rng.uniform(0.6, 0.9), 0.16) for i in range(4)]
    w.anomaly(right, 2, runs(bars, 88), -1.5, "rebar stains")
    w.anomaly(back, 2, blotch(0.25, -0.35, 0.75, 0.4, 89), -2.4, "moisture below the expansion joint", lobe=0.2)
    crust = [blotch(-1.5 + 0.45 * k, up * (0.1 - 0.2 * k), 0.28, 0.22, 90 + k, rough=0.4) for k in range(3)]
    w.anomaly(wing, 3, both(*crust), 1.9, "efflorescence")
    w.anomaly(plates[0][0], 2, blotch(0.12, 0.0, 0.14, 0.03, 94), -2.5, "rust on the lower plate of the bearing", lobe=-0.6)
    w.anomaly(plates[1][1], 2, blotch(-0.1, 0.0, 0.1, 0.02, 95), -2.0, "rust on the upper plate of the bearing", lobe=-0.6)
    w.station((0.7, -6.0, 1.75), 94, 54, -18, 24)
    w.write(folder)
