"""Pedestrian underpass of precast arches below a dual carriageway, built about 1985."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas
from .field import static_survey
from .fittings import Fitting, Rod, hung, mounted
from .instrument import Instrument, Matt
from .section import Alignment, Section, arc
from .shapes import blot, rectangle, rising, runs, smooth, specks, stroke, tidemark
from .survey import Survey

LENGTH = 24.0
UNIT = 2.0


def _section() -> Section:
    floor = [(0.0, 0.02), (2.0, -0.01), (2.02, -0.05), (2.2, -0.05)]
    flank = [(2.2, -0.05), (2.25, 0.0), *arc((0.25, 0.85), 2.17, -23, 38)[1:]]
    last = flank[-1]
    # Above the haunch the arch goes over into a flatter one that meets it without a corner.
    radius = last[0] / np.cos(np.radians(38))
    return Section(floor, [*flank, *arc((0.0, float(last[1] - radius * np.sin(np.radians(38)))), radius, 38, 90)[1:]])


def _fittings(section: Section) -> list[Fitting]:
    things = [Fitting(mounted(section, u, 0.0, (0.7, 0.28, 0.13)), -3.0, 0.4) for u in np.arange(1.0, LENGTH, 4.0)]
    things.append(Fitting(hung(section, 0, LENGTH, 0.25, 0.012, 0.01, 1.0, 0.004), -4.5, 0.2))
    y, height = section.locate(section.right(0.95))
    things.append(Fitting(Rod((0, y - 0.1, height), (LENGTH, y - 0.1, height), 0.024), -4.0, 0.7))
    things += [
        Fitting(Rod((u, y - 0.1, height), (u, y + 0.03, height - 0.05), 0.01), -5.0) for u in np.arange(0.5, LENGTH, 1.5)
    ]
    things.append(Fitting(mounted(section, 6.5, section.left(1.7), (1.2, 0.8, 0.03), 0.02), -1.5, 0.6))
    things.append(Fitting(mounted(section, 15.3, section.left(1.95), (0.6, 0.4, 0.015), 0.02), 6.0, retro=True))
    things.append(Fitting(mounted(section, 18.6, section.right(2.1), (0.18, 0.18, 0.16), 0.0), -3.5, 0.4))
    things.append(Fitting(hung(section, 12.0, LENGTH, section.right(2.1), 0.011, 0.01, 0.6, 0.004), -9.0))
    return things


def _graffiti(canvas: Canvas, u: float, s: float, size: float, level: float) -> None:
    """Tag of some strokes of the can."""
    rng = canvas.rng
    letters = []
    for k in range(5):
        points = [(u + size * (0.55 * k + rng.uniform(-0.25, 0.25)), s + size * rng.uniform(-0.5, 0.5)) for _ in range(4)]
        letters.append(stroke(canvas, points, 0.03, 0.03, 0.15))
    canvas.stain(letters, level, "graffiti")


def _dirt(canvas: Canvas) -> None:
    section, rng = canvas.section, canvas.rng
    left, right = section.left, section.right
    linings.cast_concrete(canvas, tuple(np.arange(UNIT, LENGTH, UNIT)), -3.4, 0.0, 0.3)
    crown = np.abs(canvas.s) < 0.02
    canvas.base[:, crown] -= 1.2
    for ring in np.arange(0.0, LENGTH, UNIT):
        for side in (-1, 1):
            canvas.stain(blot(canvas, ring + UNIT / 2, side * 1.3, 0.05, 0.05, 0.3, 0.0), float(rng.choice([-2.2, 1.5])))
    # Dado painted against posters and tags, thick with coats.
    dado = ((canvas.z < 1.75 + 0.01 * np.sin(canvas.s)) & canvas.on_wall)[None, :] * (canvas.noise(0.5, 4, 0.7) > -2.1)
    canvas.base += (1.2 * dado + 0.35 * dado * canvas.noise(1.5, 2)).astype(np.float32)
    canvas.sheen += (0.3 * dado).astype(np.float32)
    _graffiti(canvas, 2.0, left(1.3), 0.8, -3.2)
    _graffiti(canvas, 10.2, right(1.5), 0.7, -2.4)
    _graffiti(canvas, 17.0, left(1.2), 0.9, -3.6)
    _graffiti(canvas, 20.8, right(1.3), 0.6, 1.8)
    canvas.stain(rectangle(canvas, 4.1, 5.6, right(0.6), right(1.6), 0.03, 0.02), -1.7, "paint over graffiti")
    canvas.stain(rectangle(canvas, 12.3, 13.4, left(1.6), left(0.5), 0.03, 0.02), 1.0, "paint over graffiti")
    canvas.stain(rectangle(canvas, 9.2, 10.4, left(1.55), left(0.75), 0.01), 2.0, "poster")
    canvas.stain(rectangle(canvas, 14.5, 14.9, right(1.9), right(2.3), 0.02, 0.01), 1.4, "repair mortar")
    canvas.stain(rectangle(canvas, 22.2, 23.1, 0.5, 1.2, 0.03, 0.02), -1.4, "repair mortar")
    canvas.stain(blot(canvas, 19.6, left(0.45), 0.7, 0.5, 0.5, 0.25), -2.4, "soot of a fire")
    canvas.stain(blot(canvas, 5.2, -0.3, 0.5, 0.4, 0.7, 0.3), -1.6, "dirt about lamp")
    dirt.by_height(canvas, 0.9, 0.0, -1.5, 0.4)
    dirt.by_height(canvas, 2.2, 2.9, -0.9, 0.5)
    dirt.streaks(canvas, 1.5, 2.7, -0.8, 0.25)
    dirt.old_salt(canvas, 8.0, -1.2, 0.16, 0.7, 3.0)
    dirt.old_salt(canvas, 16.1, 0.9, 0.2, 0.5, 2.6)
    dirt.old_run(canvas, 14.0, 0.4, right(2.6), right(1.3), -1.6, "dry wash of dirt", 4)
    dirt.old_run(canvas, 18.6, 0.2, right(2.0), right(1.2), -1.8, "rust below camera", 2)
    dirt.crack(canvas, (3.0, 1.1), (3.6, -0.8), -1.1)
    linings.floor(canvas, -5.0, 0.5)
    for side in (canvas.s[0] + 1.0, canvas.s[-1] - 0.9):
        dirt.wet_floor(canvas, 12.2, side, 0.9, 0.35, -3.0)
    canvas.stain(
        [blot(canvas, u, canvas.s[0] + y, 0.04, 0.04, 0.4, 0.1) for u, y in rng.uniform((0, 0.1), (LENGTH, 1.8), (60, 2))], -2.0
    )


def _leaks(canvas: Canvas) -> None:
    left, right = canvas.section.left, canvas.section.right
    salt = specks(canvas, stroke(canvas, [(12.0, 0.6), (12.0, left(1.6))], 0.035, 0.03, 0.5), 0.5, 0.1)
    canvas.leak(
        "wet joint",
        [
            stroke(canvas, [(12.0, 0.1), (12.0, left(0.1))], (0.07, 0.17), 0.08, 0.35),
            *runs(canvas, 11.9, 12.2, left(1.6), left(0.1), 2, (0.06, 0.1)),
        ],
        4.4,
        film=0.5,
        salt=[salt],
    )
    canvas.leak("wet joint", [stroke(canvas, [(18.0, -0.4), (18.0, right(0.15))], (0.05, 0.13), 0.07, 0.4)], 3.3)
    drip = stroke(canvas, [(5.6, 0.02), (8.2, -0.02)], 0.13, 0.1, 0.45)
    fringe = specks(canvas, stroke(canvas, [(6.2, 0.0), (7.8, 0.0)], 0.03, 0.02, 0.5), 0.5, 0.08)
    canvas.leak(
        "crown joint",
        [drip, *runs(canvas, 6.0, 8.0, -0.05, -0.7, 4, (0.07, 0.05))],
        3.9,
        film=0.5,
        salt=[fringe],
        salt_level=5.0,
    )
    canvas.leak("damp footing", [rising(canvas, 13.6, 17.2, "right", 0.5, 0.14)], 2.6)
    drying = blot(canvas, 21.2, 1.5, 0.75, 0.55, 0.5, 0.22)
    canvas.leak("drying patch", [drying], 2.3)
    canvas.stain(tidemark(drying), 1.0)
    canvas.leak("lifting hole", runs(canvas, 9.0, 9.02, -1.3, right(1.3), 1, (0.06, 0.09)), 4.2)
    canvas.leak("patch", [blot(canvas, 3.9, left(0.8), 0.5, 0.35, 0.3, 0.25), rising(canvas, 3.0, 4.9, "left", 0.45)], 3.5)
    canvas.leak(
        "damp joint",
        [stroke(canvas, [(22.0, -0.7), (22.0, right(1.2))], 0.08, 0.12, 0.35)],
        1.1,
        limit="Slight damp that streaks of dirt are as dark as.",
    )


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.015, np.random.default_rng(7007))
    _dirt(canvas)
    _leaks(canvas)
    # The units stand a few millimetres out of line.
    step = canvas.rng.normal(0, 0.005, int(LENGTH / UNIT) + 1)
    canvas.height += step[(canvas.u / UNIT).astype(int)].astype(np.float32)[:, None] * smooth((canvas.z - 0.1) / 0.2)[
        None, :
    ].astype(np.float32)
    alignment = Alignment(446_610.0, 5_410_083.0, 118.9, 265.0, 0.0, 0.015)
    phase = Instrument(
        -14.0,
        plateau=1.9,
        near=3.0,
        near_range=1.2,
        noise=0.32,
        weak=-34.0,
        limit=-47.0,
        step=0.05,
        drift=0.1,
        range_noise=0.0015,
        beam=0.0008,
    )
    stands = [(3.6, 0.2, 1.62), (9.4, -0.2, 1.6), (15.2, 0.25, 1.63), (20.8, -0.1, 1.6)]
    return static_survey(
        canvas, alignment, _fittings(canvas.section), phase, Matt(0.3), stands, (0.0, 1.2), 0.0048, 0.017, reference=(1.0, 20.0)
    )


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "arch-underpass",
    "precast",
    "joints of precast arches under paint and graffiti",
    "Pedestrian underpass of precast three-hinged arches of 2 m with a painted dado, tags, posters and soot of a "
    "fire; water at joints between units, along the crown hinge, at lifting holes and footings as in inspection "
    "guides for buried structures.",
    make,
)
