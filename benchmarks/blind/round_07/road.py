"""Motorway tunnel of the Ligurian coast, cast about 1970."""

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
from .shapes import blot, rectangle, rising, runs, smooth, specks, stroke, tidemark, wander
from .survey import Survey

LENGTH = 28.0
JOINTS = (3.2, 9.2, 15.2, 21.2, 27.2)


def _section() -> Section:
    right = [(0.0, 0.0), (3.75, -0.08), (3.77, 0.12), (4.62, 0.14)]
    return Section(right, [(4.62, 0.14), (4.78, 1.75), *arc((0.0, 1.75), 4.78, 0, 90)[1:]])


def _fittings(section: Section) -> list[Fitting]:
    left, right = section.left, section.right
    things = []
    for u in np.arange(1.5, LENGTH, 4.5):
        for s in (-1.1, 1.1):
            things.append(Fitting(mounted(section, u, s, (1.3, 0.28, 0.16), 0.22), -3.0, 0.4))
            things += [
                Fitting(Rod((u + d, *section.locate(s)), (u + d, *(section.locate(s) - [0, 0.3])), 0.012), -5.0)
                for d in (-0.4, 0.4)
            ]
    for s in (-2.2, 2.2):
        y, z = section.locate(s)
        things.append(Fitting(Cuboid((LENGTH / 2, y * 0.965, z - 0.2), (LENGTH, 0.3, 0.012)), -6.0, 0.2))
        things += [Fitting(hung(section, 0, LENGTH, s + d, 0.02, 0.17, 1.5, 0.01), -10.0) for d in (-0.08, 0.02)]
    things.append(Fitting(hung(section, 0, LENGTH, right(0.75), 0.055, 0.06, 3, 0), -6.5, 0.3))
    things += [Fitting(hung(section, 0, LENGTH, left(z), 0.014, 0.015, 0.9, 0.015), -11.0) for z in (3.45, 3.56)]
    things.append(Fitting(mounted(section, 12.4, right(1.5), (0.75, 1.0, 0.3)), -4.0, 0.5))
    things.append(Fitting(mounted(section, 12.4, right(2.75), (0.6, 0.6, 0.03), 0.03), 6.0, retro=True))
    things.append(Fitting(mounted(section, 19.3, left(2.2), (0.45, 0.3, 0.02), 0.02), 5.0, retro=True))
    things.append(Fitting(mounted(section, 7.2, left(1.55), (0.35, 0.5, 0.18)), -5.0, 0.3))
    things += [Fitting(r, -8.0) for r in upright(section, 7.2, left(1.8), left(3.5), 0.015)]
    for u in np.arange(2.0, LENGTH, 6.0):
        for y in (-3.84, 3.84):
            things.append(Fitting(Cuboid((u, y, 0.2), (0.1, 0.05, 0.1)), 8.0, retro=True))
    things.append(Fitting(Rod((22.3, 0.0, 5.3), (24.6, 0.0, 5.3), 0.42), -5.0, 0.3))
    things += [Fitting(Rod((u, y, 5.3), (u, y, 6.5), 0.02), -5.0) for u in (22.7, 24.2) for y in (-0.35, 0.35)]
    return things


def _dirt(canvas: Canvas) -> None:
    left, right = canvas.section.left, canvas.section.right
    linings.cast_concrete(canvas, JOINTS, -4.0, 1.0, 0.6)
    painted = ((canvas.z < 3.1) & canvas.on_wall)[None, :] * smooth((canvas.noise(0.6, 5, 0.7) + 2.2) / 0.6)
    canvas.base += (2.4 * painted).astype(np.float32)
    canvas.sheen += (0.35 * painted).astype(np.float32)
    dirt.by_height(canvas, 2.6, 6.4, -2.8, 0.28)
    dirt.by_height(canvas, 1.5, 0.2, -2.6, 0.3)
    dirt.streaks(canvas, 1.0, 4.6, -0.9, 0.25)
    canvas.stain(rectangle(canvas, 4.4, 6.3, left(4.2), left(3.7), 0.03, 0.01), 1.9, "repair mortar")
    canvas.stain(rectangle(canvas, 16.4, 18.0, -3.1, -2.45, 0.03, 0.02), -1.7, "repair mortar")
    canvas.stain(rectangle(canvas, 10.1, 10.9, left(2.6), left(1.2), 0.02), -2.6, "paint over graffiti")
    canvas.stain(blot(canvas, 1.5, 0.0, 0.9, 0.6, 0.6, 0.3), -2.4, "soot above lamp")
    canvas.stain(blot(canvas, 25.2, 0.2, 1.7, 0.7, 0.6, 0.3), -3.0, "soot at jet fan")
    canvas.stain(stroke(canvas, [(23.0, right(1.1)), (26.5, right(0.95))], 0.07, 0.03, 0.4), -3.4, "scrape with rubber")
    canvas.stain(stroke(canvas, wander(canvas.rng, (12.0, 1.4), (14.4, 3.4), 0.3), 0.06, 0.02, 0.1), 2.0, "sealed crack")
    dirt.crack(canvas, (17.0, 2.6), (20.2, 1.5))
    dirt.crack(canvas, (4.0, -1.0), (8.6, -1.6))
    dirt.old_salt(canvas, 20.0, right(4.1), 0.6, 0.35)
    dirt.old_run(canvas, 7.2, 0.3, left(1.3), left(0.3), -2.2, "rust below box", 3)
    dirt.old_run(canvas, 26.0, 0.9, left(3.4), left(0.9), -1.6, "dry wash of soot", 5)
    linings.floor(canvas, -8.0, 0.5, reach=0.9)
    for s in (canvas.s[0] + 3.45, canvas.s[-1] - 3.45):
        canvas.stain(rectangle(canvas, 0.0, LENGTH, s - 0.07, s + 0.07, 0.02), 6.5)
    for u in np.arange(0.5, LENGTH, 7.5):
        canvas.stain(rectangle(canvas, u, u + 3.0, canvas.s[0], canvas.s[0] + 0.06, 0.02), 6.5)


