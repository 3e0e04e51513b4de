"""Two tunnels with a cast inner lining: a railway for two tracks, scanned from stations, and a road, scanned from a car."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from .canvas import Canvas
from .dirt import Dirt
from .furniture import Furniture
from .scanner import Ground, Instrument
from .survey import Stations, Survey, Trolley
from .texture import Grid
from .tunnel import Axis, Section, Strand, Tunnel, horseshoe_lining
from .water import Water


def paint_blocks(
    canvas: Canvas, joints: Sequence[float], kickers: Sequence[float], tone: float, panel: float, girth: float
) -> None:
    """Tone of blocks and kickers, block joints with chamfers, and marks of the formwork."""
    dirt, length, rng = Dirt(canvas), canvas.grid.length, canvas.rng
    edges = [0.0, *joints, length]
    dirt.panel_tones(edges, [0.0, *kickers, girth], tone)
    canvas.relief += canvas.cloud(0.003, 4.0, 2.5, 2)
    rows = canvas.s[:, 0]
    for s0, s1 in itertools.pairwise(edges):
        canvas.relief[(rows >= s0) & (rows < s1)] += np.float32(rng.normal(0, 0.002))
    plates = [
        round(s, 3)
        for j in edges[:-1]
        for s in np.arange(j + panel, min(length, j + 40), panel)
        if s < min([e for e in edges if e > j])
    ]
    for s in plates:
        if rng.random() < 0.85:
            dirt.seam(
                [(s, kickers[0]), (s, kickers[-1])], 0.012, float(rng.uniform(-1.6, -0.5)), relief=float(rng.normal(0, 0.001))
            )
    for u in np.arange(kickers[0] + 1.5, kickers[-1], 1.5):
        dirt.seam([(0.0, float(u)), (length, float(u))], 0.010, -0.7)
    for u in kickers:
        dirt.seam([(0.0, u), (length, u)], 0.016, -2.4, relief=0.003)
    for s in joints:
        dirt.seam([(s, 0.0), (s, girth)], 0.03, -4.5, relief=0.015)


def cold_joint(canvas: Canvas, s0: float, s1: float, u: float, dip: float, tone_db: float) -> None:
    """Where concreting paused: a swept line with another tone above and a dark edge."""
    s = np.linspace(s0, s1, 16)
    line = u + canvas.down(u) * dip * np.sin(np.linspace(0.3, 2.8, 16)) + np.cumsum(canvas.rng.normal(0, 0.02, 16))
    Dirt(canvas).seam(list(zip(s.tolist(), line.tolist(), strict=True)), 0.03, tone_db, kind="cold joint")


def railway_two_tracks() -> Survey:
    """Drill and blast, blocks of 10 m, kickers; water at block joints, kickers, cracks, and at the feet of the walls."""
    rng = np.random.default_rng(110404)
    length, floor_z = 36.0, -2.4
    section = Section(
        horseshoe_lining(5.3, 8.5, floor_z), [(4.1, floor_z), (3.9, floor_z - 0.45), (-3.9, floor_z - 0.45), (-4.1, floor_z)]
    )
    axis = Axis((642118.9, 5279640.5, 611.4), 118.0, length, [(-20, -1100.0)], -0.0085)
    things = Furniture(section, length, rng)
    for y in (-2.0, 2.0):
        things.rail_track(y, floor_z - 0.20, sleeper_z=floor_z - 0.38)
        things.strands.append(Strand(y, 3.0, 0.007, -3.0))
    for s in (6.0, 30.0):
        for side in (-1, 1):
            things.plate(side * 1.6 - 0.06, side * 1.6 + 0.06, 3.4, 5.2, s, s + 0.12, 1.0)
            things.plate(min(side * 1.6, side * 2.3), max(side * 1.6, side * 2.3), 3.35, 3.41, s + 0.03, s + 0.09, 1.0)
    things.cables_on_brackets([section.u_at(-1, z) for z in (-0.9, -0.75)], 0.10, 0.024, 1.25)
    things.cable(section.u_at(1, -1.2), 0.07, 0.055, 0.5)
    things.handrail(4.95, floor_z, 1.0, 2.5)
    things.lamps(section.u_at(1, 0.3), 0.02, 12.5, 0.7, 0.14, first=6.5)
    things.niche(1, 18.2, 20.2, floor_z + 0.02, -0.3, 0.9)
    things.on_wall(section.u_at(-1, 0.2), section.u_at(-1, -0.35), 0.02, 0.30, 27.4, 28.0, 1.5)
    things.conduit(section.u_at(-1, -0.35), section.u_at(-1, -0.7), 27.7, 0.03, 0.0)

    canvas = Canvas(Grid(length, section.girth), rng, section.crown)
    left, right = section.u_at(-1, -1.5), section.u_at(1, -1.5)
    joints = [2.3, 12.3, 22.3, 32.3]
    canvas.concrete(0.5, 0.3, 0.4, 9)
    paint_blocks(canvas, joints, [left, right], 0.55, 2.0, section.girth)
    canvas.shade(
        np.array(
            [
                0,
                1.0,
                3.0,
                section.crown - 3,
                section.crown,
                section.crown + 3,
                section.girth - 3,
                section.girth - 1,
                section.girth,
            ]
        ),
        np.array([-1.7, -0.9, -0.2, -0.6, -1.6, -0.5, 0.0, -0.7, -1.5]),
        0.35,
    )
    dirt, up = Dirt(canvas), section.u_at
    cold_joint(canvas, 2.4, 12.2, up(-1, 2.0), 0.5, -1.8)
    cold_joint(canvas, 22.4, 32.2, up(1, 2.6), 0.6, -2.2)
    dirt.honeycomb(9.1, up(1, -1.1), 0.6, 0.25)
    dirt.honeycomb(24.6, up(-1, -1.2), 0.45, 0.2)
    dirt.repair(15.2, 16.3, up(-1, 0.9), up(-1, 1.5), 1.7)
    dirt.repair(29.0, 29.6, up(1, 1.2), up(1, 2.0), -1.7)
    dirt.repair(5.1, 5.5, section.crown - 1.4, section.crown - 0.9, 1.4)
    for a, b in (((14.0, up(1, 3.2)), (17.6, up(1, 4.1))), ((25.0, up(-1, 3.9)), (27.0, up(-1, 2.6)))):
        dirt.crack(a, b, -2.0)
    for s, z, side, reach, tone in (
        (7.3, 2.9, 1, 1.9, -1.3),
        (19.6, 2.2, -1, 1.4, -1.5),
        (28.3, 3.0, 1, 1.2, -1.0),
        (33.6, 1.6, -1, 1.5, -1.6),
    ):
        dirt.old_stain(s, up(side, z), reach, float(rng.uniform(0.15, 0.3)), tone)
    dirt.smudge(10.0, section.crown, 1.6, 0.8, -1.1, "soot")
    dirt.smudge(26.0, section.crown + 0.5, 2.0, 0.6, -1.3, "soot")
    dirt.writing("K38+410", 4.2, up(-1, 0.7), 0.03, -2.8)
    dirt.writing("12", 13.0, up(1, 1.0), 0.04, -2.6)
    for s in np.arange(0.4, length, 1.25):
        if rng.random() < 0.4:
            dirt.rust(float(s), up(-1, -0.95), float(rng.uniform(0.15, 0.4)))

    water = Water(canvas)
    water.ring(12.3, up(-1, 3.4), 0.02, 0.10, 0.7, 5.2, edge=0.06, salt_db=2.0, halo=0.12, name="wet block joint")
    water.ring(22.3, section.crown - 1.6, up(1, 0.6), 0.10, 0.45, 3.6, edge=0.06, name="wet block joint")
    water.ring(32.3, up(1, 2.4), section.girth - 0.02, 0.12, 0.6, 2.4, edge=0.10, name="wet block joint")
    water.line(
        [(3.6, left), (10.6, left)],
        0.10,
        3.3,
        every=0.55,
        length=(0.3, 0.85),
        tongue=(0.08, 0.25),
        salt_db=1.4,
        name="kicker joint",
    )
    water.line([(24.0, right), (28.6, right)], 0.08, 4.4, every=0.7, length=(0.3, 0.8), tongue=(0.06, 0.2), name="kicker joint")
    water.foot(14.2, 21.2, 0.0, 0.42, 3.0, edge=0.15, salt_db=1.2)
    water.foot(5.0, 8.2, section.girth, 0.34, 1.9, edge=0.14)
    water.crack((16.2, up(-1, 3.6)), (18.9, up(-1, 4.4)), 0.09, 3.4, every=0.8, length=(0.3, 1.2))
    water.crack((8.4, up(1, 2.3)), (9.6, up(1, 0.9)), 0.07, 4.6, every=0.5, length=(0.3, 1.1), salt_db=2.2)
    water.patch(19.4, section.crown + 0.6, 0.55, 0.4, 1.9, edge=0.18)
    water.patch(29.6, section.crown - 1.9, 0.35, 0.45, 3.0, edge=0.08)
    water.run(26.1, up(-1, 1.7), 2.1, 0.10, 0.42, 5.6, fan=4, salt_db=1.8, halo=0.10)
    water.patch(14.4, up(1, 0.1), 0.5, 0.35, 2.1, edge=0.12, name="damp patch")
    water.run(34.4, up(1, 1.4), 1.0, 0.05, 0.15, 2.8)
    water.patch(24.6, up(-1, -1.2) - 0.05, 0.34, 0.2, 2.6, name="honeycomb")
    water.patch(6.2, section.crown + 0.2, 0.09, 0.09, 4.4, edge=0.03, name="drip")

    instrument = Instrument(44.0, 18.5, 6.0, 1.2, 0.8, 0.5, drift_db=0.12, band_db=0.06)
    tunnel = Tunnel(axis, section, length, things.strands, things.blocks, things.niches)
    ground = Ground(-2.6, 0.7, 1.5, 0.03)
    places = [(4.0, -2.0, -1.05), (13.5, 2.0, -1.0), (22.6, -2.0, -1.1), (31.8, 2.0, -1.05)]
    return Survey(tunnel, canvas, ground, instrument, Stations(places, 0.125, 17.0), 2104, cap_lining=1550, cap_floor=350)


def road_two_lanes() -> Survey:
    """New Austrian method, painted walls, traffic soot, splash of the road; water at block joints, holes and kerbs."""
    rng = np.random.default_rng(110505)
    length, floor_z = 32.0, -1.6
    section = Section(
        horseshoe_lining(5.1, 9.0, floor_z),
        [(3.95, floor_z), (3.9, floor_z - 0.18), (0.0, floor_z - 0.08), (-3.9, floor_z - 0.18), (-3.95, floor_z)],
    )
    axis = Axis((431990.3, 5743205.8, 188.0), -64.0, length, [(-20, 640.0)], 0.021)
    things = Furniture(section, length, rng)
    for y in (-1.9, 1.9):
        for s in np.arange(1.2, length - 1, 5.0):
            z = float(np.sqrt(5.1**2 - y**2)) - 0.42
            things.plate(y - 0.16, y + 0.16, z, z + 0.14, s, s + 0.9, 3.0)
            things.plate(y - 0.015, y + 0.015, z + 0.14, z + 0.42, s + 0.4, s + 0.44, 0.5)
    z = 4.45
    things.plate(-0.22, 0.22, z, z + 0.03, -20, 200, 0.0)
    for y in (-0.12, -0.03, 0.06, 0.14):
        things.strands.append(Strand(y, z + 0.06, 0.025, -7.0))
    for s in np.arange(0.9, length, 2.0):
        things.plate(-0.02, 0.02, z, 5.1, s, s + 0.04, 0.5)
    things.on_wall(section.u_at(1, 0.25), section.u_at(1, -0.75), 0.02, 0.25, 8.3, 9.0, 3.0)
    things.on_wall(section.u_at(1, 1.2), section.u_at(1, 0.6), 0.10, 0.16, 8.3, 9.0, 4.0)
    things.on_wall(section.u_at(-1, 0.3), section.u_at(-1, -0.1), 0.02, 0.06, 20.2, 21.2, 4.5)
    things.niche(-1, 12.0, 13.6, floor_z + 0.05, 0.5, 0.6)
    things.cable(section.u_at(1, 2.6), 0.05, 0.02, 0.5)
    things.conduit(section.u_at(1, 2.6), section.u_at(1, 0.25), 8.65, 0.02, 0.5)
    things.lamps(section.u_at(-1, -0.75), 0.01, 6.0, 0.25, 0.1, first=3.0)

    canvas = Canvas(Grid(length, section.girth), rng, section.crown)
    joints = [5.2, 17.2, 29.2]
    left, right, up = section.u_at(-1, -1.2), section.u_at(1, -1.2), section.u_at
    canvas.concrete(0.4, 0.3, 0.3, 6)
    paint_blocks(canvas, joints, [left, right], 0.4, 1.5, section.girth)
    dirt = Dirt(canvas)
    for side in (-1, 1):
        dirt.band(0, length, up(side, floor_z + 0.02), up(side, 1.5), 2.2, 0.02, "wall paint", 0.004)
        dirt.splash(0, length, up(side, floor_z + 0.01), 0.85 if side > 0 else 0.7, -2.4)
    canvas.shade(
        np.array(
            [
                0,
                up(-1, 1.6),
                up(-1, 3.0),
                section.crown - 1.5,
                section.crown,
                section.crown + 1.5,
                up(1, 3.0),
                up(1, 1.6),
                section.girth,
            ]
        ),
        np.array([-0.4, -0.9, -2.2, -3.0, -3.4, -3.2, -2.4, -1.1, -0.5]),
        0.22,
    )
    dirt.band(0, 19.5, up(1, -0.6), up(1, 1.1), 0.9, 0.10, "cleaned", 0.06)
    dirt.band(6.0, 16.0, up(-1, -0.2), up(-1, 1.0), 0.8, 0.12, "cleaned", 0.05)
    for s, side, z, a, tone in (
        (3.0, -1, 0.2, 0.8, -1.3),
        (11.0, 1, 0.9, 0.6, -1.2),
        (23.5, -1, -0.3, 0.9, -1.0),
        (26.0, 1, 0.3, 0.5, -1.4),
    ):
        dirt.smudge(s, up(side, z), a, 0.3, tone, "grime")
    dirt.repair(14.4, 15.6, up(1, 0.5), up(1, 1.3), -2.0, "unpainted repair")
    dirt.repair(24.4, 24.9, up(-1, 0.3), up(-1, 0.9), 1.2)
    for s in (2.0, 10.5, 22.0, 27.5):
        dirt.smudge(s, section.crown + float(rng.uniform(-0.8, 0.8)), 1.2, 0.5, -1.3, "soot", 0.4)
    for s, side, z, reach, tone in ((7.4, -1, 2.8, 1.2, -1.4), (20.1, 1, 2.9, 1.5, -1.2), (25.2, 1, 1.3, 1.0, -1.5)):
        dirt.old_stain(s, up(side, z), reach, 0.2, tone, 1.0)
    for s, side in ((4.0, 1), (19.0, 1), (30.0, -1)):
        dirt.writing(f"{int(s * 10):03d}", s, up(side, 0.9), 0.03, -5.0)
    dirt.crack((9.5, up(-1, 3.4)), (13.8, up(-1, 3.9)), -1.8)
    for s in np.arange(0.9, length, 2.0):
        dirt.rust(float(s), section.crown + 0.05, 0.15, -1.5)

    water = Water(canvas)
    water.ring(5.2, section.crown + 0.6, section.girth - 0.02, 0.10, 0.55, 4.6, edge=0.05, salt_db=1.6, name="wet block joint")
    water.ring(17.2, up(-1, 3.6), up(-1, 0.0), 0.10, 0.40, 3.0, edge=0.06, name="wet block joint")
    water.ring(29.2, up(-1, 1.6), 0.02, 0.10, 0.5, 3.8, edge=0.05, name="wet block joint")
    water.run(11.6, up(1, 2.1), 1.9, 0.09, 0.36, 5.4, fan=3, salt_db=1.8, halo=0.08, name="anchor hole")
    water.crack((20.8, up(-1, 2.2)), (22.6, up(-1, 3.1)), 0.08, 3.4, every=0.6, length=(0.3, 1.0))
    water.foot(19.4, 25.6, section.girth, 0.40, 2.8, edge=0.12)
    water.line([(7.0, left), (10.4, left)], 0.09, 3.6, every=0.5, length=(0.15, 0.4), tongue=(0.08, 0.2), name="kicker joint")
    water.patch(26.2, up(1, 3.6), 0.5, 0.4, 2.2, edge=0.14)
    water.patch(15.0, section.crown - 2.2, 0.45, 0.35, 3.2, edge=0.08)
    water.run(31.0, up(1, 1.0), 0.9, 0.05, 0.14, 2.6)
    water.patch(2.2, up(-1, 3.3), 0.3, 0.25, 0.9, edge=0.2, limit="Lost in the soot of the vault.")

    instrument = Instrument(50.0, 16.0, 8.0, 0.8, 0.7, 0.65, drift_db=0.25, band_db=0.12, beam_mrad=0.5)
    tunnel = Tunnel(axis, section, length, things.strands, things.blocks, things.niches)
    marks = [(0.95, 1.10, 3.5), (4.85, 5.0, 3.0), (8.75, 8.9, 3.5)]
    ground = Ground(-4.5, 0.5, 0.6, 0.003, marks)
    return Survey(
        tunnel, canvas, ground, instrument, Trolley((-1.75, 0.25), 1.2, 60, 0.25, 0.01), 2105, cap_lining=2400, cap_floor=500
    )
