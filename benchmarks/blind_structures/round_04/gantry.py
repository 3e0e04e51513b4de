"""A portal of a substation: galvanised lattice with rust, insulators and wires."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .cast import Body, Face, Material, Tube, blob, runs
from .parts import add, angle, block, bolts, disc, plate, point, sag, stripe
from .survey import Instrument, Station, Survey

ZINC = Material(-6.0, 1.0, lobe=8.0, width=13.0, grain=0.55, broad=0.3, cell=0.018)
NEW_ZINC = Material(-3.8, 1.0, lobe=14.0, width=9.0, grain=0.7, broad=0.2, cell=0.022)
BOLT = Material(-5.0, 1.0, lobe=5.0, width=15.0, grain=0.4)
CONCRETE = Material(-5.2, 1.0, grain=0.25, broad=0.35, cell=0.03)
GLASS = Material(-8.5, 1.0, lobe=6.0, width=8.0, grain=0.1)
WIRE = Material(-7.0, 1.0, lobe=2.0, grain=0.3)
LABEL = Material(-1.5, 1.0, lobe=1.0, width=8.0, grain=0.05, broad=0.05)
SIDE, TALL, SPAN = 0.8, 6.4, 7.0


def column(x: float, legs: dict[tuple[int, int], list[Body]]) -> list[Body]:
    """Give a lattice column around (x, 0): four legs and a zigzag on each side."""
    out: list[Body] = []
    half = SIDE / 2
    for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        foot = point(x + i * half, j * half, 0.25)
        leg = angle(foot, foot + point(0, 0, TALL), point(-i, 0, 0), point(0, -j, 0), 0.12, ZINC, 0.01)
        legs[i, j] = leg
        out += leg
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    for k in range(4):
        (x0, y0), (x1, y1) = corners[k], corners[(k + 1) % 4]
        inward = -point((x0 + x1) / 2, (y0 + y1) / 2, 0) / half
        for n in range(7):
            z0, z1 = 0.55 + n * 0.86, 0.55 + (n + 1) * 0.86
            a, b = (point(x + x0, y0, z0), point(x + x1, y1, z1)) if n % 2 else (point(x + x1, y1, z0), point(x + x0, y0, z1))
            shift = inward * 0.013
            stuff = NEW_ZINC if (k, n, x > 3) == (0, 3, True) else ZINC
            out += angle(a + shift, b + shift, point(0, 0, 1), inward, 0.065, stuff, 0.007)[:3]
    return out


def make(folder: Path) -> None:
    """Write the scene."""
    bodies: list[Body] = []
    left: dict = {}
    right: dict = {}
    bodies += column(0.0, left) + column(SPAN, right)
    chords = {}
    for j in (-1, 1):
        for top in (0, 1):
            a, b = point(-0.4, j * 0.4, 5.75 + top * 0.8), point(SPAN + 0.4, j * 0.4, 5.75 + top * 0.8)
            chords[j, top] = angle(a, b, point(0, 0, 1 - 2 * top), point(0, -j, 0), 0.1, ZINC, 0.009)
            bodies += chords[j, top]
        for n in range(8):
            x0, x1 = 0.4 + n * 0.775, 0.4 + (n + 1) * 0.775
            z0, z1 = (5.8, 6.5) if n % 2 else (6.5, 5.8)
            y = j * 0.387
            bodies += angle(point(x0, y, z0), point(x1, y, z1), point(0, 0, 1), point(0, -j, 0), 0.06, ZINC, 0.006)[:3]
    gussets: list[Face] = []
    for x in (0.0, SPAN):
        for n in range(0, 7, 2):
            for i in (-1, 1):
                plate_ = plate(
                    point(x + i * 0.27, -0.4 - 0.009, 0.6 + n * 0.86), point(1, 0, 0), point(0, 0, 1), (0.11, 0.14), ZINC
                )
                gussets.append(plate_)
                bodies.append(plate_)
                bodies += bolts(plate_, [(-0.06, -0.08), (0.06, -0.08), (-0.06, 0.08), (0.06, 0.08)], 0.014, 0.012, BOLT)
        low = point(x - 0.65, -0.65, -0.25)
        base = block(low, low + point(1.3, 1.3, 0.48), CONCRETE)
        bodies += base
        shoe = block(point(x - 0.5, -0.5, 0.23), point(x + 0.5, 0.5, 0.25), ZINC)
        bodies += shoe
    # Insulators hang from the beam; below them are wires.
    for x in (1.6, 3.5, 5.4):
        top = point(x, -0.2, 5.7)
        bodies.append(Tube(BOLT, a=top - point(0, 0, 1.5), b=top, radius=0.025))
        for n in range(9):
            z = 5.5 - 0.14 * n
            bodies.append(Tube(GLASS, a=point(x, -0.2, z - 0.03), b=point(x, -0.2, z), radius=0.125))
            bodies.append(disc(point(x, -0.2, z - 0.03), point(0, 0, -1), 0.125, GLASS))
        bodies += sag(point(x, -4.5, 5.3), point(x, -0.2, 4.2), 0.3, 0.011, WIRE)
        bodies += sag(point(x, -0.2, 4.2), point(x, 5.5, 5.2), 0.4, 0.011, WIRE)
    # A label and an earthing strap with stripes belong to the design.
    bodies.append(
        plate(point(0.0, -0.43, 2.2), point(1, 0, 0), point(0, 0, 1), (0.16, 0.11), LABEL, design=stripe(-0.05, 0.0, -6.0))
    )
    bodies.append(
        plate(
            point(SPAN, -0.425, 0.9),
            point(1, 0, 0),
            point(0, 0, 1),
            (0.02, 0.6),
            LABEL,
            design=lambda u, v: -4.0 * (np.mod(v, 0.2) < 0.1),
        )
    )
    cabinet = block(point(2.7, 0.6, 0.1), point(3.7, 1.2, 1.5), Material(-2.2, 1.0, lobe=1.5, width=9.0, grain=0.06, broad=0.1))
    bodies += cabinet
    cabinet[2].design = stripe(-0.004, 0.004, -5.0, axis=0)
    ground = plate(
        point(3.5, 0, 0.0), point(1, 0, 0), point(0, 1, 0), (9.0, 5.0), Material(-6.0, 0.8, grain=1.4, broad=0.5), smooth=False
    )
    bodies.append(ground)
    rust = {"kind": "rust", "lobe": -7.4}
    # Legs face -y with their first leg, and the outer side of x with their second.
    add(left[-1, -1][0], db=-3.6, weight=blob(-2.55, 0.0, 0.42, 0.075, 1), **rust)
    add(left[-1, -1][0], db=-2.6, weight=blob(0.6, 0.0, 0.3, 0.08, 2), **rust)
    add(left[1, -1][0], db=-3.2, weight=blob(2.0, 0.0, 0.55, 0.07, 3), **rust)
    add(left[1, 1][0], db=-3.4, weight=blob(0.4, 0.0, 0.5, 0.08, 4), side=-1, **rust)
    add(right[-1, -1][0], db=-3.0, weight=blob(1.5, 0.0, 0.65, 0.09, 5), **rust)
    add(right[-1, -1][2], db=-3.8, weight=blob(-0.7, 0.0, 0.45, 0.08, 6), **rust)
    add(right[1, -1][0], db=-3.5, weight=blob(-2.2, 0.0, 0.38, 0.08, 7), **rust)
    add(chords[-1, 0][0], db=-3.3, weight=blob(0.8, 0.0, 0.5, 0.07, 8), **rust)
    add(chords[-1, 1][0], db=-2.9, weight=blob(-2.0, 0.0, 0.6, 0.075, 9), **rust)
    faint = "A thin bloom without an edge that is weaker than the spangle of the zinc around it."
    add(chords[-1, 0][0], "rust", -1.9, blob(-1.9, 0.0, 0.5, 0.07, 10, soft=1.4), limit=faint)
    add(gussets[1], db=-3.1, weight=blob(0.02, -0.03, 0.075, 0.07, 11), **rust)
    add(cabinet[2], "rust", -3.0, runs(0.2, 0.45, 0.09, 0.6, 12, 0.03), lobe=-1.3)
    add(cabinet[2], "graffiti", -4.2, blob(-0.22, 0.05, 0.2, 0.16, 14, ragged=0.5))
    Survey(
        bodies=bodies,
        stations=[
            Station((1.2, -6.4, 1.62), (54.0, 128.0), (-10.0, 47.0), 0.044),
            Station((6.3, -5.6, 1.71), (46.0, 142.0), (-11.0, 50.0), 0.052, offset_db=0.25),
        ],
        instrument=Instrument(level=27.0, near=2.4, noise=0.45, ranging=0.0015, beam=0.3),
        seed=4051,
        epsg=25832,
        origin=(602345.0, 5731822.0, 118.4),
    ).write(folder)
