"""A small scanner: analytic patches and tubes, materials, anomalies, a beam of five sub-rays, and the files of the contract."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

Field = Callable[[np.ndarray, np.ndarray], np.ndarray]
WEIGHTS = np.array([0.36, 0.16, 0.16, 0.16, 0.16])  # energy of the sub-rays: centre, right, left, up, down


# ---------------------------------------------------------------- textures
def _hash(i: np.ndarray, j: np.ndarray, seed: int) -> np.ndarray:
    """A number of 0 to 1 for each lattice node."""
    with np.errstate(over="ignore"):
        h = i.astype(np.int64).astype(np.uint32) * np.uint32(374761393)
        h = h + j.astype(np.int64).astype(np.uint32) * np.uint32(668265263) + np.uint32((seed * 2246822519) % 2**32)
        h = (h ^ (h >> np.uint32(13))) * np.uint32(1274126177)
        h = (h ^ (h >> np.uint32(15))) * np.uint32(2654435761)
        h = h ^ (h >> np.uint32(16))
    return h / 2.0**32


def noise(a: np.ndarray, b: np.ndarray, scale: float, seed: int, octaves: int = 2) -> np.ndarray:
    """Smooth noise of about -1 to 1 with structures of the given size in metres."""
    out = np.zeros(np.shape(a))
    total, amp = 0.0, 1.0
    for k in range(octaves):
        x, y = a / scale * 2**k, b / scale * 2**k
        i, j = np.floor(x), np.floor(y)
        fx, fy = x - i, y - j
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
        s = seed * 7 + k
        low = _hash(i, j, s) * (1 - fx) + _hash(i + 1, j, s) * fx
        high = _hash(i, j + 1, s) * (1 - fx) + _hash(i + 1, j + 1, s) * fx
        out += amp * (2 * (low * (1 - fy) + high * fy) - 1)
        total += amp
        amp *= 0.5
    return out / total


def spangle(a: np.ndarray, b: np.ndarray, size: float, seed: int) -> np.ndarray:
    """-1 to 1, constant on each zinc crystal: cells around jittered lattice nodes."""
    i, j = np.floor(a / size), np.floor(b / size)
    best, value = np.full(a.shape, np.inf), np.zeros(a.shape)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            x = (i + di + _hash(i + di, j + dj, seed)) * size
            y = (j + dj + _hash(i + di, j + dj, seed + 1)) * size
            d = (a - x) ** 2 + (b - y) ** 2
            near = d < best
            best = np.where(near, d, best)
            value = np.where(near, 2 * _hash(i + di, j + dj, seed + 2) - 1, value)
    return value


def step01(x: np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, smooth between."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


# ---------------------------------------------------------------- shapes of anomalies: 0 to 1 over a face
def foot(height: float, ragged: float, seed: int, axis: str = "b", soft: float = 0.02) -> Field:
    """Everything below a ragged line (to the left of one with the axis a)."""

    def level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        along, up = (a, b) if axis == "b" else (b, a)
        wave = noise(along, 0.4 * up, 0.09, seed) + 0.5 * noise(a, b, 0.03, seed + 1)
        return step01((height + ragged * wave - up) / soft + 0.5)

    return level


def blob(a0: float, b0: float, ra: float, rb: float, ragged: float, seed: int, soft: float = 0.1, scale: float = 0.0) -> Field:
    """A ragged ellipse."""
    scale = scale or 0.5 * min(ra, rb)

    def level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        r = np.hypot((a - a0) / ra, (b - b0) / rb)
        return step01((1 - r + ragged * noise(a, b, scale, seed, 3)) / soft + 0.5)

    return level


def flakes(a0: float, b0: float, ra: float, rb: float, size: float, seed: int, share: float = 0.0) -> Field:
    """Flakes that came off within a ragged ellipse; sharp edges."""
    hull = blob(a0, b0, ra, rb, 0.5, seed + 50, 0.3)

    def level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        n = noise(a, b, size, seed, 3)
        return step01((n + share + 1.8 * (hull(a, b) - 1)) / 0.06 + 0.5)

    return level


def streak(a0: float, top: float, length: float, width: float, seed: int) -> Field:
    """A run that starts narrow, wavers, widens and fades out downwards."""

    def level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        s = (top - b) / length
        mid = a0 + 0.25 * width * noise(b, 0 * b, 0.3, seed)
        half = 0.5 * width * (0.55 + 0.45 * np.clip(s, 0, 1)) * (1 + 0.35 * noise(a, b, 0.08, seed + 1))
        inside = step01((half - np.abs(a - mid)) / (0.15 * width) + 0.5)
        ends = step01(s / 0.02) * step01((1 - s + 0.25 * noise(a, 0.2 * b, 0.05, seed + 2)) / 0.12)
        return inside * ends

    return level


def strokes(lines: list[list[tuple[float, float]]], width: float, seed: int) -> Field:
    """Sprayed lines of one width."""

    def level(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        best = np.full(a.shape, np.inf)
        for line in lines:
            p = np.asarray(line, float)
            for q0, q1 in zip(p[:-1], p[1:], strict=True):
                d = q1 - q0
                s = np.clip(((a - q0[0]) * d[0] + (b - q0[1]) * d[1]) / (d @ d), 0, 1)
                best = np.minimum(best, np.hypot(a - q0[0] - s * d[0], b - q0[1] - s * d[1]))
        return step01((0.5 * width * (1 + 0.15 * noise(a, b, 0.05, seed)) - best) / (0.15 * width) + 0.5)

    return level


# ---------------------------------------------------------------- materials, surfaces
@dataclass(frozen=True)
class Material:
    """Reflection in dB: a base, a diffuse fall with the incidence, a lobe at 0 degrees, mottling and spangle."""

    base: float
    fall: float = 1.0
    lobe: float = 0.0
    width: float = 10.0
    mottle: float = 0.2
    size: float = 0.8
    grain: float = 0.0
    crystals: float = 0.0
    rough: float = 0.0

    def db(self, a: np.ndarray, b: np.ndarray, cosine: np.ndarray, seed: int) -> np.ndarray:
        """Reflection at places of a face."""
        c = np.clip(cosine, 0.02, 1)
        tan2 = 1 / c**2 - 1
        lobe = self.lobe * np.exp(-tan2 / np.tan(np.radians(self.width)) ** 2)
        if self.crystals:
            s = spangle(a, b, 0.016, seed)
            lobe = lobe * (1 + 0.35 * s)
        out = self.base + 10 * np.log10(c**self.fall + lobe)
        if self.mottle:
            out = out + self.mottle * noise(a, b, self.size, seed + 11)
        if self.grain:
            out = out + self.grain * noise(a, b, 0.03, seed + 12, 1)
        return out + self.crystals * s if self.crystals else out


@dataclass
class Surface:
    """One smooth surface; number 0 is anything that is none."""

    number: int
    material: Material
    seed: int
    tone: Field | None = None
    offset: float = 0.0
    flaws: list[Flaw] = field(default_factory=list)

    def evaluate(self, a: np.ndarray, b: np.ndarray, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Reflection in dB, the same without anomalies, number of the anomaly."""
        own = self.material.db(a, b, cosine, self.seed) + self.offset
        if self.tone is not None:
            own = own + self.tone(a, b)
        now, ident = own.copy(), np.zeros(a.shape, np.int32)
        for flaw in self.flaws:
            w = flaw.level(a, b)
            some = np.flatnonzero(w > 0.02)
            if len(some):
                other = flaw.reflection(own[some], a[some], b[some], cosine[some])
                now[some] = (1 - w[some]) * now[some] + w[some] * other
                ident[w >= 0.4] = flaw.number
        return now, own, ident


