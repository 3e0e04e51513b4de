"""A machine room: a motor with cooling ribs, a pump casing, base frame, pipes with flanges; oil and rust."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from .engine import Material, Scanner, View, World, band, blob, deliver, patch, run, speckle
from .parts import BARE, CONCRETE, GALVANISED, OIL, RUST, RUST_LIGHT, WET, flange, studs_along

FLOOR = Material(0.36, 0.9, 0.3, 14.0, tex=0.4, grain=0.4)
WALLS = Material(0.62, 0.95, 0.15, 18.0, tex=0.25, grain=1.2)
TILE = Material(0.60, 0.9, 1.8, 10.0, tex=0.15, grain=0.4)
MOTOR = Material(0.34, 0.85, 0.9, 17.0, tex=0.25, grain=0.12)
PUMP = Material(0.28, 0.85, 0.7, 18.0, tex=0.35, grain=0.12)
FRAME = Material(0.40, 0.85, 0.6, 18.0, tex=0.3, grain=0.4)
PIPE = Material(0.50, 0.85, 0.9, 16.0, tex=0.25, grain=0.4)
YELLOW = Material(0.70, 0.85, 0.8, 16.0, tex=0.15, grain=0.4)
BLACK = Material(0.07, 0.9, 0.8, 16.0, tex=0.1)


def build() -> World:
    """The shaft lies along x at z = 1.55; the motor is on the left, the pump on the right."""
    w = World(304)
    up = (0, 0, 1)
    # floor in six slabs with joints, walls
    slabs = {}
    for i, x in enumerate((-3.6, 0.0, 3.6)):
        for j, y in enumerate((-4.2, 0.0)):
            q = w.quad((x, y, 0), up, (0, 1, 0), 3.588, 4.188, FLOOR)
            q.big = True
            slabs[i, j] = q
    under = w.quad((0, -4.5, -0.012), up, (0, 1, 0), 11, 9, Material(0.2, tex=0.5), smooth=False)
    under.big = True
    walls = {
        "back": w.quad((0, 4.2, 0), (0, -1, 0), up, 10.8, 4.0, WALLS),
        "front": w.quad((0, -4.2, 0), (0, 1, 0), up, 10.8, 4.0, WALLS),
        "left": w.quad((-5.4, 0, 0), (1, 0, 0), up, 8.4, 4.0, WALLS),
        "right": w.quad((5.4, 0, 0), (-1, 0, 0), up, 8.4, 4.0, WALLS),
    }
    for q in walls.values():
        q.big = True
    walls["back"].design(lambda u, v: 1.0 * ((v < 1.4) & (np.abs((v % 0.15) - 0.075) < 0.072)), TILE)
    walls["back"].design(patch(1.5, 2.3, 0.84, 0.59, 61, brush=0.0), Material(0.8, 0.9, 0.7, 14.0, tex=0.6, grain=0.05))
    for q in (slabs[0, 0], slabs[1, 0], slabs[2, 0]):
        q.design(lambda u, v: 1.0 * (np.abs(v - 1.35) < 0.05), YELLOW)

    # plinth and base frame
    plinth = w.box((-3.2, 0.2, 0.11), (2.9, 0.2, 0.11), 2.3, 0.22, CONCRETE)
    beams = {}
    for y in (-0.65, 1.05):
        s = -1 if y < 0 else 1
        beams[y] = w.channel((-3.0, y, 0.40), (2.7, y, 0.40), 0.36, 0.12, 0.014, FRAME, (0, -s, 0))
    for x in (-2.8, -1.75, -0.5, 0.6, 1.6, 2.5):
        w.box((x, -0.62, 0.42), (x, 1.02, 0.42), 0.14, 0.28, FRAME, caps=False)
    y0, z0 = 0.2, 1.55

    # motor: shell with ribs along it, end shields, feet, terminal box, fan cowl
    w.cyl((-2.75, y0, z0), (-0.95, y0, z0), 0.72, MOTOR)
    for deg in np.arange(-58, 239, 9.0):
        a = math.radians(deg)
        o = np.array([0, -math.cos(a), math.sin(a)])
        p = np.array([0, y0, z0]) + 0.755 * o
        w.box(p + [-2.6, 0, 0], p + [-1.1, 0, 0], 0.014, 0.075, MOTOR, o)
    for x in (-2.75, -1.0):
        r = w.cyl((x, y0, z0), (x + 0.07, y0, z0), 0.82, MOTOR)
        r.design(lambda u, v: 1.0 * (np.abs(v - 0.035) < 0.004), -3.0)
        for k in (-1, 1):
            d = w.disc((x + 0.035 + 0.035 * k, y0, z0), (k, 0, 0), 0.82, MOTOR, 0.3)
            ang = np.arange(12) * math.pi / 6
            d.studs = np.c_[0.77 * np.cos(ang), 0.82 + 0.77 * np.sin(ang), np.full(12, 0.018), np.full(12, 0.016)]
            if x > -2 and k > 0:
                shield = d
    cowl = w.cyl((-3.1, y0, z0), (-2.75, y0, z0), 0.66, MOTOR)
    grille = w.disc((-3.1, y0, z0), (-1, 0, 0), 0.66, MOTOR)
    grille.design(lambda u, v: 1.0 * ((np.hypot(u, v - 0.66) * 25) % 1 < 0.4), -7.0)
    for x in (-2.4, -1.3):
        for y in (-0.45, 0.85):
            w.box((x, y, 0.58), (x, y, 0.98), 0.22, 0.26, MOTOR)
    tb = w.box((-2.1, -0.72, 1.75), (-1.6, -0.72, 1.75), 0.34, 0.42, MOTOR)
    tb["-2"].design(patch(0.05, 0.25, 0.12, 0.16, 71, brush=0.0), BARE)
    tb["-2"].studs = studs_along([-0.18, 0.18], np.array([0.03, 0.47]), 0.012, 0.01)
    w.cyl((-1.85, -0.75, 1.55), (-1.85, -0.95, 0.0), 0.03, Material(0.08, tex=0.1), smooth=False)

    # coupling with its guard, bearing bracket
    guard = w.cyl((-0.85, y0, z0), (-0.05, y0, z0), 0.30, YELLOW)
    guard.design(lambda u, v: 1.0 * (((v + 0.8 * u) % 0.22 < 0.11) & (np.abs(v - 0.4) < 0.16)), BLACK)
    w.cyl((-0.95, y0, z0), (-0.85, y0, z0), 0.08, BARE)
    bearing = w.cyl((-0.05, y0, z0), (0.55, y0, z0), 0.24, PUMP)
    w.box((0.25, y0, 0.58), (0.25, y0, 1.35), 0.30, 0.30, PUMP)

    # pump: casing with ring ribs, split flange, nozzles
    case = w.cyl((0.55, y0, z0), (1.75, y0, z0), 0.80, PUMP)
    for x in (0.55, 0.93, 1.31, 1.69):
        w.cyl((x, y0, z0), (x + 0.06, y0, z0), 0.88, PUMP)
        for k in (-1, 1):
            w.disc((x + 0.03 + 0.03 * k, y0, z0), (k, 0, 0), 0.88, PUMP, 0.79)
    w.disc((0.56, y0, z0), (-1, 0, 0), 0.80, PUMP, 0.2)
    cover = w.disc((1.75, y0, z0), (1, 0, 0), 0.80, PUMP, 0.2)
    for k in (-1, 1):
        b = w.box((0.6, y0 + k * 0.89, z0), (1.7, y0 + k * 0.89, z0), 0.20, 0.11, PUMP)
        b["+3"].studs = studs_along([0.04 * k], np.arange(0.08, 1.1, 0.13), 0.02, 0.025)
        w.box((1.1, y0 + 0.55 * k, 0.58), (1.1, y0 + 0.55 * k, 1.05), 0.5, 0.3, PUMP)
    suction = w.cyl((1.75, y0, z0), (5.4, y0, z0), 0.25, PIPE)
    rim1, _ = flange(w, (2.15, y0, z0), (1, 0, 0), 0.25, PUMP)
    flange(w, (4.0, y0, z0), (1, 0, 0), 0.25, PIPE)
    w.box((3.4, y0, 0.0), (3.4, y0, z0 - 0.25), 0.14, 0.14, FRAME)
    pressure = w.cyl((1.15, y0 + 0.25, z0 + 0.6), (1.15, y0 + 0.25, 4.0), 0.20, PIPE)
    rim2, _ = flange(w, (1.15, y0 + 0.25, 2.62), (0, 0, 1), 0.20, PUMP)
    w.cyl((-0.3, -0.95, 0.12), (-0.3, -0.95, 2.0), 0.022, BARE)
    w.cyl((-5.3, 3.3, 2.9), (5.3, 3.3, 2.9), 0.15, PIPE)
    w.cyl((-5.3, 3.65, 2.5), (5.3, 3.65, 2.5), 0.09, GALVANISED)
    for x in (-3.5, 0.0, 3.5):
        flange(w, (x, 3.3, 2.9), (1, 0, 0), 0.15, PIPE)
        w.box((x + 0.5, 3.3, 2.7), (x + 0.5, 4.2, 2.7), 0.06, 0.08, FRAME)
    cab = w.box((-4.4, 3.85, 0.1), (-4.4, 3.85, 2.0), 1.2, 0.6, TILE, (0, 1, 0))
    for q in cab.values():
        q.design(patch(0.0, 1.5, 0.25, 0.12, 73, brush=0.0), BLACK)

    # oil and rust
    w.anomaly(slabs[1, 0], "oil stain", blob(0.35, 2.25, 0.55, 0.5, 911, 0.45), OIL)
    w.anomaly(slabs[0, 0], "oil stain", blob(1.0, 2.55, 0.42, 0.35, 913, 0.4), OIL)
    w.anomaly(slabs[2, 0], "moisture", blob(-0.9, 2.5, 0.75, 0.6, 915, 0.45), WET)
    w.anomaly(slabs[1, 1], "oil stain", blob(-0.6, 2.2, 0.5, 0.55, 917, 0.45), OIL)
    w.anomaly(plinth["-2"], "oil stain", blob(0.0, 2.9, 0.12, 0.5, 919, 0.4), OIL)
    low = beams[-0.65]["web"]["-2"]
    w.anomaly(low, "oil stain", run(0.18, 2.55, 0.9, 0.24, 921, down=1.0, taper=0.1), OIL)
    w.anomaly(low, "rust", blob(-0.1, 4.5, 0.1, 0.55, 923, 0.4), RUST)
    w.anomaly(beams[1.05]["web"]["-2"], "rust", blob(0.05, 1.2, 0.14, 0.5, 925, 0.4), RUST)
    w.anomaly(case, "rust", speckle(blob(-0.75, 0.57, 0.3, 0.13, 927, 0.35), 928, 0.06, 1.0), RUST)
    w.anomaly(case, "rust", blob(0.30, 0.95, 0.4, 0.13, 929, 0.35), RUST)
    w.anomaly(case, "oil stain", blob(2.4, 0.95, 0.55, 0.15, 931, 0.4), OIL)
    w.anomaly(cover, "rust run", run(0.1, 0.62, 0.55, 0.10, 933), RUST)
    w.anomaly(shield, "oil stain", blob(-0.2, 0.25, 0.28, 0.2, 935, 0.4), OIL)
    w.anomaly(cowl, "oil stain", blob(-0.2, 0.17, 0.35, 0.11, 937, 0.35), OIL)
    w.anomaly(bearing, "oil stain", blob(-0.1, 0.3, 0.14, 0.15, 939, 0.35), OIL)
    w.anomaly(rim1, "rust", blob(0.1, 0.03, 0.22, 0.05, 941, 0.3), RUST)
    w.anomaly(suction, "rust", blob(-0.05, 1.35, 0.2, 0.35, 943, 0.4), RUST)
    w.anomaly(suction, "peeled paint", blob(0.1, 2.8, 0.15, 0.3, 945, 0.45), RUST_LIGHT)
    w.anomaly(pressure, "rust run", run(0.12, 0.45, 0.35, 0.1, 947, taper=0.2), RUST_LIGHT)
    w.anomaly(pressure, "patched paint", patch(0.0, 1.15, 0.34, 0.30, 949, 2), Material(0.30, 0.85, 0.9, 16.0, tex=0.15))
    w.anomaly(rim2, "rust", blob(0.1, 0.03, 0.2, 0.05, 951, 0.3), RUST)
    w.anomaly(walls["right"], "moisture", band(0.55, 953, 0.2, 0.9, -1.6, 2.4), WET)
    w.anomaly(walls["back"], "soot", blob(-1.9, 2.2, 0.7, 0.45, 955, 0.3, 0.25), -2.2)
    return w


def make(folder: Path) -> None:
    """Three stations, 3 mm of range noise."""
    tool = Scanner(beam=0.4, sigma=0.003, noise=0.7, const=27.0, near=1.8, floor=2.0, wiggle=0.2, false=0.0015, split=1.2)
    views = [
        View((-2.9, -3.4, 1.7), (20, 110), (-38, 24), 0.12),
        View((4.4, -3.1, 1.62), (92, 182), (-38, 24), 0.12, 0.2),
        View((0.4, 3.75, 1.75), (-138, -42), (-40, 20), 0.12, -0.3),
    ]
    deliver(folder, build(), views, tool, 34, 2154, (652871.5, 6861420.3, 31.2), 17.0)
