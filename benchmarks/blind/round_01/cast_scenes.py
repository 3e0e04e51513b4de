"""Tunnels and halls of cast concrete."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .canvas import Canvas, Water
from .equipment import Body, beam, hoop, strand
from .files import Survey, tripods
from .fitout import (
    RUBBER,
    ZINC,
    brake_dust,
    cabinet,
    cable_wall,
    floor_dirt,
    grain,
    injected,
    lamps,
    oil,
    old_runs,
    plates,
    repairs,
    soot,
    stencils,
    track,
    vignette,
)
from .frames import Axis, Tunnel
from .instruments import Instrument, Law
from .linings import Bays
from .scanners import ride
from .sections import box, three_centred
from .shapes import Crack, Disc, Foot, Joined, LongJoint, Patch, RingJoint, Run, Slab
from .trace import Wall


def behind_cables(folder: Path) -> None:
    """Write the scene of leaks behind tiers of cables, a tray, a pipe and cabinets."""
    rng = np.random.default_rng(103)
    floor, length = 1.9, 34.0
    axis = Axis(344_618.9, 5_702_455.1, 21.7, 352.0, length, -1 / 300, 0.004)
    tunnel = Tunnel(axis, box(4.8, 5.4, floor, 0.5))
    canvas = Canvas(tunnel, rng)
    lining = Bays(8.0, 2.4, (2.5, 1.25), rng, 0.35)
    grain(canvas, (0.45, 0.3, 0.25))
    lining.ties(canvas, 0.022, -0.8)
    lining.cracks(canvas, 8, -1.2)
    brake_dust(canvas, -1.8, 0.9)
    vignette(canvas, 5.2, -0.5, 0.2)
    old_runs(canvas, 9, (-1.6, -0.6), "dry streak", (2.7, 5.0))
    repairs(canvas, 6, (-1.0, 1.5))
    stencils(canvas, 4.6, 3.0, 8.0, -2.5)
    injected(canvas, (18.4, 3.0), (18.4, 5.4), -2.2, 0.1)
    oil(canvas, [(6.0, 6.9, 0.25), (29.5, -6.7, 0.2)], -2.6)
    _hidden_leaks(canvas)
    floor_dirt(canvas, 0.015, 0.8)
    bodies: list[Body] = track(tunnel, floor, third_rail=-1.35)
    bodies += cable_wall(tunnel, rng, [-4.55, -4.75, -4.95, -5.15, -5.35, -5.55, -5.75], 3, 0.13)
    bodies += cable_wall(tunnel, rng, [-6.35], 2, 0.1)
    bodies += beam(tunnel, (0.0, length), 2.15, -floor + 0.22, 0.42, 0.44, -4.5)
    bodies += beam(tunnel, (0.0, length), -2.28, 1.62, 0.2, 0.06, ZINC)
    bodies += strand(tunnel, (0.0, length), 6.5, 0.16, 0.084, -4.0)
    bodies += strand(tunnel, (0.0, length), 3.15, 0.1, 0.016, RUBBER, 0.012, 1.1)
    bodies += lamps(tunnel, 3.5, 2.6, 6.5, (1.1, 0.14, 0.1))
    bodies += cabinet(tunnel, 11.4, 5.15, (0.8, 0.9, 0.28), 4.1) + cabinet(tunnel, 24.6, 5.2, (0.5, 0.6, 0.22), 4.1)
    bodies += hoop(tunnel, 15.6, (4.1, 7.3), 0.05, 0.03, ZINC)
    bodies += plates(canvas, 4.3, 7.0, 9.0)
    wall = Wall(tunnel, lining, canvas, Law(22.0, 0.05), -4.4, -8.5, Law(32.0))
    profiler = Instrument(18.0, 1.8, 2.2, 0.45, -34.0, 0.45, 2.5, 0.001, (0.004, 0.0005), 0.02, 0.12, 0.003)
    parts, way = ride(tunnel, rng, 0.0195, 0.0058, (-0.1, 0.05), np.radians(18), np.radians(42))
    Survey(wall, bodies, parts, profiler, rng, way, 1e6, off_axis=(0.0, 0.02)).deliver(folder)


def _hidden_leaks(canvas: Canvas) -> None:
    """Water where the fittings are."""
    foot = canvas.tunnel.section.foot
    joint = 10.4
    canvas.leak(RingJoint(joint, -7.0, -2.8, 0.26), Water(4.6, "wet joint", 0.05, 0.3, 0.15, 1.2, 0.08))
    canvas.leak(
        Joined((LongJoint(-3.6, 4.0, 6.2, 0.06, 0.6), Run(5.0, -3.7, -6.9, 0.5, 0.35, 0.1))),
        Water(4.4, "behind cables", 0.06, 0.3, 0.1),
    )
    canvas.leak(Patch(20.6, -5.1, 0.8, 0.65, 0.35), Water(3.4, "behind cables", 0.1, 0.4))
    canvas.leak(Patch(13.6, 3.7, 0.6, 0.7, 0.35), Water(4.0, "behind tray", 0.08, 0.4))
    beside = Joined((Patch(12.0, 5.4, 0.45, 0.6, 0.3), Run(12.1, 5.5, 7.3, 0.4, 0.3, 0.06)))
    canvas.leak(beside, Water(4.2, "beside cabinet", 0.05, 0.3, 0.1))
    canvas.leak(Patch(22.4, 6.55, 0.75, 0.35, 0.3), Water(3.6, "behind pipe", 0.08, 0.4))
    canvas.leak(Patch(26.4, 0.6, 0.55, 0.8, 0.35), Water(4.6, "ceiling drip", 0.06, 0.3, 0.3, 1.5, 0.08))
    canvas.leak(Foot(1, 28.0, 31.2, 0.55, foot), Water(3.2, "damp foot", 0.12, 0.4))
    canvas.leak(Run(30.6, -3.0, -5.9, 0.14, 0.1, 0.06), Water(3.6, "trickle", 0.04, 0.2))
    canvas.leak(Patch(16.0, -6.2, 0.5, 0.3, 0.3), Water(2.6, "behind cables", 0.1, 0.4))
    canvas.leak(Run(15.66, 4.3, 7.0, 0.16, 0.2, 0.03), Water(3.8, "behind pipe", 0.04, 0.2))


def injected_box(folder: Path) -> None:
    """Write the scene of a station box whose joints were injected, some of them in vain."""
    rng = np.random.default_rng(104)
    floor, length = 2.4, 26.0
    axis = Axis(606_031.5, 5_820_774.9, 8.4, 117.0, length)
    tunnel = Tunnel(axis, box(8.6, 5.8, floor, 0.6))
    canvas = Canvas(tunnel, rng)
    lining = Bays(6.5, 3.1, (2.6, 1.3), rng, 0.35, 0.015)
    grain(canvas, (0.4, 0.25, 0.25))
    lining.ties(canvas, 0.03, 0.7)
    lining.cracks(canvas, 12, -1.0)
    brake_dust(canvas, -0.7, 0.7)
    vignette(canvas, 6.2, 0.6, 0.06)
    repairs(canvas, 7, (-0.8, 1.6))
    _injections(canvas)
    _box_leaks(canvas)
    floor_dirt(canvas, 0.003, 0.7)
    bodies: list[Body] = list(strand(tunnel, (0.0, length), -4.5, 0.42, 0.3, -2.0))
    for v, off, radius in ((6.1, 0.16, 0.07), (5.35, 0.08, 0.03), (5.47, 0.08, 0.03)):
        bodies += strand(tunnel, (0.0, length), v, off, radius, -3.2)
    bodies += cable_wall(tunnel, rng, [-6.0, -6.2], 4, 0.16)
    bodies += beam(tunnel, (0.0, length), 1.4, 3.05, 0.3, 0.06, ZINC)
    bodies += lamps(tunnel, 2.2, 1.8, 4.5, (1.3, 0.16, 0.1)) + lamps(tunnel, -2.2, 1.8, 4.5, (1.3, 0.16, 0.1))
    bodies += cabinet(tunnel, 8.0, 7.3, (1.2, 1.6, 0.4), 5.6) + cabinet(tunnel, 19.4, -7.4, (0.8, 1.2, 0.3), -6.3)
    for u, side in ((5.6, 1), (16.2, -1), (22.6, 1)):
        bodies += hoop(tunnel, u, (side * 4.4, side * 9.2), 0.09, 0.055, -3.0)
    bodies += plates(canvas, 6.9, 4.0, 7.0)
    wall = Wall(tunnel, lining, canvas, Law(16.0, 0.0, 0.06, 10.0), -3.4, -6.0, Law(20.0, 0.0, 0.1))
    phase = Instrument(2.0, 1.9, 2.8, 0.35, -46.0, 0.35, 2.2, 0.0007, (0.004, 0.00022), 0.02, 0.15, 0.003)
    places = [(3.0, 0.6, -0.7), (9.6, -0.8, -0.68), (16.3, 0.7, -0.72), (22.8, -0.5, -0.66)]
    survey = Survey(wall, bodies, tripods(wall, places, 0.0036, -58.0), phase, rng, cube=0.0205)
    survey.off_axis = (-0.01, 0.03)
    survey.deliver(folder)


def _injections(canvas: Canvas) -> None:
    """Joints and cracks under resin, rust, and lime that has dried."""
    injected(canvas, (3.1, 4.6), (3.1, 8.4), -1.8, 0.14)
    injected(canvas, (16.1, 4.5), (16.1, 8.9), -2.2, 0.16)
    injected(canvas, (9.6, -4.8), (9.6, -8.6), -1.9, 0.14)
    injected(canvas, (12.2, -1.9), (13.9, 1.7), -2.0, 0.12)
    injected(canvas, (18.2, 7.6), (20.8, 7.2), -1.6, 0.1)
    for u, v in ((6.9, 6.3), (13.4, -7.0), (21.0, 5.9), (24.4, -5.9)):
        rust = Joined((Disc(u, v, 0.05), Run(u, v, v + np.sign(v) * 0.9, 0.07, 0.03, 0.03)))
        canvas.stain(rust, -1.7, "rust", 0.03, 0.3)
    canvas.stain(Crack((5.5, -2.4), (7.6, 2.0), 0.08, 0.1), 1.8, "lime crust", 0.03, 0.4, -0.004)
    canvas.stain(Slab(11.0, 7.0, 1.6, 1.0), 1.0, "sealing slurry", 0.02, 0.05)
    canvas.stain(Slab(22.9, -7.2, 1.2, 2.0), -1.5, "bituminous coat", 0.03, 0.1)
    old_runs(canvas, 6, (-1.2, -0.5), "dry streak", (4.8, 7.4))
    old_runs(canvas, 4, (0.9, 1.8), "lime run", (4.8, 7.4))


def _box_leaks(canvas: Canvas) -> None:
    """Water round and beside the injected joints, at the kicker, in the ceiling."""
    foot = canvas.tunnel.section.foot
    beside = Joined((Patch(16.5, 6.6, 0.35, 0.6, 0.35), Run(16.5, 6.8, 9.1, 0.3, 0.45, 0.07)))
    canvas.leak(beside, Water(3.2, "beside injection", 0.06, 0.3, 0.1))
    canvas.leak(RingJoint(9.6, -9.4, -8.0, 0.34), Water(3.4, "wet joint", 0.05, 0.3, 0.15))
    canvas.leak(RingJoint(22.6, 4.9, 7.9, 0.3), Water(3.6, "wet joint", 0.05, 0.3, 0.2, 1.0, 0.08))
    canvas.leak(LongJoint(8.85, 10.8, 14.6, 0.1, 0.4), Water(2.8, "kicker joint", 0.06, 0.3))
    canvas.leak(Foot(-1, 3.4, 7.8, 0.4, foot), Water(2.4, "damp foot", 0.1, 0.4))
    canvas.leak(Patch(14.6, 0.6, 0.6, 0.5, 0.4), Water(3.0, "ceiling drip", 0.06, 0.3, 0.2, 1.2, 0.1))
    ceiling = Joined((Crack((19.0, -3.0), (21.2, 1.4), 0.2, 0.12), Patch(20.1, -0.9, 0.5, 0.4, 0.4)))
    canvas.leak(ceiling, Water(2.6, "wet crack", 0.06, 0.3, 0.1, 1.4, 0.08))
    tie = Joined((Disc(12.6, -5.6, 0.12), Run(12.6, -5.6, -8.4, 0.2, 0.26, 0.08)))
    canvas.leak(tie, Water(3.0, "tie hole", 0.04, 0.2, 0.1))
    canvas.leak(Patch(19.9, -6.3, 0.7, 0.9, 0.35), Water(2.0, "damp patch", 0.15, 0.5))
    canvas.leak(Run(5.4, 5.2, 8.6, 0.3, 0.4, 0.08), Water(2.9, "behind pipe", 0.06, 0.3))
    faint = "drop of the order of the difference between neighbouring panels, with a rim of half a metre"
    canvas.leak(Patch(1.9, -6.9, 0.7, 0.6, 0.3), Water(0.9, "damp patch", 0.45, 0.4, limit=faint))


def tide_marks(folder: Path) -> None:
    """Write the scene of damp that swells and dries, with the lines that it leaves."""
    rng = np.random.default_rng(105)
    floor, length = 1.6, 36.0
    axis = Axis(512_377.7, 5_408_213.4, 231.9, 204.0, length, 0.0, -0.028)
    tunnel = Tunnel(axis, three_centred(3.6, 2.8, 42.0, floor))
    canvas = Canvas(tunnel, rng)
    lining = Bays(10.0, 6.5, (2.0, 1.6), rng, 0.22, 0.02)
    grain(canvas, (0.5, 0.3, 0.25))
    lining.cracks(canvas, 9, -1.1)
    brake_dust(canvas, -1.6, 1.0)
    soot(canvas, -0.9, 1.1)
    canvas.shade[int(6.5 / 0.01) : int(16.5 / 0.01)] -= 0.7
    repairs(canvas, 5, (-1.0, 1.4))
    old_runs(canvas, 8, (-1.3, -0.5), "dry streak", (2.2, 4.6))
    old_runs(canvas, 3, (0.9, 1.8), "lime run", (1.8, 3.6))
    stencils(canvas, 3.4, 2.0, 7.5, -3.0)
    _tides(canvas)
    floor_dirt(canvas, 0.02, 0.9)
    bodies: list[Body] = track(tunnel, floor, third_rail=1.4)
    bodies += cable_wall(tunnel, rng, [3.75, 3.95, 4.15, 4.35], 3, 0.15)
    bodies += beam(tunnel, (0.0, length), 2.0, -floor + 0.25, 0.5, 0.5, -4.5)
    bodies += beam(tunnel, (0.0, length), 0.0, 3.0, 0.09, 0.11, -2.5)
    for u in np.arange(1.5, length, 5.0):
        bodies += beam(tunnel, (float(u), float(u) + 0.08), 0.0, 3.33, 0.1, 0.54, ZINC)
    bodies += lamps(tunnel, -2.7, 2.0, 7.0, (0.9, 0.13, 0.1))
    bodies += strand(tunnel, (0.0, length), 4.95, 0.14, 0.06, -4.0)
    bodies += cabinet(tunnel, 18.2, -3.4, (0.6, 0.5, 0.2), -2.8)
    bodies += plates(canvas, -3.1, 4.0, 10.0)
    wall = Wall(tunnel, lining, canvas, Law(26.0, -0.1), -4.8, -9.0, Law(32.0))
    profiler = Instrument(34.0, 2.0, 1.5, 0.2, -12.0, 0.4, 2.2, 0.0014, (0.005, 0.0003), 0.05, 0.12, 0.0015)
    parts, way = ride(tunnel, rng, 0.0195, 0.0058, (0.15, -0.15), 0.0, np.radians(50))
    Survey(wall, bodies, parts, profiler, rng, way, 1e6, off_axis=(0.02, 0.02)).deliver(folder)


def _tides(canvas: Canvas) -> None:
    """Damp with soft rims inside older lines."""
    foot = canvas.tunnel.section.foot
    canvas.leak(Patch(3.4, -1.4, 0.9, 0.7, 0.35), Water(3.6, "tide mark", 0.16, 0.5, tide=1.8, tide_at=0.2))
    canvas.leak(Patch(11.6, 2.2, 1.1, 0.9, 0.35), Water(3.8, "tide mark", 0.2, 0.6, tide=1.6, tide_at=0.26))
    canvas.leak(Patch(20.5, -3.0, 0.6, 0.9, 0.35), Water(3.8, "tide mark", 0.12, 0.4, 0.0, 1.2, 0.12, 1.2, 0.22))
    run = Joined((Patch(25.7, 1.4, 0.5, 0.35, 0.35), Run(25.8, 1.5, 4.7, 0.5, 0.3, 0.1)))
    canvas.leak(run, Water(4.5, "tide mark", 0.08, 0.4, 0.1, 0.0, 0.0, 1.0, 0.12))
    canvas.leak(RingJoint(16.5, -2.9, 1.8, 0.3), Water(5.2, "wet joint", 0.05, 0.3, 0.25, 1.5, 0.08))
    canvas.leak(Patch(26.5, -0.5, 0.4, 0.5, 0.35), Water(5.0, "crown drip", 0.05, 0.3, 0.3))
    canvas.leak(Foot(-1, 28.4, 33.0, 0.6, foot), Water(3.4, "damp foot", 0.14, 0.5, tide=0.9, tide_at=0.16))
    canvas.leak(Patch(8.5, -4.1, 0.7, 0.5, 0.35), Water(2.8, "damp patch", 0.2, 0.6))
    canvas.leak(Patch(30.6, 2.6, 0.45, 0.7, 0.3), Water(4.2, "damp patch", 0.1, 0.4, tide=1.0, tide_at=0.15))
    canvas.leak(Run(23.0, -2.0, -4.6, 0.12, 0.08, 0.05), Water(4.0, "trickle", 0.04, 0.2))
    drying = "the last of a patch that has dried: a third of the contrast of the mottle's broad swings"
    canvas.leak(Patch(14.3, -1.9, 0.6, 0.5, 0.3), Water(0.8, "drying", 0.4, 0.4, tide=0.8, limit=drying))
