"""A railway tunnel of 1857 through Karst limestone: vault and walls of ashlar, soot of a century, sinter and drips."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, station
from benchmarks.blind.round_08.surface import Surface
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, horseshoe
from benchmarks.blind.scene import Scene

LENGTH = 28.0


def _law(reach: Array) -> Array:
    """Time of flight with waveform digitised: nearly the square from 5 m, flat nearer."""
    return 38.0 - 10.0 * np.log10(reach**2 + 9.0)


def _stone(surface: Surface) -> None:
    """Ashlar in the vault, larger blocks in the walls, soot, a refuge that was walled up, patches of pointing."""
    section = surface.section
    low, high = section.place(2.2, -1), section.place(2.2, 1)
    surface.db += 0.45 * surface.noise(1.8, 1.2, octaves=4) + 0.4 * surface.noise(0.07, octaves=2)
    surface.relief += (0.02 * surface.noise(2.2, 1.4, octaves=2) + 0.003 * surface.noise(0.12, octaves=2)).astype(np.float32)
    dressing.masonry(surface, 0.42, 0.75, 0.5, -0.8, 0.009, 0.012, (0.0, low))
    dressing.masonry(surface, 0.34, 0.6, 0.55, -0.8, 0.008, 0.010, (low, high))
    dressing.masonry(surface, 0.42, 0.75, 0.5, -0.8, 0.009, 0.012, (high, section.lined))
    dressing.soot(surface, 1.7, -2.6, "soot")
    surface.db += -0.8 * np.clip(surface.noise(3.0, 2.0), -1.0, 1.5) * surface.lining
    # New pointing is brighter than the stones.
    for s, u, ds, du in ((6.0, 1.4, 1.3, 0.9), (20.5, section.lined - 2.6, 1.6, 1.1)):
        where = np.abs(surface.relief) < 0.012
        surface.stain("pointing", np.where(where, surface.blob(s, u, ds, du), -1.0), 1.0, ragged=0.05)
    refuge = surface.panel(15.1, 16.3, 0.0, 1.9)
    surface.stain("brick infill", refuge, -1.5, soft=0.03, mottle=0.3)
    dressing.foot_dust(surface, 0.9, -1.2)


def _water(surface: Surface) -> None:
    """Masonry that weeps, runs under sinter, drips with fringes of stalactites, a damp foot."""
    section = surface.section
    crown, lined = section.crown, section.lined
    wall = surface.blob(9.4, 2.3, 1.7, 1.0)
    for s, u, fall, half in ((8.5, 2.6, 1.7, 0.35), (9.7, 2.5, 2.0, 0.5), (10.6, 2.4, 1.4, 0.25)):
        wall = np.maximum(wall, surface.run(s, u, fall, half, half * 0.8, 0.08))
    surface.wet("masonry weeping", wall, 4.2, soft=0.12, ragged=0.09, mottle=0.35, film=0.2)
    joints = surface.seam([(3.0, lined - 3.3), (5.2, lined - 3.3)], 0.07)
    for s, fall in ((3.3, 0.8), (4.2, 1.5), (4.9, 0.6)):
        joints = np.maximum(joints, surface.run(s, lined - 3.3, fall, 0.13, 0.09))
    surface.wet("masonry weeping", joints, 3.3, soft=0.07, ragged=0.04, mottle=0.35, salt=1.8)
    surface.wet(
        "salt fringe", surface.seam([(13.0, crown + 2.1), (14.9, crown + 2.3)], 0.16), 3.9, soft=0.08, ragged=0.06, salt=3.2
    )
    surface.wet("crown drip", surface.blob(6.7, crown - 0.5, 0.42, 0.34), 3.6, soft=0.08, ragged=0.05, salt=3.0)
    surface.wet("crown drip", surface.blob(22.4, crown + 0.4, 0.55, 0.6), 4.6, soft=0.08, ragged=0.06, mottle=0.3, salt=2.4)
    run = np.maximum(surface.run(18.4, crown - 2.2, 4.2, 0.18, 0.4, 0.12), surface.run(18.1, crown - 3.8, 2.4, 0.12, 0.2, 0.1))
    surface.wet("drip", run, 5.6, soft=0.07, ragged=0.05, mottle=0.3, film=0.3, salt=1.4)
    foot = np.minimum(surface.panel(11.8, 14.4, lined - 0.8, lined + 0.3) + 0.2 * surface.wave(1.0), 0.6)
    surface.wet("damp footing", foot, 3.0, soft=0.18, ragged=0.08, mottle=0.3)
    surface.wet("patch", surface.blob(24.9, 2.0, 0.8, 0.6), 2.6, soft=0.25, ragged=0.09, mottle=0.3)
    surface.wet("patch", surface.blob(16.9, lined - 2.2, 0.45, 0.55), 3.4, soft=0.12, ragged=0.06)
    surface.wet("drip", surface.run(26.2, lined - 4.3, 2.3, 0.10, 0.16, 0.1), 4.4, soft=0.06, ragged=0.03)
    hole = np.maximum(surface.blob(1.6, 1.5, 0.16, 0.14), surface.run(1.6, 1.45, 1.2, 0.12, 0.2))
    surface.wet("drain", hole, 5.0, soft=0.05, ragged=0.03, film=0.4)
    surface.wet("drip", surface.blob(11.0, crown + 0.9, 0.12, 0.13), 3.4, soft=0.04)
    surface.wet("masonry weeping", surface.blob(21.3, crown - 3.2, 0.4, 0.3), 3.0, soft=0.1, ragged=0.06, mottle=0.4)
    surface.wet(
        "patch",
        surface.blob(16.2, crown - 0.3, 0.9, 0.7),
        0.7,
        soft=0.3,
        ragged=0.08,
        limit="Under thick soot, whose own differences are greater.",
    )
    surface.wet(
        "masonry weeping",
        surface.blob(27.0, 1.2, 0.6, 0.5),
        1.0,
        soft=0.25,
        ragged=0.08,
        limit="Nearly dried: single stones of the wall are as dark.",
    )


def _dry(surface: Surface) -> None:
    """Sinter, lichens' remains, dark stones, marks, rust."""
    section = surface.section
    crown, lined = section.crown, section.lined
    for s, u, fall, half in ((20.1, crown - 3.0, 2.6, 0.2), (7.9, crown + 2.6, 1.9, 0.25), (24.0, lined - 3.4, 1.2, 0.12)):
        surface.stain("sinter", surface.run(s, u, fall, half, half * 0.5, 0.1), 2.6, soft=0.07, ragged=0.06, mottle=0.3)
    surface.stain("soot blister", surface.blob(10.4, crown - 1.9, 0.5, 0.35), 2.0, soft=0.05, ragged=0.08)
    surface.stain("soot plume", surface.blob(4.4, crown - 2.5, 1.0, 0.5), -1.8, soft=0.4, ragged=0.06)
    for s, u in ((12.3, 1.3), (22.7, lined - 1.5), (5.0, 3.0), (18.6, lined - 2.9)):
        surface.stain("dark stone", surface.panel(s, s + 0.7, u, u + 0.38), -1.9, soft=0.02, ragged=0.006)
    for s in (2.5, 12.5, 22.5):
        dressing.mark(surface, "hectometre mark", s, section.place(1.8, 1), (0.5, 0.4), 3.0)
    surface.stain("rust run", surface.run(14.7, lined - 3.0, 0.9, 0.03, 0.05), -1.7, soft=0.03)
    surface.stain("cement patch", surface.panel(24.6, 25.8, crown + 1.9, crown + 2.7), 1.9, ragged=0.05)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Contact wire with its supports, one cable on hooks, trough, one track."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    for v, side in ((1.9, -1), (2.1, -1), (1.5, 1)):
        dressing.cable_rack(fittings, span, [section.place(v, side)], 0.02, -5.5, 2.0, off=0.09)
    fittings.box(span, (3.0, 3.5), (-0.05, 0.25), -0.8)
    fittings.rod(span, 0.2, 5.0, 0.007, -2.0)
    for s in (4.9, 15.6, 26.1):
        fittings.box((s - 0.06, s + 0.06), (0.1, 0.3), (5.1, 6.35), -1.0, gloss=0.3)
        fittings.box((s - 0.03, s + 0.03), (0.2, 1.9), (5.35, 5.41), -1.0, gloss=0.3)
    fittings.rails(span, 0.2, db=-2.5)
    fittings.mount((13.2, 13.7), (section.place(1.4, -1) - 0.35, section.place(1.4, -1) + 0.35), (0.02, 0.25), -1.0)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((769_120.0, 5_072_655.0, 571.3), 2.75, curvature=-1.0 / 380.0, grade=-0.011)
    section = horseshoe(4.0, 2.4, 3.8)
    surface = Surface(section, LENGTH, seed=80_601)
    _stone(surface)
    _dry(surface)
    _water(surface)
    dressing.ballast(surface, -2.5)
    surface.blur(0.008)
    instrument = Instrument(_law, speckle=0.45, floor=2.0, drift=0.15, offsets=0.2, jitter=0.002, mixed=0.15, exponent=0.75)
    places = ((3.0, -1.2), (10.4, 1.4), (17.8, -1.3), (25.2, 1.3))
    sweeps = [station(axis, s, h, 1.7, scan, 0.15) for scan, (s, h) in enumerate(places, 1)]
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, sweeps, 1150.0, reference=(4.4, 25.0))


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="karst-railway-ashlar",
    lining="stone",
    phenomenon="masonry weeping, sinter, soot",
    description=(
        "Ashlar of limestone from 1857, one track left of two. Walls weep from their joints, water runs beneath "
        "sinter, drips carry fringes of stalactites; soot, dark stones, new pointing; as in the inspection reports on"
        " the lines over the Karst."
    ),
    make=_make,
)
