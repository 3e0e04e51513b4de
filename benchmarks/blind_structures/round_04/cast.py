"""Faces and tubes of a structure, their materials and marks, and rays against them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

Plane = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Noise:
    """A smooth random field on a plane that repeats, of zero mean and unit deviation."""

    def __init__(self, seed: int, cell: float, smooth: float = 1.3, size: int = 192) -> None:
        """Draw the field."""
        values = gaussian_filter(np.random.default_rng(seed).normal(size=(size, size)), smooth, mode="wrap")
        self.values, self.cell = (values - values.mean()) / values.std(), cell

    def __call__(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Look up the field at coordinates in metres."""
        return map_coordinates(self.values, np.stack([u, v]) / self.cell, order=1, mode="grid-wrap", prefilter=False)


@dataclass(frozen=True)
class Material:
    """Reflection of a surface.

    `db` is ten times the logarithm of its reflectance. The echo falls with `cosine ** power`.
    A lobe of `lobe` times the diffuse part, `width` degrees wide, stands around 0 degrees.
    `grain` and `broad` are deviations in dB of fine and of wide texture.
    """

    db: float
    power: float = 1.0
    lobe: float = 0.0
    width: float = 10.0
    grain: float = 0.15
    broad: float = 0.2
    cell: float = 0.02

    def angle(self, cosine: np.ndarray, lobe: np.ndarray | float = 0.0) -> np.ndarray:
        """Give the part of the echo that depends on incidence, in dB; `lobe` adds to the material's own."""
        degrees = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
        peak = np.maximum(self.lobe + lobe, 0.0) * np.exp(-((degrees / self.width) ** 2))
        return 10.0 * np.log10(np.clip(cosine, 0.01, 1.0) ** self.power + peak)


@dataclass
class Mark:
    """An anomaly on one side of a face or tube: a weight from 0 to 1 in its coordinates, and a contrast."""

    kind: str
    db: float
    weight: Plane
    side: int = 1
    lobe: float = 0.0
    limit: str = ""
    number: int = 0


