"""A double-track railway tunnel of cast concrete, in blocks of ten metres."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas
from .deliver import Site, deliver
from .fixtures import Bar, Block, Fixture, Niche, along_lining, on_lining
from .geometry import Alignment, Profile, arc
from .laws import matt, phase
from .leaks import Look, foot, joint, outlet, patch, streaks
from .scanner import Instrument, Mobile, Tunnel

_FLOOR = -2.1
_JOINTS = (3.2, 13.2, 23.2, 33.2)
_SPRING = 4.9 * np.pi / 2


def _profile() -> Profile:
    half = np.concatenate(
        [arc((0, 0), 4.9, 0, 90), [[4.86, -0.8], [4.75, _FLOOR], [3.75, _FLOOR], [3.7, -2.45], [0.5, -2.45], [0, -2.5]]]
    )
    return Profile(half, half * (-1, 1), (4.75, _FLOOR), (-4.75, _FLOOR))


SITE = Site(
    name="rail-cast",
    alignment=Alignment(541872.0, 5706114.6, 187.4, np.radians(-112), radius=-950.0, slope=0.0125),
    profile=_profile(),
    length=36.0,
    pixel=0.01,
    instrument=Instrument(24.0, phase(3.5, 18.0, 0.06), matt(0.22), noise=0.4, wobble=0.2, blur=(0.0025, 0.0004)),
    pattern=Mobile(-2.1, -0.1, speed=1.25, turns=50, per_turn=1900, density=3600),
    seed=2020,
    ranges=(1.0, 16.0),
)


def _lining(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    everything = canvas.lining()
    dry.texture(canvas, everything, 0.4, 3.0, 0.08)
    dry.bumps(canvas, everything, 0.003, 4.0, 0.1)
    bounds = [-1.0, *_JOINTS, canvas.length + 1]
    for s1, s2 in pairwise(bounds):
        dry.tone(canvas, s1, s2 - canvas.pixel, p.foot_left, p.foot_right, rng.normal(0, 0.5), step=rng.normal(0, 0.003))
        for s in np.arange(s1 + 1.6, s2 - 0.5, 1.65):
            dry.groove(canvas, [(s, -_SPRING), (s, _SPRING)], 0.01, rng.normal(-0.5, 0.4), 0.001)
            dry.tone(canvas, s, s + 1.65, -_SPRING, _SPRING, rng.normal(0, 0.2))
    for s in _JOINTS:
        dry.groove(canvas, [(s, p.foot_left), (s, p.foot_right)], 0.011, -2.8, 0.014)
    for side in (-1, 1):
        dry.groove(canvas, dry.wander(rng, (0, side * 7.45), (canvas.length, side * 7.45), 0.05), 0.012, -1.6, 0.002)
        wall = canvas.window(-0.3, canvas.length + 0.3, side * 7.45, p.foot_right * side)
        canvas.base[wall.at] += -0.4
        dry.boards(canvas, wall, 0.5, 0.15, 0.0008)
    for u in np.arange(-6.3, 6.4, 2.1):
        dry.groove(canvas, [(0, u), (canvas.length, u)], 0.008, -0.5, 0.001)


def _dirt(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    low = p.foot_left
    dry.band(canvas, 0, canvas.length, low, low + 0.55, -1.7, "splash", 0.25, 0.08)
    dry.band(canvas, 14.0, canvas.length, p.foot_right - 0.45, p.foot_right, -1.4, "splash", 0.2, 0.08)
    dry.band(canvas, 0, canvas.length, -2.9, -1.6, -0.9, "soot", 0.9, 0.15)
    dry.band(canvas, 0, canvas.length, 1.7, 2.8, -0.8, "soot", 0.9, 0.15)
    for s, u, long, high, change in ((5.1, -6.4, 1.2, 0.8, -1.9), (16.4, 3.4, 0.9, 0.9, -1.5), (27.2, 7.8, 1.6, 0.6, -2.2)):
        dry.repair(canvas, s, u, long, high, change)
    dry.repair(canvas, 30.5, -3.9, 0.7, 1.1, 1.2)
    for s1, u1, s2, u2 in ((6.2, 1.5, 8.4, 4.0), (17.0, -1.0, 20.5, -2.1), (28.5, 3.0, 29.2, 6.4)):
        dry.groove(canvas, dry.wander(rng, (s1, u1), (s2, u2), 0.15), 0.018, -2.2, 0.0, "sealed crack")
    for s, u, a, b in ((9.8, -4.6, 0.5, 0.7), (21.3, 5.2, 0.7, 0.4), (32.0, 1.2, 0.45, 0.45)):
        dry.tide_mark(canvas, s, u, a, b, -1.8)
    for s, u, a, b, change in ((2.0, 5.0, 0.5, 0.4, -1.4), (12.1, -7.9, 0.35, 0.5, -1.8), (25.1, -1.0, 0.6, 0.5, -1.2)):
        dry.blot(canvas, s, u, a, b, change, "grime", 0.15, 0.06)
    for _ in range(8):
        dry.run(
            canvas, rng.uniform(1, 35), rng.choice([-1, 1]) * rng.uniform(5, 8), rng.uniform(0.3, 1.0), 0.02, 2.2, "lime run"
        )
    for _ in range(7):
        dry.run(
            canvas,
            rng.uniform(1, 35),
            rng.choice([-1, 1]) * rng.uniform(6, 8.5),
            rng.uniform(0.3, 0.8),
            0.018,
            -2.0,
            "rust run",
        )
    dry.groove(canvas, [(23.2, -8.5), (23.2, -1.0)], 0.06, -2.0, -0.003, "sealed joint")
    dry.graffiti(canvas, 31.2, 7.9, 1.8, 0.8, -2.6)
    for s in (8.0, 18.0, 28.0):
        dry.tone(canvas, s, s + 0.4, -8.2, -7.9, 3.0, "painted number")


def _water(canvas: Canvas) -> None:
    p = canvas.profile
    low, high = p.foot_left + 0.005, p.foot_right - 0.005
    a, b, _, d = _JOINTS
    joint(canvas, [(a, 3.6), (a, 7.2)], 0.11, Look(3.6, salt=1.5), tongues=[(0.55, 1.2, 0.1, 1), (0.95, 1.0, 0.12, 1)])
    joint(canvas, [(b, -9.6), (b, -6.1)], 0.12, Look(4.4), tongues=[(0.4, 0.6, 0.08, -1)], stop=low)
    joint(canvas, [(b, -0.6), (b, 1.9)], 0.14, Look(2.3, edge=(0.04, 0.16), rough=0.04))
    joint(canvas, [(d, 5.2), (d, 9.7)], 0.12, Look(5.0, edge=(0.012, 0.06)), tongues=[(0.3, 0.9, 0.1, 1)], stop=high)
    foot(canvas, 4.3, 12.4, 1, 0.42, Look(3.0, edge=(0.03, 0.16), rough=0.05, salt=1.0), waves=2.5)
    foot(canvas, 14.6, 19.0, -1, 0.75, Look(2.5, edge=(0.03, 0.2), rough=0.05), waves=2.0)
    foot(canvas, 25.5, 28.2, -1, 0.5, Look(3.6, edge=(0.02, 0.1), salt=1.6), waves=1.2)
    joint(canvas, [(14.6, 7.46), (20.9, 7.44)], 0.06, Look(2.8), "wet springline", [(0.25, 0.6, 0.09, 1), (0.62, 0.9, 0.08, 1)])
    crack = dry.wander(canvas.rng, (25.6, 0.9), (28.0, 2.5), 0.15)
    dry.groove(canvas, crack, 0.006, -1.5, 0.001)
    joint(canvas, crack, 0.07, Look(3.0), "wet crack", [(0.7, 0.7, 0.08, 1)])
    patch(canvas, 7.1, -2.2, 0.75, 0.55, Look(1.8, edge=(0.06, 0.2), rough=0.08), "patch")
    patch(canvas, 29.8, -5.6, 0.45, 0.8, Look(3.3, rough=0.05, salt=1.2), "patch")
    streaks(canvas, [9.1, 9.35, 9.75, 10.05, 10.2], 6.1, [0.9, 1.6, 1.1, 0.5, 1.2], 0.05, Look(2.9, rough=0.02))
    outlet(canvas, 20.6, -5.4, 1.7, 0.09, Look(4.2, edge=(0.012, 0.05)), "drain hole", widen=1.9)
    joint(canvas, [(22.0, 6.72), (22.0, 7.3)], 0.11, Look(3.2), "niche", [(0.9, 0.75, 0.1, 1)])
    patch(
        canvas,
        34.6,
        -0.8,
        0.5,
        0.4,
        Look(0.6, edge=(0.2, 0.4), rough=0.08),
        "patch",
        "Hardly darker than the concrete about it.",
    )
    patch(canvas, 18.2, 2.6, 0.15, 0.12, Look(3.0), "drip")


def _fixtures(canvas: Canvas) -> tuple[list[Fixture], list[Niche]]:
    rng, p = canvas.rng, canvas.profile
    out: list[Fixture] = []
    for z, radius in ((0.7, 0.025), (0.55, 0.03), (0.4, 0.02)):
        out.append(along_lining(p, p.height_u(z, -1), 0.13, radius, -3.5, sag=0.05, span=2.0, phase=0.5))
    for s in np.arange(0.5, 36, 2.0):
        out.append(on_lining(p, float(s), p.height_u(0.55, -1), 0.05, 0.45, 0.12, -2.0))
    out.append(along_lining(p, p.height_u(-1.1, 1), 0.09, 0.022, -0.5))
    for s in np.arange(1.0, 36, 2.4):
        out.append(on_lining(p, float(s), p.height_u(-1.1, 1), 0.04, 0.06, 0.08, -0.5))
    out.append(along_lining(p, p.height_u(2.4, 1), 0.16, 0.022, -4.0, sag=0.03, span=4.0))
    for y in (-2.1, 2.1):
        out.append(Bar(y, 3.1, 0.007, -2.0))
        out.append(Bar(y, 3.75, 0.008, -2.0, sag=0.2, span=18.0))
        for side in (-1, 1):
            out.append(Block(18, y + side * 0.7175, -2.16, 40, 0.07, 0.16, -2.5))
    for s in np.arange(0.3, 36, 0.6):
        for y in (-2.1, 2.1):
            out.append(Block(float(s + rng.normal(0, 0.015)), y, -2.33, 0.26, 2.6, 0.2, -0.5))
    for s in (6.0, 24.0):
        for y in (-2.1, 2.1):
            top = np.sqrt(4.9**2 - y**2)
            out.append(Block(s, y - 0.35, (top + 3.3) / 2, 0.12, 0.12, top - 3.2, -1.0))
            out.append(Block(s, y - 0.1, 3.45, 0.07, 0.9, 0.07, -1.0))
    for s in (4.0, 16.0, 28.0):
        out.append(on_lining(p, s, p.height_u(1.6, 1), 0.9, 0.16, 0.14, 2.0, gap=0.04))
        out.append(on_lining(p, s + 1.2, p.height_u(1.1, -1), 0.4, 0.3, 0.015, 3.5, gap=0.03))
    out.append(on_lining(p, 11.0, p.height_u(-0.7, -1), 0.6, 0.8, 0.3, -1.5))
    u2 = p.foot_right
    niches = [Niche(20.4, 21.8, u2 - 2.15, u2 - 0.02, 0.7, -1.2)]
    return out, niches


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        ballast = canvas.window(-0.3, canvas.length + 0.3, *(np.sign(floor.u[0, 0]) * np.array([11.3, canvas.profile.high])))
        canvas.base[floor.at] -= 1.2
        dry.texture(canvas, ballast, 1.2, 0.3, 0.04, 0.9)
        dry.bumps(canvas, ballast, 0.016, 0.16, 0.04, 0.8)
    _water(canvas)
    dry.grain(canvas, 0.25)
    fixtures, niches = _fixtures(canvas)
    return Tunnel(site.alignment, canvas, fixtures, niches)


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="cast",
    phenomenon="leaking block joints, damp feet of walls",
    description=(
        "Electrified double-track railway tunnel of cast blocks: water at block joints, at the joint "
        "between vault and wall, cracks, "
        "a niche and a drain hole, rising damp with salts; splash, soot, repairs, sealed cracks and dried "
        "stains. As in inspection "
        "manuals of railways for linings of plain concrete."
    ),
    make=_make,
)
