"""An Austrian single-track tunnel of the 1900s, relined with shotcrete: no water at all, but soot, oil, rust and repairs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.round_08 import dressing
from benchmarks.blind.round_08.fittings import Fittings
from benchmarks.blind.round_08.scanner import Instrument, drive
from benchmarks.blind.round_08.surface import Surface, smoothstep
from benchmarks.blind.round_08.survey import Survey, make
from benchmarks.blind.round_08.tunnel import Array, Axis, horseshoe
from benchmarks.blind.scene import Scene

LENGTH = 38.0


def _law(reach: Array) -> Array:
    """Phase-based: rises to 2.5 m, falls slower than the square beyond."""
    return 28.0 - 17.0 * np.log10(reach / 2.5) + 10.0 * np.log10(1.0 - np.exp(-((reach / 1.5) ** 2)))


def _shotcrete(surface: Surface) -> None:
    """Rough shotcrete in passes, bays sprayed on other days, drainage half-pipes sprayed over."""
    section, rng = surface.section, surface.rng
    surface.relief += (0.022 * surface.noise(0.9, 0.7, octaves=3) + 0.003 * surface.noise(0.08, octaves=2)).astype(np.float32)
    surface.db += 0.45 * surface.noise(1.3, 0.9, octaves=4) + 0.4 * surface.noise(0.06, octaves=2)
    # Each pass of the nozzle left a band; rebound makes its lower rim coarser and darker.
    pass_height = 1.4
    phase = (surface.u + 0.12 * surface.wave(1.4) + 0.05 * surface.coarse) / pass_height
    surface.db += (0.35 * np.sin(2.0 * np.pi * phase) * surface.lining).astype(np.float32)
    edges = np.array([0.0, 5.2, 11.9, 17.6, 24.3, 31.0, LENGTH + 1.0])
    bay = np.searchsorted(edges, (surface.s + 0.08 * surface.coarse)[:, :], side="right") - 1
    surface.db += rng.normal(0.0, 0.45, edges.size + 1)[np.clip(bay, 0, edges.size)].astype(np.float32)
    for s in (8.4, 21.2, 33.9):
        # The bulge over a half-pipe that leads water down behind the shotcrete.
        swell = np.exp(-(((surface.s - s - 0.04 * surface.coarse) / 0.16) ** 2))
        surface.relief -= (0.06 * swell * surface.lining).astype(np.float32)
    dressing.soot(surface, 0.9, -1.8, "soot")
    dressing.foot_dust(surface, 1.3, -1.6)
    wall = smoothstep(1.0 - np.abs(surface.u - section.crown - 2.6) / 0.8)
    surface.db += (-0.5 * wall * (1.0 + 0.4 * surface.noise(1.5, 0.5))).astype(np.float32)


def _dirt(surface: Surface) -> None:
    """What is dark, and what is bright; all of it dry."""
    section = surface.section
    crown, lined = section.crown, section.lined
    # Where diesels stopped before the signal the plume is black.
    surface.stain("soot plume", surface.blob(14.6, crown - 0.4, 2.1, 0.8), -2.2, soft=0.7, ragged=0.08, mottle=0.25)
    surface.stain("soot plume", surface.blob(27.9, crown + 0.7, 1.1, 0.6), -1.8, soft=0.5, ragged=0.08, mottle=0.25)
    for s, u, fall, half in ((6.6, 2.9, 1.3, 0.06), (18.9, lined - 2.5, 1.6, 0.09), (30.3, 2.3, 1.0, 0.05)):
        surface.stain("oil", surface.run(s, u, fall, half, half * 0.7), -2.6, soft=0.05, ragged=0.02)
    for s, u in ((3.7, crown + 2.0), (12.8, crown - 2.3), (25.5, crown + 1.7), (35.2, crown - 1.8)):
        surface.stain("rust run", surface.run(s, u, 0.8, 0.03, 0.05), -1.9, soft=0.03, ragged=0.01)
    surface.stain("fresh shotcrete", surface.blob(9.9, lined - 2.0, 1.3, 0.9), -1.5, soft=0.1, ragged=0.09, mottle=0.2)
    surface.stain("fresh shotcrete", surface.blob(23.4, crown - 2.4, 1.2, 0.8), 1.9, soft=0.08, ragged=0.1, mottle=0.2)
    surface.stain("overspray", surface.blob(32.6, lined - 1.1, 1.0, 0.5), 1.3, soft=0.5, ragged=0.06)
    surface.stain("repair mortar", surface.panel(16.9, 17.8, 1.6, 2.2), -1.8, ragged=0.012, mottle=0.1)
    surface.stain("repair mortar", surface.panel(28.8, 29.3, lined - 2.9, lined - 2.1), 1.5, ragged=0.012, mottle=0.1)
    surface.stain("dried stain", surface.run(21.2, crown + 2.4, 2.5, 0.2, 0.15), -0.8, soft=0.15, ragged=0.05)
    surface.stain("efflorescence", surface.run(34.0, crown + 2.7, 1.3, 0.12, 0.05), 2.2, soft=0.05, ragged=0.04)
    surface.stain("efflorescence", surface.run(8.45, crown - 2.9, 0.9, 0.10, 0.04), 2.5, soft=0.05, ragged=0.04)
    surface.stain("bitumen", surface.blob(36.4, 1.9, 0.35, 0.22), -3.4, soft=0.03, ragged=0.05)
    for s, u0, u1 in ((5.2, crown - 3.0, crown + 2.2), (24.3, crown - 1.0, crown + 3.4)):
        joint = surface.seam(surface.crack((s, u0), (s + 0.05, u1), 0.05), 0.012, vary=0.3)
        surface.stain("bay joint", joint, -1.5, soft=0.02, ragged=0.006)
    crack = surface.seam(surface.crack((19.6, crown - 2.8), (21.0, crown + 0.6), 0.07), 0.007, vary=0.1)
    surface.stain("dry crack", crack, -1.5, soft=0.015)
    for s in (4.0, 14.0, 24.0, 34.0):
        dressing.mark(surface, "kilometre mark", s, section.place(2.0, 1), (0.45, 0.3), 2.8)
    for s in (11.0, 26.8):
        dressing.mark(surface, "sprayed mark", s, section.place(1.6, -1), (0.35, 0.35), -2.4)


def _fittings(axis: Axis, surface: Surface) -> Fittings:
    """Cables, contact rail in the crown, refuge signs, anchors' plates, trough, sleepers and rails."""
    fittings = Fittings(axis, surface.section)
    section, span = surface.section, (0.0, LENGTH)
    dressing.cable_rack(fittings, span, [section.place(v, -1) for v in (1.25, 1.4)], 0.023, -5.5, 1.6, off=0.1)
    dressing.cable_rack(fittings, span, [section.place(3.2, 1)], 0.02, -5.0, 1.6, off=0.08)
    fittings.box(span, (-0.04, 0.04), (4.75, 4.86), 0.5, gloss=0.6)
    for s in np.arange(3.0, LENGTH, 6.0):
        fittings.box((s - 0.05, s + 0.05), (-0.06, 0.06), (4.86, 5.7), -1.0, gloss=0.3)
    fittings.box(span, (2.0, 2.5), (-0.05, 0.3), -0.8)
    places = surface.rng.uniform(1.0, LENGTH - 1.0, 26), surface.rng.uniform(2.2, section.lined - 2.2, 26)
    for s, u in zip(*places, strict=True):
        fittings.mount((s - 0.08, s + 0.08), (u - 0.08, u + 0.08), (0.01, 0.035), -1.5, gloss=0.5)
    for s in (9.0, 29.0):
        fittings.mount((s, s + 0.4), (section.place(2.6, -1), section.place(2.6, -1) + 0.4), (0.02, 0.05), 6.0)
    for s in np.arange(0.3, LENGTH, 0.62):
        fittings.box((s - 0.12, s + 0.12), (-1.2, 1.2), (-0.1, 0.03), -1.0)
    fittings.rails(span, 0.0)
    return fittings


