"""A steel bridge pier with inclined legs, bearings and a drain pipe; streaks of rust along the legs, seen at strong angles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .engine import Material, Mark, Quad, Scanner, View, World, band, blob, deliver, patch, run
from .parts import BARE, CONCRETE, GALVANISED, GRASS, RUST, RUST_LIGHT, blades, bush, flange, ground, studs_along

PAINT = Material(0.46, 0.85, 0.8, 17.0, tex=0.3, grain=0.4)
GIRDER = Material(0.22, 0.9, 0.1, 20.0, tex=0.5, grain=0.12)  # weathering steel
RUBBER = Material(0.06, 0.95, tex=0.2)
LIME = Material(0.80, 0.9, tex=0.5, grain=0.12)


def build() -> World:
    """Four legs, battered along x and y, on footings; a head beam, four bearings and two girders on top."""
    w = World(305)
    ground(w, GRASS, 8.0)
    foot, head = 0.55, 6.3
    legs: dict[tuple[int, int], dict[str, Quad]] = {}
    for i in (-1, 1):
        for j in (-1, 1):
            a, b = np.array([2.3 * i, 1.7 * j, foot]), np.array([1.15 * i, 0.55 * j, head])
            f = w.box(a, b, 0.55, 0.62, PAINT, (i, 0, 0), caps=False)
            legs[i, j] = {
                "out" if k == "+3" else "in" if k == "-3" else "front" if q.n[1] < 0 else "back": q for k, q in f.items()
            }
            for q in legs[i, j].values():
                for v in (1.9, 3.9):
                    q.design(lambda u, s, v=v: 1.0 * (np.abs(s - v) < 0.009), -1.4)  # shop welds
            e = (b - a) / np.linalg.norm(b - a)
            base = w.box(a - 0.16 * e, a + 0.0 * e, 0.85, 0.92, PAINT, (i, 0, 0))
            base["+1"].studs = studs_along([-0.36, 0.36], np.arange(0.08, 0.9, 0.19), 0.02, 0.03)
            w.box((2.3 * i - 0.75, 1.7 * j, 0.2), (2.3 * i + 0.75, 1.7 * j, 0.2), 1.4, 0.44, CONCRETE)
    for j in (-1, 1):
        tie = w.box((-1.75, 1.12 * j, 3.4), (1.75, 1.12 * j, 3.4), 0.26, 0.36, PAINT, caps=False)
        if j < 0:
            front_tie = min(tie.values(), key=lambda q: q.n[1])
    for i in (-1, 1):
        w.box((1.72 * i, -1.1, 3.4), (1.72 * i, 1.1, 3.4), 0.26, 0.36, PAINT, caps=False)
    cap = w.box((-2.0, 0, 6.62), (2.0, 0, 6.62), 1.5, 0.68, PAINT)
    cap_front = min(cap.values(), key=lambda q: q.n[1])
    cap_end = max(cap.values(), key=lambda q: q.n[0])
    for x in (-1.5, -0.5, 0.5, 1.5):
        w.box((x, -0.75, 6.62), (x, -0.87, 6.62), 0.02, 0.66, PAINT)  # stiffeners
    # bearings: plates, rubber, a roller with its bare steel
    for i in (-1, 1):
        for y in (-0.45, 0.45):
            x = 1.2 * i
            w.box((x - 0.3, y, 6.985), (x + 0.3, y, 6.985), 0.42, 0.05, GALVANISED)
            if i < 0:
                w.box((x - 0.25, y, 7.07), (x + 0.25, y, 7.07), 0.36, 0.12, RUBBER)
            else:
                w.cyl((x, y - 0.2, 7.075), (x, y + 0.2, 7.075), 0.065, BARE)
                for k in (-1, 1):
                    w.disc((x, y + 0.2 * k, 7.075), (0, k, 0), 0.065, BARE)
            w.box((x - 0.3, y, 7.165), (x + 0.3, y, 7.165), 0.42, 0.05, GALVANISED)
    for x in (-1.2, 1.2):
        w.box((x, -2.8, 7.22), (x, 2.8, 7.22), 0.55, 0.05, GIRDER)
        w.box((x, -2.8, 7.8), (x, 2.8, 7.8), 0.03, 1.12, GIRDER)
        for y in np.arange(-2.25, 2.5, 1.5):
            for k in (-1, 1):
                w.box((x + 0.015 * k, y, 7.8), (x + 0.25 * k, y, 7.8), 0.015, 1.1, GIRDER)
    w.quad((0, -2.8, 8.4), (0, 0, -1), (0, 1, 0), 5.0, 5.6, CONCRETE)

    # drain pipe along the right front leg, its outlet over the footing
    f = legs[1, -1]["front"]
    shift = f.n * 0.14 + 0.12 * f.eu
    p0, p1 = f.o + 0.25 * f.ev + shift, f.o + (f.lv - 0.05) * f.ev + shift
    drain = w.cyl(p0, p1, 0.065, Material(0.36, 1.0, 1.4, 15.0, tex=0.2))
    for s in (0.8, 2.4, 4.0, 5.4):
        c = f.o + s * f.ev + shift
        w.cyl(c, c + 0.05 * f.ev, 0.078, GALVANISED)
        w.box(c - 0.07 * f.n, c - 0.14 * f.n, 0.05, 0.04, GALVANISED, f.ev)
    c = f.o + 3.2 * f.ev + shift
    flange(w, tuple(c), tuple(f.ev), 0.065, GALVANISED, 0.03)
    w.cyl(p1, p1 + np.array([0.0, -0.05, 1.9]), 0.065, Material(0.36, 1.0, 1.4, 15.0, tex=0.2))

    # rust: streaks of 2 to 10 cm along the legs, from joints and from the head
    def streak(q: Quad, u: float, top: float, length: float, width: float, seed: int, mat: Material = RUST_LIGHT) -> None:
        w.anomaly(q, "rust streak", run(u, q.lv - top, length, width, seed, taper=0.35, wander=0.35), mat)

    streak(legs[-1, -1]["front"], -0.15, 0.25, 3.6, 0.075, 1011, RUST)
    streak(legs[-1, -1]["front"], 0.10, 0.3, 4.3, 0.045, 1013)
    streak(legs[-1, -1]["front"], 0.21, 2.0, 3.2, 0.025, 1015)
    streak(legs[-1, -1]["in"], 0.05, 0.3, 3.9, 0.095, 1017, RUST)
    streak(legs[-1, -1]["in"], -0.16, 2.3, 2.6, 0.06, 1019)
    streak(legs[-1, -1]["out"], 0.0, 0.4, 4.2, 0.08, 1021, RUST)
    streak(legs[1, -1]["front"], -0.17, 0.3, 4.4, 0.06, 1023, RUST)
    streak(legs[1, -1]["front"], 0.02, 2.6, 2.5, 0.03, 1025)
    streak(legs[1, -1]["in"], 0.08, 0.25, 3.0, 0.10, 1027)
    streak(legs[1, -1]["out"], -0.12, 0.4, 4.6, 0.09, 1029, RUST)
    streak(legs[1, -1]["out"], 0.14, 1.2, 3.6, 0.04, 1031)
    streak(legs[-1, 1]["front"], 0.0, 0.5, 3.8, 0.08, 1033, RUST)
    streak(legs[1, 1]["front"], 0.1, 0.4, 3.4, 0.07, 1035)
    streak(legs[1, 1]["out"], 0.0, 0.6, 4.1, 0.10, 1037, RUST)
    streak(legs[-1, 1]["in"], -0.05, 0.6, 3.3, 0.08, 1039)
    for k, (leg, face) in enumerate((((-1, -1), "front"), ((1, -1), "out"), ((1, 1), "front"))):
        w.anomaly(legs[leg][face], "rust", band(0.16, 1051 + 3 * k, 0.06, 0.3), RUST)
    w.anomaly(front_tie, "rust", blob(-0.08, 0.75, 0.12, 0.3, 1061, 0.4), RUST)
    w.anomaly(front_tie, "patched paint", patch(0.02, 2.3, 0.28, 0.55, 1063, 1), Material(0.66, 0.8, 1.0, 16.0, tex=0.12))
    w.anomaly(cap_front, "rust", blob(-0.2, 0.75, 0.13, 0.42, 1065, 0.4), RUST)
    across = patch(0.05, 3.2, 0.6, 0.13, 1067, 0, 0.02)
    w.anomaly(cap_front, "lime run", lambda u, v: across(u, v) * (v > 0), LIME)
    w.anomaly(cap_end, "rust", blob(0.2, 0.25, 0.35, 0.2, 1069, 0.4), RUST)
    w.anomaly(drain, "rust", blob(0.0, 2.75, 0.12, 0.35, 1071, 0.4), RUST)
    for q in (legs[-1, -1]["out"], legs[1, -1]["out"]):
        q.marks.insert(0, Mark("", patch(0.0, 1.2, 0.3, 0.16, 1073, brush=0.0), Material(0.75, 0.85, 0.9, 16.0, tex=0.05)))
    bush(w, -3.4, -2.8, 1.3, 350, 0.5)
    blades(w, -4, 4, -4.0, -2.6, 260, 0.55)
    w.cyl((-2.6, -5.0, 6.7), (-2.4, 5.0, 6.6), 0.012, Material(0.08, tex=0), smooth=False)
    return w


def make(folder: Path) -> None:
    """Two stations close by, 0.035 degrees, 1550 nm."""
    tool = Scanner(beam=0.25, sigma=0.0012, noise=0.4, const=32.0, near=2.4, floor=1.0, false=0.0008)
    views = [View((-2.3, -10.2, 1.7), (60, 94), (-8, 33.5), 0.035), View((9.4, -3.2, 1.8), (141, 178), (-8, 35.5), 0.035, 0.2)]
    deliver(folder, build(), views, tool, 35, 27700, (405218.7, 286644.9, 118.3), -24.0)
