"""Brick against frost and under a deck: ice guards, drainage channels, jack arches."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import fittings, linings
from .alignment import Alignment
from .arrays import FloatArray
from .canvas import CELL, Canvas, Window
from .instrument import Instrument
from .marks import Marks
from .moisture import Moisture, Water
from .noise import ramp, smooth
from .output import write
from .section import Piece, Section
from .solids import Downpipe, WallBox, rails
from .stances import Stations
from .tracing import Tunnel


def ice_guards(folder: Path) -> None:
    """Electrified double track under a brick vault with sheets against ice over the wires and drainage channels."""
    rng = np.random.default_rng(20206)
    section = Section(6.25, (Piece(4.014, 4.6), Piece(2.094, 3.0), Piece(3.1, 25.0)), 2.7)
    canvas = Canvas(36.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    linings.lay(canvas, canvas.whole(), linings.brickwork(rng, canvas.whole(), -4.9, 0.8, 0.05, 0.6))
    joints = linings.lengths(rng, canvas, 4.0, 5.5, 0.4, 0.45)
    marks = Marks(canvas, rng)
    marks.soot((-2.1, 1.9), 2.6, 1.2, flaked=0.25)
    marks.grime(1.0, foot, 1.5, 1.5)
    marks.grime(-1.0, foot, 1.5, 1.8)
    for s, t0, t1 in ((7.4, 2.6, wall(0.1)), (16.0, -wall(0.1), -2.4), (23.2, 2.9, wall(0.1)), (31.0, -wall(0.1), -3.0)):
        marks.chase(s, t0, t1, 0.2, 1.6)
    marks.rebuilt(10.2, 12.2, -6.0, -4.0, -6.6, "recasing in engineering brick", 0.4)
    marks.rebuilt(26.4, 28.6, 3.3, 5.6, -3.9, "recasing in new brick", 0.7)
    marks.sprayed_patch([(19.9, -5.4, 1.1, 0.7)], -3.5)
    marks.pointed([(13.8, 5.2, 1.3, 0.8)], 1.6)
    for s, t in ((4.9, 4.0), (21.3, 4.9), (33.3, -4.6), (17.4, -3.7)):
        marks.blotch([(s, t, 0.3, 0.18), (s + 0.25, t + 0.2, 0.2, 0.15)], 2.0, "spalled face", 0.02)
    marks.lime(7.0, 3.1, 1.9, 0.35, 3.2, 3)
    marks.lime(31.4, -3.5, 1.5, 0.4, 3.0, 3)
    marks.stain(24.6, -3.9, 1.5, 0.15, 2.2, "soot washed down")
    marks.niche(29.0, wall(-0.1), wall(1.9))
    wet = Moisture(canvas, rng)
    wet.run(7.62, 3.0, 3.4, 0.34, Water(5.6, 0.07, 0.03, 0.03, film=0.4), "beside drainage channel", 0.22)
    wet.weeping(
        [(15.5, -3.4, 0.5, 0.45), (15.2, -4.1, 0.3, 0.5)], 2, 1.5, Water(4.8, 0.12, 0.05, 0.07), "beside drainage channel"
    )
    wet.weeping(
        [(3.0, -2.6, 0.8, 0.45), (3.7, -2.9, 0.5, 0.4)], 3, 1.4, Water(5.0, 0.15, 0.06, 0.07, halo=0.25), "beside ice guard"
    )
    wet.patch([(9.9, 2.2, 0.9, 0.5), (10.7, 2.6, 0.6, 0.5)], Water(5.2, 0.14, 0.06, 0.07), "beside ice guard")
    wet.seam([(joints[4], -3.2), (joints[4], -0.6), (joints[4], 1.9)], 0.30, Water(5.0, 0.09, 0.04, 0.05), "wet ring joint")
    wet.patch([(19.4, 4.1, 0.9, 0.45), (20.2, 4.4, 0.6, 0.5)], Water(4.4, 0.2, 0.07, 0.08, fringe=1.8))
    wet.run(23.0, 3.2, 2.2, 0.30, Water(8.0, 0.06, 0.03, 0.02, film=0.5), "run", 0.2)
    wet.patch([(29.3, 0.4, 0.8, 0.6), (30.0, 0.0, 0.5, 0.5)], Water(4.2, 0.3, 0.08, 0.08, halo=0.25), "crown seepage")
    wet.foot(1.0, 31.6, 35.2, foot, foot - 0.6, 0.25, Water(4.4, 0.18, 0.05, 0.07))
    wet.seam([(25.6, -5.1), (28.7, -5.15)], 0.17, Water(3.6, 0.07, 0.02, 0.03), "wet bed joint")
    wet.drips([(17.6, 0.8), (22.3, -0.5), (33.8, 0.6)], 0.16, Water(4.2, 0.06, 0.02))
    solids = (
        WallBox(5.4, -0.1, 5.6, 3.9, 0.20, 0.215, -4.5, corrugation=0.018),
        WallBox(14.6, 0.4, 4.2, 3.4, 0.20, 0.215, -4.0, corrugation=0.018),
        WallBox(2.9, -0.1, 0.06, 4.0, 0.0, 0.2, -6.0, every=1.0, count=6),
        *fittings.rack(rng, -wall(2.1), 4, 36.0, 0.11, 1.5),
        *fittings.rack(rng, wall(2.6), 2, 36.0, 0.12, 2.0, 0.06),
        Downpipe(12.9, 1.6, wall(0.1), 0.07, 0.055, -3.0),
        WallBox(21.0, wall(1.3), 0.7, 1.0, 0.02, 0.35, -3.5),
        fittings.trough(3.5),
        *rails(-1.9),
        *rails(1.9),
        *fittings.catenary(-1.9, 5.0, 5.85, 8.6, 12.0, 3),
        *fittings.catenary(1.9, 5.0, 5.85, 8.6, 12.0, 3),
    )
    line = Alignment((693_274.9, 5_348_611.7, 712.5), 1.55, 1 / 420, -0.014)
    scanner = Instrument(0.00042, 27.0, 2.6, 0.2, 0.3, speckle=0.5, threshold=-8.0, quantum=0.1, range_noise=0.0016)
    places = ((4.2, 1.7, 1.65), (13.4, -1.6, 1.65), (22.6, 1.5, 1.65), (31.8, -1.6, 1.65))
    write(folder, Tunnel(line, section, canvas, solids), scanner, Stations(places, 780.0, 18.0), rng)


def _jack_arches(rng: np.random.Generator, window: Window, bay: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Small brick arches that span between iron girders across the tunnel. Returns the same as a fabric of `linings`."""
    turned = Window(window.columns, window.rows, window.t, window.s)
    albedo, relief, units = (part.T.copy() for part in linings.brickwork(rng, turned, -4.7, 0.8, 0.06))
    x = np.abs((window.s + bay / 2) % bay - bay / 2)[:, None]
    across = (bay / 2 - x) / (bay / 2 - 0.15)
    relief = relief - 0.22 * (1 - np.minimum(across, 1) ** 2)
    girder = ramp((0.15 - x) / 0.01)
    rust = 0.5 * smooth(rng, window.shape, CELL, 0.3) + 0.4 * smooth(rng, window.shape, CELL, 0.06)
    albedo = albedo * (1 - girder) + girder * (-6.6 + rust)
    relief = relief * (1 - girder) + girder * 0.03
    return albedo.astype(np.float32), relief.astype(np.float32), units


