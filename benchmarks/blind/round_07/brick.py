"""Double-track railway tunnel of the 1850s in the Pennines, lined with brick."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas, Patch
from .field import mobile_survey
from .fittings import Cuboid, Fitting, Rod, before, hung, mounted
from .instrument import Instrument, Matt
from .section import Alignment, Section, arc
from .shapes import blot, rectangle, rising, runs, specks, stroke, wander
from .survey import Survey

LENGTH = 26.0


def _section() -> Section:
    wall = [*arc((-2.6, 2.6), 6.6, -23, 0, 0.04), *arc((0.0, 2.6), 4.0, 0, 90, 0.03)[1:]]
    return Section([(0.0, 0.0), (2.6, 0.0), (3.25, -0.15), wall[0]], wall)


def _fittings(section: Section) -> list[Fitting]:
    rails = (-2.42, -0.985, 0.985, 2.42)
    things = [Fitting(Cuboid((LENGTH / 2, y, 0.24), (LENGTH, 0.07, 0.16)), -7.0, 0.2) for y in rails]
    for u in np.arange(0.35, LENGTH, 0.65):
        things += [Fitting(Cuboid((u, y, 0.1), (0.26, 2.5, 0.12)), -5.0) for y in (-1.7, 1.7)]
    for k, s in enumerate((section.right(1.5), section.right(1.62), section.right(1.74), section.right(1.95))):
        things.append(Fitting(hung(section, 0, LENGTH, s, 0.014 + 0.006 * (k % 2), 0.07, 1.5, 0.04), -11.0))
    for u in np.arange(0.8, LENGTH, 1.5):
        things.append(Fitting(mounted(section, u, section.right(1.72), (0.04, 0.6, 0.05)), -7.0))
    things.append(Fitting(hung(section, 0, LENGTH, section.left(2.3), 0.03, 0.05, 3.0, 0.03), -9.0))
    things.append(Fitting(mounted(section, 5.2, section.left(1.8), (0.35, 0.5, 0.02), 0.02), 7.0, retro=True))
    things.append(Fitting(mounted(section, 17.6, section.right(2.6), (0.25, 0.35, 0.02), 0.03), 5.0, retro=True))
    # Sheets that lead drips away from the track, below an old shaft.
    for k in range(7):
        things.append(Fitting(mounted(section, 20.4, -0.75 + 0.25 * k, (1.6, 0.24, 0.004), 0.12 + 0.02 * (k % 2)), -2.5, 0.8))
    top, bottom = before(section, 1.1, 0.2), before(section, section.left(0.4), 0.1)
    things.append(Fitting(Rod((20.4, *top), (20.4, *bottom), 0.05), -5.0))
    return things


def _dirt(canvas: Canvas) -> None:
    section, rng = canvas.section, canvas.rng
    left, right = section.left, section.right
    linings.masonry(canvas, 0.075, 0.225, 0.0125, 0.75, (section.foot_right, section.foot_left), 1.1)
    canvas.base += -5.2 + 0.5 * canvas.noise(4.0, 4) + 0.35 * canvas.noise(0.4, 3)
    canvas.height += 0.02 * canvas.noise(4.0, 3)
    dirt.by_height(canvas, 3.2, 6.2, -3.2, 0.3)
    dirt.by_height(canvas, 1.0, 0.0, -1.3, 0.35)
    dirt.streaks(canvas, 0.8, 4.8, 0.9, 0.25)
    for u0, u1, s0, s1 in ((2.2, 4.1, left(3.6), left(2.1)), (13.2, 14.1, right(1.2), right(2.9)), (8.6, 10.2, 0.6, 1.7)):
        canvas.stain(rectangle(canvas, u0, u1, s0, s1, 0.03, 0.01), -1.9, "engineering brick")
    canvas.stain(rectangle(canvas, 22.6, 25.2, right(0.6), right(3.2), 0.04, 0.03), 1.5, "new pointing")
    canvas.stain(rectangle(canvas, 11.5, 13.4, left(5.2), left(3.9), 0.04, 0.03), 2.2, "sprayed mortar repair")
    for u, s, a, b in (
        (6.4, right(3.8), 0.5, 0.4),
        (16.4, left(1.6), 0.4, 0.45),
        (24.0, 1.4, 0.6, 0.35),
        (12.1, -1.0, 0.35, 0.3),
    ):
        spall = blot(canvas, u, s, a, b, 0.12, 0.2)
        canvas.stain(spall, 1.8 if rng.random() < 0.5 else -1.3, "spalled brick")
        canvas.height[spall.window] -= 0.05 * spall.weight
    canvas.stain(blot(canvas, 17.8, -0.2, 2.2, 0.8, 0.7, 0.3), -1.9, "thick soot")
    # Refuges are shallow here, so that beams reach their backs.
    for u, side in ((10.6, "right"), (21.6, "left")):
        foot = section.foot_right if side == "right" else section.foot_left
        top = section.at_height(1.7, side)
        refuge = rectangle(canvas, u - 0.55, u + 0.55, foot, top, 0.03)
        canvas.height[refuge.window] -= 0.25 * refuge.weight
        canvas.stain(refuge, -0.8, "refuge")
    dirt.old_salt(canvas, 7.9, left(2.6), 0.7, 0.5, 3.0)
    dirt.old_run(canvas, 15.4, 0.9, -1.6, right(2.6), 2.6, "dry lime", 6)
    dirt.old_run(canvas, 5.2, 0.4, left(1.5), left(0.5), -1.6, "rust below sign", 3)
    linings.floor(canvas, -6.0, 0.6, 0.02)


def _weeping(canvas: Canvas, patch: Patch, share: float = 0.75) -> Patch:
    """Wetness that follows the courses: mortar and single bricks weep before others."""
    grains = specks(canvas, patch, share, 0.25)
    return Patch(patch.window, 0.3 * patch.weight + 0.7 * grains.weight)


def _leaks(canvas: Canvas) -> None:
    rng = canvas.rng
    left, right = canvas.section.left, canvas.section.right
    canvas.leak("brick weeping", [_weeping(canvas, blot(canvas, 4.6, right(2.2), 2.0, 1.1, 0.35, 0.25))], 3.4)
    canvas.leak(
        "brick weeping",
        [
            _weeping(canvas, blot(canvas, 18.6, left(2.6), 1.6, 1.3, 0.35, 0.25), 0.8),
            *runs(canvas, 17.6, 19.4, left(1.6), left(0.2), 5, (0.09, 0.15)),
        ],
        4.2,
        film=0.5,
    )
    canvas.leak("ring joint", [stroke(canvas, wander(rng, (7.4, -2.2), (7.6, right(0.7)), 0.25), (0.09, 0.17), 0.1, 0.4)], 3.6)
    fringe = specks(canvas, stroke(canvas, [(14.2, 0.2), (14.9, 0.35)], 0.08, 0.04, 0.5), 0.5)
    canvas.leak("crown drip", [blot(canvas, 14.6, 0.25, 0.75, 0.55, 0.3, 0.25)], 4.0, film=0.8, salt=[fringe], salt_level=5.0)
    curtain = runs(canvas, 9.6, 12.2, left(3.4), left(1.0), 8, (0.07, 0.12))
    lime = [specks(canvas, p, 0.35, 0.3) for p in curtain[::3]]
    canvas.leak(
        "lime curtain",
        [*curtain, stroke(canvas, [(9.4, left(3.45)), (12.4, left(3.4))], 0.12, 0.1)],
        3.8,
        salt=lime,
        salt_level=5.0,
    )
    canvas.leak("damp footing", [rising(canvas, 12.8, 18.6, "right", 0.9, 0.25)], 2.7)
    canvas.leak("damp footing", [rising(canvas, 1.2, 4.2, "left", 0.7, 0.2)], 3.1)
    canvas.leak("weep hole", runs(canvas, 8.3, 8.35, left(1.2), left(0.1), 1, (0.05, 0.13)), 4.6, film=0.8)
    canvas.leak("weep hole", runs(canvas, 19.4, 19.45, right(1.1), right(0.1), 1, (0.05, 0.12)), 4.2, film=0.8)
    canvas.leak("patch", [blot(canvas, 20.6, 0.1, 1.7, 1.3, 0.3, 0.2)], 5.6)
    canvas.leak("patch", [blot(canvas, 24.0, left(2.6), 0.8, 0.6, 0.45, 0.25)], 2.3)
    canvas.leak("patch behind cables", [blot(canvas, 22.0, right(1.75), 0.5, 0.6, 0.3, 0.2)], 3.6)
    canvas.leak("patch", [blot(canvas, 2.4, -0.6, 0.35, 0.3, 0.3)], 5.4)
    canvas.leak("wet crack", [stroke(canvas, wander(rng, (15.6, 1.1), (17.4, 3.0), 0.4), (0.06, 0.11), 0.08, 0.4)], 3.2)
    canvas.leak(
        "damp brick", [blot(canvas, 10.3, -1.4, 0.9, 0.5, 0.9, 0.3)], 1.2, limit="Slight damp under soot that is as dark."
    )


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.0125, np.random.default_rng(7004))
    _dirt(canvas)
    _leaks(canvas)
    alignment = Alignment(402_871.0, 5_921_406.0, 211.7, 327.0, -1 / 900, 0.004)
    profiler = Instrument(
        -11.0, plateau=2.2, noise=0.3, weak=-33.0, limit=-46.0, step=0.03, drift=0.12, range_noise=0.0015, beam=0.0008
    )
    return mobile_survey(
        canvas,
        alignment,
        _fittings(canvas.section),
        profiler,
        Matt(0.4),
        (1.7, 1.95),
        (0.0, 2.2),
        0.022,
        0.0047,
        0.7,
        steps=8,
        reference=(1.0, 10.0),
    )


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "brick-pennine",
    "brick",
    "weeping brickwork under soot, lime curtains and patches of other brick",
    "Double-track tunnel of the 1850s: brick in courses, soot of steam, patches of engineering brick, spalls, "
    "refuges, drip sheets below a shaft; wet areas, weep holes and footings as in CIRIA C671 and Network Rail's "
    "examination standards; profile scanner on a trolley.",
    make,
)
