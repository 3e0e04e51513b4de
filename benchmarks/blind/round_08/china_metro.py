"""A Chinese metro tunnel driven by a shield: straight-jointed rings of six segments, scanned from a trolley."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, drive
from benchmarks.blind.round_08.surface import Surface
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, circle
from benchmarks.blind.scene import Scene

LENGTH, RADIUS, RING, FIRST = 36.0, 2.75, 1.2, 0.55
# Joints between segments, as angles from the crown to the right: key, two neighbours, two standard segments, invert.
JOINTS = np.radians([-8.0, 8.0, 73.0, -73.0])


def _law(reach: Array) -> Array:
    """Phase-based: the optics give less near the scanner, the far branch falls with the square."""
    return 22.0 - 20.0 * np.log10(reach / 3.0) + 10.0 * np.log10(1.0 - np.exp(-((reach / 2.1) ** 2)))


def _segments(surface: Surface) -> None:
    """Concrete of segments, joints, bolt pockets and lifting holes."""
    section = surface.section
    dressing.concrete(surface, blotch=0.35, grain=0.25, streak=0.15)
    dressing.rings(surface, FIRST, RING, half=0.006, depth=0.012, change=-2.2)
    for angle in JOINTS:
        u = section.crown + RADIUS * angle
        dressing.groove(surface, np.abs(surface.u - u) * np.ones_like(surface.s), 0.007, 0.012, -2.0)
    ring = np.arange(-1, int(LENGTH / RING) + 1)
    for start in FIRST + ring * RING:
        for angle in np.radians([-100.0, -55.0, -24.0, 24.0, 55.0, 100.0]):
            u = section.crown + RADIUS * angle
            # Pockets of the bolts stand at both rims of a segment; most were closed with mortar.
            for rim in (0.13, RING - 0.13):
                pocket = surface.panel(start + rim - 0.08, start + rim + 0.08, u - 0.07, u + 0.07)
                if surface.rng.random() < 0.6:
                    surface.stain(None, pocket, surface.rng.normal(0.7, 0.4), soft=0.02)
                else:
                    surface.stain("bolt pocket", pocket, -1.6, soft=0.02)
                    surface.relief += np.where(pocket > 0, 0.03, 0.0).astype(np.float32)
        for angle in np.radians([-86.0, -40.0, 40.0, 86.0]):
            plug = surface.blob(start + RING / 2, section.crown + RADIUS * angle, 0.04, 0.04)
            surface.stain(None, plug, surface.rng.normal(-1.5, 0.6), soft=0.02)


def _water(surface: Surface) -> None:
    """Wet joints, seeping holes, and what comes of them."""

    def at(degrees: float) -> float:
        return surface.section.crown + RADIUS * float(np.radians(degrees))

    def joint(number: int) -> float:
        return FIRST + number * RING

    ring = surface.seam([(joint(3), at(22)), (joint(3), at(76))], 0.09)
    surface.wet("wet joint", np.maximum(ring, surface.run(joint(3), at(70), 1.1, 0.16, 0.08)), 4.2, soft=0.06, salt=1.4)
    long = surface.seam([(joint(6) + 0.05, at(-73)), (joint(8) - 0.2, at(-73))], 0.07)
    spread = np.maximum(long, surface.run(joint(7) - 0.3, at(-73), 1.0, 0.5, 0.26))
    surface.wet("wet joint", spread, 3.4, soft=0.07, mottle=0.3)
    cross = np.maximum(surface.blob(joint(10), at(73), 0.24, 0.3), surface.run(joint(10) + 0.02, at(76), 0.9, 0.18, 0.12))
    surface.wet("wet joint", cross, 5.1, soft=0.05, film=0.5, salt=1.0)
    hole = np.maximum(surface.blob(joint(12) + 0.6, at(40), 0.16, 0.17), surface.run(joint(12) + 0.6, at(42), 1.5, 0.10, 0.05))
    surface.wet("lifting hole", hole, 4.4, soft=0.04)
    surface.wet("lifting hole", surface.blob(joint(15) + 0.6, at(-40), 0.21, 0.26), 2.8, soft=0.1, mottle=0.3)
    crown = surface.seam([(joint(17) + 0.1, at(8)), (joint(18) + 0.3, at(8))], 0.10)
    surface.wet("crown drip", np.maximum(crown, surface.blob(joint(18), at(4), 0.35, 0.4)), 3.0, soft=0.09, salt=1.2)
    low = np.maximum(surface.seam([(joint(20), at(64)), (joint(20), at(96))], 0.13), surface.blob(joint(20), at(86), 1.1, 0.6))
    surface.wet("damp footing", low, 3.2, soft=0.12, ragged=0.04)
    surface.wet("wet joint", surface.seam([(joint(22), at(-60)), (joint(22), at(-25))], 0.055), 2.7, soft=0.05)
    surface.wet("patch", surface.blob(joint(24) + 0.7, at(53), 0.75, 0.6), 2.6, soft=0.18, ragged=0.05, mottle=0.3)
    shoulder = np.maximum(surface.blob(joint(26), at(-20), 0.28, 0.32), surface.run(joint(26) + 0.05, at(-25), 2.3, 0.14, 0.10))
    surface.wet("drip", shoulder, 5.6, soft=0.05, film=0.3)
    surface.wet("wet joint", surface.seam([(joint(28), at(14)), (joint(28), at(50))], 0.045), 2.5, soft=0.04)
    surface.wet("drip", surface.blob(joint(14), at(-8), 0.11, 0.1), 3.4, soft=0.04)
    surface.wet(
        "patch",
        surface.blob(joint(2) + 0.6, at(-48), 0.4, 0.35),
        0.9,
        soft=0.25,
        limit="Nearly dry: no darker than the clouds of cement paste on the segments about it.",
    )


def _dry(surface: Surface) -> None:
    """What is dark or bright and dry."""

    def at(degrees: float) -> float:
        return surface.section.crown + RADIUS * float(np.radians(degrees))

    for s, degrees, half in ((5.0, 35.0, 0.3), (13.6, -30.0, 0.22), (21.9, 25.0, 0.35), (30.0, 60.0, 0.25)):
        surface.stain("caulking", surface.panel(s - half, s + half, at(degrees) - 0.14, at(degrees) + 0.14), 1.8, ragged=0.01)
    # Grease and hydraulic oil of the shield, dull by now.
    surface.stain("oil", surface.run(17.1, at(50), 1.0, 0.09, 0.03), -3.0, soft=0.04, ragged=0.02)
    surface.stain("oil", surface.blob(9.5, at(-62), 0.2, 0.16), -2.4, soft=0.05, ragged=0.02)
    for s in np.arange(1.2, LENGTH, 12.0):
        dressing.mark(surface, "ring number", s, at(52), (0.4, 0.22), 2.6)
    for s in np.arange(7.2, LENGTH, 9.6):
        surface.stain("steel plate", surface.panel(s, s + 0.35, at(62), at(66)), -2.8, soft=0.015)
    for s, low, high in ((11.9, -30, 15), (27.3, 12, 42)):
        line = surface.seam(surface.crack((s, at(low)), (s + 0.25, at(high)), 0.03), 0.006, vary=0.1)
        surface.stain("dry crack", line, -1.4, soft=0.012)
    surface.stain("rust run", surface.run(25.2, at(38), 0.8, 0.03, 0.05), -1.6, soft=0.03)
    dressing.foot_dust(surface, 1.0, -1.0)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Cables, hydrant pipe, walkway, lamps, contact wire support, track."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    dressing.cable_rack(fittings, span, [section.place(v, 1) for v in (1.15, 1.33, 1.51, 1.69)], 0.024, -6.0, 1.2)
    dressing.cable_rack(fittings, span, [section.place(v, -1) for v in (1.9, 2.08, 2.26)], 0.03, -5.0, 1.2)
    h, v, *_ = section.at(np.array(section.place(0.6, 1)))
    fittings.rod(span, float(h) - 0.16, float(v), 0.075, -1.5, gloss=0.5)
    fittings.box(span, (-2.7, -1.85), (0.85, 0.97), -0.5)
    dressing.lamps(fittings, np.arange(3.1, LENGTH, 6.0), section.place(3.1, -1), (1.2, 0.14), (0.03, 0.13))
    for s in (8.3, 24.7):
        fittings.mount((s, s + 0.5), (section.place(2.0, 1), section.place(2.0, 1) + 0.6), (0.02, 0.25), -0.5)
    for s in np.arange(2.0, LENGTH, 8.0):
        fittings.mount((s - 0.1, s + 0.1), (section.crown - 0.12, section.crown + 0.12), (0.0, 0.22), -2.0, gloss=0.4)
    fittings.box(span, (-0.03, 0.03), (4.30, 4.38), 0.5, gloss=0.4)
    fittings.rails(span, 0.0)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((684_210.0, 5_331_870.0, 492.4), 0.62, curvature=1.0 / 620.0, grade=-0.012)
    section = circle(RADIUS, 1.85)
    surface = Surface(section, LENGTH, seed=80_101)
    _segments(surface)
    _dry(surface)
    _water(surface)
    dressing.slab(surface, -1.5)
    surface.blur(0.006)
    instrument = Instrument(_law, speckle=0.55, floor=-16.0, drift=0.25, offsets=0.0, jitter=0.0012, exponent=0.85)
    sweep = drive(axis, LENGTH, 0.1, 1.75, 0.018, 1000, 1.1, seed=81)
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, [sweep], 3400.0, reference=(4.0, 25.0))


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="china-shield-metro",
    lining="segments",
    phenomenon="joints and lifting holes",
    description=(
        "Straight-jointed rings of 5.5 m inside, 1.2 m wide, scanned by a phase-based profile scanner on a trolley. "
        "Leaks at ring joints, T-joints and lifting holes, as in the leakage surveys of Shanghai's and Suzhou's "
        "metros; caulking, oil, numbers."
    ),
    make=_make,
)
