"""A wide basin under a bridge: round piers, a ledge and one ladder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .deliver import Ladder, Survey, stones, uneven
from .parts import arch, masonry
from .sensors import Sonar, Station
from .trace import PIER, Bar, Canal, Course, Profile, Stone

WATER = -0.418
PIERS = ((7.5, 2.6, 0.45), (16.9, 2.72, 0.45), (27.2, 2.55, 0.45), (12.2, -2.8, 0.375), (24.4, -2.66, 0.375))


def make(folder: Path) -> None:
    """Write the scene."""
    rng = np.random.default_rng(40430)
    bed, springing = WATER - 3.1, WATER + 1.5
    section = arch(-5.7, 5.8, springing, 1.05, 48)
    section += [
        (-5.7, bed + 0.35),
        (-4.6, bed + 0.1),
        (-1.5, bed - 0.1),
        (0.0, bed - 0.18),
        (2.2, bed - 0.06),
        (4.4, bed + 0.12),
    ]
    # The left wall has a ledge 1.1 m below the water.
    section += [(5.42, bed + 0.4), (5.42, WATER - 1.14), (5.8, WATER - 1.08)]
    canal = Canal(
        course=Course(lead=36.0),
        length=36.0,
        profile=Profile(section, 0.02),
        relief=masonry(4301, springing, bed, course=0.065, block=0.21, joint=0.01, deep=0.004, proud=0.002, mud=0.07),
    )
    canal.bodies += stones(40, (1.0, 35.0), 4.9, bed, (0.08, 0.3), canal, rng)
    for s, q, radius in PIERS:
        # A footing of concrete lies under each pier.
        canal.bodies.append(Bar(np.array([s, q, bed - 0.4]), np.array([s, q, WATER + 2.7]), radius, PIER))
        canal.bodies.append(Stone(np.array([s, q, bed]), np.array([radius + 0.35, radius + 0.35, 0.3])))
    # A bicycle, as its two wheels and its frame, and a sunken beam.
    canal.bodies.append(Bar(np.array([18.6, -0.9, bed + 0.15]), np.array([21.4, 0.4, bed + 0.45]), 0.11))
    canal.bodies += [Bar(np.array([13.0 + k, 0.6, bed]), np.array([13.5 + k, 0.9, bed + 0.55]), 0.03) for k in (0.0, 0.45, 0.9)]
    ladder = Ladder(
        foot=np.array([20.62, 4.86, WATER - 1.95]),
        top=np.array([20.55, 5.42, WATER + 1.84]),
        across=np.array([1.0, 0.03, 0.01]),
        gap=0.395,
        rungs=uneven(0.25, 0.302, 12, 0.009, rng),
        stile=0.058,
        rung=0.034,
    )
    pontoon: list[Bar | Stone] = [Stone(np.array([30.5, -3.6, WATER + 0.02]), np.array([2.1, 0.9, 0.35]))]
    pontoon += [Bar(np.array([3.0, -5.6, WATER + 1.0]), np.array([9.0, -4.2, WATER - 0.05]), 0.014)]
    target = (20.58, 5.2, WATER + 0.9)
    deep = {"scale": 1470.2 / 1500.0, "reach": 16.0}
    thin = {"scale": 1470.2 / 1500.0, "reach": 16.0, "beam": 1.8, "noise": 0.017, "step": (0.9, 1.2)}
    Survey(
        canal=canal,
        seed=4043,
        epsg=28992,
        east=121540.0,
        north=487310.0,
        bearing=158.2,
        water=WATER,
        water_then=WATER - 0.142,
        axis_height=springing,
        stations=[
            Station((5.2, 0.2, WATER + 1.35)),
            Station((18.0, 0.6, WATER + 1.3), (target,)),
            Station((29.0, 1.0, WATER + 1.4), (target,)),
        ],
        scans=[
            Sonar((9.8, 0.3, WATER - 1.3), 33.0, (2.4, 1.7), **deep),
            Sonar((14.6, -0.4, WATER - 0.9), 160.0, (-5.2, 3.1), **deep),
            Sonar((21.3, 1.2, WATER - 1.6), 275.0, (0.9, -2.2), **deep),
            Sonar((28.1, -0.6, WATER - 1.1), 305.0, (8.3, -1.0), **deep),
            Sonar((17.9, 2.1, WATER - 1.4), 88.0, (-1.5, -4.6), **thin),
            Sonar((26.0, 0.9, WATER - 1.2), 211.0, (3.7, 2.9), **thin),
        ],
        ladders=[ladder],
        dry=pontoon,
        speed=(1500.0, 1471.0),
    ).write(folder)
