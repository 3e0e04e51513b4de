"""A mountain road tunnel of the 1980s: cast inner lining over a thin sprayed membrane that leaks here and there."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, station
from benchmarks.blind.round_08.surface import Surface, smoothstep
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, horseshoe
from benchmarks.blind.scene import Scene

LENGTH, BLOCK, FIRST = 30.0, 12.5, 3.4


def _law(reach: Array) -> Array:
    """Time of flight, 1550 nm: the square, softened by a logarithmic receiver, and less close by."""
    return 44.0 - 17.0 * np.log10(reach) + 10.0 * np.log10(1.0 - np.exp(-((reach / 2.4) ** 2)))


def _lining(surface: Surface) -> None:
    """Blocks, board marks of the formwork, cold seams of concreting, paint on the walls, exhaust."""
    section = surface.section
    dressing.concrete(surface, blotch=0.5, grain=0.3, streak=0.3)
    dressing.rings(surface, FIRST, BLOCK, half=0.015, depth=0.02, change=-2.2)
    sheet = np.floor((surface.u - section.crown) / 1.25).astype(int)
    surface.db += surface.rng.normal(0.0, 0.2, sheet.max() - sheet.min() + 1)[sheet - sheet.min()].astype(np.float32)
    # Layers of concreting show as faint bent lines in each block.
    layer = surface.height + 0.12 * surface.wave(4.0)
    surface.db += 0.25 * np.sin(layer * 9.0 + 2.0 * surface.coarse).astype(np.float32) * surface.lining
    dressing.soot(surface, 1.9, -1.3)
    painted = smoothstep((3.0 - surface.height) / 0.03 + 0.5) * surface.lining
    worn = 1.0 - 0.35 * smoothstep(surface.noise(0.6, 0.4) - 0.8)
    surface.db += painted * 2.2 * worn
    surface.gloss += 0.5 * painted
    dressing.foot_dust(surface, 1.2, -2.6)


def _water(surface: Surface) -> None:
    """Leaks at block joints, of the crown, at the foot, out of cracks."""
    section = surface.section
    crown, lined = section.crown, section.lined
    second, third = FIRST + BLOCK, FIRST + 2 * BLOCK
    ring = surface.seam([(FIRST, crown - 5.6), (FIRST, crown - 0.4)], 0.13)
    for u, fall, half in ((crown - 1.2, 2.4, 0.35), (crown - 2.9, 2.9, 0.75)):
        ring = np.maximum(ring, surface.run(FIRST + 0.12, u, fall, half, half * 0.8))
    surface.wet("wet joint", ring, 4.4, soft=0.08, ragged=0.04, mottle=0.3, salt=1.6)
    surface.wet(
        "wet joint", surface.seam([(second, crown + 2.6), (second, crown + 5.2)], 0.08), 3.1, soft=0.06, ragged=0.03, salt=1.8
    )
    comb = np.maximum(surface.blob(8.3, crown + 0.5, 0.9, 0.55), surface.blob(9.2, crown + 0.9, 0.5, 0.5))
    surface.wet("honeycomb", comb, 4.0, soft=0.1, ragged=0.09, mottle=0.35, salt=1.2)
    surface.wet("crown drip", surface.blob(19.8, crown - 0.3, 0.26, 0.24), 5.3, soft=0.05, ragged=0.03, salt=2.2)
    surface.wet("crown drip", surface.blob(24.6, crown + 0.1, 0.19, 0.21), 3.6, soft=0.05, ragged=0.02)
    foot = np.minimum(surface.panel(11.2, 15.2, -0.3, 0.75) + 0.18 * surface.wave(0.9), 0.6)
    surface.wet("damp footing", foot, 3.4, soft=0.14, ragged=0.06, mottle=0.3)
    crack = surface.crack((21.2, crown + 3.0), (23.2, crown + 5.0), 0.06)
    seeps = surface.seam(crack, 0.08)
    for s, u, fall in ((21.9, crown + 3.8, 2.0), (22.9, crown + 4.7, 1.9)):
        seeps = np.maximum(seeps, surface.run(s, u, fall, 0.16, 0.10))
    surface.wet("wet crack", seeps, 3.6, soft=0.07, ragged=0.03, mottle=0.3)
    surface.wet("patch", surface.blob(17.6, crown - 4.2, 1.1, 0.75), 2.5, soft=0.3, ragged=0.08, mottle=0.35)
    niche = surface.run(27.0, 3.3, 2.9, 0.15, 0.5)
    surface.wet(
        "drain", np.maximum(niche, surface.blob(27.1, 0.5, 0.8, 0.45)), 4.8, soft=0.08, ragged=0.04, mottle=0.25, film=0.4
    )
    surface.wet("patch", surface.blob(5.9, crown + 4.1, 0.4, 0.5), 2.8, soft=0.12, ragged=0.05)
    surface.wet("drip", surface.run(third - 0.6, lined - 3.8, 0.9, 0.06, 0.05), 3.0, soft=0.04)
    surface.wet(
        "patch",
        surface.blob(14.2, crown - 0.9, 0.8, 0.6),
        0.9,
        soft=0.3,
        ragged=0.06,
        limit="In the exhaust on the crown, no darker than its own clouds.",
    )


def _dry(surface: Surface) -> None:
    """Repairs, dried stains, marks, rust, injection."""
    section = surface.section
    crown, lined = section.crown, section.lined
    surface.stain("repair mortar", surface.panel(12.0, 13.1, crown + 1.6, crown + 2.5), -1.7, ragged=0.012)
    surface.stain("repair mortar", surface.blob(26.4, crown - 2.7, 0.6, 0.4), 1.7, soft=0.05, ragged=0.04)
    surface.stain("dried stain", surface.run(20.5, crown - 3.0, 2.2, 0.18, 0.12), -0.9, soft=0.12, ragged=0.05)
    surface.stain(
        "efflorescence",
        surface.seam([(FIRST + BLOCK, crown - 4.4), (FIRST + BLOCK, crown - 2.4)], 0.10, vary=0.7),
        2.3,
        ragged=0.04,
    )
    surface.stain("efflorescence", surface.run(10.0, crown + 3.6, 1.2, 0.12, 0.05), 2.6, soft=0.05, ragged=0.04)
    for s in np.arange(18.6, 20.8, 0.3):
        # Packers of an injection along a closed crack, each in a smear of resin.
        surface.stain(
            "injection", surface.blob(s, crown + 1.4 + 0.05 * np.sin(7.0 * s), 0.07, 0.09), -2.4, soft=0.03, ragged=0.02
        )
    surface.stain("rust run", surface.run(7.3, 3.6, 1.0, 0.03, 0.05), -2.3, soft=0.03)
    surface.stain("rubber mark", surface.seam([(17.5, lined - 0.8), (20.7, lined - 0.95)], 0.05, vary=0.7), -3.0, ragged=0.02)
    surface.stain("burnt", surface.blob(28.9, lined - 1.4, 0.5, 0.9), -3.2, soft=0.35, ragged=0.06)
    for s in (4.6, 17.0, 29.4):
        dressing.mark(surface, "distance mark", min(s, LENGTH - 0.5), section.place(2.2, -1), (0.7, 0.35), -2.4)
    crack = surface.seam(surface.crack((7.0, crown - 5.0), (7.5, crown - 2.0), 0.06), 0.009, vary=0.1)
    surface.stain("dry crack", crack, -1.6, soft=0.02)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Jet fans, lamps on their trays, emergency cabinets, signs, raised walkways, crash marks' reflectors."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    for side in (-1, 1):
        tray = section.crown + side * 2.0
        fittings.mount(span, (tray - 0.13, tray + 0.13), (0.22, 0.28), -0.5, gloss=0.6)
        dressing.lamps(fittings, np.arange(2.0, LENGTH, 5.0), tray, (0.9, 0.34), (0.28, 0.42))
        for s in np.arange(1.0, LENGTH, 2.5):
            fittings.mount((s - 0.02, s + 0.02), (tray - 0.02, tray + 0.02), (0.0, 0.22), -0.5)
        inner, outer = (3.75, 4.5) if side > 0 else (-4.5, -3.75)
        fittings.box(span, (inner, outer), (0.0, 0.18), -0.8)
        fittings.box((15.6, 18.2), (side * 1.0 - 0.36, side * 1.0 + 0.36), (4.95, 5.65), -1.0, gloss=0.4)
    cable = section.place(3.35, 1)
    dressing.cable_rack(fittings, span, [cable, cable + 0.11], 0.022, -5.5, 1.25, off=0.07)
    fittings.mount((24.0, 24.8), (section.place(1.7, 1), section.place(0.7, 1)), (0.0, 0.22), -2.5, gloss=0.6)
    fittings.mount((10.6, 11.0), (section.place(1.9, -1), section.place(2.6, -1)), (0.02, 0.07), 6.0)
    for s in np.arange(3.0, LENGTH, 6.0):
        fittings.mount((s - 0.05, s + 0.05), (section.place(0.7, -1), section.place(0.85, -1)), (0.0, 0.03), 9.0)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((618_392.0, 5_173_506.0, 1312.8), -2.2, curvature=1.0 / 450.0, grade=0.032)
    section = horseshoe(4.6, 1.9, 4.5)
    surface = Surface(section, LENGTH, seed=80_501, step=0.018)
    _lining(surface)
    _dry(surface)
    _water(surface)
    dressing.slab(surface, -2.0)
    surface.blur(0.009)
    instrument = Instrument(_law, speckle=0.5, floor=8.0, drift=0.2, offsets=0.35, jitter=0.0015, mixed=0.2, exponent=0.9)
    places = ((2.6, 1.2), (10.2, -1.4), (18.8, 1.3), (27.0, -1.0))
    sweeps = [station(axis, s, h, 1.75, scan, 0.15) for scan, (s, h) in enumerate(places, 1)]
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, sweeps, 1050.0, reference=(5.2, 25.0))


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="mountain-road-membrane",
    lining="cast",
    phenomenon="block joints, honeycomb, footing",
    description=(
        "Cast lining in blocks of 12.5 m over a thin sprayed membrane, painted to 3 m, under jet fans. Block joints "
        "with salts, honeycomb and drips in the crown, damp foot above a clogged drain, as described by PIARC and in "
        "the Alps' road inspections."
    ),
    make=_make,
)
