"""Access tunnel to the cavern of a hydro-electric power station in the Andes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas
from .field import static_survey
from .fittings import Cuboid, Fitting, Rod, hung, mounted, upright
from .instrument import Instrument, Matt
from .section import Alignment, Section, arc
from .shapes import blot, rectangle, rising, runs, smooth, specks, stroke, wander
from .survey import Survey

LENGTH = 30.0


def _section() -> Section:
    ditch = [(0.0, 0.0), (2.7, -0.07), (2.72, -0.25), (3.05, -0.25), (3.1, 0.0)]
    return Section(ditch, [(3.1, 0.0), (3.15, 2.6), *arc((0.0, 2.6), 3.15, 0, 90)[1:]])


def _fittings(section: Section, rng: np.random.Generator) -> list[Fitting]:
    things = []
    y, z = section.locate(1.35)
    things.append(Fitting(Rod((0, 0.8 * y, z - 0.55), (LENGTH, 0.8 * y, z - 0.58), 0.38), -4.0, 0.2))
    for s in (section.right(2.6), section.right(2.85)):
        y, z = section.locate(s)
        things.append(Fitting(Cuboid((LENGTH / 2, y - 0.3, z), (LENGTH, 0.4, 0.015)), -5.5, 0.3))
        things += [Fitting(hung(section, 0, LENGTH, s, 0.025, g, 1.2, 0.01), -10.0) for g in (0.14, 0.24, 0.36)]
    for u in np.arange(1.2, LENGTH, 1.5):
        for s in np.arange(-3.4, 3.5, 1.7):
            if rng.random() < 0.75:
                place = (u + rng.normal(0, 0.15), s + rng.normal(0, 0.15))
                things.append(Fitting(mounted(section, *place, (0.16, 0.16, 0.015), 0.04), -6.5, 0.1))
                things.append(Fitting(mounted(section, *place, (0.035, 0.035, 0.1), 0.04), -7.0))
    for u in np.arange(3.0, LENGTH, 6.0):
        things.append(Fitting(mounted(section, u, -1.4, (0.6, 0.25, 0.14), 0.3), -3.0, 0.4))
    for u in (9.8, 19.2):
        things += [Fitting(r, -4.5, 0.3) for r in upright(section, u, section.left(4.6), section.left(0.2), 0.055, 0.03)]
    things.append(Fitting(mounted(section, 14.2, section.left(1.7), (0.5, 0.5, 0.02), 0.1), 7.0, retro=True))
    things.append(Fitting(mounted(section, 25.6, section.left(1.5), (0.8, 1.1, 0.35), 0.05), -4.0, 0.4))
    things.append(Fitting(Rod((0, -2.86, 1.0), (LENGTH, -2.86, 1.0), 0.08), -5.0, 0.3))
    return things


def _dirt(canvas: Canvas) -> None:
    left, right = canvas.section.left, canvas.section.right
    linings.rock(canvas, -6.0, 0.1, 1.1)
    sprayed = Canvas(canvas.section, LENGTH, canvas.cell, canvas.rng)
    linings.shotcrete(sprayed, -4.3, 0.03, 0.8)
    edge = 0.5 * canvas.noise(1.5, 4)
    # Sprayed over a zone of broken rock from foot to foot, and on the crown alone beyond it.
    zone = np.maximum(
        smooth((2.0 - np.abs(canvas.u[:, None] - 14.0) / 2.4 + edge) / 0.3),
        smooth((2.0 + edge - np.abs(canvas.s[None, :])) / 0.3) * (canvas.u[:, None] > 14.0),
    ).astype(np.float32)
    canvas.base += zone * (sprayed.base - canvas.base)
    canvas.height += zone * (sprayed.height - 0.6 * canvas.height)
    dirt.by_height(canvas, 1.2, 0.1, -1.4, 0.4)
    dirt.by_height(canvas, 4.2, 5.7, -1.0, 0.5)
    canvas.stain(blot(canvas, 6.6, left(2.4), 1.2, 0.8, 0.5, 0.28), -2.0, "dark dyke in rock")
    canvas.stain(blot(canvas, 23.2, right(1.6), 1.0, 0.8, 0.5, 0.25), -1.8, "iron stain")
    canvas.stain(blot(canvas, 16.0, 2.4, 0.9, 0.6, 0.2, 0.2), -1.6, "younger shotcrete")
    canvas.stain(rectangle(canvas, 10.2, 11.2, left(1.9), left(1.2), 0.03), 3.0, "painted number")
    canvas.stain(stroke(canvas, wander(canvas.rng, (21.0, -0.5), (27.0, -4.2), 0.7), 0.08, 0.03, 0.5), 2.4, "calcite vein")
    dirt.crack(canvas, (12.5, 3.2), (15.5, 1.0), -1.5)
    dirt.old_salt(canvas, 14.8, right(3.9), 0.7, 0.35, 2.6)
    dirt.old_run(canvas, 17.6, 0.6, left(3.2), left(1.4), 2.2, "dry sinter", 4)
    dirt.old_run(canvas, 25.6, 0.5, left(0.9), left(0.2), -1.8, "rust below box", 3)
    linings.floor(canvas, -6.0, 0.9, 0.02)
    for u, s in ((5.0, canvas.s[0] + 1.2), (11.5, canvas.s[-1] - 0.8), (21.5, canvas.s[0] + 0.6)):
        dirt.wet_floor(canvas, u, s, 1.2, 0.6, -2.5)


def _leaks(canvas: Canvas) -> None:
    rng = canvas.rng
    left, right = canvas.section.left, canvas.section.right
    canvas.leak(
        "sheet of water",
        [
            blot(canvas, 4.0, right(3.9), 1.3, 0.9, 0.25, 0.25),
            *runs(canvas, 3.0, 5.0, right(3.3), right(0.05), 7, (0.14, 0.24)),
        ],
        3.8,
        film=0.7,
    )
    canvas.leak("wet crack", [stroke(canvas, wander(rng, (7.6, 2.6), (10.4, 0.2), 0.6), (0.09, 0.16), 0.1, 0.4)], 3.0)
    ends = (left(2.9), left(0.1))
    canvas.leak("drain hole", runs(canvas, 12.2, 12.25, *ends, 1, (0.07, 0.16)), 3.9, film=0.8)
    canvas.leak("drain hole", runs(canvas, 15.4, 15.45, right(2.2), right(0.1), 1, (0.06, 0.13)), 3.4, film=0.8)
    canvas.leak("rock bolt", [blot(canvas, 13.0, -1.7, 0.35, 0.4, 0.3, 0.25)], 2.9)
    drip = blot(canvas, 18.2, -0.5, 0.9, 0.65, 0.3, 0.25)
    fringe = specks(canvas, stroke(canvas, [(17.6, -0.5), (18.7, -0.4)], 0.07, 0.03, 0.5), 0.5, 0.1)
    canvas.leak("crown drip", [drip], 3.6, film=0.8, salt=[fringe])
    canvas.leak(
        "patch",
        [blot(canvas, 20.9, left(2.0), 1.4, 1.2, 0.4, 0.25), *runs(canvas, 20.2, 21.9, left(1.4), left(0.1), 5, (0.12, 0.2))],
        2.7,
    )
    canvas.leak("damp footing", [rising(canvas, 8.0, 13.6, "right", 0.7, 0.2)], 2.2)
    canvas.leak(
        "edge of shotcrete",
        [stroke(canvas, wander(rng, (18.9, right(3.6)), (19.3, right(0.4)), 0.6), (0.12, 0.25), 0.12, 0.5)],
        3.1,
    )
    canvas.leak("patch", [blot(canvas, 23.4, 2.9, 0.3, 0.25, 0.3)], 4.4)
    canvas.leak(
        "weeping bed",
        [
            stroke(canvas, wander(rng, (23.6, left(3.3)), (27.9, left(2.6)), 0.4), (0.1, 0.18), 0.1, 0.5),
            *runs(canvas, 24.3, 27.6, left(2.9), left(1.2), 7, (0.06, 0.1)),
        ],
        3.1,
    )
    canvas.leak("patch", [blot(canvas, 28.2, -2.2, 0.7, 0.6, 0.3, 0.25)], 2.5)
    canvas.leak(
        "damp rock",
        [blot(canvas, 8.0, left(1.1), 0.9, 0.5, 0.9, 0.3)],
        0.9,
        limit="Green light shows slight damp no better than beds.",
    )


def survey() -> Survey:
    """Tunnel, scan and truth."""
    rng = np.random.default_rng(7003)
    canvas = Canvas(_section(), LENGTH, 0.02, rng)
    _dirt(canvas)
    _leaks(canvas)
    alignment = Alignment(551_904.0, 4_640_220.0, 1460.4, 118.0, 0.0, -0.075)
    green = Instrument(
        -4.0,
        near=7.0,
        near_range=1.6,
        noise=0.45,
        weak=-26.0,
        limit=-36.0,
        step=0.05,
        drift=0.15,
        range_noise=0.003,
        mixing=0.5,
    )
    stands = [(4.2, -0.4, 1.8), (12.0, 0.5, 1.74), (19.4, -0.3, 1.82), (26.5, 0.4, 1.77)]
    return static_survey(
        canvas, alignment, _fittings(canvas.section, rng), green, Matt(0.4), stands, (0.0, 1.8), 0.0038, 0.019, 10, (1.0, 25.0)
    )


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "hydro-access",
    "rock",
    "rock and shotcrete in green light, with drain holes and bolts",
    "Blasted access tunnel of a power station in the Andes, partly sprayed, with bolts, ventilation duct and cable "
    "racks; water from joints, drain holes and bolts as in guides to unlined hydro tunnels; pulsed scanner at 532 nm, "
    "where water darkens less.",
    make,
)
