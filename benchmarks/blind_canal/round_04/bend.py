"""A masonry canal in a gentle bend, with a towpath and two steel ladders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .deliver import Ladder, Survey, stones, uneven
from .parts import arch, masonry, patches
from .sensors import Sonar, Station
from .trace import Bar, Canal, Course, Profile, Stone

WATER = 214.861


def make(folder: Path) -> None:
    """Write the scene."""
    rng = np.random.default_rng(40420)
    bed, springing = WATER - 2.05, WATER + 1.25
    course = Course(lead=15.0, radius=70.0, angle=26.0 / 70.0)
    # The towpath is on the left. The right wall has a step below the water, the left one a batter of 4 degrees.
    section = arch(-2.8, 3.5, springing, 2.6)
    section += [(-2.8, WATER - 0.72), (-2.64, WATER - 0.75), (-2.64, bed + 0.2), (-2.0, bed + 0.02), (0.2, bed - 0.1)]
    section += [(1.6, bed + 0.05), (2.04, bed + 0.25), (2.2, WATER + 0.38), (3.5, WATER + 0.41)]
    canal = Canal(
        course=course,
        length=55.0,
        profile=Profile(section),
        relief=masonry(4201, springing, bed, course=0.31, block=0.58, joint=0.016, deep=0.012, proud=0.006, mud=0.045),
    )
    canal.bodies += stones(34, (1.0, 54.0), 1.9, bed + 0.02, (0.06, 0.22), canal, rng)

    def at(s: float, q: float, z: float) -> np.ndarray:
        x, y = course.to_plan(s, q)
        return np.array([float(x), float(y), WATER + z])

    def ladder(s: float, foot: tuple[float, float], top: tuple[float, float], slant: float, **sizes: float) -> Ladder:
        low, high = at(s, *foot), at(s + slant, *top)
        return Ladder(low, high, np.append(at(s + 0.5, foot[0], 0.0)[:2] - at(s - 0.5, foot[0], 0.0)[:2], 0.0), **sizes)

    one = ladder(
        16.1, (-2.43, -1.8), (-2.6, 1.72), 0.03, gap=0.42, stile=0.048, rung=0.028, rungs=uneven(0.16, 0.298, 12, 0.004, rng)
    )
    two = ladder(
        38.7, (1.66, -1.76), (2.02, 1.58), -0.05, gap=0.385, stile=0.044, rung=0.025, rungs=uneven(0.2, 0.276, 12, 0.006, rng)
    )
    # A railing on the towpath, and a work boat that was there only for the laser.
    dry: list[Bar | Stone] = []
    for s in np.arange(2.0, 54.0, 2.5):
        if abs(s - 38.7) > 1.0:
            dry.append(Bar(at(s, 2.4, 0.39), at(s, 2.4, 1.4), 0.021))
    for s in np.arange(2.0, 51.0, 2.5):
        if abs(s + 1.25 - 38.7) > 2.4:
            dry += [Bar(at(s, 2.4, z), at(s + 2.5, 2.4, z), 0.017) for z in (0.9, 1.38)]
    dry.append(Stone(at(24.6, -1.2, 0.05), np.array([1.7, 0.75, 0.42])))
    first, second = tuple(at(16.1, -2.5, 0.85)), tuple(at(38.7, 1.95, 0.8))
    # Two laser stations are on the towpath, and two on a staging over the water, from where its edge is seen.
    stand = [(5.0, 3.0), (19.5, -0.9), (33.5, 3.0), (46.0, -0.7)]
    aims = [(), (first,), (second,), (second,)]
    # The two ladders, the towpath and the bend fix all five scans.
    spots = [
        (11.3, -0.4, -0.9, 12.0, (4.0, 2.5)),
        (18.9, 0.3, -1.1, 97.0, (-6.3, 0.8)),
        (23.6, -0.8, -0.7, 181.0, (1.2, -3.3)),
        (34.2, -0.5, -1.0, 244.0, (-2.6, -7.2)),
        (41.5, 0.1, -0.85, 333.0, (5.1, 3.9)),
    ]
    Survey(
        canal=canal,
        seed=4042,
        epsg=2154,
        east=798120.0,
        north=6743380.0,
        bearing=-112.6,
        water=WATER,
        water_then=WATER + 0.064,
        axis_height=springing,
        stations=[Station(tuple(at(s, q, 2.02)), aim) for (s, q), aim in zip(stand, aims, strict=True)],
        scans=[
            Sonar(tuple(at(s, q, z)), head, tilt, 1.0164, point="-z", reach=14.0, noise=0.014) for s, q, z, head, tilt in spots
        ],
        ladders=[one, two],
        weed=patches(4207, bed + 0.2, WATER - 0.3, 0.1, -0.5),
        dry=dry,
        spacing=2.5,
    ).write(folder)
