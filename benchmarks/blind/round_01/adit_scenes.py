"""Access tunnels: old brickwork, and sprayed concrete."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .canvas import Canvas, Water
from .equipment import Body, beam, hoop, plate, strand
from .files import Survey, tripods
from .fitout import RUBBER, ZINC, cable_wall, floor_dirt, grain, lamps, oil, old_runs, plates, repairs, soot
from .frames import Axis, Tunnel
from .instruments import Instrument, Law
from .linings import Bricks, Sprayed
from .sections import horseshoe
from .shapes import Crack, Disc, Foot, Joined, Patch, RingJoint, Run, Slab
from .trace import Wall


def brick_adit(folder: Path) -> None:
    """Write the scene of a masonry access tunnel with seepage through its courses."""
    rng = np.random.default_rng(106)
    floor, length = 1.5, 36.0
    axis = Axis(478_902.2, 5_741_366.0, 36.5, 24.0, length, 1 / 180, -0.035)
    tunnel = Tunnel(axis, horseshoe(2.25, 1.9, floor, 0.12))
    canvas = Canvas(tunnel, rng)
    lining = Bricks(0.235, 0.0765, 0.01, rng, 0.75, 0.9)
    grain(canvas, (0.5, 0.35, 0.2))
    canvas.texture(canvas.relief, 0.006, 1.2)
    soot(canvas, -2.6, 1.5)
    _masonry(canvas)
    _seepage(canvas)
    floor_dirt(canvas, 0.008, 1.0)
    bodies: list[Body] = list(strand(tunnel, (0.0, length), -3.9, 0.1, 0.04, -3.5))
    bodies += strand(tunnel, (0.0, length), 4.45, 0.11, 0.055, -4.5)
    bodies += cable_wall(tunnel, rng, [3.55, 3.75], 3, 0.12, 0.9)
    bodies += lamps(tunnel, 2.7, 2.5, 6.0, (0.65, 0.13, 0.11))
    for u in np.arange(1.0, length, 2.0):
        bodies += hoop(tunnel, float(u), (-4.42, -4.36), 0.06, 0.02, ZINC)
    bodies += strand(tunnel, (0.0, length), -4.35, 0.11, 0.021, -3.0)
    bodies += plates(canvas, -2.6, 5.0, 11.0)
    wall = Wall(tunnel, lining, canvas, Law(30.0, -0.1), -4.0, -7.0, Law(30.0))
    pulse = Instrument(55.0, 2.0, 1.4, 0.2, 5.0, 0.4, 2.0, 0.0014, (0.006, 0.00035), 0.01, 0.15, 0.0015)
    places = [(3.4, 0.1, 0.2), (10.6, -0.15, 0.18), (18.0, 0.1, 0.22), (25.3, -0.1, 0.2), (32.6, 0.12, 0.19)]
    survey = Survey(wall, bodies, tripods(wall, places, 0.004), pulse, rng, cube=0.0165)
    survey.off_axis = (0.01, -0.02)
    survey.deliver(folder)


def _masonry(canvas: Canvas) -> None:
    """Repointing, patches of other bricks and of render, salts, weep holes, streaks: dry."""
    rng = canvas.rng
    for u, v, du, dv in ((6.3, 3.4, 2.2, 1.1), (20.4, -3.2, 1.6, 1.4), (29.8, 1.2, 1.2, 1.0)):
        canvas.stain(Slab(u, v, du, dv), 1.3, "repointing", 0.05, 0.5)
    for u, v, du, dv in ((13.1, 3.9, 0.94, 0.77), (23.8, -1.4, 0.7, 0.61)):
        canvas.stain(Slab(u, v, du, dv), -1.9, "engineering bricks", 0.015, 0.15)
    canvas.stain(Patch(33.2, -2.2, 0.8, 0.6, 0.15), 1.0, "render", 0.04, 0.2, -0.012)
    canvas.stain(Slab(16.0, 4.6, 0.9, 0.9), -2.6, "tar paint", 0.03, 0.15)
    for u, v, ru, rv, rise in (
        (8.9, -3.9, 0.9, 0.5, 2.4),
        (15.4, -4.2, 1.3, 0.4, 2.0),
        (26.6, 3.7, 0.7, 0.6, 2.8),
        (31.0, 4.4, 0.9, 0.35, 2.2),
    ):
        canvas.stain(Patch(u, v, ru, rv, 0.45), rise, "salt bloom", 0.12, 0.6)
    for u in np.arange(2.2, canvas.u[-1] - 0.5, 3.6):
        for side in (-1, 1):
            hole = Slab(float(u), side * 4.85, 0.075, 0.065)
            canvas.carve(hole, 0.07, 0.025)
            canvas.stain(hole, -2.0, "", 0.02)
            if rng.random() < 0.5:
                canvas.stain(Run(float(u), side * 4.85, side * 5.35, 0.07, 0.12, 0.02), -1.4, "dry streak", 0.03)
    canvas.stain(Crack((11.5, -2.5), (13.0, 2.0), 0.012, 0.1), -2.5, "", 0.01)
    old_runs(canvas, 9, (-1.7, -0.7), "dry streak", (1.6, 4.0))
    old_runs(canvas, 5, (1.2, 2.4), "lime run", (1.2, 3.4))
    oil(canvas, [(28.4, 4.9, 0.2)], -2.6)


def _seepage(canvas: Canvas) -> None:
    """Water through joints and bricks."""
    foot = canvas.tunnel.section.foot
    arch = Joined((Patch(5.4, -0.9, 0.7, 0.6, 0.35), Run(5.5, -1.0, -4.0, 0.55, 0.3, 0.12)))
    canvas.leak(arch, Water(6.0, "seepage", 0.06, 0.3, 0.15, 2.2, 0.12))
    canvas.leak(Patch(10.2, 2.6, 0.9, 0.8, 0.35), Water(4.4, "seepage", 0.1, 0.4, 0.0, 2.6, 0.16))
    canvas.leak(Patch(14.6, 0.5, 0.45, 0.4, 0.35), Water(6.2, "crown drip", 0.05, 0.3, 0.3, 1.5, 0.08))
    canvas.leak(Foot(-1, 18.6, 23.6, 0.75, foot, 0.35), Water(4.2, "rising damp", 0.14, 0.5, 0.0, 2.4, 0.2))
    canvas.leak(Foot(1, 1.6, 4.4, 0.5, foot, 0.35), Water(3.6, "rising damp", 0.12, 0.5, 0.0, 1.8, 0.15))
    weep = Joined((Slab(23.8, 4.85, 0.11, 0.1), Run(23.8, 4.8, foot, 0.26, 0.42, 0.04)))
    canvas.leak(weep, Water(6.5, "weep hole", 0.04, 0.2, 0.3))
    canvas.leak(RingJoint(18.0, -1.6, 3.3, 0.28), Water(5.0, "ring crack", 0.05, 0.3, 0.1, 1.8, 0.1))
    canvas.leak(Patch(28.2, -3.9, 0.8, 0.5, 0.35), Water(4.6, "behind pipe", 0.08, 0.4, 0.05, 2.0, 0.12))
    canvas.leak(Run(31.6, 1.4, 4.0, 0.3, 0.2, 0.1), Water(5.0, "trickle", 0.05, 0.3, 0.1))
    canvas.leak(Patch(34.0, 3.2, 0.6, 0.8, 0.35), Water(3.0, "damp patch", 0.15, 0.5))
    canvas.leak(Patch(12.3, -4.3, 0.5, 0.4, 0.35), Water(3.6, "behind pipe", 0.08, 0.4))


def sprayed_adit(folder: Path) -> None:
    """Write the scene of a rough sprayed lining, wet at drains, at girders and between its lobes."""
    rng = np.random.default_rng(108)
    floor, length = 1.6, 28.0
    axis = Axis(391_455.8, 5_289_640.3, 612.0, 307.0, length, 1 / 90, 0.06)
    tunnel = Tunnel(axis, horseshoe(2.7, 1.9, floor, 0.05))
    canvas = Canvas(tunnel, rng)
    lining = Sprayed()
    lining.paint(canvas, 0.018, 1.5)
    _spraying(canvas)
    _weeps(canvas)
    floor_dirt(canvas, 0.03, 0.8)
    bodies: list[Body] = list(strand(tunnel, (0.0, length), -1.1, 0.5, 0.3, -3.0))
    bodies += strand(tunnel, (0.0, length), 4.6, 0.14, 0.05, -3.5)
    bodies += cable_wall(tunnel, rng, [-3.8], 4, 0.14, 1.5)
    bodies += lamps(tunnel, 2.9, 2.0, 5.5, (0.6, 0.16, 0.12))
    bodies += strand(tunnel, (0.0, length), -4.5, 0.12, 0.035, RUBBER, 0.05, 3.0)
    bodies += beam(tunnel, (0.0, length), 2.25, -floor + 0.12, 0.5, 0.24, -4.0)
    for u, v in ((4.2, 0.4), (4.2, 2.2), (4.2, -2.4), (13.2, 0.4), (13.2, 2.2), (13.2, -2.4), (22.2, 0.4), (22.2, -2.4)):
        bodies.append(plate(tunnel, u, v, (0.06, 0.06, 0.05), 4.0, 0.05))
    bodies += plates(canvas, 3.4, 6.0, 10.0)
    wall = Wall(tunnel, lining, canvas, Law(34.0), -4.6, -6.8, Law(34.0))
    pulse = Instrument(46.0, 2.0, 2.2, 0.3, 3.0, 0.5, 2.5, 0.0018, (0.007, 0.0004), 0.02, 0.2, 0.003)
    places = [(3.0, -0.5, 0.15), (9.6, 0.4, 0.12), (16.2, -0.4, 0.18), (23.4, 0.5, 0.14)]
    survey = Survey(wall, bodies, tripods(wall, places, 0.0042), pulse, rng, cube=0.0175, reference=False)
    survey.off_axis = (-0.03, 0.04)
    survey.deliver(folder)


def _spraying(canvas: Canvas) -> None:
    """Passes of different mixes, drains under mortar, plates of bolts, holes, streaks: dry."""
    rng = canvas.rng
    for u, v, ru, rv, shade in ((6.8, 2.6, 1.5, 1.0, -1.4), (17.8, -2.9, 1.3, 1.2, -1.6), (24.8, 1.0, 1.4, 0.8, 1.1)):
        canvas.stain(Patch(u, v, ru, rv, 0.4), shade, "other mix", 0.15, 0.15, -0.012)
    for u, start, end in ((8.3, 0.9, 5.0), (14.9, -5.0, -1.4), (20.9, 0.6, 5.0)):
        canvas.stain(Slab(u, (start + end) / 2, 0.2, end - start), 0.9, "drain cover", 0.06, 0.3, -0.045)
    for u in np.arange(1.1, canvas.u[-1] - 0.5, 1.5):
        for v in (-3.3, -1.9, 1.8, 3.2):
            spot = (float(u + rng.normal(0, 0.12)), float(v + rng.normal(0, 0.15)))
            canvas.stain(Slab(*spot, 0.16, 0.16), -1.8, "bolt plate", 0.012, 0.1, -0.025)
    for u, v, radius in ((11.7, 4.2, 0.25), (26.0, -4.1, 0.3)):
        canvas.stain(Disc(u, v, radius), -1.2, "fresh mortar", 0.03, 0.2)
    repairs(canvas, 3, (-1.0, 1.0))
    old_runs(canvas, 7, (-1.6, -0.7), "dry streak", (1.6, 4.0))
    old_runs(canvas, 5, (1.4, 2.8), "lime run", (1.2, 3.6))
    foot = canvas.tunnel.section.foot
    canvas.stain(Foot(1, 0.5, 27.5, 0.35, foot, 0.4), -1.4, "mud", 0.1, 0.2)


def _weeps(canvas: Canvas) -> None:
    """Water between lobes, at drain holes, along girders."""
    foot = canvas.tunnel.section.foot
    drain = Joined((Disc(8.9, 3.6, 0.1), Run(8.9, 3.6, foot, 0.22, 0.5, 0.1)))
    canvas.leak(drain, Water(6.0, "drain hole", 0.04, 0.25, 0.3))
    canvas.leak(Patch(3.6, -2.3, 0.9, 0.8, 0.35), Water(4.2, "damp patch", 0.1, 0.5, 0.0, 1.8, 0.1))
    arch = Joined((Patch(12.5, 1.0, 0.7, 0.6, 0.4), Run(12.6, 1.1, 3.9, 0.5, 0.25, 0.14)))
    canvas.leak(arch, Water(5.2, "weep", 0.06, 0.3, 0.2, 1.5, 0.08))
    canvas.leak(RingJoint(18.45, 0.4, 4.0, 0.4), Water(4.8, "along girder", 0.07, 0.3, 0.15))
    canvas.leak(Patch(14.6, -3.6, 0.5, 0.7, 0.35), Water(4.4, "beside drain", 0.06, 0.3))
    canvas.leak(Foot(-1, 19.5, 24.5, 0.8, foot, 0.35), Water(4.4, "damp foot", 0.12, 0.4))
    canvas.leak(Patch(22.9, -0.2, 0.5, 0.45, 0.4), Water(5.4, "crown drip", 0.05, 0.3, 0.3, 1.4, 0.08))
    canvas.leak(Run(25.3, -2.2, -5.0, 0.3, 0.35, 0.14), Water(4.8, "trickle", 0.05, 0.3, 0.15))
    canvas.leak(Patch(6.4, 4.4, 0.6, 0.4, 0.35), Water(3.8, "behind pipe", 0.08, 0.4))
    canvas.leak(Patch(20.4, 3.1, 0.4, 0.5, 0.35), Water(2.8, "beside drain", 0.12, 0.5))
    canvas.leak(Patch(16.3, 2.9, 0.18, 0.2, 0.3), Water(4.5, "bolt", 0.04, 0.2))
