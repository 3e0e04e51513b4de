"""Escape gallery beside a base tunnel, sprayed a few years ago and dry."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas
from .field import static_survey
from .fittings import Cuboid, Fitting, hung, mounted, upright
from .instrument import Instrument, Matt
from .section import Alignment, Section, arc
from .shapes import blot, rectangle, smooth, specks, stroke, wander
from .survey import Survey

LENGTH = 28.0


def _section() -> Section:
    floor = [(0.0, 0.0), (1.7, -0.03), (1.72, -0.12), (1.9, -0.12), (1.92, 0.0)]
    return Section(floor, [(1.92, 0.0), (2.0, 1.6), *arc((0.0, 1.6), 2.0, 0, 90)[1:]])


def _fittings(section: Section) -> list[Fitting]:
    things = []
    y, z = section.locate(section.left(2.75))
    things.append(Fitting(Cuboid((LENGTH / 2, y + 0.2, z - 0.05), (LENGTH, 0.25, 0.012)), -5.0, 0.3))
    things += [Fitting(Cuboid((LENGTH / 2, y + 0.2 + d, z - 0.02), (LENGTH, 0.01, 0.06)), -5.0, 0.3) for d in (-0.12, 0.12)]
    for u in np.arange(2.0, LENGTH, 5.0):
        things.append(Fitting(mounted(section, u, -0.5, (1.25, 0.16, 0.1), 0.1), -2.5, 0.4))
    for u in np.arange(4.2, LENGTH, 8.0):
        things.append(Fitting(mounted(section, u, section.right(1.7), (0.5, 0.25, 0.02), 0.06), 6.0, retro=True))
    things.append(Fitting(hung(section, 0, LENGTH, section.right(0.5), 0.05, 0.08, 3, 0), -5.5, 0.3))
    things.append(Fitting(hung(section, 0, LENGTH, section.right(2.2), 0.015, 0.08, 1.0, 0.02), -10.0))
    things.append(Fitting(hung(section, 0, LENGTH, section.right(1.0), 0.02, 0.1, 2.0, 0), -4.0, 0.6))
    things.append(Fitting(mounted(section, 13.4, section.left(1.4), (0.8, 1.0, 0.3), 0.03), -4.0, 0.4))
    things += [Fitting(r, -8.0) for r in upright(section, 13.4, section.left(1.9), section.left(2.75), 0.02, 0.06)]
    things.append(Fitting(mounted(section, 22.5, section.right(1.4), (0.3, 0.8, 0.25), 0.03), -2.0, 0.4))
    for u, s in ((7.3, section.left(0.6)), (16.2, section.right(0.3)), (24.3, section.left(0.6))):
        things.append(Fitting(mounted(section, u, s, (0.35, 0.35, 0.04), 0.02), -5.0, 0.4))
    return things


def _dirt(canvas: Canvas) -> None:
    section, rng = canvas.section, canvas.rng
    left, right = section.left, section.right
    linings.shotcrete(canvas, -4.2, 0.022, 0.7)
    # Advances of 1.2 m, sprayed on different days.
    advance = rng.normal(0, 0.5, int(LENGTH / 1.2) + 2)
    edge = canvas.u[:, None] + 0.12 * canvas.noise(1.5, 3)
    canvas.base += advance[np.clip((edge / 1.2).astype(int), 0, len(advance) - 1)].astype(np.float32)
    for u, s, a, b, level in (
        (3.3, 1.2, 1.1, 0.8, -2.0),
        (9.4, right(1.6), 0.8, 0.9, -1.6),
        (17.6, left(1.9), 1.4, 0.8, -2.2),
        (20.7, -0.4, 0.6, 0.5, 1.6),
        (25.4, right(2.3), 1.0, 0.6, -1.5),
    ):
        canvas.stain(blot(canvas, u, s, a, b, 0.15, 0.22), level, "younger shotcrete" if level < 0 else "paler shotcrete")
    canvas.stain(blot(canvas, 11.6, 0.2, 2.3, 1.0, 0.8, 0.3), -3.2, "soot of the fire test")
    plume = [
        stroke(canvas, wander(rng, (11.2 + d, left(0.4)), (11.4 + 1.3 * d, left(2.9)), 0.3), (0.12, 0.3), 0.25, 0.4)
        for d in (-0.3, 0.2, 0.7)
    ]
    canvas.stain(plume, -2.6, "soot of the fire test")
    canvas.stain(rectangle(canvas, 5.9, 7.0, right(0.7), right(1.9), 0.05, 0.03), -1.3, "smoothed panel")
    canvas.stain(rectangle(canvas, 14.6, 15.6, left(2.2), left(1.7), 0.02), 2.8, "painted number")
    dirt.by_height(canvas, 0.9, 0.05, 1.2, 0.5)
    dirt.by_height(canvas, 2.6, 3.5, -0.7, 0.6)
    # Half pipes of drainage below the last layer show as stripes from foot to foot.
    for u in (7.3, 16.2, 24.3):
        stripe = stroke(
            canvas, [(u, section.foot_right + 0.1), (u + 0.1, 0.0), (u - 0.05, section.foot_left - 0.1)], 0.16, 0.08, 0.15
        )
        canvas.stain(stripe, -1.1, "stripe over drainage pipe")
        canvas.height[stripe.window] += 0.03 * stripe.weight
    dirt.old_run(canvas, 24.3, 0.3, left(0.9), left(0.1), 2.4, "dry sinter", 3)
    dirt.old_run(canvas, 16.2, 0.3, right(0.5), right(0.05), 2.0, "dry sinter", 2)
    dirt.old_run(canvas, 13.4, 0.5, left(0.9), left(0.1), -1.7, "rust below box", 3)
    dirt.old_run(canvas, 2.0, 0.5, 0.9, left(1.3), -1.6, "dry trace of curing water", 4)
    dirt.old_run(canvas, 19.2, 1.2, right(2.3), right(0.6), -1.8, "dry trace of curing water", 5)
    canvas.stain(specks(canvas, blot(canvas, 22.0, left(0.8), 1.2, 0.5, 0.5, 0.3), 0.6, 0.2), -1.8, "mud splashes")
    canvas.stain(
        stroke(canvas, wander(rng, (26.2, right(0.9)), (27.6, right(1.1)), 0.2), 0.05, 0.03, 0.5), -3.0, "scrape with rubber"
    )
    dirt.old_salt(canvas, 18.9, 1.0, 0.5, 0.3, 2.2)
    dirt.crack(canvas, (8.6, 2.4), (10.0, -1.4), -1.6)
    dirt.crack(canvas, (21.0, right(1.5)), (22.4, 1.8), -1.4)
    pins = canvas.noise(0.09, 1)
    canvas.base -= (1.5 * smooth((pins - 2.8) / 0.4)).astype(np.float32)
    linings.floor(canvas, -5.0, 0.5)


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.015, np.random.default_rng(7008))
    _dirt(canvas)
    alignment = Alignment(717_366.0, 5_178_902.0, 1108.2, 154.0, 1 / 500, 0.009)
    pulsed = Instrument(
        31.0, near=6.0, near_range=1.4, noise=0.35, weak=7.0, limit=1.0, drift=0.18, range_noise=0.003, mixing=0.3
    )
    stands = [(3.2, 0.2, 1.65), (10.0, -0.2, 1.62), (17.0, 0.15, 1.66), (24.2, -0.2, 1.63)]
    return static_survey(canvas, alignment, _fittings(canvas.section), pulsed, Matt(0.4), stands, (0.0, 1.4), 0.0045, 0.019, 8)


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "escape-gallery",
    "shotcrete",
    "no leak: patchy sprayed concrete, soot, dust, traces of curing water",
    "Escape gallery sprayed over a waterproofing spray and drained: dry, but patched with younger concrete, sooted by "
    "a fire test, with stripes over drainage pipes, sinter at outlets that run no more, rust and mud; pulsed scanner "
    "without a reference curve.",
    make,
)
