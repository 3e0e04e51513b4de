"""Metro tunnel bored in the 2010s, lined with segments, in service with all its equipment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..scene import Scene
from . import dirt, linings
from .canvas import Canvas
from .field import mobile_survey
from .fittings import Cuboid, Fitting, Rod, hung, mounted
from .instrument import Instrument, Matt
from .section import Alignment, Section, arc
from .shapes import blot, rectangle, rising, runs, smooth, specks, stroke
from .survey import Survey

LENGTH = 27.0
RING = 1.5
RADIUS = 2.9
# Angles of the longitudinal joints from the middle of the key, in degrees.
JOINTS = (-8.0, 8.0, 76.0, 142.0, -142.0, -76.0)


def _section() -> Section:
    # The middle of the bore is 1.75 m above the slab; on the left lies the walkway for escape.
    centre = (0.0, 1.75)
    foot_right = np.degrees(np.arcsin(-1.75 / RADIUS))
    foot_left = 180 - np.degrees(np.arcsin((0.95 - 1.75) / RADIUS))
    right, left = arc(centre, RADIUS, foot_right, 90), arc(centre, RADIUS, foot_left, 90)
    return Section([(0.0, 0.0), right[0]], right, [(0.0, 0.0), (-1.75, 0.0), (-1.77, 0.95), left[0]], left)


def _fittings(section: Section) -> list[Fitting]:
    things = [Fitting(Cuboid((LENGTH / 2, y, 0.1), (LENGTH, 0.07, 0.17)), -6.0, 0.4) for y in (-0.75, 0.75)]
    for u in np.arange(0.3, LENGTH, 0.7):
        things += [Fitting(Cuboid((u, y, 0.05), (0.2, 0.4, 0.06)), -4.5) for y in (-0.75, 0.75)]
    heights = (1.0, 1.16, 1.32, 1.48, 1.64, 2.3, 2.46)
    for k, z in enumerate(heights):
        things.append(Fitting(hung(section, 0, LENGTH, section.right(z), 0.016 + 0.005 * (k % 3), 0.1, RING / 2, 0.012), -11.0))
    for u in np.arange(0.4, LENGTH, RING / 2):
        things.append(Fitting(mounted(section, u, section.right(1.32), (0.04, 0.8, 0.1)), -5.0, 0.2))
        things.append(Fitting(mounted(section, u, section.right(2.38), (0.04, 0.28, 0.1)), -5.0, 0.2))
    things.append(Fitting(hung(section, 0, LENGTH, section.left(1.35), 0.075, 0.08, 3, 0), -5.5, 0.4))
    things.append(Fitting(hung(section, 0, LENGTH, section.left(2.2), 0.02, 0.05, 1, 0), -4.0, 0.3))
    things.append(Fitting(hung(section, 0, LENGTH, section.left(3.9), 0.018, 0.08, RING, 0.02), -11.0))
    things.append(Fitting(hung(section, 0, LENGTH, section.right(4.1), 0.022, 0.07, RING, 0.02), -10.0))
    things.append(Fitting(Cuboid((LENGTH / 2, 0.0, 4.32), (LENGTH, 0.09, 0.11)), -2.5, 0.5))
    for u in np.arange(2.0, LENGTH, 8.0):
        things += [Fitting(Rod((u, y, 4.36), (u, y, 4.66), 0.025), -5.0) for y in (-0.3, 0.3)]
        things.append(Fitting(Cuboid((u, 0.0, 4.42), (0.08, 0.8, 0.08)), -5.0, 0.2))
    for u in np.arange(3.3, LENGTH, 9.0):
        things.append(Fitting(mounted(section, u, section.left(3.3), (1.25, 0.14, 0.11), 0.04), -2.5, 0.5))
    things.append(Fitting(mounted(section, 8.3, section.right(3.1), (0.5, 0.7, 0.25), 0.03), -4.0, 0.4))
    things.append(Fitting(mounted(section, 19.1, section.left(2.6), (0.4, 0.6, 0.2), 0.03), -4.0, 0.4))
    things.append(Fitting(mounted(section, 13.0, section.right(2.9), (0.3, 0.4, 0.01), 0.02), 7.0, retro=True))
    things.append(Fitting(mounted(section, 23.4, section.left(2.55), (0.45, 0.22, 0.01), 0.02), 5.0, retro=True))
    things.append(Fitting(Cuboid((16.4, 0.0, 0.08), (0.5, 0.4, 0.08)), 1.0, 0.2))
    return things


def _places(ring: int) -> np.ndarray:
    """Places on the girth of the joints of a ring."""
    turn = 22.5 if ring % 2 else -22.5
    angles = np.mod(np.array(JOINTS) + turn + 180, 360) - 180
    return np.radians(angles) * RADIUS


def _segments(canvas: Canvas) -> None:
    rng = canvas.rng
    canvas.base += -3.6 + 0.25 * canvas.noise(2.0, 4) + 0.2 * canvas.noise(0.1, 2)
    for ring in range(int(LENGTH / RING)):
        u0 = ring * RING
        rows = (canvas.u >= u0) & (canvas.u < u0 + RING)
        joints = np.sort(_places(ring))
        which = np.searchsorted(joints, canvas.s) % len(joints)
        tone, step = rng.normal(0, 0.45, len(joints)), rng.normal(0, 0.003, len(joints))
        line = np.abs(canvas.s[None, :] - joints[:, None]).min(axis=0) < 0.008
        canvas.base[rows] += (tone[which] - 2.5 * line)[None, :].astype(np.float32)
        canvas.height[rows] += (step[which] - 0.012 * line)[None, :].astype(np.float32)
        for k, joint in enumerate(joints):
            middle = (joint + joints[(k + 1) % len(joints)]) / 2
            if k + 1 < len(joints):
                canvas.stain(blot(canvas, u0 + RING / 2, middle, 0.045, 0.045, 0.3, 0.0), -3.5)
            for du in (0.35, 1.15):
                pocket = rectangle(canvas, u0 + du - 0.06, u0 + du + 0.06, joint + 0.1, joint + 0.28, 0.02)
                canvas.stain(pocket, -1.8)
                canvas.height[pocket.window] -= 0.07 * pocket.weight
        seam = np.abs(canvas.u - u0) < 0.008
        canvas.base[seam] -= 2.5
        canvas.height[seam] -= 0.012


def _dirt(canvas: Canvas) -> None:
    left, right = canvas.section.left, canvas.section.right
    _segments(canvas)
    dirt.by_height(canvas, 1.8, 0.2, -1.8, 0.3)
    dirt.by_height(canvas, 3.8, 4.65, -1.0, 0.4)
    canvas.stain(rectangle(canvas, 4.3, 4.75, right(3.0), right(3.4), 0.02, 0.02), 1.5, "repair mortar")
    canvas.stain(rectangle(canvas, 14.7, 15.3, 0.9, 1.6, 0.03, 0.02), -1.7, "repair mortar")
    canvas.stain(rectangle(canvas, 10.2, 11.1, left(3.2), left(2.8), 0.02), 3.0, "painted ring number")
    canvas.stain(blot(canvas, 8.4, -0.1, 1.3, 0.35, 0.6, 0.3), -2.4, "brush dust at conductor rail")
    canvas.stain(blot(canvas, 18.2, 0.15, 1.0, 0.3, 0.6, 0.3), -2.0, "brush dust at conductor rail")
    resin = [
        stroke(canvas, [(19.5, -2.4), (19.5, -0.9)], 0.06, 0.03, 0.4),
        *runs(canvas, 19.4, 19.6, -2.4, -3.0, 2, (0.02, 0.03)),
    ]
    canvas.stain(resin, 2.0, "injection resin")
    for u, s in ((19.45, -1.1), (19.55, -1.5), (19.44, -1.9), (19.56, -2.3)):
        canvas.stain(blot(canvas, u, s, 0.025, 0.025, 0.3, 0.0), -4.0)
    dirt.old_run(canvas, 24.0, 0.3, left(3.0), left(1.5), -1.8, "grease", 3)
    dirt.old_run(canvas, 8.3, 0.4, right(2.7), right(1.7), -1.6, "rust below box", 3)
    dirt.old_salt(canvas, 12.0, 1.9, 0.12, 0.5, 2.8)
    canvas.stain(stroke(canvas, [(6.0, left(2.7)), (6.02, left(1.2))], 0.12, 0.08, 0.4), -1.5, "dry trace of sealed leak")
    dirt.crack(canvas, (21.2, 1.2), (22.3, 1.4), -1.3)
    linings.floor(canvas, -4.8, 0.5)


def _leaks(canvas: Canvas) -> None:
    left, right = canvas.section.left, canvas.section.right
    canvas.leak(
        "wet joint",
        [
            stroke(canvas, [(9.0, -1.2), (9.0, right(0.3))], (0.05, 0.13), 0.06, 0.35),
            *runs(canvas, 8.95, 9.15, right(2.0), right(0.2), 2, (0.05, 0.09)),
        ],
        4.4,
        film=0.6,
    )
    joint = float(np.sort(_places(2))[3])
    salt = specks(canvas, stroke(canvas, [(3.3, joint), (4.3, joint)], 0.03, 0.02, 0.4), 0.5, 0.08)
    canvas.leak(
        "wet joint",
        [
            stroke(canvas, [(3.05, joint), (4.45, joint)], 0.08, 0.06, 0.4),
            stroke(canvas, [(4.5, joint - 0.3), (4.5, joint + 0.9)], (0.05, 0.1), 0.06, 0.4),
        ],
        3.7,
        salt=[salt],
    )
    canvas.leak("lifting hole", runs(canvas, 12.74, 12.76, left(3.55), left(1.1), 1, (0.05, 0.1)), 4.0, film=0.4)
    canvas.leak(
        "wet joint",
        [
            stroke(canvas, [(16.5, left(4.2)), (16.5, left(1.0))], (0.06, 0.16), 0.08, 0.3),
            rising(canvas, 15.7, 17.8, "left", 0.5),
        ],
        3.4,
    )
    canvas.leak("crown drip", [blot(canvas, 21.0, 0.55, 0.35, 0.25, 0.3, 0.25)], 4.6, film=0.8)
    canvas.leak("patch behind cables", [blot(canvas, 22.9, right(1.3), 0.75, 0.5, 0.3, 0.22)], 3.5)
    canvas.leak(
        "bolt pocket",
        [blot(canvas, 24.35, 1.85, 0.2, 0.25, 0.35, 0.2), *runs(canvas, 24.3, 24.4, 1.9, 2.9, 1, (0.07, 0.04))],
        3.8,
    )
    canvas.leak("damp footing", [rising(canvas, 1.6, 5.8, "right", 0.45, 0.12)], 2.6)
    canvas.leak(
        "damp joint",
        [stroke(canvas, [(25.5, 0.6), (25.5, 2.4)], 0.07, 0.1, 0.3)],
        1.1,
        limit="As dark as dust along other joints.",
    )


def survey() -> Survey:
    """Tunnel, scan and truth."""
    canvas = Canvas(_section(), LENGTH, 0.015, np.random.default_rng(7005))
    _dirt(canvas)
    _leaks(canvas)
    # Joints collect dust here and there without any water.
    canvas.base -= (
        0.8 * smooth(canvas.noise(1.2, 3) - 1.0) * (np.abs(np.mod(canvas.u + 0.75, RING) - 0.75) < 0.09)[:, None]
    ).astype(np.float32)
    alignment = Alignment(683_940.0, 5_335_027.0, 498.3, 84.0, 1 / 350, -0.012)
    profiler = Instrument(
        -6.0,
        plateau=1.6,
        near=2.0,
        near_range=1.5,
        noise=0.28,
        weak=-28.0,
        limit=-42.0,
        step=0.02,
        drift=0.15,
        range_noise=0.0012,
        beam=0.0007,
    )
    return mobile_survey(
        canvas,
        alignment,
        _fittings(canvas.section),
        profiler,
        Matt(0.3),
        (0.0, 1.85),
        (0.0, 1.75),
        0.018,
        0.0055,
        1.1,
        tilt=0.12,
        steps=4,
        reference=(0.5, 8.0),
    )


def make(folder: Path) -> None:
    """Write the scene into a folder."""
    survey().write(folder)


SCENE = Scene(
    "metro-tbm",
    "segments",
    "joints, bolt pockets and lifting holes behind full equipment",
    "Bored metro of 5.8 m with universal rings of 1.5 m, walkway, cable racks, fire main, conductor rail, lamps; "
    "water at ring joints, T-joints, lifting holes and pockets as in the ITA's report on segment damage; oblique "
    "profile scanner at 1.1 m/s.",
    make,
)
