"""An old single-track railway tunnel of brick, black with soot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas
from .deliver import Site, deliver
from .fixtures import Block, Fixture, Niche, along_lining, on_lining
from .geometry import Alignment, Profile, arc
from .laws import masonry, matt, pulsed
from .leaks import Look, foot, joint, outlet, patch, streaks
from .scanner import Instrument, Static, Tunnel

_FLOOR = -2.45
_COURSE = 0.077


def _profile() -> Profile:
    wall = arc((-2.65, 0), 5.05, 90, 119)
    half = np.concatenate([arc((0, 0), 2.4, 0, 90), wall, [[1.75, _FLOOR], [1.6, _FLOOR + 0.06], [0, _FLOOR + 0.08]]])
    foot = (float(wall[-1, 0]), float(wall[-1, 1]))
    return Profile(half, half * (-1, 1), foot, (-foot[0], foot[1]))


SITE = Site(
    name="brick-soot",
    alignment=Alignment(488120.7, 5689450.2, 301.8, np.radians(164), radius=310.0, slope=0.021),
    profile=_profile(),
    length=25.0,
    pixel=0.008,
    instrument=Instrument(
        27.0, pulsed(1.9, 1.8), matt(0.35), noise=0.6, wobble=0.12, offset=0.3, blur=(0.0025, 0.0005), target=False
    ),
    pattern=Static(((2.8, 0.05, -0.75), (9.3, -0.1, -0.72), (15.8, 0.1, -0.78), (22.3, 0.0, -0.74)), step=0.0032, density=1300),
    seed=3030,
)


def _lining(canvas: Canvas) -> np.ndarray:
    everything = canvas.lining()
    value = masonry(canvas, everything, _COURSE, 0.23, 0.005, 0.55, -0.7, 0.004, relief=0.001)
    dry.texture(canvas, everything, 0.5, 2.5, 0.1)
    dry.bumps(canvas, everything, 0.008, 4.0, 0.3)
    u = np.abs(everything.u)
    smoke = np.clip(1.25 - u / 3.3, 0, 1) ** 1.2
    patchy = np.clip(1 + 0.25 * canvas.fractal(everything, 2.0, 0.08), 0.3, 1.5)
    canvas.base[everything.at] -= (4.0 * smoke * patchy).astype(np.float32)
    canvas.base[everything.at] -= 0.8
    return value


def _dirt(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    window = canvas.window(4.0, 25.3, -1.4, 1.4)
    flakes = canvas.fractal(window, 0.7, 0.08) - 1.75
    share = np.clip(flakes * 4, 0, 1)
    canvas.base[window.at] += (2.6 * share).astype(np.float32)
    canvas.bump[window.at] -= (0.006 * share).astype(np.float32)
    canvas.note("soot come off", window, share > 0.5)
    n = _COURSE
    for s, u, long, courses, change in ((6.4, -3.6, 1.1, 9, -2.2), (14.3, 2.6, 1.6, 12, 1.9), (19.6, -2.0, 0.9, 14, 1.4)):
        dry.repair(canvas, s, u, long, courses * n, change, 0.006)
    dry.repair(canvas, 2.0, 3.1, 0.9, 11 * n, -2.4, 0.008)
    dry.repair(canvas, 22.6, 4.3, 1.2, 7 * n, -1.6, 0.008)
    dry.band(canvas, 0, canvas.length, p.foot_left, p.foot_left + 0.4, -1.3, "splash", 0.2, 0.07)
    dry.band(canvas, 8.5, 17.0, 4.35, 4.8, -1.0, "grime", 0.2, 0.08)
    for s, u, a, b in ((11.6, -4.2, 0.5, 0.4), (17.2, 4.0, 0.35, 0.6), (4.2, -1.9, 0.5, 0.35)):
        dry.tide_mark(canvas, s, u, a, b, -1.9)
    for s, u, a, b, change in ((8.9, 3.3, 0.4, 0.6, -1.8), (21.0, -4.7, 0.5, 0.35, -1.6), (13.0, -3.0, 0.3, 0.3, -1.5)):
        dry.blot(canvas, s, u, a, b, change, "soot", 0.12, 0.06)
    for _ in range(8):
        dry.run(
            canvas,
            rng.uniform(1, 24),
            rng.choice([-1, 1]) * rng.uniform(2.8, 4.8),
            rng.uniform(0.3, 0.9),
            0.02,
            2.4,
            "lime run",
        )
    for s in np.arange(1.4, 25, 3.0):
        dry.run(canvas, float(s), 3.75, rng.uniform(0.2, 0.6), 0.02, -2.0, "rust run")


def _water(canvas: Canvas, value: np.ndarray) -> None:
    p, n = canvas.profile, _COURSE
    rng = canvas.rng
    soft = Look(3.0, edge=(0.02, 0.09), rough=0.03)
    joint(canvas, [(1.2, -3.1), (5.2, -3.1)], 1.3 * n, soft, "wet course", [(0.2, 0.8, 0.1, -1), (0.7, 0.45, 0.09, -1)])
    joint(canvas, [(9.8, 2.85), (12.6, 2.85)], n, Look(3.6, salt=1.8), "wet course", [(0.35, 0.7, 0.11, 1), (0.8, 1.0, 0.1, 1)])
    joint(canvas, [(17.6, -2.75), (21.2, -2.75)], 0.9 * n, Look(2.2, edge=(0.03, 0.1)), "wet course")
    patch(canvas, 7.4, 0.3, 0.8, 0.6, Look(2.0, edge=(0.05, 0.15), rough=0.07), "crown")
    patch(canvas, 15.2, -0.9, 0.5, 0.8, Look(2.8, rough=0.06, salt=2.0), "crown")
    patch(canvas, 22.4, 1.5, 0.6, 0.7, Look(2.6, rough=0.07, salt=1.5), "haunch")
    foot(canvas, 18.6, 24.7, 1, 0.6, Look(2.7, edge=(0.03, 0.15), rough=0.05, salt=1.2), waves=2.0)
    foot(canvas, 7.8, 11.0, -1, 0.85, Look(2.3, edge=(0.04, 0.18), rough=0.06), waves=1.6)
    streaks(
        canvas,
        [13.55, 13.9, 14.1, 14.5, 14.85],
        -3.35,
        [1.0, 1.7, 1.3, 0.7, 1.5],
        0.055,
        Look(3.8, rough=0.02),
        stop=p.foot_left,
    )
    outlet(canvas, 5.6, 4.0, 0.85, 0.09, Look(4.6, edge=(0.012, 0.05)), "weep hole", stop=p.foot_right - 0.005)
    crack = dry.wander(rng, (18.4, 1.0), (19.2, 3.7), 0.15)
    dry.groove(canvas, crack, 0.007, -1.5, 0.004)
    joint(canvas, crack, 0.1, Look(3.2, rough=0.03), "wet crack")
    joint(canvas, [(13.25, 2.95), (13.25, 4.2)], 0.12, Look(2.6), "niche", [(0.5, 0.5, 0.1, 1)])
    patch(
        canvas, 3.4, 1.6, 0.45, 0.4, Look(0.7, edge=(0.15, 0.35), rough=0.08), "patch", "Hardly darker than the soot about it."
    )
    patch(canvas, 10.6, -1.5, 0.14, 0.12, Look(3.0), "drip")
    lining = canvas.lining()
    canvas.wet[lining.at] *= np.clip(1 + 0.13 * value, 0.7, 1.3).astype(np.float32)


def _fixtures(canvas: Canvas) -> tuple[list[Fixture], list[Niche]]:
    rng, p = canvas.rng, canvas.profile
    out: list[Fixture] = []
    for gap, radius in ((0.0, 0.02), (0.09, 0.014), (0.2, 0.024)):
        out.append(along_lining(p, 3.45 + gap, 0.1, radius, -4.0, sag=0.06, span=3.0, phase=1.4))
    for s in np.arange(1.4, 25, 3.0):
        out.append(on_lining(p, float(s), 3.56, 0.05, 0.4, 0.1, -2.5))
    out.append(along_lining(p, -3.95, 0.08, 0.03, -2.5))
    for s in np.arange(0.8, 25, 2.5):
        out.append(on_lining(p, float(s), -3.95, 0.05, 0.12, 0.07, -2.5))
    out.append(on_lining(p, 16.4, -2.6, 0.4, 0.3, 0.02, 3.0, gap=0.04))
    out.append(on_lining(p, 6.0, 2.5, 0.35, 0.25, 0.15, 0.0, gap=0.03))
    for y in (-0.7175, 0.7175):
        out.append(Block(12.5, y, _FLOOR + 0.27, 28, 0.07, 0.15, -2.5))
    for s in np.arange(0.2, 25, 0.65):
        out.append(Block(float(s + rng.normal(0, 0.02)), 0, _FLOOR + 0.12, 0.25, 2.5, 0.17, -2.0))
    u = p.foot_right
    return out, [Niche(11.9, 13.0, u - 1.9, u - 0.02, 0.55, -2.0)]


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    value = _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 2.0
        dry.texture(canvas, floor, 1.2, 0.3, 0.04, 0.9)
        dry.bumps(canvas, floor, 0.016, 0.16, 0.04, 0.8)
    _water(canvas, value)
    dry.grain(canvas, 0.35)
    fixtures, niches = _fixtures(canvas)
    return Tunnel(site.alignment, canvas, fixtures, niches)


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="brick",
    phenomenon="wet courses under soot",
    description=(
        "Single-track brick tunnel of the steam age: soot from the crown down, patches where it came off, "
        "blue and new bricks, lime runs; "
        "wet courses, damp patches with salts at crown and haunches, weep hole, damp feet. As in CIRIA C671 "
        "on old tunnels. No reference."
    ),
    make=_make,
)
