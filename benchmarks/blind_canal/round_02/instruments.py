"""The laser and the sonars."""

from __future__ import annotations

from dataclasses import dataclass, field as default

import numpy as np

from . import world as w
from .world import Bar, Canal, Hull


@dataclass
class Ladder:
    """A ladder: where it stands, and its bars."""

    s: float
    side: int  # 1 on the left, -1 on the right
    foot: float  # height of its foot
    length: float
    gap: float
    diameter: float
    lean: float  # radians, towards the wall
    stand: float  # distance of its foot from the nominal wall
    seed: int
    step: float = 0.28
    spread: float = 0.009
    roll: float = 0.0
    rungs: np.ndarray = default(init=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        n = int((self.length - 0.35) / self.step)
        h = 0.2 + np.cumsum(self.step + np.clip(rng.normal(0, self.spread, n), -2.2 * self.spread, 2.2 * self.spread))
        self.rungs = np.round(h[h < self.length - 0.1], 3)

    def bars(self, canal: Canal) -> list[Bar]:
        """Two stiles and the rungs, in the local frame."""
        _, phi = canal.frame(self.s)
        t, n = np.array([np.cos(phi), np.sin(phi), 0]), np.array([-np.sin(phi), np.cos(phi), 0])
        foot = canal.to_xyz(self.s, self.side * (canal.half - self.stand), self.foot)
        u = np.sin(self.lean) * self.side * n + np.cos(self.lean) * np.array([0, 0, 1.0])
        u = np.cos(self.roll) * u + np.sin(self.roll) * t
        across = t - (t @ u) * u
        across /= np.linalg.norm(across)
        r, e = self.diameter / 2, across * self.gap / 2
        out = [Bar(foot + k * e, foot + k * e + u * self.length, r, w.LADDER) for k in (-1, 1)]
        return out + [Bar(foot + u * h - e, foot + u * h + e, r, w.LADDER) for h in self.rungs]


def rope(a: np.ndarray, b: np.ndarray, sag: float, radius: float, parts: int = 10) -> list[Bar]:
    """A rope that hangs between two points."""
    f = np.linspace(0, 1, parts + 1)[:, None]
    p = a + f * (b - a) - np.array([0, 0, 1.0]) * sag * 4 * f * (1 - f)
    return [Bar(p[i], p[i + 1], radius, w.ROPE) for i in range(parts)]


def laser(
    canal: Canal,
    station: np.ndarray,
    reach: float,
    n_along: int,
    n_round: int,
    groups: list[list[Bar]],
    hulls: list[Hull],
    rng: np.random.Generator,
) -> np.ndarray:
    """Points of one laser station in the local frame. Directions follow a tube, as those of thinned scans do."""
    s = canal.to_sn(station[:1], station[1:2])[0][0]
    phi0 = canal.frame(float(s))[1]
    u = (np.arange(n_along) + 0.5) / n_along * 2 - 1
    top = np.arcsinh(reach)
    u, ang = np.meshgrid(u * top, np.arange(n_round) / n_round * 2 * np.pi, indexing="ij")
    u = np.sinh(u + rng.uniform(-1, 1, u.shape) * top / n_along)
    ang = ang + rng.uniform(-0.5, 0.5, u.shape) * 2 * np.pi / n_round
    shape = u.shape
    v, z = np.cos(ang), np.sin(ang)
    d = np.stack([u * np.cos(phi0) - v * np.sin(phi0), u * np.sin(phi0) + v * np.cos(phi0), z], -1).reshape(-1, 3)
    d /= np.linalg.norm(d, axis=1)[:, None]
    near = [g for g in groups if abs(g[0].a[0] - station[0]) < 25]
    t, kind, _, _ = w.cast(canal, station, d, 38.0, 0.0, 1, near, hulls, False)
    # Mixed pixels: where neighbours differ, a second ray through the footprint's other half.
    grid = np.where(np.isfinite(t), t, 60.0).reshape(shape)
    jump = np.zeros(shape, bool)
    jump[1:] |= np.abs(np.diff(grid, axis=0)) > 0.08
    jump[:, 1:] |= np.abs(np.diff(grid, axis=1)) > 0.08
    k = np.flatnonzero((jump.ravel() | (kind > w.SOLID)) & np.isfinite(t))
    side = np.cross(d[k], rng.standard_normal((len(k), 3)))
    side /= np.linalg.norm(side, axis=1)[:, None]
    d2 = d[k] + side * (0.003 / t[k] + 0.0003)[:, None]
    d2 /= np.linalg.norm(d2, axis=1)[:, None]
    t2 = w.cast(canal, station, d2, 38.0, 0.0, 1, near, hulls, False)[0]
    both = np.isfinite(t2) & (np.abs(t2 - t[k]) > 0.01) & (np.abs(t2 - t[k]) < 0.7)
    f = rng.beta(0.7, 0.7, both.sum())
    t[k[both]] = (1 - f) * t[k[both]] + f * t2[both]
    # Water: mirror images where the reflection is strong enough, some dirt that floats.
    below = np.isfinite(t) & (station[2] + t * d[:, 2] < 0)
    steep = np.abs(d[:, 2])
    mirror = np.minimum(1.0, 2.5 * (0.02 + 0.98 * (1 - steep) ** 5))
    draw = rng.random(len(t))
    dirt = below & (draw > 0.996)
    keep = np.isfinite(t) & (~below | (draw < 0.5 * mirror) | dirt)
    t[dirt] = -station[2] / d[dirt, 2]
    t = t + rng.normal(0, 0.002, len(t))
    return station + t[keep, None] * d[keep]


@dataclass
class Sonar:
    """A sonar's station and settings."""

    s: float
    n: float
    below: float  # depth of the head below the water of the sonar's day
    heading: float  # degrees
    tilt: tuple[float, float]  # degrees
    seed: int
    beams: tuple[int, int] = (230, 520)  # in the fan, in the turn
    fan: tuple[float, float] = (-74.0, 58.0)
    width: float = 1.0  # degrees
    sigma: float = 0.014
    rays: int = 8
    reach: float = 30.0
    tripod: bool = True
    determined: bool = True
    open: str = ""


def rotation(heading: float, tilt: tuple[float, float], down: bool) -> np.ndarray:
    """From the sonar's axes to the local frame."""
    h, a, b = np.radians([heading, *tilt])
    rz = np.array([[np.cos(h), -np.sin(h), 0], [np.sin(h), np.cos(h), 0], [0, 0, 1]])
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return rz @ rx @ ry @ (np.diag([1.0, -1.0, -1.0]) if down else np.eye(3))


def sonar(
    canal: Canal, head: Sonar, water: float, scale: float, down: bool, groups: list[list[Bar]], hulls: list[Hull]
) -> dict[str, np.ndarray]:
    """One scan: points of the file, and the pose and the check points in the local frame."""
    rng = np.random.default_rng(head.seed)
    rot = rotation(head.heading, head.tilt, down)
    o = canal.to_xyz(head.s, head.n, water - head.below)
    el, az = np.meshgrid(
        np.radians(np.linspace(*head.fan, head.beams[0])), np.arange(head.beams[1]) / head.beams[1] * 2 * np.pi, indexing="ij"
    )
    el, az = el.ravel(), az.ravel()
    if down:
        el = -el
    # A turning fan crowds its beams near the poles: drop them there evenly, as the operator's filter does.
    keep = rng.random(len(el)) < np.clip(np.cos(el) * 1.6, 0.2, 1)
    el, az = el[keep], az[keep]
    axis = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], 1)
    n, k = len(axis), head.rays
    spread = np.radians(head.width) * 0.36
    off = np.clip(rng.normal(0, spread, (n, k, 3)), -2 * spread, 2 * spread)
    off[:, 0] = 0
    d = axis[:, None, :] + off
    d = (d / np.linalg.norm(d, axis=2)[..., None]).reshape(-1, 3) @ rot.T
    near = [g for g in groups if abs(g[0].a[0] - o[0]) < head.reach + 2]
    if head.tripod:
        legs = []
        for a in np.radians(rng.uniform(0, 120) + np.array([0, 120, 240])):
            foot = o + np.array([0.75 * np.cos(a), 0.75 * np.sin(a), canal.bed_at(head.s, head.n) - o[2]])
            legs.append(Bar(o + 0.15 * (foot - o) + np.array([0, 0, -0.05]), foot, 0.018, w.TRIPOD))
        near = [*near, legs]
    t, kind, cos, up = w.cast(canal, o, d, head.reach, water, -1, near, hulls, True)
    # Echo strength of each ray: Lambert's law, the material, and spreading and absorption.
    gain = np.array([0, 1.0, 3.0, 0.6, 1.4, 1.4, 1.0])[kind]
    gain = np.where((kind == w.SOLID) & (up > 0.6), 0.55, gain)
    strength = gain * np.where(kind == w.SOLID, cos**1.5, cos)
    above = np.isfinite(t) & (o[2] + t * d[:, 2] > water) | ~np.isfinite(t) & (d[:, 2] > 0.02)
    strike = np.where(above, (water - o[2]) / np.where(above, d[:, 2], 1), np.inf)
    above &= strike < head.reach
    angle = np.degrees(np.arccos(np.clip(d[:, 2], -1, 1)))
    mirror_strength = 2.0 * np.exp(-((angle / 24) ** 2)) + 0.01
    ghost = above & np.isfinite(t) & (0.2 * strength > mirror_strength)
    surf = above & ~ghost
    t, kind = np.where(surf, strike, t), np.where(surf, w.SURFACE, kind)
    strength = np.where(surf, mirror_strength, np.where(ghost, 0.2 * strength, strength))
    t = np.where(np.isfinite(t), t, 999.0).reshape(n, k)
    strength = np.where(t < head.reach, strength.reshape(n, k) * np.exp(-t / 25), 0)
    # The strongest part of the footprint: the window of range with the largest sum.
    total = np.stack([np.where(np.abs(t - t[:, j : j + 1]) < 0.05, strength, 0).sum(1) for j in range(k)], 1)
    best = total.argmax(1)
    rows = np.arange(n)
    win = np.where(np.abs(t - t[rows, best][:, None]) < 0.05, strength, 0)
    r = (win * t).sum(1) / np.maximum(win.sum(1), 1e-9)
    power = total[rows, best] / k
    bk, bg = kind.reshape(n, k)[rows, best], ghost.reshape(n, k)[rows, best]
    seen = (power > 0.012 * np.exp(rng.normal(0, 0.5, n))) & (r > 0.3)
    seen &= ~bg | (rng.random(n) < 0.04)
    seen &= (bk != w.SURFACE) | (rng.random(n) < np.clip(power * 3, 0.004, 0.9))
    noisy = r + rng.normal(0, 1, n) * head.sigma * (0.8 + 0.04 * r)
    # False echoes: between the walls, twice to the same wall, and single random ranges.
    draw = rng.random(n)
    phi = canal.frame(head.s)[1]
    facing = np.abs((axis @ rot.T)[:, :2] @ np.array([-np.sin(phi), np.cos(phi)]))
    level = (facing > 0.85) & (bk == w.SOLID)
    twice, across, lone = (draw < 0.015) & level, (draw > 0.015) & (draw < 0.045) & level, draw > 0.991
    noisy = np.where(twice, 2 * noisy, np.where(across, 2 * canal.half / np.maximum(facing, 0.5), noisy))
    noisy = np.where(twice | across, noisy + rng.normal(0, 0.04, n), noisy)
    noisy = np.where(lone, rng.uniform(0.5, 0.8 * head.reach, n), noisy)
    seen = (seen | (lone & (rng.random(n) < 0.8))) & (noisy < head.reach)
    wobble = rng.normal(0, np.radians(0.04), (n, 3))
    axis2 = axis + wobble
    axis2 /= np.linalg.norm(axis2, axis=1)[:, None]
    points = (axis2 * noisy[:, None])[seen] / scale
    # Check points: where the middle ray of a beam meets a real surface.
    t0 = t[:, 0]
    good = seen & (t0 < 9.9) & (t0 > 0.8) & np.isin(kind.reshape(n, k)[:, 0], [w.SOLID, w.LADDER])
    good &= ~ghost.reshape(n, k)[:, 0] & (np.abs(r - t0) < 0.1)
    pick = rng.choice(np.flatnonzero(good), 400, replace=False)
    local = axis[pick] * t0[pick, None] / scale
    false = (twice | across | lone | bg) & seen
    return {
        "points": points,
        "rotation": rot,
        "origin": o,
        "check": local,
        "share": np.array(
            [false.sum() / seen.sum(), (seen & (bk == w.SURFACE)).sum() / seen.sum(), (seen & (bk == w.LADDER)).sum()]
        ),
    }
