"""Busy road tunnels, scanned from a van: wall panels and jet fans, and one that is only dirty."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import wear
from .canvas import Canvas, Leak
from .equipment import Box, Thing, Tube
from .fields import blob, curtain, line, run, sheet
from .instrument import Instrument, Mobile, minnaert, pulse, pulse_log
from .tunnel import Axis, Section
from .world import World


def panels(folder: Path) -> None:
    """Painted wall elements below a sprayed vault with jet fans: water over the panels' upper edge and behind fans."""
    rng = np.random.default_rng(60707)
    section = Section(("arc", 5.4, 55.0), ("arc", 4.6, 35.0), ("line", 2.0), axis_height=2.5)
    wall = section.height
    canvas = Canvas(section, 30.0, rng, -6.0)
    canvas.rough((2.0, 0.025), (0.5, 0.01), (0.1, 0.003))
    canvas.texture((2.5, 0.4), (0.5, 0.4), (0.1, 0.4), (0.035, 0.4))
    top, foot = wall(3.5), section.foot
    panel = np.abs(canvas.u) > top
    canvas.relief[:, panel & canvas.wall] *= 0.06
    canvas.relief += (0.14 * np.clip((np.abs(canvas.u) - top) / 0.045, 0, 1) * canvas.wall).astype(np.float32)
    shade = 3.0 + 0.35 * canvas.noise((1.5, 0.7)) + 0.15 * canvas.noise(0.08)
    canvas.albedo += (shade * (panel & canvas.wall)).astype(np.float32)
    canvas.gloss += (0.12 * (panel & canvas.wall)).astype(np.float32)
    for k, s in enumerate(np.arange(2.2, 30, 5.0)):
        canvas.albedo[:, panel & canvas.wall] += np.float32(0.3 * (-1) ** k) * (canvas.s > s)[:, None]
        for side in (1, -1):
            canvas.paint([line(((float(s), top), (float(s), foot)), 0.012)], -4.0, side=side, soft=0.006)
    wear.floor(canvas, -8.6, ((0.0, 0.15), (-3.5, 0.2), (3.5, 0.2)))
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 1.0, -2.4, side, "traffic film")
        wear.streaks(canvas, top + 0.05, side, 12, -1.6, 1.5)
    canvas.paint([blob(15, 0.0, 24.0, 1.9)], -1.5, "soot", soft=0.4, warp=0.2)
    wear.repair(canvas, 9.7, wall(4.6), (1.5, 1.0), 2.0, -1)
    canvas.paint([line(((17.3, wall(1.15)), (20.6, wall(0.95))), 0.05)], -3.0, "tyre scuff", 1, soft=0.02, warp=0.02)
    canvas.paint([sheet(6.0, 7.4, wall(2.6), wall(1.2))], 2.0, "washed field", 1, soft=0.05, warp=0.04)
    canvas.wet(Leak([run(4.1, wall(4.5), wall(0.5), 0.5, 0.3, 0.05)], 5.5, "over the edge", 1, 0.02, 0.04, fade=-0.3))
    canvas.wet(Leak(curtain(12.3, 13.5, top - 0.1, (1.2, 2.6, 0.8, 1.7), 0.15), 4.0, "over the edge", -1, 0.02, 0.025))
    canvas.wet(Leak([line(((22.2, top), (22.2, foot)), 0.1), blob(22.3, wall(0.6), 0.5, 0.4)], 4.8, "wet joint", 1, 0.02, 0.03))
    canvas.wet(Leak(wear.seep(9.6, 0.9, 1.3, 1.0, (0.8, 1.1)), 5.5, "behind fan", 1, 0.06, 0.12))
    canvas.wet(Leak(wear.seep(19.8, -0.9, 0.9, 1.2), 4.2, "patch", 1, 0.08, 0.13, uneven=0.2))
    canvas.wet(Leak(wear.seep(25.0, wall(4.7), 1.2, 0.6, (0.5, 0.4, 0.4)), 6.5, "patch", -1, 0.05, 0.1, tide=1.5))
    canvas.wet(Leak(wear.drip(16.4, wall(5.6), 1.3, 0.2), 7.0, "drip", 1, 0.02, 0.03))
    canvas.wet(Leak([blob(27.8, 0.9, 0.7, 0.6)], 2.6, "damp", 1, 0.13, 0.1))
    canvas.wet(Leak([line(((1.2, wall(5.1)), (1.9, wall(4.6)), (2.2, wall(3.9))), 0.11)], 4.5, "fissure", -1, 0.03, 0.05))
    canvas.wet(Leak([blob(7.6, wall(0.4), 1.0, 0.35)], 3.4, "foot", -1, 0.06, 0.07))
    crown = section.z.max()
    fans: list[Thing] = []
    for n in (-1.3, 1.3):
        fans.append(Tube(n, crown - 1.15, 0.52, -2.5, 8.0, 11.6, gloss=0.05))
        fans += [Box(n, crown - 0.4, 0.35, 0.3, -3.0, s, s + 0.08) for s in (8.7, 10.8)]
    things: list[Thing] = [
        *fans,
        *wear.tray(section, wall(5.2), 0.25, 0.4),
        *wear.tray(section, -wall(5.2), 0.25, 0.3),
        *wear.lamps(section, 0.0, 0.3, (2.0, 6.0, 14.0, 18.0, 22.0, 26.0), 1.3),
        Tube(*section.before(wall(5.2), 0.33), 0.03, -8.0, sag=0.01),
        wear.kerb(section, 1, 0.6, 0.2),
        wear.kerb(section, -1, 0.6, 0.2),
        wear.mounted(section, wall(2.4), 0.16, 0.6, 0.15, 1.0, (14.9, 15.7)),
        wear.mounted(section, -wall(1.5), 0.14, 1.2, 0.06, -2.0, (19.2, 20.0)),
    ]
    drive = Mobile(1.2, 2.4, 0.0, 0.019, 3.9e-3, speed=1.1)
    axis = Axis((586410.3, 6640777.5, -88.6), 152.0, radius=600.0, grade=0.03)
    device = Instrument(61.0, pulse, noise=0.55, threshold=10.0, drift=0.25, beam=4e-4)
    World(axis, canvas, things, device, drive, minnaert(0.9, 0.12), rng, axis_points=5.0).write(folder)