def _frame(w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give two directions across an axis; the second lies upwards as far as it can."""
    ref = np.array([0.0, 0.0, 1.0]) if abs(w[2]) < 0.95 else np.array([1.0, 0.0, 0.0])
    a = np.cross(ref, w)
    a /= np.linalg.norm(a)
    return a, np.cross(w, a)


@dataclass(eq=False)
class Body:
    """Properties of faces and tubes. A body that is not `smooth` has no surface number."""

    material: Material
    smooth: bool = True
    marks: list[Mark] = field(default_factory=list)
    design: Plane | None = None
    front: int = 0
    back: int = 0
    seed: int = 0


@dataclass(eq=False)
class Face(Body):
    """A rectangle around `centre`, seen from both sides. `mask` says where there is material."""

    centre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    along: np.ndarray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    over: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    half: tuple[float, float] = (0.5, 0.5)
    mask: Plane | None = None

    def ball(self) -> tuple[np.ndarray, float]:
        """Give the centre and the radius of a sphere around it."""
        return self.centre, float(np.hypot(*self.half))

    def hit(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, ...]:
        """Give range, cosine, side, and the two coordinates."""
        n = np.cross(self.along, self.over)
        dn = d @ n
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((self.centre - o) @ n) / dn
            rel = o - self.centre
            u, v = rel @ self.along + t * (d @ self.along), rel @ self.over + t * (d @ self.over)
            good = (t > 0.05) & (np.abs(u) < self.half[0]) & (np.abs(v) < self.half[1])
        if self.mask is not None:
            w = np.flatnonzero(good)
            good[w] = self.mask(u[w], v[w])
        return np.where(good, t, np.inf), np.abs(dn), np.where(dn < 0, 1, -1), u, v


@dataclass(eq=False)
class Tube(Body):
    """A cylinder from `a` to `b`. Its coordinates are an arc and the length from `a`.

    The arc is zero on the upper side, or, where the cylinder is upright, on the side that faces -y; it grows towards +x there.
    """

    a: np.ndarray = field(default_factory=lambda: np.zeros(3))
    b: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    radius: float = 0.1

    def ball(self) -> tuple[np.ndarray, float]:
        """Give the centre and the radius of a sphere around it."""
        return (self.a + self.b) / 2, float(np.hypot(np.linalg.norm(self.b - self.a) / 2, self.radius))

    def hit(self, o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, ...]:
        """Give range, cosine, side, and the two coordinates. Both the outside and the inside can be seen."""
        axis = self.b - self.a
        length = float(np.linalg.norm(axis))
        w = axis / length
        rel = o - self.a
        dw, rw = d @ w, float(rel @ w)
        a = np.maximum(1.0 - dw**2, 1e-9)
        b = d @ rel - dw * rw
        disc = b**2 - a * (float(rel @ rel) - rw**2 - self.radius**2)
        root = np.sqrt(np.maximum(disc, 0.0))
        t, side = np.full(len(d), np.inf), np.ones(len(d), int)
        for k in (1, -1):
            tk = (-b - k * root) / a
            v = rw + tk * dw
            good = (disc > 0) & (tk > 0.05) & (v > 0) & (v < length) & (tk < t)
            t[good], side[good] = tk[good], k
        p = rel + d * np.where(np.isfinite(t), t, 0.0)[:, None]
        e, f = _frame(w)
        north = f if abs(w[2]) < 0.95 else np.array([0.0, -1.0, 0.0])
        if abs(w[2]) >= 0.95:
            e = np.cross(w, north)
        turn = np.arctan2(p @ e, p @ north)
        return t, np.sqrt(np.maximum(disc, 0.0)) / self.radius, side, turn * self.radius, p @ w


@dataclass
class Hits:
    """Hits of rays: range, cosine, number of the body (-1 for none), side, and coordinates."""

    t: np.ndarray
    cosine: np.ndarray
    body: np.ndarray
    side: np.ndarray
    u: np.ndarray
    v: np.ndarray


def cast(bodies: list[Body], o: np.ndarray, d: np.ndarray, azimuth: np.ndarray) -> Hits:
    """Trace rays from one place to the nearest body. The rays' azimuths, to 2 mrad, are in growing order."""
    n = len(d)
    out = Hits(np.full(n, np.inf), np.ones(n), np.full(n, -1), np.ones(n, int), np.zeros(n), np.zeros(n))
    d32 = d.astype(np.float32)
    middle = (azimuth[0] + azimuth[-1]) / 2
    for i, body in enumerate(bodies):
        centre, size = body.ball()
        to = centre - o
        far = float(np.linalg.norm(to))
        flat = float(np.hypot(to[0], to[1]))
        low, high = 0, n
        if flat > size:
            mid = (np.arctan2(to[1], to[0]) - middle + np.pi) % (2 * np.pi) - np.pi + middle
            half = np.arcsin(size / flat) + 0.004
            low, high = np.searchsorted(azimuth, (mid - half, mid + half))
        near = np.arange(low, high)
        if far > size and near.size:
            near = near[d32[low:high] @ (to / far).astype(np.float32) > np.cos(np.arcsin(size / far)) - 2e-6]
        if not near.size:
            continue
        t, cosine, side, u, v = body.hit(o, d[near])
        better = t < out.t[near]
        w = near[better]
        out.t[w], out.cosine[w], out.body[w] = t[better], cosine[better], i
        out.side[w], out.u[w], out.v[w] = side[better], u[better], v[better]
    return out


def blob(u: float, v: float, ru: float, rv: float, seed: int, ragged: float = 0.35, soft: float = 0.12) -> Plane:
    """Give the weight of a patch around (u, v) with a ragged and soft edge."""
    noise = Noise(seed, max(min(ru, rv), 0.03) * 0.28)

    def weight(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.clip((1.0 - np.hypot((x - u) / ru, (y - v) / rv) + ragged * noise(x, y)) / soft + 0.5, 0.0, 1.0)

    return weight


def runs(u: float, top: float, wide: float, length: float, seed: int, columns: float = 0.05) -> Plane:
    """Give the weight of a stain that runs down from (u, top): columns of uneven length below a band."""
    noise, fine = Noise(seed, columns), Noise(seed + 1, 0.02)

    def weight(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        end = length * (0.62 + 0.28 * noise(x, np.full(x.shape, 7.3))) * np.sqrt(np.clip(1 - ((x - u) / wide) ** 2, 0.0, 1.0))
        inside = np.minimum(end - (top - y), top - y + 0.02)
        return np.clip(inside / 0.06 + 0.5 + 0.25 * fine(x, y), 0.0, 1.0) * (np.abs(x - u) < wide)

    return weight


def band(level: float, seed: int, wave: float = 0.06, soft: float = 0.04) -> Plane:
    """Give the weight of all that lies below an uneven level, as damp that rises."""
    noise = Noise(seed, 0.09)

    def weight(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.clip((level + wave * noise(x, np.full(x.shape, 3.1)) - y) / soft + 0.5, 0.0, 1.0)

    return weight
