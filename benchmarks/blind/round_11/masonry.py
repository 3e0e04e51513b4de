"""An old railway tunnel of brick: soot of steam days, patches of new brick, repointing, rising damp and wet vaults."""

from __future__ import annotations

import numpy as np

from .canvas import Canvas
from .dirt import Dirt
from .furniture import Furniture
from .scanner import Ground, Instrument
from .survey import Stations, Survey
from .texture import Grid, box, union
from .tunnel import Axis, Section, Tunnel, horseshoe_lining
from .water import Water

LENGTH = 27.0


def lay_bricks(canvas: Canvas, course: float, brick: float, deviation: float, mortar_db: float, recess: float) -> None:
    """Courses of bricks along the tunnel: a tone for each brick, mortar between, faces a little out of line."""
    rng, cell = canvas.rng, canvas.grid.cell
    s, u = canvas.s[:, 0], canvas.u[0]
    row = (u / course).astype(int)
    shift = (row % 2) * brick / 2 + rng.normal(0, 0.02, row.max() + 1)[row]
    along = (s[:, None] + shift[None, :]) / brick
    column = along.astype(int) + 1
    tones = rng.normal(0, deviation, (row.max() + 1, column.max() + 2)).astype(np.float32)
    tones += (rng.random(tones.shape) < 0.04) * rng.normal(0, 1.6, tones.shape).astype(np.float32)
    faces = rng.normal(0, 0.0025, tones.shape).astype(np.float32)
    faces += (rng.random(tones.shape) < 0.02).astype(np.float32) * np.float32(0.018)
    canvas.dry += tones[row[None, :], column]
    canvas.relief += faces[row[None, :], column]
    bed = (u / course - row) * course < cell * 1.05
    head = (along - along.astype(int)) * brick < cell * 1.05
    mortar = head | bed[None, :]
    weathering = 0.6 + 0.5 * canvas.cloud(1.0, 1.5, 1.0, 2)
    canvas.dry[mortar] += (mortar_db * weathering)[mortar]
    canvas.relief[mortar] += (recess * np.clip(weathering, 0.1, 2.0))[mortar]


def new_brick(canvas: Canvas, s0: float, s1: float, u0: float, u1: float, tone_db: float, course: float = 0.085) -> None:
    """A patch of new facing, toothed into the old courses."""
    rng, u = canvas.rng, min(u0, u1)
    rows = []
    while u < max(u0, u1):
        a, b = s0 + float(rng.choice([0.0, 0.11])), s1 - float(rng.choice([0.0, 0.11]))
        rows.append(box(canvas.grid, a, b, u - 0.006, u + course + 0.006, margin=0.03))
        u += course
    canvas.paint(union(canvas.grid, rows), tone_db, 0.012, "new brick", uneven=0.1, relief=-0.004)


def _furniture(section: Section, rng: np.random.Generator, floor_z: float) -> Furniture:
    """One track where there were two, cables on old hooks, refuges, a drip tray."""
    things = Furniture(section, LENGTH, rng)
    things.rail_track(-0.4, floor_z + 0.17, gauge=1.5, sleeper_z=floor_z + 0.03)
    low = [section.u_at(-1, z) for z in (-1.45, -1.33, -1.22)]
    things.cables_on_brackets(low, 0.12, 0.022, 1.8, sag=0.06)
    things.cable(section.u_at(1, 0.1), 0.09, 0.012, -5.0, sag=0.09, spacing=2.7)
    for s in np.arange(0.05, LENGTH, 2.7):
        things.on_wall(section.u_at(1, 0.14), section.u_at(1, 0.06), 0.0, 0.10, s - 0.015, s + 0.015, -2.0)
    things.niche(1, 7.2, 8.5, floor_z + 0.02, -0.55, 0.55)
    things.niche(-1, 17.0, 18.3, floor_z + 0.02, -0.55, 0.55)
    middle = section.crown - 0.3
    things.on_wall(middle - 0.8, middle - 0.25, 0.04, 0.06, 19.2, 21.4, 2.0)
    things.on_wall(middle - 0.25, middle + 0.3, 0.04, 0.06, 19.2, 21.4, 2.2)
    things.on_wall(section.u_at(-1, 0.4), section.u_at(-1, 0.05), 0.01, 0.03, 10.1, 10.6, 3.5)
    return things


