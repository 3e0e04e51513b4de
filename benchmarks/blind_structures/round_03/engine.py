"""A small ray caster: rectangles and cylinders, materials, marks on their surfaces, and a scanner with a real beam."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

Array = np.ndarray
Shape = Callable[[Array, Array], Array]


# ---------------------------------------------------------------- random fields and shapes of marks


class Noise:
    """A smooth periodic random field with unit variance, looked up bilinearly; `scale` is its grain in metres."""

    def __init__(self, seed: int, scale: float, size: int = 192, grain: float = 3.0) -> None:
        a = gaussian_filter(np.random.default_rng(seed).standard_normal((size, size)), grain, mode="wrap")
        self.a = ((a - a.mean()) / a.std()).astype(np.float32)
        self.size, self.k = size, 2.0 * grain / scale

    def __call__(self, u: Array, v: Array) -> Array:
        x, y = np.asarray(u) * self.k, np.asarray(v) * self.k
        i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        fx, fy = x - i, y - j
        n = self.size
        i0, j0, i1, j1 = i % n, j % n, (i + 1) % n, (j + 1) % n
        a = self.a
        return (a[i0, j0] * (1 - fx) + a[i1, j0] * fx) * (1 - fy) + (a[i0, j1] * (1 - fx) + a[i1, j1] * fx) * fy


def _sig(x: Array) -> Array:
    return 1.0 / (1.0 + np.exp(-np.clip(4.0 * x, -30, 30)))


def blob(u0: float, v0: float, ru: float, rv: float, seed: int, rough: float = 0.3, soft: float = 0.12) -> Shape:
    """An irregular patch around (u0, v0) with half axes ru and rv."""
    big, small = Noise(seed, 1.2 * min(ru, rv)), Noise(seed + 1, 0.35 * min(ru, rv))

    def alpha(u: Array, v: Array) -> Array:
        d = np.hypot((u - u0) / ru, (v - v0) / rv)
        return _sig((1.0 - d + rough * big(u, v) + 0.4 * rough * small(u, v)) / soft) * (d < 2.2)

    return alpha


def run(
    u0: float, v0: float, length: float, width: float, seed: int, down: float = -1.0, taper: float = 0.5, wander: float = 0.25
) -> Shape:
    """A run of liquid from (u0, v0) along v; it wanders, tapers and frays out at its end."""
    w1, w2 = Noise(seed, 0.8), Noise(seed + 1, 0.25)

    def alpha(u: Array, v: Array) -> Array:
        s = (v - v0) * down / length
        c = u0 + wander * width * w1(v, 0 * v)
        half = 0.5 * width * (1 - taper * np.clip(s, 0, 1)) * (1 + 0.22 * w2(v, 0 * v))
        a = _sig((half - np.abs(u - c)) / (0.16 * width + 0.002))
        end = _sig((1.0 - s + 0.12 * w2(3 * u, 0.3 * v)) / 0.12)
        return a * end * _sig(s * length / 0.02) * (1 - 0.3 * np.clip(s, 0, 1))

    return alpha


def band(level: float, seed: int, ragged: float, scale: float = 0.8, u0: float = -1e9, u1: float = 1e9) -> Shape:
    """What rises from the foot up to a ragged level, between u0 and u1."""
    n1, n2 = Noise(seed, scale), Noise(seed + 1, 0.25 * scale)

    def alpha(u: Array, v: Array) -> Array:
        top = level + ragged * (n1(u, 0.3 * v) + 0.35 * n2(u, v))
        return _sig((top - v) / 0.06) * _sig((u - u0 + 0.12 * n2(v, u)) / 0.06) * _sig((u1 - u + 0.12 * n2(v, u)) / 0.06)

    return alpha


def patch(u0: float, v0: float, lu: float, lv: float, seed: int, turn: float = 0.0, brush: float = 0.008) -> Shape:
    """A rectangle with brushed edges, for repairs and stencils; u0, v0 is its centre, turn in degrees."""
    n = Noise(seed, 0.06)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def alpha(u: Array, v: Array) -> Array:
        x, y = c * (u - u0) + s * (v - v0), c * (v - v0) - s * (u - u0)
        d = np.minimum(lu / 2 - np.abs(x), lv / 2 - np.abs(y))
        return _sig((d + brush * n(u, v)) / 0.006)

    return alpha


def speckle(shape: Shape, seed: int, scale: float, cover: float = 0.0) -> Shape:
    """A shape broken up into islands; a larger `cover` leaves more of it."""
    n = Noise(seed, scale)
    return lambda u, v: shape(u, v) * _sig((cover + n(u, v)) / 0.5)


# ---------------------------------------------------------------- materials and surfaces


@dataclass(frozen=True)
class Material:
    """rho (cos^m + ks exp(-(t/w)^2)), t the incidence in degrees; texture of `tex` dB with a grain of `grain` m."""

    rho: float
    m: float = 1.0
    ks: float = 0.0
    w: float = 15.0
    tex: float = 0.3
    grain: float = 0.4

    def f(self, cos: Array) -> Array:
        out = self.rho * np.maximum(cos, 1e-3) ** self.m
        if self.ks:
            deg = np.degrees(np.arccos(np.clip(cos, 0, 1)))
            out = out + self.rho * self.ks * np.exp(-((deg / self.w) ** 2))
        return out


@dataclass
class Mark:
    """Something on a surface; kind "" belongs to the design. The effect is a gain in dB or another material."""

    kind: str
    alpha: Shape
    effect: float | Material
    limit: str = ""
    ident: int = 0


class Surface:
    """What rectangles and cylinders share."""

    sid = 0
    two_sided = False
    mask: Callable[[Array, Array], Array] | None = None
    height: Callable[[Array, Array], Array] | None = None
    gain: Callable[[Array, Array], Array] | None = None
    studs: Array | None = None  # rows of u, v, radius, height: bolts and rivets
    big = False

    def __init__(self, mat: Material) -> None:
        self.mat = mat
        self.marks: list[Mark] = []
        self.noise: Noise | None = None

    def facing(self, s: Array) -> bool:
        return True

    def design(self, alpha: Shape, effect: float | Material) -> None:
        """A stripe, a label, a weld seam: part of the design."""
        self.marks.append(Mark("", alpha, effect))


class Quad(Surface):
    """A rectangle: v runs from the start `o` along ev, u across it from -lu/2 to lu/2, n is the outward normal."""

    def __init__(
        self, o: Iterable[float], n: Iterable[float], ev: Iterable[float], lu: float, lv: float, mat: Material
    ) -> None:
        super().__init__(mat)
        self.o, self.n = np.array(o, float), unit(n)
        self.ev = unit(np.array(ev, float) - np.dot(ev, self.n) * self.n)
        self.eu = np.cross(self.ev, self.n)
        self.lu, self.lv = lu, lv

    def outline(self) -> Array:
        k = np.linspace(0, 1, 15)
        uv = np.concatenate([np.c_[k - 0.5, 0 * k], np.c_[k - 0.5, 0 * k + 1], np.c_[0 * k - 0.5, k], np.c_[0 * k + 0.5, k]])
        return self.o + uv[:, :1] * self.lu * self.eu + uv[:, 1:] * self.lv * self.ev

    def facing(self, s: Array) -> bool:
        return self.two_sided or float(np.dot(self.n, s - self.o)) > 1e-4

    def hit(self, s: Array, d: Array) -> Array:
        den = d @ self.n
        with np.errstate(divide="ignore", invalid="ignore"):
            t = float(np.dot(self.n, self.o - s)) / den
            q = s - self.o
            u = float(q @ self.eu) + t * (d @ self.eu)
            v = float(q @ self.ev) + t * (d @ self.ev)
            ok = (t > 0.3) & (np.abs(u) <= self.lu / 2) & (v >= 0) & (v <= self.lv)
        if self.mask is not None and ok.any():
            ok[ok] = self.mask(u[ok], v[ok])
        return np.where(ok, t, np.inf)

    def param(self, p: Array) -> tuple[Array, Array, Array]:
        q = p - self.o
        return q @ self.eu, q @ self.ev, np.broadcast_to(self.n, p.shape)


class Cylinder(Surface):
    """The outside (or inside) of a cylinder: u is the arc from `ref`, v runs along the axis; it may be corrugated."""

    def __init__(
        self,
        p0: Iterable[float],
        p1: Iterable[float],
        r: float,
        mat: Material,
        ref: Iterable[float] = (0, -1, 0),
        inside: bool = False,
        wave: float = 0.0,
        pitch: float = 0.1,
    ) -> None:
        super().__init__(mat)
        self.p0, a = np.array(p0, float), np.array(p1, float) - np.array(p0, float)
        self.lv, self.ax, self.r = float(np.linalg.norm(a)), unit(a), r
        ref_ = np.array(ref, float) - np.dot(ref, self.ax) * self.ax
        if np.linalg.norm(ref_) < 1e-6:
            ref_ = np.cross(self.ax, [0.31, 0.2, 0.93])
        self.e1 = unit(ref_)
        self.e2 = np.cross(self.ax, self.e1)
        self.inside, self.wave, self.pitch = inside, wave, pitch

    def outline(self) -> Array:
        a = np.linspace(0, 2 * math.pi, 17)[:-1]
        ring = 1.05 * (self.r + self.wave) * (np.cos(a)[:, None] * self.e1 + np.sin(a)[:, None] * self.e2)
        return np.concatenate([self.p0 + ring + k * self.lv * self.ax for k in np.linspace(0, 1, 7)])

    def hit(self, s: Array, d: Array) -> Array:
        q = s - self.p0
        da, qa = d @ self.ax, float(q @ self.ax)
        d1, d2, q1, q2 = d @ self.e1, d @ self.e2, float(q @ self.e1), float(q @ self.e2)
        r = self.r + self.wave
        a, b, c = d1 * d1 + d2 * d2, q1 * d1 + q2 * d2, q1 * q1 + q2 * q2 - r * r
        disc = b * b - a * c
        ok = disc > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(np.where(ok, disc, 0.0))
            t = (-b + (root if self.inside else -root)) / np.maximum(a, 1e-12)
        if self.wave and ok.any():
            slope = math.hypot(1, 2 * math.pi * self.wave / self.pitch)
            tt, dd1, dd2, dda = t[ok], d1[ok], d2[ok], da[ok]
            gap = tt
            for _ in range(30):
                z = qa + tt * dda
                gap = np.hypot(q1 + tt * dd1, q2 + tt * dd2) - self.r - self.wave * np.sin(2 * math.pi * z / self.pitch)
                tt = tt + gap / slope
            t = t.copy()
            t[ok] = np.where(np.abs(gap) < 2e-4, tt, np.inf)
        with np.errstate(invalid="ignore"):
            v = qa + t * da
            ok &= (t > 0.3) & np.isfinite(t) & (v >= 0) & (v <= self.lv)
        if self.mask is not None and ok.any():
            x, y = q1 + t[ok] * d1[ok], q2 + t[ok] * d2[ok]
            ok[ok] = self.mask(self.r * np.arctan2(y, x), v[ok])
        return np.where(ok, t, np.inf)

    def param(self, p: Array) -> tuple[Array, Array, Array]:
        q = p - self.p0
        x, y, v = q @ self.e1, q @ self.e2, q @ self.ax
        phi = np.arctan2(y, x)
        n = np.cos(phi)[..., None] * self.e1 + np.sin(phi)[..., None] * self.e2
        if self.wave:
            k = 2 * math.pi / self.pitch
            n = n - (self.wave * k * np.cos(k * v))[..., None] * self.ax
            n = n / np.linalg.norm(n, axis=-1, keepdims=True)
        return self.r * phi, v, -n if self.inside else n


def unit(a: Iterable[float]) -> Array:
    a = np.array(a, float)
    return a / np.linalg.norm(a)


class World:
    """The surfaces of a scene, numbered from 1."""

    def __init__(self, seed: int) -> None:
        self.items: list[Surface] = []
        self.count = 0
        self.marks: list[Mark] = []
        self.rng = np.random.default_rng(seed)
        self.pool = [(g, Noise(seed * 7 + i, g)) for i, g in enumerate((0.02, 0.05, 0.12, 0.4, 1.2))]

    def add(self, s, smooth: bool = True):
        if smooth:
            self.count += 1
            s.sid = self.count
        s.noise = min(self.pool, key=lambda g: abs(math.log(g[0] / s.mat.grain)))[1]
        s.shift = self.rng.uniform(0, 50, 2)
        s.tone = float(self.rng.normal(0, 0.15))
        self.items.append(s)
        return s

    def anomaly(self, s: Surface, kind: str, alpha: Shape, effect: float | Material, limit: str = "") -> None:
        m = Mark(kind, alpha, effect, limit, len(self.marks) + 1)
        self.marks.append(m)
        s.marks.append(m)

    def quad(self, *a, smooth: bool = True, **k) -> Quad:
        return self.add(Quad(*a, **k), smooth)

    def cyl(self, *a, smooth: bool = True, **k) -> Cylinder:
        return self.add(Cylinder(*a, **k), smooth)

    def box(
        self,
        p0: Iterable[float],
        p1: Iterable[float],
        width: float,
        height: float,
        mat: Material,
        up: Iterable[float] = (0, 0, 1),
        caps: bool = True,
    ) -> dict[str, Quad]:
        """A bar from p0 to p1 with faces "+2", "-2" (sides), "+3", "-3" (top, bottom) and the caps "+1", "-1"."""
        p0, p1 = np.array(p0, float), np.array(p1, float)
        e1 = unit(p1 - p0)
        if abs(np.dot(up, e1)) > 0.999 * np.linalg.norm(up):
            up = (0, 1, 0)
        e3 = unit(np.array(up, float) - np.dot(up, e1) * e1)
        e2, length = np.cross(e3, e1), float(np.linalg.norm(p1 - p0))
        f = {}
        for k in (1, -1):
            f[f"{2 * k:+d}"] = self.quad(p0 + k * width / 2 * e2, k * e2, e1, height, length, mat)
            f[f"{3 * k:+d}"] = self.quad(p0 + k * height / 2 * e3, k * e3, e1, width, length, mat)
            if caps:
                f[f"{k:+d}"] = self.quad((p1 if k > 0 else p0) - height / 2 * e3, k * e1, e3, width, height, mat)
        return f

    def channel(
        self,
        p0: Iterable[float],
        p1: Iterable[float],
        h: float,
        b: float,
        t: float,
        mat: Material,
        side: Iterable[float],
        caps: bool = True,
    ) -> dict[str, dict[str, Quad]]:
        """A U section: web in the plane across `side`, flanges towards `side`; the key "web" has its back at "-2"."""
        p0, p1 = np.array(p0, float), np.array(p1, float)
        e1 = unit(p1 - p0)
        e2 = unit(np.array(side, float) - np.dot(side, e1) * e1)
        e3 = np.cross(e1, e2)
        out = {"web": self.box(p0 + t / 2 * e2, p1 + t / 2 * e2, t, h, mat, e3, caps)}
        for key, k in (("top", 1), ("low", -1)):
            off = (t + (b - t) / 2) * e2 + k * (h - t) / 2 * e3
            out[key] = self.box(p0 + off, p1 + off, b - t, t, mat, e3, caps)
        return out

    def disc(self, c: Iterable[float], n: Iterable[float], r: float, mat: Material, r0: float = 0.0) -> Quad:
        """A flat ring or disc."""
        n = unit(n)
        ev = np.array((0, 0, 1.0)) if abs(n[2]) < 0.9 else np.array((0, 1.0, 0))
        ev = unit(ev - np.dot(ev, n) * n)
        q = self.quad(np.array(c, float) - r * ev, n, ev, 2 * r, 2 * r, mat)
        q.mask = lambda u, v: (np.hypot(u, v - r) <= r) & (np.hypot(u, v - r) >= r0)
        return q

    def leaves(
        self,
        n: int,
        draw: Callable[[np.random.Generator], Array],
        size: tuple[float, float],
        mat: Material,
        slender: float = 0.55,
        upright: bool = False,
    ) -> None:
        """Leaves, or blades where upright, at places that `draw` gives."""
        for _ in range(n):
            p, s = draw(self.rng), self.rng.uniform(*size)
            nrm = self.rng.standard_normal(3)
            ev = self.rng.standard_normal(3)
            if upright:
                nrm[2] *= 0.15
                ev = np.array([0, 0, 1.0]) + 0.35 * self.rng.standard_normal(3)
            m = Material(mat.rho * self.rng.uniform(0.6, 1.15), 0.6, tex=0)
            q = Quad(p, nrm, ev, s * slender, s, m)
            q.two_sided = True
            q.mask = lambda u, v, s=s, k=slender: (2 * u / (s * k)) ** 2 + (2 * v / s - 1) ** 2 <= 1
            self.add(q, False)


# ---------------------------------------------------------------- the scanner


@dataclass
class Scanner:
    """An instrument: beam in mrad (full), noise in m and dB, constant and near field of its amplitude, threshold."""

    beam: float = 0.35
    sigma: float = 0.0015
    noise: float = 0.5
    const: float = 30.0
    near: float = 2.5
    fall: float = 20.0
    floor: float = 2.0
    split: float = 0.4
    false: float = 0.001
    drift: float = 0.15
    wiggle: float = 0.0

    def far(self, r: Array) -> Array:
        """F(range) in dB."""
        out = -self.fall * np.log10(r / 10.0) + 10 * np.log10(1 - np.exp(-((r / self.near) ** 2)) * 0.97)
        return out + self.wiggle * np.sin(2 * math.pi * r / 1.7)


@dataclass
class View:
    """A station: place, window of azimuth (mathematical, degrees) and elevation, and step."""

    at: tuple[float, float, float]
    az: tuple[float, float]
    el: tuple[float, float]
    step: float
    offset: float = 0.0


Rows = dict[str, list[Array]]
SUB = [(0.0, 0.0)] + [(math.cos(a), math.sin(a)) for a in np.arange(6) * math.pi / 3]
WEIGHT = np.array([0.34] + [0.11] * 6)


def _shade(item: Surface, p: Array, d: Array) -> dict[str, Array]:
    """Reflection of an item at points p under rays d, with and without its anomalies."""
    u, v, n = item.param(p)
    cos = np.abs(np.einsum("ij,ij->i", n, d))
    base = item.mat.f(cos) * 10 ** (0.1 * item.tone)
    if item.mat.tex:
        base = base * 10 ** (0.1 * item.mat.tex * item.noise(u + item.shift[0], v + item.shift[1]))
    if item.gain is not None:
        base = base * 10 ** (0.1 * item.gain(u, v))
    full, ident = base, np.zeros(len(u), np.int32)
    for m in item.marks:
        a = m.alpha(u, v)
        if isinstance(m.effect, Material):
            rough = m.effect.tex * item.noise(v * 1.7 + 9, u * 1.7 + 4)
            other = m.effect.f(cos) * 10 ** (0.1 * rough)
        else:
            other = full * 10 ** (0.1 * m.effect)
        full = (1 - a) * full + a * other
        if m.kind:
            ident[a > 0.4] = m.ident
        else:
            base = (1 - a) * base + a * (m.effect.f(cos) if isinstance(m.effect, Material) else base * 10 ** (0.1 * m.effect))
    out = {"cos": cos, "f": full, "base": base, "ident": ident, "u": u, "v": v}
    out["lift"] = np.zeros(len(u)) if item.height is None else item.height(u, v)
    stud = np.zeros(len(u), bool)
    if item.studs is not None:
        gap, k = cKDTree(item.studs[:, :2]).query(np.c_[u, v], distance_upper_bound=0.05)
        row = item.studs[np.minimum(k, len(item.studs) - 1)]
        near = np.where(np.isfinite(gap), gap, 9.0) / row[:, 2]
        stud = near < 1
        out["lift"] = np.where(stud, row[:, 3] * np.sqrt(1 - np.minimum(near, 1) ** 2 * 0.8), out["lift"])
        out["f"] = np.where(stud, out["f"] * (1.1 - 0.5 * near), out["f"])
    out["stud"] = stud
    return out


def _window(item: Surface, view: View) -> tuple[float, float, float, float]:
    if item.big:
        return -1e9, 1e9, -1e9, 1e9
    q = item.outline() - np.array(view.at)
    mid = 0.5 * (view.az[0] + view.az[1])
    az = (np.degrees(np.arctan2(q[:, 1], q[:, 0])) - mid + 180) % 360 - 180 + mid
    if az.max() - az.min() > 170:
        return -1e9, 1e9, -1e9, 1e9
    el = np.degrees(np.arctan2(q[:, 2], np.hypot(q[:, 0], q[:, 1])))
    pad_a, pad_e = 0.03 + 0.02 * (az.max() - az.min()), 0.03 + 0.03 * (el.max() - el.min())
    return az.min() - pad_a, az.max() + pad_a, el.min() - pad_e, el.max() + pad_e


def scan(world: World, view: View, tool: Scanner, number: int, rng: np.random.Generator, out: Rows) -> None:
    """Cast one station, column by column, and append its points."""
    s = np.array(view.at, float)
    az = np.arange(view.az[0], view.az[1], view.step)
    el = np.arange(view.el[0], view.el[1], view.step)
    items = [(i, p, _window(p, view)) for i, p in enumerate(world.items) if p.facing(s)]
    cols = max(1, int(260_000 / len(el)))
    rad = math.degrees(tool.beam * 1e-3) * 0.36
    drift = tool.drift * Noise(number + 91, 60.0)(az, 0 * az)
    for c0 in range(0, len(az), cols):
        a = az[c0 : c0 + cols]
        ee, aa = np.meshgrid(el, a)  # columns first, as the scanner turns
        e_k = np.stack([ee + rad * q for _, q in SUB])
        a_k = np.stack([aa + rad * p / np.maximum(np.cos(np.radians(ee)), 0.05) for p, _ in SUB])
        e_r, a_r = np.radians(e_k), np.radians(a_k)
        d = np.stack([np.cos(e_r) * np.cos(a_r), np.cos(e_r) * np.sin(a_r), np.sin(e_r)], axis=-1)
        t = np.full(e_k.shape, np.inf)
        pid = np.full(e_k.shape, -1, np.int32)
        for i, item, (w0, w1, w2, w3) in items:
            i0, i1 = np.searchsorted(a, (w0, w1))
            j0, j1 = np.searchsorted(el, (w2, w3))
            if i0 >= i1 or j0 >= j1:
                continue
            box = (slice(None), slice(i0, i1), slice(j0, j1))
            h = item.hit(s, d[box])
            better = h < t[box]
            if better.any():
                t[box] = np.where(better, h, t[box])
                pid[box] = np.where(better, i, pid[box])
        ray = np.isfinite(t).any(axis=0)
        if not ray.any():
            continue
        t, pid, d = t[:, ray], pid[:, ray], d[:, ray]
        el_c, col = ee[ray], (np.arange(len(a))[:, None] + c0 + 0 * ee.astype(int))[ray]
        _beams(world, view, tool, number, rng, out, s, t, pid, d, el_c, drift[col])


def _beams(
    world: World,
    view: View,
    tool: Scanner,
    number: int,
    rng: np.random.Generator,
    out: Rows,
    s: Array,
    t: Array,
    pid: Array,
    d: Array,
    el: Array,
    drift: Array,
) -> None:
    k, n = t.shape
    flat_t, flat_p, flat_d = t.ravel(), pid.ravel(), d.reshape(-1, 3)
    val = {key: np.zeros(k * n) for key in ("cos", "f", "base", "u", "v", "lift")}
    ident, stud = np.zeros(k * n, np.int32), np.zeros(k * n, bool)
    order = np.argsort(flat_p, kind="stable")
    order = order[np.searchsorted(flat_p[order], 0) :]
    cut = np.flatnonzero(np.diff(flat_p[order])) + 1
    for idx in np.split(order, cut):
        if len(idx) == 0:
            continue
        r = _shade(world.items[flat_p[idx[0]]], s + flat_t[idx, None] * flat_d[idx], flat_d[idx])
        for key in val:
            val[key][idx] = r[key]
        ident[idx], stud[idx] = r["ident"], r["stud"]
    for key in val:
        val[key] = val[key].reshape(k, n)
    ident, stud = ident.reshape(k, n), stud.reshape(k, n)
    sids = np.array([p.sid for p in world.items] + [0], np.int32)
    t = np.where(np.isfinite(t), t - val["lift"] / np.maximum(val["cos"], 0.25), 1e6)
    hit = pid >= 0
    w = np.where(hit, WEIGHT[:, None], 0.0)
    e = w * val["f"] / t**2
    # one echo: the strongest group of returns that the receiver cannot separate
    group_e = np.zeros((k, n))
    same_e = np.zeros((k, n))
    for i in range(k):
        near = np.abs(t - t[i]) < tool.split
        group_e[i] = (e * near).sum(axis=0) * hit[i]
        same_e[i] = (e * near * (pid == pid[i])).sum(axis=0) * hit[i]
    best = np.argmax(group_e * (1 + 1e-6 * (np.arange(k) == 0))[:, None], axis=0)
    cols = np.arange(n)
    near = (np.abs(t - t[best, cols]) < tool.split) & hit
    lead = np.argmax(np.where(near, same_e, -1) * (1 + 1e-6 * (np.arange(k) == 0))[:, None], axis=0)
    same = near & (pid == pid[lead, cols])
    total = (e * near).sum(axis=0)
    reach = (e * near * t).sum(axis=0) / total
    own = (e * same * t).sum(axis=0) / np.maximum((e * same).sum(axis=0), 1e-30)
    cos = val["cos"][lead, cols]
    mixed = (np.abs(reach - own) * cos > max(0.002, tool.sigma)) | ((w * same).sum(axis=0) < 0.75)
    power = (w * val["f"] * near).sum(axis=0)
    contrast = (w * val["f"] * same).sum(axis=0) / np.maximum((w * val["base"] * same).sum(axis=0), 1e-12)
    amp = tool.const + view.offset + tool.far(reach) + 10 * np.log10(np.maximum(power, 1e-9)) + drift
    weak = np.clip(10 ** (0.05 * (18 - amp)), 0.9, 1.6)
    amp = amp + tool.noise * np.clip(weak, 0.9, 1.4) * rng.standard_normal(n)
    spread = np.minimum(reach * tool.beam * 1e-3 * 0.12 * np.sqrt(1 - cos**2) / np.maximum(cos, 0.15), 0.002)
    r = reach + np.hypot(tool.sigma * np.clip(weak, 0.9, 1.3), spread) * rng.standard_normal(n)
    # false returns: dust and rain in front, echoes behind
    wrong = rng.random(n) < tool.false
    before = rng.random(n) < 0.6
    r = np.where(wrong, np.where(before, reach * rng.uniform(0.25, 0.97, n), reach + rng.uniform(0.04, 0.8, n)), r)
    amp = np.where(wrong, amp - rng.uniform(3, 12, n), amp)
    keep = (amp > tool.floor) & (r > 0.5)
    surf = np.where(mixed | wrong | stud[lead, cols], 0, sids[pid[lead, cols]])
    ids = np.where(surf > 0, ident[lead, cols], 0)
    inc = np.degrees(np.arccos(np.clip(cos, 0, 1)))
    area = reach**2 * math.radians(view.step) ** 2 * np.cos(np.radians(el)) / np.maximum(cos, 0.03)
    xyz = s + r[:, None] * d[0]
    rows = dict(
        xyz=xyz[keep],
        amp=np.round(amp, 2)[keep].astype(np.float32),
        station=np.full(int(keep.sum()), number, np.uint16),
        surface=surf[keep].astype(np.int32),
        anomaly=ids[keep].astype(np.int32),
        incidence=np.where(surf > 0, inc, np.nan)[keep].astype(np.float32),
        area=np.where(surf > 0, area, 0)[keep].astype(np.float32),
        contrast=(10 * np.log10(np.maximum(contrast, 1e-6)))[keep],
        u=val["u"][lead, cols][keep],
        v=val["v"][lead, cols][keep],
    )
    for key, a in rows.items():
        out.setdefault(key, []).append(a)


def visible(ids: Array, station: Array, u: Array, v: Array, area: Array, cell: float = 0.1) -> dict[int, float]:
    """For each number: the sum over cells of the most area that one scan saw."""
    ok = ids > 0
    if not ok.any():
        return {}
    key = np.c_[ids[ok], np.floor(u[ok] / cell), np.floor(v[ok] / cell), station[ok]].astype(np.int64)
    cells, inv = np.unique(key, axis=0, return_inverse=True)
    a = np.bincount(inv.ravel(), area[ok].astype(float))
    spots, inv2 = np.unique(cells[:, :3], axis=0, return_inverse=True)
    top = np.zeros(len(spots))
    np.maximum.at(top, inv2.ravel(), a)
    return {int(i): float(top[spots[:, 0] == i].sum()) for i in np.unique(spots[:, 0])}


def deliver(
    folder: Path,
    world: World,
    views: list[View],
    tool: Scanner,
    seed: int,
    epsg: int,
    origin: tuple[float, float, float],
    yaw: float,
) -> None:
    """Scan all stations and write the four files."""
    rng, out = np.random.default_rng(seed), {}
    for i, view in enumerate(views, 1):
        scan(world, view, tool, i, rng, out)
    a = {key: np.concatenate(x) for key, x in out.items()}
    c, s = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    xyz = a["xyz"] @ turn.T + np.array(origin)
    head = laspy.LasHeader(point_format=6, version="1.4")
    head.add_crs(CRS.from_epsg(epsg))
    head.scales, head.offsets = [0.0005] * 3, np.round(xyz.mean(axis=0), -1)
    head.add_extra_dim(laspy.ExtraBytesParams("Amplitude", np.float32, "dB"))
    las = laspy.LasData(head)
    las.x, las.y, las.z = xyz[:, 0], xyz[:, 1], xyz[:, 2]
    las.Amplitude = a["amp"]
    las.intensity = np.clip((a["amp"] + 5) * 1000, 0, 65535).astype(np.uint16)
    las.point_source_id = a["station"]
    las.return_number = np.ones(len(xyz), np.uint8)
    las.number_of_returns = np.ones(len(xyz), np.uint8)
    las.gps_time = 3.0e5 + np.arange(len(xyz)) * 8e-6 + 900.0 * a["station"]
    las.write(str(Path(folder) / "scan.laz"))
    rows = ["scan_id,x,y,z"]
    for i, view in enumerate(views, 1):
        p = turn @ np.array(view.at) + np.array(origin)
        rows.append(f"{i},{p[0]:.4f},{p[1]:.4f},{p[2]:.4f}")
    (Path(folder) / "stations.csv").write_text("\n".join(rows) + "\n")
    np.savez_compressed(
        Path(folder) / "truth.npz", anomaly=a["anomaly"], surface=a["surface"], incidence=a["incidence"], area=a["area"]
    )
    size = visible(a["anomaly"], a["station"], a["u"], a["v"], a["area"])
    listed = []
    for m in world.marks:
        on = a["anomaly"] == m.ident
        if not on.any():
            continue
        row = {
            "id": m.ident,
            "kind": m.kind,
            "area": round(size[m.ident], 4),
            "contrast_db": round(float(a["contrast"][on].mean()), 2),
        }
        if m.limit:
            row["limit"] = m.limit
        listed.append(row)
    (Path(folder) / "truth.json").write_text(json.dumps({"anomalies": listed}, indent=1) + "\n")
