"""A pedestrian underpass: a painted concrete box with graffiti."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas
from .deliver import Site, deliver
from .fixtures import Block, Fixture, along_lining, on_lining
from .geometry import Alignment, Profile
from .laws import glossy, pulsed
from .leaks import Look, foot, joint, outlet, patch, streaks
from .scanner import Instrument, Static, Tunnel

_HALF, _TOP, _FLOOR = 2.4, 1.45, -1.45
_CORNER = _HALF - 0.2 + 0.1414 * 2
_FOOT = _CORNER + 2.7
_JOINTS = (3.6, 10.6, 17.6)


def _profile() -> Profile:
    half = np.array(
        [[0, _TOP], [_HALF - 0.2, _TOP - 0.0], [_HALF, _TOP - 0.2], [_HALF, _FLOOR], [2.25, _FLOOR - 0.03], [0, _FLOOR + 0.03]]
    )
    return Profile(half, half * (-1, 1), (_HALF, _FLOOR), (-_HALF, _FLOOR))


SITE = Site(
    name="underpass-box",
    alignment=Alignment(356940.2, 5645508.8, 52.6, np.radians(-63), slope=-0.012),
    profile=_profile(),
    length=22.0,
    pixel=0.007,
    instrument=Instrument(
        26.0, pulsed(1.4), glossy(0.2, 0.2, 0.14), noise=0.45, wobble=0.1, offset=0.25, blur=(0.002, 0.0004), target=False
    ),
    pattern=Static(((2.6, 0.2, -0.12), (8.4, -0.2, -0.1), (14.0, 0.15, -0.13), (19.6, 0.0, -0.12)), step=0.0034, density=1500),
    seed=7070,
)


def _lining(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    everything = canvas.lining()
    dry.texture(canvas, everything, 0.3, 2.0, 0.05)
    dry.bumps(canvas, everything, 0.0015, 2.0, 0.1)
    bounds = [-1.0, *_JOINTS, canvas.length + 1]
    for s1, s2 in pairwise(bounds):
        dry.tone(canvas, s1, s2 - canvas.pixel, p.foot_left, p.foot_right, rng.normal(0, 0.4), step=rng.normal(0, 0.003))
        for s in np.arange(s1 + 1.2, s2 - 0.4, 1.2):
            dry.groove(canvas, [(s, -_CORNER), (s, _CORNER)], 0.006, rng.normal(-0.5, 0.3), -0.001)
    for s in _JOINTS:
        dry.groove(canvas, [(s, p.foot_left), (s, p.foot_right)], 0.012, -3.0, 0.01)
    for side in (-1, 1):
        upper = canvas.window(-0.3, canvas.length + 0.3, side * (_CORNER + 0.05), side * _FOOT)
        canvas.base[upper.at] += 1.6
        plinth = canvas.window(-0.3, canvas.length + 0.3, side * (_FOOT - 0.75), side * _FOOT)
        canvas.base[plinth.at] -= 2.2
        canvas.note("painted plinth", plinth, np.ones(plinth.shape, dtype=bool))


def _dirt(canvas: Canvas) -> None:
    rng = canvas.rng
    for s, u, long, high, change in (
        (1.2, -4.3, 1.7, 0.9, -3.2),
        (6.0, -4.1, 2.2, 0.9, -2.4),
        (12.2, -4.2, 1.3, 0.7, 1.2),
        (18.4, -4.4, 1.9, 1.0, -3.6),
        (4.6, 3.2, 1.8, 0.8, -2.8),
        (11.6, 3.3, 2.4, 0.9, -3.4),
        (16.0, 3.1, 1.2, 0.7, -2.0),
    ):
        dry.graffiti(canvas, s, u, long, high, change)
    for s, u, long, high, change in (
        (9.0, -4.3, 1.2, 1.0, -1.0),
        (14.4, -4.35, 1.5, 1.1, 0.9),
        (8.2, 3.0, 1.4, 1.1, -0.9),
        (19.2, 3.1, 1.1, 1.0, -1.2),
    ):
        window = canvas.window(s - 0.2, s + long + 0.2, u - 0.2, u + high + 0.2)
        box = np.minimum(np.minimum(window.s - s, s + long - window.s), np.minimum(window.u - u, u + high - window.u))
        dry.paint(canvas, window, box, change, "painted over", 0.03, 0.02, 0.2)
    for side in (-1, 1):
        dry.band(canvas, 0, canvas.length, side * (_FOOT - 0.22), side * _FOOT, -1.2, "splash", 0.15, 0.05)
        for _ in range(14):
            s = rng.uniform(0.3, 21.5)
            dry.blot(canvas, s, side * (_FOOT - rng.uniform(0.3, 1.3)), 0.09, 0.07, -1.5, "scuffs", 0.05, 0.03)
        for _ in range(8):
            dry.run(canvas, rng.uniform(0.4, 21.6), side * (_CORNER + 0.1), rng.uniform(0.3, 1.2), 0.02, -1.3, "dirt run")
    dry.band(canvas, 0, canvas.length, -0.35, 0.35, -0.7, "dust of the ceiling", 0.3, 0.1)
    for s, u, a, b in ((5.0, -0.9, 0.5, 0.4), (13.2, 1.1, 0.4, 0.5), (20.4, 0.4, 0.45, 0.35)):
        dry.tide_mark(canvas, s, u, a, b, -2.0)
    for s, u, long, high, change in ((6.6, 0.7, 0.9, 0.7, -1.8), (15.4, -1.6, 1.1, 0.6, 1.3)):
        dry.repair(canvas, s, u, long, high, change)
    dry.groove(canvas, [(17.6, -_FOOT), (17.6, -0.6)], 0.045, -2.3, -0.002, "sealed joint")
    for s1, u1, s2, u2 in ((1.5, 0.3, 3.3, 1.4), (12.0, -0.5, 13.6, -1.9)):
        dry.groove(canvas, dry.wander(rng, (s1, u1), (s2, u2), 0.12), 0.014, -2.0, 0.0, "sealed crack")


def _water(canvas: Canvas) -> None:
    low, high = canvas.profile.foot_left + 0.005, canvas.profile.foot_right - 0.005
    a, b, _ = _JOINTS
    joint(canvas, [(b, -1.9), (b, 0.7)], 0.1, Look(3.4, rough=0.03, salt=2.0))
    joint(canvas, [(b, 2.7), (b, _FOOT)], 0.1, Look(4.2, edge=(0.012, 0.06)), tongues=[(0.3, 0.8, 0.08, 1)], stop=high)
    joint(canvas, [(a, -_FOOT), (a, -2.9)], 0.09, Look(2.8), tongues=[(0.8, 0.7, 0.08, -1)], stop=low)
    joint(
        canvas,
        [(13.3, 2.33), (16.6, 2.35)],
        0.08,
        Look(3.0),
        "wet corner",
        [(0.2, 0.9, 0.07, 1), (0.55, 0.6, 0.09, 1), (0.8, 1.3, 0.06, 1)],
    )
    foot(canvas, 4.8, 9.6, 1, 0.33, Look(2.4, edge=(0.03, 0.12), rough=0.04, salt=1.4), waves=1.5)
    foot(canvas, 11.6, 15.0, -1, 0.5, Look(3.2, edge=(0.02, 0.12), rough=0.04), waves=1.2)
    patch(canvas, 19.2, -1.2, 0.55, 0.45, Look(2.0, edge=(0.05, 0.16), rough=0.06), "patch")
    outlet(canvas, 8.0, -1.72, 0.7, 0.17, Look(3.6, edge=(0.02, 0.07)), "lamp", side=-1, widen=0.9)
    streaks(canvas, [20.1, 20.35, 20.7, 20.9], -2.6, [0.9, 1.6, 0.7, 1.2], 0.045, Look(3.0, rough=0.015))
    patch(
        canvas,
        2.0,
        1.9,
        0.4,
        0.16,
        Look(0.6, edge=(0.15, 0.3), rough=0.05),
        "patch",
        "Hardly darker than the ceiling about it.",
    )
    patch(canvas, 16.9, -0.4, 0.13, 0.11, Look(2.6), "drip")


def _fixtures(canvas: Canvas) -> list[Fixture]:
    p = canvas.profile
    out: list[Fixture] = []
    for side in (-1, 1):
        for s in np.arange(1.5, 22, 3.2):
            out.append(on_lining(p, float(s), side * 1.55, 1.2, 0.18, 0.1, 3.0))
        rail = side * (_FOOT - 0.95)
        out.append(along_lining(p, rail, 0.08, 0.022, 0.5))
        for s in np.arange(0.8, 22, 1.5):
            out.append(on_lining(p, float(s), rail, 0.03, 0.04, 0.07, 0.5))
    out.append(along_lining(p, 1.3, 0.03, 0.014, 1.0))
    out.append(on_lining(p, 10.0, -3.4, 0.9, 1.2, 0.05, 2.0, gap=0.02))
    out.append(on_lining(p, 18.3, 3.3, 0.5, 0.7, 0.03, 3.5, gap=0.01))
    out.append(on_lining(p, 5.4, 0.1, 0.2, 0.2, 0.12, 1.5))
    out.append(on_lining(p, 15.6, -3.0, 0.3, 0.4, 0.12, 0.5))
    out.append(Block(21.0, 1.9, -1.2, 0.35, 0.35, 0.5, -1.0))
    return out


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 1.8
        dry.texture(canvas, floor, 0.8, 1.0, 0.03, 0.8)
    _water(canvas)
    dry.grain(canvas, 0.22)
    return Tunnel(site.alignment, canvas, _fixtures(canvas))


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="cast",
    phenomenon="wet joints and corners among graffiti",
    description=(
        "Pedestrian underpass, a box with painted walls and a dark plinth: water at block joints, the "
        "corner of the ceiling, a lamp, damp feet; "
        "graffiti, painted-over graffiti, scuffs, splash, sealed joints and cracks, dried stains. No reference."
    ),
    make=_make,
)
