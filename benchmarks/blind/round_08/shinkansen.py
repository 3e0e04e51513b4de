"""A Shinkansen tunnel of the 1970s: cast arch placed before the side walls, scanned from a road-rail vehicle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, drive
from benchmarks.blind.round_08.surface import Surface
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, horseshoe
from benchmarks.blind.scene import Scene

LENGTH, BAY, FIRST = 40.0, 10.5, 4.2
# Height of the joint between the arch, which was cast first, and the side walls beneath it.
SPRINGING = 2.5


def _law(reach: Array) -> Array:
    """Phase-based with automatic gain: flatter than the square, a shallow hump at 4 m."""
    return 30.0 - 16.0 * np.log10(reach / 5.0) - 1.6 * np.exp(-(((reach - 1.5) / 1.3) ** 2))


def _concrete(surface: Surface) -> None:
    """Concrete, joints of bays, the joint at the springing, steel forms' panels, a cold joint."""
    section = surface.section
    dressing.concrete(surface, blotch=0.5, grain=0.3, streak=0.25)
    dressing.rings(surface, FIRST, BAY, half=0.012, depth=0.015, change=-2.0)
    for side in (-1, 1):
        u = section.place(SPRINGING, side) + 0.02 * surface.wave(1.5)
        dressing.groove(surface, np.abs(surface.u - u), 0.012, 0.01, -1.8)
    # Forms 1.5 m wide leave lips and a level of their own.
    sheet = np.floor(surface.s / 1.5).astype(int)
    surface.db += surface.rng.normal(0.0, 0.15, int(LENGTH / 1.5) + 2)[sheet].astype(np.float32)
    wall = surface.lining & (surface.height < SPRINGING)
    surface.db += np.where(wall, -0.5, 0.0).astype(np.float32)
    # Iron dust of wheels and wire settles on the lower wall.
    dressing.foot_dust(surface, 1.6, -1.4)
    dressing.soot(surface, 1.1, -0.7)


def _water(surface: Surface) -> None:
    """Leaks."""
    section = surface.section
    left, right, crown = section.place(SPRINGING, -1), section.place(SPRINGING, 1), section.crown

    def joint(number: int) -> float:
        return FIRST + number * BAY

    weep = surface.seam([(7.2, right), (9.6, right)], 0.08)
    for s, fall, half in ((7.5, 0.9, 0.16), (8.3, 1.6, 0.22), (9.2, 0.7, 0.12)):
        weep = np.maximum(weep, surface.run(s, right, fall, half, half * 0.7))
    surface.wet("wet joint", weep, 3.8, soft=0.07, ragged=0.03, mottle=0.3, salt=1.5)
    ring = surface.seam([(joint(1), crown + 2.2), (joint(1), crown + 6.2)], 0.12)
    surface.wet(
        "wet joint", np.maximum(ring, surface.blob(joint(1) + 0.1, crown + 5.2, 0.75, 1.3)), 4.6, soft=0.08, ragged=0.05
    )
    cold = surface.crack((18.4, crown - 4.6), (20.9, crown - 3.1), 0.05)
    inclined = surface.seam(cold, 0.09)
    for s, u, fall in ((18.7, crown - 4.4, 1.1), (19.8, crown - 3.75, 1.7)):
        inclined = np.maximum(inclined, surface.run(s, u, fall, 0.15, 0.07))
    surface.wet("cold joint", inclined, 3.1, soft=0.08, ragged=0.03, mottle=0.35, salt=1.0)
    comb = surface.blob(joint(2) - 0.5, crown - 2.1, 0.42, 0.55)
    surface.wet("honeycomb", comb, 5.2, soft=0.06, ragged=0.06, mottle=0.3)
    surface.wet("crown drip", surface.blob(12.1, crown + 0.25, 0.45, 0.36), 4.2, soft=0.08, ragged=0.04, salt=2.0)
    gutter = surface.run(27.35, right + 0.2, 2.3, 0.28, 0.42)
    surface.wet("drain", gutter, 4.4, soft=0.09, ragged=0.04, mottle=0.25, film=0.3)
    thin = surface.seam(surface.crack((33.2, crown + 3.4), (33.6, crown + 5.6), 0.05), 0.055)
    surface.wet("wet crack", thin, 2.7, soft=0.05)
    surface.wet("patch", surface.blob(36.9, left + 1.3, 1.7, 1.05), 2.6, soft=0.4, ragged=0.07, mottle=0.3)
    behind = np.maximum(surface.blob(2.6, left - 0.35, 0.4, 0.35), surface.run(2.6, left - 0.4, 1.3, 0.28, 0.18))
    surface.wet("drip", behind, 3.4, soft=0.07, ragged=0.03)
    small = surface.run(24.0, left + 0.8, 1.0, 0.07, 0.04)
    surface.wet("drip", small, 3.0, soft=0.04)
    surface.wet("wet joint", surface.seam([(joint(3), crown - 5.4), (joint(3), crown - 4.1)], 0.10), 2.9, soft=0.06)
    surface.wet(
        "patch",
        surface.blob(30.4, crown - 1.0, 0.8, 0.5),
        0.8,
        soft=0.3,
        ragged=0.05,
        limit="In the sooty crown, no darker than the soot's own clouds.",
    )


