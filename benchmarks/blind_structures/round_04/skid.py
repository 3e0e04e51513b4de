"""A skid of a process plant: tank, vessel, pipes and cable trays, with wet patches."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .cast import Body, Material, Tube, blob, runs
from .parts import add, beam, block, disc, grating, plate, point, sag, stripe, wire
from .survey import Instrument, Station, Survey

SLAB = Material(-4.8, 1.0, grain=0.3, broad=0.4, cell=0.03)
WALL = Material(-1.8, 1.0, grain=0.15, broad=0.2)
PAINT = Material(-3.2, 1.0, lobe=1.8, width=9.0, grain=0.08, broad=0.12)
CLAD = Material(-4.5, 1.0, lobe=7.0, width=12.0, grain=0.2, broad=0.2)
STAINLESS = Material(-7.0, 1.0, lobe=9.0, width=16.0, grain=0.25, broad=0.15)
RED = Material(-2.4, 1.0, lobe=1.6, width=9.0, grain=0.08, broad=0.1)
ZINC = Material(-5.5, 1.0, lobe=6.0, width=12.0, grain=0.5)
CABLE = Material(-10.0, 1.0, lobe=0.8, width=10.0, grain=0.2)
LABEL = Material(-0.9, 1.0, lobe=1.2, width=8.0, grain=0.04, broad=0.05)


def run(points: list[np.ndarray], radius: float, stuff: Material, flange: float = 0.0) -> list[Tube]:
    """Give a pipe through points, with flanges at its ends. The straight lengths come first."""
    out = [Tube(stuff, a=a, b=b, radius=radius) for a, b in zip(points[:-1], points[1:], strict=True)]
    if flange:
        for a, b in ((points[0], points[1]), (points[-1], points[-2])):
            w = (b - a) / np.linalg.norm(b - a)
            out.append(Tube(stuff, a=a, b=a + w * 0.045, radius=radius * 1.7))
    return out


def wheel(centre: np.ndarray, radius: float, stuff: Material) -> list[Body]:
    """Give a handwheel in a plane that faces -y."""
    turn = np.linspace(0.0, 2 * np.pi, 13)
    p = [centre + radius * point(np.cos(a), 0, np.sin(a)) for a in turn]
    out: list[Body] = [wire(a, b, 0.011, stuff) for a, b in zip(p[:-1], p[1:], strict=True)]
    return out + [wire(centre, q, 0.007, stuff) for q in p[:-1:4]]


def make(folder: Path) -> None:
    """Write the scene."""
    bodies: list[Body] = []
    slab = plate(point(0, 0.4, 0), point(1, 0, 0), point(0, 1, 0), (4.6, 3.6), SLAB)
    wall = plate(point(0, 3.1, 1.75), point(1, 0, 0), point(0, 0, 1), (4.6, 1.75), WALL)
    # Joints of the slab and of the wall's blocks.
    slab.design = lambda u, v: -2.5 * ((np.abs(u - 0.9) < 0.006) | (np.abs(v + 1.7) < 0.006))
    wall.design = lambda u, v: (
        -0.9 * ((np.mod(v + 5, 0.2) < 0.008) | (np.mod(u + 9 + 0.2 * (np.mod(v + 5, 0.4) < 0.2), 0.4) < 0.008))
    )
    bodies += [slab, wall]
    rails = [
        beam(point(-3.2, y, 0.12), point(3.2, y, 0.12), point(0, 0, 1), (0.2, 0.12, 0.008, 0.012), PAINT) for y in (-0.9, 1.9)
    ]
    rails += [
        beam(point(x, -0.83, 0.12), point(x, 1.83, 0.12), point(0, 0, 1), (0.18, 0.1, 0.008, 0.012), PAINT)
        for x in (-3.1, 0.0, 3.1)
    ]
    posts = [
        beam(point(x, y, 0.22), point(x, y, 2.9), point(0, 1, 0), (0.14, 0.14, 0.008, 0.012), PAINT)
        for x in (-0.2, 3.1)
        for y in (-0.85, 1.8)
    ]
    for section in rails + posts:
        for part in section:
            bodies += part
    tank = Tube(PAINT, a=point(-2.05, 0.55, 0.62), b=point(-2.05, 0.55, 2.85), radius=0.78)
    tank.design = lambda u, v: (
        0.7 * ((np.abs(v - 1.1) < 0.009) | (np.abs(u + 0.6) < 0.007) & (v < 1.1)) - 4.5 * (np.abs(v - 1.95) < 0.045)
    )
    bodies += [tank, disc(tank.a, point(0, 0, -1), 0.78, PAINT), disc(tank.b, point(0, 0, 1), 0.78, PAINT)]
    for k in (0.6, 2.2, 3.8, 5.4):
        foot = point(-2.05 + 0.68 * np.cos(k), 0.55 + 0.68 * np.sin(k), 0.12)
        bodies.append(Tube(PAINT, a=foot, b=foot + point(0, 0, 0.6), radius=0.05))
    plinth = block(point(0.2, -0.65, 0.0), point(2.6, 0.35, 0.34), SLAB)
    vessel = Tube(CLAD, a=point(0.3, -0.15, 0.98), b=point(2.5, -0.15, 0.98), radius=0.4)
    vessel.design = lambda u, v: -1.5 * ((np.mod(v, 0.73) < 0.012) | (np.abs(u - 0.9) < 0.008))
    bodies += [*plinth, vessel, disc(vessel.a, point(-1, 0, 0), 0.4, CLAD), disc(vessel.b, point(1, 0, 0), 0.4, CLAD)]
    for x in (0.65, 2.1):
        bodies += block(point(x - 0.07, -0.45, 0.34), point(x + 0.07, 0.15, 0.72), PAINT)
    motor = Tube(RED, a=point(-0.95, -0.5, 0.5), b=point(-0.45, -0.5, 0.5), radius=0.16)
    pump = block(point(-1.2, -0.66, 0.22), point(-0.95, -0.34, 0.68), RED)
    bodies += [
        motor,
        disc(motor.b, point(1, 0, 0), 0.16, RED),
        *pump,
        *block(point(-1.25, -0.7, 0.0), point(-0.4, -0.3, 0.34), SLAB),
    ]
    red = run(
        [point(-1.08, -0.5, 0.68), point(-1.08, -0.5, 1.9), point(0.4, -0.5, 1.9), point(3.0, -0.5, 1.9)], 0.057, RED, 0.1
    )
    steel = run([point(-1.3, 0.5, 2.3), point(1.2, 0.5, 2.3), point(1.2, 0.5, 1.35)], 0.084, STAINLESS, 0.1)
    clad = run([point(-0.2, 1.5, 0.7), point(-0.2, 1.5, 2.45), point(3.0, 1.5, 2.45)], 0.15, CLAD)
    thin = run([point(1.7, -0.7, 0.5), point(1.7, -0.7, 2.15), point(1.7, 2.9, 2.15)], 0.03, STAINLESS, 0.1)
    low = run([point(-3.2, -0.62, 0.42), point(-1.25, -0.62, 0.42)], 0.076, STAINLESS, 0.1)
    wallpipes = [
        Tube(m, a=point(-4.4, 2.95, z), b=point(4.4, 2.95, z), radius=r)
        for z, r, m in ((3.1, 0.06, RED), (2.9, 0.045, STAINLESS))
    ]
    bodies += red + steel + clad + thin + low + wallpipes
    # Bands that name the medium belong to the design.
    red[1].design = red[2].design = lambda u, v: -3.0 * ((v > 0.5) & (v < 0.68))
    bodies += wheel(point(0.9, -0.72, 1.9), 0.12, RED) + wheel(point(-2.2, -0.85, 0.42), 0.1, RED)
    cabinet = block(point(2.75, -1.25, 0.3), point(3.45, -0.95, 1.75), PAINT)
    cabinet[2].design = lambda u, v: (
        -5.5 * ((np.abs(u) < 0.16) & (np.abs(v - 0.4) < 0.11)) - 2.0 * (np.hypot(u - 0.2, v) < 0.03)
    )
    bodies += cabinet
    bodies.append(
        plate(point(3.1, -1.254, 0.75), point(1, 0, 0), point(0, 0, 1), (0.12, 0.05), LABEL, design=stripe(-0.01, 0.01, -6.0))
    )
    for x, y, z, half in ((0.0, 1.05, 2.72, 4.2), (0.0, -0.75, 2.62, 3.2)):
        bodies.append(
            plate(
                point(x, y, z), point(1, 0, 0), point(0, 1, 0), (half, 0.15), ZINC, smooth=False, mask=grating(0.1, 0.05, 0.005)
            )
        )
        for k in (-1, 1):
            bodies.append(plate(point(x, y + k * 0.15, z + 0.03), point(1, 0, 0), point(0, 0, 1), (half, 0.03), ZINC))
        bodies += [
            wire(point(x - half, y + d, z + 0.02), point(x + half, y + d, z + 0.02), 0.012, CABLE)
            for d in (-0.1, -0.06, 0.02, 0.07)
        ]
    bodies += sag(point(3.1, -0.75, 2.6), point(3.1, -1.1, 1.75), 0.02, 0.012, CABLE, 4)
    bodies += sag(point(-0.6, -0.75, 2.6), point(-0.7, -0.5, 0.66), 0.05, 0.011, CABLE, 6)
    wet = {"kind": "moisture", "lobe": 1.2}
    add(slab, db=-5.2, weight=blob(-1.5, -2.2, 1.1, 0.5, 81, ragged=0.3), **wet)
    add(slab, db=-4.4, weight=blob(1.9, -2.6, 0.8, 0.42, 83, ragged=0.35), **wet)
    add(slab, "stain", -3.0, blob(3.9, -1.2, 0.45, 0.9, 85, ragged=0.3))
    add(tank, "stain", -2.9, runs(0.35, 2.2, 0.25, 1.7, 87, 0.03), lobe=-1.2)
    add(tank, "peeled paint", -2.6, blob(-0.45, 0.5, 0.24, 0.28, 89, ragged=0.5, soft=0.06), lobe=-1.5)
    add(vessel, "stain", -3.5, blob(-0.45, 0.6, 0.2, 0.3, 91), lobe=-5.8)
    add(vessel, "rust", -3.0, blob(-0.3, 1.65, 0.2, 0.3, 93), lobe=-6.0)
    add(plinth[2], db=-4.6, weight=blob(-0.4, -0.06, 0.5, 0.14, 95), **wet)
    add(wall, db=-4.0, weight=blob(1.6, -0.2, 0.6, 0.7, 97, ragged=0.25), **wet)
    add(wall, "efflorescence", 1.5, blob(3.8, 0.3, 0.45, 0.8, 99))
    add(cabinet[2], "patched paint", 1.8, lambda u, v: ((np.abs(u + 0.1) < 0.17) & (np.abs(v + 0.45) < 0.16)) * 1.0)
    add(clad[0], "stain", -3.2, blob(0.0, 0.9, 0.2, 0.4, 101), lobe=-5.5)
    add(red[2], "rust", -3.2, blob(-0.02, 1.6, 0.12, 0.3, 103), lobe=-1.3)
    add(rails[0][0][2], "rust", -3.4, blob(-1.3, 0.0, 0.35, 0.08, 105), lobe=-1.5)
    Survey(
        bodies=bodies,
        stations=[Station((0.3, -5.2, 1.72), (42.0, 138.0), (-34.0, 25.0), 0.07)],
        instrument=Instrument(level=26.0, near=1.4, noise=0.35, ranging=0.0012, beam=0.3, facet=0.12),
        seed=4054,
        epsg=28992,
        origin=(68450.0, 438120.0, 3.2),
    ).write(folder)
