"""An access tunnel of sprayed concrete with drainage strips."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas, cover, ellipse, rectangle
from .deliver import Site, deliver
from .fixtures import Bar, Block, Fixture, along_lining, on_lining
from .geometry import Alignment, Profile, arc
from .laws import matt, pulsed
from .leaks import Look, foot, joint, outlet, patch, streaks
from .scanner import Instrument, Static, Tunnel

_FLOOR = -1.75
_STRIPS = (3.1, 8.4, 13.2, 18.9, 24.1)


def _profile() -> Profile:
    half = np.concatenate([arc((0, 0), 3.1, 0, 90), [[3.08, -0.7], [2.95, _FLOOR], [2.5, _FLOOR - 0.05], [0, _FLOOR + 0.05]]])
    return Profile(half, half * (-1, 1), (2.95, _FLOOR), (-2.95, _FLOOR))


SITE = Site(
    name="shotcrete-strips",
    alignment=Alignment(647215.8, 5241360.3, 812.5, np.radians(-28), radius=180.0, slope=0.08),
    profile=_profile(),
    length=27.0,
    pixel=0.009,
    instrument=Instrument(29.0, pulsed(1.6), matt(0.3), noise=0.7, wobble=0.1, offset=0.25, blur=(0.002, 0.0004)),
    pattern=Static(((2.5, 0.3, -0.15), (9.5, 0.4, -0.1), (16.8, 0.2, -0.2), (24.0, 0.3, -0.1)), step=0.0035, density=1150),
    seed=5050,
    ranges=(1.5, 25.0),
)


def _lining(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    everything = canvas.lining()
    dry.bumps(canvas, everything, 0.03, 2.4, 0.3)
    dry.bumps(canvas, everything, 0.008, 0.25, 0.03, 0.7)
    dry.texture(canvas, everything, 0.7, 1.6, 0.03, 0.75)
    for _ in range(45):
        s, u = rng.uniform(0, canvas.length), rng.uniform(p.foot_left, p.foot_right)
        size = rng.uniform(0.5, 1.3)
        window = canvas.window(s - 1.6 * size, s + 1.6 * size, u - 1.6 * size, u + 1.6 * size)
        share = cover(ellipse(window, s, u, size, size * rng.uniform(0.6, 1)) + 0.12 * canvas.fractal(window, 0.6, 0.05), 0.25)
        canvas.base[window.at] += (rng.normal(0, 0.4) * share).astype(np.float32)
        canvas.bump[window.at] += (rng.uniform(0, 0.012) * share).astype(np.float32)
    for s in np.arange(0.8, 27, 2.2):
        dry.groove(
            canvas, dry.wander(rng, (s, p.foot_left), (s + 0.1, p.foot_right), 0.12), 0.09, rng.normal(-0.3, 0.4), -0.012
        )
    for s in _STRIPS:
        window = canvas.window(s - 0.5, s + 0.5, p.foot_left, p.foot_right)
        share = cover(
            rectangle(window, s - 0.16, s + 0.16, p.foot_left, p.foot_right) + 0.02 * canvas.fractal(window, 0.6, 0.05), 0.08
        )
        canvas.base[window.at] += (rng.normal(-1.2, 0.4) * share).astype(np.float32)
        canvas.bump[window.at] += 0.05 * share
        canvas.note("drainage strip", window, share > 0.5)


def _dirt(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    for side, foot_u in ((-1, p.foot_left), (1, p.foot_right)):
        window = canvas.window(-0.3, canvas.length + 0.3, foot_u - side * 1.6, foot_u)
        above = np.abs(foot_u - window.u)
        dust = np.exp(-((above / 0.6) ** 2)) * np.clip(1 + 0.35 * canvas.fractal(window, 1.5, 0.05), 0.2, 1.8)
        canvas.base[window.at] -= (1.8 * dust).astype(np.float32)
        canvas.note("mud of vehicles", window, dust > 0.5)
    for s, u, a, b, change in (
        (5.6, 3.6, 1.1, 0.8, -2.2),
        (15.6, -3.0, 1.3, 0.9, -1.9),
        (21.6, 1.3, 0.9, 1.0, 1.4),
        (11.0, -0.6, 0.9, 0.7, -1.6),
    ):
        dry.blot(canvas, s, u, a, b, change, "newer shotcrete", 0.06, 0.1)
    for s, u, a, b in ((7.0, -4.4, 0.5, 0.5), (20.9, 4.6, 0.6, 0.45), (2.2, -2.2, 0.45, 0.6)):
        dry.tide_mark(canvas, s, u, a, b, -1.9)
    for s, u, a, b, change in ((13.9, 4.2, 0.4, 0.5, -1.6), (25.8, -3.4, 0.5, 0.4, -1.8)):
        dry.blot(canvas, s, u, a, b, change, "oil and grime", 0.12, 0.07)
    dry.band(canvas, 6.0, 19.0, 4.95, 5.35, -1.2, "brushed by vehicles", 0.15, 0.06)
    for _ in range(10):
        dry.run(
            canvas,
            rng.uniform(1, 26),
            rng.choice([-1, 1]) * rng.uniform(2.5, 5.0),
            rng.uniform(0.3, 0.9),
            0.025,
            2.0,
            "lime run",
        )
    for _ in range(12):
        dry.run(
            canvas,
            rng.uniform(1, 26),
            rng.choice([-1, 1]) * rng.uniform(2.0, 5.0),
            rng.uniform(0.2, 0.7),
            0.02,
            -2.0,
            "rust run",
        )
    for s1, u1, s2, u2 in ((16.0, 1.0, 18.0, 2.6), (4.0, -0.4, 6.8, -1.4)):
        dry.groove(canvas, dry.wander(rng, (s1, u1), (s2, u2), 0.25), 0.012, -2.0, 0.004, "crack")
    dry.tone(canvas, 10.2, 10.9, -4.5, -4.1, 3.2, "painted number")
    dry.graffiti(canvas, 22.0, -4.9, 1.2, 0.5, 2.6)


def _water(canvas: Canvas) -> None:
    a, _, c, _, e = _STRIPS
    rough = Look(3.4, edge=(0.02, 0.12), rough=0.05)
    joint(canvas, [(a + 0.22, 2.3), (a + 0.24, 5.6)], 0.12, rough, "edge of strip", [(0.5, 0.6, 0.1, 1)])
    joint(
        canvas, [(c - 0.2, -4.8), (c - 0.22, -2.6)], 0.13, Look(4.6, edge=(0.02, 0.08), rough=0.04, salt=1.8), "edge of strip"
    )
    joint(canvas, [(e - 0.2, 0.8), (e - 0.18, 2.9)], 0.12, Look(2.2, edge=(0.04, 0.15), rough=0.05), "edge of strip")
    patch(canvas, 10.6, 2.4, 0.9, 0.7, Look(2.6, edge=(0.04, 0.2), rough=0.09), "patch")
    patch(canvas, 16.4, -0.75, 0.55, 0.6, Look(4.0, rough=0.07, salt=1.8), "crown")
    patch(canvas, 22.0, 3.3, 0.5, 0.7, Look(1.9, edge=(0.05, 0.2), rough=0.08), "patch")
    outlet(canvas, 6.4, -2.7, 1.4, 0.11, Look(4.8, edge=(0.015, 0.06), rough=0.03, salt=2.0), "rock bolt", widen=1.8)
    outlet(canvas, 19.9, 2.6, 1.0, 0.1, Look(3.2, rough=0.03), "rock bolt")
    streaks(
        canvas,
        [20.6, 20.95, 21.3, 21.5, 21.95],
        -2.9,
        [1.1, 1.9, 1.4, 0.8, 1.6],
        0.07,
        Look(3.6, rough=0.03),
        "curtain",
        head=0.09,
    )
    foot(canvas, 12.0, 17.8, 1, 0.5, Look(2.6, edge=(0.03, 0.2), rough=0.07), waves=1.6)
    foot(canvas, 1.0, 4.6, -1, 0.7, Look(3.2, edge=(0.03, 0.15), rough=0.06, salt=1.2), waves=1.4)
    crack = dry.wander(canvas.rng, (8.9, -1.9), (9.6, -0.3), 0.15)
    joint(canvas, crack, 0.1, Look(2.9, rough=0.04), "wet crack")
    patch(
        canvas, 4.9, 1.2, 0.6, 0.5, Look(0.7, edge=(0.2, 0.4), rough=0.1), "patch", "Lost in the uneven tone of the shotcrete."
    )
    patch(canvas, 12.0, 3.0, 0.14, 0.14, Look(3.5), "drip")


def _fixtures(canvas: Canvas) -> list[Fixture]:
    rng, p = canvas.rng, canvas.profile
    out: list[Fixture] = [Bar(0.4, 2.5, 0.28, 0.8)]
    for s in np.arange(1.2, 27, 2.5):
        out.append(Block(float(s), 0.4, 2.92, 0.03, 0.03, 0.3, -1.0))
    for z, radius in ((0.9, 0.02), (0.72, 0.028)):
        out.append(along_lining(p, p.height_u(z, -1), 0.16, radius, -3.5, sag=0.08, span=2.0, phase=0.3))
    for s in np.arange(0.3, 27, 2.0):
        out.append(on_lining(p, float(s), p.height_u(0.85, -1), 0.05, 0.4, 0.14, -2.0))
    out.append(along_lining(p, p.height_u(-0.5, 1), 0.17, 0.06, -1.5))
    out.append(along_lining(p, p.height_u(-0.75, 1), 0.15, 0.04, -0.5))
    for s in np.arange(1.0, 27, 3.0):
        out.append(on_lining(p, float(s), p.height_u(-0.6, 1), 0.06, 0.45, 0.12, -2.0))
    for row, s in enumerate(np.arange(1.1, 27, 1.8)):
        for u in np.arange(-3.9, 4.0, 1.95) + (0.95 if row % 2 else 0.0):
            if abs(u) < 4.4:
                place = (float(s + rng.normal(0, 0.08)), float(u + rng.normal(0, 0.08)))
                out.append(on_lining(p, *place, 0.18, 0.18, 0.02, -1.0, gap=0.015))
                out.append(on_lining(p, *place, 0.04, 0.04, 0.1, -1.0))
    out.append(on_lining(p, 15.0, p.height_u(0.2, -1), 0.6, 0.8, 0.25, 0.5, gap=0.03))
    out.append(on_lining(p, 5.2, p.height_u(0.6, 1), 0.5, 0.35, 0.02, 3.0, gap=0.05))
    for s in np.arange(2.0, 27, 6.0):
        out.append(on_lining(p, float(s), 1.9, 0.7, 0.14, 0.12, 2.0, gap=0.05))
    return out


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 1.5
        dry.texture(canvas, floor, 1.0, 0.8, 0.04, 0.8)
        dry.bumps(canvas, floor, 0.015, 0.6, 0.05, 0.6)
    _water(canvas)
    dry.grain(canvas, 0.35)
    return Tunnel(site.alignment, canvas, _fixtures(canvas))


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="shotcrete",
    phenomenon="seepage beside drainage strips and bolts",
    description=(
        "Steep access tunnel of sprayed concrete with drainage strips from crown to foot, bolts and a "
        "ventilation duct: water beside strips, "
        "at bolts and cracks, a curtain, damp feet; mud, newer shotcrete, dried stains, rust and lime. As "
        "in hydropower and mine adits."
    ),
    make=_make,
)
