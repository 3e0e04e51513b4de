"""A single-track railway tunnel driven by shield: large segments, clean concrete, static scans without a reference."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas
from .dirt import Dirt
from .furniture import Furniture
from .scanner import Ground, Instrument
from .shield import Rings, out_of_round, paint_rings
from .survey import Stations, Survey
from .texture import Grid
from .tunnel import Axis, Section, Strand, Tunnel, circle_lining
from .water import Water

RADIUS, FLOOR_Z, LENGTH = 4.0, -2.35, 34.0


def _section() -> Section:
    """Slab track between two escape walks."""
    floor = [(2.15, -1.75), (2.15, FLOOR_Z), (-2.15, FLOOR_Z), (-2.15, -1.75)]
    lining = circle_lining(RADIUS, -1.75)
    return Section(lining, floor)


def _furniture(section: Section, rng: np.random.Generator) -> Furniture:
    """Track, catenary, handrails, few cables, lamps and signs."""
    things = Furniture(section, LENGTH, rng)
    things.rail_track(0.0, FLOOR_Z + 0.22, sleeper=0.65, sleeper_z=FLOOR_Z + 0.05)
    things.handrail(2.75, -1.75, 1.05, 2.0)
    things.cable(section.u_at(-1, -1.2), 0.12, 0.03, -6.0, sag=0.015, spacing=1.5)
    things.cable(section.u_at(-1, -0.1), 0.08, 0.022, -6.5, sag=0.02, spacing=1.5)
    for s in np.arange(0.7, LENGTH, 1.5):
        things.on_wall(section.u_at(-1, -1.26), section.u_at(-1, -1.14), 0.0, 0.09, s - 0.02, s + 0.02, 0.0)
        things.on_wall(section.u_at(-1, -0.15), section.u_at(-1, -0.05), 0.0, 0.06, s - 0.02, s + 0.02, 0.0)
    things.strands.append(Strand(-0.1, 2.75, 0.007, -3.0))
    things.strands.append(Strand(-0.1, 3.35, 0.006, -3.0))
    for s in (8.2, 26.2):
        things.plate(-0.18, -0.08, 3.3, 3.97, s, s + 0.08, 1.5)
        things.plate(-0.9, 0.1, 3.28, 3.33, s + 0.02, s + 0.06, 1.0)
    things.lamps(section.u_at(1, 0.55), 0.02, 11.0, 0.7, 0.14, first=3.6)
    things.on_wall(section.u_at(1, 0.95), section.u_at(1, 0.70), 0.02, 0.04, 12.2, 12.9, 4.0)
    things.on_wall(section.u_at(-1, 1.3), section.u_at(-1, 0.75), 0.02, 0.22, 21.3, 21.9, 1.5)
    things.conduit(section.u_at(-1, 0.72), section.u_at(-1, 0.0), 21.6, 0.022, 0.5)
    things.cable(section.u_at(1, 1.9), 0.09, 0.016, -5.0, sag=0.03, spacing=2.0)
    return things


def _dry(canvas: Canvas, section: Section, rings: Rings) -> None:
    """Segments with marks of their moulds, few repairs, little dirt."""
    at, joint, rng = section.u_at_angle, rings.joint_s(LENGTH), canvas.rng
    canvas.concrete(0.35, 0.3, 0.15, 10)
    out_of_round(canvas, section, RADIUS, 0.006)
    paint_rings(
        canvas,
        section,
        rings,
        0.5,
        joint_db=-5.0,
        joint_width=0.016,
        lipping=0.0025,
        pockets=(-98, -77, -50, -26, 0, 26, 50, 77, 98),
        pocket_size=(0.20, 0.16),
        pocket_depth=0.06,
    )
    dirt = Dirt(canvas)
    canvas.shade(
        np.array([0, 0.7, 2.2, section.crown, section.girth - 2.2, section.girth - 0.6, section.girth]),
        np.array([-1.1, -0.7, -0.1, -0.5, 0.0, -0.5, -1.2]),
        0.3,
    )
    for s0, s1, a, b, tone in (
        (4.2, 4.75, -41, -35, 1.6),
        (13.1, 13.5, 20, 26, 1.4),
        (19.9, 20.6, 61, 66, -1.4),
        (27.0, 27.35, -70, -62, 1.8),
    ):
        dirt.repair(s0, s1, at(a), at(b), tone)
    for k in (4, 12):
        dirt.repair(joint[k] - 0.08, joint[k] + 0.08, at(-70), at(-30), 1.1, "sealed joint")
    dirt.old_stain(joint[9] + 0.3, at(41), 1.6, 0.2, -1.1)
    dirt.old_stain(joint[2] + 1.0, at(-52), 1.1, 0.16, -1.3)
    dirt.smudge(10.2, at(-4), 1.5, 0.6, -1.0, "soot")
    dirt.smudge(24.0, at(8), 1.1, 0.5, -1.3, "soot")
    dirt.smudge(31.2, at(74), 0.7, 0.4, -1.2, "grime")
    dirt.band(0, LENGTH, 0.42, 0.47, -0.8, 0.05, "grime line")
    for k in range(0, len(joint) - 1, 3):
        dirt.writing(f"{4105 + k}", joint[k] + 0.5, at(60), 0.022, -3.0)
    for k in range(1, len(joint) - 1, 4):
        dirt.writing(f"R{k:02d}", joint[k] + 1.2, at(-58), 0.018, 2.4)
    for s in (5.2, 11.2, 17.2, 29.2):
        dirt.rust(s, at(97), float(rng.uniform(0.2, 0.5)), -1.8)
    dirt.crack((joint[7] + 0.4, at(15)), (joint[7] + 0.6, at(42)), -2.2, 0.03)


def railway() -> Survey:
    """Rings of 1.8 m of trapezoidal segments, turned by turns; one ring joint is wet all round."""
    rng = np.random.default_rng(110202)
    section = _section()
    axis = Axis((588410.7, 5334872.3, 402.1), -22.0, LENGTH, [(-20, 1400.0)], 0.008)
    things = _furniture(section, rng)
    canvas = Canvas(Grid(LENGTH, section.girth), rng, section.crown)
    rings = Rings(1.8, 1.1, (0.0, 25.7, -25.7, 51.4), (12.9, -12.9, 64.3, -64.3, 115.7, -115.7, 167.0), lean=0.30)
    _dry(canvas, section, rings)

    at, joint, water = section.u_at_angle, rings.joint_s(LENGTH), Water(canvas)
    water.ring(joint[5], 0.02, section.girth - 0.02, 0.10, 0.34, 4.4, edge=0.05, salt_db=1.6)
    water.ring(joint[14], at(38), at(112), 0.07, 0.26, 3.1, edge=0.05)
    water.run(joint[10] + 0.9, at(-39), 1.7, 0.10, 0.34, 5.0, fan=3, halo=0.09, name="grout hole")
    water.line(
        [(joint[11], at(64.3 - 25.7) + 0.1), (joint[12], at(64.3 - 25.7) - 0.1)], 0.09, 3.0, every=0.5, length=(0.2, 0.8)
    )
    water.patch(joint[15] + 0.9, at(-12), 0.42, 0.32, 1.7, edge=0.14)
    water.foot(7.6, 12.4, 0.0, 0.34, 2.6, edge=0.14)
    water.patch(joint[8] - 0.14, at(77), 0.13, 0.30, 4.2, edge=0.03, salt_db=2.0, name="bolt pocket")
    water.ring(joint[1], at(-115), at(-58), 0.12, 0.4, 2.2, edge=0.09)
    water.patch(joint[16] + 0.3, at(52), 0.10, 0.09, 5.0, edge=0.02, name="drip")
    water.run(joint[12] + 0.7, at(-66), 1.1, 0.09, 0.2, 3.8, name="run")

    instrument = Instrument(48.0, 20.0, 5.0, 1.4, 0.7, 0.45, drift_db=0.1, band_db=0.05, beam_mrad=0.35)
    tunnel = Tunnel(axis, section, LENGTH, things.strands, things.blocks, things.niches)
    ground = Ground(-0.8, 0.5, 0.4, 0.002)
    places = [(3.6, 0.15, -0.65), (12.4, -0.2, -0.62), (21.3, 0.25, -0.66), (30.2, -0.1, -0.6)]
    return Survey(
        tunnel,
        canvas,
        ground,
        instrument,
        Stations(places, 0.14, 15.0),
        2102,
        cap_lining=1700,
        cap_floor=500,
        with_reference=False,
    )