def _dry(surface: Surface) -> None:
    """Repairs, chalk, old stains, dry cold joint, plates."""
    section, crown = surface.section, surface.section.crown
    cold = surface.seam(surface.crack((14.6, crown + 2.0), (17.2, crown + 3.6), 0.06), 0.02, vary=0.3)
    surface.stain("dry cold joint", cold, -1.7, soft=0.02)
    # Resin mortar is darker than concrete, smooth, and has straight rims.
    for s, u, ds, du in ((10.6, crown - 3.0, 0.5, 0.35), (34.4, crown - 4.0, 0.8, 0.25), (22.6, crown + 4.7, 0.3, 0.6)):
        surface.stain("resin mortar", surface.panel(s - ds, s + ds, u - du, u + du), -1.9, soft=0.03, ragged=0.008, mottle=0.08)
    for s, u in ((5.7, crown + 1.6), (28.7, crown - 3.3)):
        surface.stain("fresh mortar", surface.blob(s, u, 0.45, 0.35), 1.8, soft=0.05, ragged=0.03)
    # Chalk of inspectors: outlines of hollow places and dates.
    for s, u, r in ((15.6, crown - 2.0, 0.35), (31.6, crown + 2.6, 0.5), (20.4, crown + 1.9, 0.3)):
        ring = 0.012 - np.abs(surface.blob(s, u, r, r * 0.8))
        surface.stain("chalk", ring, 1.5, soft=0.015)
    for s in (6.0, 16.0, 26.0, 36.0):
        dressing.mark(surface, "kilometre mark", s, section.place(1.9, 1), (0.5, 0.25), 2.4)
    dried = surface.run(13.0, section.place(3.6, -1), 1.9, 0.2, 0.1)
    surface.stain("dried stain", dried, -0.8, soft=0.12, ragged=0.04)
    surface.stain("efflorescence", surface.run(36.0, section.place(3.2, 1), 1.1, 0.14, 0.05), 2.4, ragged=0.04, soft=0.06)
    for s, low, high in ((11.9, 3.0, 5.6), (24.9, 1.0, 3.2)):
        crack = surface.seam(surface.crack((s, crown + low), (s - 0.3, crown + high), 0.05), 0.008, vary=0.1)
        surface.stain("dry crack", crack, -1.5, soft=0.02)
    surface.stain("grease", surface.run(32.2, section.place(4.5, -1), 0.8, 0.08, 0.03), -2.6, ragged=0.02)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Leaky coaxial cable, feeders, gutter, net of steel mesh, cable troughs, wire supports, slab tracks."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    for side in (-1, 1):
        dressing.cable_rack(fittings, span, [section.place(2.0, side)], 0.026, -6.0, 1.5, off=0.16)
        fittings.box(span, (4.05, 4.6) if side > 0 else (-4.6, -4.05), (-0.05, 0.42), -0.6)
        fittings.cable(span, section.crown + side * 2.4, 0.55, 0.014, -4.0)
        fittings.rails(span, side * 2.15)
        fittings.rod(span, side * 2.15, 5.0, 0.008, -2.0, gloss=0.5)
        for s in np.arange(5.0 + side, LENGTH, 10.0):
            fittings.box((s - 0.05, s + 0.05), (side * 2.15 - 0.05, side * 2.15 + 0.05), (5.1, 6.8), -0.5, gloss=0.3)
    # A gutter of plastic leads water of an old leak down to the trough.
    low, high = section.place(2.6, 1), section.place(0.5, 1)
    fittings.mount((26.85, 27.1), (low, high), (0.0, 0.06), 1.2, gloss=0.4)
    fittings.mount((18.0, 18.6), (section.place(1.1, -1) - 0.4, section.place(1.1, -1) + 0.4), (0.05, 0.3), -1.0)
    dressing.lamps(fittings, np.arange(7.0, LENGTH, 15.0), section.place(3.0, -1), (0.7, 0.12), (0.05, 0.15))
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((512_460.0, 5_402_118.0, 231.7), 2.31, curvature=-1.0 / 4000.0, grade=0.009)
    section = horseshoe(4.8, 2.3, 4.55)
    surface = Surface(section, LENGTH, seed=80_201, step=0.02)
    _concrete(surface)
    _dry(surface)
    _water(surface)
    dressing.slab(surface, -1.2)
    surface.blur(0.01)
    instrument = Instrument(
        _law, speckle=0.7, floor=2.0, drift=0.35, offsets=0.0, jitter=0.002, mixed=0.5, exponent=0.9, digit=0.05
    )
    sweep = drive(axis, LENGTH, -2.15, 2.3, 0.024, 1500, 2.2, seed=82)
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, [sweep], 2400.0, reference=(4.0, 25.0))


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="shinkansen-arch-first",
    lining="cast",
    phenomenon="horizontal joint, cold joint, gutter",
    description=(
        "Double-track arch of 1975 placed before its side walls: leaks at the joint of the springing, at joints of "
        "bays of 10.5 m, an inclined cold joint, honeycomb, an overrunning gutter, as in Japanese manuals on "
        "maintenance of railway tunnels."
    ),
    make=_make,
)
