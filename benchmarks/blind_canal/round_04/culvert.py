"""A concrete culvert with inlets, a step in the bed and buttresses at one pitch, without a ladder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .deliver import Survey, stones
from .parts import blend
from .sensors import Sonar, Station
from .trace import Bar, Canal, Course, Field, Noise, Profile, Stone, box, pipe

WATER = 87.153
PITCH = 6.0


def concrete(seed: int, bed: float) -> Field:
    """Give the relief of shuttered concrete: panels that are out of line by millimetres, and silt on the bed."""
    wave, grain = Noise(seed, 3, 0.7), Noise(seed + 1, 3, 0.05)
    silt = Noise(seed + 2, 2, 0.9)
    offset = np.random.default_rng(seed).normal(0.0, 0.0015, (64, 8))

    def wall(s: np.ndarray, q: np.ndarray, z: np.ndarray) -> np.ndarray:
        panel = offset[np.floor(s / 1.25).astype(int) % 64, np.floor(z / 0.625).astype(int) % 8]
        return panel + 0.003 * wave(s, q, z) + 0.0008 * grain(s, q, z)

    return blend(wall, lambda s, q, _: 0.014 * silt(s, q), bed + 0.5, 0.2)


def make(folder: Path) -> None:
    """Write the scene."""
    rng = np.random.default_rng(40440)
    bed = WATER - 1.9
    section = [(-2.3, bed + 0.1), (-1.9, bed), (1.9, bed), (2.3, bed + 0.1), (2.3, WATER + 1.6), (1.95, WATER + 1.95)]
    section += [(-1.95, WATER + 1.95), (-2.3, WATER + 1.6)]
    canal = Canal(course=Course(lead=48.0), length=48.0, profile=Profile(section), relief=concrete(4401, bed))
    # The bed falls by 0.38 m at 33 m. Buttresses stand before the left wall.
    canal.solids.append(box(-2.0, 33.0, -3.0, 3.0, bed - 1.0, bed + 0.38))
    for s in np.arange(PITCH, 47.0, PITCH):
        canal.solids.append(box(s - 0.25, s + 0.25, 2.02, 3.0, bed - 1.0, WATER + 1.42))
    # Two inlets are half under water, one is wholly under it, and one is high in the left wall.
    canal.voids += [pipe(10.3, WATER + 0.04, 0.46, -4.4, -2.0), pipe(27.0, WATER - 0.8, 0.3, -3.9, -2.0)]
    canal.voids += [pipe(44.2, WATER - 0.06, 0.36, -3.8, -2.0), pipe(38.7, WATER + 1.0, 0.2, 2.0, 3.6)]
    canal.bodies += stones(9, (2.0, 12.0), 1.5, bed + 0.38, (0.05, 0.14), canal, rng)
    cable: list[Bar | Stone] = [Bar(np.array([0.2, -2.2, WATER + 1.3]), np.array([47.8, -2.2, WATER + 1.32]), 0.02)]
    both = (
        "No other feature that both sensors see is in reach. The walls are vertical and the water moved by an unknown amount, "
        "so the height is open by that amount too."
    )
    first = (
        "Two buttresses of the left wall are seen, which stand at a pitch of 6.000 m and look alike. "
        "The inlet at 27 m is wholly under water and unknown to the laser. "
        f"Poses shifted along the axis by 6 or 12 m (to 27 or 33 m) explain the data as well. {both}"
    )
    second = (
        "Two buttresses of the left wall are seen, and a step of the bed that the laser cannot see. "
        f"Poses shifted along the axis by multiples of 6 m (to 19, 25 or 31 m) explain the data as well. {both}"
    )
    Survey(
        canal=canal,
        seed=4044,
        epsg=25832,
        east=468912.0,
        north=5553207.0,
        bearing=-21.7,
        water=WATER,
        water_then=WATER + 0.088,
        axis_height=WATER + 0.5,
        stations=[Station((s, q, WATER + 1.1)) for s, q in ((7.0, 0.2), (19.0, -0.2), (31.0, 0.1), (42.0, 0.3))],
        scans=[
            Sonar((8.4, -0.2, WATER - 0.7), 140.0, (1.9, -2.8), 0.9917, reach=9.0),
            Sonar((21.0, 0.4, WATER - 0.62), 19.0, (-3.6, 1.3), 0.9917, reach=7.0, determined=False, open=first),
            Sonar((37.0, -0.3, WATER - 0.9), 232.0, (2.2, 4.7), 0.9917, reach=6.2, determined=False, open=second),
            Sonar((45.4, 0.2, WATER - 0.8), 297.0, (-0.8, -1.9), 0.9917, reach=6.0, noise=0.01),
        ],
        dry=cable,
        spacing=4.0,
    ).write(folder)
