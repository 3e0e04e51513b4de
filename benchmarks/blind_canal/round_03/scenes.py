"""The four canals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.blind_canal.round_03.cast import (
    Canal,
    Raster2,
    Raster3,
    Sonar,
    laser,
    noise,
    noise_raster,
    sonar,
    write,
)


def vault(y: np.ndarray, z: np.ndarray, half: np.ndarray | float, springing: float, rise: float) -> np.ndarray:
    """Upright walls with half an ellipse above them: about the distance to them, positive inside."""
    q = np.hypot(y / half, np.maximum(z - springing, 0.0) / rise)
    return (1.0 - q) * np.minimum(half, rise)


def heads(places: list[tuple], scale: float, **common) -> list[Sonar]:
    """Sonar heads from (x, y, z, heading, tilt, direction of the tilt, level of the water)."""
    return [Sonar(np.array(p[:3]), p[3], p[4], p[5], scale, p[6], **common) for p in places]


def centre(length: float, step: float, z: float, y=lambda x: 0.0) -> np.ndarray:
    """Points of the axis from portal to portal."""
    x = np.append(np.arange(0.0, length - step / 2, step), length)
    return np.array([[v, y(v), z] for v in x])


# ---------------------------------------------------------------- 1: rock


def rock_cut(folder: Path) -> dict:
    """Rough rock above and below the water, and nothing else that reaches through it."""
    rng = np.random.default_rng(30301)
    length, step = 45.0, 0.1
    low, high = np.array([-5.0, -5.6, -3.4]), np.array([length + 5.0, 5.6, 4.4])
    shape = [int(round(v / step)) + 1 for v in high - low]
    relief = noise(rng, shape, step, [(1.1, 0.11), (0.42, 0.075), (0.16, 0.022)])
    folds = noise(rng, shape, step, [(0.6, 0.1)])
    rough = Raster3(relief + 0.10 - 1.1 * np.abs(folds), low, step)  # creases as where blocks broke out
    bed = noise_raster(rng, (-5.0, -5.6), (length + 5.0, 5.6), 0.15, [(1.6, 0.10), (0.4, 0.04)])
    along = np.linspace(-5.0, length + 5.0, 41)
    half = 3.05 + noise(rng, (41,), 1.25, [(2.2, 0.16)])
    drift = noise(rng, (41,), 1.25, [(4.0, 0.15)])
    rubble = np.stack([rng.uniform(-3, length + 3, 26), rng.uniform(-2.6, 2.6, 26), rng.uniform(-2.15, -1.85, 26)], axis=1)
    size = rng.uniform(0.15, 0.45, 26)

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        n = rough(x, y, z)
        a = np.interp(x, along, half)
        ledge = 0.25 * np.clip((-0.95 - z) / 0.15, 0, 1) * ((x > 14) & (x < 31) & (y > 0))
        f = np.minimum(vault(y - np.interp(x, along, drift), z, a, 0.9, 2.3) - ledge + n, z + 1.95 - bed(x, y) + 0.6 * n)
        deep = np.flatnonzero((z < -1.2) & (f > 0))
        if len(deep):
            xs, ys, zs = x[deep], y[deep], z[deep]
            near = f[deep]
            for c, r in zip(rubble, size):
                near = np.minimum(near, np.sqrt((xs - c[0]) ** 2 + (ys - c[1]) ** 2 + 1.6 * (zs - c[2]) ** 2) - r)
            f[deep] = near
        return f

    canal = Canal(
        field, low + [1, 0.2, 0.2], high - [1, 0.2, 0.2], np.radians(63.0), np.array([912340.0, 6487210.0, 214.36]), 2154
    )
    stations = np.array([[4.5, 0.4, 1.25], [14.8, -0.6, 1.35], [24.7, 0.5, 1.2], [35.0, -0.3, 1.3], [42.0, 0.2, 1.3]])
    points, sources = laser(canal, stations, 0.42, rng, band=(-26.0, 2.0))
    # the water stood 3 mm lower when the sonar was there
    scans = [
        sonar(canal, h, rng)
        for h in heads(
            [
                (10.4, 0.35, -0.92, 131.0, 2.2, 40.0, -0.003),
                (21.6, -0.5, -0.85, 287.0, 4.6, 200.0, -0.003),
                (33.1, 0.2, -1.0, 18.0, 1.4, 310.0, -0.003),
            ],
            1452.6 / 1470.0,
            fan=(-78.0, 84.0),
            beam_step=0.8,
            pan_step=0.9,
            sigma=0.013,
        )
    ]
    return write(
        folder, canal, points, sources, stations, centre(length, 5.0, 1.2), scans, "+z", {"sound_speed": [1470.0, 1453.0]}, rng
    )


# ---------------------------------------------------------------- 2: brick


def brick(folder: Path) -> dict:
    """Narrow, one wall battered, ladders that are damaged and whose feet lie in the mud, ropes."""
    rng = np.random.default_rng(30302)
    length, lean = 30.0, np.tan(np.radians(4.0))
    low, high = np.array([-4.0, -3.2, -2.9]), np.array([length + 4.0, 3.2, 3.9])
    waves = [noise_raster(rng, (-4.0, -2.9), (length + 4.0, 2.1), 0.1, [(1.3, 0.009), (0.3, 0.004)]) for _ in range(2)]
    x, y = np.meshgrid(np.arange(-4.0, length + 4.01, 0.12), np.arange(-3.2, 3.21, 0.12), indexing="ij")
    mud = -1.98 + 0.62 * np.exp(-(y + 2.15) / 0.55) + 0.50 * np.exp(-(2.0 - y) / 0.5)
    mud += noise(rng, x.shape, 0.12, [(0.9, 0.06), (0.3, 0.02)])
    bed = Raster2(np.clip(mud, -2.6, -0.95), (-4.0, -3.2), 0.12)
    stones = [
        (7.4, 0.6, -1.9, 0.22),
        (13.2, -0.9, -1.85, 0.3),
        (16.0, 0.3, -1.95, 0.26),
        (22.3, 0.8, -1.8, 0.3),
        (24.9, -0.4, -1.9, 0.2),
    ]

    def joints(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Courses of 75 mm in stretcher bond, joints 6 mm deep that are open here and there."""
        row = np.floor(z / 0.075)
        bond = (x / 0.225 + 0.5 * (row % 2)) % 1.0
        return 0.006 * (((z / 0.075) % 1.0 < 0.14) | (bond < 0.045))

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        left, right = y + 2.1 + waves[0](x, z), 2.1 + lean * z - y + waves[1](x, z)  # the wall at y < 0 is upright
        f = np.minimum(left, right)
        close = np.flatnonzero((f < 0.05) & (z < 1.9))
        f[close] += joints(x[close], z[close])
        f = np.minimum(f, z - bed(x, y))
        half = 2.1 + lean * 0.95
        f = np.where(z > 1.9, vault(y - lean * 0.95, z, half, 1.9, 1.35), f)
        for a, b, c, r in stones:
            f = np.minimum(f, np.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) - r)
        return f

    canal = Canal(
        field, low + [0.5, 0.2, 0.2], high - [0.5, 0.2, 0.2], np.radians(-148.0), np.array([531480.0, 181955.0, 31.82]), 27700
    )
    # first ladder: leans on the upright wall; two rungs broken out, one bent
    up = np.array([0.02, -0.09, 1.0])
    heights = 0.22 + 0.285 * np.arange(14) + rng.normal(0, 0.006, 14)
    canal.ladder(
        rng,
        np.array([9.1, -1.72, -2.12]),
        up,
        np.array([1.0, 0.0, -0.02]),
        4.05,
        0.38,
        0.030,
        heights,
        missing=(5, 9),
        bent={10: np.array([0.01, 0.035, -0.055])},
        zero=0.10,
    )
    # second ladder: parallel to the battered wall; two missing (one in the water), one bent below it
    up = np.array([-0.01, lean, 1.0])
    heights = 0.20 + 0.295 * np.arange(13) + rng.normal(0, 0.008, 13)
    canal.ladder(
        rng,
        np.array([20.3, 1.76, -2.05]),
        up,
        np.array([1.0, 0.0, 0.01]),
        3.95,
        0.40,
        0.028,
        heights,
        missing=(4, 11),
        bent={6: np.array([0.0, -0.04, -0.05])},
        zero=1.3,
    )
    # ropes in front of the second one: a slack one and one that hangs from a ring
    t = np.linspace(0, 1, 13)
    sag = np.sin(np.pi * t)
    canal.bar(np.stack([19.6 + 1.7 * t, 1.62 - 0.25 * sag, 0.95 - 1.5 * t - 0.55 * sag], axis=1), 0.011)
    canal.bar(np.stack([20.42 + 0.05 * np.sin(6 * t), 1.58 - 0.10 * t, 1.25 - 2.5 * t], axis=1), 0.010)
    canal.bar(np.stack([20.12 - 0.04 * t, 1.50 + 0.06 * np.sin(5 * t), 1.10 - 2.1 * t], axis=1), 0.010)
    stations = np.array([[4.0, 0.2, 1.3], [11.6, -0.2, 1.25], [18.6, -0.3, 1.35], [26.0, 0.1, 1.3]])
    points, sources = laser(canal, stations, 0.38, rng, fine=0.07)
    # tilting the head on its bracket moves it by some centimetres; the water is 6 mm higher than for the laser
    scans = [
        sonar(canal, h, rng)
        for h in heads(
            [
                (11.9, 0.10, -0.62, 74.0, 0.4, 10.0, 0.006),
                (11.932, 0.115, -0.641, 74.3, 9.0, 22.0, 0.006),
                (17.7, -0.25, -0.58, 251.0, 0.7, 120.0, 0.006),
                (17.681, -0.222, -0.603, 250.8, 9.0, 118.0, 0.006),
            ],
            1448.0 / 1465.0,
            fan=(-70.0, 75.0),
            beam_step=0.5,
            pan_step=1.0,
            sigma=0.012,
            down=True,
        )
    ]
    return write(folder, canal, points, sources, stations, centre(length, 3.0, 0.0), scans, "-z", {}, rng)