def _leaks(canvas: Canvas) -> None:
    rng = canvas.rng
    left, right = canvas.section.left, canvas.section.right
    seam = stroke(canvas, wander(rng, (9.2, 1.3), (9.22, left(1.1)), 0.08), (0.08, 0.22), 0.1, 0.3)
    fan = rising(canvas, 8.2, 10.6, "left", 1.0)
    salt = specks(canvas, stroke(canvas, [(9.2, 1.6), (9.2, left(2.0))], 0.05, 0.04, 0.5), 0.5)
    canvas.leak("wet joint", [seam, fan, *runs(canvas, 9.0, 9.7, left(2.6), left(0.4), 4)], 6.6, film=1.2, salt=[salt])
    halo = blot(canvas, 15.3, 0.15, 0.38, 0.5, 0.35, 0.25)
    needles = specks(canvas, stroke(canvas, [(15.2, -0.2), (15.2, 0.45)], 0.05, 0.03, 0.4), 0.6)
    canvas.leak("crown drip", [halo], 4.6, film=1.0, salt=[needles], salt_level=5.0)
    canvas.height[needles.window] += 0.06 * needles.weight
    path = wander(rng, (16.8, -1.5), (20.4, -4.1), 0.5)
    canvas.leak("wet crack", [stroke(canvas, path, (0.06, 0.11), 0.08, 0.4), *runs(canvas, 19.4, 20.3, -3.7, -5.0, 3)], 3.6)
    canvas.leak("honeycomb", [blot(canvas, 2.0, right(3.9), 0.75, 0.5, 0.2, 0.25)], 4.0)
    canvas.leak(
        "runs on paint",
        [
            *runs(canvas, 20.9, 22.2, right(3.3), right(0.3), 6, (0.07, 0.15)),
            stroke(canvas, [(20.8, right(3.3)), (22.3, right(3.25))], 0.1, 0.08),
        ],
        4.4,
        film=1.0,
    )
    canvas.leak("damp footing", [rising(canvas, 13.6, 18.9, "left", 0.85, 0.2)], 3.0)
    canvas.leak("patch behind tray", [blot(canvas, 5.4, -2.2, 1.1, 0.8, 0.3, 0.2)], 3.3)
    drying = blot(canvas, 21.6, 2.9, 2.1, 1.0, 0.45, 0.22)
    canvas.leak("drying patch", [drying, *runs(canvas, 20.6, 22.8, 3.5, 5.2, 5, (0.1, 0.07))], 2.3)
    canvas.stain(tidemark(drying), 0.9)
    canvas.leak("patch", [blot(canvas, 11.6, -0.5, 0.22, 0.18, 0.3, 0.15)], 5.5)
    canvas.leak("patch", [blot(canvas, 6.4, 1.7, 0.7, 0.4, 0.8, 0.3)], 1.5, limit="Faint damp that soot at the crown covers.")


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.02, np.random.default_rng(7001))
    _dirt(canvas)
    _leaks(canvas)
    alignment = Alignment(478_312.0, 4_917_655.0, 148.2, 63.0, 1 / 620, 0.018)
    riegl = Instrument(
        34.0, near=5.0, near_range=2.2, noise=0.35, weak=8.0, limit=1.5, drift=0.12, range_noise=0.003, mixing=0.35
    )
    stands = [(5.2, 0.6, 1.75), (14.3, -0.8, 1.7), (23.4, 0.5, 1.78)]
    return static_survey(canvas, alignment, _fittings(canvas.section), riegl, Matt(0.25), stands, (0.0, 1.5))


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "road-liguria",
    "cast",
    "soot, white paint and wet construction joints",
    "Motorway tunnel of about 1970 with a cast lining in blocks of 6 m, walls painted white, soot at the crown and "
    "spray at the foot; water at construction joints, cracks and honeycomb as in manuals of inspection (CETU, PIARC); "
    "pulsed scanner at 1550 nm.",
    make,
)
