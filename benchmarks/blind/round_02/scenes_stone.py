"""Tunnels in stone and in rock."""

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
from .solids import Cable, Downpipe, Solid, WallBox, rails
from .stances import Drive, Stations
from .tracing import Tunnel


def ashlar_weepholes(folder: Path) -> None:
    """Single-track vault of sandstone blocks on a curve, drained by weepholes with their runs and lime."""
    rng = np.random.default_rng(20202)
    section = Section(5.9, (Piece(2.61, 2.3), Piece(1.484, 3.4), Piece(3.6, 20.0)), 2.5)
    canvas = Canvas(31.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    linings.lay(canvas, canvas.whole(), linings.ashlar(rng, canvas.whole(), -3.9, 1.2))
    joints = linings.lengths(rng, canvas, 6.0, 8.0, 0.4, 0.2)
    marks = Marks(canvas, rng)
    marks.soot((0.0,), 3.4, 1.5, flaked=0.15)
    marks.grime(1.0, foot, 1.0, 1.2)
    marks.grime(-1.0, foot, 1.0, 1.4)
    marks.rebuilt(12.6, 14.6, -1.1, 1.2, -5.6, "brick repair of the crown", 0.9)
    marks.rebuilt(26.4, 28.0, 3.9, 5.4, -5.0, "brick repair", 0.9)
    marks.pointed([(7.6, 4.6, 1.4, 0.9), (8.9, 5.0, 0.9, 0.7)], 1.5)
    for s, t in ((4.4, -3.2), (15.8, 3.7), (22.6, -4.4), (29.5, 2.9)):
        marks.blotch([(s, t, 0.35, 0.22), (s + 0.25, t + 0.15, 0.25, 0.2)], 1.8, "spalled face", 0.03)
    marks.blotch([(10.9, -5.4, 0.3, 0.2)], -2.6, "bitumen", 0.03, 0.02)
    marks.stain(18.8, 2.5, 1.9, 0.2, 2.2, "soot washed down")
    marks.stain(1.7, -2.6, 1.5, 0.16, 2.0, "soot washed down")
    holes = [(1.2 + 3.1 * k, side * wall(1.15)) for k in range(10) for side in (-1.0, 1.0)]
    for s, t in holes:
        marks.weephole(s, t, 0.05)
    for k in (1, 5, 8, 12, 15):
        s, t = holes[k]
        marks.lime(s, t + 0.05 * np.sign(t), 0.9, 0.28, 3.0, 3, "calcite")
    wet = Moisture(canvas, rng)
    running = Water(5.0, 0.05, 0.025, 0.02, film=0.6, halo=0.2)
    for k, drop in ((5, 6.5), (8, 4.0), (13, 5.5), (16, 3.2)):
        s, t = holes[k]
        wet.run(s + 0.04, t, 1.05, 0.30 + 0.02 * k, Water(drop, 0.06, 0.03, 0.02, film=0.4), "weephole run", 0.11)
    wet.run(6.1, 2.4, 3.2, 0.30, running, "run", 0.3)
    wet.seam([(joints[1], -2.0), (joints[1] + 0.05, -4.9)], 0.30, Water(4.8, 0.10, 0.04, 0.05), "wet ring joint", 0.04)
    wet.weeping([(18.2, -3.6, 0.9, 0.35), (19.0, -3.9, 0.6, 0.3)], 4, 1.3, Water(4.2, 0.16, 0.06, 0.10, halo=0.25), "springing")
    wet.patch([(14.9, 0.9, 0.45, 0.5), (15.3, 1.3, 0.35, 0.3)], Water(4.6, 0.2, 0.06, 0.07), "beside repair")
    wet.foot(1.0, 19.6, 24.4, foot, foot - 0.6, 0.25, Water(3.6, 0.2, 0.05, 0.08, halo=0.2))
    wet.seam([(23.6, -4.0), (26.2, -4.03)], 0.16, Water(4.0, 0.08, 0.03, 0.03), "wet bed joint", 0.015)
    wet.patch([(26.0, -1.7, 0.5, 0.35), (25.7, -2.1, 0.3, 0.4)], Water(3.4, 0.3, 0.08, 0.08, 0.5, fringe=1.6))
    wet.drips([(9.5, 0.3), (20.9, -0.4), (30.0, 0.5)], 0.16, Water(4.5, 0.06, 0.02))
    solids = (
        *fittings.rack(rng, wall(2.3), 3, 31.0, 0.10, 1.0, 0.03),
        *fittings.pipe(-wall(0.55), 0.045, 31.0, -5.0),
        *fittings.lamps(-wall(2.9), 5.0, 12.0, 3),
        WallBox(17.0, wall(1.5), 0.4, 0.6, 0.02, 0.2, -4.0),
        WallBox(3.0, -wall(1.8), 0.25, 0.35, 0.01, 0.02, -1.0, every=20.0, count=2),
        *rails(0.0),
    )
    line = Alignment((433_727.8, 5_389_154.2, 471.9), -1.07, 1 / 320, 0.012)
    scanner = Instrument(0.0003, 21.0, 1.7, 0.25, 0.3, speckle=0.35, threshold=-14.0, range_noise=0.0008, blends=True)
    drive = Drive(-0.08, 2.15, 0.0158, 960, rate=100.0)
    write(folder, Tunnel(line, section, canvas, solids), scanner, drive, rng)


def rock_behind_portal(folder: Path) -> None:
    """Unlined gneiss behind a ring of masonry at the portal; water on fractures; no curve of the scanner at hand."""
    rng = np.random.default_rng(20203)
    section = Section(5.9, (Piece(4.084, 2.6), Piece(3.9, 12.0)), 2.4)
    canvas = Canvas(30.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    whole = canvas.whole()
    linings.lay(canvas, whole, linings.rock(rng, whole, -4.6))
    canvas.relief -= np.float32(0.17)
    ring = canvas.window(0.0, 6.2, -section.half, section.half)
    linings.lay(canvas, ring, linings.ashlar(rng, ring, -3.6, 1.0, 0.014))
    marks = Marks(canvas, rng)
    marks.soot((0.1,), 3.6, 1.7, flaked=0.1)
    marks.grime(1.0, foot, 1.1, 1.0)
    marks.grime(-1.0, foot, 1.1, 1.3)
    marks.sprayed_patch([(14.6, -2.6, 1.4, 1.0), (15.7, -3.2, 0.9, 0.8)], -3.4, 0.04)
    marks.sprayed_patch([(21.3, 1.8, 1.1, 0.9)], -3.8, 0.04)
    marks.blotch([(9.3, 3.4, 0.9, 0.5), (10.1, 3.9, 0.6, 0.6)], -1.9, "dark mineral", 0.12, 0.1)
    marks.blotch([(23.8, -4.8, 0.7, 0.5)], -1.8, "dark mineral", 0.12, 0.1)
    marks.blotch([(18.7, 4.9, 0.8, 0.12), (19.6, 5.0, 0.7, 0.10)], 2.0, "quartz vein", 0.04, 0.03)
    marks.stain(12.7, 2.9, 1.6, 0.2, 2.0, "soot washed down")
    marks.lime(4.0, -3.3, 1.6, 0.4, 2.8, 3)
    marks.lime(17.3, 2.6, 1.8, 0.5, 3.4, 4)
    for s, t in ((1.5, wall(0.9)), (4.5, wall(0.9)), (1.9, -wall(0.9)), (4.9, -wall(0.9))):
        marks.weephole(s, t)
    wet = Moisture(canvas, rng)
    wet.seam([(7.6, -0.9), (8.3, -2.6), (8.9, -4.6)], 0.34, Water(5.5, 0.09, 0.05, 0.06, film=0.5), "wet fracture", 0.10)
    wet.seam([(11.2, 0.3), (12.0, 1.6), (12.6, 2.2)], 0.26, Water(5.0, 0.08, 0.04, 0.05), "wet fracture", 0.07)
    wet.run(10.9, 4.0, 2.3, 0.45, Water(5.8, 0.07, 0.04, 0.05, film=0.6), "run", 0.3)
    wet.weeping(
        [(16.9, -2.2, 0.5, 0.5), (17.2, -3.0, 0.4, 0.6)], 3, 1.8, Water(5.0, 0.12, 0.06, 0.06, fringe=1.5), "beside repair"
    )
    wet.seam([(6.2, -1.2), (6.2, -3.3)], 0.28, Water(5.0, 0.08, 0.04, 0.05), "wet ring joint", 0.03)
    wet.patch([(3.1, 3.0, 0.7, 0.45), (3.5, 3.5, 0.45, 0.5)], Water(4.6, 0.14, 0.06, 0.09, halo=0.2))
    wet.patch([(20.4, -0.5, 0.65, 0.5), (20.9, -0.9, 0.4, 0.5)], Water(4.8, 0.15, 0.07, 0.06), "crown seepage")
    wet.seam([(22.0, 3.4), (23.4, 4.3), (24.2, 5.3)], 0.38, Water(6.0, 0.10, 0.05, 0.07, film=0.3), "wet fracture", 0.09)
    wet.foot(-1.0, 18.4, 21.6, foot, foot - 0.7, 0.28, Water(4.0, 0.18, 0.06, 0.06))
    wet.patch([(27.2, 2.2, 0.5, 0.7), (27.5, 3.0, 0.4, 0.6)], Water(3.4, 0.3, 0.07, 0.06, halo=0.25))
    wet.drips([(9.8, -0.4), (14.2, 0.7), (24.9, 0.2)], 0.15, Water(4.5, 0.06, 0.03))
    solids: tuple[Solid, ...] = (
        Cable(wall(1.9), 0.12, 0.03, -6.5, 0.09, 2.4),
        Cable(wall(2.05), 0.12, 0.018, -5.0, 0.11, 2.4),
        Downpipe(5.6, -wall(2.6), -wall(0.1), 0.07, 0.05, -3.0),
        WallBox(3.2, -wall(1.9), 0.4, 0.5, 0.02, 0.2, -3.0),
        *rails(0.0),
    )
    line = Alignment((608_442.7, 5_237_718.5, 884.3), 2.93, 0.0, 0.018)
    scanner = Instrument(0.00032, 41.0, 3.6, 0.12, 0.45, threshold=4.0, range_noise=0.0018)
    stations = Stations(((3.6, 0.3, 1.8), (13.6, -0.4, 1.8), (24.2, 0.4, 1.8)), 1480.0, 18.0)
    tunnel = Tunnel(line, section, canvas, solids, 0.65)
    write(folder, tunnel, scanner, stations, rng, reference=False)
