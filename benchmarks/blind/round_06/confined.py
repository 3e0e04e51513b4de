"""Narrow ones: a cable culvert and a water tunnel that has been emptied."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import wear
from .canvas import Canvas, Leak
from .equipment import Box, Thing, Tube
from .fields import blob, curtain, line, run, sheet
from .instrument import Instrument, Static, minnaert, phase, pulse
from .tunnel import Axis, Section
from .world import World


def culvert(folder: Path) -> None:
    """Cable culvert: trays in tiers and pipes before wet walls and joints."""
    rng = np.random.default_rng(60505)
    section = Section(("line", 1.95), ("turn", 90.0), ("line", 3.3), axis_height=1.65)
    wall = section.height
    canvas = Canvas(section, 36.0, rng, -4.8)
    canvas.rough((3.0, 0.004), (0.05, 0.0008))
    canvas.texture((1.5, 0.4), (0.3, 0.3), (0.07, 0.35), (0.035, 0.25))
    wear.formwork(canvas, 1.2, 1.2, 0.25)
    wear.joints(canvas, (3.4, 10.9, 18.4, 25.9, 33.4), -1.8, 0.012)
    wear.floor(canvas, -6.5)
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 0.25, -1.5, side, "dust and spoil")
    for s in np.arange(1.0, 36, 2.4):
        canvas.paint([blob(float(s), wall(2.95), 0.06, 0.06)], -2.0, side=-1)
    wear.number(canvas, 6.0, wall(2.2), -1)
    wear.number(canvas, 16.0, wall(2.2), -1)
    wear.repair(canvas, 13.6, wall(2.0), (0.8, 0.7), 1.6, -1)
    wear.repair(canvas, 7.2, 0.6, (0.5, 0.9), -1.4, 1)
    canvas.paint([blob(20.3, 0.3, 0.5, 0.6)], -2.0, "smoke of a burnt cable", soft=0.2, warp=0.1)
    canvas.paint([run(8.9, wall(3.1), wall(1.6), 0.2, 0.1)], 3.0, "lime crust", -1, soft=0.02, warp=0.03)
    canvas.wet(
        Leak([line(((3.4, -1.3), (3.4, wall(0.5))), 0.1), blob(3.5, 1.2, 0.4, 0.4)], 5.5, "wet joint", 1, 0.03, 0.04, tide=1.5)
    )
    canvas.wet(Leak([line(((10.9, wall(3.2)), (10.9, section.foot)), 0.13)], 4.5, "wet joint", -1, 0.03, 0.04))
    canvas.wet(Leak(wear.seep(5.8, wall(2.4), 0.8, 0.55, (0.9, 1.2)), 6.0, "behind trays", 1, 0.04, 0.08, uneven=0.15))
    canvas.wet(Leak([run(14.2, wall(3.1), section.foot, 0.4, 0.7, 0.05)], 5.0, "behind trays", 1, 0.04, 0.06, fade=-0.2))
    canvas.wet(Leak([blob(17.0, -0.5, 0.6, 0.5)], 6.8, "patch", 1, 0.03, 0.09, tide=2.5))
    canvas.wet(Leak([blob(8.8, 0.9, 0.45, 0.35), blob(9.3, 1.2, 0.3, 0.25)], 3.2, "damp", 1, 0.08, 0.06))
    canvas.wet(Leak([blob(16.0, wall(0.9), 0.9, 0.4), blob(16.8, wall(0.5), 0.7, 0.35)], 4.0, "behind pipes", -1, 0.06, 0.08))
    canvas.wet(Leak(wear.drip(5.2, wall(2.9), 1.3, 0.18, 0.16), 5.5, "drip", -1, 0.02, 0.02, tide=1.8))
    canvas.wet(Leak(curtain(19.6, 20.8, wall(2.5), (0.5, 1.0, 0.7), 0.12), 6.0, "curtain", -1, 0.02, 0.02))
    canvas.wet(Leak([line(((25.9, -0.9), (25.9, wall(2.0))), 0.12)], 4.2, "wet joint", -1, 0.04, 0.05, tide=1.5))
    canvas.wet(Leak(wear.seep(28.2, wall(2.9), 0.7, 0.4, (0.6, 1.1)), 5.2, "behind trays", 1, 0.05, 0.08))
    canvas.wet(Leak([blob(32.3, 0.9, 0.7, 0.5)], 2.8, "damp", 1, 0.1, 0.09))
    trays: list[Thing] = []
    for h in (0.55, 1.15, 1.75, 2.35):
        n, z = section.point(h, 1, 0.2)
        trays.append(Box(n, z, 0.19, 0.025, -3.0, gloss=0.03))
        trays += [Tube(n - 0.12 + 0.08 * k, z + 0.05, 0.012 + 0.006 * (k % 3), -8.0 + k % 2, sag=0.01) for k in range(4)]
    posts = [Box(1.92, -0.1, 0.03, 1.3, -2.5, float(s), float(s) + 0.05) for s in np.arange(0.7, 36, 1.5)]
    things: list[Thing] = [
        *trays,
        *posts,
        Tube(*section.point(0.7, -1, 0.28), 0.16, -3.5, gloss=0.03),
        Tube(*section.point(1.25, -1, 0.2), 0.09, -6.0),
        *wear.lamps(section, -0.35, 0.02, (2.5, 8.0, 13.5, 19.0, 24.5, 30.0, 35.0), 1.1, -1.5),
        Tube(*section.before(-0.62, 0.03), 0.012, -5.0),
    ]
    places = ((2.2, -0.15), (6.6, -0.1), (11.0, -0.2), (15.4, -0.1), (19.8, -0.15), (24.3, -0.1), (28.7, -0.2), (33.4, -0.1))
    stations = Static(tuple((s, n, 1.65) for s, n in places), 7.5, 1150.0, 1.8e-3)
    axis = Axis((571093.8, 6622418.2, 6.9), 266.0, grade=0.004)
    device = Instrument(55.0, pulse, noise=0.5, threshold=7.0, stray=0.004, drift=0.2)
    World(axis, canvas, things, device, stations, minnaert(0.9, 0.2), rng, reference=False, axis_points=2.0).write(folder)


def water(folder: Path) -> None:
    """Bored water tunnel, emptied: manganese slime below the waterline, inflows above and through it; 785 nm."""
    rng = np.random.default_rng(60606)
    section = Section(("arc", 2.65, 140.0), axis_height=2.65 * float(np.cos(np.radians(40.0))))
    wall = section.height
    canvas = Canvas(section, 31.0, rng, -5.0)
    rings = np.sin(2 * np.pi * canvas.s / 0.09)[:, None] * (0.6 + 0.4 * canvas.noise(1.2))
    canvas.relief += (0.002 * rings * canvas.wall).astype(np.float32)
    canvas.rough((1.6, 0.02), (0.4, 0.009), (0.1, 0.003))
    canvas.texture((1.8, 0.6), (0.35, 0.5), (0.08, 0.45), (0.035, 0.3))
    wear.floor(canvas, -9.0)
    for side in (1, -1):
        canvas.paint([sheet(-1, 32, wall(2.35), section.foot + 0.5)], -2.6, "manganese slime", side, soft=0.03, warp=0.035)
        canvas.paint([sheet(-1, 32, wall(2.5), wall(2.4))], 1.0, "lime line", side, soft=0.03, warp=0.02)
        zone = side * canvas.u > wall(2.3)
        canvas.albedo[:, zone] += 0.7 * canvas.noise((0.9, 0.25), (canvas.shape[0], int(zone.sum())))
    wear.bolts(canvas, 3.1, 1.7, 1.2, 0.08)
    for s in (3.6, 15.2):
        wear.repair(canvas, s, 1.5, (1.4, 1.7), 1.5, -1)
    canvas.paint([blob(9.0, 0.9, 0.7, 0.45)], -1.8, "dark rock in a gap", -1, soft=0.01, warp=0.09)
    canvas.paint([blob(20.6, wall(1.5), 0.8, 0.35)], 2.2, "slime flaked off", 1, soft=0.01, warp=0.09)
    canvas.paint([blob(5.9, wall(1.2), 0.5, 0.5)], 2.0, "slime flaked off", -1, soft=0.01, warp=0.08)
    wear.number(canvas, 12.0, wall(2.9), 1, 3.0)
    canvas.wet(
        Leak(
            [line(((2.6, -1.6), (3.3, 0.2), (3.6, 1.5)), 0.09), run(3.6, 1.4, wall(1.2), 0.25, 0.3)],
            3.6,
            "fissure",
            1,
            0.02,
            0.05,
        )
    )
    canvas.wet(Leak(wear.drip(7.2, 1.9, 2.6, 0.28, 0.25), 4.2, "inflow", -1, 0.02, 0.04, fade=-0.2))
    canvas.wet(Leak(wear.seep(11.0, 0.4, 0.8, 0.5, (0.7,)), 3.8, "patch", 1, 0.04, 0.1, uneven=0.18))
    canvas.wet(Leak([blob(14.4, 2.4, 0.9, 0.6), run(14.8, 2.5, wall(0.9), 0.35, 0.25)], 3.0, "patch", 1, 0.07, 0.1))
    canvas.wet(Leak([blob(17.6, -0.4, 0.6, 0.9)], 2.1, "damp", 1, 0.1, 0.1))
    canvas.wet(Leak(curtain(18.6, 20.0, 2.3, (0.8, 1.6, 2.3, 1.0), 0.15), 4.4, "curtain", -1, 0.02, 0.03, tide=1.0))
    canvas.wet(Leak(wear.seep(26.5, 1.0, 0.6, 0.5, (1.2,)), 4.0, "patch", -1, 0.05, 0.08, tide=1.0))
    canvas.wet(Leak(wear.drip(28.8, 2.2, 2.1, 0.3, 0.3), 3.8, "inflow", 1, 0.03, 0.05))
    hidden = "Damp on blotchy dark slime whose own changes are as strong"
    canvas.wet(Leak([blob(12.6, wall(1.0), 0.8, 0.35)], 1.4, "damp in slime", -1, 0.1, 0.09, limit=hidden))
    canvas.wet(Leak([run(22.3, 0.9, wall(2.0), 0.3, 0.5, 0.08)], 3.4, "run", 1, 0.03, 0.05))
    canvas.wet(Leak(wear.drip(1.2, 2.4, 1.0, 0.2, 0.18), 3.2, "drip", -1, 0.03, 0.03))
    things: list[Thing] = [
        Tube(*section.point(2.9, -1, 0.16), 0.055, -4.0),
        Tube(*section.point(3.1, 1, 0.12), 0.014, -6.5, sag=0.12, span=3.1),
        *wear.lamps(section, 0.55, 0.1, (5.0, 13.0, 21.0, 29.0), 0.5, -2.0),
    ]
    stations = Static(
        ((3.5, 0.2, 1.55), (9.2, -0.25, 1.6), (15.0, 0.15, 1.55), (20.8, -0.2, 1.6), (26.8, 0.2, 1.55)), 9.5, 1300.0, 1.7e-3
    )
    axis = Axis((493655.1, 6755231.6, 318.2), 79.0, radius=900.0, grade=0.006)
    device = Instrument(48.0, phase, noise=0.55, noise_weak=0.9, threshold=2.0, beam=4e-4, range_noise=0.001, stray=0.004)
    World(axis, canvas, things, device, stations, minnaert(0.8, 0.25), rng, axis_points=3.0).write(folder)
