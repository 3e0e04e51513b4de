"""Two metro lines driven by shield: one that leaks at its joints, one that is dry and very dirty."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas
from .dirt import Dirt
from .furniture import Furniture
from .scanner import Ground, Instrument
from .shield import Rings, out_of_round, paint_rings
from .survey import Survey, Trolley
from .texture import Grid
from .tunnel import Axis, Section, Tunnel, circle_lining
from .water import Water


def _track_furniture(section: Section, length: float, rng: np.random.Generator, floor_z: float, radius: float) -> Furniture:
    """What both lines have: track, cables on both sides, a fire main, an overhead conductor."""
    things = Furniture(section, length, rng)
    things.rail_track(0.0, floor_z + 0.24, sleeper_z=floor_z + 0.06)
    left = [section.u_at_angle(a) for a in (-104, -99, -94, -89)]
    things.cables_on_brackets(left, 0.13, 0.026, 1.0)
    right = [section.u_at_angle(a) for a in (72, 77)]
    things.cables_on_brackets(right, 0.10, 0.018, 1.0, first=0.8)
    things.cable(section.u_at_angle(-119), 0.14, 0.076, 0.5)
    for s in np.arange(2.2, length, 3.0):
        things.on_wall(section.u_at_angle(-121), section.u_at_angle(-117), 0.0, 0.07, s, s + 0.05, -1.0)
    y, z = 0.0, radius - 0.42
    things.plate(y - 0.05, y + 0.05, z, z + 0.11, -20, 200, 3.0)
    for s in np.arange(3.4, length, 6.0):
        things.plate(y - 0.22, y + 0.22, z + 0.14, z + 0.18, s, s + 0.10, 0.0)
        for side in (-0.2, 0.2):
            things.plate(side - 0.02, side + 0.02, z + 0.16, z + 0.45, s + 0.03, s + 0.07, 0.5)
    return things


def staggered() -> Survey:
    """A line of the 2010s: rings of 1.2 m, staggered; profiler on a trolley; leaks at joints of shoulders and waist."""
    rng = np.random.default_rng(110101)
    radius, floor_z, length = 2.75, -1.92, 30.0
    section = Section(
        circle_lining(radius, floor_z), [(0.25, floor_z), (0.15, floor_z - 0.08), (-0.15, floor_z - 0.08), (-0.25, floor_z)]
    )
    axis = Axis((463211.4, 5398120.7, 12.6), 38.0, length, [(-20, np.inf), (6, 420.0)], -0.012)
    things = _track_furniture(section, length, rng, floor_z, radius)
    things.plate(1.72, 2.42, -0.98, -0.93, -20, 200, -1.0)
    for s in np.arange(0.9, length, 1.5):
        things.plate(1.80, 2.50, -1.10, -0.98, s, s + 0.06, -0.5)
    things.cable(section.u_at_angle(92), 0.10, 0.02, 1.0)
    things.lamps(section.u_at_angle(62), 0.03, 10.0, 0.65, 0.12, first=4.3)
    things.on_wall(section.u_at_angle(82), section.u_at_angle(90), 0.06, 0.20, 17.5, 18.0, 0.0)

    canvas = Canvas(Grid(length, section.girth), rng, section.crown)
    rings = Rings(1.2, 0.7, (-22.5, 22.5), (10.75, -10.75, 78.75, -78.75, 146.25, -146.25))
    canvas.concrete(0.4, 0.3, 0.25)
    out_of_round(canvas, section, radius, 0.012)
    paint_rings(canvas, section, rings, 0.45, pockets=(-108, -63, -27, 0, 27, 63, 108))
    at = section.u_at_angle
    dirt = Dirt(canvas)
    canvas.shade(
        np.array([0, at(-110), at(-80), at(-40), at(0), at(40), at(80), at(110), section.girth]),
        np.array([-2.2, -1.5, -0.4, -0.1, -0.9, -0.1, -0.3, -1.2, -2.0]),
    )
    joint = rings.joint_s(length)
    for k in (2, 8, 13, 19, 22):
        dirt.repair(joint[k] - 0.09, joint[k] + 0.09, at(-60), at(-60) + 0.2 + 0.12 * k, 1.2, "sealed joint")
    dirt.repair(joint[15] - 0.5, joint[15] - 0.1, at(30), at(44), -1.6, "resin repair")
    dirt.repair(joint[5] + 0.2, joint[5] + 0.65, at(-48), at(-41), 1.5)
    for s, angle, reach, tone in ((4.1, 50, 0.9, -1.2), (12.8, -45, 1.2, -1.4), (20.3, 52, 0.7, -1.0), (26.9, -30, 1.1, -1.3)):
        dirt.old_stain(s, at(angle), reach, 0.16, tone)
    for s in np.arange(0.4, length, 1.0):
        if rng.random() < 0.45:
            dirt.rust(float(s), at(-87) - 0.05, float(rng.uniform(0.1, 0.4)))
    for k, name in enumerate(("R1240", "R1245", "R1250", "R1255")):
        dirt.writing(name, joint[2 + 5 * k] + 0.3, at(58), 0.022, 2.6)
    dirt.writing("K14+620", 15.9, at(-60), 0.024, -2.8)
    for _ in range(7):
        dirt.smudge(
            float(rng.uniform(0, length)), at(float(rng.uniform(-70, 70))), 0.5, 0.3, float(rng.uniform(-1.2, -0.6)), "grime"
        )

    water = Water(canvas)
    water.ring(joint[3], at(-84), at(-33), 0.10, 0.34, 4.6, salt_db=2.0, halo=0.08)
    water.ring(joint[17], at(24), at(70), 0.07, 0.28, 3.2, edge=0.06)
    water.line(
        [(joint[6], at(56.2)), (joint[7], at(56.2))], 0.10, 4.2, every=0.35, length=(0.3, 0.9), salt_db=1.5, name="wet joint"
    )
    water.line(
        [(joint[10], at(-56.2)), (joint[11], at(-56.2))], 0.08, 2.7, every=0.5, length=(0.2, 0.6), edge=0.05, name="wet joint"
    )
    water.run(joint[14] + 0.6, at(38), 1.35, 0.10, 0.30, 5.2, fan=3, name="grout hole")
    water.patch(joint[20] + 0.4, at(-20), 0.30, 0.26, 2.4, edge=0.12, name="patch")
    water.run(joint[21], at(-56.2), 1.1, 0.12, 0.36, 6.4, fan=4, salt_db=2.4, salt_width=0.04, halo=0.10, name="joint crossing")
    water.patch(joint[11] + 0.17, at(63), 0.16, 0.30, 3.6, edge=0.04, name="bolt pocket")
    water.ring(joint[8], at(-12), at(14), 0.14, 0.16, 2.0, edge=0.08, name="wet ring joint")
    water.foot(20.6, 26.2, section.girth, 0.30, 3.4, salt_db=1.5)
    water.patch(joint[5] + 0.5, at(20), 0.34, 0.22, 1.7, edge=0.12, name="patch")
    water.ring(joint[23], at(10), at(104), 0.08, 0.42, 5.4, edge=0.05, salt_db=1.8)
    water.patch(joint[12] + 0.55, at(-33), 0.07, 0.10, 4.0, name="drip")
    water.patch(9.2, at(6), 0.20, 0.16, 0.9, edge=0.2, limit="Hardly darker than the clouds of the concrete.")

    instrument = Instrument(46.0, 17.0, 7.0, 0.9, 0.75, 0.55, drift_db=0.2, band_db=0.12)
    tunnel = Tunnel(axis, section, length, things.strands, things.blocks, things.niches)
    ground = Ground(-1.8, 0.6, 0.5, 0.003, [(1.6, 2.1, -2.0)])
    return Survey(tunnel, canvas, ground, instrument, Trolley((0.0, -0.36), 0.85, 50, 0.30, 0.004), 2101, cap_lining=3600)


def straight_jointed() -> Survey:
    """A line of the 1980s: rings of 1 m with joints in line, caulked with mortar; black with brake dust; no water at all."""
    rng = np.random.default_rng(110303)
    radius, floor_z, length = 2.6, -1.78, 28.0
    section = Section(
        circle_lining(radius, floor_z), [(0.9, floor_z), (0.8, floor_z - 0.12), (-0.8, floor_z - 0.12), (-0.9, floor_z)]
    )
    axis = Axis((712840.2, 5612044.9, -8.3), 171.0, length, [(-20, -310.0)], 0.004)
    things = _track_furniture(section, length, rng, floor_z, radius)
    right = [section.u_at_angle(a) for a in (86, 91, 96, 102)]
    things.cables_on_brackets(right, 0.15, 0.03, 1.2, sag=0.035, first=0.3)
    things.on_wall(section.u_at_angle(-72), section.u_at_angle(-60), 0.02, 0.18, 9.1, 9.7, 1.0)
    things.on_wall(section.u_at_angle(-50), section.u_at_angle(-42), 0.02, 0.04, 19.3, 19.9, 3.5)
    things.conduit(section.u_at_angle(-60), section.u_at_angle(-10), 9.4, 0.02, 0.5)
    things.lamps(section.u_at_angle(-42), 0.02, 8.0, 0.6, 0.14, first=3.2)

    canvas = Canvas(Grid(length, section.girth), rng, section.crown)
    rings = Rings(1.0, 0.45, (0.0,), (8.0, -8.0, 73.0, -73.0, 138.0, -138.0))
    canvas.concrete(0.55, 0.35, 0.45, 12)
    out_of_round(canvas, section, radius, 0.022, 0.003)
    paint_rings(
        canvas,
        section,
        rings,
        0.6,
        joint_db=-3.2,
        joint_width=0.022,
        lipping=0.003,
        pockets=(-115, -95, -52, -30, -8.0, 8.0, 30, 52, 95, 115),
        pocket_size=(0.12, 0.16),
        pocket_db=-3.6,
    )
    at = section.u_at_angle
    dirt = Dirt(canvas)
    canvas.shade(
        np.array([0, at(-118), at(-100), at(-72), at(-40), at(-12), at(12), at(40), at(75), at(100), section.girth]),
        np.array([-4.2, -3.6, -2.8, -1.3, -0.5, -1.5, -1.7, -0.4, -1.0, -2.6, -4.0]),
        uneven=0.3,
    )
    joint = rings.joint_s(length)
    for side in (-73.0, 73.0, -8.0, 8.0):
        for k in range(len(joint) - 1):
            if rng.random() < 0.45:
                dirt.repair(
                    joint[k] + 0.05,
                    joint[k + 1] - 0.05,
                    at(side) - 0.05,
                    at(side) + 0.06,
                    float(rng.choice([1.6, 1.1, -1.5])),
                    "sealed joint",
                )
    for k in range(0, len(joint), 2):
        if rng.random() < 0.6:
            a, b = sorted(rng.uniform(-70, 70, 2))
            dirt.repair(
                joint[k] - 0.07, joint[k] + 0.07, at(a), at(max(b, a + 20)), float(rng.choice([1.3, -1.7])), "sealed joint"
            )
    for s, angle, reach, width, tone in (
        (2.9, -38, 1.1, 0.18, -1.6),
        (6.45, 47, 1.3, 0.22, -1.3),
        (11.5, -60, 0.7, 0.15, -1.7),
        (14.4, 25, 1.6, 0.14, -1.2),
        (17.5, 62, 0.8, 0.26, -1.5),
        (21.4, -22, 1.2, 0.12, -1.8),
        (24.5, 40, 0.9, 0.2, -1.1),
        (26.2, -50, 1.0, 0.16, -1.4),
    ):
        dirt.old_stain(s, at(angle), reach, width, tone, rim_db=1.2)
    dirt.repair(7.6, 8.3, at(-34), at(-22), 1.9)
    dirt.repair(18.6, 19.4, at(28), at(46), -1.8, "resin repair")
    dirt.repair(22.52, 22.9, at(-66), at(-52), -2.3, "resin repair")
    dirt.band(12.45, 15.45, at(10), at(58), 1.0, 0.05, "cleaned", 0.02)
    dirt.band(0, length, at(-79), at(-75), -1.1, 0.10, "brake dust", 0.03)
    dirt.band(0, length, at(67), at(71), -0.9, 0.08, "brake dust", 0.03)
    for s in np.arange(0.3, length, 1.2):
        dirt.rust(float(s), at(84), float(rng.uniform(0.1, 0.35)), -1.6)
        if rng.random() < 0.5:
            dirt.rust(float(s) + 0.4, at(-86), float(rng.uniform(0.1, 0.5)), -2.2)
    for k, name in enumerate(("0871", "0881", "0891")):
        dirt.writing(name, joint[1 + 10 * k] + 0.2, at(-62), 0.024, 3.0)
    dirt.writing("K7-300", 16.8, at(60), 0.025, 2.4)
    for _ in range(14):
        dirt.smudge(
            float(rng.uniform(0, length)),
            at(float(rng.uniform(-75, 75))),
            float(rng.uniform(0.3, 0.9)),
            float(rng.uniform(0.2, 0.5)),
            float(rng.uniform(-1.8, -0.7)),
            "soot",
            edge=float(rng.uniform(0.15, 0.4)),
        )
    for s, a, b in ((5.0, -30, 5), (13.7, -55, -40), (25.3, 15, 55)):
        dirt.crack((s, at(a)), (s + 0.25, at(b)), -1.8)

    instrument = Instrument(43.0, 19.0, 9.0, 1.1, 0.85, 0.85, drift_db=0.3, band_db=0.2, range_noise_m=0.002)
    tunnel = Tunnel(axis, section, length, things.strands, things.blocks, things.niches)
    ground = Ground(-3.2, 0.8, 0.8, 0.004, [(1.7, 3.3, -1.0)])
    return Survey(
        tunnel,
        canvas,
        ground,
        instrument,
        Trolley((0.05, -0.25), 1.0, 50, 0.36, 0.0),
        2103,
        cap_lining=2600,
        start_time=88230.0,
    )
