"""A gallery for cables and heating pipes: a concrete box, dry and dusty."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas
from .deliver import Site, deliver
from .fixtures import Bar, Block, Fixture, on_lining
from .geometry import Alignment, Profile
from .laws import glossy, pulsed
from .scanner import Instrument, Static, Tunnel

_HALF, _TOP, _FLOOR = 1.75, 1.65, -1.65
_CORNER = _HALF
_FOOT = _HALF + _TOP - _FLOOR
_JOINTS = (5.6, 13.6, 21.6)
_RACKS = tuple(float(s) for s in np.arange(0.7, 28, 1.0))


def _profile() -> Profile:
    half = np.array(
        [
            [0, _TOP],
            [_HALF - 0.06, _TOP],
            [_HALF, _TOP - 0.06],
            [_HALF, _FLOOR],
            [0.2, _FLOOR],
            [0.2, _FLOOR - 0.08],
            [0, -1.73],
        ]
    )
    return Profile(half, half * (-1, 1), (_HALF, _FLOOR), (-_HALF, _FLOOR))


SITE = Site(
    name="cable-gallery",
    alignment=Alignment(565880.6, 5933240.0, 3.4, np.radians(101), slope=0.004),
    profile=_profile(),
    length=28.0,
    pixel=0.007,
    instrument=Instrument(
        30.0, pulsed(1.7, 2.0), glossy(0.22, 0.08, 0.1), noise=0.35, wobble=0.08, offset=0.2, blur=(0.002, 0.0003)
    ),
    pattern=Static(((3.2, -0.2, 0.0), (10.2, -0.2, 0.02), (17.4, -0.15, -0.02), (24.6, -0.2, 0.0)), step=0.0034, density=1500),
    seed=6060,
    ranges=(1.5, 25.0),
)


def _lining(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    everything = canvas.lining()
    dry.texture(canvas, everything, 0.35, 1.5, 0.05)
    dry.bumps(canvas, everything, 0.0015, 1.5, 0.1)
    bounds = [-1.0, *_JOINTS, canvas.length + 1]
    for s1, s2 in pairwise(bounds):
        dry.tone(canvas, s1, s2 - canvas.pixel, p.foot_left, p.foot_right, rng.normal(0, 0.45), step=rng.normal(0, 0.002))
        for s in np.arange(s1 + 1.35, s2 - 0.4, 1.35):
            dry.groove(canvas, [(s, p.foot_left), (s, p.foot_right)], 0.007, rng.normal(-0.7, 0.4), -0.001)
            dry.tone(canvas, s, s + 1.35, -_CORNER, _CORNER, rng.normal(0, 0.25))
            for u in (-4.4, -2.4, 2.4, 4.4, -0.9, 0.9):
                dry.disc(canvas, s + 0.3, u, 0.02, 0.006, -1.2)
                dry.disc(canvas, s + 1.0, u, 0.02, 0.006, -1.2)
    for s in _JOINTS:
        dry.groove(canvas, [(s, p.foot_left), (s, p.foot_right)], 0.012, -3.2, 0.008)
    for side in (-1, 1):
        wall = canvas.window(-0.3, canvas.length + 0.3, side * (_CORNER + 0.1), side * _FOOT)
        dry.boards(canvas, wall, 0.26, 0.22, 0.0008)
        dry.groove(canvas, [(0, side * 4.75), (canvas.length, side * 4.75)], 0.012, -1.3, 0.002)


def _dirt(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    dry.groove(canvas, [(13.6, p.foot_left), (13.6, -0.3)], 0.05, -2.2, -0.002, "sealed joint")
    dry.groove(canvas, [(21.6, -1.6), (21.6, p.foot_right)], 0.045, -1.8, -0.002, "sealed joint")
    for side in (-1, 1):
        dry.band(canvas, 0, canvas.length, side * (_FOOT - 0.3), side * _FOOT, -1.6, "dirt of the foot", 0.2, 0.07)
    dry.band(canvas, 3.0, 12.0, -_FOOT, -_FOOT + 0.75, -1.3, "old waterline", 0.03, 0.03)
    for z in (1.0, 0.6, 0.2, -0.2, -0.6):
        u = _CORNER + _TOP - z
        dry.band(canvas, 0, canvas.length, u - 0.06, u + 0.02, -0.8, "dust of the cables", 0.1, 0.03)
    for s in _RACKS:
        if rng.random() < 0.4:
            dry.run(canvas, s, _CORNER + rng.uniform(0.3, 2.2), rng.uniform(0.2, 0.8), 0.016, -2.2, "rust run")
    for s in (2.2, 6.2, 10.2, 14.2, 18.2, 22.2, 26.2):
        if rng.random() < 0.7:
            dry.run(canvas, s, -3.2, rng.uniform(0.3, 1.2), 0.02, -2.2, "rust run")
    for s, u, a, b in ((8.6, 0.5, 0.5, 0.4), (16.6, -2.3, 0.4, 0.35), (24.2, -0.7, 0.55, 0.35), (4.6, 1.2, 0.35, 0.3)):
        dry.tide_mark(canvas, s, u, a, b, -1.9)
    for s, u, a, b, change in (
        (11.8, -2.6, 0.45, 0.35, -1.7),
        (19.6, 0.7, 0.5, 0.4, -1.4),
        (26.6, 2.3, 0.3, 0.4, -1.6),
        (2.4, -0.9, 0.5, 0.35, -1.2),
    ):
        dry.blot(canvas, s, u, a, b, change, "grime", 0.12, 0.06)
    for s, u, a, b in ((15.2, -3.1, 0.25, 0.15), (22.9, 0.1, 0.3, 0.2), (6.9, 2.2, 0.25, 0.2)):
        dry.blot(canvas, s, u, a, b, -1.6, "honeycombs", 0.015, 0.04)
    for s, u, long, high, change in ((9.4, -2.7, 0.7, 0.5, -2.0), (17.6, 0.4, 0.9, 0.6, -1.7), (25.0, -2.9, 0.5, 0.6, 1.5)):
        dry.repair(canvas, s, u, long, high, change)
    for s1, u1, s2, u2 in ((7.6, -1.4, 9.9, -0.2), (18.6, -1.0, 18.9, -2.9), (11.0, 0.2, 12.6, 1.5)):
        dry.groove(canvas, dry.wander(rng, (s1, u1), (s2, u2), 0.12), 0.015, -2.0, 0.0, "sealed crack")
    dry.band(canvas, 0, canvas.length, 0.35, 0.95, -0.7, "dust over the lamps", 0.25, 0.08)
    dry.graffiti(canvas, 20.2, -3.0, 1.0, 0.5, -2.6)
    for s in (3.0, 13.0, 23.0):
        dry.tone(canvas, s, s + 0.3, -2.25, -2.1, -3.0, "painted number")


def _fixtures(canvas: Canvas) -> list[Fixture]:
    rng, p = canvas.rng, canvas.profile
    out: list[Fixture] = []
    for s in _RACKS:
        out.append(Block(s, _HALF - 0.03, -0.05, 0.05, 0.05, 2.7, 0.0))
        for z in (1.0, 0.6, 0.2, -0.2, -0.6):
            out.append(Block(s, _HALF - 0.2, z - 0.02, 0.04, 0.34, 0.03, 0.0))
    for z in (1.0, 0.6, 0.2, -0.2, -0.6):
        for place in rng.permutation([0.1, 0.2, 0.3])[: rng.integers(1, 4)]:
            radius = float(rng.choice([0.018, 0.026, 0.036]))
            out.append(
                Bar(
                    _HALF - place,
                    z + radius,
                    radius,
                    rng.uniform(-4.5, -2.5),
                    sag=rng.uniform(0.005, 0.03),
                    span=1.0,
                    phase=0.7,
                )
            )
    for z, radius in ((-0.35, 0.16), (-0.95, 0.16)):
        out.append(Bar(-_HALF + 0.3, z, radius, 2.5))
    out.append(Bar(-_HALF + 0.1, 0.25, 0.03, -1.0))
    for s in np.arange(2.2, 28, 4.0):
        out.append(Block(float(s), -_HALF + 0.22, -0.65, 0.08, 0.44, 0.06, -1.0))
        out.append(Block(float(s), -_HALF + 0.22, -1.2, 0.08, 0.44, 0.06, -1.0))
        out.append(Block(float(s), -_HALF + 0.05, -0.6, 0.1, 0.1, 1.9, -1.0))
    for s in np.arange(1.8, 28, 4.0):
        out.append(Block(float(s), 0.65, _TOP - 0.1, 1.2, 0.14, 0.1, 2.5))
    out.append(Bar(0.35, _TOP - 0.03, 0.014, 0.5))
    out.append(Bar(-1.1, _TOP - 0.16, 0.055, -1.0))
    for s in np.arange(1.0, 28, 2.5):
        out.append(Block(float(s), -1.1, _TOP - 0.1, 0.03, 0.14, 0.2, -1.0))
    out.append(on_lining(p, 12.9, -2.6, 0.4, 0.5, 0.2, 1.0))
    out.append(on_lining(p, 5.0, -2.4, 0.3, 0.3, 0.02, 3.5))
    return out


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 1.2
        dry.texture(canvas, floor, 0.7, 1.2, 0.04)
    dry.grain(canvas, 0.25)
    return Tunnel(site.alignment, canvas, _fixtures(canvas))


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="cast",
    phenomenon="dry; racks, dust, rust and an old waterline",
    description=(
        "Utility gallery, a concrete box with cable racks on one wall and heating pipes on the other: marks "
        "of boards and ties, sealed joints "
        "and cracks, honeycombs, repairs, rust below racks, a waterline of an old flood, dried stains. No water at all."
    ),
    make=_make,
)
