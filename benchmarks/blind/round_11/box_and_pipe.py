"""A cut-and-cover box of a light railway, and a utility tunnel of jacked concrete pipes."""

from __future__ import annotations

import itertools

import numpy as np

from .canvas import Canvas
from .dirt import Dirt
from .furniture import Furniture
from .scanner import Ground, Instrument
from .survey import Stations, Survey
from .texture import Grid, box
from .tunnel import Axis, Section, Strand, Tunnel, circle_lining, polygon_lining
from .water import Water


def _box_formwork(canvas: Canvas, edges_s: list[float], edges_u: list[float]) -> None:
    """Boards of 1.25 by 2.5 m, ties with plugs, joints of pours."""
    dirt, rng, length = Dirt(canvas), canvas.rng, canvas.grid.length
    dirt.panel_tones(edges_s, edges_u, 0.5)
    for u0, u1 in itertools.pairwise(edges_u):
        boards = np.arange(u0, u1 + 0.01, (u1 - u0) / max(round((u1 - u0) / 2.5), 1)).tolist()
        columns = np.arange(0.35, length, 1.25).tolist()
        dirt.panel_tones([0.0, *columns, length], boards, 0.22)
        for s in columns:
            dirt.seam([(s, u0), (s, u1)], 0.01, float(rng.uniform(-1.3, -0.3)))
        for u in boards[1:-1]:
            dirt.seam([(0.0, u), (length, u)], 0.01, -0.9)
        for s in columns:
            for u in np.arange(u0 + 0.5, u1 - 0.2, 1.1):
                a, plug = s + 0.3, float(rng.choice([-2.5, -3.2, 1.6]))
                canvas.paint(box(canvas.grid, a - 0.02, a + 0.02, u - 0.02, u + 0.02, margin=0.05), plug, 0.02)