def dirty(folder: Path) -> None:
    """Old cast road tunnel in a dry stretch: soot, traffic film, dry streaks, lamps' plumes, repairs; no water at all."""
    rng = np.random.default_rng(60808)
    section = Section(("arc", 4.7, 112.0), axis_height=1.9)
    wall = section.height
    canvas = Canvas(section, 30.0, rng, -4.7)
    canvas.rough((4.0, 0.01), (0.06, 0.001))
    canvas.texture((3.0, 0.6), (0.7, 0.5), (0.1, 0.35), (0.04, 0.3))
    wear.formwork(canvas, 2.0, 1.0, 0.3)
    wear.joints(canvas, (2.7, 12.7, 22.7), -3.0, 0.015)
    wear.floor(canvas, -9.0, ((0.0, 0.12), (-3.1, 0.15), (3.1, 0.15)))
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 1.5, -3.0, side, "traffic film")
        wear.streaks(canvas, wall(4.3), side, 12, -2.2, 1.8)
        for k in range(6):
            wear.crack(canvas, 2.0 + 4.6 * k, wall(4.6 - 0.3 * k), 1.6, k % 2 == 0, side, -2.0)
    canvas.paint([blob(14, 0.3, 20.0, 2.2)], -2.2, "soot", soft=0.5, warp=0.25)
    lamps_at = (3.0, 9.0, 15.0, 21.0, 27.0)
    for s in lamps_at:
        wear.plume(canvas, s, 2.6, -1, 1.0, -2.0)
    for s, v, size, db, side in (
        (6.2, wall(2.6), (1.3, 0.9), -2.4, 1),
        (18.9, wall(3.2), (0.8, 1.8), 2.0, 1),
        (12.3, wall(2.8), (0.7, 2.4), -1.8, -1),
        (25.4, wall(2.3), (1.8, 0.8), -2.8, -1),
    ):
        wear.repair(canvas, s, v, size, db, side)
    canvas.paint([line(((14.0, wall(1.2)), (18.2, wall(1.0))), 0.06)], -2.5, "tyre scuff", 1, soft=0.02, warp=0.02)
    canvas.paint([run(22.8, wall(5.2), wall(2.0), 0.35, 0.2, 0.05)], 3.0, "lime crust", 1, soft=0.02, warp=0.04)
    canvas.paint([blob(9.4, 1.2, 0.6, 0.5)], 2.4, "old salt rim", 1, soft=0.05, warp=0.1)
    canvas.paint([blob(20.0, wall(2.0), 0.9, 0.6)], -2.6, "bitumen paint", -1, soft=0.006, warp=0.02)
    canvas.paint([blob(27.6, wall(1.9), 0.8, 0.8)], -3.0, "soot of a burnt car", 1, soft=0.25, warp=0.15)
    for s in (5.0, 15.0, 25.0):
        wear.number(canvas, s, wall(2.1), -1)
    things: list[Thing] = [
        *wear.lamps(section, -2.9, 0.1, lamps_at, 1.2),
        *wear.lamps(section, 2.9, 0.1, lamps_at, 1.2),
        *(Tube(*section.before(3.35 + 0.07 * k, 0.06), 0.02, -8.0, sag=0.02, span=1.0) for k in range(3)),
        Tube(*section.point(2.4, -1, 0.1), 0.04, -4.5),
        wear.kerb(section, 1, 0.8, 0.2),
        wear.kerb(section, -1, 0.8, 0.2),
        wear.mounted(section, wall(1.6), 0.0, 1.0, 0.25, -2.5, (9.8, 10.5)),
        wear.mounted(section, -wall(2.7), 0.04, 0.6, 0.05, 0.5, (17.6, 18.2)),
    ]
    drive = Mobile(-0.7, 2.5, 40.0, 0.022, 4.1e-3, speed=1.2)
    axis = Axis((559120.0, 6733840.8, 154.1), 12.0, radius=-1200.0, grade=-0.012)
    device = Instrument(60.0, pulse_log, noise=0.6, noise_weak=1.0, threshold=9.0, drift=0.2, step=0.05)
    World(axis, canvas, things, device, drive, minnaert(1.0, 0.2), rng, axis_points=6.0).write(folder)
