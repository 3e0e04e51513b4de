"""Drill-and-blast tunnels: sprayed concrete on rock, and on frost insulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import wear
from .canvas import Canvas, Leak
from .equipment import Thing, Tube
from .fields import blob, curtain, line, run
from .instrument import Instrument, Mobile, Static, minnaert, oren_nayar, pulse, pulse_log
from .tunnel import Axis, Section
from .world import World


def rock(folder: Path) -> None:
    """Sprayed concrete straight on blasted rock, drips at bolts and along fissures."""
    rng = np.random.default_rng(60101)
    section = Section(("arc", 4.55, 90.0), ("line", 2.1), axis_height=2.6)
    wall = section.height
    canvas = Canvas(section, 27.0, rng, -5.6)
    canvas.rough((2.2, 0.09), (0.7, 0.035), (0.2, 0.008), (0.07, 0.003))
    canvas.texture((2.5, 0.5), (0.6, 0.5), (0.12, 0.5), (0.04, 0.5))
    for k, s in enumerate((4.6, 9.8, 14.5, 19.7, 24.4)):
        canvas.albedo += np.float32((-1) ** k * 0.55) * (canvas.s[:, None] > s + 0.25 * canvas.noise(1.0)) * canvas.wall
    bolts = wear.bolts(canvas, 1.7, 1.9, 1.5)
    wear.floor(canvas, -9.0, ((0.0, 0.12), (-3.0, 0.15), (3.0, 0.15)))
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 0.9, -1.7, side)
    canvas.paint([blob(9, 0.2, 11.0, 1.1)], -1.0, "soot", soft=0.25, warp=0.2)
    wear.repair(canvas, 6.4, wall(1.9), (1.6, 1.0), 1.8, 1)
    wear.repair(canvas, 21.5, wall(2.4), (0.9, 1.3), -1.5, -1)
    for s in (2.0, 12.0, 22.0):
        wear.number(canvas, s, wall(1.7), -1)
    canvas.paint([run(16.9, wall(4.2), wall(2.1), 0.35, 0.2, 0.08)], 3.0, "lime crust", -1, soft=0.03, warp=0.05)
    at = [(s, abs(u), 1 if u > 0 else -1) for s, u in bolts if 1.5 < abs(u) < wall(2.5)]
    for k, (s, v, side) in enumerate(at[3::13][:5]):
        canvas.wet(Leak(wear.drip(s, v, 1.3 + 0.5 * k, 0.2 + 0.06 * k, 0.24), 4.0 + k, "drip", side, 0.03, 0.05, fade=-0.3))
    fissure = ((7.4, -2.6), (8.0, -1.5), (8.2, -0.3), (9.0, 0.6), (9.4, 1.9))
    canvas.wet(
        Leak([line(fissure, 0.09), blob(8.2, -0.3, 0.5, 0.35), run(9.4, 1.8, 4.2, 0.3, 0.2)], 5.5, "fissure", 1, 0.03, 0.06)
    )
    canvas.wet(Leak(wear.seep(13.4, wall(3.4), 1.1, 0.7, (0.8, 1.6, 0.5)), 6.5, "patch", 1, 0.06, 0.14, tide=1.5))
    canvas.wet(Leak(wear.seep(19.6, wall(1.6), 1.3, 0.6, (1.5, 1.5, 1.5)), 4.5, "patch", -1, 0.12, 0.15, uneven=0.2))
    canvas.wet(Leak([blob(22.6, 0.6, 0.8, 1.1)], 2.6, "damp", 1, 0.15, 0.12))
    canvas.wet(Leak(curtain(3.2, 4.6, wall(5.0), (0.9, 2.2, 1.2, 0.5), 0.16), 7.0, "curtain", -1, 0.02, 0.03, fade=-0.2))
    canvas.wet(Leak([blob(25.0, wall(0.4), 0.9, 0.35)], 3.2, "foot", 1, 0.07, 0.1))
    things: list[Thing] = [
        *wear.tray(section, -wall(4.9), 0.32),
        Tube(*section.before(-wall(4.9), 0.42), 0.025, -8.0, sag=0.02),
        Tube(*section.point(3.1, 1, 0.35), 0.03, -8.5, sag=0.09, span=2.5),
        Tube(*section.point(2.9, 1, 0.34), 0.022, -8.0, sag=0.12, span=2.5),
        Tube(*section.point(0.45, -1, 0.3), 0.08, -5.0),
        *wear.lamps(section, 0.9, 0.35, (3.5, 11.0, 18.5, 26.0)),
        wear.mounted(section, wall(1.5), 0.15, 0.9, 0.3, -2.0, (17.0, 17.7)),
    ]
    stations = Static(((4.5, 0.4, 1.75), (13.2, -0.6, 1.7), (22.0, 0.5, 1.8)), 14.0, 1250.0)
    axis = Axis((594210.4, 6645120.7, 41.3), 37.0, grade=0.018)
    device = Instrument(57.0, pulse, noise=0.6, threshold=9.0, beam=3.5e-4)
    World(axis, canvas, things, device, stations, oren_nayar(0.45), rng, reference=False, axis_points=3.0).write(folder)


def sheets(folder: Path) -> None:
    """Frost insulation of foam sheets under sprayed concrete: leaks at laps, sawn joints, bolts and shrinkage cracks."""
    rng = np.random.default_rng(60202)
    section = Section(("arc", 5.1, 62.0), ("arc", 4.4, 42.0), ("line", 0.6), axis_height=2.3)
    wall = section.height
    canvas = Canvas(section, 30.0, rng, -5.0)
    bulge = np.cos(2 * np.pi * canvas.s[:, None] / 1.2) * np.cos(2 * np.pi * canvas.u[None] / 1.2)
    canvas.relief += (0.012 * bulge * canvas.wall).astype(np.float32)
    canvas.rough((3.0, 0.02), (0.25, 0.003), (0.06, 0.0025))
    canvas.texture((3.0, 0.35), (0.5, 0.3), (0.1, 0.35), (0.035, 0.45))
    for s in np.arange(0.9, 30, 2.4):
        canvas.relief += 0.018 * (np.abs(canvas.s - s) < 0.14)[:, None] * canvas.wall
        canvas.albedo += 0.4 * (np.abs(canvas.s - s) < 0.14)[:, None] * canvas.wall
    wear.joints(canvas, (8.1, 22.5), -2.5, 0.01)
    wear.bolts(canvas, 1.2, 1.2, -1.2, 0.045)
    wear.floor(canvas, -8.5, ((0.0, 0.12), (-3.2, 0.15), (3.2, 0.15)))
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 1.3, -2.2, side)
        wear.streaks(canvas, wall(4.1), side, 7, -1.8, 1.4)
    canvas.paint([blob(15, 0.0, 22.0, 1.5)], -1.6, "soot", soft=0.35, warp=0.15)
    for k in range(9):
        wear.crack(canvas, 2.0 + 3.1 * k, 1.5 + 0.5 * (k % 5), 1.5, k % 2 == 0, (-1) ** k)
    wear.repair(canvas, 18.2, wall(2.2), (1.2, 1.2), 1.4, 1)
    wear.repair(canvas, 5.0, wall(2.8), (0.8, 0.6), 1.9, -1)
    lap = [0.9 + 2.4 * k for k in range(12)]
    canvas.wet(
        Leak([line(((8.1, 1.0), (8.1, wall(0.7))), 0.1), blob(8.1, wall(2.4), 0.35, 0.6)], 5.0, "wet joint", 1, 0.025, 0.03)
    )
    canvas.wet(Leak([line(((22.5, -1.2), (22.5, 1.3)), 0.13)], 4.0, "wet joint", 1, 0.03, 0.04))
    canvas.wet(Leak([run(lap[1] + 0.16, wall(4.6), section.foot, 0.25, 0.6, 0.05)], 6.5, "run", -1, 0.03, 0.04, fade=-0.3))
    canvas.wet(Leak(wear.drip(lap[5] - 0.5, wall(4.9), 1.7, 0.24), 7.5, "drip", -1, 0.02, 0.03, tide=2.0))
    canvas.wet(Leak(wear.drip(lap[2] + 0.3, wall(5.4), 2.6, 0.16), 6.0, "drip", 1, 0.02, 0.03))
    canvas.wet(Leak(wear.seep(lap[7] - 0.9, wall(1.7), 0.9, 0.5, (0.9, 0.4)), 3.4, "damp", -1, 0.14, 0.1, uneven=0.2))
    canvas.wet(Leak([blob(27.2, wall(0.45), 1.5, 0.45)], 3.0, "foot", 1, 0.08, 0.09))
    crack = ((25.6, wall(3.9)), (26.3, wall(3.6)), (26.8, wall(3.75)), (27.7, wall(3.3)))
    canvas.wet(Leak([line(crack, 0.1)], 3.6, "wet crack", -1, 0.03, 0.05, tide=1.2))
    canvas.wet(Leak([blob(14.4, -0.8, 0.45, 0.6), blob(14.9, -0.3, 0.3, 0.3)], 5.5, "patch", 1, 0.05, 0.07))
    things: list[Thing] = [
        *wear.barrier(section, 1, 0.45),
        *wear.barrier(section, -1, 0.45),
        *wear.tray(section, 1.9, 0.25, 0.35),
        *wear.lamps(section, 1.3, 0.25, (2.0, 8.5, 15.0, 21.5, 28.0)),
        *(Tube(*section.point(h, -1, 0.06), 0.018, -8.0, sag=0.015, span=1.2) for h in (3.55, 3.62)),
        wear.mounted(section, wall(1.45), 0.02, 1.1, 0.25, -1.5, (11.2, 11.9)),
    ]
    drive = Mobile(-0.9, 2.55, 22.0, 0.021, 4.0e-3)
    axis = Axis((401877.2, 6789455.9, 112.8), 301.0, radius=-700.0, grade=-0.022)
    device = Instrument(60.0, pulse_log, noise=0.55, threshold=10.0, step=0.05, drift=0.2)
    World(axis, canvas, things, device, drive, minnaert(0.85, 0.15), rng, axis_points=5.0).write(folder)
