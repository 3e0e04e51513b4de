"""Brick tunnels of the age of steam."""

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
from .solids import WallBox, rails
from .stances import Drive, Stations
from .tracing import Tunnel


def sooted_double_track(folder: Path) -> None:
    """Wide brick tunnel with two bands of soot, recased places and damp haunches."""
    rng = np.random.default_rng(20201)
    section = Section(6.6, (Piece(6.44, 4.1), Piece(3.1, 9.0)), 2.6)
    canvas = Canvas(34.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    linings.lay(canvas, canvas.whole(), linings.brickwork(rng, canvas.whole(), -4.6))
    joints = linings.lengths(rng, canvas, 3.3, 4.6, 0.35, 0.5)
    marks = Marks(canvas, rng)
    marks.soot((-2.0, 2.0), 4.6, 1.25, flaked=0.22)
    marks.grime(1.0, foot, 1.6, 1.6)
    marks.grime(-1.0, foot, 1.3, 1.9)
    marks.rebuilt(16.4, 18.6, 3.9, 6.2, -6.3, "recasing in engineering brick", 0.5)
    marks.rebuilt(1.0, 3.2, -6.6, -5.0, -3.5, "recasing in new brick", 0.7)
    marks.rebuilt(28.3, 30.1, 0.9, 3.6, -4.0, "recasing in new brick", 0.8)
    marks.pointed([(11.5, -4.9, 1.3, 0.7), (12.8, -5.5, 0.8, 0.5)], 1.9)
    marks.pointed([(31.6, 5.2, 1.2, 0.9)], 1.5)
    for s, t in ((7.5, 5.1), (14.1, -3.6), (24.2, -5.6), (20.7, 6.9)):
        marks.blotch([(s, t, 0.28, 0.18), (s + 0.3, t + 0.2, 0.2, 0.15)], 2.2, "spalled face", 0.02)
    marks.blotch([(26.9, 4.2, 0.22, 0.30)], -3.2, "bitumen", 0.03, 0.02)
    marks.stain(3.9, 3.4, 1.7, 0.16, 2.4, "soot washed down")
    marks.stain(21.6, -4.4, 1.4, 0.14, 2.0, "soot washed down")
    marks.lime(10.4, -3.9, 1.5, 0.5, 3.2)
    marks.niche(13.0, wall(-0.1), wall(1.9))
    marks.niche(25.6, -wall(-0.1), -wall(1.9))
    for s in (2.6, 6.8, 11.0, 15.2, 19.4, 23.6, 27.8, 32.0):
        marks.weephole(s, wall(0.75))
        marks.weephole(s + 1.3, -wall(0.75))
    wet = Moisture(canvas, rng)
    wet.weeping([(5.2, -4.3, 0.75, 0.42), (5.8, -4.7, 0.5, 0.4)], 4, 1.5, Water(5.0, 0.14, 0.07, 0.07, halo=0.22))
    wet.run(9.2, 3.5, 3.1, 0.34, Water(6.5, 0.05, 0.02, 0.02, film=0.5), source=0.22)
    wet.seam([(joints[3], -3.2), (joints[3], -6.4)], 0.26, Water(5.5, 0.08, 0.03, 0.04), "wet ring joint")
    wet.patch([(15.0, 0.2, 0.55, 0.42), (15.5, -0.2, 0.4, 0.3)], Water(4.5, 0.25, 0.07, 0.08, halo=0.25), "crown seepage")
    wet.patch([(20.6, 2.3, 0.6, 0.4), (21.1, 2.7, 0.35, 0.4)], Water(5.5, 0.12, 0.06, 0.06), "crown seepage")
    damp = Water(5.5, 0.1, 0.06, 0.08, 0.4, fringe=2.2)
    wet.weeping([(22.9, 5.3, 1.1, 0.5), (23.9, 5.6, 0.7, 0.45)], 5, 1.6, damp)
    wet.foot(-1.0, 27.4, 32.2, foot, foot - 0.55, 0.22, Water(4.2, 0.16, 0.05, 0.07))
    wet.run(19.4, wall(0.75), 0.9, 0.30, Water(7.0, 0.05, 0.02, film=0.4), "weephole run", 0.10)
    wet.run(30.9, -2.9, 2.0, 0.22, Water(5.0, 0.06, 0.02, 0.02), "run", 0.15)
    wet.seam([(9.6, -5.9), (12.2, -5.95)], 0.17, Water(3.6, 0.07, 0.02, 0.03), "wet bed joint")
    wet.drips([(6.9, 0.5), (7.6, -0.3), (26.2, 0.2), (32.6, -0.6)], 0.13, Water(4.0, 0.05, 0.02))
    solids = (
        *fittings.rack(rng, -wall(1.9), 4, 34.0),
        *fittings.pipe(wall(1.25), 0.055, 34.0),
        *fittings.lamps(wall(3.0), 3.0, 9.0, 4),
        WallBox(14.9, -wall(1.2), 0.55, 0.75, 0.02, 0.28, -3.5),
        WallBox(8.0, wall(2.1), 0.35, 0.35, 0.01, 0.02, -1.5, every=16.0, count=2),
        fittings.trough(3.55),
        *rails(-1.9),
        *rails(1.9),
    )
    line = Alignment((562_318.4, 5_701_246.9, 213.6), 0.62, 0.0, 0.004)
    scanner = Instrument(0.00027, 34.0, 3.2, 0.15, 0.35, threshold=-2.0, range_noise=0.0012)
    stations = Stations(((6.0, -1.7, 1.75), (17.0, 1.4, 1.75), (28.0, -1.5, 1.75)), 1450.0)
    write(folder, Tunnel(line, section, canvas, solids), scanner, stations, rng)


def dry_steam_bore(folder: Path) -> None:
    """Circular brick bore, black with soot, repaired in all manners, and dry."""
    rng = np.random.default_rng(20207)
    section = Section(5.0, (Piece(7.75, 2.9),), 2.1)
    canvas = Canvas(28.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    linings.lay(canvas, canvas.whole(), linings.brickwork(rng, canvas.whole(), -4.2, 1.1, 0.12))
    linings.lengths(rng, canvas, 2.7, 3.7, 0.45, 0.6)
    marks = Marks(canvas, rng)
    marks.soot((0.1,), 5.5, 2.1, flaked=0.3)
    marks.grime(1.0, foot, 1.2, 2.2)
    marks.grime(-1.0, foot, 1.4, 1.7)
    marks.rebuilt(4.2, 6.1, 2.2, 4.3, -6.2, "recasing in engineering brick", 0.5)
    marks.rebuilt(19.7, 21.4, -3.9, -1.6, -5.9, "recasing in engineering brick", 0.6)
    marks.rebuilt(11.2, 12.4, -1.0, 1.4, -3.8, "recasing in new brick", 0.8)
    marks.sprayed_patch([(15.2, 2.9, 1.2, 0.8), (16.2, 3.4, 0.7, 0.7)], -3.6)
    marks.sprayed_patch([(25.1, -3.1, 0.9, 0.9)], -5.2)
    marks.pointed([(8.3, -3.6, 1.4, 0.7)], 2.0)
    marks.pointed([(22.8, 3.7, 1.1, 0.6)], 1.7)
    for s, t, length in ((2.1, -2.5, 1.6), (9.6, 2.2, 2.1), (13.5, -2.3, 1.3), (18.0, 2.6, 1.7), (26.3, 2.3, 1.1)):
        marks.stain(s, t, length, float(rng.uniform(0.12, 0.30)), float(rng.uniform(1.8, 3.2)), "soot washed down")
    marks.blotch([(6.9, -2.8, 0.5, 0.4), (7.3, -3.1, 0.35, 0.4)], -2.6, "scorched brick", 0.15, 0.07)
    marks.blotch([(17.4, -3.6, 0.45, 0.3)], -3.4, "bitumen", 0.03, 0.03)
    marks.stain(17.3, -3.8, 0.7, 0.12, 3.2, "bitumen")
    marks.blotch([(23.6, -0.9, 0.7, 0.5), (24.3, -0.5, 0.5, 0.4)], -2.2, "soot of a standing engine", 0.3, 0.08)
    marks.lime(3.2, 2.8, 1.6, 0.5, 3.6, 4)
    marks.lime(20.6, 2.4, 2.2, 0.6, 4.0, 5)
    marks.lime(14.0, -3.0, 1.2, 0.35, 3.0, 3)
    for s, t in ((1.4, 3.3), (10.6, -1.5), (12.8, 3.9), (24.1, 2.1), (27.1, -2.4)):
        marks.blotch([(s, t, 0.25, 0.16), (s + 0.2, t - 0.2, 0.16, 0.14)], 3.0, "spalled face", 0.02)
    marks.painted(9.9, 11.0, wall(1.9), wall(1.0), 3.0, "limewash", 0.35)
    marks.painted(21.9, 23.6, -wall(1.7), -wall(0.9), -2.8, "graffiti", 0.25)
    solids = (
        *fittings.rack(rng, wall(1.5), 3, 28.0, 0.10, 1.2),
        *fittings.pipe(-wall(0.6), 0.04, 28.0),
        *fittings.lamps(-wall(2.7), 4.5, 10.0, 3),
        WallBox(13.2, wall(2.2), 0.3, 0.4, 0.01, 0.02, -1.5),
        WallBox(7.7, wall(1.2), 0.4, 0.55, 0.02, 0.22, -4.5),
        *rails(0.0),
    )
    line = Alignment((371_905.2, 5_623_870.3, 148.2), 2.41, 0.0, -0.007)
    scanner = Instrument(0.00035, -6.0, 1.6, 0.2, 0.4, speckle=0.45, threshold=-38.0, range_noise=0.0010, blends=True)
    drive = Drive(0.05, 1.9, 0.0150, 1040, rate=50.0)
    write(folder, Tunnel(line, section, canvas, solids), scanner, drive, rng)
