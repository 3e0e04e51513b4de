"""A German underground station of the 1970s: wall cladding half taken off, the cast lining behind it come to light."""

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

LENGTH, BLOCK, FIRST = 30.0, 8.8, 5.1
# Stretches of the platform wall where panels still hang, and their height above the rail.
CLAD, PANEL_FOOT, PANEL_HEAD = ((0.0, 7.2), (22.8, 30.0)), 1.15, 3.55


def _law(reach: Array) -> Array:
    """Phase-based of the first generation: a bump where gain is switched, then the square."""
    return (
        36.0
        - 20.0 * np.log10(np.maximum(reach, 3.2) / 3.2)
        - 1.2 * np.maximum(3.2 - reach, 0.0)
        + 0.8 * np.exp(-((reach - 6.5) ** 2))
    )


def _lining(surface: Surface) -> None:
    """Concrete that was never meant to be seen: boards, shades of blocks, dabs of glue, dust lines of the panels."""
    section = surface.section
    dressing.concrete(surface, blotch=0.5, grain=0.35, streak=0.3)
    dressing.rings(surface, FIRST, BLOCK, half=0.012, depth=0.015, change=-2.0)
    board = np.floor(surface.height / 0.14).astype(int)
    shade = surface.rng.normal(0.0, 0.18, (board.max() + 1, 12)).astype(np.float32)
    surface.db += np.where(surface.height < 4.0, shade[board, np.floor(surface.s / 2.9).astype(int)], 0.0).astype(np.float32)
    # The wall that the cladding covered stayed clean; above it brake dust of fifty years.
    behind = (surface.u > section.crown) & (surface.height > PANEL_FOOT) & (surface.height < PANEL_HEAD)
    dusty = np.where(behind, 0.0, -1.1 * smoothstep((5.4 - surface.height) / 2.0)) * surface.lining
    surface.db += (dusty * (1.0 + 0.2 * surface.noise(2.0, 0.8))).astype(np.float32)
    surface.db += np.where(section.at(surface.u[0])[1][None, :] > 4.6, 1.4, 0.0) * surface.lining
    for s in np.arange(7.8, 22.5, 1.2):
        for height in (1.4, 2.35, 3.3):
            if surface.rng.random() < 0.75:
                u = section.place(height, 1) + surface.rng.normal(0.0, 0.03)
                glue = surface.blob(s + surface.rng.normal(0.0, 0.03), u, 0.09, 0.075)
                surface.stain("glue", glue, surface.rng.choice([-2.4, -1.9, 1.2]), soft=0.02, ragged=0.015)


def _water(surface: Surface) -> None:
    """What the panels hid, and what comes through above and on the side of the track."""
    section = surface.section
    crown, right = section.crown, section.lined
    second, third = FIRST + BLOCK, FIRST + 2 * BLOCK

    def wall(height: float, side: int = 1) -> float:
        return section.place(height, side)

    joint = np.maximum(
        surface.seam([(second, wall(3.9)), (second, wall(1.2))], 0.16), surface.run(second + 0.3, wall(2.8), 1.6, 0.5, 0.3)
    )
    surface.wet("wet joint", joint, 4.8, soft=0.07, ragged=0.05, mottle=0.35, salt=1.6)
    sheet = surface.blob(18.6, wall(2.3), 1.5, 0.75)
    for s, fall, half in ((17.7, 1.2, 0.25), (19.2, 1.3, 0.4)):
        sheet = np.maximum(sheet, surface.run(s, wall(2.2), fall, half, half))
    surface.wet("patch", sheet, 3.1, soft=0.3, ragged=0.09, mottle=0.35)
    anchors = np.maximum(surface.blob(10.2, wall(2.9), 0.14, 0.14), surface.run(10.2, wall(2.9), 1.2, 0.1, 0.06))
    surface.wet("drip", anchors, 4.0, soft=0.05)
    half_hidden = np.maximum(surface.blob(22.6, wall(3.3), 0.9, 0.45), surface.run(22.3, wall(3.2), 1.5, 0.3, 0.22))
    surface.wet("wet joint", half_hidden, 3.6, soft=0.1, ragged=0.05)
    surface.wet("crown drip", surface.blob(4.3, crown + 1.6, 0.5, 0.42), 3.4, soft=0.1, ragged=0.06, salt=2.0)
    surface.wet(
        "wet joint", surface.seam([(third, crown - 3.2), (third, crown + 0.8)], 0.11), 3.9, soft=0.07, ragged=0.04, salt=1.2
    )
    track = np.maximum(surface.blob(12.4, wall(2.4, -1), 0.5, 0.4), surface.run(12.4, wall(2.3, -1), 1.9, 0.35, 0.25))
    surface.wet("drip", track, 5.2, soft=0.07, ragged=0.04, film=0.3)
    foot = np.minimum(surface.panel(24.6, 27.0, -0.3, 0.6) + 0.14 * surface.wave(0.8), 0.5)
    surface.wet("damp footing", foot, 2.8, soft=0.15, ragged=0.06)
    crack = surface.crack((6.4, crown - 4.4), (8.3, crown - 3.2), 0.06)
    surface.wet("wet crack", surface.seam(crack, 0.07), 2.8, soft=0.05, ragged=0.02)
    surface.wet("patch", surface.blob(16.1, crown + 2.4, 0.36, 0.3), 2.6, soft=0.14, ragged=0.05)
    surface.wet(
        "patch",
        surface.blob(12.0, right - 2.1, 0.5, 0.35),
        0.9,
        soft=0.3,
        ragged=0.06,
        limit="Among boards' shades and dabs of glue that are as dark.",
    )


