"""Canals as signed distances: walls, vault, bed, towpath and boat; ladders and legs as round bars.

Everything is in a local frame: x roughly along the canal, y to the left, z the height. Canal coordinates are s (along the
axis), n (to the left of it) and z.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

Array = np.ndarray


@dataclass
class Raster:
    """A raster over two coordinates, read bilinearly."""

    values: Array
    first: tuple[float, float]
    step: tuple[float, float]

    def __call__(self, a: Array, b: Array) -> Array:
        at = np.empty((2, a.size), np.float32)
        at[0] = (a - self.first[0]) / self.step[0]
        at[1] = (b - self.first[1]) / self.step[1]
        return map_coordinates(self.values, at, order=1, mode="nearest", prefilter=False)

    def nodes(self) -> tuple[Array, Array]:
        a = self.first[0] + self.step[0] * np.arange(self.values.shape[0])
        b = self.first[1] + self.step[1] * np.arange(self.values.shape[1])
        return a[:, None], b[None, :]


def relief(
    rng: np.random.Generator,
    a: tuple[float, float],
    b: tuple[float, float],
    step: tuple[float, float],
    parts: list[tuple[float, float, float]],
) -> Raster:
    """A raster of noise: each part is (sigma, correlation length along a, along b), in m; length 0 is white."""
    shape = (int((a[1] - a[0]) / step[0]) + 2, int((b[1] - b[0]) / step[1]) + 2)
    total = np.zeros(shape)
    for sigma, long_a, long_b in parts:
        noise = gaussian_filter(rng.normal(size=shape), (long_a / step[0], long_b / step[1]), mode="nearest")
        total += sigma * noise / max(float(noise.std()), 1e-12)
    return Raster(total.astype(np.float32), (a[0], b[0]), step)


@dataclass
class Axis:
    """Straight up to ``start``, then an arc to the left of ``length`` with ``radius``, then straight again."""

    start: float = 1e9
    length: float = 0.0
    radius: float = 0.0

    def to_canal(self, x: Array, y: Array) -> tuple[Array, Array]:
        if not self.length:
            return x, y
        dx, dy = x - self.start, self.radius - y
        theta = np.arctan2(dx, dy)
        end = self.length / self.radius
        c, k = np.cos(end), np.sin(end)
        ex, ey = dx - self.radius * k, y - self.radius * (1 - c)
        s = np.where(
            theta < 0, x, np.where(theta > end, self.start + self.length + ex * c + ey * k, self.start + self.radius * theta)
        )
        n = np.where(theta < 0, y, np.where(theta > end, -ex * k + ey * c, self.radius - np.hypot(dx, dy)))
        return s, n

    def to_local(self, s: Array, n: Array) -> tuple[Array, Array]:
        s, n = np.broadcast_arrays(np.asarray(s, float), np.asarray(n, float))
        if not self.length:
            return s.copy(), n.copy()
        end = self.length / self.radius
        theta = np.clip((s - self.start) / self.radius, 0, end)
        rest = np.where(s < self.start, s - self.start, np.maximum(s - self.start - self.length, 0))
        c, k = np.cos(theta), np.sin(theta)
        x = self.start + self.radius * k + rest * c - n * k
        y = self.radius * (1 - c) + rest * k + n * c
        return x, y

    def heading(self, s: float) -> float:
        return float(np.clip((s - self.start) / self.radius, 0, self.length / self.radius)) if self.length else 0.0


@dataclass
class Wall:
    """One side: distance from the axis at the water, in plan, and its profile below and above the water."""

    plan: tuple[Array, Array]  # s and distance from the axis at the water
    profile: tuple[Array, Array]  # height above the water and how much further out the wall is
    rough: Raster  # over s and z; positive is further out

    def out(self, s: Array, z: Array, water: float) -> Array:
        return np.interp(s, *self.plan) + np.interp(z - water, *self.profile) + self.rough(s, z)


@dataclass
class Towpath:
    """A masonry path on the right bank, on piers with segmental arches between them, open to the water behind."""

    front: float  # distance of the front face from the axis
    top: float
    centres: Array  # of the openings
    half: Array  # half spans of the openings
    crown: float
    rise: float
    rough: Raster

    def solid(self, s: Array, n: Array, z: Array) -> Array:
        pick = np.clip(np.searchsorted((self.centres[1:] + self.centres[:-1]) / 2, s), 0, len(self.centres) - 1)
        u, half = s - self.centres[pick], self.half[pick]
        radius = (half**2 + self.rise**2) / (2 * self.rise)
        up = z - (self.crown - radius)
        opening = np.maximum(np.abs(u) - half, np.where(up > 0, np.hypot(u, up) - radius, -9.0))
        box = np.maximum(n + self.front + self.rough(s, z), z - self.top)
        return np.maximum(box, -opening)


@dataclass
class Boat:
    """An open hull: the shell of an ellipsoid, cut at the gunwale, with thwarts; turned and heeled."""

    place: Array
    turn: Array  # rotation from the boat's axes to the local frame
    size: tuple[float, float, float]  # half length, half breadth, depth
    shell: float = 0.03
    solid_fill: bool = False

    def __call__(self, p: Array) -> Array:
        q = (p - self.place) @ self.turn
        far = np.sqrt((q**2).sum(1)) - 1.15 * max(self.size)
        near = far < 0.3
        if near.any():
            q = q[near]
            size = np.asarray(self.size)
            k0 = np.sqrt(((q / size) ** 2).sum(1))
            k1 = np.sqrt(((q / size**2) ** 2).sum(1)) + 1e-9
            hull = k0 * (k0 - 1) / k1
            body = np.maximum(hull if self.solid_fill else np.abs(hull) - self.shell, q[:, 2])
            for x in (-0.35, 0.25):
                plank = np.maximum(np.maximum(np.abs(q[:, 0] - x * size[0]) - 0.11, np.abs(q[:, 2] + 0.12) - 0.02), hull)
                body = np.minimum(body, plank)
            far[near] = body
        return far


@dataclass
class Bars:
    """Round bars from ``a`` to ``b``."""

    a: Array
    b: Array
    radius: Array

    def cast(self, origin: Array, d: Array) -> tuple[Array, Array]:
        """The distance along each ray to the first bar (inf where there is none), and cosine of incidence."""
        best, cosine = np.full(len(d), np.inf), np.zeros(len(d))
        middle = (np.vstack([self.a, self.b]).max(0) + np.vstack([self.a, self.b]).min(0)) / 2
        ball = np.linalg.norm(np.vstack([self.a, self.b]) - middle, axis=1).max() + self.radius.max()
        to = middle - origin
        along = (d * to).sum(1)
        use = np.flatnonzero(((to**2).sum(-1) - along**2 < ball**2) & (along > -ball))
        if not use.size:
            return best, cosine
        d, o = d[use], np.broadcast_to(origin, (len(best), 3))[use]
        t_best, c_best = best[use], cosine[use]
        for a, b, r in zip(self.a, self.b, self.radius, strict=True):
            length = np.linalg.norm(b - a)
            axis = (b - a) / length
            da = d @ axis
            w = o - a
            wa = w @ axis
            across, ww = d - da[:, None] * axis, w - wa[:, None] * axis
            qa, qb, qc = (across**2).sum(1) + 1e-12, (across * ww).sum(1), (ww**2).sum(1) - r * r
            disc = qb**2 - qa * qc
            t = (-qb - np.sqrt(np.maximum(disc, 0))) / qa
            on = wa + t * da
            ok = (disc > 0) & (t > 0.02) & (on > 0) & (on < length) & (t < t_best)
            t_best[ok] = t[ok]
            c_best[ok] = np.sqrt(disc[ok]) / r
        best[use], cosine[use] = t_best, np.minimum(c_best, 1)
        return best, cosine


@dataclass
class Ladder:
    """Two stiles and rungs; ``foot`` is the middle of its foot, ``up`` and ``side`` its unit vectors."""

    foot: Array
    up: Array
    side: Array
    length: float
    heights: Array  # of the rungs, along the ladder
    gap: float
    rung: float  # diameters
    stile: float
    sag: Array  # how far the middle of each rung is bent down
    steel: bool = True

    def bars(self) -> Bars:
        a, b, r = [], [], []
        for sign in (-0.5, 0.5):
            a.append(self.foot + sign * self.gap * self.side)
            b.append(a[-1] + self.length * self.up)
            r.append(self.stile / 2)
        for height, sag in zip(self.heights, self.sag, strict=True):
            left = self.foot - 0.5 * self.gap * self.side + height * self.up
            right = left + self.gap * self.side
            middle = (left + right) / 2 - sag * self.up
            a += [left, middle]
            b += [middle, right]
            r += [self.rung / 2] * 2
        return Bars(np.array(a), np.array(b), np.array(r))


def make_ladder(
    axis: Axis,
    s: float,
    n: float,
    z_foot: float,
    length: float,
    lean: float,
    slant: float,
    spacing: float,
    sigma: float,
    rng: np.random.Generator,
    missing: int | None = None,
    bent: int | None = None,
    **kind: float | bool,
) -> Ladder:
    """A ladder at a wall of either side; it leans towards the wall by ``lean`` and along it by ``slant`` degrees."""
    x, y = axis.to_local(s, n)
    h = axis.heading(s)
    along, left = np.array([np.cos(h), np.sin(h), 0]), np.array([-np.sin(h), np.cos(h), 0])
    out = np.sign(n) * left
    up = np.array([0, 0, 1.0]) + np.tan(np.radians(lean)) * out + np.tan(np.radians(slant)) * along
    up /= np.linalg.norm(up)
    side = along - (along @ up) * up
    side /= np.linalg.norm(side)
    count = int((length - 0.25) / spacing)
    heights = 0.22 + spacing * np.arange(count) + rng.normal(0, sigma, count)
    sag = np.abs(rng.normal(0, 0.003, count))
    if bent is not None:
        sag[bent] = 0.06
    if missing is not None:
        heights, sag = np.delete(heights, missing), np.delete(sag, missing)
    return Ladder(np.array([float(x), float(y), z_foot]), up, side, length, heights, sag=sag, **kind)


@dataclass
class Canal:
    """All surfaces of a scene."""

    axis: Axis
    length: float
    water: float
    left: Wall
    right: Wall
    bed: Raster
    spring: float  # height of the springing above the water
    rise: float
    vault_rough: Raster
    top: float = 6.0  # outside the portals: height of the walls above the water
    towpath: Towpath | None = None
    sunk: list[Boat] = field(default_factory=list)
    afloat: list[Boat] = field(default_factory=list)  # only at the time of the laser scan
    ladders: list[Ladder] = field(default_factory=list)
    ropes: list[Bars] = field(default_factory=list)  # only at the time of the laser scan
    caution: float = 0.85  # share of the distance that is marched
    shine: float = 1.0  # exponent of the cosine of incidence in a sonar echo

    def sdf(self, laser: bool = False) -> Callable[[Array], Array]:
        """The distance to the nearest surface, as a function of points; negative inside of matter.

        The laser does not meet the bed, and the sonar does not meet the vault.
        """
        water, length = self.water, self.length

        def distance(p: Array) -> Array:
            s, n = self.axis.to_canal(p[:, 0], p[:, 1])
            z = p[:, 2]
            left, right = self.left.out(s, z, water), self.right.out(s, z, water)
            f = np.minimum(left - n, right + n)
            if not laser:
                f = np.minimum(f, z - self.bed(s, n))
            else:
                f = np.minimum(f, vault(s, n, z))
            if self.towpath is not None:
                path = n + self.towpath.front - 0.06
                near = path < 0.3
                path[near] = self.towpath.solid(s[near], n[near], z[near])
                f = np.minimum(f, path)
            f = f * self.caution
            for boat in self.afloat if laser else self.sunk:
                f = np.minimum(f, boat(p))
            return f

        def vault(s: Array, n: Array, z: Array) -> Array:
            up = z - (water + self.spring)
            a_left = np.interp(s, *self.left.plan) + np.interp(self.spring, *self.left.profile)
            a_right = np.interp(s, *self.right.plan) + np.interp(self.spring, *self.right.profile)
            a = (a_left + a_right) / 2
            k = np.hypot((n - (a_left - a_right) / 2) / a, np.maximum(up, 0) / self.rise)
            inner = (1 - k) * np.minimum(a, self.rise) + np.maximum(-up, 0) + 0.02 + self.vault_rough(s, n)
            return np.maximum(inner, np.maximum(-s, s - length))

        return distance


def march(
    distance: Callable[[Array], Array],
    origin: Array,
    d: Array,
    t0: Array | float,
    t_max: Array | float,
    cone: float = 0.0,
    eps: float = 2e-4,
    steps: int = 160,
) -> Array:
    """Sphere tracing. The distance along each ray; inf where nothing is met before ``t_max``.

    With ``cone``, the tangent of half an angle, a ray stops where the surface comes near the cone.
    """
    t = np.broadcast_to(np.asarray(t0, float), (len(d),)).copy()
    out = np.full(len(d), np.inf)
    t_max = np.broadcast_to(np.asarray(t_max, float), (len(d),))
    live = np.flatnonzero(t < t_max)
    many = origin.ndim == 2
    f = np.zeros(0)
    for _ in range(steps):
        if not live.size:
            break
        f = distance((origin[live] if many else origin) + t[live, None] * d[live])
        done = f < eps + cone * t[live]
        if not cone:
            done &= f > -4 * eps
        out[live[done]] = t[live[done]]
        t[live] += np.where(done, 0, f)
        keep = ~done & (t[live] < t_max[live])
        live, f = live[keep], f[keep]
    if live.size:
        near = live[np.abs(f) < 0.01]
        out[near] = t[near]
    if cone:
        far = live[f >= 0.01] if live.size else live
        out[far] = t[far]
    return out


def slope(distance: Callable[[Array], Array], p: Array, h: float = 0.01) -> Array:
    """The unit normals at points, into the free space."""
    g = np.stack([distance(p + h * e) - distance(p - h * e) for e in np.eye(3)], 1)
    return g / (np.linalg.norm(g, axis=1, keepdims=True) + 1e-12)
