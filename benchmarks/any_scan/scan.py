"""Scans: points on a tube's lining, and what a scanner would have noted of them.

The echo is that of a dull surface (Lambert) whose light spreads over a sphere, with an optic that loses near ranges:
``dB = C + 10 lg(albedo) + 10 lg(cos incidence) - 10 lg(r² + NEAR²)``. Albedo wanders slowly along the lining; wet lining
is darker by its leak's contrast; each echo carries noise. Points lie evenly at random (a static scanner) or on profiles (a
moving one).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from benchmarks.any_scan.tube import Array, Tube

LEVEL = 62.0
NEAR = 1.5
NOISE = 0.4
RANGE_NOISE = 0.003
SCANNER_ABOVE_FLOOR = 1.6


@dataclass(frozen=True)
class Leak:
    """A wet blot about (s, a): an ellipse whose rim wanders, darker by `drop` dB."""

    s: float
    a: float
    along: float
    around: float
    drop: float = 4.5

    def polygon(self) -> shapely.Polygon:
        angle = np.linspace(0.0, 2 * np.pi, 60, endpoint=False)
        wander = 1 + 0.12 * np.sin(3 * angle + self.s) + 0.06 * np.sin(5 * angle + self.a)
        rim = np.column_stack([self.along / 2 * np.cos(angle), self.around / 2 * np.sin(angle)]) * wander[:, None]
        return shapely.Polygon(rim + np.array([self.s, self.a]))


LEAKS = (
    Leak(5.3, 1.1, 0.9, 1.1, 5.0),
    Leak(10.4, -2.6, 0.5, 0.7, 4.0),
    Leak(14.6, 3.4, 1.2, 0.8, 6.0),
    Leak(18.9, -0.7, 0.6, 0.5, 4.5),
)
"""0.2 to 0.8 m² between 5 and 19 m, left and right of the crown; on tubes of a metre and more in radius."""


@dataclass
class Cloud:
    """What a scan holds: the points, where they were seen from, and when."""

    tube: Tube
    xyz: Array
    db: Array
    time: Array
    scan: np.ndarray
    poses: Array
    """(k, 4): number of the scan, or time; x, y, z."""
    mobile: bool = False
    leaks: tuple[Leak, ...] = LEAKS
    extra: dict[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, which: np.ndarray) -> Cloud:
        return replace(self, xyz=self.xyz[which], db=self.db[which], time=self.time[which], scan=self.scan[which])

    def add(self, xyz: Array, db: Array | float, like: Cloud | None = None) -> Cloud:
        """Add points that the nearest pose saw."""
        part = observe(self.tube, xyz, np.asarray(db) + np.zeros(len(xyz)), self.poses, self.mobile)
        return join(self, part)


def join(first: Cloud, second: Cloud) -> Cloud:
    return replace(
        first,
        xyz=np.vstack([first.xyz, second.xyz]),
        db=np.concatenate([first.db, second.db]),
        time=np.concatenate([first.time, second.time]),
        scan=np.concatenate([first.scan, second.scan]),
    )


def observe(tube: Tube, xyz: Array, db: Array, poses: Array, mobile: bool) -> Cloud:
    """Give points the time or the scan of the pose nearest along the axis."""
    s = tube.unplace(xyz)[0]
    along = tube.unplace(poses[:, 1:])[0]
    order = np.argsort(along)
    index = order[np.clip(np.searchsorted((along[order][1:] + along[order][:-1]) / 2, s), 0, len(order) - 1)]
    key = poses[index, 0]
    if mobile:
        return Cloud(tube, xyz, db, np.interp(s, along[order], poses[order, 0]), np.zeros(len(xyz), int), poses, True)
    return Cloud(tube, xyz, db, 1000.0 + np.arange(len(xyz)) * 1e-5, key.astype(int), poses, False)


def law(distance: Array, cosine: Array | float = 1.0) -> Array:
    """Return dB of dry lining."""
    return LEVEL + 10 * np.log10(np.maximum(cosine, 1e-3)) - 10 * np.log10(distance**2 + NEAR**2)


def static(tube: Tube, density: float = 500.0, spacing: float = 9.0, leaks: tuple[Leak, ...] = LEAKS, seed: int = 1) -> Cloud:
    """Scan from stations `spacing` apart, beginning half of it inside, with `density` points/m²."""
    rng = np.random.default_rng(seed)
    count = max(1, round(tube.length / spacing))
    at = (np.arange(count) + 0.5) * tube.length / count
    side = np.where(np.arange(count) % 2, -0.2, 0.2) * abs(tube.section.floor) / 2
    poses = tube.place(at, side, np.full(count, _eye(tube)))
    poses = np.column_stack([np.arange(1, count + 1), poses])
    n = round(tube.length * tube.section.perimeter * density)
    return _shoot(tube, rng.uniform(0, tube.length, n), rng, poses, leaks, mobile=False)


def mobile(
    tube: Tube,
    profile: float = 0.02,
    points: int = 400,
    leaks: tuple[Leak, ...] = LEAKS,
    seed: int = 2,
    back: bool = False,
    start: float = 250000.0,
) -> Cloud:
    """Drive a profiler along at 1 m/s: a profile every `profile` m with `points` points; `back`: towards falling s."""
    rng = np.random.default_rng(seed)
    at = np.arange(profile / 2, tube.length, profile)
    way = np.arange(-1.0, tube.length + 1.01, 0.5)
    poses = tube.place(way, np.full(len(way), 0.3), np.full(len(way), _eye(tube)))
    time = start + (tube.length - way if back else way)
    poses = np.column_stack([time, poses])
    poses = poses[np.argsort(time)]
    return _shoot(tube, np.repeat(at, points), rng, poses, leaks, mobile=True)


def _eye(tube: Tube) -> float:
    return tube.section.floor + min(SCANNER_ABOVE_FLOOR, abs(tube.section.floor))


def _shoot(tube: Tube, s: Array, rng: np.random.Generator, poses: Array, leaks: tuple[Leak, ...], mobile: bool) -> Cloud:
    perimeter = tube.section.perimeter
    a = rng.uniform(-perimeter / 2, perimeter / 2, len(s))
    flat, normal = tube.section.at(a)
    xyz = tube.place(s, flat[:, 0], flat[:, 1])
    cloud = observe(tube, xyz, np.zeros(len(s)), poses, mobile)
    if mobile:
        eye = np.column_stack([np.interp(cloud.time, poses[:, 0], poses[:, k]) for k in (1, 2, 3)])
    else:
        eye = poses[np.searchsorted(poses[:, 0], cloud.scan), 1:]
    heading = tube.heading(s)
    inward = np.column_stack([normal[:, 0] * np.cos(heading), -normal[:, 0] * np.sin(heading), normal[:, 1]])
    ray = eye - xyz
    distance = np.linalg.norm(ray, axis=1)
    cosine = np.einsum("ij,ij->i", ray, inward) / distance
    albedo = 0.35 * np.sin(0.9 * s + 0.4 * a) + 0.25 * np.sin(0.31 * s - 1.3 * a)
    db = law(distance, cosine) + albedo + rng.normal(0, NOISE, len(s))
    for leak in leaks:
        near = np.flatnonzero((np.abs(s - leak.s) < leak.along) & (np.abs(a - leak.a) < leak.around))
        wet = shapely.contains_xy(leak.polygon(), s[near], a[near])
        db[near[wet]] -= leak.drop
    xyz = xyz - ray / distance[:, None] * rng.normal(0, RANGE_NOISE, len(s))[:, None]
    seen = cosine > np.cos(np.radians(86))
    return replace(cloud.take(seen), xyz=xyz[seen], db=db[seen], leaks=leaks)