def build() -> Survey:
    """Everything of the scene."""
    axis = Axis((401_884.0, 5_220_940.0, 1173.5), 1.9, curvature=1.0 / 310.0, grade=0.024)
    section = horseshoe(2.85, 2.9, 2.6)
    surface = Surface(section, LENGTH, seed=80_801)
    _shotcrete(surface)
    _dirt(surface)
    dressing.ballast(surface, -2.8)
    surface.blur(0.007)
    instrument = Instrument(_law, speckle=0.6, floor=-6.0, drift=0.3, offsets=0.0, jitter=0.0015, mixed=0.5, exponent=0.7)
    sweep = drive(axis, LENGTH, 0.05, 2.4, 0.019, 1150, 1.4, seed=88)
    return Survey(axis, section, surface, _fittings(axis, surface), instrument, [sweep], 3300.0, reference=(4.0, 25.0))


def _make(folder: Path) -> None:
    """Write the scene."""
    make(build(), folder)


SCENE = Scene(
    name="alpine-shotcrete-dry",
    lining="shotcrete",
    phenomenon="none",
    description=(
        "Single track of 1906 relined with shotcrete over half-pipes, dry: soot plumes, oil, rust of anchors, "
        "shotcrete of other days, old stains that dried. Nothing in it is wet, as after most relinings of the "
        "Austrian main lines."
    ),
    make=_make,
)
