"""Tunnels of precast segments."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .canvas import Canvas, Water
from .equipment import Body, strand
from .files import Survey, tripods
from .fitout import (
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
    walkway,
)
from .frames import Axis, Tunnel
from .instruments import Instrument, Law
from .linings import Segments
from .scanners import ride
from .sections import circle
from .shapes import Foot, Joined, LongJoint, Patch, RingJoint, Run, Slab
from .trace import Wall

SEVEN = (-9.0, 9.0, 57.9, 106.7, 155.6, -155.6, -106.7, -57.9)
UNIVERSAL = (-10.0, 10.0, 77.0, 144.0, -144.0, -77.0)


def gasket_joints(folder: Path) -> None:
    """Write the scene of leaking ring and longitudinal joints."""
    rng = np.random.default_rng(101)
    radius, floor = 2.75, 1.85
    axis = Axis(567_412.3, 5_933_120.8, -14.2, 63.0, 32.0, 0.0, 0.012)
    tunnel = Tunnel(axis, circle(radius, floor))
    canvas = Canvas(tunnel, rng)
    lining = Segments(radius, 1.2, -0.5, 28, UNIVERSAL, (18.0, -36.0, 54.0, -18.0), rng, lips=0.0025)
    grain(canvas, (0.35, 0.25, 0.25))
    lining.pockets(canvas, (0.17, 0.21), 0.09, 16, True)
    lining.plugs(canvas, 0.035, -1.5)
    brake_dust(canvas, -1.3, 0.9)
    old_runs(canvas, 7, (-1.6, -0.7), "dry streak", (1.5, 4.2))
    repairs(canvas, 6, (0.6, 1.8))
    stencils(canvas, 2.1, 1.5, 6.0, -3.0)
    for u, start, end in ((lining.ring(9), -2.6, 1.4), (lining.ring(22), 0.4, 4.8)):
        canvas.stain(Slab(u, (start + end) / 2, 0.07, end - start), -2.6, "dark caulking", rim=0.012, lift=-0.004)
    injected(canvas, (lining.ring(15), 2.2), (lining.ring(15), 4.6), -2.4, 0.10)
    _gasket_leaks(canvas, lining)
    floor_dirt(canvas, 0.004, 0.5)
    bodies: list[Body] = track(tunnel, floor, third_rail=1.35)
    bodies += walkway(tunnel, -1, 2.12, -0.62, 0.75)
    bodies += cable_wall(tunnel, rng, [-3.35, -3.75, -4.15], 4)
    bodies += lamps(tunnel, 3.0, 3.1, 7.0, (0.9, 0.12, 0.09))
    bodies += strand(tunnel, (0.0, 32.0), -2.3, 0.09, 0.016, -7.0, 0.01, 1.2)
    bodies += strand(tunnel, (0.0, 32.0), 3.75, 0.12, 0.057, -4.0)
    bodies += cabinet(tunnel, 20.4, -2.85, (0.5, 0.35, 0.18), -2.35)
    bodies += plates(canvas, 2.55, 5.0, 10.0)
    wall = Wall(tunnel, lining, canvas, Law(24.0), -4.2, -7.5, Law(30.0))
    pulse = Instrument(58.0, 2.0, 1.6, 0.25, 4.0, 0.35, 2.0, 0.0012, (0.006, 0.00035), drift=0.12, stray=0.0012)
    stations = tripods(wall, [(4.0, 0.1, 0.05), (11.8, -0.15, 0.02), (19.9, 0.05, 0.0), (27.8, -0.1, 0.06)], 0.0036)
    Survey(wall, bodies, stations, pulse, rng).deliver(folder)


def _gasket_leaks(canvas: Canvas, lining: Segments) -> None:
    """Water through gaskets, bolt holes and grouting plugs."""
    ring, joint = lining.ring, lining.joint
    wet = Water(6.5, "wet joint", 0.03, 0.25, 0.25, 1.2, 0.06)
    canvas.leak(RingJoint(ring(4), -3.1, 0.9, 0.17), wet)
    v = joint(7, 2)
    canvas.leak(LongJoint(v, ring(7) + 0.02, ring(8) + 0.3, 0.05, 0.55), Water(6.0, "wet joint", 0.03, 0.3, 0.3))
    v = joint(11, 1)
    cross = Joined((Patch(ring(12), v, 0.3, 0.25, 0.35), Run(ring(12) + 0.05, v, v + np.sign(v) * 2.2, 0.3, 0.12, 0.06)))
    canvas.leak(cross, Water(7.0, "cross joint", 0.04, 0.3, 0.4, 2.0, 0.07))
    pocket = Joined((Slab(ring(17) - 0.17, 2.35, 0.2, 0.26), Run(ring(17) - 0.19, 2.4, 3.95, 0.2, 0.1, 0.05)))
    canvas.leak(pocket, Water(5.5, "bolt pocket", 0.03, 0.2, 0.2))
    plug = ring(19) + 0.6
    canvas.leak(
        Joined((Patch(plug, -1.75, 0.16, 0.16), Run(plug, -1.7, -4.6, 0.22, 0.3, 0.07))), Water(5.0, "grouting plug", 0.05, 0.2)
    )
    canvas.leak(Patch(ring(21) + 0.5, 1.3, 0.55, 0.4, 0.35), Water(2.6, "damp patch", 0.12, 0.5))
    canvas.leak(LongJoint(joint(24, 0) or 0.2, ring(24) + 0.1, ring(25), 0.14, 0.16), Water(4.5, "crown drip", 0.04, 0.3, 0.3))
    canvas.leak(
        Joined((RingJoint(ring(14), -5.6, -2.9, 0.2), Patch(ring(14) + 0.1, -4.9, 0.3, 0.6))), Water(5.5, "wet joint", 0.05)
    )
    canvas.leak(Foot(-1, 21.4, 24.6, 0.5, canvas.tunnel.section.foot), Water(4.0, "damp foot", 0.1, 0.4))
    canvas.leak(Run(ring(2) + 0.4, 1.9, 3.2, 0.09, 0.05, 0.03), Water(4.0, "trickle", 0.03))


def lime_and_salt(folder: Path) -> None:
    """Write the scene of damp areas with bright rims, and of crusts left by leaks that have closed."""
    rng = np.random.default_rng(102)
    radius, floor = 4.3, 2.6
    axis = Axis(689_204.6, 5_338_411.2, 478.3, 148.0, 34.0, -1 / 420, -0.008)
    tunnel = Tunnel(axis, circle(radius, floor))
    canvas = Canvas(tunnel, rng)
    lining = Segments(radius, 1.8, -0.7, 21, SEVEN, (0.0, 24.4, -24.4), rng, lips=0.003, gap=0.005, contrast=0.5)
    grain(canvas, (0.4, 0.3, 0.3))
    lining.pockets(canvas, (0.2, 0.24), 0.11, 21, False)
    lining.plugs(canvas, 0.045, -0.8)
    brake_dust(canvas, -1.0, 1.2)
    repairs(canvas, 5, (0.5, 1.4))
    _crusts(canvas, lining)
    _salt_leaks(canvas, lining)
    floor_dirt(canvas, 0.012, 0.9)
    bodies: list[Body] = track(tunnel, floor, 1.9) + track(tunnel, floor, -1.9)
    bodies += walkway(tunnel, 1, 3.55, -1.45, 0.8) + walkway(tunnel, -1, 3.55, -1.45, 0.8)
    bodies += cable_wall(tunnel, rng, [-6.3, -6.5, -6.72, -6.95], 3, 0.16, 1.2)
    bodies += cable_wall(tunnel, rng, [6.6, 6.95], 5, 0.2, 1.2)
    bodies += lamps(tunnel, 5.2, 2.0, 8.0, (1.2, 0.14, 0.1)) + lamps(tunnel, -5.2, 6.0, 8.0, (1.2, 0.14, 0.1))
    bodies += strand(tunnel, (0.0, 34.0), 4.6, 0.1, 0.016, -7.5, 0.012, 1.3)
    bodies += strand(tunnel, (0.0, 34.0), -7.5, 0.17, 0.085, -3.5)
    bodies += plates(canvas, -4.7, 4.0, 12.0)
    wall = Wall(tunnel, lining, canvas, Law(28.0), -4.6, -8.0, Law(32.0))
    phase = Instrument(-4.0, 1.85, 2.4, 0.4, -52.0, 0.45, 2.5, 0.0008, (0.0045, 0.0003), 0.02, 0.18, 0.0025)
    places = [(3.6, 0.3, -0.85), (12.4, -0.4, -0.8), (21.3, 0.2, -0.9), (30.2, -0.2, -0.84)]
    survey = Survey(wall, bodies, tripods(wall, places, 0.0039), phase, rng, reference=False, cube=0.019)
    survey.off_axis = (0.02, -0.03)
    survey.deliver(folder)


def _crusts(canvas: Canvas, lining: Segments) -> None:
    """Lime where water came through once: bright, and as dry as the rest."""
    ring, joint = lining.ring, lining.joint
    canvas.stain(RingJoint(ring(3), -4.2, -0.5, 0.12), 2.8, "lime crust", 0.03, 0.3, -0.006)
    canvas.stain(LongJoint(joint(5, 3), ring(5) + 0.1, ring(6) - 0.2, 0.05, 0.45), 3.2, "lime crust", 0.03, 0.3, -0.005)
    canvas.stain(LongJoint(joint(14, 1), ring(14) + 0.2, ring(15) - 0.1, 0.08, 0.12), 3.6, "lime crust", 0.03, 0.3, -0.015)
    for u, top, bottom in ((9.7, 2.5, 4.4), (16.8, -3.8, -5.9), (27.1, 1.8, 3.3), (28.0, 2.1, 3.9)):
        canvas.stain(Run(u, top, bottom, 0.06, 0.16, 0.06), 2.4, "lime run", 0.03, 0.3, -0.003)
    canvas.stain(Patch(22.6, 4.3, 0.6, 0.45, 0.4), 2.0, "salt bloom", 0.12, 0.5)
    canvas.stain(Patch(7.4, -7.9, 0.8, 0.35, 0.4), 2.3, "salt bloom", 0.12, 0.5)
    old_runs(canvas, 5, (-1.4, -0.6), "dry streak", (3.0, 6.5))


def _salt_leaks(canvas: Canvas, lining: Segments) -> None:
    """Damp areas, most of them inside a bright rim."""
    ring, joint = lining.ring, lining.joint
    canvas.leak(Patch(5.3, 3.6, 0.6, 0.75, 0.3), Water(4.5, "salt fringe", 0.08, 0.4, 0.05, 3.2, 0.2))
    canvas.leak(Patch(12.2, -2.8, 0.9, 0.6, 0.35), Water(3.6, "salt fringe", 0.1, 0.5, 0.0, 2.6, 0.14))
    v = joint(9, 2)
    cross = Joined((Patch(ring(9), v, 0.35, 0.4, 0.3), Run(ring(9), v, v + np.sign(v) * 2.3, 0.4, 0.25, 0.09)))
    canvas.leak(cross, Water(6.0, "salt fringe", 0.05, 0.25, 0.25, 3.5, 0.12))
    canvas.stain(Run(ring(9) + 0.03, v + np.sign(v) * 0.1, v + np.sign(v) * 1.8, 0.07, 0.05, 0.05), 2.5, "", 0.03, 0.3, -0.006)
    canvas.leak(RingJoint(ring(12), -7.0, -3.4, 0.32), Water(5.0, "wet joint", 0.05, 0.3, 0.15, 2.4, 0.1))
    canvas.leak(LongJoint(joint(16, 6), ring(16), ring(17) - 0.1, 0.1, 0.9), Water(5.2, "wet joint", 0.04, 0.3, 0.2, 3.0, 0.1))
    canvas.leak(Patch(17.6, 0.3, 0.5, 0.45, 0.35), Water(5.5, "crown drip", 0.05, 0.3, 0.4, 2.0, 0.08))
    canvas.leak(Foot(1, 24.0, 27.6, 1.25, canvas.tunnel.section.foot, 0.2), Water(3.8, "salt fringe", 0.1, 0.5, 0.0, 3.0, 0.22))
    plug = (ring(10) + 0.9, 5.85)
    drip = Joined((Patch(*plug, 0.2, 0.2), Run(plug[0], 5.9, 8.3, 0.28, 0.4, 0.08)))
    canvas.leak(drip, Water(5.0, "grouting plug", 0.05, 0.3, 0.2, 2.0, 0.1))
    canvas.leak(Patch(31.0, -4.1, 0.5, 0.9, 0.4), Water(2.4, "damp patch", 0.15, 0.5, 0.0, 1.6, 0.2))


def brake_dust_only(folder: Path) -> None:
    """Write the scene of a dirty tunnel without a drop of water."""
    rng = np.random.default_rng(107)
    radius, floor = 2.6, 1.7
    axis = Axis(455_870.1, 5_461_932.7, 92.6, 271.0, 36.0, 1 / 260, 0.021)
    tunnel = Tunnel(axis, circle(radius, floor))
    canvas = Canvas(tunnel, rng)
    lining = Segments(radius, 1.0, -0.3, 38, UNIVERSAL, (0.0, 45.0, -22.5, 22.5, -45.0), rng, 0.003, 0.005, 0.7)
    lining.shades[[8, 8, 21, 29], [2, 3, 1, 4]] -= 1.4
    grain(canvas, (0.5, 0.35, 0.3))
    lining.pockets(canvas, (0.15, 0.18), 0.08, 14, True)
    lining.plugs(canvas, 0.05, -3.0)
    brake_dust(canvas, -2.6, 0.8)
    brake_dust(canvas, -1.2, 1.8, 1)
    soot(canvas, -1.2, 0.9)
    _dry_dirt(canvas, lining)
    floor_dirt(canvas, 0.015, 0.9)
    bodies: list[Body] = track(tunnel, floor, third_rail=-1.4)
    bodies += walkway(tunnel, 1, 2.0, -0.55, 0.7)
    bodies += cable_wall(tunnel, rng, [2.75, 2.9, 3.05, 3.2, 3.35], 3, 0.15)
    bodies += cable_wall(tunnel, rng, [-3.0, -3.3], 4, 0.13)
    bodies += lamps(tunnel, -2.3, 2.2, 6.0, (0.7, 0.12, 0.1))
    bodies += strand(tunnel, (0.0, 36.0), 2.1, 0.1, 0.016, -7.0, 0.01, 1.0)
    bodies += strand(tunnel, (0.0, 36.0), -3.95, 0.11, 0.055, -4.5)
    bodies += cabinet(tunnel, 13.4, -2.75, (0.6, 0.4, 0.2), -2.4) + cabinet(tunnel, 27.0, -2.7, (0.4, 0.3, 0.16), -2.4)
    bodies += plates(canvas, -1.7, 3.0, 9.0)
    wall = Wall(tunnel, lining, canvas, Law(30.0, -0.2), -5.2, -9.5, Law(32.0))
    profiler = Instrument(12.0, 1.7, 1.9, 0.5, -38.0, 0.5, 2.5, 0.0011, (0.0035, 0.0004), 0.02, 0.1, 0.002)
    parts, way = ride(tunnel, rng, 0.018, 0.0072, (0.08, -0.05), 0.0, np.radians(46))
    Survey(wall, bodies, parts, profiler, rng, way, 1e6, off_axis=(-0.02, 0.0)).deliver(folder)


def _dry_dirt(canvas: Canvas, lining: Segments) -> None:
    """Soot, grease, resin, caulking, paint: all that darkens a lining without wetting it."""
    ring, joint = lining.ring, lining.joint
    for k, start, end in ((5, -3.2, 2.4), (11, -1.0, 3.8), (24, -4.2, 0.2), (33, -2.0, 2.0)):
        canvas.stain(Slab(ring(k), (start + end) / 2, 0.08, end - start), -3.0, "dark caulking", 0.012, lift=-0.004)
    for k, j in ((3, 2), (16, 5), (22, 1), (30, 2)):
        v = joint(k, j)
        injected(canvas, (ring(k) + 0.05, v), (ring(k + 1) - 0.05, v), -3.2, 0.12)
    v = joint(18, 1)
    injected(canvas, (ring(18), v - 0.6), (ring(18), v + 0.6), -2.8, 0.11)
    oil(canvas, [(7.6, -4.5, 0.35), (8.4, -4.3, 0.25), (19.7, 4.0, 0.22), (26.2, -4.4, 0.4)], -3.5)
    for u, v in ((13.4, -2.2), (27.0, -2.2)):
        canvas.stain(Patch(u, v, 0.35, 0.4, 0.3), -2.4, "soot", 0.25, 0.3)
    for u in (2.2, 8.2, 14.2, 20.2, 26.2, 32.2):
        canvas.stain(Patch(u, -1.95, 0.4, 0.2, 0.3), -1.3, "soot", 0.2, 0.3)
    canvas.stain(Slab(23.6, 1.1, 1.1, 0.7), -2.8, "bituminous paint", 0.02, 0.05)
    canvas.stain(Slab(10.2, -1.2, 0.8, 0.5), -2.0, "epoxy patch", 0.015, 0.05, -0.003)
    old_runs(canvas, 16, (-2.4, -0.9), "dry streak", (1.0, 3.6))
    old_runs(canvas, 5, (1.2, 2.4), "lime run", (1.2, 3.2))
    repairs(canvas, 8, (-1.8, 1.6))
    stencils(canvas, -1.4, 2.5, 5.0, -4.0)