# ---------------------------------------------------------------- 3: bends


def bends(folder: Path) -> dict:
    """Two bends, a passing place, towpaths of different widths, steel ladders, a level that falls."""
    rng = np.random.default_rng(30303)
    length = 100.0
    low, high = np.array([-5.0, -16.0, -3.2]), np.array([length + 5.0, 16.0, 5.2])
    grid = np.arange(-6.0, length + 6.01, 0.25)
    # the line's slope turns by 10 degrees near x = 32 and back by 16 near x = 70
    slope = np.tan(np.radians(10.0)) / (1 + np.exp(-(grid - 32) / 2.4))
    slope -= np.tan(np.radians(16.0)) / (1 + np.exp(-(grid - 70) / 3.0))
    line = np.cumsum(slope) * 0.25
    line -= np.interp(50.0, grid, line)

    def knots(x: list[float], v: list[float]) -> np.ndarray:
        return np.interp(grid, x, v)

    left = knots([0, 43, 48, 61, 66, 106], [2.65, 2.7, 3.9, 3.95, 2.75, 2.6])
    right = knots([0, 18, 22, 82, 86, 106], [2.55, 2.55, 2.75, 2.8, 2.45, 2.5])
    path_left = knots([0, 43, 48, 106], [0.95, 0.9, 0.75, 0.8])
    path_right = knots([0, 50, 54, 106], [1.45, 1.5, 1.7, 1.65])
    walls = [noise_raster(rng, (-5.0, -3.2), (length + 5.0, 0.8), 0.1, [(1.5, 0.014), (0.35, 0.006)]) for _ in range(2)]
    lining = noise_raster(rng, (-5.0, -3.2), (length + 5.0, 5.2), 0.2, [(1.6, 0.014), (0.4, 0.004)])
    xx, tt = np.meshgrid(np.arange(-5.0, length + 5.01, 0.2), np.arange(-4.4, 4.41, 0.2), indexing="ij")
    mud = noise(rng, xx.shape, 0.2, [(1.8, 0.10), (0.5, 0.03)]) + 0.45 * (np.abs(tt) / 3.0) ** 3.0
    bed = Raster2(-2.3 + np.minimum(mud, 1.0), (-5.0, -4.4), 0.2)

    def at(x: np.ndarray, table: np.ndarray) -> np.ndarray:
        return np.interp(x, grid, table)

    # x, half length, t, half width, z, half height: a moored punt, and sunken things
    boxes = [(55.0, 2.1, 2.95, 0.55, 0.10, 0.30), (26.0, 0.5, 0.4, 0.3, -2.1, 0.25), (63.5, 0.8, -1.0, 0.15, -2.1, 0.3)]
    # quay walls batter by 1.5 degrees below a plinth on the left and stand on a ledge on the right
    tan = np.tan(np.radians(1.5))

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        k = at(x, slope)
        t = (y - at(x, line)) / np.sqrt(1 + k * k)
        a, b = at(x, left), at(x, right)
        wall_left = a - t + tan * np.minimum(z + 0.4, 0.0) + walls[0](x, z)
        ledge = 0.22 * np.clip((-1.35 - z) / 0.05, 0.0, 1.0) * ((x > 30) & (x < 66))
        wall_right = b + t - ledge + walls[1](x, z)
        water = np.minimum(np.minimum(wall_left, wall_right), np.minimum(z - bed(x, t), 1.2 - z))
        c, d = a + at(x, path_left), b + at(x, path_right)
        air = np.minimum(
            vault(t - 0.5 * (c - d), z, 0.5 * (c + d), 1.7, 2.2) + lining(x, np.where(t > 0, z, z - 0.7)),
            z - 0.42 - 0.4 * walls[0](x, t * 0.5 - 1.0),
        )
        f = np.maximum(water, air)
        for bx, hx, bt, ht, bz, hz in boxes:
            near = np.flatnonzero(np.abs(x - bx) < hx + 4.0)
            q = np.stack([np.abs(x[near] - bx) - hx, np.abs(t[near] - bt) - ht, np.abs(z[near] - bz) - hz])
            box = np.linalg.norm(np.maximum(q, 0.0), axis=0) + np.minimum(q.max(axis=0), 0.0)
            f[near] = np.minimum(f[near], box)
        return 0.96 * f

    canal = Canal(
        field, low + [0.5, 0.2, 0.2], high - [0.5, 0.2, 0.2], np.radians(21.0), np.array([363720.0, 5620480.0, 98.115]), 25832
    )

    def place(x: float, t: float, z: float) -> np.ndarray:
        return np.array([x, np.interp(x, grid, line) + t * np.sqrt(1 + np.interp(x, grid, slope) ** 2), z])

    rows = [(20.4, 1, 0.13), (36.0, -1, 0.15), (58.9, 1, 0.14), (68.6, -1, 0.13), (77.3, -1, 0.12)]
    for number, (x, side, gap) in enumerate(rows):
        k = np.interp(x, grid, slope)
        along = np.array([1.0, k, 0.0]) / np.hypot(1.0, k)
        half = np.interp(x, grid, left if side > 0 else right)
        # wall-mounted steel ladders that reach above the towpath as grab rails do; those at the ledge stand before it
        off = half - gap - (0.10 if side > 0 else 0.0) - (0.20 if number == 1 else 0.0)
        n = 12 + number % 2
        heights = 0.15 + 0.300 * np.arange(n) + rng.normal(0, 0.005, n)
        lean = np.array([0.006 * (number - 1.5), side * 0.012, 1.0])
        canal.ladder(
            rng,
            place(x, side * off, -1.95 - 0.05 * number),
            lean,
            along,
            0.25 + 0.3 * n,
            0.42,
            0.032,
            heights,
            zero=-0.4 * number,
        )
    stations = np.array(
        [
            place(*p)
            for p in [
                (6, 3.1, 1.8),
                (19, -3.2, 1.85),
                (32, 3.1, 1.8),
                (44, -3.3, 1.8),
                (57, -3.4, 1.85),
                (70, 3.1, 1.8),
                (83, -3.1, 1.8),
                (95, 3.0, 1.8),
            ]
        ]
    )
    points, sources = laser(canal, stations, 0.55, rng, fine=0.08, fine_reach=10.0)
    poses = []
    for i, x in enumerate(18.0 + 12.0 * np.arange(6)):
        p = place(x, [0.4, -0.6, 0.2, 0.9, -0.3, 0.5][i], -0.75 - 0.05 * (i % 3))
        # the level falls by 3 cm while the sonar goes from station to station
        poses.append(
            (
                *p,
                [33.0, 151.0, 304.0, 88.0, 219.0, 12.0][i],
                [1.1, 3.4, 0.6, 2.3, 5.2, 1.7][i],
                [20.0, 95.0, 180.0, 260.0, 330.0, 145.0][i],
                -0.006 * i,
            )
        )
    scans = [
        sonar(canal, h, rng)
        for h in heads(poses, 1 - 0.018, fan=(-72.0, 66.0), beam_step=0.5, pan_step=1.2, sigma=0.015, reach=18.0)
    ]
    start = []
    for number in (2, 5):
        p = canal.world(np.array(poses[number - 1][:3])) + rng.normal(0, 0.6, 3)
        start.append({"file": f"sonar_{number}.xyz", "x": round(float(p[0]), 1), "y": round(float(p[1]), 1), "within": 3.0})
    line_at = centre(length, 4.0, 1.0, lambda v: float(np.interp(v, grid, line)))
    return write(folder, canal, points, sources, stations, line_at, scans, "+z", {"start": start}, rng)


