"""A small ray caster and a model of a terrestrial scanner: bodies, materials, patches, scan, files, truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

Field = Callable[[np.ndarray, np.ndarray], np.ndarray]


def noise(s: np.ndarray, t: np.ndarray, wave: float, seed: int, stretch: float = 1.0, terms: int = 18) -> np.ndarray:
    """Smooth random field of unit variance; ``stretch`` makes it longer along t."""
    rng = np.random.default_rng(seed)
    out = np.zeros(np.shape(s))
    for _ in range(terms):
        k = 2 * np.pi / (wave * np.exp(rng.uniform(-0.9, 0.9)))
        a, phase = rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
        out += np.cos(k * (np.cos(a) * s + np.sin(a) / stretch * t) + phase)
    return out * np.sqrt(2.0 / terms)


# ---------------------------------------------------------------- fields: strength 0..1 on a surface


def blotch(s0: float, t0: float, rs: float, rt: float, seed: int, rough: float = 0.25, edge: float = 0.2) -> Field:
    """An irregular patch around (s0, t0)."""

    def f(s, t):
        q = np.hypot((s - s0) / rs, (t - t0) / rt)
        near = q < 2.2
        out = np.zeros(np.shape(s))
        m = min(rs, rt)
        sn, tn = s[near], t[near]
        q = q[near] + rough * (0.7 * noise(sn, tn, 1.6 * m, seed) + 0.35 * noise(sn, tn, 0.6 * m, seed + 1))
        out[near] = np.clip((1 - q) / edge + 0.5, 0, 1)
        return out

    return f


def runs(sources: list[tuple[float, float, float, float]], seed: int, down: float = -1.0) -> Field:
    """Streaks that run along t: (s, t at the source, length, width) each; ``down`` is the sign of t on the way down."""

    def f(s, t):
        out = np.zeros(np.shape(s))
        for i, (s0, t0, length, width) in enumerate(sources):
            u = (t - t0) * down / length
            near = (u > -0.02) & (u < 1.05) & (np.abs(s - s0) < 4 * width)
            un, sn = u[near], s[near]
            z = np.zeros_like(un)
            mid = s0 + 0.07 * width * noise(z, un * length, 1.5, seed + 7 * i)
            half = 0.5 * width * np.clip(1.25 - 0.6 * un, 0.2, 1) * np.clip(0.4 + un * length / 0.5, 0, 1)
            half *= 1 + 0.16 * noise(z, un * length, 0.6, seed + 7 * i + 1)
            v = np.clip((half - np.abs(sn - mid)) / (0.25 * width) + 0.5, 0, 1)
            v *= np.clip((1.0 - un) / 0.12, 0, 1) * np.clip((un + 0.02) / 0.03, 0, 1)
            out[near] = np.maximum(out[near], v)
        return out

    return f


def rect(s0: float, s1: float, t0: float, t1: float, edge: float = 0.004) -> Field:
    """A rectangle."""
    return lambda s, t: np.clip(np.minimum(np.minimum(s - s0, s1 - s), np.minimum(t - t0, t1 - t)) / edge + 0.5, 0, 1)


def lines(at: list[float], width: float, along: str = "t", lo: float = -1e9, hi: float = 1e9) -> Field:
    """Straight seams at s (``along`` t) or at t (``along`` s), between lo and hi."""

    def f(s, t):
        a, b = (s, t) if along == "t" else (t, s)
        d = np.full(np.shape(s), 1e9)
        for x in at:
            d = np.minimum(d, np.abs(a - x))
        return ((d < width / 2) & (b > lo) & (b < hi)).astype(float)

    return f


def dots(points: list[tuple[float, float]], radius: float) -> Field:
    """Discs: heads of bolts, tie holes, lamps."""

    def f(s, t):
        out = np.zeros(np.shape(s))
        for a, b in points:
            out = np.maximum(out, np.hypot(s - a, t - b) < radius)
        return out

    return f


def both(*fields: Field) -> Field:
    """The stronger of several fields."""

    def f(s, t):
        out = fields[0](s, t)
        for g in fields[1:]:
            out = np.maximum(out, g(s, t))
        return out

    return f


# ---------------------------------------------------------------- materials and bodies


@dataclass(frozen=True)
class Material:
    """Reflectance in dB, exponent of the cosine, strength and width of the lobe, mottle in dB and its wavelength."""

    db: float
    power: float = 1.0
    lobe: float = 0.0
    width: float = 0.3
    mottle: float = 0.15
    wave: float = 0.3
    grain: float = 0.0
    mirror: float = 0.0


@dataclass
class Patch:
    """Something on a face: design (number 0) or an anomaly."""

    where: Field
    db: float
    number: int = 0
    kind: str = ""
    lobe: float = 0.0
    height: float = 0.0
    soft: bool = False
    drop: float = 0.0
    uneven: float = 0.0
    seed: int = 0


@dataclass
class Body:
    """A box, a cylinder with caps, a quarter of a torus or a bush, in its own frame (rows of ``frame``)."""

    kind: str
    centre: np.ndarray
    frame: np.ndarray
    size: np.ndarray
    mat: Material
    soft: bool = False
    hole: Field | None = None
    mats: dict[int, Material] = field(default_factory=dict)
    patches: dict[int, list[Patch]] = field(default_factory=dict)

    def outline(self) -> np.ndarray:
        """Points on the edges of the bounding box."""
        if self.kind in ("box", "bush"):
            h = self.size
        elif self.kind == "cyl":
            h = np.array([self.size[0], self.size[0], self.size[1] / 2])
        else:
            h = np.array([sum(self.size), sum(self.size), self.size[1]])
        e = np.linspace(-1, 1, 13)
        pts = []
        for k in range(3):
            i, j = [a for a in range(3) if a != k]
            for a in (-1, 1):
                for b in (-1, 1):
                    p = np.zeros((13, 3))
                    p[:, k], p[:, i], p[:, j] = e, a, b
                    pts.append(p)
        return self.centre + (np.concatenate(pts) * h) @ self.frame

    def hit(self, o: np.ndarray, d: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Distance along each ray; inf where it misses. o and d are in the own frame."""
        with np.errstate(divide="ignore", invalid="ignore"):
            t = getattr(self, "_" + self.kind)(o, d, rng)
        t = np.where(t > 0.3, t, np.inf)
        if self.hole is not None:
            ok = np.flatnonzero(np.isfinite(t))
            _, s, v, _ = self.local((o if o.ndim == 1 else o[ok]) + t[ok, None] * d[ok])
            t[ok[self.hole(s, v) > 0.5]] = np.inf
        return t

    def _box(self, o, d, rng):
        t1, t2 = (-self.size - o) / d, (self.size - o) / d
        near, far = np.minimum(t1, t2).max(-1), np.maximum(t1, t2).min(-1)
        return np.where((near <= far) & (near > 0), near, np.inf)

    def _cyl(self, o, d, rng):
        r, h = self.size[0], self.size[1] / 2
        o = np.broadcast_to(o, d.shape)
        a = d[:, 0] ** 2 + d[:, 1] ** 2
        b = o[:, 0] * d[:, 0] + o[:, 1] * d[:, 1]
        q = b * b - a * (o[:, 0] ** 2 + o[:, 1] ** 2 - r * r)
        t = (-b - np.sqrt(np.maximum(q, 0))) / a
        t = np.where((q > 0) & (t > 0) & (np.abs(o[:, 2] + t * d[:, 2]) <= h), t, np.inf)
        cap = (-np.sign(d[:, 2]) * h - o[:, 2]) / d[:, 2]
        x = o[:, :2] + cap[:, None] * d[:, :2]
        ok = (cap > 0) & ((x**2).sum(1) <= r * r)
        return np.where(ok, np.minimum(cap, t), t)

    def _torus(self, o, d, rng):
        big, r = self.size
        o = np.broadcast_to(o, d.shape)
        mid = np.array([big, big, 0]) * 0.6
        b = ((o - mid) * d).sum(1)
        t = np.maximum(-b - (big + 2 * r), 0)
        out = np.full(len(d), np.inf)
        live = np.flatnonzero(((o - mid) ** 2).sum(1) - b * b < (big + 2 * r) ** 2)
        for _ in range(70):
            p = o[live] + t[live, None] * d[live]
            g = self._arc(p)
            gap = np.linalg.norm(p - np.c_[big * np.cos(g), big * np.sin(g), 0 * g], axis=1) - r
            out[live[gap < 2e-4]] = t[live[gap < 2e-4]]
            t[live] += gap
            live = live[(gap >= 2e-4) & (t[live] < -b[live] + big + 2.5 * r)]
            if not len(live):
                break
        return out

    @staticmethod
    def _arc(p):
        g = np.arctan2(p[:, 1], p[:, 0]) - np.pi / 4
        return np.clip((g + np.pi) % (2 * np.pi) - np.pi, -np.pi / 4, np.pi / 4) + np.pi / 4

    def _bush(self, o, d, rng):
        o, d = o / self.size, d / self.size
        a, b, c = (d * d).sum(-1), (o * d).sum(-1), (o * o).sum(-1) - 1
        q = np.sqrt(b * b - a * c)
        t = (-b - q) / a + rng.exponential(0.35, len(d))
        return np.where((t < (-b + q) / a) & np.isfinite(q), t, np.inf)

    def local(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Face, s, t and normal (all in the own frame) of points in the own frame."""
        n = np.zeros_like(p)
        if self.kind == "box":
            k = np.argmax(np.abs(p) - self.size, axis=1)
            row = np.arange(len(p))
            up = p[row, k] > 0
            n[row, k] = np.where(up, 1, -1)
            return 2 * k + up, p[row, np.where(k == 0, 1, 0)], p[row, np.where(k == 2, 1, 2)], n
        if self.kind == "cyl":
            rho = np.hypot(p[:, 0], p[:, 1])
            face = np.where(self.size[1] / 2 - np.abs(p[:, 2]) < self.size[0] - rho, 1 + (p[:, 2] > 0), 0)
            n[:, :2] = p[:, :2] / np.maximum(rho, 1e-9)[:, None]
            n[face > 0] = np.c_[np.zeros(len(p)), np.zeros(len(p)), np.sign(p[:, 2])][face > 0]
            ang = np.arctan2(p[:, 1], p[:, 0])
            return face, np.where(face == 0, ang * self.size[0], p[:, 0]), np.where(face == 0, p[:, 2], p[:, 1]), n
        zero = np.zeros(len(p), int)
        if self.kind == "torus":
            g = self._arc(p)
            radial = np.c_[np.cos(g), np.sin(g), 0 * g]
            n = p - self.size[0] * radial
            n /= np.linalg.norm(n, axis=1)[:, None]
            return zero, np.arctan2(n[:, 2], (n * radial).sum(1)) * self.size[1], g * self.size[0], n
        n = p / np.maximum(np.linalg.norm(p, axis=1), 1e-9)[:, None]
        return zero, p[:, 0], p[:, 2], n


@dataclass(frozen=True)
class Scanner:
    """Steps and noise of an instrument. ``pulsed`` separates echoes, else their phases mix."""

    step: float
    beam: float
    sigma_r: float
    sigma_a: float
    const: float = 42.0
    near: float = 3.0
    decay: float = 20.0
    pulsed: bool = True
    floor: float = 2.0
    saturation: float = 45.0
    quantum: float = 0.01
    stripe: float = 0.05
    false: float = 2e-4


class World:
    """Bodies, anomalies and stations of one scene in a local frame (z up), and the files made of them."""

    def __init__(self, seed: int, scanner: Scanner, origin: tuple[float, float, float], turn: float, epsg: int = 25832) -> None:
        self.rng = np.random.default_rng(seed)
        self.seed, self.scanner, self.origin, self.turn, self.epsg = seed, scanner, np.array(origin), np.radians(turn), epsg
        self.bodies: list[Body] = []
        self.notes: list[dict] = []
        self.stations: list[tuple[np.ndarray, float, float, float, float]] = []

    def add(self, kind: str, centre, frame, size, mat: Material, **kw) -> Body:
        """A body; plants belong to no surface."""
        kw.setdefault("soft", kind == "bush")
        body = Body(kind, np.asarray(centre, float), np.asarray(frame, float), np.asarray(size, float), mat, **kw)
        self.bodies.append(body)
        return body

    def box(self, lo, hi, mat: Material, **kw) -> Body:
        """A box along the axes."""
        lo, hi = np.asarray(lo, float), np.asarray(hi, float)
        return self.add("box", (lo + hi) / 2, np.eye(3), (hi - lo) / 2, mat, **kw)

    def bar(self, p0, p1, side, width: float, thick: float, mat: Material, shift: float = 0.0, out: float = 0.0, **kw) -> Body:
        """A flat bar from p0 to p1: x along it, y along ``side`` (thick), z across (width); shifted along z and y."""
        p0, p1 = np.asarray(p0, float), np.asarray(p1, float)
        x = (p1 - p0) / np.linalg.norm(p1 - p0)
        y = np.asarray(side, float) - np.dot(side, x) * x
        y /= np.linalg.norm(y)
        z = np.cross(x, y)
        mid = (p0 + p1) / 2 + shift * z + out * y
        return self.add("box", mid, [x, y, z], [np.linalg.norm(p1 - p0) / 2, thick / 2, width / 2], mat, **kw)

    def pipe(self, p0, p1, radius: float, mat: Material, face=(0, -1, 0), **kw) -> Body:
        """A cylinder from p0 to p1; s = 0 looks along ``face``."""
        p0, p1 = np.asarray(p0, float), np.asarray(p1, float)
        z = (p1 - p0) / np.linalg.norm(p1 - p0)
        x = np.asarray(face, float) - np.dot(face, z) * z
        x = x / np.linalg.norm(x) if np.linalg.norm(x) > 1e-6 else np.cross(z, [0.6, 0.64, 0.48])
        x /= np.linalg.norm(x)
        return self.add("cyl", (p0 + p1) / 2, [x, np.cross(z, x), z], [radius, np.linalg.norm(p1 - p0)], mat, **kw)

    def wire(self, points, radius: float, mat: Material) -> None:
        """A cable through points; it belongs to no surface."""
        for a, b in zip(points[:-1], points[1:], strict=True):
            self.pipe(a, b, radius, mat, soft=True)

    def design(self, body: Body, face: int, where: Field, db: float, **kw) -> None:
        """A seam, a label, heads of bolts: what belongs to the design."""
        body.patches.setdefault(face, []).append(Patch(where, db, **kw))

    def anomaly(self, body: Body, face: int, where: Field, db: float, kind: str, limit: str | None = None, **kw) -> int:
        """An anomaly on a face."""
        note = {"id": len(self.notes) + 1, "kind": kind}
        if limit:
            note["limit"] = limit
        self.notes.append(note)
        kw.setdefault("uneven", 0.15)
        seed = self.seed * 100 + note["id"]
        body.patches.setdefault(face, []).append(Patch(where, db, number=note["id"], kind=kind, seed=seed, **kw))
        return note["id"]

    def station(self, at, look: float, az: float, el0: float, el1: float) -> None:
        """A station; ``look`` is the direction of the window in degrees from x, az its half width, el0..el1 its height."""
        self.stations.append((np.asarray(at, float), np.radians(look), np.radians(az), np.radians(el0), np.radians(el1)))

    def cast(self, o: np.ndarray, d: np.ndarray, look: float | None) -> tuple[np.ndarray, np.ndarray]:
        """First hit: distance and number of the body (-1: none)."""
        best, who = np.full(len(d), np.inf), np.full(len(d), -1, np.int32)
        if look is not None:
            az = (np.arctan2(d[:, 1], d[:, 0]) - look + np.pi) % (2 * np.pi) - np.pi
            el = np.arcsin(d[:, 2])
            order = np.argsort(az, kind="stable")
            saz, sel = az[order], el[order]
        for i, b in enumerate(self.bodies):
            if look is None:
                idx = np.arange(len(d))
            else:
                v = b.outline() - o
                a = (np.arctan2(v[:, 1], v[:, 0]) - look + np.pi) % (2 * np.pi) - np.pi
                e = np.arctan2(v[:, 2], np.hypot(v[:, 0], v[:, 1]))
                if np.ptp(a) > 2.8:
                    idx = order
                else:
                    lo, hi = np.searchsorted(saz, [a.min() - 0.006, a.max() + 0.006])
                    part = sel[lo:hi]
                    idx = order[lo:hi][(part > e.min() - 0.006) & (part < e.max() + 0.006)]
            if not len(idx):
                continue
            oo = (o if o.ndim == 1 else o[idx]) - b.centre
            t = b.hit(oo @ b.frame.T, d[idx] @ b.frame.T, self.rng)
            closer = t < best[idx]
            best[idx[closer]], who[idx[closer]] = t[closer], i
        return best, who

    def shade(self, o: np.ndarray, d: np.ndarray, t: np.ndarray, who: np.ndarray) -> dict[str, np.ndarray]:
        """What the hits are: surface, incidence, reflected dB without range, height above the face, anomaly."""
        n = len(t)
        r = {k: np.zeros(n) for k in ("db", "plain", "height", "s", "t", "drop", "mirror")}
        r |= {"surface": np.zeros(n, np.int32), "anomaly": np.zeros(n, np.int32), "cos": np.ones(n), "normal": np.zeros((n, 3))}
        order = np.argsort(who, kind="stable")
        cut = np.searchsorted(who[order], np.arange(len(self.bodies) + 1))
        for i, b in enumerate(self.bodies):
            idx = order[cut[i] : cut[i + 1]]
            if not len(idx):
                continue
            dd = d[idx] @ b.frame.T
            face, s, v, nrm = b.local((o - b.centre) @ b.frame.T + t[idx, None] * dd)
            r["s"][idx], r["t"][idx], r["normal"][idx] = s, v, nrm @ b.frame
            c = np.clip(-(nrm * dd).sum(1), 0.02, 1)
            r["cos"][idx] = c
            for f in np.unique(face):
                m = face == f
                self._face(b, i, int(f), idx[m], s[m], v[m], c[m], r)
        return r

    def _face(self, b: Body, i: int, f: int, idx, s, v, c, r) -> None:
        mat = b.mats.get(f, b.mat)
        seed = self.seed * 1000 + i * 8 + f
        db = mat.db + mat.mottle * (0.8 * noise(s, v, mat.wave, seed) + 0.6 * noise(s, v, mat.wave / 4, seed + 500000))
        if mat.grain:  # spangle and grain: cells of a centimetre or two with a value each
            cell = np.floor(s / 0.015 + 0.4 * np.sin(v / 0.011)) * 12.9898 + np.floor(v / 0.015) * 78.233 + seed
            db = db + mat.grain * ((np.sin(cell) * 43758.5453) % 1 - 0.5) * 3.46
        lobe = np.full(len(s), mat.lobe)
        surface = np.full(len(s), 0 if b.soft else i * 8 + f + 1)
        if b.kind == "bush":
            db = db + self.rng.normal(0, 2.0, len(s))
        shape = np.exp(-(1 / c**2 - 1) / mat.width**2)
        number, height, drop = np.zeros(len(s), np.int32), np.zeros(len(s)), np.zeros(len(s))
        for p in (p for p in b.patches.get(f, []) if not p.number):
            w = p.where(s, v)
            db, lobe, height, drop = db + p.db * w, lobe + p.lobe * w, height + p.height * w, drop + p.drop * w
            if p.soft:
                surface[w > 0.5] = 0
        plain = db + 10 * np.log10(c**mat.power + lobe * shape)
        for p in (p for p in b.patches.get(f, []) if p.number):
            w = p.where(s, v)
            k = 1 + p.uneven * noise(s, v, 0.3, p.seed) if p.uneven else 1.0
            db, lobe = db + p.db * w * k, np.maximum(lobe + p.lobe * w, 0)
            number[w > 0.4] = p.number
        r["db"][idx] = db + 10 * np.log10(c**mat.power + lobe * shape)
        r["plain"][idx], r["height"][idx], r["drop"][idx], r["mirror"][idx] = plain, height, drop, mat.mirror
        r["surface"][idx], r["anomaly"][idx] = surface, np.where(surface > 0, number, 0)

    def scan(self, k: int) -> dict[str, np.ndarray]:
        """One station: rays, hits, mixed pixels, false returns, noise."""
        sc, rng = self.scanner, self.rng
        o, look, half, el0, el1 = self.stations[k]
        step = np.radians(sc.step)
        na, ne = int(2 * half / step), int((el1 - el0) / step)
        az = np.repeat(look - half + step * (np.arange(na) + rng.uniform()), ne) + rng.normal(0, 8e-6, na * ne)
        el = np.tile(el0 + step * (np.arange(ne) + rng.uniform()), na) + rng.normal(0, 8e-6, na * ne)
        d = np.c_[np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)]
        t, who = self.cast(o, d, look)
        r = self.shade(o, d, t, who)
        t = t - np.where(who >= 0, r["height"] / r["cos"], 0)

        # Pixels whose neighbours lie on another surface or at another distance: cast the rest of the beam too.
        grid, tg = r["surface"].reshape(na, ne) + 100000 * (who.reshape(na, ne) >= 0), np.where(who < 0, 999, t).reshape(na, ne)
        edge = np.zeros((na, ne), bool)
        for ax in (0, 1):
            a, b = [slice(None)] * 2, [slice(None)] * 2
            a[ax], b[ax] = slice(1, None), slice(None, -1)
            jump = (grid[tuple(a)] != grid[tuple(b)]) | (np.abs(tg[tuple(a)] - tg[tuple(b)]) > 0.03)
            edge[tuple(a)] |= jump
            edge[tuple(b)] |= jump
        cand = np.flatnonzero(edge)
        e1 = np.c_[-np.sin(az[cand]), np.cos(az[cand]), np.zeros(len(cand))]
        e2 = np.cross(d[cand], e1)
        tt, pw, sf = [], [], []
        power = np.where(who >= 0, self._range_db(t) + r["db"], -99)
        for j in range(7):
            if j == 0:
                tj, pj, sj, wj = t[cand], power[cand], r["surface"][cand], 0.28
            else:
                a = j * np.pi / 3
                dj = d[cand] + 0.6 * sc.beam / 2 * (np.cos(a) * e1 + np.sin(a) * e2)
                dj /= np.linalg.norm(dj, axis=1)[:, None]
                tj, hj = self.cast(o, dj, look)
                rj = self.shade(o, dj, tj, hj)
                tj = tj - np.where(hj >= 0, rj["height"] / rj["cos"], 0)
                pj, sj, wj = np.where(hj >= 0, self._range_db(tj) + rj["db"], -99), rj["surface"] + 0, 0.12
                sj[hj < 0] = -1
            tt.append(tj), pw.append(wj * 10 ** (pj / 10)), sf.append(sj)
        tt, pw, sf = np.array(tt), np.array(pw), np.array(sf)
        sf[0][who[cand] < 0] = -1
        tt[~np.isfinite(tt)] = 0
        main = tt[np.argmax(pw, axis=0), np.arange(len(cand))]
        use = (pw > 1e-9) & ((np.abs(tt - main) < 0.12) | (not sc.pulsed))
        pw = pw * use
        total = pw.sum(0)
        seen = total > 1e-9
        mean = np.where(seen, (pw * tt).sum(0) / np.maximum(total, 1e-12), np.inf)
        spread = np.where(use, tt, -1e9).max(0) - np.where(use, tt, 1e9).min(0)
        other = (sf != sf[0]).any(0)
        mixed = (other & ((spread > 0.008) | ~use.all(0))) | (sf[0] < 1)
        t[cand], power[cand] = mean, 10 * np.log10(np.maximum(total, 1e-10))
        surface, anomaly = r["surface"], r["anomaly"]
        surface[cand[mixed]] = 0
        anomaly[cand[mixed]] = 0

        # Mirrors: glossy sheets now and then return what they reflect; then false returns in the air.
        ghost = np.flatnonzero((rng.random(len(t)) < r["mirror"] * 0.05) & (who >= 0) & np.isfinite(t))
        if len(ghost):
            n = r["normal"][ghost]
            d2 = d[ghost] - 2 * (d[ghost] * n).sum(1)[:, None] * n
            t2, _ = self.cast(o + t[ghost, None] * d[ghost] + 1e-3 * d2, d2, None)
            t[ghost] += np.where(t2 < 12, t2, np.inf)
            power[ghost] = power[ghost] - rng.uniform(0, 4, len(ghost))
            surface[ghost], anomaly[ghost] = 0, 0
        loss = rng.random(len(t)) < r["drop"]
        t[loss] = np.inf
        ok = np.isfinite(t)
        false = np.flatnonzero(ok & (rng.random(len(t)) < sc.false))
        t[false] *= rng.uniform(0.15, 0.97, len(false))
        power[false] = sc.floor + rng.exponential(4, len(false)) + 1
        surface[false], anomaly[false] = 0, 0

        # The instrument: noise, drift in time, a gain for each line, compression of strong echoes, detection limit.
        col = np.repeat(np.arange(na), ne)
        amp = power + rng.normal(0, sc.sigma_a, len(t)) + rng.normal(0, 0.12) + (rng.normal(0, sc.stripe, na))[col]
        amp += 0.08 * np.sin(col / na * rng.uniform(3, 7) + rng.uniform(0, 6))
        amp = np.where(amp > sc.saturation, sc.saturation + 0.35 * (amp - sc.saturation), amp)
        ok &= amp > sc.floor + rng.normal(0, 0.4, len(t))
        t = t + rng.normal(0, 1, len(t)) * sc.sigma_r * (1 + 0.5 * 10 ** (-(np.maximum(amp, 0) - sc.floor) / 20))
        cosi = r["cos"]
        area = np.where(surface > 0, t**2 * step**2 * np.cos(el) / cosi, 0)
        inc = np.where(surface > 0, np.degrees(np.arccos(cosi)), np.nan)
        out = {"xyz": o + t[:, None] * d, "amp": np.round(amp / sc.quantum) * sc.quantum}
        out |= {"surface": surface, "anomaly": anomaly}
        out |= {"incidence": inc, "area": area, "s": r["s"], "t": r["t"], "diff": r["db"] - r["plain"]}
        out |= {"time": 1000.0 * (k + 1) + np.arange(na * ne) * 2e-5}
        return {key: v[ok] for key, v in out.items()} | {"station": np.full(ok.sum(), k + 1)}

    def _range_db(self, t: np.ndarray) -> np.ndarray:
        sc = self.scanner
        t = np.where(np.isfinite(t), t, 1.0)
        return sc.const - sc.decay * np.log10(t) - 10 * np.log10(1 + (sc.near / t) ** 2.5)

    def write(self, folder: Path) -> None:
        """Scan from every station and write the files."""
        parts = [self.scan(k) for k in range(len(self.stations))]
        p = {k: np.concatenate([q[k] for q in parts]) for k in parts[0]}
        used, number = np.unique(p["surface"], return_inverse=True)
        surface = number.astype(np.int32) if used[0] == 0 else number.astype(np.int32) + 1
        c, s = np.cos(self.turn), np.sin(self.turn)
        spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        xyz = p["xyz"] @ spin.T + self.origin
        header = laspy.LasHeader(version="1.4", point_format=6)
        header.scales, header.offsets = np.full(3, 0.0005), np.floor(self.origin)
        header.add_crs(CRS.from_epsg(self.epsg))
        header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32", "dB"))
        las = laspy.LasData(header)
        las.x, las.y, las.z = xyz.T
        las.Amplitude = p["amp"].astype(np.float32)
        las.point_source_id = p["station"].astype(np.uint16)
        las.gps_time = p["time"]
        las.return_number, las.number_of_returns = np.ones(len(xyz), np.uint8), np.ones(len(xyz), np.uint8)
        las.write(str(Path(folder) / "scan.laz"))
        text = ["scan_id,x,y,z"]
        for k, st in enumerate(self.stations):
            text.append(f"{k + 1}," + ",".join(f"{v:.4f}" for v in spin @ st[0] + self.origin))
        (Path(folder) / "stations.csv").write_text("\n".join(text) + "\n", encoding="utf-8")
        np.savez_compressed(
            Path(folder) / "truth.npz",
            anomaly=p["anomaly"].astype(np.int32),
            surface=surface,
            incidence=p["incidence"].astype(np.float32),
            area=p["area"].astype(np.float32),
        )
        listed = []
        for note in self.notes:
            m = p["anomaly"] == note["id"]
            if not m.any():
                continue
            cell = np.c_[np.floor(p["s"][m] / 0.1), np.floor(p["t"][m] / 0.1)].astype(int)
            _, at = np.unique(cell, axis=0, return_inverse=True)
            at = at.ravel()
            sums = [np.bincount(at, p["area"][m] * (p["station"][m] == k + 1), at.max() + 1) for k in range(len(parts))]
            more = {"area": round(float(np.max(sums, axis=0).sum()), 4), "contrast_db": round(float(p["diff"][m].mean()), 2)}
            listed.append(note | more)
        (Path(folder) / "truth.json").write_text(json.dumps({"anomalies": listed}, indent=1) + "\n", encoding="utf-8")
