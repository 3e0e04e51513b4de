"""Running tunnels of a metro, driven by shields of six metres: wet joints, cable racks, grouting repairs, and dirt alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from shapely.geometry import Point
from shapely.geometry import box as rectangle

from . import fittings as fit
from . import linings as lin
from .files import write_mobile, write_static
from .geometry import Axis, circle
from .scan import Instrument, Law, Trolley
from .shapes import blob, curtain, join, line, run
from .tunnel import Tunnel


def turned(radius: float, key: float) -> list[float]:
    """Arcs of the joints of a ring of six segments whose key stands at an angle from the crown, in degrees."""
    angles = [key + d for d in (-146.25, -78.75, -11.25, 11.25, 78.75, 146.25)]
    return [float(np.radians(a) * radius) for a in angles if abs(a) < 175]


def wet_joints(folder: Path) -> None:
    """Straight-jointed rings of 1 m whose ring and longitudinal joints leak, from a trolley."""
    axis = Axis(32.0, 400.0, -0.012, 0.7, (563210.0, 5932480.0, -11.4))
    t = Tunnel.new(50101, axis, circle(2.75, -1.78), -5.0)
    r = t.rng
    t.mottle((0.35, 0.03, 0.03), (0.4, 0.25, 0.4), (0.45, 2.5, 1.2))
    cuts = [float(np.radians(a) * 2.75) for a in (-138, -73, -8, 8, 73, 138)]
    lin.segments(t, 1.0, 1.0, [cuts], gap=(0.012, -4.5), bolts=15)
    t.floor(-6.5)
    t.dust(-1.6, 0.9, "brake dust")
    crown, shoulder = cuts[3], cuts[4]
    t.leak(line(r, (7.0, -0.5), (7.0, -2.4), 0.17, 0.003), 4.6, "wet joint", soft=0.02)
    seam = join(
        line(r, (15.0, 1.1), (15.0, 4.5), 0.2, 0.004), run(r, 15.12, 2.3, 1.1, 0.12, 0.08), run(r, 14.9, 3.0, 1.2, 0.1, 0.12)
    )
    t.leak(seam, 5.4, "wet joint", soft=0.025, fade=0.25, film=0.3)
    t.leak(curtain(r, 10.0, 13.1, -crown, 0.13, (0.5, 0.9, 0.35, 1.3), 0.16), 5.8, "wet joint", soft=0.03, salt=1.6)
    t.leak(curtain(r, 19.0, 21.6, shoulder, 0.12, (0.9, 0.6, 1.0, 0.4), 0.17), 4.8, "wet joint", fade=0.3)
    corner = join(blob(r, 22.0, -shoulder, 0.42, 0.6), run(r, 22.1, -shoulder, 1.3, 0.3, 0.2))
    t.leak(corner, 4.4, "patch", soft=0.05)
    t.leak(join(blob(r, 4.5, 1.94, 0.17, 0.17), run(r, 4.5, 2.0, 1.2, 0.17, 0.11)), 5.0, "drip", soft=0.018, film=0.4)
    t.leak(join(blob(r, 26.2, 2.7, 0.16, 0.14), run(r, 26.2, 2.75, 1.0, 0.16, 0.1)), 3.9, "drip")
    t.leak(blob(r, 28.6, -1.85, 0.55, 0.85), 2.4, "damp", soft=0.09, uneven=0.12)
    t.leak(blob(r, 17.6, crown, 0.42, 0.24, 0.22), 6.2, "patch", soft=0.03, film=0.5)
    t.leak(line(r, (24.0, -2.5), (24.0, -5.4), 0.22, 0.004), 4.2, "wet joint", soft=0.04, fade=0.35)
    t.leak(join(line(r, (30.0, 0.6), (30.0, 3.2), 0.12), blob(r, 30.1, 2.9, 0.3, 0.4)), 3.2, "wet joint", soft=0.05)
    for c, s in ((2.0, -1.6), (12.0, 2.8), (18.0, -2.3), (27.0, 2.2)):
        lin.streak_dirt(t, -2.0, s, (0.4, 1.2), "rust", c + 0.1, int(np.sign(s)))
    t.mark(line(r, (9.0, 0.6), (9.0, 3.0), 0.09), 1.8, "mortar caulking", 0.008)
    t.mark(blob(r, 6.3, -2.9, 0.35, 0.3), -1.6, "mortar patch", 0.006)
    lin.numerals(t, [(2.5 + 5 * k, 2.6) for k in range(6)], -3.0)
    lin.targets(t, [(5.4, 0.9), (15.4, -3.3), (25.4, 0.9)])
    fit.rack(t, (-3.45, -3.7, -3.95, -4.2), (0.02, 0.03, 0.035, 0.0), 1.0, 0.55)
    fit.rack(t, (2.62, 2.8), (0.012, 0.016), 1.0, 0.5)
    fit.pipe(t, 4.35, 0.10, 0.055, -8.5, 3.0)
    fit.platform(t, 1, -0.85, 0.7)
    fit.lamps(t, 2.2, 7.0, 3.5)
    fit.overhead(t, 0.42, 7.0, 2.4)
    fit.cabinets(t, [(8.7, -2.6, (0.4, 0.5, 0.16)), (20.6, -2.5, (0.3, 0.35, 0.12))])
    fit.track(t)
    tool = Instrument(constant=44.0, noise=(0.4, 2.0), hump=(0.8, 3.4, 1.1), beam=(0.003, 0.0005), outliers=0.0015)
    write_mobile(t, folder, tool, Law(0.85, 0.06, 9.0), Trolley(0.0, -0.22, 0.8, 50.0, 1020), 0.5)


def cable_side(folder: Path) -> None:
    """Leaks beside and behind cable racks, pipes and cabinets, from tripods and without a reference curve."""
    axis = Axis(32.0, slope=0.004, heading=2.1, origin=(568420.0, 5929770.0, -17.9))
    t = Tunnel.new(50202, axis, circle(2.95, -1.95), -4.6)
    r = t.rng
    t.mottle((0.4, 0.03, 0.03), (0.45, 0.35, 0.3), (0.4, 3.0, 2.0))
    left, right = turned(2.95, -22.5), turned(2.95, 22.5)
    lin.segments(t, 1.5, 0.9, [left, right], batch=0.55, step=0.004, bolts=16)
    t.floor(-7.0)
    t.dust(-1.4, 1.0, "brake dust")
    joints = [0.9 + 1.5 * k for k in range(21)]
    behind = join(blob(r, 6.4, 3.9, 0.75, 0.95), run(r, 6.1, 4.2, 1.2, 0.35, 0.22), run(r, 6.8, 4.3, 0.9, 0.3, 0.2))
    t.leak(behind, 4.8, "patch", soft=0.04, fade=0.2)
    t.leak(line(r, (joints[8], 2.0), (joints[8], 5.3), 0.22, 0.004), 5.2, "wet joint", film=0.3)
    t.leak(join(blob(r, 18.4, -3.6, 0.5, 0.7), run(r, 18.5, -3.9, 1.5, 0.3, 0.15)), 5.6, "patch", soft=0.03, salt=1.4)
    beside = join(line(r, (joints[15], -1.8), (joints[15], -4.4), 0.16), run(r, joints[15] + 0.2, -3.0, 1.3, 0.16, 0.12))
    t.leak(beside, 4.4, "wet joint", soft=0.03)
    t.leak(curtain(r, 9.9, 11.4, right[3], 0.12, (0.7, 1.1, 0.5), 0.18), 5.0, "wet joint")
    t.leak(blob(r, 21.5, 3.4, 0.4, 0.8), 2.6, "damp", soft=0.08)
    t.leak(join(blob(r, 27.2, 4.5, 0.6, 0.5), run(r, 27.3, 4.7, 0.9, 0.4, 0.3)), 3.9, "patch", soft=0.05)
    t.leak(join(blob(r, 3.2, -2.4, 0.15, 0.15), run(r, 3.2, -2.4, 1.7, 0.16, 0.1)), 4.9, "drip", soft=0.015, film=0.5)
    t.leak(blob(r, 25.0, 0.3, 0.7, 0.35, 0.2), 4.2, "patch", soft=0.05)
    t.leak(line(r, (13.0, -1.2), (14.3, -2.6), 0.11, 0.02), 3.4, "crack", soft=0.02)
    for k in range(9):
        lin.streak_dirt(t, -1.8, 4.4, (0.3, 0.9), "rust", 2.1 + 3.0 * k + r.normal(0, 0.03), 1)
    t.mark(blob(r, 15.8, 2.6, 0.5, 0.4), -1.9, "soot of a short circuit", 0.12)
    t.mark(rectangle(22.0, -3.3, 22.9, -2.7), -1.5, "mortar patch", 0.006)
    t.mark(rectangle(29.0, 1.0, 30.2, 1.6), 1.6, "fresh mortar", 0.006)
    lin.numerals(t, [(1.6 + 7.5 * k, -2.9) for k in range(4)], 3.0)
    fit.rack(t, (3.3, 3.58, 3.86, 4.14, 4.42), (0.018, 0.025, 0.035, 0.035, 0.045), 1.5, 0.6)
    fit.rack(t, (-3.3, -3.5), (0.012, 0.02), 1.5, 0.6)
    fit.pipe(t, -4.0, 0.11, 0.085, -7.5, 3.0)
    fit.pipe(t, -4.45, 0.11, 0.055, -8.0, 3.0)
    fit.cabinets(t, [(17.6, -2.95, (0.6, 0.8, 0.25)), (26.7, 3.1, (0.5, 0.45, 0.2)), (5.3, 2.85, (0.35, 0.4, 0.15))])
    fit.lamps(t, 2.6, 6.0, 2.6)
    fit.overhead(t, 0.45, 8.0, 3.5)
    fit.track(t)
    tool = Instrument(constant=40.0, noise=(0.3, 1.2), beam=(0.0025, 0.0003), hump=(-0.7, 4.5, 1.5), outliers=0.001)
    places = [(4.0, 0.2, -0.35), (12.0, -0.25, -0.33), (20.2, 0.2, -0.36), (28.2, -0.2, -0.34)]
    write_static(t, folder, tool, Law(0.75), places, 0.0053, 0.0)


def regrouted(folder: Path) -> None:
    """Leaks that came back beside injections, caulking and drain channels; the trolley's laser is at 785 nm."""
    axis = Axis(30.0, slope=-0.025, heading=-0.9, origin=(559870.0, 5936145.0, -20.6))
    t = Tunnel.new(50404, axis, circle(2.75, -1.8), -4.2)
    r = t.rng
    t.mottle((0.4, 0.03, 0.03), (0.5, 0.3, 0.4), (0.4, 2.0, 2.0))
    left, right = turned(2.75, -22.5), turned(2.75, 22.5)
    lin.segments(t, 1.2, 0.6, [left, right], batch=0.5, gap=(0.014, -3.5))
    t.floor(-6.0)
    t.dust(-1.2, 0.8, "brake dust")
    joints = [0.6 + 1.2 * k for k in range(25)]
    for k, (low, high) in ((3, (0.8, 3.4)), (9, (-3.9, -0.6)), (14, (-1.5, 1.5)), (19, (1.0, 4.4))):
        t.mark(line(r, (joints[k], low), (joints[k], high), 0.10), r.uniform(1.3, 2.2), "mortar caulking", 0.008)
    resin = ((3, 2.0), (6, -2.2), (9, -1.4), (12, 3.1), (16, -3.0), (19, 2.2), (21, -1.9))
    for k, s in resin:
        flow = join(blob(r, joints[k], s, 0.14, 0.22), run(r, joints[k] + 0.03, s, r.uniform(0.4, 1.1), 0.12, 0.05))
        t.mark(flow, r.uniform(-3.4, -2.2), "polyurethane residue", 0.01, 0.3)
        for d in (-0.28, 0.28):
            t.mark(Point(joints[k] + 0.12, s + d).buffer(0.035), -3.0, "injection packer", 0.006)
    t.mark(rectangle(16.7, 0.5, 17.7, 2.3), -1.3, "bonded sheet", 0.005, 0.1)
    t.leak(
        join(line(r, (joints[3], 3.4), (joints[3], 4.9), 0.17), run(r, joints[3] + 0.15, 3.7, 0.9, 0.14, 0.1)), 3.6, "wet joint"
    )
    t.leak(join(blob(r, 8.3, -2.9, 0.35, 0.5), run(r, 8.2, -3.1, 1.4, 0.25, 0.15)), 3.2, "patch", soft=0.04, salt=1.3)
    t.leak(line(r, (joints[9], -3.9), (joints[9], -5.4), 0.2), 3.8, "wet joint", soft=0.03)
    t.leak(curtain(r, 13.9, 15.1, right[2], 0.11, (0.4, 0.8, 0.6), 0.15), 4.1, "wet joint", film=0.3)
    t.leak(join(blob(r, joints[12] + 0.3, 3.3, 0.3, 0.55), run(r, joints[12] + 0.3, 3.6, 1.1, 0.2, 0.12)), 3.4, "patch")
    t.leak(blob(r, 19.9, -2.6, 0.5, 0.8), 2.0, "damp", soft=0.07, uneven=0.1)
    t.leak(
        join(line(r, (joints[19], -0.5), (joints[19], 0.95), 0.15), blob(r, joints[19], 0.2, 0.25, 0.2)),
        3.9,
        "wet joint",
        film=0.4,
    )
    t.leak(
        join(line(r, (joints[21], -2.3), (joints[21], -4.6), 0.13), run(r, joints[21] + 0.2, -3.2, 1.2, 0.13, 0.1)),
        3.0,
        "wet joint",
    )
    t.leak(blob(r, 17.85, 2.75, 0.3, 0.6), 3.3, "patch", soft=0.03)
    t.leak(join(blob(r, 28.2, 1.7, 0.14, 0.14), run(r, 28.2, 1.7, 1.5, 0.15, 0.1)), 3.7, "drip", soft=0.015)
    t.leak(line(r, (3.4, -1.0), (4.2, -2.9), 0.1, 0.02), 2.6, "crack", soft=0.018)
    for c, low in ((joints[6] - 0.02, -5.6), (joints[16], -5.7)):
        for s in np.arange(low, -1.8, 0.25):
            fit.wall_box(t, c, float(s) + 0.125, 0.0, (0.09, 0.26, 0.03), -3.2, 0.35)
    lin.numerals(t, [(1.1 + 6 * k, -2.4) for k in range(5)], -2.5)
    lin.targets(t, [(6.1, 0.0), (6.1, 3.0), (18.1, 0.0), (18.1, -3.0)])
    fit.rack(t, (3.5, 3.75, 4.0), (0.02, 0.03, 0.03), 1.2, 0.3)
    fit.rack(t, (-3.6, -3.8), (0.012, 0.014), 1.2, 0.3)
    fit.pipe(t, -4.3, 0.08, 0.055, -6.5, 2.4)
    fit.lamps(t, -2.9, 8.0, 4.9)
    fit.track(t)
    fit.platform(t, 1, -0.95, 0.65, rail=False)
    tool = Instrument(constant=38.0, noise=(0.45, 1.5), dim=1.5, beam=(0.002, 0.0003), jitter=0.0009, outliers=0.002)
    write_mobile(t, folder, tool, Law(0.9, 0.1, 8.0), Trolley(0.05, -0.25, 0.75, 50.0, 980, 0.2, 0.45, 0.12), 0.8)


