"""A two-lane road tunnel with painted walls, dry and dirty."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas, rectangle
from .deliver import Site, deliver
from .fixtures import Bar, Block, Fixture, Niche, along_lining, on_lining
from .geometry import Alignment, Profile, arc
from .laws import glossy, pulsed
from .scanner import Instrument, Mobile, Tunnel

_WALK, _ROAD = -1.4, -1.55
_JOINTS = (1.4, 13.4, 25.4)


def _profile() -> Profile:
    half = np.concatenate(
        [arc((0, 0), 5.1, 0, 90), [[5.06, -0.6], [4.95, _WALK], [4.0, _WALK], [3.98, _ROAD], [0, _ROAD + 0.08]]]
    )
    return Profile(half, half * (-1, 1), (4.95, _WALK), (-4.95, _WALK))


SITE = Site(
    name="road-painted",
    alignment=Alignment(612034.1, 5302877.5, 642.0, np.radians(78), radius=-620.0, slope=-0.03),
    profile=_profile(),
    length=34.0,
    pixel=0.01,
    instrument=Instrument(33.0, pulsed(1.3), glossy(0.2, 0.15, 0.15), noise=0.55, wobble=0.16, blur=(0.003, 0.0004)),
    pattern=Mobile(-1.9, 0.75, speed=1.3, turns=55, per_turn=2000, density=3300),
    seed=4040,
    ranges=(1.0, 16.0),
)


def _lining(canvas: Canvas) -> tuple[float, float]:
    """The concrete and its paint; returns where the paint ends on the left and on the right."""
    rng, p = canvas.rng, canvas.profile
    everything = canvas.lining()
    dry.texture(canvas, everything, 0.35, 3.0, 0.08)
    dry.bumps(canvas, everything, 0.003, 4.0, 0.1)
    bounds = [-1.0, *_JOINTS, canvas.length + 1]
    for s1, s2 in pairwise(bounds):
        dry.tone(canvas, s1, s2 - canvas.pixel, p.foot_left, p.foot_right, rng.normal(0, 0.4), step=rng.normal(0, 0.003))
        for s in np.arange(s1 + 2.0, s2 - 0.5, 2.0):
            dry.groove(canvas, [(s, -7.0), (s, 7.0)], 0.01, rng.normal(-0.3, 0.3), 0.001)
    top = (p.height_u(1.7, -1), p.height_u(1.7, 1))
    for side, u in zip((-1, 1), top, strict=True):
        foot = p.foot_left if side < 0 else p.foot_right
        wall = canvas.window(-0.3, canvas.length + 0.3, u, foot)
        canvas.base[wall.at] += 2.6 + 0.25 * canvas.fractal(wall, 0.8, 0.04)
    for s in _JOINTS:
        dry.groove(canvas, [(s, p.foot_left), (s, p.foot_right)], 0.013, -4.0, 0.006)
        for side in (-1, 1):
            dry.groove(canvas, [(s, side * 3.5), (s, side * 8.9)], 0.03, -1.8, -0.001, "sealed joint")
    return top


def _dirt(canvas: Canvas, top: tuple[float, float]) -> None:
    rng, p = canvas.rng, canvas.profile
    for foot, side in ((p.foot_left, -1), (p.foot_right, 1)):
        window = canvas.window(-0.3, canvas.length + 0.3, foot - side * 2.0, foot)
        above = np.abs(foot - window.u)
        splash = np.exp(-((above / 0.75) ** 1.5)) * np.clip(1 + 0.3 * canvas.fractal(window, 1.5, 0.04), 0.2, 1.7)
        canvas.base[window.at] -= (3.4 * splash).astype(np.float32)
        canvas.note("splash", window, splash > 0.5)
        for _ in range(60):
            s, u = rng.uniform(0, canvas.length), foot - side * rng.uniform(0.3, 1.6)
            dry.run(canvas, s, u, rng.uniform(0.1, 0.5), rng.uniform(0.008, 0.02), rng.uniform(-1.6, -0.6), "dirt run", side)
    for s1, s2, u1, u2, change in ((4.0, 10.5, 7.3, 8.1, 0.9), (15.0, 24.0, 7.1, 7.9, 0.8), (18.0, 31.0, -8.2, -7.4, 1.0)):
        dry.band(canvas, s1, s2, u1, u2, change, "cleaned", 0.06, 0.02)
    for s1, s2, u in ((6.0, 9.2, 8.5), (20.3, 22.0, -8.45), (26.4, 30.5, 8.55)):
        path = dry.wander(rng, (s1, u), (s2, u + 0.05), 0.03)
        dry.groove(canvas, path, rng.uniform(0.02, 0.045), -3.0, 0.001, "scrape of a vehicle")
    soot = canvas.window(-0.3, canvas.length + 0.3, top[0], top[1])
    shade = np.clip(1.1 - np.abs(soot.u) / 6.0, 0, 1) * np.clip(1 + 0.2 * canvas.fractal(soot, 3.0, 0.15), 0.3, 1.6)
    canvas.base[soot.at] -= (2.0 * shade).astype(np.float32)
    for s, u, a, b, change in ((7.5, 1.2, 0.9, 0.5, -1.6), (17.9, -1.4, 1.1, 0.6, -1.9), (28.6, 0.6, 0.7, 0.7, -1.4)):
        dry.blot(canvas, s, u, a, b, change, "soot", 0.25, 0.1)
    for s, u, a, b in ((10.3, -5.2, 0.5, 0.6), (22.7, 5.0, 0.6, 0.45), (31.4, -6.4, 0.35, 0.7)):
        dry.tide_mark(canvas, s, u, a, b, -2.2)
    for s, u, long, high, change in ((3.0, -8.3, 1.1, 0.7, -2.6), (12.0, 6.2, 0.8, 1.2, -1.8), (20.0, -3.6, 1.5, 0.9, -1.9)):
        dry.repair(canvas, s, u, long, high, change)
    dry.repair(canvas, 29.4, 3.4, 0.8, 0.6, 1.5)
    for s1, u1, s2, u2 in ((8.6, 2.0, 11.4, 4.7), (16.3, -2.6, 16.9, -6.5)):
        dry.groove(canvas, dry.wander(rng, (s1, u1), (s2, u2), 0.2), 0.02, -2.0, 0.0, "sealed crack")
    for s in np.arange(2.0, 34.0, 3.0):
        for side in (-1, 1):
            if rng.random() < 0.6:
                dry.run(
                    canvas,
                    s + rng.normal(0, 0.3),
                    side * 4.45,
                    rng.uniform(0.3, 1.3),
                    0.022,
                    rng.uniform(-2.4, -1.2),
                    "rust run",
                )
    for s, side in ((5.5, 1), (18.7, -1), (26.7, 1)):
        fan = [s, side * 6.9]
        for _ in range(5):
            dry.run(canvas, fan[0] + rng.normal(0, 0.12), fan[1], rng.uniform(0.4, 1.1), 0.03, -1.5, "dirt run", side)
    dry.graffiti(canvas, 23.0, 7.2, 1.6, 0.7, -3.0)
    window = canvas.window(13.8, 14.6, -7.6, -6.8)
    ring = np.abs(rectangle(window, 13.9, 14.5, -7.5, -6.9))
    canvas.base[window.at] -= (3.0 * (ring < 0.03)).astype(np.float32)


def _fixtures(canvas: Canvas) -> tuple[list[Fixture], list[Niche]]:
    p = canvas.profile
    out: list[Fixture] = []
    for side in (-1, 1):
        for s in np.arange(1.0, 34, 3.0):
            out.append(on_lining(p, float(s), side * 3.3, 1.3, 0.3, 0.14, 1.5, gap=0.12))
        out.append(on_lining(p, 17, side * 3.9, 36, 0.28, 0.06, -0.5, gap=0.1))
        for s in np.arange(0.6, 34, 1.5):
            out.append(on_lining(p, float(s), side * 3.9, 0.05, 0.34, 0.1, -0.5))
    out.append(along_lining(p, p.height_u(-0.2, 1), 0.12, 0.03, -1.5, s1=2.0, s2=15.0))
    for y in (-0.85, 0.85):
        out.append(Bar(y, 4.15, 0.42, 0.5, s1=18.6, s2=21.8))
        for s in (19.0, 21.4):
            out.append(Block(s, y, 4.75, 0.1, 0.1, 0.5, -1.0))
    for s, side in ((4.5, -1), (12.6, 1), (27.5, -1)):
        out.append(on_lining(p, s, p.height_u(0.6, side), 0.6, 0.6, 0.03, 4.0, gap=0.05))
    for s in np.arange(3.0, 34, 8.0):
        out.append(on_lining(p, float(s), p.height_u(-0.9, 1), 0.25, 0.12, 0.08, 4.0))
    out.append(on_lining(p, 24.6, p.height_u(-0.4, -1), 0.7, 1.1, 0.28, 0.0))
    out.append(along_lining(p, p.height_u(-0.75, -1), 0.1, 0.022, -0.5))
    u = p.foot_right
    return out, [Niche(16.2, 17.6, u - 2.1, u - 0.02, 0.6, 1.0)]


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    top = _lining(canvas)
    _dirt(canvas, top)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 3.0
        dry.texture(canvas, floor, 0.7, 2.0, 0.05)
        side = np.sign(floor.u[0, 0])
        start = canvas.profile.foot_right
        dry.tone(canvas, -0.3, canvas.length + 0.3, side * start, side * (start + 0.95), 2.0)
        dry.tone(canvas, -0.3, canvas.length + 0.3, side * (start + 1.35), side * (start + 1.5), 5.0)
    dry.grain(canvas, 0.25)
    fixtures, niches = _fixtures(canvas)
    return Tunnel(site.alignment, canvas, fixtures, niches)


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="cast",
    phenomenon="dry; splash, soot and scrapes on painted walls",
    description=(
        "Two-lane road tunnel with painted walls before its yearly wash: splash and runs of dirt at the "
        "foot, soot at the crown, washed "
        "bands, scrapes, rust below brackets, sealed joints and cracks, repairs, dried stains. No water at all."
    ),
    make=_make,
)
