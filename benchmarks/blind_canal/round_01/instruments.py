"""The laser, the sonar, and the files of a scene."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

from .canal import Array, Bars, Canal, march, slope

MISS, SHELL, LADDER, SURFACE, LEG = range(5)


@dataclass(frozen=True)
class Frame:
    """From the local frame to the projected CRS."""

    epsg: int
    x: float
    y: float
    azimuth: float  # of the local x axis, counterclockwise from east, degrees

    @property
    def turn(self) -> Array:
        return spin(self.azimuth)

    def __call__(self, p: Array) -> Array:
        return np.asarray(p) @ self.turn.T + [self.x, self.y, 0]


def spin(degrees: float, axis: tuple[float, float, float] = (0, 0, 1)) -> Array:
    """A rotation about an axis."""
    a = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    w = np.radians(degrees)
    return np.eye(3) + np.sin(w) * k + (1 - np.cos(w)) * k @ k


def rays(azimuth: Array, elevation: Array) -> Array:
    c = np.cos(elevation)
    return np.stack([c * np.cos(azimuth), c * np.sin(azimuth), np.sin(elevation)], -1)


# ---------------------------------------------------------------------------------------------------------------- laser


def laser_scan(
    canal: Canal,
    at: Array,
    step: float,
    rng: np.random.Generator,
    reach: float = 60.0,
    window: tuple[float, float, float, float] | None = None,
) -> tuple[Array, Array]:
    """Points and intensities from one station. ``window`` (degrees: azimuths, elevations) is a finer scan of a part."""
    az0, az1, el0, el1 = window or (0.0, 360.0, -62.0, 89.0)
    block = 4
    rows, cols = (int((b - a) / step / block) + 1 for a, b in ((el0, el1), (az0, az1)))
    el = np.radians(el0 + step * np.arange(rows * block))
    az = np.radians(az0 + step * np.arange(cols * block))
    distance = canal.sdf(laser=True)
    # Blocks of rays are marched as cones; the rays then start where the cone came near a surface.
    mid_el, mid_az = el.reshape(rows, block).mean(1), az.reshape(cols, block).mean(1)
    coarse = rays(*np.meshgrid(mid_az, mid_el)).reshape(-1, 3)
    cone = np.tan(np.radians(step) * (block / 2 + 0.1) * 1.42)
    begin = np.minimum(march(distance, at, coarse, 0.3, reach, cone), reach)
    begin = np.repeat(np.repeat(begin.reshape(rows, cols), block, 0), block, 1).ravel() * 0.995 - 0.02
    d = rays(*np.meshgrid(az, el)).reshape(-1, 3)
    with np.errstate(divide="ignore"):
        surface = np.where(d[:, 2] < 0, (canal.water - at[2]) / d[:, 2], np.inf)
    wet_before = begin > surface
    t = np.full(len(d), np.inf)
    dry = np.flatnonzero(~wet_before)
    t[dry] = march(distance, at, d[dry], np.maximum(begin[dry], 0.1), np.minimum(surface[dry] + 0.1, reach), eps=4e-4)
    bars = [ladder.bars() for ladder in canal.ladders] + canal.ropes
    for bar in bars:
        t = np.minimum(t, bar.cast(at, d)[0])
    wet = surface < t
    # The water is a mirror: what it shows lies below it, in the straight line of the ray.
    cosine = np.abs(d[:, 2])
    mirror = 0.02 + 0.98 * (1 - cosine) ** 5
    seen = np.flatnonzero(wet & (surface < reach) & (rng.random(len(d)) < np.clip(2.5 * mirror, 0, 0.5)))
    t[wet] = np.inf
    if seen.size:
        start = at + surface[seen, None] * d[seen]
        back = d[seen] * [1, 1, -1]
        t2 = march(distance, start, back, 0.005, reach, eps=4e-4)
        for bar in bars:
            t2 = np.minimum(t2, bar.cast(start, back)[0])
        t[seen] = surface[seen] + t2
    t[t > reach] = np.inf
    # Mixed pixels: where the next ray is much further, some beams are split by the edge.
    grid = t.reshape(rows * block, cols * block)
    mixed = grid.copy()
    share = np.clip(0.006 / (np.radians(step) * np.where(np.isfinite(grid), grid, 1e3)), 0, 0.5)
    for axis in (0, 1):
        for shift in (1, -1):
            other = np.roll(grid, shift, axis)
            with np.errstate(invalid="ignore"):
                edge = np.isfinite(grid) & np.isfinite(other) & (np.abs(other - grid) > 0.04) & (np.abs(other - grid) < 2)
            edge &= rng.random(grid.shape) < share
            mix = rng.random(grid.shape)
            mixed[edge] = (grid * mix + np.where(np.isfinite(other), other, 0) * (1 - mix))[edge]
    t = mixed.ravel()
    ok = np.isfinite(t)
    p = at + d[ok] * t[ok, None]
    s, _ = canal.axis.to_canal(p[:, 0], p[:, 1])
    keep = (p[:, 2] < canal.water + canal.top) | ((s > 0) & (s < canal.length))  # above the walls outside is sky
    keep &= rng.random(len(p)) > 0.005
    t, p = t[ok][keep], p[keep]
    t_noise = rng.normal(0, 0.002, len(t)) * np.sqrt(1 + (t / 25) ** 2)
    p = p + d[ok][keep] * t_noise[:, None]
    strength = np.where(wet[ok][keep], 0.35, 1.0) * 30000 / (1 + (t / 12) ** 2) * rng.uniform(0.6, 1.0, len(t))
    return p, strength


def ladder_window(canal: Canal, at: Array, ladder_index: int) -> tuple[float, float, float, float]:
    """The part of a station's view that holds the dry part of a ladder, with a margin."""
    bars = canal.ladders[ladder_index].bars()
    p = np.vstack([bars.a, bars.b])
    p = p[p[:, 2] > canal.water - 0.1] - at
    az = np.degrees(np.arctan2(p[:, 1], p[:, 0]))
    az = np.where(az - az[0] > 180, az - 360, np.where(az - az[0] < -180, az + 360, az))
    el = np.degrees(np.arctan2(p[:, 2], np.hypot(p[:, 0], p[:, 1])))
    return az.min() - 2, az.max() + 2, max(el.min() - 2, -62), min(el.max() + 2, 89)