def brake_dust(folder: Path) -> None:
    """An old line without a leak, but with brake dust, rust, oil, old tide marks and repairs."""
    axis = Axis(32.0, -350.0, 0.018, 1.4, (571005.0, 5934922.0, -14.2))
    t = Tunnel.new(50505, axis, circle(2.75, -1.75), -6.0)
    r = t.rng
    t.mottle((0.4, 0.03, 0.03), (0.55, 0.25, 0.6), (0.8, 2.5, 1.5), (0.5, 0.15, 1.8))
    left, right = turned(2.75, -22.5), turned(2.75, 22.5)
    lin.segments(t, 1.2, 0.8, [left, right], batch=0.8, step=0.004, gap=(0.016, -4.0))
    t.floor(-8.0)
    t.dust(-2.6, 1.3, "brake dust", 0.25)
    joints = [0.8 + 1.2 * k for k in range(26)]
    for k in range(26):
        if r.random() < 0.6:
            side = int(r.choice((-1, 1)))
            lin.streak_dirt(t, r.uniform(-3.0, -1.2), side * r.uniform(1.8, 3.8), (0.3, 1.5), "rust", joints[k] + 0.15, side)
    for c, s, a, b, db, kind in (
        (4.6, -2.2, 0.6, 0.7, -2.2, "soot"),
        (9.3, 2.6, 0.5, 0.45, -3.2, "oil"),
        (14.1, 1.4, 0.45, 0.6, -1.6, "old mortar"),
        (20.4, -1.2, 0.8, 0.5, -2.0, "soot"),
        (25.7, 2.9, 0.5, 0.8, -2.6, "bitumen"),
        (29.2, -3.0, 0.4, 0.5, 2.0, "fresh mortar"),
    ):
        t.mark(blob(r, c, s, a, b), db, kind, 0.1 if kind == "soot" else 0.015)
    for k, low, high in ((5, -3.0, -0.8), (11, 1.0, 4.3), (18, -4.4, -2.1)):
        t.mark(line(r, (joints[k], low), (joints[k], high), 0.12), -2.4, "gasket squeezed out", 0.01)
    for c, s in ((7.4, 3.0), (17.2, -2.6), (22.9, 2.2)):
        old = join(blob(r, c, s, 0.4, 0.5), run(r, c, s, 1.2, 0.25, 0.15))
        t.mark(old.buffer(0.05).difference(old.buffer(-0.02)), -1.4, "dry tide mark", 0.015)
        t.mark(old.buffer(-0.03), r.uniform(0.5, 1.4), "efflorescence", 0.03, 0.5)
    t.mark(rectangle(0.02, -0.25, 31.98, 0.25), -1.5, "soot above the conductor", 0.12)
    t.mark(rectangle(12.3, -3.3, 13.0, -2.4), -2.8, "black paint", 0.004, 0.05)
    lin.numerals(t, [(1.3 + 6 * k, 2.5) for k in range(5)], 3.5)
    lin.targets(t, [(10.0, 0.8), (20.0, -0.8)])
    fit.rack(t, (-3.5, -3.75, -4.0, -4.25), (0.02, 0.03, 0.035, 0.03), 1.2, 0.5)
    fit.rack(t, (3.2, 3.4), (0.015, 0.02), 1.2, 0.5)
    fit.pipe(t, 4.2, 0.10, 0.055, -9.0, 3.6)
    fit.overhead(t, 0.4, 7.0, 1.9)
    fit.lamps(t, 2.4, 8.0, 2.5, (0.7, 0.16, 0.12))
    fit.cabinets(t, [(16.0, 2.6, (0.5, 0.6, 0.2)), (27.6, -2.7, (0.35, 0.5, 0.15))], -6.5)
    fit.track(t)
    tool = Instrument(constant=44.0, noise=(0.4, 2.5), hump=(1.0, 3.0, 1.0), beam=(0.0035, 0.0005), outliers=0.002)
    write_mobile(t, folder, tool, Law(0.8), Trolley(0.0, -0.2, 0.9, 60.0, 930, 0.12), 0.5)
