"""Cut-and-cover road underpass of about 2005, a box of watertight concrete."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas
from .field import static_survey
from .fittings import Cuboid, Fitting, Rod, hung, mounted, upright
from .instrument import Instrument, Matt
from .section import Alignment, Section
from .shapes import blot, rectangle, rising, runs, specks, stroke, tidemark, wander
from .survey import Survey

LENGTH = 27.0
JOINTS = (4.6, 12.6, 20.6)
# Height of the joint between base slab and wall, in metres.
KICKER = 0.55


def _section() -> Section:
    floor = [(0.0, 0.0), (3.4, -0.07), (3.42, 0.1), (4.3, 0.12)]
    return Section(floor, [(4.3, 0.12), (4.3, 4.3), (3.8, 4.75), (0.0, 4.85)])


def _fittings(section: Section) -> list[Fitting]:
    things = []
    for u in np.arange(1.2, LENGTH, 3.0):
        for y in (-1.9, 1.9):
            things.append(Fitting(Cuboid((u, y, 4.62), (1.5, 0.16, 0.1)), -2.0, 0.5))
            things += [Fitting(Rod((u + d, y, 4.66), (u + d, y, 4.8), 0.008), -5.0) for d in (-0.5, 0.5)]
    things.append(Fitting(Cuboid((LENGTH / 2, 3.1, 4.45), (LENGTH, 0.4, 0.012)), -5.0, 0.3))
    things += [Fitting(Cuboid((LENGTH / 2, 3.1 + d, 4.48), (LENGTH, 0.01, 0.07)), -5.0, 0.3) for d in (-0.2, 0.2)]
    for u in np.arange(0.7, LENGTH, 1.8):
        things += [Fitting(Rod((u, 3.1 + d, 4.45), (u, 3.1 + d, 4.78), 0.007), -5.0) for d in (-0.19, 0.19)]
    things.append(Fitting(hung(section, 0, LENGTH, -3.0, 0.055, 0.16, 3, 0), -5.5, 0.3))
    things += [Fitting(hung(section, 0, LENGTH, section.left(3.6 + d), 0.012, 0.01, 0.8, 0.006), -10.0) for d in (0.0, 0.05)]
    for u in (6.3, 18.7):
        things += [Fitting(r, -5.0, 0.3) for r in upright(section, u, section.left(4.2), section.left(0.2), 0.05, 0.03)]
    things.append(Fitting(mounted(section, 15.0, section.right(1.5), (0.8, 1.2, 0.28)), -3.5, 0.5))
    things.append(Fitting(mounted(section, 15.0, section.right(2.6), (0.5, 0.5, 0.02), 0.02), 7.0, retro=True))
    things.append(Fitting(mounted(section, 9.8, section.left(1.9), (0.6, 0.3, 0.015), 0.02), 6.0, retro=True))
    things.append(Fitting(Cuboid((22.6, 0.0, 4.66), (0.9, 0.7, 0.03)), -2.5, 0.7))
    for z in (0.5, 0.75):
        things.append(Fitting(Cuboid((LENGTH / 2, 3.55, z), (LENGTH, 0.06, 0.12)), -4.0, 0.6))
    things += [Fitting(Cuboid((u, 3.62, 0.45), (0.1, 0.06, 0.8)), -5.0, 0.3) for u in np.arange(1.0, LENGTH, 2.0)]
    return things


def _dirt(canvas: Canvas) -> None:
    section, rng = canvas.section, canvas.rng
    left, right = section.left, section.right
    linings.cast_concrete(canvas, JOINTS, -3.8, 1.25, 0.5)
    for s in (left(KICKER), right(KICKER)):
        canvas.stain(rectangle(canvas, 0, LENGTH, s - 0.01, s + 0.01, 0.015), -1.5)
    for u in np.arange(0.6, LENGTH, 1.25):
        for z in (1.0, 2.3, 3.6):
            for s in (left(z), right(z)):
                plug = blot(canvas, float(u), s, 0.03, 0.03, 0.3, 0.0)
                canvas.stain(plug, float(rng.choice([-1.8, 1.2])))
    # Where concrete was poured in lifts the later one came out paler.
    lift = np.where(np.abs(canvas.s) > 5.6 + 0.12 * canvas.noise(2.0, 3, stretch=(1.0, 20.0)), -0.5, 0.2) * canvas.on_wall
    canvas.base += lift.astype(np.float32)
    dirt.by_height(canvas, 1.6, 0.2, -2.2, 0.35)
    dirt.by_height(canvas, 3.9, 4.8, -1.0, 0.5)
    dirt.streaks(canvas, 0.6, 4.0, -0.8, 0.2)
    canvas.stain(rectangle(canvas, 7.6, 9.2, left(3.3), left(2.2), 0.03, 0.015), 1.8, "repair mortar")
    canvas.stain(rectangle(canvas, 10.4, 11.6, -1.6, -0.7, 0.03, 0.02), -1.6, "coating on repair")
    canvas.stain(rectangle(canvas, 16.8, 18.0, right(0.8), right(2.1), 0.02), 2.4, "paint over graffiti")
    canvas.stain(
        [
            stroke(canvas, wander(rng, (23.2 + d, left(2.4)), (24.0 + d, left(1.2)), 0.6), 0.04, 0.02, 0.2)
            for d in (0, 0.4, 0.9)
        ],
        -2.8,
        "graffiti",
    )
    canvas.stain(blot(canvas, 2.4, 0.6, 1.2, 0.6, 0.6, 0.3), -2.2, "exhaust soot")
    canvas.stain(blot(canvas, 24.8, 1.2, 0.9, 0.5, 0.6, 0.3), -1.9, "bleeding of form oil")
    dirt.crack(canvas, (7.1, right(3.9)), (7.3, right(1.0)))
    dirt.crack(canvas, (17.0, 2.9), (17.4, -1.8))
    packers = [
        blot(canvas, 17.2 + d, s, 0.02, 0.02, 0.3, 0.0) for d, s in ((0.15, -1.4), (-0.15, -0.9), (0.15, -0.4), (-0.15, 0.1))
    ]
    canvas.stain(packers, -3.5)
    canvas.stain(stroke(canvas, wander(rng, (17.3, -1.6), (17.2, 0.3), 0.15), 0.07, 0.03, 0.3), 1.9, "injection resin")
    dirt.old_salt(canvas, 3.6, left(1.8), 0.5, 0.6, 3.0)
    dirt.old_run(canvas, 13.8, 0.8, left(3.5), left(1.4), -1.7, "dry wash of soot", 5)
    dirt.old_run(canvas, 20.6, 0.3, right(3.9), right(1.6), 2.4, "dry lime", 3)
    linings.floor(canvas, -7.5, 0.5, reach=0.88)
    for s in (canvas.s[0] + 3.1, canvas.s[-1] - 3.1):
        canvas.stain(rectangle(canvas, 0.0, LENGTH, s - 0.06, s + 0.06, 0.02), 6.0)
    dirt.wet_floor(canvas, 13.0, canvas.s[-1] - 3.6, 1.4, 0.3, -3.0)


def _leaks(canvas: Canvas) -> None:
    rng = canvas.rng
    left, right = canvas.section.left, canvas.section.right
    canvas.leak(
        "construction joint",
        [
            stroke(canvas, [(12.6, 1.9), (12.6, left(0.25))], (0.07, 0.2), 0.08, 0.35),
            *runs(canvas, 12.4, 12.9, left(2.0), left(0.2), 3, (0.06, 0.1)),
        ],
        4.4,
        film=0.6,
    )
    canvas.leak(
        "kicker joint",
        [
            stroke(canvas, [(14.2, left(KICKER)), (18.1, left(KICKER))], 0.09, 0.07, 0.4),
            rising(canvas, 14.0, 18.3, "left", 0.6, 0.12),
        ],
        3.4,
    )
    cracked = wander(rng, (9.4, right(4.0)), (9.6, right(0.3)), 0.25)
    salt = [specks(canvas, stroke(canvas, cracked[: len(cracked) // 2], 0.03, 0.02, 0.4), 0.5, 0.1)]
    canvas.leak("wet crack", [stroke(canvas, cracked, (0.06, 0.16), 0.08, 0.35)], 3.8, salt=salt)
    drips = specks(canvas, stroke(canvas, [(20.6, -2.5), (20.6, -0.4)], 0.04, 0.03, 0.5), 0.5, 0.1)
    canvas.leak(
        "salt fringe", [stroke(canvas, [(20.6, -2.6), (20.6, -0.2)], 0.22, 0.12, 0.4)], 4.2, salt=[drips], salt_level=5.0
    )
    drying = blot(canvas, 7.0, 1.3, 1.9, 1.0, 0.4, 0.25)
    canvas.leak("drying patch", [drying], 2.4)
    canvas.stain(tidemark(drying), 1.1)
    canvas.leak(
        "honeycomb",
        [blot(canvas, 23.2, right(1.2), 0.8, 0.45, 0.25, 0.25), *runs(canvas, 22.7, 23.7, right(0.9), right(0.2), 4)],
        3.8,
    )
    canvas.leak("tie hole", runs(canvas, 21.84, 21.86, left(2.3), left(0.7), 1, (0.05, 0.09)), 4.8, film=0.6)
    canvas.leak(
        "construction joint",
        [
            stroke(canvas, [(4.6, right(2.8)), (4.6, right(0.15))], (0.05, 0.17), 0.07, 0.4),
            rising(canvas, 3.6, 6.0, "right", 0.5, 0.12),
        ],
        3.6,
    )
    canvas.leak("patch behind tray", [blot(canvas, 25.2, -2.9, 0.8, 0.7, 0.3, 0.22)], 3.5)
    canvas.leak("patch", [blot(canvas, 15.8, -0.3, 0.24, 0.2, 0.3)], 8.2, film=0.5)
    canvas.leak(
        "damp patch",
        [blot(canvas, 10.9, left(1.0), 0.6, 0.4, 0.8, 0.3)],
        1.1,
        limit="Slight damp within spray that is as dark.",
    )


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.02, np.random.default_rng(7006))
    _dirt(canvas)
    _leaks(canvas)
    alignment = Alignment(365_228.0, 5_644_719.0, 41.6, 12.0, 0.0, 0.022)
    phase = Instrument(
        -5.0,
        plateau=2.6,
        near=1.5,
        near_range=2.0,
        noise=0.28,
        weak=-27.0,
        limit=-40.0,
        step=0.02,
        drift=0.14,
        range_noise=0.0012,
        beam=0.0006,
    )
    stands = [(4.6, 0.5, 1.7), (13.2, -0.6, 1.73), (22.0, 0.4, 1.68)]
    return static_survey(canvas, alignment, _fittings(canvas.section), phase, Matt(0.3), stands, (0.6, 1.2), 0.0033, 0.018)


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "box-underpass",
    "cast",
    "construction joints, kicker joint, tie holes and cracks of a box",
    "Cut-and-cover road underpass of watertight concrete in blocks of 8 m with haunches; separation cracks, kicker "
    "joint, tie holes and injections as in guides to waterproof concrete (DBV, ICE); crash rail, cable tray, drip "
    "tray; phase-based scanner, no reference.",
    make,
)
