"""A utility tunnel like a sewer: jacked concrete pipes with a heating main and cable trays, scanned by time of flight."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, station
from benchmarks.blind.round_08.surface import Surface
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, circle
from benchmarks.blind.scene import Scene

LENGTH, RADIUS, PIPE, FIRST = 26.0, 1.85, 3.0, 1.3


def _law(reach: Array) -> Array:
    """Time of flight: the receiver is out of focus near by, so that amplitude rises up to 4 m and then falls."""
    return 34.0 - 20.0 * np.log10(reach) + 20.0 * np.log10(1.0 - np.exp(-((reach / 2.6) ** 2)))


def _pipes(surface: Surface) -> None:
    """Spun concrete, joints between pipes with their bands, grout holes, tide mark of old floods."""
    section = surface.section
    dressing.concrete(surface, blotch=0.35, grain=0.35, streak=0.2)
    dressing.rings(surface, FIRST, PIPE, half=0.009, depth=0.015, change=-2.4)
    number = np.round((surface.s - FIRST) / PIPE)
    band = 0.09 - np.abs(surface.s - FIRST - number * PIPE)
    surface.stain(None, band * np.ones_like(surface.u), 0.6, soft=0.03, ragged=0.01)
    for start in np.arange(FIRST - PIPE, LENGTH, PIPE):
        for degrees in (-60.0, 0.0, 60.0):
            u = section.crown + RADIUS * float(np.radians(degrees))
            surface.stain(None, surface.blob(start + PIPE / 2, u, 0.035, 0.035), -1.5, soft=0.015)
    dressing.foot_dust(surface, 0.55, -1.3)


def _water(surface: Surface) -> None:
    """Leaks, most of them at joints of pipes."""

    def at(degrees: float) -> float:
        return surface.section.crown + RADIUS * float(np.radians(degrees))

    def joint(number: int) -> float:
        return FIRST + number * PIPE

    wide = surface.seam([(joint(0), at(-48)), (joint(0), at(-5))], 0.10)
    surface.wet("wet joint", np.maximum(wide, surface.blob(joint(0), at(-20), 0.3, 0.25)), 3.6, soft=0.06, salt=2.2)
    deep = surface.seam([(joint(2), at(8)), (joint(2), at(60))], 0.08)
    deep = np.maximum(deep, surface.run(joint(2), at(55), 0.8, 0.18, 0.12))
    surface.wet("wet joint", deep, 5.4, soft=0.05, film=0.4, salt=1.6)
    surface.wet(
        "grout hole",
        np.maximum(surface.blob(joint(3) + 1.5, at(-60), 0.13, 0.16), surface.run(11.8, at(-61), 0.7, 0.1, 0.06)),
        4.3,
    )
    surface.wet("crown drip", surface.blob(joint(4) + 0.12, at(4), 0.28, 0.2), 3.3, soft=0.07, ragged=0.03, salt=2.5)
    foot = np.minimum(surface.panel(15.2, 18.9, -0.2, 0.42) + 0.06 * surface.wave(0.8), 0.4)
    surface.wet("damp footing", foot, 3.0, soft=0.12, ragged=0.05, mottle=0.3)
    surface.wet("patch", surface.blob(20.9, at(-28), 0.85, 0.5), 2.8, soft=0.22, ragged=0.06, mottle=0.3)
    surface.wet("wet joint", surface.seam([(joint(7), at(-58)), (joint(7), at(-26))], 0.075), 2.9, soft=0.04, salt=1.2)
    crack = surface.crack((23.4, at(14)), (25.3, at(26)), 0.04)
    surface.wet("wet crack", np.maximum(surface.seam(crack, 0.06), surface.run(24.7, at(23), 0.55, 0.14, 0.07)), 3.7, soft=0.05)
    surface.wet("drip", surface.blob(6.1, at(-33), 0.12, 0.13), 4.0, soft=0.04)
    surface.wet(
        "salt fringe",
        surface.seam([(joint(5), at(-50)), (joint(5), at(-22))], 0.035),
        1.0,
        soft=0.06,
        salt=3.0,
        limit="A thread of damp between crusts of salt; the joint alone is as dark.",
    )


def _dry(surface: Surface) -> None:
    """Markings, mortar, rust, lubricant of the jacking, salts that are dry."""

    def at(degrees: float) -> float:
        return surface.section.crown + RADIUS * float(np.radians(degrees))

    surface.stain(
        "efflorescence", surface.seam([(FIRST + 3.0, at(-55)), (FIRST + 3.0, at(-15))], 0.07, vary=0.6), 2.6, ragged=0.02
    )
    surface.stain("efflorescence", surface.run(9.2, at(-40), 0.6, 0.1, 0.04), 2.8, ragged=0.03, soft=0.04)
    surface.stain("mortar", surface.panel(17.4, 18.1, at(-12), at(4)), 1.4, ragged=0.012)
    surface.stain("mortar", surface.panel(13.5, 14.0, at(36), at(52)), -1.8, ragged=0.012)
    surface.stain("bentonite", surface.blob(4.9, at(28), 0.45, 0.2), -1.3, soft=0.1, ragged=0.04)
    surface.stain("rust run", surface.run(19.5, at(20), 0.9, 0.035, 0.05), -2.0, soft=0.03)
    surface.stain("scorched", surface.blob(22.4, at(2), 0.5, 0.24), -2.6, soft=0.25, ragged=0.03)
    for s in (3.4, 10.2, 15.9, 22.2):
        dressing.mark(surface, "marking", s, at(-42), (0.3, 0.16), 1.9)
    for s in (7.4, 16.4):
        dressing.mark(surface, "marking", s, at(12), (0.5, 0.05), -3.5, written=False)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Heating main in foil, trays of cables, a small pipe, lamps, hangers."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    for height in (0.55, 1.02):
        fittings.rod(span, 1.32, height, 0.16, 0.8, gloss=2.5)
        for s in np.arange(1.0, LENGTH, 3.0):
            fittings.box((s - 0.04, s + 0.04), (1.15, 1.7), (height - 0.21, height - 0.16), -1.5, gloss=0.3)
    for height in (0.75, 1.1, 1.45):
        fittings.box(span, (-1.62, -1.34), (height, height + 0.02), -0.5, gloss=0.6)
        for number, h in enumerate((-1.58, -1.51, -1.44, -1.38)):
            fittings.rod(span, h, height + 0.045, 0.022, -5.0 - 0.6 * number)
    fittings.cable(span, section.crown + 1.25, 0.07, 0.028, -1.0, gloss=0.4)
    dressing.lamps(fittings, np.arange(2.6, LENGTH, 5.0), section.crown - 0.55, (0.6, 0.1), (0.02, 0.1))
    fittings.mount((9.9, 10.15), (section.crown + 0.7, section.crown + 0.95), (0.0, 0.12), 0.5)
    fittings.cable(span, section.crown - 0.47, 0.015, 0.009, -2.5)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((466_845.0, 5_247_330.0, 402.1), -0.45, grade=0.004)
    section = circle(RADIUS, 1.3)
    surface = Surface(section, LENGTH, seed=80_301, step=0.0125)
    _pipes(surface)
    _dry(surface)
    _water(surface)
    dressing.slab(surface, -1.5)
    surface.blur(0.005)
    instrument = Instrument(_law, speckle=0.45, floor=0.0, drift=0.15, offsets=0.15, jitter=0.0012, mixed=0.25, exponent=0.8)
    sweeps = [
        station(axis, s, h, 1.45, scan, 0.19)
        for scan, (s, h) in enumerate(((2.5, 0.0), (9.3, -0.1), (16.4, 0.05), (23.2, 0.0)), 1)
    ]
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, sweeps, 1900.0, reference=(3.1, 25.0))


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="utility-jacked-pipe",
    lining="pipe",
    phenomenon="joints with salts, behind pipes",
    description=(
        "Jacked pipes of 3.7 m inside with a heating main and cable trays, ranges of 1.5 to 3 m where the receiver of"
        " a time-of-flight scanner is out of focus. Joints weep between crusts of salt, the foot is damp; codes of "
        "sewers' inspection (EN 13508-2)."
    ),
    make=_make,
)
