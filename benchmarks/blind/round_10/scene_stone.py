"""A water tunnel lined with ashlar, emptied for its inspection."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas
from .deliver import Site, deliver
from .fixtures import Fixture, along_lining, on_lining
from .geometry import Alignment, Profile, arc
from .laws import masonry, matt, phase
from .leaks import Look, foot, joint, outlet, patch, streaks
from .scanner import Instrument, Static, Tunnel

_FLOOR = -1.7
_LINE = -0.55


def _profile() -> Profile:
    invert = arc((0, 2.6), 4.85, 152.9, 180)
    half = np.concatenate([arc((0, 0), 2.25, 0, 90), [[2.22, _FLOOR]], invert[1:]])
    return Profile(half, half * (-1, 1), (2.22, _FLOOR), (-2.22, _FLOOR))


SITE = Site(
    name="headrace-ashlar",
    alignment=Alignment(418302.9, 5288764.4, 455.1, np.radians(12), radius=-260.0, slope=-0.002),
    profile=_profile(),
    length=26.0,
    pixel=0.008,
    instrument=Instrument(21.0, phase(3.0, 20.0, 0.05), matt(0.3), noise=0.9, wobble=0.12, offset=0.3, blur=(0.003, 0.0005)),
    pattern=Static(
        ((2.4, 0.0, -0.3), (8.6, 0.1, -0.25), (15.0, -0.1, -0.3), (21.0, 0.0, -0.28), (25.0, 0.1, -0.3)),
        step=0.0036,
        density=1150,
    ),
    seed=8080,
    ranges=(1.5, 25.0),
)


def _lining(canvas: Canvas) -> np.ndarray:
    everything = canvas.lining()
    value = masonry(canvas, everything, 0.33, 0.62, 0.008, 0.75, 0.6, 0.008, uneven=0.25, relief=0.004)
    dry.texture(canvas, everything, 0.5, 1.2, 0.05, 0.7)
    dry.bumps(canvas, everything, 0.006, 3.0, 0.3)
    dry.bumps(canvas, everything, 0.003, 0.2, 0.03, 0.7)
    return value


def _dirt(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    for side, foot_u in ((-1, p.foot_left), (1, p.foot_right)):
        line = p.height_u(_LINE, side)
        dry.band(canvas, -0.3, canvas.length + 0.3, line, foot_u, -2.0, "film below the waterline", 0.08, 0.03)
        dry.band(
            canvas, -0.3, canvas.length + 0.3, line - side * 0.14, line - side * 0.02, 1.5, "lime of the waterline", 0.06, 0.03
        )
        dry.band(canvas, -0.3, canvas.length + 0.3, foot_u - side * 0.3, foot_u, -0.9, "silt", 0.15, 0.06)
    for s, u, a, b, change in ((6.0, -1.0, 0.6, 0.5, -1.8), (14.2, 1.6, 0.5, 0.7, -2.0), (23.5, -2.2, 0.7, 0.4, -1.7)):
        dry.blot(canvas, s, u, a, b, change, "manganese", 0.08, 0.08)
    for s, u, long, high, change in ((10.4, 2.4, 1.2, 0.66, -2.0), (17.3, -1.4, 0.9, 0.9, 1.7), (3.2, 1.2, 0.7, 0.7, -1.8)):
        dry.repair(canvas, s, u, long, high, change, 0.004)
    for s, u, a, b in ((12.4, -1.7, 0.5, 0.5), (20.2, 2.9, 0.45, 0.4), (8.2, 0.4, 0.5, 0.35)):
        dry.tide_mark(canvas, s, u, a, b, -2.2)
    for _ in range(12):
        dry.run(
            canvas,
            rng.uniform(0.6, 25.4),
            rng.choice([-1, 1]) * rng.uniform(1.2, 3.4),
            rng.uniform(0.3, 1.0),
            0.025,
            2.2,
            "lime run",
        )
    for s in np.arange(1.6, 26, 4.0):
        dry.run(canvas, float(s), 2.75, rng.uniform(0.2, 0.6), 0.018, -2.0, "rust run")
    dry.band(canvas, 5.0, 16.0, -2.7, -2.3, -1.0, "old waterline", 0.05, 0.03)
    dry.tone(canvas, 13.0, 13.4, 3.0, 3.3, 3.0, "painted number")


def _water(canvas: Canvas, value: np.ndarray) -> None:
    rng = canvas.rng
    joint(
        canvas,
        [(2.0, -2.05), (5.6, -2.0)],
        0.11,
        Look(3.2, rough=0.03),
        "wet course",
        [(0.3, 0.7, 0.1, -1), (0.75, 0.5, 0.11, -1)],
    )
    joint(canvas, [(15.3, 2.5), (18.2, 2.5)], 0.1, Look(3.8, salt=2.0, rough=0.03), "wet course", [(0.6, 0.7, 0.1, 1)])
    outlet(canvas, 7.4, 2.9, 1.1, 0.1, Look(4.5, edge=(0.012, 0.06)), "weep hole", widen=1.7)
    outlet(canvas, 20.6, -2.6, 1.6, 0.11, Look(3.6, salt=1.6), "weep hole", widen=1.6)
    patch(canvas, 9.8, -0.6, 0.7, 0.6, Look(2.4, edge=(0.04, 0.15), rough=0.07), "crown")
    patch(canvas, 18.9, 0.7, 0.6, 0.55, Look(3.4, rough=0.06, salt=2.2), "crown")
    joint(canvas, [(12.1, -0.4), (12.05, 1.8)], 0.11, Look(2.8, rough=0.035), "wet ring joint")
    streaks(canvas, [14.0, 14.35, 14.6, 15.0], -2.2, [1.0, 1.7, 1.3, 0.8], 0.065, Look(3.4, rough=0.025), "curtain", head=0.08)
    foot(canvas, 21.0, 25.4, 1, 0.55, Look(2.8, edge=(0.03, 0.14), rough=0.05), "seeping foot", waves=1.6)
    foot(canvas, 8.6, 11.2, -1, 0.45, Look(3.4, edge=(0.02, 0.1), rough=0.04), "seeping foot", waves=1.2)
    patch(canvas, 23.2, 1.9, 0.5, 0.7, Look(2.1, edge=(0.05, 0.16), rough=0.07), "patch")
    crack = dry.wander(rng, (5.2, 0.9), (6.1, 2.5), 0.15)
    dry.groove(canvas, crack, 0.008, -1.5, 0.004)
    joint(canvas, crack, 0.1, Look(3.0, rough=0.03), "wet crack")
    patch(
        canvas,
        1.4,
        1.8,
        0.35,
        0.5,
        Look(0.6, edge=(0.15, 0.3), rough=0.06),
        "patch",
        "Less than the tones of stones differ by.",
    )
    patch(canvas, 16.4, -0.9, 0.14, 0.13, Look(3.0), "drip")
    lining = canvas.lining()
    canvas.wet[lining.at] *= np.clip(1 + 0.12 * value, 0.7, 1.3).astype(np.float32)


def _fixtures(canvas: Canvas) -> list[Fixture]:
    p = canvas.profile
    out: list[Fixture] = [along_lining(p, 2.7, 0.07, 0.025, -2.0, sag=0.02, span=2.0)]
    for s in np.arange(1.6, 26, 2.0):
        out.append(on_lining(p, float(s), 2.7, 0.05, 0.1, 0.06, -2.0))
    for s in np.arange(3.0, 26, 5.0):
        out.append(on_lining(p, float(s), -3.0, 0.1, 0.1, 0.05, -1.0))
    for z in np.arange(-1.5, 0.6, 0.3):
        out.append(on_lining(p, 19.6, p.height_u(float(z), -1), 0.4, 0.03, 0.03, -1.5, gap=0.1))
    out.append(on_lining(p, 11.6, p.height_u(-0.2, 1), 0.12, 1.6, 0.03, 2.5, gap=0.02))
    out.append(on_lining(p, 4.4, 2.2, 0.3, 0.3, 0.02, 2.5, gap=0.02))
    return out


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    value = _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 2.5
        dry.texture(canvas, floor, 1.0, 0.8, 0.03, 0.8)
        dry.bumps(canvas, floor, 0.012, 0.5, 0.04, 0.7)
    _water(canvas, value)
    dry.grain(canvas, 0.35)
    return Tunnel(site.alignment, canvas, _fixtures(canvas))


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="stone",
    phenomenon="seeping courses above a dried waterline",
    description=(
        "Headrace tunnel of ashlar, emptied for inspection: dry film and silt below the waterline, lime at "
        "it, manganese, repairs, lime runs; "
        "water at courses, weep holes, ring joint and crack, damp crown with salts, seeping feet. As in "
        "manuals on old water tunnels."
    ),
    make=_make,
)