def covered_way(folder: Path) -> None:
    """Cut-and-cover box: brick walls, jack arches between girders; no curve of the scanner at hand."""
    rng = np.random.default_rng(20208)
    section = Section(5.4, (Piece(4.3), Piece(5.9, corner=90.0)), 2.5)
    canvas = Canvas(24.0, section.half)
    foot, wall = section.wall(0.0), section.wall
    linings.lay(canvas, canvas.whole(), linings.brickwork(rng, canvas.whole(), -4.3, 1.0, 0.1))
    linings.lengths(rng, canvas, 6.0, 8.0, 0.35, 0.25)
    deck = canvas.window(0.0, 24.0, -4.06, 4.06)
    linings.lay(canvas, deck, _jack_arches(rng, deck, 1.6))
    marks = Marks(canvas, rng)
    x = np.abs((deck.s + 0.8) % 1.6 - 0.8)[:, None]
    marks.note("iron girder", deck, np.broadcast_to(ramp((0.15 - x) / 0.01), deck.shape))
    marks.soot((-1.9, 1.9), 3.0, 1.2, noted=True)
    marks.grime(1.0, foot, 1.7, 1.8)
    marks.grime(-1.0, foot, 1.5, 1.5)
    marks.painted(0.4, 8.2, wall(3.4), wall(0.9), 1.8, "limewash", 0.3)
    marks.rebuilt(14.2, 16.4, -wall(0.9), -wall(3.0), -6.1, "recasing in engineering brick", 0.5)
    marks.pointed([(11.0, wall(2.6), 1.3, 0.8)], 1.6)
    for s, t in ((1.7, -wall(4.9)), (9.7, wall(4.9)), (17.7, -wall(4.9)), (20.9, wall(4.8))):
        marks.stain(s, t, 1.5, 0.22, 1.9, "rust")
    marks.lime(6.2, -wall(5.2), 1.7, 0.5, 3.2, 4)
    marks.lime(19.0, wall(5.1), 1.5, 0.4, 3.0, 3)
    for s, t in ((3.9, -wall(2.4)), (18.2, wall(3.6)), (21.7, -wall(1.6))):
        marks.blotch([(s, t, 0.3, 0.2), (s + 0.2, t + 0.15, 0.2, 0.15)], 2.2, "spalled face", 0.02)
    marks.painted(17.0, 19.4, wall(1.9), wall(0.9), -2.6, "graffiti", 0.25)
    marks.painted(9.0, 9.9, -wall(2.2), -wall(1.5), 2.6, "painted number", 0.2)
    wet = Moisture(canvas, rng)
    top = wall(5.25)
    wet.weeping(
        [(3.4, top + 0.1, 1.1, 0.25), (4.5, top + 0.1, 0.7, 0.2)], 6, 2.4, Water(4.8, 0.12, 0.05, 0.07), "wet deck joint"
    )
    wet.run(6.4, -top, 2.4, 0.36, Water(6.0, 0.07, 0.03, 0.03, film=0.3), "wet deck joint", 0.2)
    wet.weeping([(12.2, -top - 0.1, 1.0, 0.25)], 5, 1.9, Water(5.0, 0.1, 0.05, 0.06, fringe=1.8), "wet deck joint")
    wet.patch([(8.8, 1.0, 0.35, 0.9), (8.75, 0.2, 0.3, 0.5)], Water(5.0, 0.14, 0.05, 0.05), "wet jack arch")
    wet.patch([(16.8, -2.8, 0.34, 0.8)], Water(4.4, 0.16, 0.05, 0.05), "wet jack arch")
    wet.patch([(13.6, 3.3, 0.36, 0.7), (13.7, 2.6, 0.25, 0.5)], Water(4.8, 0.14, 0.05, 0.05), "wet jack arch")
    wet.patch([(13.2, wall(2.2), 0.9, 0.5), (13.9, wall(1.8), 0.6, 0.5)], Water(4.2, 0.25, 0.07, 0.08, halo=0.25))
    wet.run(21.6, wall(4.2), 3.0, 0.32, Water(6.3, 0.06, 0.03, 0.03, film=0.3), "run", 0.2)
    wet.foot(-1.0, 17.6, 21.4, foot, foot - 0.65, 0.25, Water(4.4, 0.2, 0.05, 0.07))
    solids = (
        *fittings.rack(rng, -wall(2.6), 6, 24.0, 0.12, 1.2, 0.03),
        *fittings.pipe(wall(3.9), 0.09, 24.0, -4.5),
        *fittings.lamps(-wall(4.3), 2.0, 8.0, 3),
        Downpipe(10.4, wall(5.1), wall(0.1), 0.07, 0.055, -3.5),
        WallBox(15.6, wall(1.4), 0.8, 1.1, 0.02, 0.32, -3.5),
        WallBox(5.2, -wall(1.8), 0.4, 0.6, 0.01, 0.18, -2.5),
        fittings.trough(-3.9, 0.45, 0.3),
        *rails(-1.9),
        *rails(1.9),
    )
    line = Alignment((390_118.3, 5_819_560.6, 31.7), -0.48, 0.0, 0.003)
    scanner = Instrument(0.0003, -22.0, 2.2, 0.25, 0.35, speckle=0.4, threshold=-58.0, range_noise=0.0009, blends=True)
    stations = Stations(((4.4, -1.6, 1.75), (12.2, 1.7, 1.75), (19.8, -1.5, 1.75)), 1250.0, 18.0)
    tunnel = Tunnel(line, section, canvas, solids, 0.7)
    write(folder, tunnel, scanner, stations, rng, reference=False)
