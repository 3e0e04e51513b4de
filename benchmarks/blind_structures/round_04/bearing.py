"""The bearing of a painted truss bridge: peeled paint, handrails, a grating and a stained abutment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .cast import Body, Material, Tube, band, blob, runs
from .parts import add, beam, block, bolts, disc, grating, plants, plate, point, sag
from .survey import Instrument, Station, Survey

PAINT = Material(-3.6, 1.0, lobe=2.0, width=9.0, grain=0.12, broad=0.22)
RAIL = Material(-2.2, 1.0, lobe=2.5, width=9.0, grain=0.1, broad=0.1)
STEEL = Material(-5.0, 1.0, lobe=8.0, width=14.0, grain=0.4, broad=0.3)
ZINC = Material(-5.5, 1.0, lobe=6.0, width=12.0, grain=0.5)
STONE = Material(-4.2, 1.0, grain=0.35, broad=0.4, cell=0.03)
RUBBER = Material(-11.0, 1.0, lobe=0.5, width=10.0, grain=0.15)
LABEL = Material(-0.8, 1.0, lobe=1.5, width=8.0, grain=0.04, broad=0.05)
LEAF = Material(-2.6, 0.7, grain=0.5)
EARTH = Material(-5.0, 0.7, grain=1.2, broad=0.8)


def turned(degrees: float) -> np.ndarray:
    """Give a rotation about y that lifts +x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def make(folder: Path) -> None:
    """Write the scene."""
    rng = np.random.default_rng(4053)
    bodies: list[Body] = []
    seat = block(point(-1.3, -1.6, -0.2), point(3.4, 1.8, 1.0), STONE)
    back = block(point(1.5, -1.6, 1.0), point(3.4, 1.8, 3.1), STONE)
    # The abutment is built in courses; the joints are no anomaly.
    for face in (seat[2], back[2], back[0]):
        face.design = lambda u, v: (
            -1.8 * ((np.mod(v + 5, 0.4) < 0.014) | (np.mod(u + 5 + 0.35 * (np.mod(v + 5, 0.8) < 0.4), 0.7) < 0.014))
        )
    bodies += seat + back
    sole = block(point(-0.45, -0.5, 1.0), point(0.45, 0.5, 1.07), STEEL)
    rocker = Tube(STEEL, a=point(0, -0.45, 1.22), b=point(0, 0.45, 1.22), radius=0.15)
    saddle = block(point(-0.4, -0.42, 1.37), point(0.4, 0.42, 1.45), PAINT)
    bodies += [*sole, *saddle, rocker, disc(point(0, -0.45, 1.22), point(0, -1, 0), 0.15, STEEL)]
    bodies += bolts(sole[5], [(x, y) for x in (-0.36, 0.36) for y in (-0.4, 0.4)], 0.028, 0.05, STEEL)
    chord = block(point(-7.5, -0.25, 1.45), point(0.55, 0.25, 2.0), PAINT)
    far = block(point(-7.5, 3.75, 1.45), point(0.55, 4.25, 2.0), PAINT)
    mid = point(0.1, 0, 1.75) + turned(125.0) @ point(3.0, 0, 0)
    post = block(mid - point(3.0, 0.22, 0.24), mid + point(3.0, 0.22, 0.24), PAINT, turned(125.0))
    bodies += chord + far + post
    hanger = beam(point(-3.3, 0, 2.0), point(-3.3, 0, 6.6), point(0, -1, 0), (0.42, 0.3, 0.014, 0.02), PAINT)
    brace = beam(point(-3.5, 0, 6.2), point(-6.6, 0, 2.0), point(0, -1, 0), (0.38, 0.28, 0.014, 0.02), PAINT)
    cross = beam(point(-3.3, 0.3, 1.75), point(-3.3, 3.7, 1.75), point(0, 0, 1), (0.5, 0.26, 0.016, 0.022), PAINT)
    for section in (hanger, brace, cross):
        for part in section:
            bodies += part
    gussets = []
    for x, z, half in ((-0.45, 2.05, (0.75, 0.55)), (-3.3, 2.05, (0.55, 0.5)), (-6.4, 2.0, (0.5, 0.45))):
        g = plate(
            point(x, -0.265, z),
            point(1, 0, 0),
            point(0, 0, 1),
            half,
            PAINT,
            mask=lambda u, v, h=half: np.abs(u) / h[0] + np.abs(v) / h[1] < 1.45,
        )
        gussets.append(g)
        bodies.append(g)
        grid = [(u, v) for u in np.arange(-half[0] + 0.12, half[0], 0.13) for v in (-half[1] + 0.1, -half[1] + 0.24, 0.1, 0.24)]
        spots = [(u, v) for u, v in grid if abs(u) / half[0] + abs(v) / half[1] < 1.25]
        bodies += bolts(g, spots, 0.017, 0.012, PAINT)
    # A walkway of grating stands out on brackets; its rail has three tubes.
    deck = plate(
        point(-3.6, -0.95, 2.72),
        point(1, 0, 0),
        point(0, 1, 0),
        (3.8, 0.4),
        ZINC,
        smooth=False,
        mask=grating(0.034, 0.1, 0.005),
    )
    bodies.append(deck)
    bodies += block(point(-7.4, -1.38, 2.62), point(0.2, -1.36, 2.76), RAIL)
    for x in np.arange(-7.2, 0.3, 1.45):
        bodies.append(Tube(RAIL, a=point(x, -1.4, 2.6), b=point(x, -1.4, 3.8), radius=0.024))
        bodies += block(point(x - 0.03, -1.36, 2.6), point(x + 0.03, -0.25, 2.7), RAIL)[:5]
    for z in (3.1, 3.45, 3.8):
        bodies.append(Tube(RAIL, a=point(-7.4, -1.4, z), b=point(0.2, -1.4, z), radius=0.021 if z < 3.7 else 0.026))
    bodies += sag(point(-7.5, -0.3, 1.36), point(1.4, -0.3, 1.36), 0.12, 0.018, RUBBER)
    drain = Tube(RUBBER, a=point(2.5, -1.7, 0.0), b=point(2.5, -1.7, 3.1), radius=0.07)
    bodies.append(drain)
    bodies.append(
        plate(
            point(-1.9, -0.256, 1.72),
            point(1, 0, 0),
            point(0, 0, 1),
            (0.2, 0.09),
            LABEL,
            design=lambda u, v: -5.0 * (np.abs(np.mod(u, 0.08) - 0.04) < 0.012) * (np.abs(v) < 0.05),
        )
    )
    # A weld and a painted stripe for the level of floods.
    chord[2].design = lambda u, v: 0.9 * (np.abs(u + 1.3) < 0.008)
    bodies.append(plate(point(-3.0, 0, -0.2), point(1, 0, 0), point(0, 1, 0), (7.0, 7.0), EARTH, smooth=False))
    bodies += plants(point(-4.6, -1.6, 0.2), point(0.5, 0.3, 0.3), 120, LEAF, rng)
    bare = {"kind": "peeled paint", "lobe": -1.7}
    # The chord's front has its middle at x = -3.475, and its second coordinate is height.
    add(chord[2], db=-2.8, weight=blob(0.9, -0.1, 0.55, 0.15, 51, ragged=0.5, soft=0.06), **bare)
    add(chord[2], db=-2.3, weight=blob(-2.3, 0.12, 0.7, 0.12, 53, ragged=0.55, soft=0.06), **bare)
    add(chord[2], "patched paint", 1.9, lambda u, v: ((np.abs(u - 2.15) < 0.16) & (np.abs(v + 0.05) < 0.19)) * 1.0)
    add(back[0], "soot", -4.0, blob(0.3, -0.3, 0.6, 0.45, 55, ragged=0.2, soft=0.4), lobe=0.0)
    add(post[2], db=-3.2, weight=blob(-1.0, 0.02, 0.5, 0.17, 57, ragged=0.5, soft=0.06), **bare)
    add(post[2], "rust", -3.7, blob(1.3, -0.05, 0.4, 0.14, 59), lobe=-1.6)
    add(gussets[0], "rust", -3.3, runs(0.15, 0.2, 0.3, 0.6, 61, 0.03), lobe=-1.6)
    add(gussets[1], db=-2.6, weight=blob(-0.15, -0.12, 0.22, 0.2, 63, ragged=0.5, soft=0.06), **bare)
    add(hanger[1][5], db=-3.0, weight=blob(-0.8, 0.0, 0.45, 0.11, 65, ragged=0.4), **bare)
    add(brace[1][5], "rust", -3.0, blob(0.9, 0.0, 0.4, 0.1, 67), lobe=-1.6)
    add(cross[0][0], "rust", -3.4, blob(0.3, -0.05, 0.4, 0.14, 68), lobe=-1.6)
    add(seat[2], "moisture", -4.6, band(-0.3, 69, 0.08), lobe=0.4)
    add(seat[2], "graffiti", -3.6, blob(-1.2, 0.22, 0.5, 0.2, 71, ragged=0.6, soft=0.06))
    add(back[2], "efflorescence", 2.6, runs(-0.4, 0.6, 0.28, 1.3, 73))
    add(seat[0], "stain", -2.9, runs(0.2, 0.58, 0.6, 0.9, 75))
    chalk = "Chalking of the paint that fades over a metre without an edge."
    add(chord[2], "patched paint", 1.3, blob(-0.7, 0.0, 0.6, 0.3, 77, ragged=0.1, soft=2.0), limit=chalk)
    Survey(
        bodies=bodies,
        stations=[
            Station((-2.2, -5.6, 1.35), (42.0, 140.0), (-13.0, 44.0), 0.082),
            Station((1.8, -6.3, 1.42), (66.0, 155.0), (-12.0, 38.0), 0.08, offset_db=0.3),
            Station((-6.2, -4.4, 1.3), (18.0, 100.0), (-13.0, 40.0), 0.09, offset_db=-0.1),
        ],
        instrument=Instrument(level=24.0, near=1.6, noise=0.5, ranging=0.0012, beam=0.3, facet=0.08),
        seed=4053,
        epsg=27700,
        origin=(512388.0, 178204.0, 6.7),
    ).write(folder)