def cut_and_cover() -> Survey:
    """Box of two tracks with expansion joints and restraint cracks; water at joints, corners, kickers and ties."""
    rng = np.random.default_rng(110707)
    length, floor_z, top, half, haunch = 32.0, -2.5, 2.3, 4.6, 0.45
    corners = [
        (-half, floor_z),
        (-half, top - haunch),
        (haunch - half, top),
        (half - haunch, top),
        (half, top - haunch),
        (half, floor_z),
    ]
    section = Section(polygon_lining(corners), [(3.6, floor_z), (3.5, floor_z - 0.15), (-3.5, floor_z - 0.15), (-3.6, floor_z)])
    axis = Axis((376540.2, 5892210.4, 21.9), 77.0, length, [(-20, 260.0)], 0.026)
    things = Furniture(section, length, rng)
    for y in (-1.95, 1.95):
        things.rail_track(y, floor_z - 0.02)
        things.strands.append(Strand(y, 1.75, 0.007, -3.0))
        for s in np.arange(2.5, length, 8.0):
            things.plate(y - 0.04, y + 0.04, 1.8, top, s, s + 0.08, 1.0)
    things.cables_on_brackets([section.u_at(1, z) for z in (-0.35, -0.25, -0.15)], 0.12, 0.024, 1.0)
    things.cable(section.u_at(-1, -0.9), 0.10, 0.06, 1.0)
    for s in np.arange(1.5, length, 3.0):
        things.on_wall(section.u_at(-1, -0.98), section.u_at(-1, -0.82), 0.0, 0.05, s, s + 0.05, 0.0)
    things.lamps(section.u_at(-1, 0.6), 0.02, 8.0, 1.2, 0.12, first=3.0)
    things.lamps(section.u_at(1, 0.6), 0.02, 8.0, 1.2, 0.12, first=7.0)
    things.on_wall(section.u_at(-1, 0.1), section.u_at(-1, -0.6), 0.01, 0.25, 13.2, 14.0, 1.5)
    things.conduit(section.u_at(-1, 0.55), section.u_at(-1, 0.1), 13.6, 0.02, 0.5)
    things.on_wall(section.u_at(1, -0.7), section.u_at(1, -0.95), 0.01, 0.03, 22.0, 22.8, 4.0)
    things.conduit(section.u_at(1, 1.6), section.u_at(1, -2.3), 26.4, 0.055, 0.5)

    canvas = Canvas(Grid(length, section.girth), rng, section.crown)
    canvas.concrete(0.45, 0.3, 0.25, 8)
    canvas.relief += canvas.cloud(0.003, 3.0, 2.0, 2)
    up, low = section.u_at, floor_z + 0.45
    kick_l, kick_r = up(-1, low), up(1, low)
    top_l, top_r = up(-1, top - haunch), up(1, top - haunch)
    joints = [5.6, 17.6, 29.6]
    _box_formwork(
        canvas, [0.0, *joints, length], [0.0, kick_l, top_l, top_l + 0.64, top_r - 0.64, top_r, kick_r, section.girth]
    )
    dirt = Dirt(canvas)
    for u in (kick_l, kick_r, top_l, top_r):
        dirt.seam([(0.0, u), (length, u)], 0.014, -2.0, relief=0.002)
    for s in joints:
        dirt.seam([(s, 0.0), (s, section.girth)], 0.035, -5.0, relief=0.02)
    canvas.shade(
        np.array(
            [
                0,
                0.6,
                1.5,
                top_l,
                section.crown - 2.0,
                section.crown,
                section.crown + 2.0,
                top_r,
                section.girth - 1.3,
                section.girth,
            ]
        ),
        np.array([-1.8, -1.0, -0.2, -0.1, -1.0, -0.3, -1.1, -0.1, -0.4, -1.6]),
        0.3,
    )
    for s, side in ((9.2, -1), (12.9, 1), (21.4, 1), (25.0, -1)):
        dirt.crack((s, kick_l if side < 0 else kick_r), (s + 0.1, up(side, 1.4)), -1.7, 0.025)
    for s, side, z0, z1, tone in ((21.2, 1, 0.2, 1.2, 1.3), (8.9, -1, -0.4, 0.4, -1.4), (2.2, 1, -1.6, -1.0, 1.6)):
        dirt.repair(s, s + 0.45, up(side, z0), up(side, z1), tone, "injection" if tone < 0 else "repair", 0.02)
    dirt.repair(11.0, 12.2, section.crown - 1.8, section.crown - 1.1, -1.5, "mortar render", 0.02)
    dirt.repair(26.0, 26.7, section.crown + 1.0, section.crown + 1.5, 1.5)
    for s, side, z, reach, tone in (
        (3.3, -1, 1.2, 1.4, -1.2),
        (15.3, 1, 1.0, 0.9, -1.5),
        (23.2, -1, 0.4, 1.3, -1.3),
        (30.7, 1, 1.3, 1.2, -1.1),
    ):
        dirt.old_stain(s, up(side, z), reach, 0.2, tone, 1.1)
    dirt.band(0, length, section.crown - 2.15, section.crown - 1.8, -0.8, 0.2, "soot", 0.05)
    dirt.band(0, length, section.crown + 1.8, section.crown + 2.15, -0.7, 0.2, "soot", 0.05)
    for s, side, z in ((6.4, 1, 0.4), (18.5, -1, 0.3), (28.3, -1, 0.9)):
        dirt.writing(f"{int(100 + s * 3)}", s, up(side, z), 0.035, -3.0)
    dirt.smudge(19.6, up(1, -1.4), 1.0, 0.35, -1.2, "grime")
    dirt.smudge(11.6, up(-1, -1.5), 0.8, 0.3, -1.3, "grime")
    for s in np.arange(0.4, length, 1.0):
        if rng.random() < 0.35:
            dirt.rust(float(s), up(1, -0.42), float(rng.uniform(0.1, 0.4)))

    water = Water(canvas)
    water.ring(5.6, top_l + 0.1, 0.02, 0.14, 0.6, 4.6, edge=0.06, salt_db=1.8, halo=0.08, name="wet expansion joint")
    water.ring(17.6, section.crown - 2.6, section.crown + 3.0, 0.22, 0.42, 3.2, edge=0.08, name="wet expansion joint")
    water.ring(29.6, up(1, 0.9), section.girth - 0.02, 0.12, 0.5, 2.6, edge=0.08, name="wet expansion joint")
    water.foot(18.4, 27.4, 0.0, 0.36, 3.2, edge=0.12, salt_db=1.4)
    water.foot(8.4, 12.2, section.girth, 0.30, 2.2, edge=0.12)
    water.line(
        [(13.6, kick_r), (20.4, kick_r)], 0.10, 4.0, every=0.6, length=(0.15, 0.44), tongue=(0.10, 0.25), name="kicker joint"
    )
    water.line([(20.0, top_l), (23.0, top_l)], 0.12, 3.4, every=0.6, length=(0.4, 1.4), tongue=(0.07, 0.18), name="corner")
    water.crack((25.0, up(-1, 1.3)), (25.1, up(-1, -1.6)), 0.12, 4.8, wander=0.03, salt_db=2.2, every=0.9, length=(0.3, 0.7))
    water.crack((12.95, up(1, 0.3)), (12.9, kick_r), 0.11, 2.8, wander=0.02)
    water.patch(8.2, section.crown + 0.8, 0.55, 0.45, 2.0, edge=0.16)
    water.patch(26.6, section.crown - 1.2, 0.4, 0.5, 3.8, edge=0.07, halo=0.1)
    water.run(10.65, up(-1, 0.9), 1.5, 0.09, 0.24, 5.8, fan=3, name="tie hole")
    water.run(15.65, up(-1, -0.2), 0.7, 0.05, 0.12, 3.2, name="tie hole")

    instrument = Instrument(45.0, 20.0, 6.0, 1.0, 0.8, 0.4, drift_db=0.1, band_db=0.05)
    tunnel = Tunnel(axis, section, length, things.strands, things.blocks, things.niches)
    ground = Ground(-1.4, 0.6, 0.5, 0.003)
    places = [(4.2, -0.1, -1.0), (12.2, 0.3, -0.95), (20.0, -0.2, -1.0), (27.9, 0.2, -1.02)]
    return Survey(tunnel, canvas, ground, instrument, Stations(places, 0.135, 14.0), 2107, cap_lining=1550, cap_floor=400)