@dataclass
class Flaw:
    """An anomaly on one surface: another material, or the same one lighter or darker."""

    number: int
    kind: str
    level: Field
    material: Material | None = None
    change: float = 0.0
    limit: str = ""

    def reflection(self, own: np.ndarray, a: np.ndarray, b: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Reflection in dB where the anomaly covers all."""
        if self.material is not None:
            return self.material.db(a, b, cosine, 900 + self.number)
        return own + self.change * (1 + 0.2 * noise(a, b, 0.12, 700 + self.number))


def unit(v: np.ndarray) -> np.ndarray:
    """Of length 1."""
    v = np.asarray(v, float)
    return v / np.linalg.norm(v)


@dataclass
class Patch:
    """A flat rectangle, seen from both sides; `mask` cuts it to shape."""

    o: np.ndarray
    u: np.ndarray
    v: np.ndarray
    lu: float
    lv: float
    surface: Surface
    mask: Field | None = None

    def corners(self) -> np.ndarray:
        u, v = self.lu * self.u, self.lv * self.v
        p = self.o + np.array([0 * u, u, u + v, v])
        return np.stack([p, np.roll(p, -1, 0)], 1)

    def cast(self, dots: Callable, s: np.ndarray) -> np.ndarray:
        n = np.cross(self.u, self.v)
        rel = self.o - s
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.float32(rel @ n) / dots(n)
        a = t * dots(self.u) - np.float32(rel @ self.u)
        b = t * dots(self.v) - np.float32(rel @ self.v)
        good = (t > 0.3) & (a >= 0) & (a <= self.lu) & (b >= 0) & (b <= self.lv)
        if self.mask is not None:
            where = np.nonzero(good)
            good[where] = self.mask(a[where].astype(float), b[where].astype(float))
        return np.where(good, t, np.float32(np.inf))

    def locate(self, d: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, ...]:
        n = np.cross(self.u, self.v)
        dn = d @ n
        t = ((self.o - s) @ n) / dn
        p = s + t[:, None] * d - self.o
        return t, p @ self.u, p @ self.v, np.abs(dn)


@dataclass
class Tube:
    """The mantle of a cylinder; `ref` is where the coordinate around it is 0."""

    p: np.ndarray
    w: np.ndarray
    r: float
    length: float
    surface: Surface
    ref: np.ndarray

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        e1 = unit(self.ref - (self.ref @ self.w) * self.w)
        return e1, np.cross(self.w, e1)

    def corners(self) -> np.ndarray:
        e1, e2 = self.axes()
        out = []
        q = [self.p + self.r * (i * e1 + j * e2) for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        for k in range(4):
            out.append([q[k], q[k] + self.length * self.w])
            for end in (0, self.length * self.w):
                out.append([q[k] + end, q[(k + 1) % 4] + end])
        return np.array(out)

    def cast(self, dots: Callable, s: np.ndarray) -> np.ndarray:
        e1, e2 = self.axes()
        rel = s - self.p
        x0, y0, z0 = (np.float32(rel @ e) for e in (e1, e2, self.w))
        dx, dy, dz = dots(e1), dots(e2), dots(self.w)
        aa = dx * dx + dy * dy
        bb = x0 * dx + y0 * dy
        cross = dx * y0 - dy * x0
        disc = aa * np.float32(self.r**2) - cross * cross
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(disc)
            out = np.full(aa.shape, np.inf, np.float32)
            for sign in (1, -1):
                t = (-bb + sign * root) / aa
                z = z0 + t * dz
                out = np.where((disc > 0) & (t > 0.3) & (z >= 0) & (z <= self.length), t, out)
        return out

    def locate(self, d: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, ...]:
        e1, e2 = self.axes()
        rel = s - self.p
        dx, dy, dz = d @ e1, d @ e2, d @ self.w
        aa = dx * dx + dy * dy
        bb = (rel @ e1) * dx + (rel @ e2) * dy
        root = np.sqrt(np.maximum(bb * bb - aa * ((rel @ e1) ** 2 + (rel @ e2) ** 2 - self.r**2), 0))
        t = (-bb - root) / aa
        z = rel @ self.w + t * dz
        inner = (z < 0) | (z > self.length) | (t < 0.3)
        t = np.where(inner, (-bb + root) / aa, t)
        z = rel @ self.w + t * dz
        x, y = rel @ e1 + t * dx, rel @ e2 + t * dy
        return t, self.r * np.arctan2(y, x), z, np.abs(x * dx + y * dy) / self.r


@dataclass
class Station:
    """Where the scanner stands (local), its window in degrees and its gain in dB."""

    at: tuple[float, float, float]
    azimuth: tuple[float, float]
    elevation: tuple[float, float]
    gain: float = 0.0
    step: float = 0.06


@dataclass
class Instrument:
    """What the scanner adds."""

    beam: float = 0.3  # mrad
    range_noise: float = 0.0015
    noise: float = 0.5
    level: float = 25.0
    near: float = 3.0
    power: float = 20.0
    floor: float = -8.0
    echoes: bool = False
    false: float = 2e-4

    def of_range(self, t: np.ndarray) -> np.ndarray:
        """F(range): the fall with the distance, and the loss of a receiver that does not see all of a near spot."""
        return -self.power * np.log10(t / 10) + 10 * np.log10(1 - np.exp(-((t / self.near) ** 1.6)))


class World:
    """Collects surfaces and primitives and writes the scene."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.seed = seed
        self.surfaces: list[Surface] = []
        self.prims: list[Patch | Tube] = []
        self.flaws: list[Flaw] = []
        self.mirror: tuple[Surface, float, str] | None = None

    def surface(self, material: Material, tone: Field | None = None, spread: float = 0.15, none: bool = False) -> Surface:
        """A new surface (number 0 with `none`)."""
        number = 0 if none else 1 + sum(s.number > 0 for s in self.surfaces)
        s = Surface(number, material, self.seed * 1000 + len(self.surfaces), tone, float(self.rng.normal(0, spread)))
        self.surfaces.append(s)
        return s

    def flaw(
        self, surface: Surface, kind: str, level: Field, material: Material | None = None, change: float = 0.0, limit: str = ""
    ) -> None:
        """Puts an anomaly on a surface."""
        f = Flaw(len(self.flaws) + 1, kind, level, material, change, limit)
        self.flaws.append(f)
        surface.flaws.append(f)

    def patch(self, o, u, v, surface: Surface | Material, mask: Field | None = None) -> Surface:
        """A rectangle from a corner and two full edges."""
        s = self.surface(surface) if isinstance(surface, Material) else surface
        lu, lv = float(np.linalg.norm(u)), float(np.linalg.norm(v))
        self.prims.append(Patch(np.asarray(o, float), unit(u), unit(v), lu, lv, s, mask))
        return s

    def tube(self, p, q, r: float, surface: Surface | Material, ref=(0.0, 0.0, 1.0)) -> Surface:
        """A mantle between two points."""
        s = self.surface(surface) if isinstance(surface, Material) else surface
        p, q = np.asarray(p, float), np.asarray(q, float)
        w = unit(q - p)
        ref = np.asarray(ref, float)
        if np.linalg.norm(np.cross(ref, w)) < 0.1:
            ref = np.array([1.0, 0.3, 0.0])
        self.prims.append(Tube(p, w, r, float(np.linalg.norm(q - p)), s, ref))
        return s

    def disc(self, c, n, r: float, surface: Surface | Material, inner: float = 0.0) -> Surface:
        """A round plate (a ring with `inner`)."""
        n = unit(n)
        u = unit(np.cross(n, (0.31, 0.2, 0.93)))
        v = np.cross(n, u)
        return self.patch(
            np.asarray(c, float) - r * (u + v),
            2 * r * u,
            2 * r * v,
            surface,
            mask=lambda a, b: (np.hypot(a - r, b - r) <= r) & (np.hypot(a - r, b - r) >= inner),
        )

    def box(self, o, ex, ey, ez, material: Material | Surface, skip: str = "") -> dict[str, Surface]:
        """Six faces, each a surface (all on one where a surface is given)."""
        o, ex, ey, ez = (np.asarray(x, float) for x in (o, ex, ey, ez))
        faces = {"x0": (o, ey, ez), "x1": (o + ex, ey, ez), "y0": (o, ex, ez), "y1": (o + ey, ex, ez)}
        faces.update({"z0": (o, ex, ey), "z1": (o + ez, ex, ey)})
        return {k: self.patch(*f, material) for k, f in faces.items() if k not in skip.split()}

    def ibeam(self, o, along, up, side, h: float, b: float, tw: float, tf: float, material: Material) -> dict[str, Surface]:
        """A rolled I: `o` is the middle of the lower flange from outside; a runs along, b up the web or across the flange."""
        o, along, up, side = np.asarray(o, float), np.asarray(along, float), unit(up), unit(side)
        out = {}
        for k, z in (("low", 0.0), ("top", h)):
            out[k] = self.patch(o + z * up - b / 2 * side, along, b * side, material)
            edge = o + (0 if z == 0 else h - tf) * up
            for g in (-1, 1):
                self.patch(edge + g * b / 2 * side, along, tf * up, material)
        for g, k in ((-1, "-"), (1, "+")):
            out["web" + k] = self.patch(o + tf * up + g * tw / 2 * side, along, (h - 2 * tf) * up, material)
            for kk, z in (("low", tf), ("top", h - tf)):
                out[kk + k] = self.patch(o + z * up + g * tw / 2 * side, along, g * (b - tw) / 2 * side, material)
        return out

    # ---------------------------------------------------------------- the scan
    def _window(self, prim, s, az, el, mid) -> tuple[int, int, int, int] | None:
        edges = prim.corners()
        f = np.linspace(0, 1, 13)[None, :, None]
        p = edges[:, :1] * (1 - f) + edges[:, 1:] * f - s
        pa = (np.arctan2(p[..., 1], p[..., 0]) - mid + np.pi) % (2 * np.pi) - np.pi
        pe = np.arctan2(p[..., 2], np.hypot(p[..., 0], p[..., 1]))
        a0, a1 = pa.min(), pa.max()
        m = 0.5 * np.abs(np.diff(pe, axis=1)).max() + 0.002
        e0, e1 = pe.min() - m, pe.max() + m
        if a1 - a0 >= np.pi * 0.95:
            return 0, len(az), 0, len(el)
        c = max(0.05, np.cos(min(max(abs(e0), abs(e1)), 1.52)))
        i0, i1 = np.searchsorted(az, (a0 - 0.001 / c, a1 + 0.001 / c))
        j0, j1 = np.searchsorted(el, (e0, e1))
        return (i0, i1, j0, j1) if i1 > i0 and j1 > j0 else None

    def _cast(self, s, az, el, mid, beam, prims) -> tuple[np.ndarray, np.ndarray]:
        h = 0.30 * beam * 1e-3
        da = np.array([0, h, -h, 0, 0], np.float32)[:, None, None]
        de = np.array([0, 0, 0, h, -h], np.float32)[:, None, None]
        best = np.full((5, len(az), len(el)), np.inf, np.float32)
        who = np.full(best.shape, -1, np.int32)
        ca, sa = np.cos(az + mid).astype(np.float32), np.sin(az + mid).astype(np.float32)
        ce, se = np.cos(el).astype(np.float32), np.sin(el).astype(np.float32)
        for k, prim in enumerate(prims):
            w = self._window(prim, s, az, el, mid)
            if w is None:
                continue
            i, j = slice(w[0], w[1]), slice(w[2], w[3])
            c1, s1 = ce[None, None, j] - de * se[None, None, j], se[None, None, j] + de * ce[None, None, j]
            cc, ss = ca[i][None, :, None], sa[i][None, :, None]

            def dots(n, c1=c1, s1=s1, cc=cc, ss=ss):
                n = np.asarray(n, np.float32)
                return c1 * (cc * n[0] + ss * n[1]) + s1 * n[2] + da * (cc * n[1] - ss * n[0])

            t = prim.cast(dots, s)
            near = t < best[:, i, j]
            best[:, i, j][near] = t[near]
            who[:, i, j][near] = k
        return best, who

    def _directions(self, az, el, mid, i, j, beam, k) -> np.ndarray:
        h = 0.30 * beam * 1e-3
        x, y = az[i] + mid, el[j]
        d = np.stack([np.cos(y) * np.cos(x), np.cos(y) * np.sin(x), np.sin(y)], 1)
        da = np.array([0, h, -h, 0, 0])[k][:, None]
        de = np.array([0, 0, 0, h, -h])[k][:, None]
        d += da * np.stack([-np.sin(x), np.cos(x), 0 * x], 1)
        return d + de * np.stack([-np.sin(y) * np.cos(x), -np.sin(y) * np.sin(x), np.cos(y)], 1)

    def _scan(self, number: int, st: Station, ins: Instrument) -> dict[str, np.ndarray]:
        rng = np.random.default_rng([self.seed, number])
        s = np.asarray(st.at, float)
        mid = np.radians(0.5 * sum(st.azimuth))
        step = np.radians(st.step)
        half = np.radians(0.5 * (st.azimuth[1] - st.azimuth[0]))
        az = np.arange(-half, half, step)
        el = np.arange(np.radians(st.elevation[0]), np.radians(st.elevation[1]), step)
        best, who = self._cast(s, az, el, mid, ins.beam, self.prims)
        ray = np.flatnonzero((who >= 0).any(0).ravel())
        best, who = best.reshape(5, -1), who.reshape(5, -1)
        sky = np.flatnonzero((who < 0).all(0))
        who = who[:, ray]
        m = len(ray)
        same = (who == who[0]).all(0)
        use = who >= 0
        use[1:, same] = False
        kk, rr = np.nonzero(use)
        pid = who[kk, rr]
        tt = np.full((5, m), np.inf)
        db, own, cosine, ca, cb = np.zeros((5, m)), np.zeros(m), np.ones(m), np.zeros(m), np.zeros(m)
        flaw, surf = np.zeros((5, m), np.int32), np.full((5, m), -1, np.int32)
        order = np.argsort(pid, kind="stable")
        cuts = np.flatnonzero(np.diff(pid[order])) + 1
        for part in np.split(order, cuts):
            if not len(part):
                continue
            prim = self.prims[pid[part[0]]]
            k, r = kk[part], rr[part]
            i, j = np.divmod(ray[r], len(el))
            t, a, b, c = prim.locate(self._directions(az, el, mid, i, j, ins.beam, k), s)
            now, was, ident = prim.surface.evaluate(a, b, c)
            if prim.surface.material.rough:
                t = t + rng.normal(0, prim.surface.material.rough, len(t))
            tt[k, r], db[k, r], flaw[k, r], surf[k, r] = t, now, ident, prim.surface.number
            z = k == 0
            own[r[z]], cosine[r[z]], ca[r[z]], cb[r[z]] = now[z] - was[z], c[z], a[z], b[z]
        tt[1:, same], db[1:, same], flaw[1:, same], surf[1:, same] = tt[0, same], db[0, same], flaw[0, same], surf[0, same]
        with np.errstate(invalid="ignore", divide="ignore"):
            hit = np.isfinite(tt)
            energy = np.where(hit, WEIGHTS[:, None] * 10 ** ((db + ins.of_range(np.where(hit, tt, 10.0))) / 10), 0)
        first = tt.min(0)
        g1 = hit & (tt - first < 0.5)
        rest = np.where(g1, np.inf, tt)
        g2 = np.isfinite(rest) & (np.where(np.isfinite(rest), rest, 1e9) - rest.min(0) < 0.5)
        groups = []
        for g in (g1, g2):
            e = np.where(g, energy, 0)
            tot = e.sum(0)
            with np.errstate(invalid="ignore", divide="ignore"):
                t = np.where(g, e * np.where(hit, tt, 0), 0).sum(0) / tot
                amp = 10 * np.log10(tot)
                mine = np.where(g & (surf == surf[0]), WEIGHTS[:, None], 0).sum(0)
                share = np.where(surf == surf[0], e, 0).sum(0) / tot
                pure = g[0] & (surf[0] > 0) & (mine >= 0.6) & (share > 0.6) & (np.abs(t - tt[0]) < 0.004)
            groups.append((t, amp, np.nan_to_num(pure).astype(bool), tot > 0))
        drift = 0.12 * np.sin(2 * np.pi * (ray // len(el)) / len(az) * 1.7 + number)
        out: list[dict[str, np.ndarray]] = []
        both = groups[1][3]
        stronger = np.where(both & (groups[1][1] > groups[0][1]), 1, 0)
        for n, (t, amp, pure, there) in enumerate(groups):
            keep = there & (np.ones(m, bool) if ins.echoes else stronger == n)
            weak = np.maximum(0, 6 - (amp - ins.floor)) / 6
            keep &= amp + rng.normal(0, 0.5, m) > ins.floor
            r = np.flatnonzero(keep)
            tn = t[r] + rng.normal(0, 1, len(r)) * np.minimum(ins.range_noise * (1 + weak[r]), 0.003)
            value = amp[r] + ins.level + st.gain + drift[r] + rng.normal(0, 1, len(r)) * ins.noise * (1 + 0.5 * weak[r])
            s0 = np.where(pure[r], surf[0, r], 0)
            out.append(
                {
                    "ray": ray[r],
                    "t": tn,
                    "amp": value,
                    "surface": s0,
                    "flaw": np.where(s0 > 0, flaw[0, r], 0),
                    "cos": cosine[r],
                    "delta": own[r],
                    "a": ca[r],
                    "b": cb[r],
                    "echo": np.full(len(r), n + 1),
                }
            )
        if ins.echoes:
            count = np.bincount(np.concatenate([o["ray"] for o in out]), minlength=len(az) * len(el))
        if self.mirror is not None:
            out = self._ghosts(out, s, az, el, mid, ins, st, rng)
        if len(sky):
            pick = np.sort(rng.choice(sky, rng.binomial(len(sky), ins.false), replace=False))
            z = np.zeros(len(pick))
            amp = rng.normal(ins.floor + ins.level + st.gain + 2, 1, len(pick))
            out.append(
                {
                    "ray": pick,
                    "t": rng.uniform(1.5, 22, len(pick)),
                    "amp": amp,
                    "surface": z.astype(np.int32),
                    "flaw": z.astype(np.int32),
                    "cos": z + 1,
                    "delta": z,
                    "a": z,
                    "b": z,
                    "echo": z + 1,
                }
            )
        p = {k: np.concatenate([o[k] for o in out]) for k in out[0]}
        order = np.lexsort((p["echo"], p["ray"]))
        p = {k: v[order] for k, v in p.items()}
        i, j = np.divmod(p["ray"], len(el))
        p["returns"] = np.maximum(count[p["ray"]], 1) if ins.echoes else np.ones(len(i), int)
        p["echo"] = np.minimum(p["echo"], p["returns"])
        d = self._directions(az, el, mid, i, j, ins.beam, np.zeros(len(i), int))
        d = d + rng.normal(0, 2e-5, d.shape)
        p["xyz"] = s + p["t"][:, None] * d
        if number > 1:  # what registration leaves
            p["xyz"] = p["xyz"] + rng.normal(0, 0.0008, 3)
        p["area"] = np.where(p["surface"] > 0, p["t"] ** 2 * step * step * np.cos(el[j]) / np.maximum(p["cos"], 0.02), 0)
        p["station"] = np.full(len(i), number)
        return p

    def _ghosts(self, out, s, az, el, mid, ins, st, rng) -> list[dict[str, np.ndarray]]:
        """Rays that a puddle mirrors: some of them return what lies above, at a place below the ground."""
        surface, z0, kind = self.mirror
        prims = []
        flip = np.array([1.0, 1.0, -1.0])
        for q in self.prims:
            if isinstance(q, Patch) and q.surface is not surface and q.o[2] > z0 + 1:
                o = q.o * flip + np.array([0, 0, 2 * z0])
                prims.append(Patch(o, q.u * flip, q.v * flip, q.lu, q.lv, q.surface, q.mask))
        wet = [f.number for f in surface.flaws if f.kind == kind]
        low = el < -0.05
        t, who = self._cast(s, az, el[low], mid, ins.beam, prims)
        full = np.full((len(az), len(el)), np.inf)
        full[:, low] = t[0]
        full = full.ravel()
        g = out[0]
        sel = np.isin(g["flaw"], wet) & np.isfinite(full[g["ray"]]) & (rng.random(len(g["ray"])) < 0.12) & (g["cos"] < 0.8)
        r = np.flatnonzero(sel)
        g["t"][r] = full[g["ray"][r]] + rng.normal(0, ins.range_noise, len(r))
        g["amp"][r] = ins.floor + ins.level + st.gain + rng.gamma(2, 1.2, len(r))
        g["surface"][r], g["flaw"][r] = 0, 0
        return out

    def write(
        self,
        folder: Path,
        stations: list[Station],
        ins: Instrument,
        origin: tuple[float, float, float],
        turn: float,
        epsg: int,
        software: str,
    ) -> None:
        """Scans from all stations and writes the files."""
        parts = [self._scan(k + 1, st, ins) for k, st in enumerate(stations)]
        p = {k: np.concatenate([q[k] for q in parts]) for k in parts[0]}
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        rot = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        xyz = p["xyz"] @ rot.T + np.asarray(origin)
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales = np.full(3, 0.0005)
        header.offsets = np.floor(xyz.mean(0))
        header.add_crs(CRS.from_epsg(epsg))
        header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
        header.generating_software = software
        las = laspy.LasData(header)
        las.x, las.y, las.z = xyz.T
        las.Amplitude = np.round(p["amp"], 2).astype(np.float32)
        las.point_source_id = p["station"].astype(np.uint16)
        las.return_number, las.number_of_returns = p["echo"].astype(np.uint8), p["returns"].astype(np.uint8)
        las.intensity = np.clip((p["amp"] + 10) * 1000, 0, 65535).astype(np.uint16)
        las.write(str(folder / "scan.laz"))
        at = np.array([st.at for st in stations]) @ rot.T + np.asarray(origin)
        rows = [f"{k + 1},{x:.4f},{y:.4f},{z:.4f}\n" for k, (x, y, z) in enumerate(at)]
        (folder / "stations.csv").write_text("scan_id,x,y,z\n" + "".join(rows))
        seen = p["surface"] > 0
        incidence = np.where(seen, np.degrees(np.arccos(np.clip(p["cos"], 0, 1))), np.nan)
        np.savez_compressed(
            folder / "truth.npz",
            anomaly=p["flaw"].astype(np.int32),
            surface=p["surface"].astype(np.int32),
            incidence=incidence.astype(np.float32),
            area=p["area"].astype(np.float32),
        )
        listed = []
        for flaw in self.flaws:
            on = np.flatnonzero(p["flaw"] == flaw.number)
            if not len(on):
                continue
            cell = np.stack([np.floor(p["a"][on] / 0.1), np.floor(p["b"][on] / 0.1), p["station"][on]], 1).astype(int)
            keys, inverse = np.unique(cell, axis=0, return_inverse=True)
            sums = np.bincount(inverse.ravel(), p["area"][on])
            _, place = np.unique(keys[:, :2], axis=0, return_inverse=True)
            most = np.zeros(place.max() + 1)
            np.maximum.at(most, place.ravel(), sums)
            entry = {
                "id": flaw.number,
                "kind": flaw.kind,
                "area": round(float(most.sum()), 4),
                "contrast_db": round(float(p["delta"][on].mean()), 2),
            }
            if flaw.limit:
                entry["limit"] = flaw.limit
            listed.append(entry)
        (folder / "truth.json").write_text(json.dumps({"anomalies": listed}, indent=1))
