"""Cast concrete: a portal, and a gallery with openings towards the valley."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import wear
from .canvas import Canvas, Leak
from .equipment import Thing, Tube
from .fields import blob, curtain, line, run, sheet
from .instrument import Instrument, Static, minnaert, oren_nayar, pulse, pulse_log
from .tunnel import Axis, Section
from .world import World


def portal(folder: Path) -> None:
    """Cast portal in a curve: block joints that leak, salt fringes, algae in the daylight."""
    rng = np.random.default_rng(60303)
    section = Section(("arc", 5.6, 48.0), ("arc", 3.9, 42.0), ("line", 1.9), axis_height=2.4)
    wall = section.height
    canvas = Canvas(section, 26.0, rng, -4.6)
    canvas.rough((4.0, 0.008), (0.05, 0.0008))
    canvas.texture((2.5, 0.4), (0.4, 0.3), (0.08, 0.3))
    wear.formwork(canvas, 1.5, 0.75, 0.22)
    wear.joints(canvas, (7.9, 15.9, 23.9), -2.5)
    wear.floor(canvas, -8.8, ((0.0, 0.15), (-3.4, 0.2), (3.4, 0.2)))
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 1.1, -1.8, side)
        canvas.paint([sheet(-1, 2.6, wall(4.5), wall(1.0))], -2.2, "algae", side, soft=0.3, warp=0.3)
        for k in range(4):
            wear.crack(canvas, 3.0 + 5.5 * k, wall(4.2 - 0.4 * k), 1.8, False, side)
    wear.repair(canvas, 15.4, wall(3.0), (0.7, 2.2), 1.7, 1)
    wear.repair(canvas, 8.3, wall(1.8), (0.6, 1.1), -1.8, -1)
    for s in (5.0, 13.0, 21.0):
        wear.number(canvas, s, wall(2.2), 1, 4.0)
    canvas.paint([run(19.2, wall(5.0), wall(2.6), 0.3, 0.14, 0.04)], 3.2, "lime crust", 1, soft=0.02, warp=0.03)
    canvas.wet(
        Leak([line(((7.9, -1.6), (7.9, wall(2.0))), 0.11), blob(8.0, 1.8, 0.4, 0.7)], 5.5, "wet joint", 1, 0.02, 0.04, tide=2.2)
    )
    canvas.wet(Leak([line(((15.9, wall(4.8)), (15.9, section.foot)), 0.14)], 4.2, "wet joint", -1, 0.03, 0.05, tide=1.8))
    canvas.wet(Leak([line(((23.9, wall(3.2)), (23.9, wall(0.6))), 0.09)], 3.2, "wet joint", 1, 0.02, 0.03))
    canvas.wet(Leak(wear.seep(4.6, wall(3.4), 0.9, 0.6, (0.7, 1.4)), 6.0, "salt fringe", -1, 0.03, 0.09, tide=3.5))
    canvas.wet(
        Leak(wear.seep(11.4, wall(4.9), 0.7, 0.5, (1.8, 0.6, 1.0)), 6.8, "salt fringe", 1, 0.03, 0.07, tide=3.0, fade=-0.3)
    )
    crack = ((17.5, 0.4), (18.1, 0.7), (18.9, 0.5), (19.8, 1.0), (20.9, 0.9))
    canvas.wet(Leak([line(crack, 0.1), blob(18.9, 0.5, 0.35, 0.3)], 4.6, "wet crack", -1, 0.03, 0.05, tide=1.5))
    canvas.wet(Leak([blob(12.3, wall(0.5), 1.4, 0.4)], 2.8, "rising damp", -1, 0.1, 0.1))
    canvas.wet(Leak([blob(0.9, 0.0, 0.8, 1.6)], 3.5, "damp", 1, 0.18, 0.15))
    canvas.wet(Leak(wear.drip(21.6, wall(3.6), 1.2, 0.18), 5.0, "drip", -1, 0.02, 0.03))
    things: list[Thing] = [
        wear.kerb(section, 1, 0.9, 0.18),
        wear.kerb(section, -1, 0.9, 0.18),
        *wear.lamps(section, -0.7, 0.05, (1.5, 5.0, 8.5, 12.0, 15.5, 19.0, 22.5)),
        *(Tube(*section.before(-1.3 - 0.06 * k, 0.05), 0.016, -8.0, sag=0.01, span=1.0) for k in range(3)),
        Tube(*section.point(2.55, 1, 0.12), 0.055, -3.0, gloss=0.04),
        Tube(*section.point(0.75, -1, 0.14), 0.07, -5.5),
        wear.mounted(section, -wall(2.6), 0.06, 0.7, 0.08, -0.5, (9.6, 10.3)),
        wear.mounted(section, wall(1.4), 0.0, 1.0, 0.2, -2.5, (17.2, 17.9)),
    ]
    stations = Static(((3.5, -0.8, 1.7), (12.5, 0.7, 1.75), (21.5, -0.4, 1.7)), 14.0, 1250.0)
    axis = Axis((612744.9, 6712008.3, 63.5), 118.0, radius=340.0, grade=0.012)
    device = Instrument(56.0, pulse_log, noise=0.45, threshold=8.0, drift=0.25)
    World(axis, canvas, things, device, stations, minnaert(0.95, 0.1), rng, axis_points=2.0).write(folder)


def gallery(folder: Path) -> None:
    """Avalanche gallery: box with openings, leaking joints of the roof, water down the columns."""
    rng = np.random.default_rng(60404)
    pieces = (("line", 4.6), ("turn", 45.0), ("line", 0.5), ("turn", 45.0), ("line", 4.9))
    section = Section(*pieces, axis_height=2.6)  # type: ignore[arg-type]
    wall = section.height
    canvas = Canvas(section, 26.0, rng, -5.2)
    canvas.rough((5.0, 0.006), (0.06, 0.001))
    canvas.texture((2.0, 0.45), (0.5, 0.35), (0.1, 0.35), (0.04, 0.3))
    wear.formwork(canvas, 2.5, 0.5, 0.3)
    wear.joints(canvas, (5.6, 13.1, 20.6), -2.0, 0.015)
    wear.floor(canvas, -8.5, ((0.2, 0.12), (-3.3, 0.15), (3.6, 0.15)))
    for side in (1, -1):
        wear.dirt_at_foot(canvas, 0.8, -2.0, side)
    wear.streaks(canvas, wall(4.6), 1, 9, -1.7, 1.8)
    V = -canvas.u
    for s in np.arange(0.9, 25, 5.0):
        window = (np.abs(canvas.s - s - 1.75) < 1.75)[:, None] & ((wall(4.1) < V) & (wall(0.95) > V))[None]
        canvas.hole |= window
    wear.repair(canvas, 10.5, 2.4, (1.1, 1.6), 1.3, 1)
    wear.repair(canvas, 17.0, wall(2.4), (1.4, 0.8), -1.6, 1)
    canvas.paint([blob(3.2, 2.0, 0.5, 0.4)], 2.8, "lime crust", -1, soft=0.03, warp=0.08)
    canvas.paint([blob(22.8, wall(1.9), 1.5, 0.7)], -1.6, "graffiti overpainted", 1, soft=0.01, warp=0.03)
    canvas.wet(
        Leak([line(((5.6, -3.9), (5.6, -0.8)), 0.14), blob(5.6, -2.4, 0.55, 0.6)], 6.0, "wet joint", 1, 0.03, 0.06, tide=2.0)
    )
    canvas.wet(Leak([line(((13.1, 1.2), (13.1, wall(2.2))), 0.12), blob(13.3, 4.2, 0.6, 0.4)], 5.0, "wet joint", 1, 0.03, 0.05))
    canvas.wet(Leak([line(((20.6, -0.9), (20.6, 2.2)), 0.1)], 3.6, "wet joint", 1, 0.04, 0.04))
    canvas.wet(Leak([blob(8.6, 1.6, 1.1, 0.8), blob(9.6, 2.1, 0.5, 0.5)], 4.4, "patch", 1, 0.05, 0.13, tide=2.5, uneven=0.2))
    canvas.wet(Leak([blob(16.4, 2.3, 0.7, 1.0)], 2.4, "damp", -1, 0.14, 0.12))
    canvas.wet(Leak([run(5.25, wall(4.75), section.foot, 0.35, 0.5, 0.05)], 6.5, "column", -1, 0.03, 0.04))
    canvas.wet(Leak([run(20.2, wall(4.6), wall(1.5), 0.3, 0.2, 0.05)], 4.0, "column", -1, 0.05, 0.04, fade=-0.4))
    canvas.wet(Leak(curtain(23.0, 24.3, wall(4.85), (1.0, 2.4, 1.7), 0.17), 7.0, "curtain", 1, 0.02, 0.03))
    canvas.wet(Leak([line(((1.2, wall(0.9)), (4.4, wall(0.8))), 0.12)], 3.0, "cold joint", 1, 0.05, 0.06))
    canvas.wet(Leak(wear.drip(18.6, wall(3.1), 1.4, 0.2), 5.5, "drip", 1, 0.02, 0.03, tide=1.5))
    things: list[Thing] = [
        *wear.barrier(section, 1, 0.5),
        *(Tube(*section.point(h, -1, 0.08), 0.03, -1.5, gloss=0.04) for h in (1.05, 1.4)),
        *wear.lamps(section, 2.9, 0.0, (2.5, 10.5, 18.5), 1.2),
        *(Tube(*section.before(3.35 + 0.05 * k, 0.04), 0.015, -8.0) for k in range(2)),
        Tube(*section.point(4.1, 1, 0.1), 0.05, -4.0),
        wear.mounted(section, wall(1.5), 0.0, 0.7, 0.22, -2.0, (14.6, 15.1)),
    ]
    stations = Static(((4.0, 0.6, 1.7), (13.0, -0.7, 1.7), (22.0, 0.4, 1.7)), 13.0, 1300.0)
    axis = Axis((418302.6, 6830990.1, 287.4), 201.0, grade=-0.02)
    device = Instrument(59.0, pulse, noise=0.65, noise_weak=1.0, threshold=9.0, beam=5e-4, stray=0.003)
    World(axis, canvas, things, device, stations, oren_nayar(0.3), rng, axis_points=4.0).write(folder)
