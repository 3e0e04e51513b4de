"""A laser above the water and a sonar below it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .trace import WALL, Canal, Field


def rays(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """Give unit vectors of angles in radians; z is up."""
    c = np.cos(elevation)
    return np.stack([c * np.cos(azimuth), c * np.sin(azimuth), np.sin(elevation)], axis=-1)


def turn(axis: str, degrees: float) -> np.ndarray:
    """Give a rotation about an axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


@dataclass(frozen=True)
class Station:
    """A laser's place in the frame of the scene, and the targets that it scans in detail."""

    place: tuple[float, float, float]
    targets: tuple[tuple[float, float, float], ...] = ()
    step: float = 0.31
    spread: float = 1.3


@dataclass(frozen=True)
class Sonar:
    """A sonar scan: its place, its pose, its pattern and its errors.

    `heading` and the two tilts are degrees, `beam` is the width at -3 dB in degrees, `noise` is in m.
    `scale` is the true speed of sound over the assumed one. `point` is "+z" or "-z".
    """

    place: tuple[float, float, float]
    heading: float
    tilt: tuple[float, float]
    scale: float
    point: str = "+z"
    reach: float = 20.0
    beam: float = 1.0
    noise: float = 0.012
    step: tuple[float, float] = (0.6, 0.7)
    fan: tuple[float, float] = (-86.0, 62.0)
    determined: bool = True
    open: str = ""
    start: float = 0.0

    def rotation(self) -> np.ndarray:
        """Give the rotation from the file's axes to the frame of the scene."""
        flip = np.diag([1.0, 1.0, 1.0] if self.point == "+z" else [1.0, -1.0, -1.0])
        return turn("z", self.heading) @ turn("y", self.tilt[0]) @ turn("x", self.tilt[1]) @ flip


