"""Shape of a tunnel and what a beam meets in it.

Everything is thought of in a straight tunnel first: `s` along the axis, `y` to the right, `z` up from the axis. `Axis` bends it
into the world; ranges and angles are those of the bent tunnel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# ---------------------------------------------------------------------------------------------------------------------- the axis


@dataclass(frozen=True)
class Axis:
    """A circular arc in plan with a constant gradient, in EPSG:25832."""

    east: float
    north: float
    height: float
    azimuth: float  # degrees from north, at s = 0
    curvature: float  # 1/m, positive to the right
    grade: float

    def _plan(self, s):
        a0 = np.radians(self.azimuth)
        s = np.asarray(s, float)
        a = a0 + self.curvature * s
        if abs(self.curvature) < 1e-9:
            return self.east + np.sin(a0) * s, self.north + np.cos(a0) * s, a
        k = self.curvature
        return self.east + (np.cos(a0) - np.cos(a)) / k, self.north + (np.sin(a) - np.sin(a0)) / k, a

    def world(self, s, y, z):
        """Coordinates (n, 3) of points given in the straight tunnel."""
        e, n, a = self._plan(s)
        return np.stack(
            np.broadcast_arrays(e + np.cos(a) * y, n - np.sin(a) * y, self.height + self.grade * np.asarray(s) + z), -1
        )

    def turn(self, s, vs, vy, vz):
        """A vector of the straight tunnel at `s`, in the world."""
        _, _, a = self._plan(s)
        ve = np.sin(a) * (vs - self.grade * vz) + np.cos(a) * vy
        vn = np.cos(a) * (vs - self.grade * vz) - np.sin(a) * vy
        return np.stack(np.broadcast_arrays(ve, vn, vz + self.grade * vs), -1)


# ------------------------------------------------------------------------------------------------------------------ cross-section


def arc(cy, cz, r, a0, a1, step=0.05):
    """Points of an arc from angle `a0` to `a1` (degrees, from +y counterclockwise)."""
    n = max(2, int(np.ceil(abs(np.radians(a1 - a0)) * r / step)) + 1)
    a = np.radians(np.linspace(a0, a1, n))
    return np.stack([cy + r * np.cos(a), cz + r * np.sin(a)], 1)


def line(p, q, step=0.2):
    n = max(2, int(np.ceil(np.hypot(q[0] - p[0], q[1] - p[1]) / step)) + 1)
    t = np.linspace(0, 1, n)[:, None]
    return np.asarray(p, float) * (1 - t) + np.asarray(q, float) * t


def chain(*parts):
    """Polylines one after another; double points go."""
    p = np.concatenate([np.asarray(x, float).reshape(-1, 2) for x in parts])
    keep = np.r_[True, np.hypot(*np.diff(p, axis=0).T) > 1e-6]
    return p[keep]


class Section:
    """A closed cross-section: the lining from the left foot over the crown to the right foot, then the floor back to the left."""

    def __init__(self, lining, floor):
        lining, floor = np.asarray(lining, float), np.asarray(floor, float)
        v = chain(lining, floor, lining[:1])
        if np.hypot(*(v[-1] - v[0])) > 1e-9:
            v = np.concatenate([v, v[:1]])
        self.p0, d = v[:-1], np.diff(v, axis=0)
        self.len = np.hypot(d[:, 0], d[:, 1])
        self.t = d / self.len[:, None]
        self.n = np.stack([self.t[:, 1], -self.t[:, 0]], 1)  # inward
        self.u0 = np.r_[0, np.cumsum(self.len)[:-1]]
        self.k = len(chain(lining)) - 1  # segments of the lining
        self.girth = float(self.len[: self.k].sum())
        self.around = float(self.len.sum())
        self._u = np.r_[self.u0[: self.k], self.girth]
        self._yz = v[: self.k + 1]

    def at(self, u):
        """Coordinates (y, z) on the lining at arc length `u`."""
        return np.interp(u, self._u, self._yz[:, 0]), np.interp(u, self._u, self._yz[:, 1])

    def inward(self, u):
        i = np.clip(np.searchsorted(self._u, u, side="right") - 1, 0, self.k - 1)
        # smoothed between neighbours, so that outlines do not jump
        return self.n[i, 0], self.n[i, 1]

    def u_at_height(self, z, side):
        """Arc length at which the lining passes height `z`; side −1 left, +1 right."""
        top = int(np.argmax(self._yz[:, 1]))
        if side < 0:
            return float(np.interp(z, self._yz[: top + 1, 1], self._u[: top + 1]))
        return float(np.interp(-z, -self._yz[top:, 1], self._u[top:]))

    @property
    def crown(self):
        zz = self._yz[:, 1]
        top = np.nonzero(zz > zz.max() - 1e-6)[0]
        return float(self._u[top].mean())

    def steepness(self, u):
        """dz/du, from −1 to 1: positive where water runs towards smaller `u`."""
        i = np.clip(np.searchsorted(self._u, u, side="right") - 1, 0, self.k - 1)
        return self.t[i, 1]

    def table(self, y0, z0, n=7200):
        """Which segment is seen from (y0, z0) in each of `n` directions."""
        ang = (np.arange(n) + 0.5) / n * 2 * np.pi - np.pi
        dy, dz = np.cos(ang)[:, None], np.sin(ang)[:, None]
        den = dy * self.n[:, 0] + dz * self.n[:, 1]
        num = (self.p0[:, 0] - y0) * self.n[:, 0] + (self.p0[:, 1] - z0) * self.n[:, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            r = num / den
        k = (y0 + r * dy - self.p0[:, 0]) * self.t[:, 0] + (z0 + r * dz - self.p0[:, 1]) * self.t[:, 1]
        bad = (den >= -1e-9) | (r <= 1e-6) | (k < -1e-6) | (k > self.len + 1e-6)
        r = np.where(bad, np.inf, r)
        return np.argmin(r, axis=1).astype(np.int32)


def meet(sec, table, y0, z0, s0, ds, dy, dz):
    """Where beams meet the smooth section: t, s, u, segment; `table` is (n,) or, with `row`, a stack of them."""
    n = table.shape[-1]
    b = ((np.arctan2(dz, dy) + np.pi) * (n / (2 * np.pi))).astype(np.int32)
    np.clip(b, 0, n - 1, out=b)
    seg = table[b]
    return _plane(sec, seg, y0, z0, s0, ds, dy, dz)


def meet_rows(sec, tables, row, y0, z0, s0, ds, dy, dz):
    n = tables.shape[1]
    b = ((np.arctan2(dz, dy) + np.pi) * (n / (2 * np.pi))).astype(np.int32)
    np.clip(b, 0, n - 1, out=b)
    seg = tables[row, b]
    return _plane(sec, seg, y0, z0, s0, ds, dy, dz)


def _plane(sec, seg, y0, z0, s0, ds, dy, dz):
    ny, nz = sec.n[seg, 0], sec.n[seg, 1]
    py, pz = sec.p0[seg, 0], sec.p0[seg, 1]
    den = dy * ny + dz * nz
    t = ((py - y0) * ny + (pz - z0) * nz) / np.where(den > -1e-6, -1e-6, den)
    u = sec.u0[seg] + (y0 + t * dy - py) * sec.t[seg, 0] + (z0 + t * dz - pz) * sec.t[seg, 1]
    return t, s0 + t * ds, u, seg


# ------------------------------------------------------------------------------------------------------------------ installations


@dataclass
class Tube:
    """A cable or pipe along the tunnel, with a sag between its hangers."""

    y: float
    z: float
    r: float
    s0: float
    s1: float
    level: float = -9.0
    kr: float = 0.2
    ks: float = 0.0
    sag: float = 0.0
    pitch: float = 1.5

    def hit(self, os, oy, oz, ds, dy, dz):
        a = dy * dy + dz * dz
        zc = self.z
        if self.sag:
            t0 = ((self.y - oy) * dy + (self.z - oz) * dz) / np.maximum(a, 1e-9)
            x = np.mod((os + t0 * ds) / self.pitch, 1.0)
            zc = self.z - 4 * self.sag * x * (1 - x)
        fy, fz = oy - self.y, oz - zc
        b = fy * dy + fz * dz
        c = fy * fy + fz * fz - self.r * self.r
        q = b * b - a * c
        ok = (q > 0) & (a > 1e-9)
        with np.errstate(invalid="ignore", divide="ignore"):
            t = np.where(ok, (-b - np.sqrt(np.maximum(q, 0))) / a, np.inf)
            s = os + t * ds
            t = np.where((t > 0.05) & (s > self.s0) & (s < self.s1), t, np.inf)
        with np.errstate(invalid="ignore"):
            return t, np.zeros_like(t), (oy + t * dy - self.y) / self.r, (oz + t * dz - zc) / self.r


@dataclass
class Box:
    """A box, turned by `rot` degrees in the section."""

    y: float
    z: float
    a: float  # half width along `rot`
    b: float  # half width across
    s0: float
    s1: float
    rot: float = 0.0
    level: float = -8.0
    kr: float = 0.2
    ks: float = 0.0

    def hit(self, os, oy, oz, ds, dy, dz):
        c, w = np.cos(np.radians(self.rot)), np.sin(np.radians(self.rot))
        o = (os - (self.s0 + self.s1) / 2, (oy - self.y) * c + (oz - self.z) * w, -(oy - self.y) * w + (oz - self.z) * c)
        d = (ds, dy * c + dz * w, -dy * w + dz * c)
        h = ((self.s1 - self.s0) / 2, self.a, self.b)
        lo = np.full(np.shape(dy), -np.inf)
        hi = np.full(np.shape(dy), np.inf)
        ax = np.zeros(np.shape(dy), np.int8)
        for i in range(3):
            di = np.where(np.abs(d[i]) < 1e-9, 1e-9, d[i])
            t1, t2 = (-h[i] - o[i]) / di, (h[i] - o[i]) / di
            a, b = np.minimum(t1, t2), np.maximum(t1, t2)
            ax = np.where(a > lo, i, ax)
            lo, hi = np.maximum(lo, a), np.minimum(hi, b)
        t = np.where((lo < hi) & (lo > 0.05), lo, np.inf)
        n0 = np.where(ax == 0, -np.sign(d[0]), 0.0)
        n1 = np.where(ax == 1, -np.sign(d[1]), 0.0)
        n2 = np.where(ax == 2, -np.sign(d[2]), 0.0)
        return t, n0, n1 * c - n2 * w, n1 * w + n2 * c


def nearest(objects, os, oy, oz, ds, dy, dz, limit):
    """The first thing a beam meets before `limit`: t, its index (−1: none) and normal."""
    n = len(dy)
    best = np.array(limit, float)
    who = np.full(n, -1, np.int16)
    nrm = np.zeros((3, n), np.float32)
    phi = np.arctan2(dz, dy)
    osv, oyv, ozv = (np.broadcast_to(np.asarray(v, float), (n,)) for v in (os, oy, oz))
    for i, ob in enumerate(objects):
        ry, rz = ob.y - oyv, ob.z - ozv
        dist = np.hypot(ry, rz)
        size = ob.r + ob.sag if isinstance(ob, Tube) else np.hypot(ob.a, ob.b)
        w = np.arcsin(np.clip((size + 0.02) / np.maximum(dist, 1e-3), 0, 1))
        dphi = np.abs(np.mod(phi - np.arctan2(rz, ry) + np.pi, 2 * np.pi) - np.pi)
        m = np.nonzero((dphi < w) | (dist < size + 0.05))[0]
        if not len(m):
            continue
        t, a, b, c = ob.hit(osv[m], oyv[m], ozv[m], ds[m], dy[m], dz[m])
        g = t < best[m]
        j = m[g]
        best[j] = t[g]
        who[j] = i
        nrm[0, j], nrm[1, j], nrm[2, j] = a[g], b[g], c[g]
    return best, who, nrm