# ---------------------------------------------------------------- 4: a chamber


def chamber(folder: Path) -> dict:
    """A lock-like chamber: gate recesses, hollow quoins and stop-plank grooves in plan, a ladder in a niche."""
    rng = np.random.default_rng(30304)
    length = 25.0
    low, high = np.array([-4.0, -3.8, -4.9]), np.array([length + 4.0, 3.8, 4.6])
    walls = [noise_raster(rng, (-4.0, -4.9), (length + 4.0, 2.1), 0.1, [(1.4, 0.007), (0.3, 0.003)]) for _ in range(2)]
    bed = noise_raster(rng, (-4.0, -3.8), (length + 4.0, 3.8), 0.15, [(1.5, 0.05), (0.4, 0.025)])
    half = 2.62
    # x0, x1, side, depth, bottom, top: recesses that are open to the chamber
    recesses = [
        (3.4, 6.55, 1, 0.42, -2.55, 1.75),
        (3.4, 6.50, -1, 0.40, -2.55, 1.75),
        (18.2, 21.30, 1, 0.42, -4.5, 1.75),
        (18.25, 21.30, -1, 0.43, -4.5, 1.75),
        (1.9, 2.16, 1, 0.20, -4.5, 1.75),
        (1.9, 2.15, -1, 0.20, -4.5, 1.75),
        (23.1, 23.36, 1, 0.20, -4.5, 1.75),
        (23.12, 23.36, -1, 0.21, -4.5, 1.75),
        (11.2, 11.95, 1, 0.34, -3.05, 1.72),
    ]  # the last is the ladder's niche
    quoins = [(6.62, 2.72, 0.26, -2.55), (6.57, -2.72, 0.26, -2.55), (21.37, 2.73, 0.27, -4.5), (21.37, -2.73, 0.27, -4.5)]

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        n = np.where(y > 0, walls[0](x, z), walls[1](x, z))
        f = vault(y, z, half, 1.9, 1.75)
        side = np.abs(y)
        close = np.flatnonzero(side > half - 1.6)
        if len(close):
            xs, ys, zs, best = x[close], y[close], z[close], f[close]
            for x0, x1, s, depth, bottom, top in recesses:
                ends = np.minimum(np.minimum(xs - x0, x1 - xs), np.minimum(zs - bottom, top - zs))
                best = np.maximum(best, np.minimum(ends, np.minimum(half + depth - s * ys, s * ys)))
            for cx, cy, r, bottom in quoins:
                best = np.maximum(best, np.minimum(r - np.hypot(xs - cx, ys - cy), np.minimum(zs - bottom, 1.75 - zs)))
            f[close] = best
        # the floor, with the sill of the upper gates and a mitre sill at the lower ones
        sill = np.where(x < 7.0, np.clip(1.25 * (7.0 - x) / 0.12, 0.0, 1.25), 0.0)
        sill = np.maximum(sill, 0.24 * ((x > 21.1) & (x < 21.9)))
        mud = 0.22 * np.exp(-(half - np.minimum(side, half)) / 0.4)
        steep = np.where(np.abs(x - 6.95) < 0.3, 0.15, 1.0)  # keeps the steps short at the drop
        return np.minimum(f + n, (z + 3.8 - bed(x, y) - sill - mud) * steep)

    canal = Canal(
        field, low + [0.5, 0.2, 0.2], high - [0.5, 0.2, 0.2], np.radians(107.0), np.array([148330.0, 169870.0, 57.244]), 31370
    )
    heights = 0.18 + 0.290 * np.arange(15) + rng.normal(0, 0.004, 15)
    canal.ladder(
        rng,
        np.array([11.565, half + 0.12, -2.75]),
        np.array([0.004, 0.003, 1.0]),
        np.array([1.0, 0.0, 0.003]),
        4.38,
        0.45,
        0.026,
        heights,
        zero=0.55,
    )
    # gauge board and a sunken beam, and a rope that has fallen in
    canal.bar(np.array([[14.2, -2.5, -0.9], [15.9, 1.2, -3.55]]), 0.09)
    t = np.linspace(0, 1, 9)
    canal.bar(np.stack([8.9 + 0.5 * t, -2.5 + 0.2 * t, 1.3 - 3.2 * t], axis=1), 0.011)
    stations = np.array([[2.6, -0.8, 1.45], [9.3, 0.9, 1.4], [15.2, -0.9, 1.4], [22.4, 0.5, 1.45]])
    points, sources = laser(canal, stations, 0.36, rng, fine=0.07)
    scans = [
        sonar(canal, h, rng)
        for h in heads(
            [(9.2, -0.45, -1.50, 199.0, 1.8, 75.0, -0.002), (15.8, 0.55, -1.52, 340.0, 3.1, 290.0, -0.002)],
            1479.5 / 1465.0,
            fan=(-80.0, 80.0),
            beam_step=0.5,
            pan_step=0.9,
            sigma=0.013,
            down=True,
        )
    ]
    return write(folder, canal, points, sources, stations, centre(length, 2.5, 1.0), scans, "-z", {}, rng)