def laser(canal: Canal, station: Station, water: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Scan from a station. Give points in the frame of the scene, and intensities."""
    o = np.array(station.place)
    step = np.radians(station.step)
    az, el = np.meshgrid(np.arange(0.0, 2 * np.pi, step), np.arange(np.radians(-62.0), np.radians(89.0), step), indexing="ij")
    keep = rng.random(az.shape) < np.clip(np.cos(el) * 1.6, 0.05, 1.0)
    keep &= (el > np.radians(-25.0)) | (rng.random(az.shape) < 0.2)
    parts = [rays(az[keep], el[keep])]
    for target in station.targets:
        v = np.array(target) - o
        far = np.linalg.norm(v)
        a0, e0, half = np.arctan2(v[1], v[0]), np.arcsin(v[2] / far), min(station.spread / far, 0.5)
        fine = max(0.005 / far, 0.0006)
        a = a0 + np.arange(-half * 0.6, half * 0.6, fine) / np.cos(e0)
        parts.append(rays(*(g.ravel() for g in np.meshgrid(a, np.arange(e0 - half, e0 + half, fine), indexing="ij"))))
    d = np.concatenate(parts)
    with np.errstate(divide="ignore"):
        tw = np.where(d[:, 2] < 0.0, (water - o[2]) / d[:, 2], np.inf)
    # A ray that comes down into the water far away, or steeply, gives nothing.
    steep = -d[:, 2]
    fresnel = 0.02 + 0.98 * (1.0 - np.clip(steep, 0.0, 1.0)) ** 5
    chance = np.clip(20.0 * fresnel**2, 0.0, 0.8)
    t, cosine, kind, graze = canal.trace(o, d, 60.0)
    wet = tw < t
    mirror = np.flatnonzero(wet & (rng.random(len(d)) < chance))
    t[wet], kind[wet] = np.inf, 0
    graze[graze > tw] = np.inf
    flip = d[mirror] * np.array([1.0, 1.0, -1.0])
    tm, cm, km, _ = canal.trace(o + d[mirror] * tw[mirror, None] + np.array([0.0, 0.0, 1e-4]), flip, 40.0)
    t[mirror], cosine[mirror], kind[mirror] = tw[mirror] + tm, cm, km
    # Leaves and scum that float give a few points of the water itself.
    scum = np.flatnonzero(wet & (tw < 8.0) & (rng.random(len(d)) < 0.004))
    t[scum], cosine[scum], kind[scum] = tw[scum] + rng.normal(0.0, 0.003, len(scum)), 0.5, WALL
    mixed = np.flatnonzero(np.isfinite(graze) & np.isfinite(t))
    share = rng.random(len(mixed))
    front = np.minimum(graze[mixed], t[mixed])
    back = np.where(kind[mixed] == WALL, t[mixed], front + rng.uniform(0.0, 0.1, len(mixed)))
    t[mixed] = np.where(back - front < 1.5, front + share * (back - front), t[mixed])
    good = np.isfinite(t) & (rng.random(len(d)) < np.clip(cosine * 12.0, 0.0, 0.995))
    t = t[good] + rng.normal(0.0, 0.002, good.sum())
    strength = 30000 * np.clip(cosine[good], 0.05, 1.0) * np.where(kind[good] == WALL, 1.0, 1.4) / (1.0 + (t / 12.0) ** 2)
    return o + d[good] * t[:, None], np.clip(strength * rng.normal(1.0, 0.08, len(t)), 50, 65000).astype(np.uint16)


def sonar(
    canal: Canal, scan: Sonar, water: float, weed: Field | None, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scan below the water.

    Give the points in the file's axes, and check points in the file's axes and in the frame of the scene.
    """
    o = np.array(scan.place)
    rotation = scan.rotation()
    sign = 1.0 if scan.point == "+z" else -1.0
    az, el = np.meshgrid(
        np.radians(np.arange(0.0, 360.0, scan.step[0])), np.radians(np.arange(*scan.fan, scan.step[1])), indexing="ij"
    )
    az, el = az.ravel(), el.ravel()
    keep = rng.random(len(az)) < np.clip(1.6 * np.cos(el) ** 2, 0.06, 1.0)
    az, el = az[keep] + rng.normal(0.0, 0.0006, keep.sum()), el[keep]
    local = rays(az, el) * np.array([1.0, sign, sign])
    n, k = len(local), 6
    centre = local @ rotation.T
    # Rays inside of the beam: the first is its middle, and the others lie on it by chance, most of them near the middle.
    side = np.stack([-np.sin(az), np.cos(az), np.zeros(n)], axis=-1) * np.array([1.0, sign, sign]) @ rotation.T
    over = np.cross(centre, side)
    off = rng.normal(0.0, np.radians(scan.beam) / 2.355, (2, n, k))
    off[:, :, 0] = 0.0
    d = centre[:, None] + off[0][..., None] * side[:, None] + off[1][..., None] * over[:, None]
    d = (d / np.linalg.norm(d, axis=-1, keepdims=True)).reshape(-1, 3)
    t, cosine, kind, _ = canal.trace(o, d, scan.reach * 1.02)
    with np.errstate(divide="ignore"):
        tw = np.where(d[:, 2] > 0.0, (water - o[2]) / d[:, 2], np.inf)
    up = tw < t
    weight = np.where(kind == WALL, cosine**1.5 + 0.02, 2.5 * cosine + 0.05) * np.isfinite(t)
    slope = np.sqrt(np.maximum(1.0 / np.maximum(d[:, 2], 1e-3) ** 2 - 1.0, 0.0))
    weight = np.where(up, 1.2 * np.exp(-((slope / 0.55) ** 2)), weight)
    real_t = np.where(up, np.inf, t)
    t = np.where(up & (tw < scan.reach), tw, t)
    kind = np.where(up, 0, kind)
    if weed is not None:
        p = o + d * np.where(np.isfinite(t), t, 0.0)[:, None]
        s, q = canal.course.to_curve(p[:, 0], p[:, 1])
        thick = np.where(kind == WALL, weed(s, q, p[:, 2]), 0.0)
        caught = rng.random(len(t)) < np.clip(4.0 * thick, 0.0, 0.75)
        t = t - caught * np.minimum(thick * rng.exponential(0.6, len(t)) / np.maximum(cosine, 0.25), 0.5)
        kind = np.where(caught, 0, kind)
    t, weight, kind = t.reshape(n, k), weight.reshape(n, k), kind.reshape(n, k)
    t = np.where(np.isfinite(t), t, 1e6)
    close = np.abs(t[:, :, None] - t[:, None, :]) < 0.03
    power = np.einsum("nij,nj->ni", close, weight)
    best = power.argmax(axis=1)
    row = np.arange(n)
    share = close[row, best] * weight
    total = share.sum(axis=1)
    found = np.sum(share * t, axis=1) / np.maximum(total, 1e-9)
    seen = rng.random(n) < np.clip(total / k * 6.0, 0.0, 0.99) * np.clip(1.4 - 0.5 * found / scan.reach, 0.0, 1.0)
    seen &= (found < scan.reach) & (found > 0.35)
    plain = seen & (kind[:, 0] > 0) & (np.abs(found - real_t.reshape(n, k)[:, 0]) < 0.05)
    found = found + rng.normal(0.0, scan.noise, n) + rng.normal(0.0, 0.002, n) * found * (1 - cosine.reshape(n, k)[:, 0])
    # False echoes: by way of the water's surface, by way of a wall, and single ones at any range.
    by_water = np.flatnonzero(up.reshape(n, k)[:, 0] & ~seen & (rng.random(n) < 0.05))
    tw = tw.reshape(n, k)[:, 0]
    below = o + centre[by_water] * tw[by_water, None] - np.array([0.0, 0.0, 1e-3])
    found[by_water] = tw[by_water] + canal.trace(below, centre[by_water] * np.array([1.0, 1.0, -1.0]), scan.reach)[0]
    by_wall = np.flatnonzero(plain & (rng.random(n) < 0.008))
    found[by_wall] *= rng.uniform(1.3, 2.1, len(by_wall))
    random = np.flatnonzero(rng.random(n) < 0.008)
    found[random] = rng.uniform(0.5, scan.reach, len(random))
    seen[by_water] = True
    seen[random] = True
    seen &= (found < scan.reach) & (found > 0.35)
    check = np.flatnonzero(plain & (real_t.reshape(n, k)[:, 0] < 9.9 * min(scan.scale, 1.0)) & (np.isfinite(found)))
    far = real_t.reshape(n, k)[check, 0] ** 2
    check = rng.choice(check, min(400, len(check)), replace=False, p=far / far.sum())
    check_scene = o + centre[check] * real_t.reshape(n, k)[check, :1]
    check_local = (check_scene - o) @ rotation / scan.scale
    return local[seen] * found[seen, None] / scan.scale, check_local, check_scene
