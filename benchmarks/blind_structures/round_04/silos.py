"""Three concrete silos with stains, efflorescence and damp, a downpipe and a caged ladder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .cast import Body, Material, Plane, Tube, band, blob, runs
from .parts import add, block, bolts, plants, plate, point, wire
from .survey import Instrument, Station, Survey

CONCRETE = Material(-4.6, 1.05, grain=0.3, broad=0.35, cell=0.028)
RENDER = Material(-3.4, 1.0, grain=0.2, broad=0.25, cell=0.02)
STEEL = Material(-4.0, 1.0, lobe=5.0, width=12.0, grain=0.3)
PAINT = Material(-3.0, 1.0, lobe=1.4, width=9.0, grain=0.1, broad=0.12)
PVC = Material(-5.5, 1.0, lobe=2.5, width=8.0, grain=0.05, broad=0.1)
LEAF = Material(-3.0, 0.7, grain=0.5)
ASPHALT = Material(-9.0, 0.9, grain=0.7, broad=0.4)
RADIUS, TALL = 2.1, 8.6


def lifts(pitch: float, number: str = "") -> Plane:
    """Give the joints between lifts of the formwork, and a painted number 1 or 2."""

    def design(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        out = -1.6 * (np.mod(v, pitch) < 0.018)
        x, y = u + 0.1, v - 5.2
        ink = np.zeros(u.shape, bool)
        if number == "1":
            ink = (np.abs(x) < 0.09) & (np.abs(y) < 0.55)
        elif number == "2":
            ink = (np.abs(x) < 0.33) & (np.abs(y) < 0.55)
            ink &= (np.abs(np.abs(y) - 0.47) < 0.08) | (np.abs(y) < 0.08)
            ink |= (np.abs(x - 0.26) < 0.07) & (y > 0) & (y < 0.5) | (np.abs(x + 0.26) < 0.07) & (y < 0) & (y > -0.5)
        return np.where(ink, -5.0, out)

    return design


def make(folder: Path) -> None:
    """Write the scene."""
    rng = np.random.default_rng(4052)
    bodies: list[Body] = []
    silos = [Tube(CONCRETE, a=point(x, 0, 0.9), b=point(x, 0, 0.9 + TALL), radius=RADIUS) for x in (-4.35, 0.0, 4.35)]
    for silo, number in zip(silos, ("1", "2", ""), strict=True):
        silo.design = lifts(1.25, number)
        rim = silo.b + point(0, 0, 0.0)
        bodies.append(Tube(CONCRETE, a=rim - point(0, 0, 0.02), b=rim + point(0, 0, 0.25), radius=RADIUS + 0.08))
    bodies += silos
    plinth = block(point(-7.0, -2.6, -0.2), point(7.0, 2.4, 0.9), RENDER)
    bodies += plinth
    # A joint and a row of ties are in the plinth. A hatch, a downpipe and a ladder stand before the silos.
    plinth[2].design = lambda u, v: -2.0 * ((np.mod(u, 3.5) < 0.015) | (np.hypot(np.mod(u, 0.875) - 0.43, v - 0.1) < 0.025))
    hatch = block(point(-0.55, -2.35, 1.0), point(0.35, -2.0, 2.1), PAINT)
    bodies += hatch
    bodies += bolts(hatch[2], [(x, z) for x in (-0.4, 0.4) for z in (-0.5, -0.17, 0.17, 0.5)], 0.018, 0.015, STEEL)
    pipe = Tube(PVC, a=point(2.17, -1.0, 0.9), b=point(2.17, -1.0, 9.2), radius=0.08)
    bodies.append(pipe)
    bodies += [Tube(STEEL, a=point(2.17, -1.0, z), b=point(2.17, -1.0, z + 0.04), radius=0.09) for z in (2.0, 4.5, 7.0)]
    pedestal = block(point(0.9, -4.4, -0.2), point(1.8, -3.6, 0.9), CONCRETE)
    bodies += pedestal
    x0, y0 = -5.0, -2.32
    for k in (-1, 1):
        bodies.append(Tube(STEEL, a=point(x0 + k * 0.22, y0, 1.2), b=point(x0 + k * 0.22, y0, 9.4), radius=0.022))
    for z in np.arange(1.4, 9.3, 0.28):
        bodies.append(Tube(STEEL, a=point(x0 - 0.22, y0, z), b=point(x0 + 0.22, y0, z), radius=0.012))
    for z in np.arange(3.2, 9.3, 0.9):
        p = [point(x0 + 0.36 * np.cos(a), y0 - 0.36 + 0.36 * np.sin(a), z) for a in np.linspace(0.4, -3.5, 9)]
        bodies += [Tube(STEEL, smooth=False, a=a, b=b, radius=0.012) for a, b in zip(p[:-1], p[1:], strict=True)]
    bodies.append(wire(point(4.0, -2.25, 0.9), point(4.1, -2.2, 9.0), 0.012, PVC))
    bodies.append(plate(point(0, -7, -0.2), point(1, 0, 0), point(0, 1, 0), (12.0, 7.0), ASPHALT))
    bodies += plants(point(6.2, -3.0, 0.05), point(0.35, 0.2, 0.25), 60, LEAF, rng)
    bodies += plants(point(-2.2, -2.75, 0.1), point(0.2, 0.1, 0.2), 35, LEAF, rng)
    top = TALL - 0.02
    one, two, three = silos
    add(one, "stain", -3.2, runs(-0.55, top, 0.55, 4.2, 21))
    add(one, "efflorescence", 2.4, blob(1.0, 3.4, 0.45, 0.7, 23))
    add(one, "moisture", -4.4, band(0.55, 25, 0.12), lobe=0.3)
    add(two, "stain", -2.4, runs(0.95, top, 0.7, 3.1, 27))
    add(two, "rust", -2.8, runs(-1.35, 3.5, 0.5, 3.2, 29, 0.03))
    add(two, "patch", 2.0, lambda u, v: ((np.abs(u - 1.25) < 0.62) & (np.abs(v - 2.6) < 0.55)).astype(float))
    add(three, "stain", -3.6, runs(-1.3, top, 0.42, 5.5, 31))
    add(three, "graffiti", -3.9, blob(0.2, 1.25, 0.75, 0.4, 33, ragged=0.6, soft=0.08))
    add(three, "efflorescence", 2.9, runs(0.75, 5.02, 0.85, 2.6, 35))
    add(
        pedestal[2],
        "crack",
        -3.0,
        lambda u, v: (np.abs(u - 0.08 - 0.05 * np.sin(v * 9) + 0.12 * v) < 0.02) * (np.abs(v) < 0.52) * 1.0,
    )
    add(pedestal[0], "moisture", -4.0, band(-0.2, 45, 0.1))
    haze = "Dust that fades over metres without an edge; it reads as the concrete's own variation."
    add(two, "stain", -1.8, blob(-1.0, 6.9, 0.9, 1.2, 37, ragged=0.2, soft=2.2), limit=haze)
    add(plinth[2], "moisture", -5.0, blob(-3.3, -0.45, 1.1, 0.32, 39), lobe=0.5)
    add(plinth[2], "soot", -4.5, blob(3.6, 0.05, 0.5, 0.42, 41, ragged=0.25, soft=0.4))
    add(hatch[2], "rust", -3.4, blob(0.18, -0.38, 0.2, 0.16, 43), lobe=-1.2)
    Survey(
        bodies=bodies,
        stations=[
            Station((-3.4, -10.2, 1.55), (47.0, 122.0), (-13.0, 41.0), 0.068),
            Station((4.6, -9.1, 1.48), (52.0, 133.0), (-13.0, 44.0), 0.068, offset_db=-0.2),
        ],
        instrument=Instrument(level=25.5, near=3.5, noise=0.55, ranging=0.002, beam=0.4, facet=0.15),
        seed=4052,
        epsg=2154,
        origin=(651870.0, 6862410.0, 41.2),
    ).write(folder)