def utility() -> Survey:
    """Jacked pipes of 4 m by 2.5 m, mains and cable racks on both sides, a tide mark of an old flood; water at few joints."""
    rng = np.random.default_rng(110808)
    radius, floor_z, length = 2.0, -1.5, 24.0
    section = Section(
        circle_lining(radius, floor_z), [(0.2, floor_z), (0.15, floor_z - 0.05), (-0.15, floor_z - 0.05), (-0.2, floor_z)]
    )
    axis = Axis((605127.7, 5477093.6, -4.2), -141.0, length, [(-20, np.inf)], 0.003)
    things = Furniture(section, length, rng)
    at = section.u_at_angle
    for angle in (66, 84, 102):
        y, z = things.off_wall(at(angle), 0.20)
        for k in range(3):
            things.strands.append(
                Strand(y + 0.06 * (k - 1), z + 0.035, 0.022 + 0.006 * (k % 2), -7.0 + k, sag=0.012, spacing=0.8)
            )
        for s in np.arange(0.5, length, 0.8):
            things.plate(min(y - 0.10, y + 0.25), y + 0.25, z - 0.02, z, s - 0.02, s + 0.02, 0.5)
    things.strands.append(Strand(-1.32, -0.80, 0.22, 1.5))
    things.strands.append(Strand(-1.62, 0.15, 0.085, -1.0))
    for s in np.arange(1.6, length, 4.0):
        things.plate(-1.55, -1.10, floor_z, -1.0, s, s + 0.15, -0.5)
        things.plate(-1.98, -1.6, 0.03, 0.07, s + 1.0, s + 1.06, 0.0)
    things.lamps(at(14), 0.02, 6.0, 0.7, 0.12, first=2.4)
    things.conduit(at(16), at(64), 6.1, 0.015, 0.5)
    things.on_wall(at(-52), at(-40), 0.01, 0.16, 12.4, 12.8, 2.0)
    things.cable(at(10), 0.03, 0.012, 0.0)

    canvas = Canvas(Grid(length, section.girth), rng, section.crown)
    canvas.concrete(0.4, 0.3, 0.3, 14)
    canvas.relief += canvas.cloud(0.0015, 1.5, 1.5, 2)
    dirt = Dirt(canvas)
    joints = [1.9, 4.4, 6.9, 9.4, 11.9, 14.4, 16.9, 19.4, 21.9]
    dirt.panel_tones([0.0, *joints, length], [0.0, section.girth], 0.6)
    for s in joints:
        dirt.seam([(s, 0.0), (s, section.girth)], 0.022, -4.5, relief=0.014)
        for angle in (-35, 35):
            if 0.4 < s + 1.25 < length:
                a, u = s + 1.25, at(angle)
                canvas.paint(
                    box(canvas.grid, a - 0.03, a + 0.03, u - 0.03, u + 0.03, margin=0.05), float(rng.choice([1.8, -2.4])), 0.02
                )
    for side in (-1, 1):
        tide = section.u_at(side, -0.55)
        foot = 0.0 if side < 0 else section.girth
        dirt.band(0, length, tide, foot, -1.5, 0.05, "tide mark", 0.02)
        dirt.band(0, length, tide - 0.03 * side, tide, 0.8, 0.04, "tide mark", 0.02)
    canvas.shade(
        np.array([0, at(-60), at(-20), at(0), at(20), at(60), section.girth]),
        np.array([-0.5, -0.3, -0.1, -0.4, -0.1, -0.5, -0.6]),
        0.4,
    )
    for k in (1, 3, 6):
        dirt.repair(joints[k] - 0.07, joints[k] + 0.07, at(-50), at(46), 1.3, "sealed joint")
    dirt.repair(17.6, 18.3, at(24), at(40), -1.5, "mortar render", 0.02)
    for s, angle, reach, tone in ((3.2, -38, 0.6, -1.3), (10.3, 36, 0.5, -1.2), (18.9, -30, 0.7, -1.4)):
        dirt.old_stain(s, at(angle), reach, 0.15, tone, 1.2)
    for k, s in enumerate((1.9, 9.4, 16.9)):
        dirt.writing(f"{31 + 3 * k}", s + 0.5, at(-20), 0.025, -3.2)
    for s in np.arange(0.5, length, 0.8):
        if rng.random() < 0.3:
            dirt.rust(float(s), at(68), float(rng.uniform(0.1, 0.25)))
    dirt.smudge(7.9, at(-12), 0.6, 0.3, -1.1, "grime")
    dirt.smudge(20.6, at(28), 0.5, 0.3, -1.2, "grime")

    water = Water(canvas)
    water.ring(11.9, at(-96), at(40), 0.08, 0.30, 4.2, edge=0.04, salt_db=2.0)
    water.ring(19.4, at(12), section.girth - 0.02, 0.08, 0.34, 3.0, edge=0.06)
    water.run(15.65, at(-35), 0.95, 0.10, 0.26, 5.2, fan=2, halo=0.06, name="lifting hole")
    water.patch(5.6, at(30), 0.32, 0.26, 2.2, edge=0.1)
    water.foot(12.6, 16.2, section.girth, 0.26, 2.8, edge=0.08)
    water.patch(21.9, at(-30), 0.09, 0.11, 3.6, edge=0.03, name="drip")

    instrument = Instrument(42.0, 17.0, 9.0, 1.0, 0.9, 0.7, drift_db=0.15, band_db=0.08, range_noise_m=0.001)
    tunnel = Tunnel(axis, section, length, things.strands, things.blocks, things.niches)
    ground = Ground(-1.6, 0.5, 0.4, 0.002)
    places = [(2.6, 0.1, 0.05), (7.6, 0.0, 0.08), (12.4, 0.12, 0.04), (17.2, 0.05, 0.06), (21.8, 0.1, 0.05)]
    return Survey(tunnel, canvas, ground, instrument, Stations(places, 0.22, 9.0), 2108, cap_lining=1600, cap_floor=500)