def _dry(surface: Surface) -> None:
    """Formwork oil, mortar, marks of builders, plugs, soot of a lamp."""
    section = surface.section
    crown = section.crown

    def wall(height: float, side: int = 1) -> float:
        return section.place(height, side)

    surface.stain("formwork oil", surface.blob(15.6, wall(3.0), 0.5, 0.28), -1.7, soft=0.06, ragged=0.06)
    surface.stain("formwork oil", surface.run(20.9, wall(3.2), 1.1, 0.12, 0.05), -1.6, soft=0.05, ragged=0.03)
    surface.stain("mortar", surface.panel(8.6, 9.5, wall(2.2), wall(1.6)), 1.9, ragged=0.02)
    surface.stain("mortar", surface.panel(26.2, 27.5, crown - 3.4, crown - 2.6), -1.6, ragged=0.015)
    surface.stain("levelling line", surface.seam([(7.3, wall(2.0)), (22.7, wall(2.0))], 0.012, vary=0.1), -2.4, soft=0.02)
    for s, height, side in ((11.0, 2.6, 1), (19.8, 3.3, 1), (17.0, 2.1, -1)):
        dressing.mark(surface, "sprayed mark", s, wall(height, side), (0.6, 0.25), -2.2)
    surface.stain("scorched", surface.blob(10.6, crown - 1.2, 0.7, 0.3), -1.8, soft=0.3, ragged=0.05)
    surface.stain("old paint", surface.panel(0.5, 4.2, wall(2.9, -1), wall(3.3, -1)), 2.3, ragged=0.01)
    surface.stain("rust run", surface.run(21.6, wall(2.3), 0.8, 0.03, 0.05), -2.1, soft=0.03)
    surface.stain("dried stain", surface.run(3.2, wall(2.4, -1), 1.6, 0.25, 0.15), -0.8, soft=0.15, ragged=0.05)
    dressing.foot_dust(surface, 0.8, -1.0)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Panels and their rails, platform, band of lamps, loudspeakers, signs, cables at the track's wall, third rail."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    rng = np.random.default_rng(807)
    face = 4.1
    for start, end in CLAD:
        for s in np.arange(start, end - 0.05, 0.9):
            for low in np.arange(PANEL_FOOT, PANEL_HEAD - 0.1, 0.8):
                if rng.random() < 0.93:
                    fittings.box(
                        (s + 0.006, s + 0.894), (face, face + 0.03), (low + 0.006, low + 0.794), 2.0 + rng.normal(0, 0.25), 1.5
                    )
    for height in (1.25, 2.35, 3.45):
        fittings.box(span, (face + 0.05, face + 0.09), (height - 0.02, height + 0.02), 0.8, gloss=0.6)
    for s in np.arange(0.9, LENGTH, 1.8):
        if rng.random() < 0.8:
            fittings.box((s - 0.02, s + 0.02), (face + 0.09, face + 0.13), (PANEL_FOOT, PANEL_HEAD), 0.8, gloss=0.6)
    fittings.box(span, (1.5, 4.7), (-0.05, 0.96), -0.4)
    fittings.box(span, (1.48, 1.8), (0.955, 0.965), 2.2)
    for s in np.arange(0.0, LENGTH - 0.5, 3.0):
        fittings.box((s + 0.1, s + 2.9), (2.0, 2.25), (4.05, 4.2), 2.0, gloss=0.4)
        fittings.rod((s + 0.1, s + 0.13), 2.1, 4.9, 0.01, 0.0)
    fittings.box((13.0, 15.2), (2.6, 2.68), (3.3, 3.75), 3.0, gloss=0.5)
    for s in (6.0, 24.0):
        fittings.mount((s, s + 0.3), (section.crown + 3.2, section.crown + 3.5), (0.0, 0.25), 0.5)
    cables = [section.place(v, -1) for v in (0.75, 0.9, 1.05, 1.2)]
    dressing.cable_rack(fittings, span, cables, 0.025, -5.5, 1.0, off=0.13)
    fittings.mount((20.0, 20.7), (section.place(1.5, -1), section.place(2.4, -1)), (0.0, 0.3), -0.5)
    fittings.box(span, (-1.65, -1.5), (0.1, 0.3), 0.8)
    fittings.rails(span, 0.0)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((692_655.0, 5_335_020.0, 503.2), 0.15, grade=0.0)
    section = horseshoe(4.75, 2.3, 4.55)
    surface = Surface(section, LENGTH, seed=80_701, step=0.018)
    _lining(surface)
    _dry(surface)
    _water(surface)
    dressing.ballast(surface, -3.0)
    surface.blur(0.009)
    instrument = Instrument(
        _law, speckle=0.8, floor=9.0, drift=0.35, offsets=0.4, jitter=0.0025, mixed=0.6, exponent=0.95, digit=0.05
    )
    places = ((3.4, 2.6), (10.6, -0.3), (18.2, 2.4), (26.0, -0.4))
    sweeps = [station(axis, s, h, 2.5 if h > 1.0 else 1.7, scan, 0.15) for scan, (s, h) in enumerate(places, 1)]
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, sweeps, 1100.0)


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="station-cladding-off",
    lining="cast",
    phenomenon="behind cladding",
    description=(
        "A station's platform wall: enamelled panels in front of both ends, their rails and dabs of glue where they "
        "were taken off. Joints and patches that the panels hid, one of them still by half; drips at the track. As in"
        " reports on refurbishment."
    ),
    make=_make,
)
