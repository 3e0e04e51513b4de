"""A metro tunnel of concrete segments, bored by a shield, some twenty years old."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.blind.scene import Scene

from . import dry
from .canvas import Canvas
from .deliver import Site, deliver
from .fixtures import Bar, Block, Fixture, along_lining, on_lining
from .geometry import Alignment, Profile, arc
from .laws import glossy, pulsed
from .leaks import Look, joint, outlet, patch, streaks
from .scanner import Instrument, Mobile, Tunnel

_RADIUS, _RING, _SLAB = 2.75, 1.2, -1.75
_TURNS = (-10.0, 10.0, 77.5, -77.5, 145.0, -145.0)


def _profile() -> Profile:
    half = np.concatenate([arc((0, 0), _RADIUS, 0, 129.52), [[0.28, _SLAB], [0.28, -1.9], [0, -1.9]]])
    mirror = half * (-1, 1)
    return Profile(half, mirror, (2.121, _SLAB), (-2.121, _SLAB))


SITE = Site(
    name="metro-segments",
    alignment=Alignment(566210.4, 5934870.9, 11.2, np.radians(37), radius=420.0, slope=-0.018),
    profile=_profile(),
    length=30.0,
    pixel=0.008,
    instrument=Instrument(31.0, pulsed(1.5), glossy(0.25, 0.06, 0.12), noise=0.5, wobble=0.14, blur=(0.002, 0.0005)),
    pattern=Mobile(0.0, -0.35, speed=1.1, turns=50, per_turn=1050),
    seed=1010,
    ranges=(1.0, 12.0),
)


def _key(ring: int) -> float:
    """Angle of the key segment of a ring (degrees): rings are turned in turn."""
    return 22.5 if ring % 2 else -22.5


def joint_u(ring: int, which: int) -> float:
    """Place of a longitudinal joint of a ring."""
    return float(_RADIUS * np.radians(_key(ring) + _TURNS[which]))


def _lining(canvas: Canvas) -> None:
    rng, p = canvas.rng, canvas.profile
    everything = canvas.lining()
    dry.texture(canvas, everything, 0.35, 2.0, 0.06)
    dry.bumps(canvas, everything, 0.0012, 1.0, 0.05)
    canvas.bump[everything.at] += (0.009 * np.cos(2 * everything.u / _RADIUS)).astype(np.float32)
    canvas.base[everything.at] -= (1.1 * np.clip((np.abs(everything.u) - 3.2) / 2.6, 0, 1)).astype(np.float32)
    for ring in range(-1, int(canvas.length / _RING) + 1):
        s1, s2 = ring * _RING + 0.35, (ring + 1) * _RING + 0.35
        places = sorted([joint_u(ring, i) for i in range(6)])
        bounds = [p.low, *places, p.high]
        for u1, u2 in pairwise(bounds):
            u1, u2 = np.clip([u1, u2], p.foot_left, p.foot_right)
            if u2 - u1 > 0.05:
                dry.tone(canvas, s1, s2 - canvas.pixel, u1, u2 - canvas.pixel, rng.normal(0, 0.4), step=rng.normal(0, 0.0016))
            if u2 - u1 > 1.0:
                middle, centre = (u1 + u2) / 2, (s1 + s2) / 2
                dry.disc(canvas, centre, middle, 0.035, 0.015, -1.8)
                for shift in (-0.3, 0.3):
                    for edge in (s1 + 0.14, s2 - 0.14):
                        dry.pocket(canvas, edge, middle + shift * (u2 - u1), 0.13, 0.17, 0.055, -1.6)
        for u in places:
            if p.foot_left < u < p.foot_right:
                dry.groove(canvas, [(s1, u), (s2, u)], 0.006, -2.4, 0.009)
                for s in (s1 + 0.35, s2 - 0.35):
                    for shift in (-0.17, 0.17):
                        dry.pocket(canvas, s, u + shift, 0.15, 0.12, 0.05, -1.5)
        dry.groove(canvas, [(s1, p.foot_left), (s1, p.foot_right)], 0.006, -2.4, 0.009)


def _dirt(canvas: Canvas) -> None:
    rng = canvas.rng
    for ring, u1, u2 in ((3, -2.6, 2.0), (11, 0.4, 5.8), (16, -5.6, -1.0), (21, -1.5, 5.5)):
        s = ring * _RING + 0.35
        half = rng.uniform(0.03, 0.05)
        dry.groove(canvas, [(s, u1), (s, u2)], half, rng.uniform(-2.6, -1.6), -0.002, "sealed joint")
    for ring, which in ((2, 3), (9, 2), (14, 1), (19, 3)):
        u = joint_u(ring, which)
        s = ring * _RING + 0.35
        dry.groove(canvas, [(s, u), (s + _RING, u)], 0.04, rng.uniform(-2.5, -1.5), -0.002, "sealed joint")
    for s, u, a, b, change in ((5.2, 1.7, 0.35, 0.28, -1.8), (13.2, -2.7, 0.25, 0.4, -1.5), (24.4, 2.7, 0.4, 0.3, -1.6)):
        dry.blot(canvas, s, u, a, b, change, "grime", 0.1, 0.05)
    dry.band(canvas, 0, canvas.length, 2.55, 3.1, -0.9, "dust of the cables", 0.15, 0.06)
    dry.band(canvas, 0, canvas.length, -5.1, -4.7, -1.0, "dust", 0.12, 0.05)
    for s, u in ((8.6, 0.9), (17.4, -3.4), (27.3, 4.1)):
        dry.repair(canvas, s, u, rng.uniform(0.3, 0.6), rng.uniform(0.25, 0.5), rng.uniform(-2.2, -1.2))
    dry.repair(canvas, 20.3, 3.4, 0.5, 0.35, 1.3)
    for _ in range(9):
        s, u = rng.uniform(1, 29), rng.choice([-1, 1]) * rng.uniform(2.4, 4.4)
        dry.run(canvas, s, u, rng.uniform(0.25, 0.7), 0.014, -1.8, "rust run")
    for s, u in ((6.6, -2.3), (22.6, 1.9)):
        dry.tide_mark(canvas, s, u, 0.3, 0.35, -1.6)
    dry.tone(canvas, 10.0, 10.35, -3.6, -3.45, 3.0, "painted number")
    dry.tone(canvas, 25.6, 25.95, -3.6, -3.45, 3.0, "painted number")


def _water(canvas: Canvas) -> None:
    ring = [r * _RING + 0.35 for r in range(26)]
    joint(canvas, [(ring[2], 0.6), (ring[2], 2.3)], 0.07, Look(3.8, salt=1.5), tongues=[(0.9, 0.5, 0.05, 1)])
    joint(canvas, [(ring[5], -4.4), (ring[5], -1.9)], 0.08, Look(4.5, edge=(0.012, 0.05)))
    u = joint_u(8, 2)
    joint(
        canvas, [(ring[8] - 0.1, u), (ring[9] + 0.05, u)], 0.06, Look(3.2), tongues=[(0.3, 0.5, 0.06, 1), (0.8, 0.8, 0.05, 1)]
    )
    outlet(canvas, ring[9] + 0.6, -1.3, 1.1, 0.08, Look(4.0, salt=2.0), "grouting hole", side=-1)
    patch(canvas, ring[12], -0.5, 0.75, 0.5, Look(2.4, edge=(0.04, 0.15), rough=0.05), "joint cross")
    joint(canvas, [(ring[13], 3.3), (ring[13], 6.1)], 0.09, Look(5.2), tongues=[(0.5, 0.9, 0.07, 1)], stop=6.21)
    streaks(canvas, [ring[15] + d for d in (0.1, 0.32, 0.45, 0.75)], -2.6, [0.9, 1.6, 1.2, 0.6], 0.05, Look(3.4, rough=0.015))
    outlet(canvas, ring[17] + 0.14, 2.1, 0.9, 0.07, Look(2.8), "bolt hole")
    joint(canvas, [(ring[18], -5.85), (ring[20] + 0.4, -5.85)], 0.1, Look(3.6, rough=0.04), "wet foot")
    joint(canvas, [(ring[19], -1.2), (ring[19], 1.0)], 0.08, Look(1.9, edge=(0.03, 0.12)), "wet joint")
    patch(canvas, ring[20] + 0.5, -3.6, 0.5, 0.85, Look(3.0, rough=0.05, salt=1.2), "patch")
    outlet(canvas, ring[23] + 0.5, 0.7, 1.6, 0.06, Look(6.8, edge=(0.01, 0.04)), "grouting hole", side=1, widen=2.2)
    joint(canvas, [(ring[23], -2.1), (ring[23], -4.4)], 0.11, Look(2.6), tongues=[(0.3, 0.7, 0.08, -1)])
    patch(canvas, ring[10] + 0.2, 4.15, 0.75, 0.3, Look(1.7, edge=(0.05, 0.15), rough=0.06), "patch")
    outlet(canvas, ring[6] + 0.3, 1.2, 0.25, 0.045, Look(3.5), "bolt hole")
    patch(canvas, ring[21] + 0.5, 0.2, 0.11, 0.09, Look(3.0), "drip")


def _fixtures(canvas: Canvas) -> list[Fixture]:
    rng, p = canvas.rng, canvas.profile
    out: list[Fixture] = []
    for z, radius in ((0.9, 0.018), (0.75, 0.022), (0.6, 0.015), (-0.95, 0.028), (-1.1, 0.022)):
        u = p.height_u(z, 1)
        out.append(along_lining(p, u, 0.11, radius, -3.5, sag=0.025, span=_RING, phase=0.9))
    out.append(along_lining(p, p.height_u(-0.45, 1), 0.16, 0.075, -1.0))
    for z in (1.2, 1.35):
        out.append(along_lining(p, p.height_u(z, -1), 0.1, 0.014, -4.0, sag=0.02, span=_RING, phase=0.9))
    for r in range(25):
        s = 0.9 + r * _RING
        for z in (0.75, -1.02):
            out.append(on_lining(p, s, p.height_u(z, 1), 0.04, 0.42, 0.1, -2.0))
        out.append(on_lining(p, s, p.height_u(1.27, -1), 0.03, 0.22, 0.08, -2.0))
        if r % 3 == 0:
            out.append(on_lining(p, s + 0.1, p.height_u(-0.45, 1), 0.06, 0.2, 0.22, -2.0))
            out.append(Block(s, -2.28, -1.3, 0.08, 0.08, 0.9, -1.5))
    out.append(Block(15, -2.3, -0.82, 32, 0.75, 0.05, -0.5))
    out.append(along_lining(p, p.height_u(0.2, -1), 0.12, 0.02, -1.0))
    out.append(Block(15, 0, 2.2, 32, 0.1, 0.12, 1.0))
    for s in np.arange(1.5, 30, 7.0):
        out.append(Block(float(s), 0, 2.5, 0.1, 0.3, 0.5, -1.0))
        out.append(on_lining(p, float(s) + 2.0, -2.9, 0.65, 0.14, 0.12, 2.0, gap=0.03))
    out.append(on_lining(p, 12.0, p.height_u(0.55, -1), 0.4, 0.3, 0.02, 3.5, gap=0.05))
    out.append(on_lining(p, 18.6, p.height_u(0.1, 1), 0.35, 0.45, 0.18, -1.0, gap=0.04))
    for y in (-0.7525, 0.7525):
        out.append(Block(15, y, -1.5, 32, 0.07, 0.16, -2.0))
    for s in np.arange(0.2, 30, 0.6):
        out.append(Block(float(s + rng.normal(0, 0.01)), 0, -1.69, 0.26, 2.3, 0.12, -0.8))
    out.append(Bar(1.55, -1.66, 0.03, -3.0))
    return out


def build(site: Site, canvas: Canvas) -> Tunnel:
    """Paint it and put everything in."""
    _lining(canvas)
    _dirt(canvas)
    for floor in canvas.floors():
        canvas.base[floor.at] -= 1.5
        dry.texture(canvas, floor, 0.8, 0.8, 0.05)
    _water(canvas)
    dry.grain(canvas, 0.25)
    return Tunnel(site.alignment, canvas, _fixtures(canvas))


def _make(folder: Path) -> None:
    deliver(folder, SITE, build)


SCENE = Scene(
    name=SITE.name,
    lining="segments",
    phenomenon="leaking gaskets, bolt and grouting holes",
    description=(
        "Single-track metro tunnel of staggered rings of six segments: water at ring joints, longitudinal "
        "joints, crossings, bolt "
        "and grouting holes; sealed joints, brake dust, rust, mortar patches and dried stains. As described "
        "in papers on leakage of "
        "shield tunnels in intensity of mobile scans (Tongji, Wuhan)."
    ),
    make=_make,
)
