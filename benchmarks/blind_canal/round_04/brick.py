"""A straight brick canal of 60 m with one wooden ladder, and weed at the walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .deliver import Ladder, Survey, stones, uneven
from .parts import arch, masonry, patches
from .sensors import Sonar, Station
from .trace import Bar, Canal, Course, Profile, Stone

WATER = 112.402


def make(folder: Path) -> None:
    """Write the scene."""
    rng = np.random.default_rng(40410)
    bed, springing = WATER - 1.9, WATER + 0.9
    # Both walls lean back by 2 degrees; mud lies along them.
    section = arch(-3.2, 3.2, springing, 2.2)
    section += [
        (-3.105, bed + 0.27),
        (-2.55, bed + 0.06),
        (-1.0, bed - 0.06),
        (0.9, bed - 0.05),
        (2.5, bed + 0.08),
        (3.105, bed + 0.31),
    ]
    canal = Canal(
        course=Course(lead=60.0),
        length=60.0,
        profile=Profile(section),
        relief=masonry(4101, springing, bed, course=0.075, block=0.235, joint=0.01, deep=0.005, proud=0.002, mud=0.03),
    )
    canal.bodies += stones(26, (1.0, 58.0), 2.6, bed + 0.02, (0.05, 0.17), canal, rng)
    # A barrel and a shopping basket's worth of rubble lie in mid-channel.
    canal.bodies += [Bar(np.array([18.2, 0.9, bed + 0.22]), np.array([18.9, 1.3, bed + 0.25]), 0.26)]
    canal.bodies += [Stone(np.array([7.1, -0.6, bed + 0.1]), np.array([0.4, 0.25, 0.22]))]
    ladder = Ladder(
        foot=np.array([14.0, -2.15, WATER - 1.72]),
        top=np.array([14.06, -2.74, WATER + 1.74]),
        across=np.array([1.0, 0.02, 0.0]),
        gap=0.36,
        rungs=uneven(0.21, 0.287, 11, 0.007, rng),
        stile=0.062,
        rung=0.036,
    )
    # A mooring rope hangs from the vault at the time of the laser only.
    rope = [Bar(np.array([24.0, 2.4, WATER + 0.1]), np.array([24.3, 2.5, WATER + 2.2]), 0.012)]
    target = (14.03, -2.5, WATER + 0.9)
    open_text = (
        "Nothing but smooth brick walls of one section is seen within 10 m, without ladder or portal. "
        "The place along the axis is open between s = 12 m and 48 m, within the circle that was paced out. "
        "As the section is symmetric, the scan turned by 180 degrees about the vertical explains the data as well. "
        "The height rests on the water alone, which may have moved."
    )
    Survey(
        canal=canal,
        seed=4041,
        epsg=27700,
        east=403210.0,
        north=287654.0,
        bearing=37.4,
        water=WATER,
        water_then=WATER - 0.037,
        axis_height=springing,
        stations=[
            Station((9.6, 0.4, WATER + 1.45), (target,)),
            Station((17.3, -0.3, WATER + 1.52), (target,)),
            Station((38.0, 0.2, WATER + 1.4)),
        ],
        scans=[
            Sonar((9.2, -0.7, WATER - 0.92), 71.0, (3.2, -1.4), 0.9862, reach=11.0),
            Sonar((16.8, 0.5, WATER - 1.05), 203.0, (-2.1, 5.6), 0.9862, reach=11.0),
            Sonar((21.6, -0.2, WATER - 0.75), 318.0, (0.6, 1.1), 0.9862, reach=11.0),
            Sonar(
                (44.3, 0.3, WATER - 0.98), 126.0, (-4.4, 2.0), 0.9862, reach=10.0, determined=False, open=open_text, start=3.0
            ),
        ],
        ladders=[ladder],
        weed=patches(4107, bed + 0.1, WATER - 0.15, 0.16, -0.15),
        dry=rope,
    ).write(folder)