def brick() -> Survey:
    """Horseshoe of the 1870s under wet clay; leaks as patches in the vault, weeping joints, and damp walls."""
    rng = np.random.default_rng(110606)
    floor_z = -2.3
    section = Section(
        horseshoe_lining(4.0, 14.0, floor_z), [(3.4, floor_z - 0.02), (2.2, floor_z - 0.12), (-2.6, floor_z - 0.1)]
    )
    axis = Axis((517300.6, 5680421.3, 88.7), 204.0, LENGTH, [(-20, np.inf), (12, 520.0)], -0.0111)
    things = _furniture(section, rng, floor_z)

    canvas = Canvas(Grid(LENGTH, section.girth), rng, section.crown)
    canvas.dry += canvas.cloud(0.55, 2.0, 1.4) + np.float32(0.35) * rng.standard_normal(canvas.grid.shape, dtype=np.float32)
    canvas.dry += canvas.cloud(0.35, 0.25, 1.8, 2)
    canvas.relief += canvas.cloud(0.011, 2.2, 1.4, 3)
    lay_bricks(canvas, 0.085, 0.235, 0.75, 1.0, 0.006)
    up, crown = section.u_at, section.crown
    canvas.shade(
        np.array(
            [
                0,
                0.5,
                1.6,
                up(-1, 0.6),
                up(-1, 2.4),
                crown - 0.8,
                crown,
                crown + 0.8,
                up(1, 2.4),
                up(1, 0.4),
                section.girth - 1.2,
                section.girth,
            ]
        ),
        np.array([-1.3, -0.6, -0.1, -0.5, -2.1, -3.4, -3.6, -3.3, -1.9, -0.3, -0.1, -1.0]),
        0.28,
        2.2,
    )
    dirt = Dirt(canvas)
    new_brick(canvas, 3.1, 4.9, up(1, -0.6), up(1, 0.9), 1.6)
    new_brick(canvas, 13.0, 14.6, up(-1, 2.6), up(-1, 3.5), 2.6)
    new_brick(canvas, 22.4, 24.6, crown + 0.4, crown + 1.7, 2.8)
    new_brick(canvas, 20.2, 21.1, up(-1, -0.9), up(-1, 0.1), -1.5)
    dirt.repair(9.3, 10.9, up(1, 1.3), up(1, 2.2), 1.5, "repointing", 0.05)
    dirt.repair(1.1, 2.0, up(-1, 1.1), up(-1, 1.9), -1.5, "mortar render", 0.03)
    dirt.repair(15.2, 16.1, up(1, -1.4), up(1, -0.8), 1.8, "mortar render", 0.03)
    for s, side, z, reach, width, tone in (
        (2.6, -1, 2.4, 1.3, 0.25, -1.5),
        (6.1, 1, 2.1, 1.8, 0.3, -1.2),
        (12.0, -1, 0.9, 1.2, 0.35, -1.6),
        (19.8, 1, 1.6, 1.5, 0.22, -1.4),
        (25.4, -1, 2.0, 1.0, 0.3, -1.3),
    ):
        dirt.old_stain(s, up(side, z), reach, width, tone, 1.6)
    for s, at, a, b, tone in (
        (5.0, crown + 0.3, 1.3, 0.6, -1.4),
        (16.5, crown - 0.4, 1.6, 0.7, -1.5),
        (11.0, crown + 1.3, 0.8, 0.4, -1.1),
    ):
        dirt.smudge(s, at, a, b, tone, "soot", 0.4)
    for s, side, z, a, b, tone in (
        (8.2, -1, -0.5, 0.8, 0.35, -1.2),
        (24.9, 1, -0.8, 0.7, 0.4, -1.3),
        (1.6, 1, -0.9, 0.5, 0.3, -1.1),
    ):
        dirt.smudge(s, up(side, z), a, b, tone, "grime")
    for s, side, z, reach in ((4.1, -1, 1.4, 0.9), (17.4, 1, 2.0, 1.2), (23.0, -1, 0.8, 0.7)):
        dirt.old_stain(s, up(side, z), reach, 0.18, 2.6, 0.3, "calcite")
    for s in np.arange(0.05, LENGTH, 2.7):
        dirt.rust(float(s), up(1, 0.05), float(rng.uniform(0.2, 0.7)), -2.0)
    dirt.crack((9.0, crown - 0.9), (16.0, crown - 1.3), -1.6, 0.04)
    dirt.writing("17", 11.8, up(1, -0.4), 0.04, 3.0)
    dirt.writing("3-22", 5.6, up(-1, -0.2), 0.03, 2.6)

    water = Water(canvas)
    water.foot(1.2, 6.6, 0.0, 0.55, 3.4, edge=0.16, torn=0.07, salt_db=1.8, salt_width=0.08)
    water.foot(10.6, 15.0, section.girth, 0.48, 2.6, edge=0.16, torn=0.07, salt_db=1.5, salt_width=0.07)
    water.foot(21.8, 25.6, 0.0, 0.40, 4.2, edge=0.12, torn=0.06)
    water.patch(7.6, up(-1, 2.3), 0.75, 0.6, 4.2, edge=0.10, torn=0.09, salt_db=2.2, halo=0.12)
    water.patch(18.2, crown + 1.1, 0.9, 0.6, 2.8, edge=0.16, torn=0.1)
    water.patch(5.4, up(1, 1.6), 0.5, 0.5, 2.2, edge=0.14, torn=0.08)
    water.run(20.6, up(1, 1.3), 2.3, 0.14, 0.5, 5.4, fan=4, torn=0.05, salt_db=2.0, name="weeping joint")
    water.run(16.1, up(-1, 1.2), 1.7, 0.12, 0.34, 3.6, fan=3, torn=0.04, name="weep hole")
    water.line(
        [(11.2, up(-1, 2.0)), (14.0, up(-1, 1.85))],
        0.12,
        3.4,
        every=0.5,
        length=(0.3, 1.1),
        tongue=(0.08, 0.2),
        torn=0.03,
        salt_db=1.6,
    )
    water.patch(25.6, up(1, 1.9), 0.55, 0.45, 3.0, edge=0.10, torn=0.08)
    water.patch(14.8, crown + 1.9, 0.5, 0.4, 2.8, edge=0.12, torn=0.07)
    water.run(23.6, up(-1, 2.6), 1.5, 0.10, 0.26, 4.4, fan=2, torn=0.04)
    water.patch(9.9, up(-1, -0.6), 0.1, 0.12, 3.5, edge=0.04, name="drip")
    water.patch(21.8, crown - 1.5, 0.35, 0.3, 1.1, edge=0.2, limit="Soot of the vault hides it.")

    instrument = Instrument(47.0, 19.0, 5.5, 1.3, 0.65, 0.6, drift_db=0.12, band_db=0.06, range_noise_m=0.0015)
    tunnel = Tunnel(axis, section, LENGTH, things.strands, things.blocks, things.niches)
    ground = Ground(-2.4, 0.8, 1.5, 0.03)
    places = [(3.4, 0.5, -0.6), (10.4, 0.9, -0.55), (17.2, 0.4, -0.6), (24.0, 0.8, -0.58)]
    return Survey(tunnel, canvas, ground, instrument, Stations(places, 0.14, 15.0), 2106, cap_lining=1280, cap_floor=350)
