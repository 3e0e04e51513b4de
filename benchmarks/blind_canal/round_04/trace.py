"""Rays against a canal: a signed distance of the shell, and exact cylinders and ellipsoids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter, map_coordinates

WALL, BAR, PIER, STONE, EXTRA = 1, 2, 3, 4, 5
Field = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class Noise:
    """A smooth random field that repeats, of zero mean and unit deviation."""

    def __init__(self, seed: int, dims: int, cell: float, smooth: float = 1.2, size: int = 64) -> None:
        """Draw the field."""
        values = gaussian_filter(np.random.default_rng(seed).normal(size=(size,) * dims), smooth, mode="wrap")
        self.values = ((values - values.mean()) / values.std()).astype(np.float32)
        self.cell = cell

    def __call__(self, *coordinates: np.ndarray) -> np.ndarray:
        """Look up the field at coordinates in metres."""
        at = np.stack([np.asarray(c, dtype=np.float32) / self.cell for c in coordinates])
        return map_coordinates(self.values, at, order=1, mode="grid-wrap", prefilter=False)


@dataclass(frozen=True)
class Course:
    """The axis in plan: a straight, an arc that turns left, and a straight.

    A straight canal has no arc (`angle` 0). It begins at (0, 0) along +x.
    """

    lead: float
    radius: float = 1000.0
    angle: float = 0.0

    def to_curve(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give chainage, and offset to the left."""
        if self.angle == 0.0:
            return x, y
        dx, dy = x - self.lead, self.radius - y
        phi = np.arctan2(dx, dy)
        turn = np.clip(phi, 0.0, self.angle)
        c, s = np.cos(turn), np.sin(turn)
        along = dx * c - dy * s
        return self.lead + self.radius * turn + along, self.radius - (dx * s + dy * c)

    def to_plan(self, s: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Give x and y of a chainage and an offset to the left."""
        s, q = np.asarray(s, dtype=float), np.asarray(q, dtype=float)
        turn = np.clip((s - self.lead) / self.radius, 0.0, self.angle)
        along = s - self.lead - self.radius * turn
        r = self.radius - q
        c, n = np.cos(turn), np.sin(turn)
        return self.lead + r * n + along * c, self.radius - r * c + along * n


class Profile:
    """The signed distance of a section, on a grid. It is positive in the free space."""

    def __init__(self, corners: np.ndarray, step: float = 0.015) -> None:
        """Lay out the grid."""
        corners = np.asarray(corners, dtype=float)
        self.corners, self.step = corners, step
        self.low = corners.min(axis=0) - 0.6
        size = np.ceil((corners.max(axis=0) + 0.6 - self.low) / step).astype(int) + 1
        q, z = np.meshgrid(*(self.low[i] + step * np.arange(size[i]) for i in (0, 1)), indexing="ij")
        best = np.full(q.shape, np.inf)
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            v = b - a
            along = np.clip(((q - a[0]) * v[0] + (z - a[1]) * v[1]) / max(v @ v, 1e-12), 0.0, 1.0)
            np.minimum(best, (q - a[0] - along * v[0]) ** 2 + (z - a[1] - along * v[1]) ** 2, out=best)
        area = shapely.Polygon(corners)
        shapely.prepare(area)
        self.table = np.where(shapely.contains_xy(area, q, z), 1.0, -1.0) * np.sqrt(best)

    def __call__(self, q: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Interpolate the distance."""
        at = np.stack([(q - self.low[0]) / self.step, (z - self.low[1]) / self.step])
        return map_coordinates(self.table, at, order=1, mode="nearest", prefilter=False)


@dataclass(frozen=True)
class Bar:
    """A cylinder from `a` to `b` in the frame of the scene."""

    a: np.ndarray
    b: np.ndarray
    radius: float
    kind: int = BAR

    def ball(self) -> tuple[np.ndarray, float]:
        """Give the centre and the radius of a sphere around it."""
        return (self.a + self.b) / 2, float(np.linalg.norm(self.b - self.a)) / 2 + self.radius

    def hit(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Give the range (inf if it misses), the cosine, and the range where the ray grazes the bar's skin."""
        axis = self.b - self.a
        length = np.linalg.norm(axis)
        w = axis / length
        rel = o - self.a
        dw, rw = d @ w, rel @ w
        a = np.maximum(1.0 - dw**2, 1e-9)
        b = np.sum(d * rel, axis=-1) - dw * rw
        c = np.sum(rel * rel, axis=-1) - rw**2
        closest = c - b**2 / a
        root = np.sqrt(np.maximum(self.radius**2 - closest, 0.0) * a)
        t = (-b - root) / a
        inside = (rw + t * dw > 0.0) & (rw + t * dw < length) & (t > 0.02)
        miss = np.where(inside, np.sqrt(np.maximum(closest, 0.0)) - self.radius, np.inf)
        graze = np.where(np.abs(miss) < 0.0025, -b / a, np.inf)
        return np.where(miss < 0.0, t, np.inf), root / self.radius, graze


@dataclass(frozen=True)
class Stone:
    """An ellipsoid with its axes along the scene's axes."""

    centre: np.ndarray
    half: np.ndarray
    kind: int = STONE

    def ball(self) -> tuple[np.ndarray, float]:
        """Give the centre and the radius of a sphere around it."""
        return self.centre, float(self.half.max())

    def hit(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Give the range, the cosine, and no grazing range."""
        e, r = d / self.half, (o - self.centre) / self.half
        a, b, c = np.sum(e * e, -1), np.sum(e * r, -1), np.sum(r * r, -1) - 1.0
        disc = b * b - a * c
        t = np.where((disc > 0) & (-b > 0), (-b - np.sqrt(np.maximum(disc, 0.0))) / a, np.inf)
        n = (o + d * np.where(np.isfinite(t), t, 0.0)[..., None] - self.centre) / self.half**2
        cosine = np.abs(np.sum(n * d, -1)) / np.linalg.norm(n, axis=-1)
        return np.where(t > 0.02, t, np.inf), cosine, np.full(t.shape, np.inf)


def box(s0: float, s1: float, q0: float, q1: float, z0: float, z1: float) -> Field:
    """Give the signed distance of a box in chainage, offset and height; positive outside."""
    mid = np.array([s0 + s1, q0 + q1, z0 + z1]) / 2
    half = np.array([s1 - s0, q1 - q0, z1 - z0]) / 2

    def distance(s: np.ndarray, q: np.ndarray, z: np.ndarray) -> np.ndarray:
        e = np.abs(np.stack([s - mid[0], q - mid[1], z - mid[2]])) - half[:, None]
        return np.sqrt(np.sum(np.maximum(e, 0.0) ** 2, axis=0)) + np.minimum(e.max(axis=0), 0.0)

    return distance


def pipe(s: float, z: float, radius: float, q0: float, q1: float) -> Field:
    """Give the signed distance of a pipe across the axis; positive outside."""

    def distance(ss: np.ndarray, q: np.ndarray, zz: np.ndarray) -> np.ndarray:
        return np.maximum(np.hypot(ss - s, zz - z) - radius, np.abs(q - (q0 + q1) / 2) - abs(q1 - q0) / 2)

    return distance


@dataclass
class Canal:
    """All that a ray can hit, in the frame of the scene (z is the true height)."""

    course: Course
    length: float
    profile: Profile
    relief: Field
    solids: list[Field] = field(default_factory=list)
    voids: list[Field] = field(default_factory=list)
    bodies: list[Bar | Stone] = field(default_factory=list)

    def distance(self, p: np.ndarray) -> np.ndarray:
        """Give the signed distance of the shell with its relief; positive in the free space."""
        s, q = self.course.to_curve(p[:, 0], p[:, 1])
        z = p[:, 2]
        d = self.profile(q, z)
        for void in self.voids:
            d = np.maximum(d, -void(s, q, z))
        for solid in self.solids:
            d = np.minimum(d, solid(s, q, z))
        # Far from the shell its relief is not looked up, but no step may jump over it.
        near = d < 0.2
        d[~near] -= 0.15
        near = np.flatnonzero(near)
        d[near] -= self.relief(s[near], q[near], z[near])
        return d

    def march(self, o: np.ndarray, d: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Trace rays to the shell. Give the range (inf if there is none) and the cosine."""
        n = len(d)
        o = np.broadcast_to(o, d.shape)
        t, out, cosine = np.full(n, 0.05), np.full(n, np.inf), np.ones(n)
        live = np.arange(n)
        for turn in range(160):
            if not live.size:
                break
            p = o[live] + d[live] * t[live, None]
            f = self.distance(p)
            s = self.course.to_curve(p[:, 0], p[:, 1])[0]
            ended = (s < 0.0) | (s > self.length) | (t[live] > reach)
            # A ray that has gone through a bump steps back, but not for ever.
            hit = (f < 0.001) & ((f > -0.001) | (turn > 70)) & ~ended
            if hit.any():
                w = live[hit]
                slope = np.clip((self.distance(p[hit] - 0.006 * d[w]) - f[hit]) / 0.006, 0.06, 1.0)
                out[w] = t[w] + np.clip(f[hit] / slope, -0.02, 0.02)
                cosine[w] = slope
            go = ~hit & ~ended
            live = live[go]
            t[live] += 0.93 * f[go]
        return out, cosine

    def trace(self, o: np.ndarray, d: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Trace rays to everything. Give range, cosine, kind, and the range of an edge that they graze."""
        t, cosine = self.march(o, d, reach)
        kind = np.where(np.isfinite(t), WALL, 0)
        graze = np.full(len(d), np.inf)
        for body in self.bodies:
            centre, size = body.ball()
            v = centre - o
            if v.ndim == 1:
                far = max(float(np.linalg.norm(v)), 1e-6)
                limit = np.cos(np.arcsin(min(size / far, 1.0))) if far > size else -1.0
                near = np.flatnonzero(d @ (v / far) >= limit - 1e-4)
                start = o
            else:
                along = np.sum(v * d, -1)
                near = np.flatnonzero(np.sum(v * v, -1) - along**2 < size**2)
                start = o[near]
            if not near.size:
                continue
            tb, cb, edge = body.hit(start, d[near])
            graze[near] = np.minimum(graze[near], edge)
            better = tb < t[near]
            w = near[better]
            t[w], cosine[w], kind[w] = tb[better], np.clip(cb[better], 0.0, 1.0), body.kind
        far = t > reach
        t[far], kind[far] = np.inf, 0
        return t, cosine, kind, graze
