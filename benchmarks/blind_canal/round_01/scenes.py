"""The four canals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .canal import Array, Axis, Bars, Boat, Canal, Raster, Towpath, Wall, make_ladder, relief
from .instruments import Frame, Sonar, Station, spin, write

Rng = np.random.Generator


def _wall(
    rng: Rng,
    span: tuple[float, float],
    heights: tuple[float, float],
    plan: list[tuple[float, float]],
    profile: list[tuple[float, float]],
    parts: list[tuple[float, float, float]],
    step: float = 0.05,
) -> Wall:
    """A wall; ``plan`` is (s, distance), ``profile`` (height above the water, further out), ``parts`` its relief."""
    p, q = np.array(plan, float).T, np.array(profile, float).T
    return Wall((p[0], p[1]), (q[0], q[1]), relief(rng, span, heights, (step, step), parts))


def _bed(
    rng: Rng,
    span: tuple[float, float],
    across: float,
    level: float,
    parts: list[tuple[float, float, float]],
    walls: tuple[Wall, Wall] | None = None,
    mud: float = 0.0,
    reach: float = 0.6,
    stones: int = 0,
    depth: float = 2.0,
) -> Raster:
    """The bed: relief, a wedge of mud at the walls, and stones."""
    bed = relief(rng, span, (-across, across), (0.05, 0.05), parts)
    s, n = bed.nodes()
    z = bed.values.astype(float) + level
    if walls and mud:
        uneven = relief(rng, span, (-1, 1), (0.05, 2.0), [(0.3, 1.5, 0)]).values[: len(s)]
        for wall, sign, column in ((walls[0], 1, 0), (walls[1], -1, 1)):
            face = np.interp(s, *wall.plan) + np.interp(-depth, *wall.profile)
            gap = np.maximum(face - sign * n, 0)
            z += mud * (1 + uneven[:, column : column + 1]) * np.exp(-((gap / reach) ** 1.5))
    for _ in range(stones):
        a, b = rng.uniform(span[0] + 1, span[1] - 1), rng.uniform(-across + 0.5, across - 0.5)
        r, ratio, height, w = rng.uniform(0.08, 0.35), rng.uniform(0.6, 1), rng.uniform(0.5, 0.8), rng.uniform(0, np.pi)
        u = ((s - a) * np.cos(w) + (n - b) * np.sin(w)) / r
        v = (-(s - a) * np.sin(w) + (n - b) * np.cos(w)) / (r * ratio)
        z = np.maximum(z, level + height * r * (np.sqrt(np.maximum(1.1 - u**2 - v**2, 0)) - 0.35))
    return Raster(z.astype(np.float32), bed.first, bed.step)


def _rope(a: tuple[float, float, float], b: tuple[float, float, float], sag: float, parts: int = 12) -> Bars:
    """A hanging rope."""
    u = np.linspace(0, 1, parts + 1)[:, None]
    p = np.array(a) * (1 - u) + np.array(b) * u - np.array([0, 0, 1.0]) * sag * 4 * u * (1 - u)
    return Bars(p[:-1], p[1:], np.full(parts, 0.008))


def _vault(rng: Rng, span: tuple[float, float], across: float, parts: list[tuple[float, float, float]]) -> Raster:
    return relief(rng, span, (-across, across), (0.06, 0.06), parts)


def _batter(degrees: float) -> float:
    return float(np.tan(np.radians(degrees)))


def brick(folder: Path) -> None:
    """A short brick tunnel without towpath; wing walls flare out at both portals."""
    rng = np.random.default_rng(1101)
    water, span, heights = 38.42, (-14.0, 39.0), (35.0, 42.0)
    parts = [(0.012, 1.6, 0.9), (0.008, 0.7, 2.5), (0.004, 0.12, 0.03), (0.002, 0, 0)]
    k = _batter(4.0)
    left = _wall(rng, span, heights, [(-14, 9.0), (0, 2.45), (25, 2.55), (38, 8.3)], [(-4, -4 * k), (4, 4 * k)], parts)
    k = _batter(3.2)
    right = _wall(rng, span, heights, [(-14, 8.2), (0, 2.50), (25, 2.44), (38, 9.1)], [(-4, -4 * k), (4, 4 * k)], parts)
    bed = _bed(rng, span, 9.0, water - 1.85, [(0.05, 1.2, 0.8), (0.012, 0.15, 0.15)], (left, right), 0.18, 0.5, 45)
    canal = Canal(
        Axis(),
        25.0,
        water,
        left,
        right,
        bed,
        0.9,
        2.1,
        _vault(rng, span, 9.0, [(0.010, 1.0, 1.0), (0.004, 0.1, 0.05)]),
        top=3.5,
        caution=0.8,
    )
    canal.ladders = [
        make_ladder(
            canal.axis,
            11.6,
            1.95,
            water - 1.85,
            3.2,
            9.0,
            1.2,
            0.29,
            0.008,
            rng,
            gap=0.42,
            rung=0.036,
            stile=0.065,
            steel=False,
        )
    ]
    canal.afloat = [Boat(np.array([19.2, -1.2, water + 0.30]), spin(8), (1.9, 0.62, 0.45), solid_fill=True)]
    canal.ropes = [_rope((17.4, -1.3, water + 0.32), (14.0, -2.45, water + 0.9), 0.25)]
    stations = [Station(3.0, -0.6, 1.55), Station(10.2, -0.9, 1.6, (0,)), Station(21.5, 0.4, 1.5)]
    fine: dict = {"beams": (-80.0, 64.0, 0.5), "turn_step": 0.9}
    sonars = [Sonar(8.4, -0.4, 0.75, 71, 3.2, 200, 1 - 0.013, **fine), Sonar(15.3, 0.3, 0.85, 212, 1.6, 35, 1 - 0.013, **fine)]
    write(folder, canal, Frame(27700, 402310.4, 287655.2, 37.0), stations, sonars, "+z", 1102)


def towpath(folder: Path) -> None:
    """A masonry canal in a bend to the left; on the right a towpath on piers, with water below its arches."""
    rng = np.random.default_rng(2201)
    water, span, heights = 214.76, (-16.0, 76.0), (211.0, 219.0)
    parts = [(0.018, 1.3, 0.8), (0.014, 0.6, 3.0), (0.006, 0.2, 0.1), (0.004, 0, 0)]
    k = _batter(1.5)
    left = _wall(
        rng,
        span,
        heights,
        [(-16, 3.30), (76, 3.35)],
        [(-4, -4 * k - 0.16), (-1.62, -1.62 * k - 0.16), (-1.55, -1.55 * k), (4, 4 * k)],
        parts,
        0.06,
    )
    right = _wall(rng, span, heights, [(-16, 4.60), (76, 4.60)], [(-4, 0), (4, 0.05)], parts, 0.06)
    bed = _bed(rng, span, 5.5, water - 2.2, [(0.06, 1.5, 0.8), (0.012, 0.2, 0.2)], (left, right), 0.38, 0.7, 30, 2.0)
    # Piers of 0.7 to 0.95 m between arches whose spans are uneven by decimetres.
    piers = np.cumsum(np.append(-14.6, 3.45 + rng.uniform(-0.22, 0.22, 25)))
    wide = rng.uniform(0.70, 0.95, len(piers))
    first, last = piers[:-1] + wide[:-1] / 2, piers[1:] - wide[1:] / 2
    path = Towpath(
        3.05,
        water + 0.62,
        (first + last) / 2,
        (last - first) / 2,
        water + 0.30,
        0.62,
        relief(rng, span, heights, (0.06, 0.06), [(0.010, 0.8, 0.8), (0.004, 0.1, 0.1)]),
    )
    canal = Canal(
        Axis(14.0, 32.0, 120.0),
        60.0,
        water,
        left,
        right,
        bed,
        1.2,
        2.6,
        _vault(rng, span, 5.5, [(0.012, 1.0, 1.0), (0.005, 0.12, 0.12)]),
        top=4.0,
        towpath=path,
        caution=0.8,
    )
    steel = {"gap": 0.38, "rung": 0.028, "stile": 0.045, "steel": True}
    canal.ladders = [
        make_ladder(canal.axis, 13.2, 3.05, water - 2.05, 4.0, 1.4, 0.3, 0.28, 0.004, rng, **steel),
        make_ladder(canal.axis, 44.6, 2.58, water - 2.1, 4.0, 8.5, -4.0, 0.30, 0.007, rng, missing=5, bent=8, **steel),
    ]
    x, y = canal.axis.to_local(np.array([27.0, 27.8]), np.array([3.3, -3.1]))
    canal.ropes = [_rope((x[0], y[0], water + 1.0), (x[1], y[1], water + 0.9), 0.35)]
    # Three stations on the towpath; two hang from a boom over the water and see the heads of the arches.
    stations = [
        Station(5.0, -3.8, 2.25),
        Station(16.5, 0.4, 1.5, (0,)),
        Station(30.0, -3.8, 2.25),
        Station(42.0, 0.2, 1.5, (1,)),
        Station(55.0, -3.8, 2.25),
    ]
    scale = 1.0065
    more: dict = {"beams": (-80.0, 64.0, 0.65), "turn_step": 1.1}
    sonars = [
        Sonar(8.6, 0.5, 0.9, 15, 10.0, 70, scale, **more),
        Sonar(17.4, -0.6, 1.1, 140, 4.1, 310, scale, **more),
        Sonar(30.2, 0.2, 0.7, 255, 7.2, 160, scale, **more),
        Sonar(41.3, -0.3, 1.2, 330, 2.3, 20, scale, **more),
        Sonar(50.4, 0.8, 0.8, 98, 8.8, 245, scale, **more),
    ]
    write(folder, canal, Frame(2154, 912450.7, 6745120.3, -58.0), stations, sonars, "-z", 2202, step=0.34, start=[3])


HEIGHT = (
    "The height: the water at the time of this scan is not in the files, and nothing that both instruments see has a "
    "known height. Poses that are raised or lowered by some centimetres explain the data as well; the true one lies 3 cm "
    "below the one that puts the water's surface at water_level."
)


def basin(folder: Path) -> None:
    """A vaulted canal that widens from 6 m to 12 m and narrows again, with uneven corners."""
    rng = np.random.default_rng(3301)
    water, span, heights = 97.31, (-12.0, 50.0), (93.5, 101.0)
    parts = [(0.010, 1.4, 0.9), (0.006, 0.8, 3.0), (0.004, 0.15, 0.1), (0.002, 0, 0)]
    k = _batter(0.8)
    left = _wall(
        rng,
        span,
        heights,
        [(-12, 3.0), (10.2, 3.0), (13.0, 6.05), (26.6, 5.95), (29.0, 3.02), (50, 3.0)],
        [(-4, -4 * k), (4, 4 * k)],
        parts,
    )
    right = _wall(
        rng,
        span,
        heights,
        [(-12, 3.0), (11.4, 2.98), (14.6, 6.0), (24.2, 6.0), (27.6, 3.0), (50, 3.02)],
        [(-4, -4 * k), (4, 4 * k)],
        parts,
    )
    bed = _bed(rng, span, 6.6, water - 2.4, [(0.05, 1.5, 1.5), (0.01, 0.2, 0.2)], (left, right), 0.22, 0.6, 140, 2.3)
    canal = Canal(
        Axis(),
        38.0,
        water,
        left,
        right,
        bed,
        1.1,
        2.8,
        _vault(rng, span, 6.6, [(0.010, 1.2, 1.2), (0.004, 0.1, 0.1)]),
        top=4.5,
        caution=0.66,
    )
    heeled = spin(24) @ spin(14, (1, 0, 0)) @ spin(4, (0, 1, 0))
    canal.sunk = [Boat(np.array([19.5, 3.3, water - 1.93]), heeled, (2.4, 0.75, 0.62))]
    stations = [Station(8.0, 0.5, 1.6), Station(19.8, -1.2, 1.7), Station(31.0, -0.4, 1.6)]
    scale = 1461.3 / 1475.0
    more: dict = {"beams": (-80.0, 64.0, 0.65), "turn_step": 1.1}
    sonars = [
        Sonar(15.2, -1.4, 1.1, 25, 2.4, 90, scale, **more),
        Sonar(22.4, 0.9, 0.9, 160, 5.1, 280, scale, 0.03, False, HEIGHT, **more),
        Sonar(28.7, -0.6, 1.0, 290, 3.3, 10, scale, 0.03, False, HEIGHT, **more),
    ]
    write(
        folder, canal, Frame(25832, 467820.1, 5540961.8, 112.0), stations, sonars, "+z", 3302, step=0.26, sound=(1475.0, 1462.0)
    )


SLIDE = (
    "The place along the axis and the sense of the heading: walls, bed and water are the same at every chainage. Poses "
    "that are slid along the axis by any amount, and those turned by 180 degrees about the vertical, explain the data "
    "as well."
)


def concrete(folder: Path) -> None:
    """A uniform canal of smooth concrete; its walls go on unchanged outside both portals."""
    rng = np.random.default_rng(4401)
    water, span, heights = 12.08, (-36.0, 76.0), (9.5, 16.0)
    parts = [(0.0008, 0, 0)]
    left = _wall(rng, span, heights, [(-36, 2.75), (76, 2.75)], [(-4, 0), (4, 0)], parts, 0.08)
    right = _wall(rng, span, heights, [(-36, 2.75), (76, 2.75)], [(-4, 0), (4, 0)], parts, 0.08)
    bed = _bed(rng, span, 3.0, water - 1.9, [(0.004, 0.2, 0.2)])
    canal = Canal(
        Axis(),
        40.0,
        water,
        left,
        right,
        bed,
        0.8,
        1.6,
        _vault(rng, span, 3.0, [(0.001, 0.1, 0.1)]),
        top=1.2,
        caution=0.92,
        shine=2.5,
    )
    stations = [Station(6.0, 0.6, 1.2), Station(20.5, -0.5, 1.2), Station(34.0, 0.3, 1.2)]
    # A profiling sonar: one pencil beam, fewer points.
    pencil: dict = {"beams": (-80.0, 64.0, 0.95), "turn_step": 1.8, "width": 1.5, "sigma": 0.012}
    sonars = [
        Sonar(14.3, 0.7, 0.8, 48, 3.0, 130, 1.008, 0.0, False, SLIDE, **pencil),
        Sonar(27.1, -0.9, 0.95, 305, 5.5, 260, 1.008, 0.0, False, SLIDE, **pencil),
    ]
    write(folder, canal, Frame(25833, 391204.6, 5819433.1, 8.0), stations, sonars, "+z", 4402)
