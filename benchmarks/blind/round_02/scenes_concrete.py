"""Old tunnels under new skins of concrete."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import fittings, linings
from .alignment import Alignment
from .canvas import Canvas
from .instrument import Instrument
from .marks import Marks
from .moisture import Moisture, Water
from .output import write
from .section import Piece, Section
from .solids import Beam, Downpipe, WallBox, rails
from .stances import Drive, Stations
from .tracing import Tunnel


def sprayed_over_brick(folder: Path) -> None:
    """Sprayed concrete over an old vault, pierced by lime curtains, with half pipes that drain its leaks."""
    rng = np.random.default_rng(20204)
    section = Section(6.4, (Piece(6.754, 4.3), Piece(2.9, 10.0)), 2.4)
    canvas = Canvas(32.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    whole = canvas.whole()
    linings.lay(canvas, whole, linings.sprayed(rng, whole, -3.8, 1.1))
    old = canvas.window(25.2, 32.0, -section.half, section.half)
    linings.lay(canvas, old, linings.brickwork(rng, old, -4.9, 1.0))
    canvas.relief[old.index] -= np.float32(0.05)
    marks = Marks(canvas, rng)
    marks.soot((-2.0, 2.0), 1.1, 1.4, noted=False)
    marks.blotch([(28.6, 1.9, 3.2, 1.1)], -3.0, "soot", 0.5, 0.15)
    marks.grime(1.0, foot, 1.8, 1.8)
    marks.grime(-1.0, foot, 1.8, 1.5)
    marks.sprayed_patch([(9.6, 4.1, 1.1, 0.7), (10.4, 4.6, 0.7, 0.6)], -2.4)
    marks.sprayed_patch([(18.6, -5.6, 1.2, 0.8)], -5.3)
    marks.lime(3.5, 3.0, 2.6, 0.9, 3.6, 6, "calcite curtain")
    marks.lime(13.1, -3.4, 2.2, 0.7, 3.2, 5, "calcite curtain")
    marks.lime(21.7, 2.8, 3.0, 1.0, 3.8, 7, "calcite curtain")
    marks.lime(29.9, -3.9, 1.3, 0.4, 3.5, 3, "calcite")
    for s, t in ((6.4, -3.9), (16.2, 3.5), (24.0, -2.7)):
        marks.stain(s, t, 1.4, 0.16, 2.2, "rust")
    marks.blotch([(11.9, 6.1, 0.35, 0.25)], -3.0, "bitumen", 0.03, 0.03)
    marks.painted(19.2, 20.9, wall(1.8), wall(1.0), -2.6, "graffiti", 0.25)
    marks.painted(6.0, 6.8, -wall(2.1), -wall(1.6), 2.4, "painted number", 0.2)
    for s in (7.9, 23.3):
        marks.chase(s, 1.1, wall(0.1), 0.22, 1.3)
    wet = Moisture(canvas, rng)
    wet.run(3.7, 3.2, 2.9, 0.38, Water(8.2, 0.07, 0.03, film=0.8), "calcite curtain", 0.25)
    wet.run(13.4, -3.7, 2.6, 0.30, Water(5.5, 0.08, 0.03, film=0.5), "calcite curtain", 0.2)
    wet.weeping([(22.2, 2.6, 0.6, 0.4), (21.4, 2.3, 0.45, 0.35)], 3, 2.2, Water(5.8, 0.12, 0.05, film=0.4), "calcite curtain")
    wet.run(8.05, 2.0, 3.0, 0.30, Water(6.5, 0.10, 0.04), "beside drain", 0.2)
    wet.seam([(25.2, 4.2), (25.2, 1.2), (25.25, -1.4)], 0.32, Water(5.2, 0.12, 0.05, 0.02), "wet joint", 0.04)
    wet.patch(
        [(16.9, 0.3, 0.9, 0.6), (17.6, -0.2, 0.6, 0.6), (16.4, -0.4, 0.5, 0.4)],
        Water(3.2, 0.45, 0.08, halo=0.25),
        "crown seepage",
    )
    wet.weeping([(10.7, -4.7, 0.7, 0.4), (11.4, -4.9, 0.5, 0.35)], 4, 1.7, Water(5.0, 0.15, 0.06, halo=0.25, fringe=1.5))
    wet.foot(1.0, 13.6, 18.6, foot, foot - 0.7, 0.3, Water(4.5, 0.2, 0.06))
    wet.patch([(29.0, 4.6, 0.8, 0.4), (29.6, 5.0, 0.5, 0.45)], Water(4.8, 0.12, 0.06, 0.09))
    wet.seam([(1.0, -2.2), (2.2, -3.1), (3.0, -4.6)], 0.18, Water(4.4, 0.07, 0.03), "wet crack", 0.06)
    wet.drips([(5.6, 0.4), (12.3, -0.7), (19.9, 0.6), (30.9, -0.5)], 0.16, Water(4.6, 0.06, 0.02))
    solids = (
        *fittings.rack(rng, wall(2.2), 5, 32.0, 0.12, 1.5, 0.04),
        *fittings.pipe(-wall(1.1), 0.08, 32.0, -3.0),
        *fittings.lamps(-wall(3.1), 4.0, 10.0, 3),
        Downpipe(15.2, -wall(4.6), -wall(0.1), 0.03, 0.075, -2.5),
        Downpipe(20.8, 0.9, wall(0.1), 0.03, 0.075, -2.5),
        WallBox(27.4, -wall(1.9), 0.6, 0.8, 0.02, 0.26, -3.5),
        fittings.trough(-3.72),
        *rails(-1.9),
        *rails(1.9),
        *fittings.catenary(-1.9, 5.2, 6.0, 9.0, 16.0, 2),
    )
    line = Alignment((512_860.1, 5_288_437.4, 626.8), 0.31, -1 / 560, 0.009)
    scanner = Instrument(0.00025, 30.0, 4.0, 0.18, 0.4, threshold=-7.0, range_noise=0.0012)
    stations = Stations(((5.0, -0.3, 1.7), (15.6, 1.6, 1.7), (26.2, -0.2, 1.7)), 1450.0)
    write(folder, Tunnel(line, section, canvas, solids), scanner, stations, rng)


def cast_relining(folder: Path) -> None:
    """Relining cast in blocks of eight metres with wet construction joints; oblique profiles, 785 nm."""
    rng = np.random.default_rng(20205)
    section = Section(6.3, (Piece(4.32, 2.75), Piece(4.1, 14.0)), 2.6)
    canvas = Canvas(35.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    whole = canvas.whole()
    linings.lay(canvas, whole, linings.cast(rng, whole, -3.4))
    joints = (2.4, 10.4, 18.4, 26.4, 34.4)
    marks = Marks(canvas, rng)
    marks.soot((0.0,), 1.3, 1.1, noted=False)
    marks.grime(1.0, foot, 1.9, 1.4)
    marks.grime(-1.0, foot, 1.9, 1.7)
    marks.blotch([(6.4, 1.6, 0.8, 0.5), (7.1, 1.9, 0.5, 0.4)], 1.5, "mortar repair", 0.03, 0.04)
    marks.blotch([(21.0, -3.9, 0.6, 0.45)], -1.4, "mortar repair", 0.03, 0.04)
    marks.painted(12.3, 13.1, wall(2.4), wall(1.9), 1.8, "painted number", 0.15)
    marks.painted(28.9, 31.0, -wall(1.9), -wall(0.8), -2.4, "graffiti", 0.25)
    marks.lime(18.5, 2.3, 1.9, 0.3, 2.2, 3, "calcite")
    marks.lime(26.3, -3.0, 1.4, 0.3, 2.0, 3, "calcite")
    marks.lime(14.6, 3.2, 1.3, 0.3, 1.9, 2, "calcite")
    for s, t in ((5.2, -2.4), (15.7, 2.5), (23.0, -2.6), (32.2, 2.7)):
        marks.stain(s, t, 1.3, 0.12, 2.0, "rust")
    for s in (4.0, 16.0, 28.0):
        marks.blotch([(s, 0.3, 0.5, 0.25)], -1.8, "soot of arcing", 0.2, 0.05)
    wet = Moisture(canvas, rng)
    wet.seam([(joints[1], -0.7), (joints[1], -4.4)], 0.30, Water(3.8, 0.10, 0.04), "wet construction joint", 0.02)
    wet.seam(
        [(joints[2], 0.5), (joints[2], 2.9), (joints[2] + 0.05, 5.4)],
        0.24,
        Water(4.4, 0.08, 0.04),
        "wet construction joint",
        0.03,
    )
    wet.seam([(joints[3], -2.6), (joints[3], -0.2)], 0.40, Water(3.2, 0.16, 0.06), "wet construction joint", 0.03)
    wet.weeping(
        [(joints[3], 3.0, 0.35, 0.5), (joints[3] + 0.4, 3.3, 0.4, 0.3)],
        3,
        1.5,
        Water(3.6, 0.14, 0.05),
        "wet construction joint",
    )
    wet.seam([(19.6, 3.3), (22.3, 3.34)], 0.18, Water(3.0, 0.08, 0.03), "wet lift joint", 0.02)
    wet.run(13.8, -2.1, 2.6, 0.26, Water(3.6, 0.07, 0.03, film=0.4), "run", 0.18)
    wet.seam([(29.6, 1.2), (30.5, 2.2), (30.9, 3.4)], 0.20, Water(3.4, 0.07, 0.03), "wet crack", 0.06)
    wet.patch([(24.2, 0.3, 0.8, 0.45), (23.6, -0.1, 0.5, 0.4)], Water(2.4, 0.4, 0.08, halo=0.2), "crown seepage")
    wet.foot(-1.0, 5.6, 9.6, foot, foot - 0.55, 0.24, Water(2.8, 0.2, 0.05))
    wet.patch([(7.2, -4.1, 0.4, 0.35), (7.5, -3.8, 0.3, 0.3)], Water(3.2, 0.18, 0.06, fringe=1.2), "gravel nest")
    wet.drips([(9.2, 0.4), (20.4, 0.5)], 0.15, Water(3.0, 0.06, 0.02))
    solids = (
        *fittings.rack(rng, -wall(2.0), 3, 35.0, 0.10, 1.0, 0.02),
        *fittings.pipe(wall(0.9), 0.06, 35.0, -2.5),
        *fittings.lamps(wall(2.8), 3.5, 10.0, 4),
        WallBox(6.0, wall(3.4), 0.2, 0.7, 0.0, 0.5, -4.5, every=12.0, count=3),
        Beam(0.1, 5.15, 0.08, 0.11, -3.0),
        Beam(0.32, 5.7, 0.07, 1.2, -4.0, 4.0, 0.07, 12.0, 3),
        Beam(0.2, 5.28, 0.3, 0.07, -4.0, 4.0, 0.07, 12.0, 3),
        WallBox(20.0, -wall(1.2), 0.5, 0.7, 0.02, 0.24, -2.5),
        *rails(0.0),
    )
    line = Alignment((466_031.6, 5_552_690.8, 302.4), -2.2, 0.0, -0.011)
    scanner = Instrument(0.00038, -12.0, 1.5, 0.22, 0.15, 0.25, 0.40, -46.0, 0.01, 0.0010, True)
    drive = Drive(0.06, 2.3, 0.0155, 1150, turned=0.52, rate=50.0)
    write(folder, Tunnel(line, section, canvas, solids), scanner, drive, rng)