# ---------------------------------------------------------------------------------------------------------------- sonar


@dataclass(frozen=True)
class Sonar:
    """A station of the sonar, in canal coordinates; angles in degrees."""

    s: float
    n: float
    depth: float  # of the head below the water of the laser scan
    heading: float
    tilt: float
    tilt_to: float
    scale: float
    fell: float = 0.0  # how far the water fell since the laser scan
    determined: bool = True
    open: str = ""
    beams: tuple[float, float, float] = (-80.0, 64.0, 0.72)  # elevations: first, last, step
    turn_step: float = 1.25  # of the rotation
    width: float = 1.0  # of the beam, half power
    sigma: float = 0.014  # of a range, m
    reach: float = 30.0


def legs(at: Array, floor: float, turn: float) -> Bars:
    """The three legs of the sonar's tripod."""
    a, b = [], []
    for k in range(3):
        w = np.radians(turn + 120 * k)
        out = np.array([np.cos(w), np.sin(w), 0])
        a.append(at + 0.10 * out + [0, 0, -0.22])
        b.append(np.array([at[0], at[1], floor]) + (0.15 + 0.45 * (at[2] - floor)) * out)
    return Bars(np.array(a), np.array(b), np.full(3, 0.016))


def sonar_scan(canal: Canal, sonar: Sonar, up: str, rng: np.random.Generator) -> tuple[Array, dict]:
    """The points of one scan in the sonar's axes, and its truth in the local frame."""
    x, y = canal.axis.to_local(sonar.s, sonar.n)
    at = np.array([float(x), float(y), canal.water - sonar.depth])
    floor = float(canal.bed(np.array([sonar.s]), np.array([sonar.n]))[0])
    flip = np.diag([1.0, 1.0, 1.0] if up == "+z" else [1.0, -1.0, -1.0])
    w = np.radians(sonar.tilt_to)
    turn = spin(sonar.tilt, (np.cos(w), np.sin(w), 0)) @ spin(sonar.heading) @ flip
    surface_z = canal.water - sonar.fell
    distance = canal.sdf()
    tripod = legs(at, floor, 40 + sonar.heading)
    ladders = [ladder.bars() for ladder in canal.ladders]
    steel = [ladder.steel for ladder in canal.ladders]

    # Beams in the head's own axes; ``flip`` makes elevations count from the head's mounting, so up is up.
    el, az = np.meshgrid(np.radians(np.arange(*sonar.beams)), np.radians(np.arange(0, 360, sonar.turn_step)))
    own = rays(az.ravel(), el.ravel()) @ flip
    main = own @ turn.T
    count = len(main)
    cone = np.tan(np.radians(0.62 * sonar.width))
    begin = np.minimum(march(distance, at, main, 0.1, sonar.reach + 3, cone), sonar.reach + 3)

    # Parts of the footprint: the middle, a ring of three and a ring of four, turned at random from beam to beam.
    radius = np.radians(sonar.width) * np.array([0, 0.27, 0.27, 0.27, 0.55, 0.55, 0.55, 0.55])
    share = np.exp2(-((radius / np.radians(sonar.width / 2)) ** 2)) * np.array([1, 1, 1, 1, 1.2, 1.2, 1.2, 1.2])
    phase = np.array([0, 0, 120, 240, 0, 90, 180, 270]) * np.pi / 180
    side = np.cross(main, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-9
    over = np.cross(side, main)
    turned = rng.uniform(0, 2 * np.pi, count)[:, None] + phase
    ring = np.cos(turned)[..., None] * side[:, None] + np.sin(turned)[..., None] * over[:, None]
    d = main[:, None] + radius[:, None] * ring
    d /= np.linalg.norm(d, axis=2, keepdims=True)
    parts = len(radius)
    d = d.reshape(-1, 3)
    t, energy, label = _first(
        canal, distance, at, d, np.repeat(begin, parts) * 0.99 - 0.02, sonar.reach + 2, surface_z, tripod, ladders, steel
    )
    t, label = t.reshape(count, parts), label.reshape(count, parts)
    energy = energy.reshape(count, parts) * share
    energy[~np.isfinite(t)] = 0
    safe = np.where(np.isfinite(t), t, 1e6)

    # The echo is the strongest part of the footprint: parts whose ranges lie within the length of the pulse add up.
    best, chosen = np.zeros(count), np.full(count, np.inf)
    kind = np.zeros(count, int)
    for i in range(parts):
        near = np.abs(safe - safe[:, i : i + 1]) < 0.03
        power = (energy * near).sum(1)
        better = power > best * 1.0001
        mean = (energy * near * safe).sum(1) / np.maximum(power, 1e-12)
        best[better], chosen[better], kind[better] = power[better], mean[better], label[better, i]
    found = best / share.sum()
    lost = np.exp(-0.02 * np.where(np.isfinite(chosen), chosen, 0))
    heard = (rng.random(count) < 0.985 * found * lost / (found * lost + 0.015)) & np.isfinite(chosen) & (chosen < sonar.reach)

    # Mirror echoes: the surface throws a flat beam on to the walls and the bed; it seems to come from above the water.
    flat = np.flatnonzero((label[:, 0] == SURFACE) & ~heard & (rng.random(count) < 0.035))
    echo = chosen.copy()
    if flat.size:
        run = (surface_z - at[2]) / main[flat, 2]
        start = at + run[:, None] * main[flat]
        echo[flat] = run + march(distance, start, main[flat] * [1, 1, -1], 0.02, sonar.reach)
        heard[flat] = echo[flat] < sonar.reach
    # Multipath: over a wall to another surface and back the same way.
    double = np.flatnonzero(heard & (kind == SHELL) & (rng.random(count) < 0.014))
    if double.size:
        hit = at + echo[double, None] * main[double]
        normal = slope(distance, hit)
        hit = hit + 0.03 * normal
        out = main[double] - 2 * (main[double] * normal).sum(1, keepdims=True) * normal
        with np.errstate(divide="ignore"):
            top = np.where(out[:, 2] > 0, np.maximum(surface_z - hit[:, 2], 0.01) / out[:, 2], np.inf)
        far = echo[double] + np.minimum(march(distance, hit, out, 0.05, sonar.reach), top)
        use = far < sonar.reach
        echo[double[use]] = far[use]
    stray = heard & (rng.random(count) < 0.011)
    echo[stray] = rng.uniform(0.5, 0.6 * sonar.reach, int(stray.sum()))

    shaken = own + rng.normal(0, np.radians(0.08), own.shape)
    noise = rng.normal(0, sonar.sigma, count) * (1 + 0.015 * np.where(np.isfinite(echo), echo, 0))
    points = shaken[heard] * (echo[heard] + noise[heard])[:, None] / sonar.scale

    # Check points: hits of single rays, evenly spread over all directions, on walls, piers, bed, boat and ladders.
    probe = rng.normal(size=(6000, 3))
    probe /= np.linalg.norm(probe, axis=1, keepdims=True)
    t, _, label = _first(
        canal, distance, at, probe, np.full(len(probe), 0.05), 10.0, surface_z, tripod, ladders, steel, eps=1e-4
    )
    good = ((label == SHELL) | (label == LADDER)) & (t < 9.9)
    good &= np.abs(distance(at + np.where(good, t, 0)[:, None] * probe)) < np.where(label == LADDER, np.inf, 1e-3)
    good = np.flatnonzero(good)[:500]
    world = at + t[good, None] * probe[good]
    truth = {
        "turn": turn,
        "at": at,
        "scale": sonar.scale,
        "check": world,
        "check_local": (world - at) @ turn / sonar.scale,
        "determined": sonar.determined,
        "open": sonar.open,
    }
    return points, truth


def _first(
    canal: Canal,
    distance: object,
    at: Array,
    d: Array,
    begin: Array,
    reach: float,
    surface_z: float,
    tripod: Bars,
    ladders: list[Bars],
    steel: list[bool],
    eps: float = 8e-4,
) -> tuple[Array, Array, Array]:
    """Range, strength and kind of what each ray meets first below the water."""
    with np.errstate(divide="ignore"):
        top = np.where(d[:, 2] > 0, (surface_z - at[2]) / d[:, 2], np.inf)
    t, energy, label = np.full(len(d), np.inf), np.zeros(len(d)), np.zeros(len(d), int)
    try_ = np.flatnonzero(begin < top)
    t[try_] = march(distance, at, d[try_], np.maximum(begin[try_], 0.05), np.minimum(top[try_] + 0.1, reach), eps=eps)
    hit = np.flatnonzero(np.isfinite(t) & (t < top))
    p = at + t[hit, None] * d[hit]
    h = 0.015
    g = np.stack([distance(p + h * e) for e in np.eye(3)], 1) - distance(p)[:, None]
    cosine = np.abs((g * d[hit]).sum(1)) / (np.linalg.norm(g, axis=1) + 1e-9)
    s, n = canal.axis.to_canal(p[:, 0], p[:, 1])
    soft = np.where(p[:, 2] < canal.bed(s, n) + 0.02, 0.55, 1.0)
    energy[hit], label[hit] = soft * (0.03 + cosine**canal.shine), SHELL
    things = [(b, 2.2 if m else 1.3, LADDER) for b, m in zip(ladders, steel, strict=True)]
    for bars, strength, kind in [*things, (tripod, 1.0, LEG)]:
        near, c = bars.cast(at, d)
        closer = near < np.minimum(t, reach)
        t[closer], energy[closer], label[closer] = near[closer], strength * (0.3 + 0.7 * c[closer]), kind
    wet = top < np.minimum(t, reach)
    t[wet], label[wet] = top[wet], SURFACE
    energy[wet] = 1.6 * np.clip((d[wet, 2] - 0.5) / 0.4, 0, 1) ** 1.5
    return t, energy, label


# ---------------------------------------------------------------------------------------------------------------- files


@dataclass(frozen=True)
class Station:
    """A station of the laser, in canal coordinates, with height above the water, and ladders that it scans finely."""

    s: float
    n: float
    height: float
    fine: tuple[int, ...] = ()


def write(
    folder: Path,
    canal: Canal,
    frame: Frame,
    stations: list[Station],
    sonars: list[Sonar],
    up: str,
    seed: int,
    step: float = 0.24,
    start: list[int] | None = None,
    within: float = 1.5,
    sound: tuple[float, float] | None = None,
) -> None:
    """All files of a scene."""
    rng = np.random.default_rng(seed)
    points, strengths, source, rows = [], [], [], []
    for i, station in enumerate(stations, 1):
        x, y = canal.axis.to_local(station.s, station.n)
        at = np.array([float(x), float(y), canal.water + station.height])
        rows.append([i, *np.round(frame(at), 4)])
        parts = [laser_scan(canal, at, step, rng)]
        parts += [laser_scan(canal, at, 0.07, rng, window=ladder_window(canal, at, k)) for k in station.fine]
        for p, strength in parts:
            points.append(frame(p))
            strengths.append(strength)
            source.append(np.full(len(p), i))
    _las(folder / "laser.laz", np.vstack(points), np.concatenate(strengths), np.concatenate(source), frame.epsg)
    _csv(folder / "stations.csv", ["scan_id", "x", "y", "z"], rows)
    s = np.append(np.arange(0, canal.length - 1, 2.0), canal.length)
    x, y = canal.axis.to_local(s, np.zeros_like(s))
    _csv(folder / "axis.csv", ["x", "y", "z"], np.round(frame(np.stack([x, y, np.full_like(x, canal.water)], 1)), 4).tolist())
    _csv(
        folder / "ladders.csv",
        ["ladder", "rung", "height", "stile_gap", "diameter"],
        [
            [k, j, round(float(h - ladder.heights[0] + 0.2 + rng.normal(0, 0.0015)), 3), round(ladder.gap, 3), ladder.rung]
            for k, ladder in enumerate(canal.ladders, 1)
            for j, h in enumerate(ladder.heights, 1)
        ],
    )
    scans, starts = [], []
    for i, sonar in enumerate(sonars, 1):
        p, truth = sonar_scan(canal, sonar, up, rng)
        np.savetxt(folder / f"sonar_{i}.xyz", p, fmt="%.4f")
        entry = {
            "rotation": (frame.turn @ truth["turn"]).tolist(),
            "origin": frame(truth["at"]).tolist(),
            "scale": truth["scale"],
            "check_local": truth["check_local"].tolist(),
            "check_world": frame(truth["check"]).tolist(),
            "determined": truth["determined"],
        }
        if truth["open"]:
            entry["open"] = truth["open"]
        scans.append(entry)
        if start and i in start:
            paced = frame(truth["at"])[:2] + rng.uniform(-0.6, 0.6, 2) * within
            starts.append(
                {"file": f"sonar_{i}.xyz", "x": round(float(paced[0]), 1), "y": round(float(paced[1]), 1), "within": within}
            )
    scene: dict = {"epsg": frame.epsg, "up": up, "water_level": canal.water}
    if sound:
        scene["sound_speed"] = list(sound)
    if starts:
        scene["start"] = starts
    (folder / "scene.json").write_text(json.dumps(scene, indent=1))
    (folder / "truth.json").write_text(json.dumps({"scans": scans}))


def _csv(path: Path, head: list[str], rows: list) -> None:
    with path.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(head)
        out.writerows(rows)


def _las(path: Path, p: Array, strength: Array, source: Array, epsg: int) -> None:
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 0.001)
    header.offsets = np.floor(p.min(0))
    header.add_crs(CRS.from_epsg(epsg))
    las = laspy.LasData(header)
    las.x, las.y, las.z = p.T
    las.intensity = np.clip(strength, 0, 65535).astype(np.uint16)
    las.point_source_id = source.astype(np.uint16)
    las.return_number = np.ones(len(p), np.uint8)
    las.number_of_returns = np.ones(len(p), np.uint8)
    las.write(str(path))
