"""Haulage level of an old lead mine, open to visitors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas
from .field import static_survey
from .fittings import Cuboid, Fitting, Rod, hung, mounted
from .instrument import Instrument, Matt
from .section import Alignment, Section, arc
from .shapes import blot, rectangle, rising, runs, smooth, specks, stroke, wander
from .survey import Survey

LENGTH = 24.0
# Up to here the level is walled, behind it stands in the rock.
WALLED = 8.6


def _section() -> Section:
    return Section([(0.0, 0.0), (1.85, 0.0)], [(1.85, 0.0), (1.95, 1.5), *arc((0.0, 1.5), 1.95, 0, 90)[1:]])


def _fittings(section: Section) -> list[Fitting]:
    things = []
    for u in (11.2, 13.9, 16.6, 19.5):
        things += [Fitting(Rod((u, y, 0.0), (u + 0.06, 0.93 * y, 2.45), 0.09), -5.5) for y in (-1.62, 1.62)]
        things.append(Fitting(Rod((u, -1.65, 2.5), (u, 1.65, 2.47), 0.1), -5.0))
    things.append(Fitting(hung(section, 0, LENGTH, section.right(1.9), 0.012, 0.09, 1.1, 0.05), -10.0))
    things.append(Fitting(hung(section, 0, LENGTH, section.left(2.6), 0.045, 0.12, 3, 0.02), -6.0, 0.2))
    lamp = (0.24, 0.14, 0.12)
    things += [Fitting(mounted(section, u, section.right(2.0), lamp, 0.08), -3.0, 0.5) for u in np.arange(2.2, LENGTH, 4.4)]
    things += [Fitting(Rod((u, -1.1, 0.0), (u, -1.1, 1.0), 0.02), -5.0, 0.2) for u in np.arange(1.0, LENGTH, 2.0)]
    things += [Fitting(Rod((0, -1.1, z), (LENGTH, -1.1, z), 0.022), -5.0, 0.2) for z in (0.5, 1.0)]
    things += [Fitting(Rod((0, y, 0.06), (LENGTH, y, 0.06), 0.035), -7.5) for y in (-0.3, 0.3)]
    things.append(Fitting(mounted(section, 6.3, section.left(1.55), (0.9, 0.6, 0.02), 0.05), -1.5, 0.5))
    things.append(Fitting(Rod((17.9, 1.2, 0.0), (17.9, 1.2, 1.1), 0.22), -6.0))
    things.append(Fitting(Cuboid((21.8, 1.2, 0.45), (1.3, 0.7, 0.9)), -7.5))
    return things


def _dirt(canvas: Canvas) -> None:
    left, right = canvas.section.left, canvas.section.right
    walled = smooth((WALLED - canvas.u) / 0.25)[:, None].astype(np.float32)
    linings.rock(canvas, -5.6, 0.085, 0.7)
    masonry = Canvas(canvas.section, LENGTH, canvas.cell, canvas.rng)
    linings.masonry(masonry, 0.19, 0.42, 0.022, 0.8, (masonry.section.foot_right, masonry.section.foot_left), 0.9)
    masonry.base += -4.8 + 0.5 * masonry.noise(3.0, 4) + 0.3 * masonry.noise(0.15, 3)
    masonry.height += 0.015 * masonry.noise(1.2, 3)
    for layer in ("base", "height"):
        setattr(canvas, layer, walled * getattr(masonry, layer) + (1 - walled) * getattr(canvas, layer))
    dirt.by_height(canvas, 2.3, 3.4, -1.3, 0.5)
    dirt.by_height(canvas, 0.7, 0.1, -1.2, 0.4)
    canvas.stain(stroke(canvas, wander(canvas.rng, (9.6, 3.6), (13.2, -1.2), 0.5), 0.09, 0.03, 0.5), 3.2, "quartz vein")
    canvas.stain(stroke(canvas, wander(canvas.rng, (19.6, 2.4), (22.9, 1.2), 0.4), 0.05, 0.02, 0.5), 2.6, "quartz vein")
    for u, s, a, b in ((10.6, left(0.9), 0.8, 0.55), (20.3, right(1.7), 0.6, 0.5)):
        patch = blot(canvas, u, s, a, b, 0.5, 0.25)
        canvas.stain(patch, -2.1, "dry ochre")
    canvas.stain(blot(canvas, 13.9, -0.4, 0.9, 0.45, 0.6, 0.3), -2.6, "lamp soot")
    canvas.stain(blot(canvas, 6.4, 0.5, 0.6, 0.5, 0.7, 0.3), -1.9, "lamp soot")
    for u in np.arange(2.2, LENGTH, 4.4):
        patch = blot(canvas, u, right(2.35), 0.45, 0.3, 0.7, 0.3)
        canvas.stain(specks(canvas, patch, 0.7, 0.2), -1.3, "dry moss at lamp")
    dirt.old_salt(canvas, 3.4, left(1.2), 0.5, 0.4, 2.6)
    dirt.old_run(canvas, 22.4, 0.8, -1.1, right(0.9), 2.4, "dry sinter", 5)
    canvas.stain(rectangle(canvas, 4.6, 5.7, right(2.3), right(1.2), 0.04, 0.02), 1.4, "new pointing")
    linings.floor(canvas, -6.5, 0.9, 0.02)
    dirt.wet_floor(canvas, 3.9, canvas.s[0] + 0.9, 0.8, 0.5, -3.5)
    dirt.wet_floor(canvas, 15.4, canvas.s[-1] - 0.6, 1.5, 0.4, -4.0)


def _leaks(canvas: Canvas) -> None:
    rng = canvas.rng
    left, right = canvas.section.left, canvas.section.right
    fissure = stroke(canvas, wander(rng, (14.8, -1.9), (15.9, 1.7), 0.5), (0.1, 0.2), 0.1, 0.4)
    fringe = specks(canvas, stroke(canvas, [(15.2, -0.6), (15.6, 0.8)], 0.09, 0.04, 0.5), 0.45)
    canvas.leak(
        "crown drip", [fissure, blot(canvas, 15.5, 0.7, 0.5, 0.4, 0.4, 0.25)], 4.6, film=0.8, salt=[fringe], salt_level=4.0
    )
    canvas.leak(
        "sheet of water",
        [blot(canvas, 12.3, left(1.5), 1.0, 1.0, 0.2, 0.22), *runs(canvas, 11.5, 13.2, left(1.1), left(0.05), 6, (0.12, 0.17))],
        6.4,
        film=1.0,
    )
    canvas.leak("wet joint", [stroke(canvas, wander(rng, (2.6, 0.7), (2.9, right(0.9)), 0.25), (0.1, 0.16), 0.08, 0.45)], 3.7)
    canvas.leak("brick weeping", [specks(canvas, blot(canvas, 7.1, right(1.35), 0.8, 0.55, 0.4, 0.2), 0.8, 0.3)], 3.2)
    canvas.leak("damp footing", [rising(canvas, 3.0, 6.2, "left", 0.6, 0.18)], 2.8)
    curtain = runs(canvas, 17.4, 18.6, left(2.4), left(0.4), 5, (0.08, 0.13))
    sinter = [specks(canvas, p, 0.3, 0.25) for p in curtain[:2]]
    canvas.leak("salt fringe", [*curtain, blot(canvas, 18.0, left(2.5), 0.7, 0.25, 0.3)], 3.9, salt=sinter, salt_level=3.5)
    canvas.leak("patch", [blot(canvas, 9.9, right(1.2), 0.45, 0.6, 0.3, 0.25)], 4.0)
    canvas.leak(
        "wet crack", [stroke(canvas, wander(rng, (20.6, 0.6), (22.2, left(1.3)), 0.5), (0.07, 0.14), 0.08, 0.4)], 3.4, film=0.5
    )
    canvas.leak("patch", [blot(canvas, 18.9, right(2.5), 0.24, 0.2, 0.3)], 5.3)
    canvas.leak("borehole", [*runs(canvas, 23.0, 23.1, left(1.1), left(0.1), 1, (0.06, 0.14))], 5.0, film=1.0)
    canvas.leak(
        "damp rock",
        [blot(canvas, 14.9, right(0.9), 0.7, 0.4, 0.9, 0.3)],
        1.3,
        limit="Slight damp, as dark as beds of the rock are.",
    )


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.015, np.random.default_rng(7002))
    _dirt(canvas)
    _leaks(canvas)
    alignment = Alignment(612_450.0, 5_203_118.0, 712.6, 201.0, 1 / 180, 0.006)
    phase = Instrument(
        -8.0, plateau=3.0, noise=0.3, weak=-30.0, limit=-42.0, step=0.02, drift=0.1, range_noise=0.001, beam=0.0009
    )
    stands = [(3.3, 0.25, 1.62), (8.9, -0.2, 1.66), (15.0, 0.3, 1.6), (21.0, 0.1, 1.64)]
    return static_survey(
        canvas, alignment, _fittings(canvas.section), phase, Matt(0.45), stands, (0.0, 1.3), 0.005, 0.018, 10, (0.5, 20.0)
    )


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "adit-show-mine",
    "rock",
    "rock and rubble walling with sinter, ochre and timber sets",
    "Haulage level of a lead mine, now shown to visitors: walled for 9 m, then bare rock with timber sets, handrail "
    "and lamps with moss; drips, sheets of water and curtains of sinter as speleologists and mine surveyors describe "
    "them; phase-based scanner.",
    make,
)
