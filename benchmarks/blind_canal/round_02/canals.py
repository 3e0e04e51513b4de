"""The plans of the four canals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .build import Plan, Station, write
from .instruments import Ladder, Sonar, rope
from .world import Box, Canal, Hull, Pier


def masonry(folder: Path) -> None:
    """35 m of ashlar with a towpath, recesses, pilasters, three wooden ladders, a moored boat."""
    boxes = [
        Box("R", 4.2, 0.35, 0.16, -3.0, 1.1, False),
        Box("R", 12.9, 0.35, 0.16, -3.0, 1.1, False),
        Box("R", 22.4, 0.35, 0.16, -3.0, 1.1, False),
        Box("R", 31.0, 0.35, 0.16, -3.0, 1.1, False),
        Box("R", 8.3, 0.60, 0.22, -0.9, 0.7, True),
        Box("R", 17.7, 0.45, 0.28, -1.6, 0.9, True),
        Box("R", 27.2, 0.70, 0.20, -0.6, 0.8, True),
        Box("L", 6.4, 0.14, 0.18, -3.0, 0.7, True),
        Box("L", 15.6, 0.40, 0.25, -1.2, 0.35, True),
        Box("L", 24.8, 0.14, 0.18, -3.0, 0.7, True),
        Box("L", 29.5, 0.50, 0.12, -3.0, 0.6, False),
        Box("B", 10.0, 0.55, 0.45, 0.5, 1.3, True),
        Box("B", 26.0, 0.55, 0.45, 0.5, 1.3, True),
    ]
    batter = ((-4.0, 0.0, 3.0), (0.20, 0.0, 0.0))
    canal = Canal(
        35.0, 3.1, 1.35, 2.3, 2.5, 201, tow_width=1.4, tow_height=0.55, profile={"R": batter, "L": batter}, boxes=boxes
    )
    ladders = [
        Ladder(9.9, -1, -1.85, 3.6, 0.42, 0.046, 0.03, 0.26, 11, spread=0.011, roll=0.012),
        Ladder(19.2, 1, -2.0, 3.9, 0.40, 0.044, 0.025, 0.24, 12, step=0.29, spread=0.013, roll=-0.018),
        Ladder(25.1, -1, -1.9, 3.8, 0.44, 0.048, 0.04, 0.30, 13, step=0.27, spread=0.012, roll=0.02),
    ]
    stations = [
        Station(s, n, z, 22.0, 900, 760) for s, n, z in ((3.5, 3.6, 1.9), (12.0, -0.6, 1.4), (21.5, 3.6, 1.9), (31.0, 0.2, 1.4))
    ]
    sonars = [
        Sonar(8.2, 0.4, 0.8, 37.0, (3.2, -4.5), 21),
        Sonar(17.1, -0.7, 1.0, 251.0, (-5.1, 2.0), 22),
        Sonar(25.9, 0.6, 0.7, 134.0, (1.5, 6.3), 23),
    ]

    def moored(x: float, y: float, heading: float) -> tuple[Hull, list[list]]:
        hull = Hull(np.array([x, y, 0.28]), (2.3, 0.72, 0.52), heading, 0.28)
        c, s = np.cos(heading), np.sin(heading)
        bow, stern = np.array([x + 2.2 * c, y + 2.2 * s, 0.26]), np.array([x - 2.2 * c, y - 2.2 * s, 0.26])
        ropes = [
            rope(bow, np.array([16.4, 3.12, 0.45]), 0.75, 0.012),
            rope(stern, np.array([9.6, 3.12, 0.45]), 0.65, 0.012),
            rope(np.array([21.5, 3.1, 0.5]), np.array([23.6, 3.1, 0.5]), 1.3, 0.014),
        ]
        return hull, ropes

    boat, ropes = moored(12.9, 2.05, 0.04)
    boat2, ropes2 = moored(12.6, 1.92, -0.03)
    write(
        Plan(
            canal,
            ladders,
            stations,
            sonars,
            27700,
            412_530.0,
            289_144.0,
            131.427,
            61.0,
            0.9885,
            31,
            water_then=0.016,
            ropes_laser=ropes,
            ropes_sonar=ropes2,
            hulls_laser=[boat],
            hulls_sonar=[boat2],
        ),
        folder,
    )


def long_bends(folder: Path) -> None:
    """2,000 m of brick in gentle S bends, with twelve scans in the middle of it."""
    profile = {"R": ((-4.0, 0.0, 3.0), (0.14, 0.0, 0.0)), "L": ((-4.0, -0.9, 0.0, 3.0), (0.22, 0.06, 0.0, 0.0))}
    rng = np.random.default_rng(202)
    canal = Canal(
        2000.0,
        3.4,
        0.8,
        3.0,
        2.1,
        203,
        profile=profile,
        bend=(19.0, 690.0),
        masonry=(0.22, 0.075, 0.0015),
        wave=0.014,
        stones=0.10,
    )
    ladders = []
    for i in range(50):
        ladders.append(
            Ladder(
                20.0 + 40.0 * i + rng.normal(0, 0.25),
                1 if i % 2 else -1,
                -1.75 + rng.normal(0, 0.05),
                3.6,
                0.40,
                0.034,
                rng.uniform(0.02, 0.06),
                rng.uniform(0.26, 0.34),
                300 + i,
                step=0.29,
                spread=0.008,
                roll=rng.normal(0, 0.012),
            )
        )
    first, middle = 963.3, 1006.0
    inner = np.arange(middle - 72, middle + 73, 12.0)
    outer = [s for s in np.arange(8.0, 2000.0, 21.0) if abs(s - middle) > 75]
    stations = [Station(s, 0.8 * (-1) ** i, 1.45, 9.0, 520, 400) for i, s in enumerate(inner)]
    stations += [Station(s, 0.5 * (-1) ** i, 1.45, 8.0, 125, 110) for i, s in enumerate(outer)]
    stations.sort(key=lambda st: st.s)
    sonars = [
        Sonar(
            first + 8.0 * i + rng.normal(0, 0.3),
            rng.uniform(-0.9, 0.9),
            rng.uniform(0.5, 1.0),
            rng.uniform(0, 360),
            (rng.uniform(-6, 6), rng.uniform(-6, 6)),
            400 + i,
            beams=(170, 430),
            rays=6,
        )
        for i in range(12)
    ]
    write(
        Plan(
            canal,
            ladders,
            stations,
            sonars,
            2154,
            884_210.0,
            6_846_930.0,
            214.308,
            -23.0,
            1.0075,
            32,
            water_then=-0.02,
            paced=4.0,
            axis_step=10.0,
        ),
        folder,
    )


def profiler(folder: Path) -> None:
    """20 m with a ledge below the water, two leaning ladders, and a profiling sonar whose z points down."""
    profile = {"R": ((-4.0, 0.0, 3.0), (0.06, 0.0, 0.0)), "L": ((-4.0, 0.0, 3.0), (0.10, 0.0, 0.0))}
    canal = Canal(
        20.0,
        2.6,
        1.1,
        2.2,
        2.2,
        205,
        profile=profile,
        ledges=(("R", -0.95, 0.34), ("L", -1.15, 0.28)),
        boxes=[Box("R", 14.6, 0.5, 0.25, -0.7, 0.8, True), Box("L", 4.1, 0.25, 0.14, -3.0, 0.9, False)],
        masonry=(0.5, 0.25, 0.003),
        stones=0.12,
    )
    ladders = [
        Ladder(7.2, 1, -1.72, 3.55, 0.41, 0.040, 0.165, 0.62, 51, spread=0.010, roll=0.02),
        Ladder(12.1, -1, -1.76, 3.70, 0.38, 0.042, 0.170, 0.68, 52, step=0.285, spread=0.012, roll=-0.014),
    ]
    stations = [Station(s, n, 1.5, 18.0, 900, 700) for s, n in ((3.5, 0.6), (10.0, -0.5), (16.5, 0.4))]
    sonars = [
        Sonar(s, n, below, heading, tilt, seed, beams=(160, 252), fan=(-77.0, 60.0), width=1.5, sigma=0.015, rays=14)
        for s, n, below, heading, tilt, seed in (
            (8.3, -0.4, 0.7, 312.0, (4.2, 2.7), 61),
            (11.6, 0.5, 0.6, 98.0, (-3.1, 5.2), 62),
        )
    ]
    write(
        Plan(
            canal,
            ladders,
            stations,
            sonars,
            25832,
            565_920.0,
            5_934_410.0,
            4.183,
            118.0,
            1.0130,
            33,
            water_then=0.01,
            down=True,
            axis_step=2.5,
        ),
        folder,
    )


def piers(folder: Path) -> None:
    """50 m with a footbridge on piers, scour holes, one ladder at one end, and a speed of sound that was measured."""
    profile = {"R": ((-4.0, 0.0, 3.0), (0.16, 0.0, 0.0)), "L": ((-5.0, -1.3, 0.0, 3.0), (0.26, 0.02, 0.0, 0.0))}
    canal = Canal(
        50.0,
        5.3,
        1.6,
        3.4,
        2.7,
        207,
        profile=profile,
        piers=[Pier(25.0, 1.9, 0.9, 0.42, 1.95), Pier(25.2, -1.8, 0.8, 0.36, 1.95)],
        deck=(25.1, 1.1, 1.9, 2.25),
        holes=(
            (23.6, 1.9, 0.7, 0.45),
            (27.0, -1.7, 0.8, 0.35),
            (36.5, 1.0, 1.0, 0.30),
            (11.0, -1.2, 0.9, 0.35),
            (42.5, -2.0, 1.1, 0.4),
            (31.0, -3.0, 0.8, 0.3),
        ),
        stones=0.06,
        boxes=[Box("R", 15.5, 0.45, 0.2, -1.1, 0.9, True), Box("L", 34.0, 0.12, 0.15, -4.0, 1.2, True)],
    )
    ladders = [Ladder(6.3, 1, -2.0, 4.0, 0.42, 0.038, 0.05, 0.36, 71, spread=0.011, roll=0.01)]
    stations = [Station(s, n, 1.5, 18.0, 900, 720) for s, n in ((5.0, -1.2), (16.0, 1.0), (33.0, -0.9), (44.0, 1.1))]
    sonars = [
        Sonar(8.0, 0.9, 0.9, 15.0, (2.2, -3.6), 81),
        Sonar(19.0, -0.4, 1.1, 203.0, (-6.4, 1.1), 82),
        Sonar(31.5, 0.3, 0.8, 288.0, (3.7, 4.9), 83),
        Sonar(42.5, -0.8, 1.0, 77.0, (-2.5, -5.8), 84),
    ]
    write(
        Plan(
            canal,
            ladders,
            stations,
            sonars,
            2056,
            2_683_450.0,
            1_247_820.0,
            402.655,
            143.0,
            1452 / 1500,
            34,
            water_then=-0.012,
            sound=(1500.0, 1452.0),
        ),
        folder,
    )
