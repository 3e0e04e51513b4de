"""A road tunnel of 13 m, a cut-and-cover box, a mined section and an adit of shotcrete."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from shapely.geometry import box as rectangle

from . import fittings as fit
from . import linings as lin
from .files import write_mobile, write_static
from .geometry import Axis, box, circle, horseshoe, three_centred
from .objects import Box, Tube
from .scan import Instrument, Law, Trolley
from .shapes import blob, curtain, join, line, run
from .tunnel import Tunnel


def great_shield(folder: Path) -> None:
    """A road tunnel of 13 m inside, rings of 2 m in ten segments, with wet joints and curtains high up."""
    axis = Axis(34.0, slope=-0.03, heading=0.25, origin=(574310.0, 5931208.0, -24.0))
    t = Tunnel.new(50303, axis, circle(6.5, -2.7), -4.8, 0.015)
    r = t.rng
    t.mottle((0.35, 0.04, 0.04), (0.4, 0.5, 0.5), (0.5, 4.0, 2.5))
    even = [float(np.radians(a) * 6.5) for a in (-90, -54, -18, 18, 54, 90)]
    odd = [float(np.radians(a) * 6.5) for a in (-108, -72, -36, 0, 36, 72, 108)]
    lin.segments(t, 2.0, 1.0, [even, odd], batch=0.5, step=0.005, gap=(0.02, -4.0), pockets=(0.22, 0.2), bolts=29)
    t.floor(-9.0, 0.6)
    for side in (-1, 1):
        low, high = sorted((side * (t.section.foot - 0.02), t.section.height_at(0.4, side)))
        t.mark(rectangle(0.02, low, 33.98, high), 1.6, "white paint", 0.01, 0.05)
    t.dust(-1.8, 1.4, "splash and exhaust")
    t.leak(line(r, (9.0, 1.2), (9.0, 6.6), 0.3, 0.006), 5.2, "wet joint", soft=0.03, fade=0.2)
    t.leak(curtain(r, 13.0, 15.0, even[4], 0.16, (1.6, 0.9, 2.1, 1.2), 0.28), 5.6, "wet joint", soft=0.04, salt=1.5)
    t.leak(
        join(blob(r, 21.0, -4.1, 0.9, 1.0), run(r, 20.8, -4.6, 2.6, 0.5, 0.3), run(r, 21.4, -4.5, 1.6, 0.4, 0.25)),
        6.0,
        "patch",
        soft=0.05,
    )
    t.leak(line(r, (27.0, -1.0), (27.0, -5.6), 0.24, 0.006), 4.6, "wet joint", soft=0.05)
    t.leak(blob(r, 5.4, -2.4, 0.8, 0.6), 2.6, "damp", soft=0.12)
    t.leak(join(blob(r, 24.1, 3.1, 0.35, 0.35), run(r, 24.1, 3.2, 3.2, 0.3, 0.16)), 4.9, "drip", film=0.3)
    t.leak(blob(r, 17.1, 0.2, 0.9, 0.45, 0.2), 5.5, "patch", soft=0.04, film=0.4)
    t.leak(curtain(r, 29.1, 31.0, -odd[6] * 0.667, 0.14, (0.8, 1.5, 0.6), 0.25), 4.3, "wet joint")
    t.leak(join(line(r, (11.0, -7.4), (11.0, -10.3), 0.26), run(r, 11.2, -8.2, 1.7, 0.2, 0.2)), 4.0, "wet joint", fade=0.3)
    t.leak(join(blob(r, 30.2, 8.3, 0.5, 0.8), run(r, 30.1, 8.6, 1.8, 0.35, 0.3)), 3.7, "patch", soft=0.05)
    for c, s in ((3.0, 3.6), (7.0, -6.2), (19.0, 5.2), (25.0, -3.0), (33.0, 4.4)):
        lin.streak_dirt(t, -1.9, s, (0.7, 2.0), "rust", c + 0.1, int(np.sign(s)))
    t.mark(blob(r, 27.6, 4.4, 0.9, 0.7), -2.2, "soot of a vehicle fire", 0.2)
    t.mark(rectangle(15.3, -6.6, 16.6, -5.4), -1.5, "mortar patch", 0.006)
    t.mark(line(r, (23.0, -7.0), (23.0, -9.6), 0.14), 1.9, "mortar caulking", 0.01)
    lin.numerals(t, [(2.0 + 8 * k, 7.2) for k in range(4)], -3.0)
    for side in (-1, 1):
        t.things.append(Box(17.0, side * 5.35, -2.3, (17.5, 0.18, 0.4), -4.0))
        fit.rack(t, (side * 5.0, side * 5.25), (0.02, 0.03), 2.0, 0.5)
        fit.lamps(t, side * 3.9, 4.0, 1.8, (1.4, 0.25, 0.18))
    for side in (-1, 1):
        u, w, _ = t.on_wall(side * 1.7, 1.0)
        t.things.append(Tube(u, w, 0.55, 18.6, 22.4, -5.0, 0.2))
        for c in (19.3, 21.7):
            fit.wall_box(t, c, side * 1.7, 0.0, (0.12, 0.6, 0.5), -5.0, 0.2)
    fit.cabinets(t, [(12.5, 10.9, (1.2, 1.1, 0.25)), (32.3, -10.8, (0.8, 1.0, 0.25))])
    fit.pipe(t, -11.3, 0.08, 0.08, -10.0, 4.0)
    tool = Instrument(False, 46.0, 20.0, 2.2, (0.0, 6.0, 2.0), (0.006, 0.0003), (0.4, 2.5), 0.002, 0.01, 0.0015)
    places = [(4.2, -1.6, -1.0), (13.2, 1.5, -1.02), (22.0, -1.5, -0.98), (30.5, 1.6, -1.0)]
    write_static(t, folder, tool, Law(1.1, 0.05, 12.0), places, 0.0038, 0.8)


def cut_and_cover(folder: Path) -> None:
    """A frame for two tracks: cracks in the roof, construction joints, a gutter under the expansion joint."""
    axis = Axis(34.0, slope=0.002, heading=3.0, origin=(566733.0, 5938060.0, -8.7))
    t = Tunnel.new(50606, axis, box(9.6, 3.1, -2.3, 0.35), -5.0, 0.0125)
    r = t.rng
    t.mottle((0.4, 0.04, 0.04), (0.6, 0.6, 0.4), (0.6, 3.0, 2.0))
    lin.bays(t, 12.0, 5.0, -3.0, 0.6)
    t.floor(-7.0)
    t.dust(-1.5, 0.7, "dust")
    wall = 4.45 + 0.35 * 1.414
    t.leak(
        join(line(r, (5.0, -2.6), (5.0, 3.4), 0.3, 0.01), blob(r, 5.1, 0.7, 0.6, 0.5)), 4.9, "wet joint", soft=0.05, film=0.4
    )
    t.leak(
        join(line(r, (17.0, wall), (17.0, wall + 4.4), 0.26), run(r, 17.2, wall + 1.2, 2.6, 0.3, 0.2)),
        5.4,
        "wet joint",
        fade=0.3,
    )
    crack = join(line(r, (9.2, -3.6), (11.7, 1.8), 0.16, 0.04), blob(r, 10.85, -0.9, 0.4, 0.35))
    t.leak(crack, 4.4, "crack", soft=0.03, salt=2.0)
    t.leak(curtain(r, 20.2, 23.0, -wall - 0.5, 0.18, (1.8, 2.6, 1.1, 2.0), 0.3), 4.6, "curtain", soft=0.05, fade=0.35)
    t.leak(blob(r, 13.6, 2.6, 0.8, 0.7), 2.5, "damp", soft=0.12)
    t.leak(join(blob(r, 26.0, wall + 0.1, 0.6, 0.55), run(r, 25.9, wall + 0.4, 2.3, 0.4, 0.2)), 5.1, "patch", soft=0.04)
    t.leak(
        join(line(r, (31.2, -wall - 0.9), (31.8, -wall - 4.2), 0.15, 0.03), run(r, 31.4, -wall - 1.9, 1.2, 0.15, 0.12)),
        4.1,
        "crack",
    )
    t.leak(blob(r, 28.4, -1.5, 0.7, 1.0, 0.2), 3.6, "patch", soft=0.06, salt=1.2)
    t.leak(line(r, (7.0, wall + 2.7), (9.4, wall + 2.75), 0.2, 0.01), 3.8, "wet joint", soft=0.04)
    t.leak(join(blob(r, 15.1, -wall - 1.1, 0.13, 0.13), run(r, 15.1, -wall - 1.1, 2.5, 0.16, 0.1)), 4.5, "drip", film=0.3)
    for c, s in ((3.0, wall + 0.7), (12.4, -wall - 0.6), (19.5, wall + 1.0), (24.6, -wall - 0.8), (29.7, wall + 0.5)):
        lin.streak_dirt(t, r.uniform(-2.8, -1.5), s, (0.8, 2.4), "rust", c, int(np.sign(s)))
    t.mark(line(r, (29.0, -3.8), (29.0, 3.8), 0.1), -2.5, "joint sealant", 0.008)
    t.mark(rectangle(21.4, 1.0, 23.0, 2.5), -1.6, "formwork of another pour", 0.01)
    t.mark(blob(r, 7.4, -2.7, 0.7, 0.6), -2.0, "mould oil", 0.06)
    t.mark(blob(r, 19.2, -0.6, 0.5, 0.4), 1.9, "fresh mortar", 0.008)
    t.things.append(Box(29.0, 0.0, 3.03, (0.2, 3.6, 0.03), -3.5, (1.0, 0.0), 0.4))
    fit.rack(t, (wall + 2.0, wall + 2.25, wall + 2.5), (0.025, 0.03, 0.035), 1.5, 0.5)
    fit.rack(t, (-wall - 2.2, -wall - 2.45), (0.02, 0.03), 1.5, 0.5)
    fit.pipe(t, -wall - 3.1, 0.12, 0.09, -7.5, 3.0)
    fit.lamps(t, wall + 0.9, 6.0, 2.0)
    fit.lamps(t, -wall - 0.9, 6.0, 5.0)
    fit.cabinets(
        t, [(11.0, wall + 3.2, (1.0, 1.3, 0.35)), (22.7, -wall - 1.0, (0.6, 0.7, 0.25)), (33.0, wall + 1.6, (0.5, 0.6, 0.2))]
    )
    for lateral in (-2.3, 2.3):
        fit.track(t, lateral)
        t.things.append(Box(17.0, lateral, 2.55, (17.5, 0.04, 0.055), -4.0, (1.0, 0.0), 0.3))
        for c in np.arange(1.5, 34.0, 7.0):
            t.things.append(Box(float(c), lateral, 2.85, (0.06, 0.06, 0.24), -6.0))
    tool = Instrument(True, 43.0, 20.5, 1.4, (0.9, 6.0, 2.2), (0.0025, 0.0003), (0.3, 1.8), 0.001, 0.02, 0.001)
    places = [(4.2, -1.0, -0.7), (12.6, 0.9, -0.68), (21.2, -1.1, -0.7), (30.0, 1.0, -0.72)]
    write_static(t, folder, tool, Law(0.8), places, 0.0046, 0.0)


def mined_salt(folder: Path) -> None:
    """A mined section lined in bays of 9 m, its joints and cold joints wet within fringes of lime."""
    axis = Axis(30.0, 300.0, 0.021, -2.2, (562118.0, 5927655.0, 4.3))
    t = Tunnel.new(50707, axis, three_centred(3.0, 4.2, 1.05, -2.15), -4.4)
    r = t.rng
    t.mottle((0.35, 0.03, 0.03), (0.45, 0.5, 0.3), (0.7, 2.5, 1.5))
    lin.bays(t, 9.0, 6.0, -3.5, 0.7)
    t.floor(-7.0)
    t.dust(-1.3, 0.8, "dust")
    ring = join(line(r, (6.0, -4.6), (6.0, -0.6), 0.3, 0.01), blob(r, 6.1, -2.6, 0.45, 0.7))
    t.leak(ring, 4.4, "salt fringe", soft=0.04, salt=2.4)
    great = join(blob(r, 10.8, 2.4, 1.0, 0.9, 0.2), run(r, 10.4, 3.0, 2.0, 0.5, 0.35), run(r, 11.3, 3.0, 1.6, 0.6, 0.3))
    t.leak(great, 3.8, "patch", soft=0.08, fade=0.25, salt=1.6)
    t.leak(line(r, (15.0, 0.9), (15.0, 5.4), 0.24, 0.01), 5.0, "wet joint", film=0.4)
    t.leak(curtain(r, 17.4, 21.2, -3.1, 0.14, (0.9, 1.6, 0.7, 1.3, 1.1), 0.2), 4.6, "cold joint", salt=2.0)
    t.leak(blob(r, 22.4, 0.4, 0.8, 0.5), 2.2, "damp", soft=0.1, uneven=0.1)
    t.leak(join(line(r, (25.1, 1.2), (26.5, 3.4), 0.13, 0.03), run(r, 26.3, 3.1, 1.5, 0.18, 0.1)), 4.2, "crack", salt=1.8)
    t.leak(
        join(line(r, (24.0, -5.4), (24.0, -2.6), 0.25), blob(r, 24.1, -3.2, 0.4, 0.5)), 3.5, "salt fringe", soft=0.05, salt=2.2
    )
    t.leak(join(blob(r, 3.0, 3.6, 0.15, 0.15), run(r, 3.0, 3.6, 1.9, 0.18, 0.12)), 4.7, "drip", soft=0.02)
    t.leak(blob(r, 28.3, -1.6, 0.35, 0.5), 5.4, "patch", soft=0.03, film=0.3)
    t.mark(line(r, (12.8, -2.0), (14.4, -4.4), 0.1, 0.04), 2.6, "efflorescence", 0.02, 0.5)
    t.mark(blob(r, 20.0, 2.2, 0.5, 0.4), -1.8, "soot", 0.1)
    t.mark(blob(r, 16.6, -1.2, 0.7, 0.4), -1.5, "formwork oil", 0.07)
    t.mark(rectangle(27.0, 3.4, 27.9, 4.2), -1.7, "mortar patch", 0.006)
    for c in (1.9, 8.4, 13.4, 18.9, 22.9):
        lin.streak_dirt(t, -1.8, 4.3, (0.4, 1.2), "rust", c, 1)
    lin.numerals(t, [(6.3, 2.8), (15.3, 2.8), (24.3, 2.8)], -3.0)
    fit.rack(t, (4.0, 4.25, 4.5), (0.02, 0.03, 0.035), 1.2, 0.7)
    fit.rack(t, (-4.3, -4.5), (0.015, 0.02), 1.2, 0.7)
    fit.pipe(t, -5.0, 0.09, 0.055, -8.0, 3.0)
    fit.lamps(t, 2.9, 8.0, 4.0)
    fit.overhead(t, 0.5, 7.0, 3.1)
    fit.track(t)
    tool = Instrument(constant=42.0, noise=(0.4, 1.8), hump=(0.7, 3.8, 1.2), beam=(0.003, 0.0004), outliers=0.0015)
    write_mobile(t, folder, tool, Law(0.9, 0.04, 10.0), Trolley(-0.1, -0.5, 0.7, 50.0, 970, 0.25), 0.5)


def wet_adit(folder: Path) -> None:
    """An adit of bare shotcrete to the running tunnel, scanned sparsely: seepage through rough concrete, hoses and anchors."""
    axis = Axis(40.0, slope=0.06, heading=-0.2, origin=(570544.0, 5940371.0, 12.8))
    t = Tunnel.new(50808, axis, horseshoe(2.5, -1.9), -6.0, 0.0125)
    r = t.rng
    t.mottle((0.6, 0.05, 0.05), (0.5, 0.3, 0.3), (0.7, 2.0, 1.5))
    lin.shotcrete(t, 0.018)
    t.floor(-8.0, 1.2)
    t.dust(-1.5, 0.5, "mud")
    t.leak(
        join(blob(r, 4.6, 2.0, 0.8, 0.7, 0.22), run(r, 4.4, 2.4, 2.6, 0.4, 0.5), run(r, 5.1, 2.4, 1.8, 0.35, 0.2)),
        6.2,
        "patch",
        soft=0.05,
    )
    t.leak(join(blob(r, 9.5, -3.0, 0.7, 0.9, 0.2), run(r, 9.7, -3.4, 2.0, 0.6, 0.7)), 7.4, "patch", soft=0.04, fade=0.15)
    t.leak(blob(r, 13.8, 0.5, 1.0, 0.6, 0.24), 5.0, "patch", soft=0.07)
    t.leak(join(blob(r, 18.2, -1.6, 0.16, 0.16), run(r, 18.2, -1.6, 2.9, 0.24, 0.3, 0.02)), 6.6, "drip", soft=0.03)
    t.leak(curtain(r, 21.3, 24.2, 3.3, 0.25, (1.2, 1.9, 1.5, 2.1), 0.35), 5.6, "curtain", soft=0.05)
    t.leak(blob(r, 27.2, -3.4, 0.9, 1.1, 0.2), 3.2, "damp", soft=0.12)
    t.leak(
        join(line(r, (31.0, -0.8), (32.3, 2.9), 0.2, 0.04), run(r, 32.2, 2.6, 2.2, 0.3, 0.3)), 6.0, "crack", soft=0.04, salt=1.8
    )
    t.leak(join(blob(r, 36.4, 3.6, 0.8, 0.7), run(r, 36.2, 4.0, 1.3, 0.7, 0.9)), 8.2, "patch", soft=0.05, film=0.3)
    t.leak(blob(r, 35.6, -2.4, 0.3, 0.4), 4.6, "patch", soft=0.04)
    t.mark(rectangle(15.2, -5.2, 17.0, 1.2), 1.2, "fresh shotcrete", 0.08, 0.3)
    t.mark(blob(r, 7.6, 3.3, 0.5, 0.8), -2.2, "soot of a generator", 0.15)
    t.mark(blob(r, 25.8, -0.6, 0.6, 0.5), -1.8, "resin", 0.02)
    t.mark(blob(r, 20.0, 4.6, 0.5, 0.4), -2.6, "oil", 0.04)
    for c in (2.4, 11.8, 29.3):
        lin.streak_dirt(t, -2.2, -2.4, (0.6, 1.6), "rust", c, -1)
    lin.numerals(t, [(6.0 + 10 * k, -3.9) for k in range(4)], 3.0)
    for c in np.arange(1.2, 40.0, 2.4):
        for s in (-4.4, -2.2, 0.0, 2.2, 4.4):
            fit.wall_box(t, float(c) + r.normal(0, 0.1), s + r.normal(0, 0.1), 0.01, (0.2, 0.2, 0.025), -7.0, 0.1)
    fit.pipe(t, 5.1, 0.1, 0.09, -6.5, 3.0)
    fit.cable(t, -4.1, 0.12, 0.025, -9.5, 0.08, 2.0)
    fit.cable(t, -4.3, 0.12, 0.02, -9.0, 0.1, 2.0)
    u, w, _ = t.on_wall(1.0, 0.42)
    t.things.append(Tube(u, w, 0.3, 9.0, 40.5, -6.0, 0.05, 0.04, 3.0))
    fit.lamps(t, -3.4, 8.0, 4.0, (0.6, 0.15, 0.1))
    tool = Instrument(False, 45.0, 20.0, 2.0, (0.0, 6.0, 2.0), (0.006, 0.00025), (0.45, 2.5), 0.002, 0.01, 0.003)
    places = [(3.2 + 5.6 * k, 0.25 * (-1) ** k, -0.3) for k in range(7)]
    write_static(t, folder, tool, Law(1.0), places, 0.0066, 0.5)
