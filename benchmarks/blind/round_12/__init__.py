"""Round 12: eight tunnels of the trade, drawn and scanned by a small ray caster of its own.

A lining is a raster of 1 cm in chainage *s* and developed length *u* (from the right foot over the crown to the left one): dry
reflectance in dB, relief, and what water takes away. Leaks are outlines first; the raster follows them, and so does the truth.
Rays go from a scanner in the tunnel to that lining, through whatever hangs before it.
"""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import shapely
from pyproj import CRS
from scipy import ndimage
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box
from shapely.ops import unary_union

from benchmarks.blind.scene import Scene

RES = 0.01
PAD = 0.5


# ---------------------------------------------------------------------------------------------------------------- geometry


class Section:
    """A closed section, star-shaped about (0, 0): lining from right foot (y < 0) to left foot, then floor back."""

    def __init__(self, lining, floor):
        line = LineString(lining)
        self.length = line.length
        n = int(np.ceil(self.length / 0.005))
        self.pu = np.linspace(0.0, self.length, n + 1)
        self.pts = shapely.get_coordinates(shapely.line_interpolate_point(line, self.pu))
        fl = LineString([lining[-1], *floor, lining[0]])
        m = int(np.ceil(fl.length / 0.005))
        fpts = shapely.get_coordinates(shapely.line_interpolate_point(fl, np.linspace(0, fl.length, m + 1)))[1:-1]
        allp = np.vstack([self.pts, fpts])
        allu = np.concatenate([self.pu, np.full(len(fpts), np.nan)])
        # theta 0 = straight down, grows over the right side
        th = np.mod(np.arctan2(-allp[:, 0], -allp[:, 1]), 2 * np.pi)
        order = np.argsort(th)
        th, rho, uu = th[order], np.hypot(*allp.T)[order], allu[order]
        self.n = 14400
        grid = (np.arange(self.n) + 0.5) * 2 * np.pi / self.n
        self.rtab = np.interp(grid, th, rho, period=2 * np.pi)
        nearest = np.clip(np.searchsorted(th, grid), 0, len(th) - 1)
        isfloor = np.isnan(uu)[nearest]
        good = ~np.isnan(uu)
        self.utab = np.where(isfloor, np.nan, np.interp(grid, th[good], uu[good]))
        y, z = -self.rtab * np.sin(grid), -self.rtab * np.cos(grid)
        k = 6
        ty = np.roll(y, -k) - np.roll(y, k)
        tz = np.roll(z, -k) - np.roll(z, k)
        ln = np.hypot(ty, tz)
        self.ty, self.tz = ty / ln, tz / ln  # along growing u
        self.rmax = self.rtab.max()
        self.ceiling = self.pts[:, 1].max()

    def index(self, y, z):
        a = np.arctan2(-y, -z)
        a = np.where(a < 0, a + 2 * np.pi, a)
        return np.minimum((a * (self.n / (2 * np.pi))).astype(np.int64), self.n - 1)

    def at(self, u):
        """Coordinates and inward normal at developed lengths."""
        u = np.clip(u, 0, self.length)
        y = np.interp(u, self.pu, self.pts[:, 0])
        z = np.interp(u, self.pu, self.pts[:, 1])
        e = 0.05
        ty = np.interp(u + e, self.pu, self.pts[:, 0]) - np.interp(u - e, self.pu, self.pts[:, 0])
        tz = np.interp(u + e, self.pu, self.pts[:, 1]) - np.interp(u - e, self.pu, self.pts[:, 1])
        ln = np.hypot(ty, tz)
        return y, z, tz / ln, -ty / ln


def circle(radius, floor, bench=None):
    """Circle about (0, 0); floor at depth `floor`; a walkway (width, top) on the left."""
    z0 = -floor
    zl = bench[1] if bench else z0
    a0 = np.arctan2(-np.sqrt(radius**2 - z0**2), z0)
    a1 = np.arctan2(np.sqrt(radius**2 - zl**2), zl)
    a = np.linspace(a0, a1, 600)
    lining = np.c_[radius * np.sin(a), radius * np.cos(a)]
    yl = lining[-1, 0]
    floor_pts = [(yl - bench[0], zl), (yl - bench[0], z0)] if bench else []
    return Section(lining, floor_pts)


def horseshoe(radius, wall, batter=0.0, kerb=None):
    """Half circle on walls of a height, drawn in by `batter` at the foot."""
    a = np.linspace(-np.pi / 2, np.pi / 2, 500)
    lining = [(-(radius - batter), -wall), *np.c_[radius * np.sin(a), radius * np.cos(a)], (radius - batter, -wall)]
    f = radius - batter
    floor_pts = (
        [(f - kerb, -wall + 0.02), (f - kerb, -wall - 0.14), (-f + kerb, -wall - 0.14), (-f + kerb, -wall + 0.02)]
        if kerb
        else []
    )
    return Section(lining, floor_pts)


def three_centred(r1, r2, half_deg, wall):
    """Flat crown of radius r1 over +-half_deg, haunches of radius r2 down to the springing, walls below; springing at z = 0."""
    t = np.radians(half_deg)
    cz = (r1 - r2) * np.cos(t)
    cy = (r1 - r2) * np.sin(t)
    a = np.linspace(0, t, 200)
    crown = np.c_[r1 * np.sin(a), -cz + r1 * np.cos(a)]
    b = np.linspace(t, np.pi / 2, 200)[1:]
    haunch = np.c_[cy + r2 * np.sin(b), r2 * np.cos(b)]
    right = np.vstack([crown, haunch, [[cy + r2, -wall]]])
    lining = np.vstack([(right * [-1, 1])[::-1], right[1:]])
    return Section(lining, [])


def rectangle(half, top, bottom, haunch):
    return Section(
        [
            (-half, -bottom),
            (-half, top - haunch),
            (-half + haunch, top),
            (half - haunch, top),
            (half, top - haunch),
            (half, -bottom),
        ],
        [],
    )


class Tunnel:
    """An axis of constant curvature and gradient with a section about it."""

    def __init__(self, length, section, origin, azimuth, kappa=0.0, grade=0.0):
        self.length, self.section = length, section
        self.origin, self.kappa, self.grade = np.array(origin, float), kappa, grade
        a = np.pi / 2 - np.radians(azimuth)
        self.rot = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])

    def model(self, s, y, z):
        s, y, z = np.broadcast_arrays(np.asarray(s, float), y, z)
        k = self.kappa
        if k:
            px = np.sin(k * s) / k - y * np.sin(k * s)
            py = (1 - np.cos(k * s)) / k + y * np.cos(k * s)
        else:
            px, py = s, y
        return np.stack([px, py, z + self.grade * s], -1)

    def local(self, p):
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        k = self.kappa
        if k:
            s = np.arctan2(k * x, 1 - k * y) / k
            y = (1 - np.hypot(k * x, 1 - k * y)) / k
        else:
            s = x
        return s, y, z - self.grade * s

    def world(self, p):
        q = np.array(p, float)
        q[..., :2] = p[..., :2] @ self.rot.T
        return q + self.origin

    def unworld(self, p):
        q = np.asarray(p, float) - self.origin
        q[..., :2] = q[..., :2] @ self.rot
        return q

    def cast(self, o, d, far):
        """First hits of rays on the section: distance, s, y, z; NaN where there is none."""
        sec = self.section

        def out(t):
            s, y, z = self.local(o + d * t[:, None])
            return np.hypot(y, z) - sec.rtab[sec.index(y, z)]

        so = self.local(o)[0]
        across = np.sqrt((d[:, 0] * -np.sin(self.kappa * so) + d[:, 1] * np.cos(self.kappa * so)) ** 2 + d[:, 2] ** 2)
        tmax = np.minimum(far, 2.4 * sec.rmax / np.maximum(across, 1e-3))
        lo, hi = np.zeros(len(d)), np.full(len(d), np.nan)
        steps = 10
        for i in range(1, steps + 1):
            t = tmax * i / steps
            f = out(t)
            open_ = np.isnan(hi)
            hi[open_ & (f >= 0)] = t[open_ & (f >= 0)]
            lo = np.where(open_ & (f < 0), t, lo)
        ok = ~np.isnan(hi)
        o, d, lo, hi = (o[ok] if len(o) == len(ok) else o), d[ok], lo[ok], hi[ok]
        for _ in range(12):
            mid = 0.5 * (lo + hi)
            f = out(mid)
            lo, hi = np.where(f < 0, mid, lo), np.where(f < 0, hi, mid)
        t = np.full(len(ok), np.nan)
        t[ok] = 0.5 * (lo + hi)
        return t


# ------------------------------------------------------------------------------------------------------------------ canvas


def _bspline(n, step):
    """Rows of cubic B-splines for n cells, knots `step` cells apart."""
    m = int(np.ceil(n / step)) + 4
    x = np.arange(n) / step + 1.5
    t = np.abs(x[:, None] - np.arange(m)[None])
    return np.where(t < 1, 2 / 3 - t**2 + t**3 / 2, np.where(t < 2, (2 - t) ** 3 / 6, 0)).astype(np.float32)


def _single(g):
    """Polygons of a geometry, largest first."""
    g = shapely.make_valid(g)
    parts = [p for p in shapely.get_parts(g) if p.geom_type == "Polygon"]
    more = [
        q for p in shapely.get_parts(g) if p.geom_type != "Polygon" for q in shapely.get_parts(p) if q.geom_type == "Polygon"
    ]
    return sorted(parts + more, key=lambda p: -p.area)


class Canvas:
    def __init__(self, tunnel, seed):
        self.tunnel, self.rng = tunnel, np.random.default_rng(seed)
        self.length, self.width = tunnel.length, tunnel.section.length
        self.ns, self.nu = int((self.length + 2 * PAD) / RES), int(np.ceil(self.width / RES))
        self.s = (np.arange(self.ns) + 0.5) * RES - PAD
        self.u = (np.arange(self.nu) + 0.5) * RES
        self.dry = np.zeros((self.ns, self.nu), np.float32)
        self.wet = np.zeros_like(self.dry)
        self.film = np.zeros_like(self.dry)
        self.relief = np.zeros_like(self.dry)
        self.leaks, self.others, self.objects = [], [], []
        self.bounds = box(0.15, 0.0, self.length - 0.15, self.width)

    # raster -------------------------------------------------------------------------------------------------------------

    def noise(self, cs, cu, amp):
        a, b = _bspline(self.ns, cs / RES), _bspline(self.nu, cu / RES)
        g = self.rng.normal(size=(a.shape[1], b.shape[1])).astype(np.float32)
        return a @ g @ b.T * np.float32(amp / 0.48)

    def grain(self, sigma, amp):
        g = ndimage.gaussian_filter(self.rng.standard_normal((self.ns, self.nu), dtype=np.float32), sigma)
        return g * np.float32(amp / g.std())

    def field(self, poly, soft, pad=0.3):
        """Window and signed distance (metres, positive inside) of an outline; ramp of half width `soft`."""
        x0, y0, x1, y1 = poly.bounds
        i0, i1 = max(int((x0 - pad + PAD) / RES), 0), min(int((x1 + pad + PAD) / RES) + 1, self.ns)
        j0, j1 = max(int((y0 - pad) / RES), 0), min(int((y1 + pad) / RES) + 1, self.nu)
        shapely.prepare(poly)
        gs, gu = np.meshgrid(self.s[i0:i1], self.u[j0:j1], indexing="ij")
        m = shapely.contains_xy(poly, gs.ravel(), gu.ravel()).reshape(gs.shape)
        # what runs off the lining at a foot has no edge there
        ext = np.pad(m, ((0, 0), (60 if j0 == 0 else 0, 60 if j1 == self.nu else 0)), mode="edge")
        d = ndimage.distance_transform_edt(ext) - ndimage.distance_transform_edt(~ext)
        d = d[:, 60 if j0 == 0 else 0 :][:, : m.shape[1]] * RES
        w = np.clip(0.5 + d / (2 * max(soft, 0.006)), 0, 1)
        return (slice(i0, i1), slice(j0, j1)), m, d, w * w * (3 - 2 * w)

    def window(self, s0, s1, u0, u1):
        return (
            slice(max(int(round((s0 + PAD) / RES)), 0), max(int(round((s1 + PAD) / RES)), 0)),
            slice(max(int(round(u0 / RES)), 0), max(int(round(u1 / RES)), 0)),
        )

    def add(self, s0, s1, u0, u1, db=0.0, relief=0.0):
        w = self.window(s0, s1, u0, u1)
        self.dry[w] += db
        self.relief[w] += relief

    # outlines -----------------------------------------------------------------------------------------------------------

    def down(self, u):
        return -1.0 if u < self.width / 2 else 1.0

    def steep(self, u):
        """0 at a level crown, 1 at a vertical wall."""
        i = np.clip(np.searchsorted(self.tunnel.section.pu, u), 3, len(self.tunnel.section.pu) - 4)
        p = self.tunnel.section.pts
        t = p[i + 3] - p[i - 3]
        return abs(t[1]) / np.hypot(*t)

    def along(self, pts, r, vary=0.35):
        """What has soaked a line: discs whose radius wanders."""
        line = LineString(pts)
        n = max(int(line.length / 0.025), 2)
        c = shapely.get_coordinates(shapely.line_interpolate_point(line, np.linspace(0, line.length, n)))
        wander = ndimage.gaussian_filter1d(self.rng.normal(size=n + 40), 6)[20:-20]
        wander /= max(wander.std(), 1e-6) if n > 8 else 1
        taper = np.minimum(1, 0.45 + 0.1 * np.minimum(np.arange(n), np.arange(n)[::-1]))
        rr = np.clip(r * taper * (1 + vary * wander), 0.3 * r, 2.0 * r)
        return unary_union(shapely.buffer(shapely.points(c), rr, quad_segs=5))

    def blob(self, s, u, rs, ru):
        a = np.linspace(0, 2 * np.pi, 140, endpoint=False)
        f = sum(self.rng.normal() * 0.22 / k**0.9 * np.cos(k * a + self.rng.uniform(0, 6.3)) for k in range(2, 9))
        f = np.clip(1 + f, 0.45, 1.7)
        return Polygon(np.c_[s + rs * f * np.cos(a), u + ru * f * np.sin(a)]).buffer(0)

    def streak(self, s, u, length, w0, w1):
        """Water that runs down from a point."""
        n = max(int(length / 0.03), 3)
        t = np.linspace(0, 1, n)
        sway = np.cumsum(ndimage.gaussian_filter1d(self.rng.normal(size=n), 4)) * 0.012
        uu = np.clip(u + self.down(u) * length * t, 0, self.width)
        w = (w0 + (w1 - w0) * t) * (1 + 0.25 * ndimage.gaussian_filter1d(self.rng.normal(size=n), 4) * 2.5)
        return unary_union(shapely.buffer(shapely.points(np.c_[s + sway, uu]), np.clip(w, 0.015, None) / 2, quad_segs=4))

    def wander(self, s, u, length, heading, bend=0.35):
        """A crack: a path that turns a little at each step."""
        n = max(int(length / 0.1), 2)
        h = heading + np.cumsum(self.rng.normal(size=n) * bend * 0.35) - 0.0
        return np.vstack([[s, u], np.c_[s + np.cumsum(0.1 * np.cos(h)), u + np.cumsum(0.1 * np.sin(h))]])

    def ragged(self, g, amp=0.012):
        g = _single(g.buffer(0.02).buffer(-0.02))[0]
        g = Polygon(g.exterior, [r for r in g.interiors if Polygon(r).area > 0.02])
        c = shapely.get_coordinates(shapely.segmentize(g.exterior, 0.025))[:-1]
        if len(c) > 12:
            t = np.roll(c, -2, 0) - np.roll(c, 2, 0)
            t /= np.maximum(np.hypot(*t.T), 1e-9)[:, None]
            k = ndimage.gaussian_filter1d(self.rng.normal(size=len(c)), 2.5, mode="wrap")
            c = c + np.c_[t[:, 1], -t[:, 0]] * (k * amp * 2.5)[:, None]
            g = Polygon(c, [r.coords for r in g.interiors]).buffer(0)
        g = g.intersection(self.bounds)
        return _single(g.simplify(0.004))[0]

    # what is on it --------------------------------------------------------------------------------------------------------

    def draw(self):
        """A drop: median between 2.5 and 3 dB, few strong."""
        return float(np.clip(np.exp(self.rng.normal(np.log(2.9), 0.36)), 1.4, 6.5))

    def leak(
        self, build, phenomenon, drop=None, soft=0.04, least=0.0, film=False, fringe=0.0, limit=None, clear=0.3, keep=True
    ):
        """Draw a leak where `build(rng)` puts it; it keeps away from others."""
        for _ in range(60):
            poly = self.ragged(build())
            busy = [o for o, k, b in self.others if b]
            if poly.area >= least and all(poly.distance(q["poly"]) > clear for q in self.leaks):
                if not keep or all(poly.distance(o) > 0.08 for o in busy):
                    break
        else:
            raise RuntimeError(f"no room for {phenomenon}")
        drop = drop if drop is not None else self.draw()
        win, m, d, w = self.field(poly, soft)
        depth = np.clip(d / max(d.max(), 0.02), 0, 1)
        v = 0.72 + 0.28 * depth + self.patchy[win] * 0.12
        v = np.clip(v, 0.25, None) * w
        v *= drop / max(v[m].mean(), 1e-3)
        self.wet[win] = np.minimum(self.wet[win], -v)
        if film:
            self.film[win] = np.maximum(self.film[win], w * np.clip(depth * 2, 0, 1))
        if fringe:
            band = np.exp(-(((d + 0.05 + 0.02 * self.patchy[win]) / 0.035) ** 2)) * (self.patchy[win] > -0.4)
            self.dry[win] += fringe * ndimage.gaussian_filter(band, 1.5)
            ring = poly.buffer(0.1).difference(poly.buffer(0.01)).intersection(self.bounds)
            self.others.append((ring, "salt", False))
        self.leaks.append({"poly": poly, "phenomenon": phenomenon, "limit": limit})
        return poly

    def other(self, poly, kind, db, soft=0.02, mottle=0.15, busy=True, rim=0.0):
        poly = poly.intersection(self.bounds)
        if poly.is_empty:
            return
        win, m, d, w = self.field(poly, soft)
        self.dry[win] += (db * w * (1 + mottle * self.patchy[win])).astype(np.float32)
        if rim:
            self.dry[win] += (rim * np.exp(-(((d - 0.02) / 0.025) ** 2))).astype(np.float32)
        self.others.append((poly, kind, busy))

    def free(self, make, clear=0.1):
        """A shape for something dry that touches no other."""
        for _ in range(60):
            p = make()
            if all(p.distance(o) > clear for o, k, b in self.others if b):
                return p
        return p

    def prepare(self):
        self.patchy = np.clip(self.noise(0.18, 0.18, 1.0) + 0.5 * self.noise(0.07, 0.07, 1.0), -2.5, 2.5)

    # things before it -------------------------------------------------------------------------------------------------------

    def cable(self, u, h, r, db, s0=None, s1=None, every=None, dust=0.0):
        a, b = (-PAD if s0 is None else s0), (self.length + PAD if s1 is None else s1)
        self.objects.append(("s", a, b, u, h, r, db))
        if every:
            for x in np.arange(a + 0.6, b, every):
                self.objects.append(("box", x, x + 0.04, u - r - 0.03, u + r + 0.03, 0.0, h + r + 0.01, db + 1))
        if dust:
            dn = self.down(u)
            x = self.s[:, None]
            prof = np.exp(-(((self.u - u - dn * 0.07) / 0.05) ** 2))[None]
            self.dry += np.float32(dust) * (prof * (1 + 0.4 * self.noise(0.8, 5, 1.0)) * ((x > a) & (x < b))).astype(np.float32)
            p = box(max(a, 0.2), u + dn * 0.07 - 0.06, min(b, self.length - 0.2), u + dn * 0.07 + 0.06)
            self.others.append((p, "cable shadow", False))

    def riser(self, s, h, r, u0, u1, db):
        self.objects.append(("u", u0, u1, s, h, r, db))

    def case(self, s0, s1, u0, u1, depth, db):
        self.objects.append(("box", s0, s1, u0, u1, 0.0, depth, db))

    # scanning -----------------------------------------------------------------------------------------------------------------

    def sample(self, raster, s, u):
        i = np.clip(((s + PAD) / RES).astype(np.int64), 0, self.ns - 1)
        j = np.clip((u / RES).astype(np.int64), 0, self.nu - 1)
        return raster[i, j]

    def shoot(self, o, d, kit):
        """Rays to points: dict of arrays of those that came back."""
        tun, sec, rng = self.tunnel, self.tunnel.section, self.rng
        t = tun.cast(o, d, 25.5)
        keep = np.flatnonzero(np.isfinite(t))
        o, d, t = o[keep], d[keep], t[keep]
        s, y, z = tun.local(o + d * t[:, None])
        inside = (s > 0) & (s < self.length)
        keep, o, d, t, s, y, z = (a[inside] for a in (keep, o, d, t, s, y, z))
        idx = sec.index(y, z)
        u = sec.utab[idx]
        floor = np.isnan(u)
        ty, tz = sec.ty[idx], sec.tz[idx]
        cs, sn = np.cos(tun.kappa * s), np.sin(tun.kappa * s)
        ds = d[:, 0] * cs + d[:, 1] * sn
        dy = -d[:, 0] * sn + d[:, 1] * cs
        dz = d[:, 2]
        du = dy * ty + dz * tz
        dh = dy * tz - dz * ty  # inward normal is (tz, -ty)
        uu = np.where(floor, 0, u)
        rel = np.where(floor, rng.normal(0, kit["floor_rough"], len(t)), self.sample(self.relief, s, uu))
        cosi = np.clip(-dh, 0.15, 1)
        t = t - rel / cosi
        s_l = np.clip(s - ds * rel / cosi, 0, self.length)
        u_l = np.clip(uu - du * rel / cosi, 0, self.width - 1e-6)
        # incidence with the slope of the relief
        gs, gu = self.sample(self.slope[0], s_l, u_l), self.sample(self.slope[1], s_l, u_l)
        nrm = np.sqrt(1 + gs**2 + gu**2)
        cosi = np.where(floor, np.clip(-dh, 0.05, 1), np.clip((-dh + gs * ds + gu * du) / nrm, 0.05, 1))
        refl = np.where(floor, kit["floor_db"] + rng.normal(0, 0.8, len(t)), self.sample(self.total, s_l, u_l))
        film = np.where(floor, 0, self.sample(self.film, s_l, u_l))
        lining = ~floor
        # things before the lining
        best = np.zeros(len(t))
        what = np.full(len(t), np.nan)
        edge = np.zeros(len(t), bool)
        for ob in self.objects:
            kind, a0, a1 = ob[0], ob[1], ob[2]
            if kind == "s":
                _, _, _, c, h, r, db = ob
                cand = np.flatnonzero(lining & (s > a0 - 1.5) & (s < a1 + 1.5) & (np.abs(u_l - c) < 1.0))
                p, q, dp, run, drun = u_l[cand] - c, -h, du[cand], s_l[cand], ds[cand]
            elif kind == "u":
                _, _, _, c, h, r, db = ob
                cand = np.flatnonzero(lining & (np.abs(s_l - c) < 1.5) & (u_l > a0 - 1) & (u_l < a1 + 1))
                p, q, dp, run, drun = s_l[cand] - c, -h, ds[cand], u_l[cand], du[cand]
            if kind != "box":
                dq = dh[cand]
                aa = dp**2 + dq**2
                bb = p * dp + q * dq
                near = np.sqrt(np.clip(p**2 + q**2 - bb**2 / aa, 0, None))
                tt = -bb / aa - np.sqrt(np.clip(r * r - near**2, 0, None) / aa)
                at = run + drun * tt
                hit = (near < r + 0.004) & (at > a0) & (at < a1) & (tt < best[cand])
                sel = cand[hit]
                best[sel], what[sel], edge[sel] = tt[hit], db, near[hit] > r - 0.004
            else:
                _, s0, s1, u0, u1, h0, h1, db = ob
                cand = np.flatnonzero(lining & (s > s0 - 2) & (s < s1 + 2) & (u_l > u0 - 1) & (u_l < u1 + 1))
                lo, hi = np.full(len(cand), -np.inf), np.full(len(cand), np.inf)
                for x, v, b0, b1 in ((s_l[cand], ds[cand], s0, s1), (u_l[cand], du[cand], u0, u1), (0.0, dh[cand], h0, h1)):
                    v = np.where(np.abs(v) < 1e-9, 1e-9, v)
                    p0, p1 = (b0 - x) / v, (b1 - x) / v
                    lo, hi = np.maximum(lo, np.minimum(p0, p1)), np.minimum(hi, np.maximum(p0, p1))
                hit = (lo < hi) & (lo < best[cand]) & (hi <= 1e-6 + 0.02)
                sel = cand[hit]
                best[sel], what[sel], edge[sel] = lo[hit], db, False
        blocked = np.isfinite(what)
        lining &= ~blocked
        frac = np.where(edge, rng.uniform(0.2, 1.0, len(t)), 1.0)
        t = t + np.where(blocked, best * frac, 0)
        refl = np.where(blocked, what - np.where(edge, 2.5, 0) + rng.normal(0, 0.6, len(t)), refl)
        cosi = np.where(blocked, np.clip(rng.uniform(0.4, 1, len(t)), 0, 1), cosi)
        amp = kit["const"] + kit["range"](t) + kit["lambert"] * 10 * np.log10(cosi) + refl
        # a film of water: a little more in the mirror, less beside it
        amp = amp + np.where(blocked, 0, film * (3.0 * np.exp(-(((1 - cosi) / 0.0012) ** 2)) - 0.5 * (1 - cosi)))
        if kit.get("flash"):  # gloss of paint or iron
            amp = amp + np.where(lining, kit["flash"] * np.exp(-(((1 - cosi) / 0.004) ** 2)), 0)
        sig = kit["noise"] * np.sqrt(1 + 10 ** ((kit["weak"] - amp) / 10))
        amp = amp + rng.normal(0, 1, len(t)) * sig
        t = t + rng.normal(0, kit["range_noise"], len(t))
        good = (t > 1.5) & (t < 25) & (cosi > 0.16)
        out = {"xyz": o + d * t[:, None], "amp": amp, "s": s_l, "u": u_l, "lining": lining, "t": t, "ray": keep, "cos": cosi}
        return {k: v[good] for k, v in out.items()}

    def finish(self):
        self.total = self.dry + self.wet
        smooth = ndimage.gaussian_filter(self.relief, 2.0)
        self.slope = [np.clip(g, -1.2, 1.2).astype(np.float32) for g in np.gradient(smooth, RES)]
        self.smooth = ndimage.gaussian_filter(self.relief, 6.0)

    def mobile(self, folder, kit, spacing, across, height, offset=0.0, speed=1.0):
        """A profiler on a trolley."""
        self.finish()
        tun, rng = self.tunnel, self.rng
        period = spacing / speed
        n_prof = int((self.length + 0.4) / spacing)
        r_mean = np.median(tun.section.rtab)
        n_ang = int(2 * np.pi * r_mean / across)
        t0 = 312000.0 + rng.uniform(0, 5000)
        ph = rng.uniform(0, 6.3, 4)

        def pose(t):
            s = -0.2 + speed * t + 0.01 * np.sin(0.7 * t + ph[0])
            return s, offset + 0.012 * np.sin(0.9 * t + ph[1]), height + 0.006 * np.sin(1.3 * t + ph[2])

        parts = []
        jitter = rng.normal(0, kit.get("line", 0.08), n_prof)
        block = max(1, 500000 // n_ang)
        for k0 in range(0, n_prof, block):
            k = np.arange(k0, min(k0 + block, n_prof))
            frac = np.arange(n_ang) / n_ang
            t = ((k[:, None] + frac[None]) * period).ravel()
            prof = np.repeat(k, n_ang)
            a = np.tile(frac * 2 * np.pi, len(k))
            s, y, z = pose(t)
            o = tun.model(s, y, z)
            cy, cz = np.sin(a), -np.cos(a)
            h = tun.kappa * s
            d = np.stack([-cy * np.sin(h), cy * np.cos(h), cz], -1)
            got = self.shoot(o, d, kit)
            got["time"] = t0 + t[got["ray"]]
            tt = t[got["ray"]]
            got["amp"] = got["amp"] + jitter[prof[got["ray"]]] + kit.get("drift", 0.15) * np.sin(tt / 11 + ph[3])
            got["src"] = np.ones(len(tt), np.uint16)
            parts.append(got)
        pts = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
        tt = np.arange(-0.3, n_prof * period + 0.4, 0.1)
        traj = tun.world(tun.model(*pose(tt)))
        rows = ["time,x,y,z"] + [f"{t0 + a:.4f},{p[0]:.4f},{p[1]:.4f},{p[2]:.4f}" for a, p in zip(tt, traj, strict=True)]
        (folder / "trajectory.csv").write_text("\n".join(rows) + "\n")
        self.write(folder, pts, kit)

    def static(self, folder, kit, stations, step, cap, reach=9.0):
        """Stations (s, y, z); a grid of angles, thinned where it is too dense."""
        self.finish()
        tun, rng = self.tunnel, self.rng
        parts = []
        rows = ["scan_id,x,y,z"]
        for i, st in enumerate(stations, 1):
            o = tun.model(*st)
            w = tun.world(o)
            rows.append(f"{i},{w[0]:.4f},{w[1]:.4f},{w[2]:.4f}")
            bias = rng.normal(0, kit.get("station", 0.15))
            az0 = np.arange(0, 2 * np.pi, step)
            ze0 = np.arange(0.02, np.radians(142), step)
            for c in np.array_split(np.arange(len(az0)), 5):
                az, ze = np.meshgrid(az0[c], ze0, indexing="ij")
                az, ze = az.ravel(), ze.ravel()
                # a grid crowds at the zenith, and rays along the tunnel reach nothing of use
                keep = rng.random(len(ze)) < np.clip(1.15 * np.sin(ze), 0.0, 1)
                keep &= np.abs(np.cos(az) * np.sin(ze)) < 0.97
                az, ze = az[keep], ze[keep]
                h = az + tun.kappa * st[0]
                d = np.stack([np.sin(ze) * np.cos(h), np.sin(ze) * np.sin(h), np.cos(ze)], -1)
                got = self.shoot(np.repeat(o[None], len(d), 0), d, kit)
                dens = got["cos"] / (got["t"] ** 2 * step**2)
                ok = (rng.random(len(dens)) < cap / dens) & (np.abs(got["s"] - st[0]) < reach)
                got["time"] = 400000.0 + 600 * i + (az + 0.01 * ze)[got["ray"]] * 30
                got["src"] = np.full(len(dens), i, np.uint16)
                got["amp"] = got["amp"] + bias
                parts.append({k: v[ok] for k, v in got.items()})
        pts = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
        (folder / "stations.csv").write_text("\n".join(rows) + "\n")
        self.write(folder, pts, kit)

    # files -----------------------------------------------------------------------------------------------------------------

    def lift(self, g):
        """An outline on the unrolled lining as rings in space."""

        def ring(r):
            c = shapely.get_coordinates(shapely.segmentize(LineString(r.coords), 0.03))
            y, z, ny, nz = self.tunnel.section.at(c[:, 1])
            h = self.sample(self.smooth, c[:, 0], c[:, 1])
            p = self.tunnel.world(self.tunnel.model(c[:, 0], y + h * ny, z + h * nz))
            p[-1] = p[0]
            return [[round(float(v), 4) for v in q] for q in p]

        polys = [[ring(p.exterior)] + [ring(r) for r in p.interiors] for p in shapely.get_parts(g)]
        if len(polys) == 1:
            return {"type": "Polygon", "coordinates": polys[0]}
        return {"type": "MultiPolygon", "coordinates": polys}

    def write(self, folder, pts, kit):
        tun = self.tunnel
        folder = Path(folder)
        n = len(pts["amp"])
        if n > 2_950_000:
            sel = np.sort(self.rng.choice(n, 2_950_000, replace=False))
            pts = {k: v[sel] for k, v in pts.items()}
        xyz = tun.world(pts["xyz"])
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales = np.full(3, 0.0005)
        header.offsets = np.floor(xyz.min(0))
        header.add_crs(CRS.from_epsg(25832))
        header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
        las = laspy.LasData(header)
        las.x, las.y, las.z = xyz.T
        las.Amplitude = pts["amp"].astype(np.float32)
        las.intensity = np.clip(pts["amp"] * 1000, 0, 65535).astype(np.uint16)
        las.gps_time = pts["time"]
        las.point_source_id = pts["src"]
        las.return_number = np.ones(len(xyz), np.uint8)
        las.number_of_returns = np.ones(len(xyz), np.uint8)
        las.write(str(folder / "scan.laz"))

        a = tun.world(tun.model(np.arange(-4.0, tun.length + 4.01, 2.0), 0.0, 0.0))
        (folder / "axis.csv").write_text("x,y,z\n" + "".join(f"{p[0]:.4f},{p[1]:.4f},{p[2]:.4f}\n" for p in a))
        if kit["reference"]:
            r = np.arange(1.0, 26.01, 0.25)
            v = kit["const"] + kit["range"](r) + 10 * np.log10(kit["target"]) + self.rng.normal(0, 0.04, len(r))
            rows = "".join(f"{x:.2f},{y:.3f}\n" for x, y in zip(r, v, strict=True))
            (folder / "reference.csv").write_text("range_m,intensity_db\n" + rows)

        # behind what is wider than 0.15 m nothing is drawn
        cell = 0.05
        cnt, _, _ = np.histogram2d(
            pts["s"][pts["lining"]],
            pts["u"][pts["lining"]],
            bins=[np.arange(0, tun.length + cell, cell), np.arange(0, self.width + cell, cell)],
        )
        blind = ndimage.binary_opening(cnt == 0, np.ones((4, 4)))
        i, j = np.nonzero(blind)
        cells = shapely.STRtree(shapely.box(i * cell, j * cell, (i + 1) * cell, (j + 1) * cell)) if len(i) else None

        crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
        wetall = unary_union([q["poly"] for q in self.leaks]) if self.leaks else Polygon()
        darkall = unary_union([o for o, k, b in self.others if b]) if self.others else Polygon()
        lin = np.flatnonzero(pts["lining"])
        ps, pu = pts["s"][lin], pts["u"][lin]
        flat = pts["amp"] - kit["const"] - kit["range"](pts["t"]) - kit["lambert"] * 10 * np.log10(pts["cos"])
        feats = []
        for k, q in enumerate(self.leaks, 1):
            g = q["poly"]
            if cells is not None:
                hid = cells.query(g, predicate="intersects")
                if len(hid):
                    cut = unary_union(cells.geometries[hid]).buffer(0.02, join_style="mitre").buffer(-0.02, join_style="mitre")
                    parts = [p for p in _single(g.difference(cut)) if p.area > 0.01]
                    g = MultiPolygon(parts) if len(parts) > 1 else parts[0] if parts else None
            if g is None:
                continue
            about = g.buffer(0.4).difference(g.buffer(0.07)).difference(wetall.buffer(0.07)).difference(darkall.buffer(0.04))
            about = about.intersection(self.bounds)
            if about.area < 0.05:
                about = g.buffer(0.5).difference(wetall.buffer(0.07)).intersection(self.bounds)
            x0, y0, x1, y1 = about.bounds
            w = self.window(max(x0, 0), x1 + RES, max(y0, 0), y1 + RES)
            gs, gu = np.meshgrid(self.s[w[0]], self.u[w[1]], indexing="ij")
            t = self.total[w]
            m_in = shapely.contains_xy(g, gs.ravel(), gu.ravel()).reshape(t.shape)
            m_out = shapely.contains_xy(about, gs.ravel(), gu.ravel()).reshape(t.shape)
            drop = float(t[m_out].mean() - t[m_in].mean())
            # what the scan shows of it, once range and incidence are taken out (mirror of the film, what is mixed, and so on)
            near = lin[(ps > x0) & (ps < x1) & (pu > y0) & (pu < y1)]
            p_in = shapely.contains_xy(g, pts["s"][near], pts["u"][near])
            p_out = shapely.contains_xy(about, pts["s"][near], pts["u"][near])
            if min(p_in.sum(), p_out.sum()) >= 30:
                drop = float(flat[near][p_out].mean() - flat[near][p_in].mean())
            prop = {"id": k, "drop_db": round(drop, 2), "phenomenon": q["phenomenon"]}
            if q["limit"] or drop < 0.8:
                prop["limit"] = q["limit"] or "It is hardly darker than the dry lining about it."
            feats.append({"type": "Feature", "properties": prop, "geometry": self.lift(g)})
        doc = {"type": "FeatureCollection", "crs": crs, "features": feats}
        (folder / "truth.geojson").write_text(json.dumps(doc))
        feats = []
        for g, kind, _ in self.others:
            parts = [p for p in _single(g.difference(wetall.buffer(0.01))) if p.area > 0.005]
            for p in parts:
                feats.append({"type": "Feature", "properties": {"id": len(feats) + 1, "kind": kind}, "geometry": self.lift(p)})
        doc = {"type": "FeatureCollection", "crs": crs, "features": feats}
        (folder / "other.geojson").write_text(json.dumps(doc))


# -------------------------------------------------------------------------------------------------------------- instruments


def pulsed(r):
    """Time of flight, coaxial: a little less near than the law of squares says."""
    return -20 * np.log10(r / 5) - 2.2 * np.exp(-((r / 2.2) ** 2))


def phase(r):
    """Phase difference: the optics hold back near range."""
    return -16.5 * np.log10(r / 5) - 6.5 * np.exp(-r / 1.9)


def pocket(r):
    """A small scanner: optics that gather best at 3 m, ripple left from its own correction."""
    return -20 * np.log10(np.hypot(r, 2.4) / 5) + 0.25 * np.sin(r * 0.9)


def kit(rng_curve, const, noise=0.35, range_noise=0.002, lambert=0.8, reference=True, **more):
    base = {"range": rng_curve, "const": const, "noise": noise, "range_noise": range_noise, "lambert": lambert}
    base |= {"reference": reference, "target": 0.8, "floor_db": -9.0, "floor_rough": 0.006, "weak": const - 22.0}
    return base | more


# --------------------------------------------------------------------------------------------------------------------- scenes


def _concrete(cv, grain=0.35, cloud=0.35, large=0.4):
    """Skin of concrete: grain, clouds, and what differs over metres."""
    cv.prepare()
    cv.dry += cv.noise(2.5, 1.8, large) + cv.noise(0.5, 0.4, cloud) + cv.noise(0.12, 0.12, 0.2) + cv.grain(0.8, grain)
    cv.relief += cv.noise(1.5, 1.5, 0.003)


def _u(cv, lo, hi):
    """A developed length between shares of the lining, on either side."""
    x = cv.rng.uniform(lo, hi) * cv.width
    return x if cv.rng.random() < 0.5 else cv.width - x


def metro_segments(folder):
    """Running tunnel, rings of 1.5 m, six segments and a key, profiler."""
    tun = Tunnel(30.0, circle(2.75, 1.75, bench=(0.75, -0.85)), (691423.4, 5335870.2, 498.31), 63.0, 1 / 420, -0.012)
    cv = Canvas(tun, 1201)
    rng = cv.rng
    cv.dry += -5.2
    _concrete(cv, 0.3, 0.25, 0.3)
    rings = np.arange(0.6, 30.6, 1.5)
    joints = []
    for k, s0 in enumerate(np.r_[rings[0] - 1.5, rings]):
        s1 = s0 + 1.5
        cuts = np.sort(np.r_[np.arange(0.35 + (k % 2) * 1.15, cv.width, 2.3)])
        edges = np.r_[0, cuts, cv.width]
        for u0, u1 in zip(edges[:-1], edges[1:], strict=True):
            tone = rng.normal(0, 0.35)
            cv.add(s0, s1, u0, u1, tone, rng.normal(0, 0.002))
            if rng.random() < 0.035 and u1 - u0 > 1 and s0 > 0:  # another batch, or coated afterwards
                cv.other(box(s0 + 0.01, u0 + 0.01, s1 - 0.01, u1 - 0.01), "dark segment", -rng.uniform(1.6, 2.8), 0.008, 0.08)
            mid = (u0 + u1) / 2
            if u1 - u0 > 1.2:  # grout socket, bolt pockets
                for du in (-0.65, 0.65):
                    for sa in (s0 + 0.1, s1 - 0.22):
                        cv.add(sa, sa + 0.12, mid + du - 0.07, mid + du + 0.07, -0.9, -0.04)
                win, m, d, w = cv.field(Point(s0 + 0.75, mid).buffer(0.04), 0.01)
                cv.dry[win] -= 1.4 * w
                cv.relief[win] -= 0.015 * w
        for c in cuts:
            cv.add(s0, s1, c - 0.01, c + 0.01, -1.2, -0.012)
            joints.append((s0, s1, c))
    for s0 in rings:
        cv.add(s0 - 0.01, s0 + 0.01, 0, cv.width, -1.2, -0.012)
    # dust that lies on the lower half; soot at the crown from work trains
    cv.dry += (-0.9 * np.clip((np.abs(cv.u - cv.width / 2) - 3.2) / 3.0, 0, 1) ** 1.3)[None].astype(np.float32)
    cv.cable(1.9, 0.09, 0.022, -11.0, every=1.0, dust=-0.8)
    cv.cable(2.06, 0.09, 0.03, -12.0, every=1.0)
    cv.cable(2.25, 0.09, 0.018, -8.5, every=1.0, dust=-0.6)
    cv.cable(cv.width - 1.7, 0.08, 0.04, -6.5, every=3.0)
    for s0 in (4.3, 12.3, 20.3, 28.3):
        cv.case(s0, s0 + 0.9, cv.width - 3.3, cv.width - 3.1, 0.12, -3.5)
    cv.case(15.4, 16.1, 2.9, 3.5, 0.22, -4.5)
    # dry things
    for _ in range(4):  # repairs with mortar at edges of segments
        s0, j = rng.choice(rings[1:-1]), rng.uniform(1, cv.width - 2)
        p = cv.free(
            lambda s0=s0, j=j: box(
                s0 + 0.012, (v := j + rng.uniform(-1.5, 1.5)), s0 + rng.uniform(0.2, 0.55), v + rng.uniform(0.25, 0.7)
            )
        )
        cv.other(p, "repair", -rng.uniform(1.5, 3.5), 0.008, 0.1)
    for _ in range(3):
        p = cv.free(lambda: cv.streak(rng.uniform(1, 29), cv.width - 3.0, rng.uniform(0.4, 1.0), 0.03, 0.07))
        cv.other(p, "rust", -rng.uniform(1.5, 3.0), 0.01)
    for _ in range(2):  # what leaked before the injection: calcite, dry
        s0 = rng.choice(rings[2:-2])
        p = cv.free(lambda s0=s0: cv.ragged(cv.along([(s0, (v := rng.uniform(3, 9))), (s0, v + 0.9)], 0.07)))
        cv.other(p, "calcite", 1.8, 0.02, 0.3)
    p = cv.free(lambda: box((v := rng.uniform(5, 24)), cv.width - 1.4, v + 1.0, cv.width - 1.0))
    cv.other(p, "paint", -4.2, 0.004, 0.03)
    cv.other(cv.blob(22.5, 7.3, 3.2, 1.1), "soot", -1.7, 0.45, 0.3, busy=False)

    def ring_joint(lo=0.15, hi=0.5, length=(0.8, 2.2), r=0.1):
        def build():
            s0 = rng.choice(rings[1:-1])
            u0, n = _u(cv, lo, hi), rng.uniform(*length)
            g = [cv.along([(s0, u0), (s0, np.clip(u0 + n, 0, cv.width))], r)]
            for _ in range(rng.integers(0, 3)):
                v = u0 + rng.uniform(0.2, 0.9) * n
                if 0 < v < cv.width and cv.steep(v) > 0.35:
                    g.append(cv.streak(s0, v, rng.uniform(0.4, 1.3), 0.18, 0.08))
            return unary_union(g)

        return build

    def long_joint():
        s0, s1, c = joints[rng.integers(len(joints))]
        a = s0 + rng.uniform(0.0, 0.4)
        g = [cv.along([(a, c), (a + rng.uniform(0.6, 1.1), c)], 0.1)]
        if cv.steep(c) > 0.4:
            g.append(cv.streak(a + 0.4, c, rng.uniform(0.4, 1.1), 0.16, 0.07))
        return unary_union(g)

    def cross():
        s0, s1, c = joints[rng.integers(len(joints))]
        e = rng.choice([s0, s1])
        sg = 1 if e == s0 else -1
        v = rng.uniform(0.3, 0.6)
        return unary_union(
            [cv.along([(e, c - v), (e, c + v)], 0.09), cv.along([(e, c), (e + sg * rng.uniform(0.3, 0.7), c)], 0.07)]
        )

    def socket():
        s0, u0 = rng.choice(rings[1:-2]) + 0.75, _u(cv, 0.25, 0.4)
        return unary_union([cv.blob(s0, u0, 0.15, 0.15), cv.streak(s0, u0, rng.uniform(0.6, 1.2), 0.16, 0.07)])

    def foot():
        left = rng.random() < 0.5
        s0 = rng.choice(rings[2:-2])
        u0 = cv.width if left else 0.0
        return unary_union(
            [cv.along([(s0, u0), (s0, abs(u0 - rng.uniform(0.7, 1.2)))], 0.09), cv.blob(s0, u0, rng.uniform(0.4, 0.8), 0.22)]
        )

    for _ in range(4):
        cv.leak(ring_joint(), "wet joint", least=0.1, soft=0.03)
    cv.leak(ring_joint(0.35, 0.5, (1.4, 2.4), 0.1), "wet joint", 4.9, 0.03, film=True, fringe=1.6)
    for _ in range(2):
        cv.leak(long_joint, "wet joint", least=0.1, soft=0.03)
    for _ in range(2):
        cv.leak(cross, "corner", least=0.12, soft=0.03)
    cv.leak(socket, "drip", soft=0.02)
    cv.leak(foot, "floor edge", soft=0.05)
    cv.leak(ring_joint(0.2, 0.45, (0.3, 0.4), 0.05), "wet joint", 2.0, 0.02)
    cv.mobile(folder, kit(phase, 38.0, 0.4, 0.0015, 0.75, floor_db=-8.5), 0.02, 0.02, 0.1, offset=-0.1)


def road_cast(folder):
    """Two lanes, cast blocks of 10 m, light paint on the walls, soot above; stations."""
    tun = Tunnel(32.0, horseshoe(4.9, 1.9, 0.12, kerb=0.85), (603218.7, 5198442.5, 734.6), 141.0, -1 / 650, 0.021)
    cv = Canvas(tun, 1202)
    rng = cv.rng
    cv.dry += -5.6
    _concrete(cv, 0.3, 0.3, 0.35)
    blocks = [5.8, 15.8, 25.8]
    prev = -PAD
    for b in [*blocks, 33.0]:  # every block its own day of concrete
        cv.add(prev, b, 0, cv.width, rng.normal(0, 0.35))
        prev = b
    forms = np.arange(-0.2, 33, 2.0)
    for f in forms:
        cv.add(f - 0.01, f + 0.01, 2.4, cv.width - 2.4, -0.35, 0.002)
    for b in blocks:
        cv.add(b - 0.015, b + 0.015, 0, cv.width, -2.0, -0.02)
    top = 3.1
    for a, b in ((0, top), (cv.width - top, cv.width)):  # coat of paint, dirty below, where spray reaches
        win = cv.window(-PAD, 33, a, b)
        cv.dry[win] += 1.8
    cv.others.append((box(0.2, 0.9, 31.8, top), "paint", False))
    cv.others.append((box(0.2, cv.width - top, 31.8, cv.width - 0.9), "paint", False))
    low = np.minimum(cv.u, cv.width - cv.u)
    cv.dry += (-1.6 * np.exp(-low / 0.5))[None].astype(np.float32) * (1 + 0.25 * cv.noise(0.7, 0.5, 1.0))
    # soot thickest at the crown, in clouds; washed walls
    cv.dry -= (1.5 * np.exp(-(((cv.u - cv.width / 2 - 0.6) / 2.6) ** 2)))[None].astype(np.float32) * (
        1 + 0.2 * cv.noise(2.5, 1.2, 1.0)
    )
    cv.others.append((box(0.2, cv.width / 2 - 2.0, 31.8, cv.width / 2 + 3.0), "soot", False))
    for s0 in np.arange(2.0, 32, 6.0):  # luminaires and the tray they hang on
        cv.case(s0, s0 + 1.3, cv.width / 2 - 2.3, cv.width / 2 - 1.95, 0.25, -5)
    cv.case(-PAD, 32.5, cv.width / 2 - 1.75, cv.width / 2 - 1.42, 0.1, -6.5)
    cv.cable(cv.width / 2 + 1.9, 0.06, 0.02, -10, every=1.5, dust=-0.6)
    cv.case(11.0, 11.8, 1.1, 2.2, 0.2, -3.5)
    cv.case(21.0, 21.5, cv.width - 2.4, cv.width - 1.8, 0.18, -9.5)
    cv.riser(21.25, 0.03, 0.022, cv.width - 6.5, cv.width - 2.4, -8)
    for _ in range(5):
        p = cv.free(
            lambda: box(
                (a := rng.uniform(1, 30)),
                (b := rng.uniform(3.4, cv.width - 4.5)),
                a + rng.uniform(0.3, 1.1),
                b + rng.uniform(0.3, 0.9),
            )
        )
        cv.other(p, "repair", -rng.uniform(1.4, 3.2), 0.008, 0.12)
    for _ in range(3):  # blotches of form oil
        p = cv.free(
            lambda: cv.ragged(cv.blob(rng.uniform(2, 30), _u(cv, 0.25, 0.45), rng.uniform(0.2, 0.6), rng.uniform(0.15, 0.4)))
        )
        cv.other(p, "form oil", -rng.uniform(1.2, 2.0), 0.05, 0.3)
    for _ in range(3):  # old injections: a row of packers, resin dark and glossy
        p = cv.free(
            lambda: cv.ragged(
                cv.along(cv.wander(rng.uniform(3, 28), _u(cv, 0.25, 0.4), rng.uniform(0.8, 1.6), rng.uniform(0, 0.4)), 0.04)
            )
        )
        cv.other(p, "resin", -rng.uniform(2.0, 3.5), 0.006, 0.1)
    p = cv.free(lambda: box((v := rng.uniform(3, 26)), cv.width - 2.6, v + 1.3, cv.width - 2.3))
    cv.other(p, "sign", -3.5, 0.004, 0.03)
    cv.other(cv.ragged(cv.along([(25.8, 2.4), (25.8, 3.9)], 0.09)), "calcite", 1.7, 0.02, 0.3)
    for s0 in (8.4, 18.3):  # dried stain: a rim is left of it
        p = cv.free(lambda s0=s0: cv.ragged(cv.blob(s0 + rng.uniform(-1, 1), _u(cv, 0.22, 0.3), 0.35, 0.55)))
        cv.other(p, "dry stain", -0.5, 0.03, 0.3, rim=-1.2)

    def block(lo, hi, n):
        def build():
            b, u0 = rng.choice(blocks), _u(cv, lo, hi)
            ln = rng.uniform(*n) * cv.down(u0)
            g = [cv.along([(b, u0), (b, np.clip(u0 + ln, 0, cv.width))], rng.uniform(0.09, 0.14))]
            if cv.steep(u0) > 0.3:
                g.append(cv.streak(b + rng.uniform(0.05, 0.2), u0 + 0.5 * ln, rng.uniform(0.5, 1.3), 0.2, 0.08))
            return unary_union(g)

        return build

    def crack(lo=0.22, hi=0.48, lengthwise=True, n=(1.2, 2.6)):
        def build():
            path = cv.wander(
                rng.uniform(2, 28), _u(cv, lo, hi), rng.uniform(*n), rng.normal(0, 0.25) + (0 if lengthwise else np.pi / 2)
            )
            g = [cv.along(path, rng.uniform(0.06, 0.1))]
            for _ in range(rng.integers(1, 4)):
                q = path[rng.integers(len(path))]
                if cv.steep(np.clip(q[1], 0, cv.width)) > 0.35:
                    g.append(cv.streak(q[0], q[1], rng.uniform(0.3, 1.2), 0.13, 0.05))
            return unary_union(g)

        return build

    for _ in range(2):
        cv.leak(block(0.28, 0.46, (0.8, 2.0)), "wet joint", soft=0.04)
    cv.leak(block(0.1, 0.18, (1.6, 2.6)), "wet joint", 3.6, 0.05, film=True)
    for _ in range(3):
        cv.leak(crack(), "wet crack", soft=0.03, least=0.1)
    cv.leak(crack(0.12, 0.25, False, (1.5, 2.5)), "wet crack", 2.4, 0.03, fringe=1.4)
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 29), cv.width / 2 + rng.uniform(0.2, 1.3), rng.uniform(0.3, 0.6), 0.35),
        "patch",
        2.7,
        0.08,
        keep=False,
    )
    cv.leak(
        lambda: cv.ragged(
            unary_union(
                [cv.blob((a := rng.uniform(3, 29)), (b := _u(cv, 0.3, 0.4)), 0.14, 0.14), cv.streak(a, b, 1.3, 0.17, 0.07)]
            )
        ),
        "drip",
        5.2,
        0.02,
    )
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 29), rng.choice([0.0, cv.width]), rng.uniform(0.6, 1.0), 0.4), "floor edge", 2.2, 0.07
    )
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 29), cv.width / 2 + rng.uniform(-0.8, 1.2), 0.5, 0.4),
        "patch",
        0.6,
        0.15,
        limit="Faint damp in the soot of the crown, no darker than its clouds.",
        keep=False,
    )
    st = [(s0, -0.9 + 0.2 * k, -0.25) for k, s0 in enumerate((3.5, 11.5, 19.5, 28.0))]
    cv.static(folder, kit(pulsed, 31.0, 0.4, 0.002, 0.8, floor_db=-10, flash=1.0), st, 0.0026, 1000, 9.0)


def rail_brick(folder):
    """Double track of the age of steam: brick, soot, relined stretches; stations, no reference."""
    tun = Tunnel(27.0, horseshoe(4.05, 2.1, 0.35), (447891.2, 5701233.9, 182.45), 12.0, 1 / 500, 0.007)
    cv = Canvas(tun, 1203)
    rng = cv.rng
    cv.prepare()
    cv.dry += -6.5
    course = np.floor(cv.u / 0.076).astype(int)
    ss = cv.s[:, None] + 0.118 * (course % 2)[None]
    brick = np.floor((ss + 2) / 0.236).astype(int)
    tone = rng.normal(0, 0.65, (brick.max() + 1, course.max() + 1)).astype(np.float32)
    tone -= (rng.random(tone.shape) < 0.04) * rng.uniform(0.8, 2.2, tone.shape).astype(np.float32)  # burnt headers
    cv.dry += tone[brick, course[None]]
    mortar = (np.mod(ss + 2, 0.236) < 0.011) | (np.mod(cv.u, 0.076) < 0.010)[None]
    cv.dry += np.where(mortar, np.float32(0.9), 0)
    cv.relief += np.where(mortar, np.float32(-0.006), 0) + cv.noise(2, 1.5, 0.008)
    cv.dry += cv.noise(3.0, 1.5, 0.5) + cv.noise(0.6, 0.5, 0.4) + cv.grain(0.8, 0.35)
    # steam soot on the crown and haunches
    soot = np.exp(-(((cv.u - cv.width / 2) / 2.9) ** 4))[None].astype(np.float32) * np.clip(
        1 + 0.35 * cv.noise(2.2, 1.0, 1.0), 0.2, 1.8
    )
    cv.dry -= 2.0 * soot
    cv.others.append((box(0.2, cv.width / 2 - 2.9, 26.8, cv.width / 2 + 2.9), "soot", False))
    # soot has fallen off in places: bright
    for _ in range(6):
        p = cv.free(
            lambda: cv.ragged(
                cv.blob(
                    rng.uniform(1, 26), cv.width / 2 + rng.uniform(-2.5, 2.5), rng.uniform(0.2, 0.5), rng.uniform(0.15, 0.4)
                )
            )
        )
        cv.other(p, "spalled", 1.8, 0.015, 0.2)
    for _ in range(4):  # relined with engineering brick: courses bound it

        def reline():
            a, b = rng.uniform(1, 24), 0.076 * int(rng.uniform(4, cv.width / 0.076 - 25))
            return box(a, b, a + 0.236 * rng.integers(3, 8), b + 0.076 * rng.integers(6, 18))

        cv.other(cv.free(reline), "repair", -rng.uniform(1.6, 3.4), 0.006, 0.12)
    for _ in range(2):
        p = cv.free(lambda: box((a := rng.uniform(2, 24)), 0.4, a + rng.uniform(0.6, 1.5), 1.4))
        cv.other(p, "render", 1.3, 0.01, 0.2)
    for _ in range(3):  # lime curtains, long dry
        p = cv.free(
            lambda: cv.ragged(
                unary_union(
                    [cv.streak((a := rng.uniform(1, 26)) + 0.1 * k, _u(cv, 0.2, 0.2), 1.1, 0.12, 0.05) for k in range(1)]
                )
            )
        )
        cv.other(p, "calcite", 2.2, 0.02, 0.3)
    cv.other(
        cv.free(lambda: box((a := rng.uniform(4, 20)), cv.width - 1.9, a + 0.9, cv.width - 1.5)), "paint", 3.0, 0.004, 0.05
    )
    cv.other(cv.free(lambda: cv.ragged(cv.blob(rng.uniform(4, 22), cv.width - 0.5, 0.9, 0.35))), "oil", -2.4, 0.05, 0.2)
    # brake dust towards the foot
    low = np.minimum(cv.u, cv.width - cv.u)
    cv.dry += (-1.3 * np.exp(-((low / 0.55) ** 2)))[None].astype(np.float32) * (1 + 0.3 * cv.noise(1.2, 0.5, 1.0))
    cv.cable(1.7, 0.08, 0.03, -12, every=1.2, dust=-0.9)
    cv.cable(1.86, 0.08, 0.02, -11, every=1.2)
    cv.cable(cv.width - 1.25, 0.07, 0.035, -9.0, every=2.0)
    weeps = [(s0, u0) for s0 in np.arange(2.5, 26, 4.0) for u0 in (0.95, cv.width - 0.95)]
    for s0, u0 in weeps:
        cv.add(s0 - 0.04, s0 + 0.04, u0 - 0.04, u0 + 0.04, -4.0, -0.06)

    def course_wet():
        u0 = 0.076 * round(_u(cv, 0.2, 0.42) / 0.076)
        a, n = rng.uniform(1.5, 23), rng.uniform(0.7, 1.8)
        g = [cv.along([(a, u0), (a + n, u0)], 0.1)]
        if cv.steep(u0) > 0.3:
            g += [cv.streak(a + n * rng.random(), u0, rng.uniform(0.4, 1.4), 0.2, 0.1) for _ in range(2)]
        return unary_union(g)

    def patch(lo, hi):
        return lambda: cv.blob(rng.uniform(2, 25), _u(cv, lo, hi), rng.uniform(0.3, 0.8), rng.uniform(0.25, 0.7))

    def curtain():
        a, u0 = rng.uniform(2, 24), _u(cv, 0.27, 0.36)
        g = [cv.along([(a, u0), (a + 0.9, u0)], 0.09)]
        return unary_union(g + [cv.streak(a + x, u0, rng.uniform(0.9, 2.2), 0.22, 0.1) for x in (0.1, 0.45, 0.8)])

    def weep():
        s0, u0 = weeps[rng.integers(len(weeps))]
        return unary_union([cv.blob(s0, u0, 0.16, 0.13), cv.along([(s0, u0), (s0 + 0.05, 0.0 if u0 < 3 else cv.width)], 0.1)])

    def crack():
        path = cv.wander(rng.uniform(2, 24), _u(cv, 0.2, 0.4), rng.uniform(1.2, 2.2), rng.uniform(0.4, 1.2))
        return cv.along(path, 0.09)

    for _ in range(3):
        cv.leak(course_wet, "wet joint", soft=0.05)
    for _ in range(2):
        cv.leak(patch(0.25, 0.45), "patch", soft=0.07)
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 24), _u(cv, 0.16, 0.36), rng.uniform(0.9, 1.3), rng.uniform(0.7, 1.0)),
        "patch",
        2.6,
        0.08,
        keep=False,
    )
    cv.leak(curtain, "curtain", 3.9, 0.05, film=True)
    for _ in range(2):
        cv.leak(weep, "hole", soft=0.04)
    cv.leak(crack, "wet crack", soft=0.04)
    cv.leak(patch(0.14, 0.22), "salt fringe", 2.3, 0.06, fringe=1.9)
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 24), rng.choice([0.0, cv.width]), rng.uniform(0.7, 1.3), 0.45), "floor edge", 2.6, 0.08
    )
    st = [(s0, 1.2, -0.4) for s0 in (3.2, 10.0, 17.0, 23.8)]
    cv.static(
        folder, kit(pulsed, 33.0, 0.45, 0.003, 0.65, reference=False, floor_db=-11, floor_rough=0.03), st, 0.0028, 900, 8.0
    )


def water_dry(folder):
    """Headrace tunnel, drained for inspection and dried for weeks: deposits, tide marks, no leak."""
    tun = Tunnel(30.0, circle(2.3, 1.75), (584120.8, 5241377.1, 1187.22), 205.0, 0.0, -0.003)
    cv = Canvas(tun, 1204)
    rng = cv.rng
    cv.dry += -5.8
    _concrete(cv, 0.3, 0.35, 0.45)
    for s0 in (2.2, 8.2, 14.2, 20.2, 26.2):
        cv.add(s0 - 0.012, s0 + 0.012, 0, cv.width, -1.5, -0.012)
    for u0 in (2.1, cv.width - 2.1):
        cv.add(-PAD, 31, u0 - 0.008, u0 + 0.008, -0.8, -0.004)
    low = np.minimum(cv.u, cv.width - cv.u)[None] + 0.06 * cv.noise(1.2, 20, 1.0)
    # manganese skin below the water line, tide mark above, silt at the foot
    cv.dry += (
        -1.3 / (1 + np.exp((low - 2.0) / 0.05)) + 0.7 * np.exp(-(((low - 2.08) / 0.04) ** 2)) + 1.0 * np.exp(-low / 0.2)
    ).astype(np.float32)
    cv.others.append((box(0.2, 0.0, 29.8, 2.0), "manganese", False))
    cv.others.append((box(0.2, cv.width - 2.0, 29.8, cv.width), "manganese", False))
    for _ in range(9):
        p = cv.free(
            lambda: cv.ragged(cv.blob(rng.uniform(1, 29), _u(cv, 0.05, 0.48), rng.uniform(0.2, 0.8), rng.uniform(0.15, 0.5)))
        )
        cv.other(p, "manganese", -rng.uniform(1.3, 3.0), rng.uniform(0.02, 0.1), 0.35)
    for _ in range(6):
        p = cv.free(
            lambda: box(
                (a := rng.uniform(0.5, 28)),
                (b := rng.uniform(0.5, cv.width - 1.2)),
                a + rng.uniform(0.3, 1.2),
                b + rng.uniform(0.25, 0.8),
            )
        )
        cv.other(p, "repair", -rng.uniform(1.5, 3.5), 0.008, 0.12)
    for k in range(5):  # cracks sealed with resin, joints with a band of mortar
        p = cv.free(
            lambda: cv.along(
                cv.wander(rng.uniform(2, 26), _u(cv, 0.15, 0.45), rng.uniform(0.8, 2.2), rng.uniform(0, 3)), 0.03, 0.15
            )
        )
        cv.other(p, "resin", -rng.uniform(2.0, 3.5), 0.006, 0.1)
    for s0, a, b in ((8.2, 2.6, 5.4), (20.2, 5.0, 8.6)):
        cv.other(box(s0 - 0.14, a, s0 + 0.14, b), "repair", -2.2, 0.008, 0.12)
    for s0 in (2.2, 14.2, 14.2, 26.2):
        p = cv.free(
            lambda s0=s0: cv.ragged(cv.along([(s0, (v := rng.uniform(2.5, 6.5))), (s0, v + rng.uniform(0.5, 1.4))], 0.08))
        )
        cv.other(p, "calcite", 1.8, 0.025, 0.3)
    for _ in range(4):  # stains with a rim: damp once, dry now
        p = cv.free(lambda: cv.ragged(cv.streak(rng.uniform(2, 28), _u(cv, 0.27, 0.4), rng.uniform(0.7, 1.5), 0.22, 0.12)))
        cv.other(p, "dry stain", -0.7, 0.03, 0.3, rim=-0.9)
    for _ in range(4):
        p = cv.free(lambda: cv.streak(rng.uniform(2, 28), _u(cv, 0.25, 0.4), rng.uniform(0.3, 0.8), 0.03, 0.06))
        cv.other(p, "rust", -rng.uniform(1.5, 2.8), 0.01)
    for s0 in np.arange(1.2, 30, 3.0):  # plugs of the contact grouting
        for u0 in (0.3, 0.5, 0.7):
            win, m, d, w = cv.field(Point(s0, u0 * cv.width).buffer(0.045), 0.01)
            cv.dry[win] -= 1.6 * w
    cv.mobile(folder, kit(pulsed, 36.0, 0.35, 0.002, 0.85, floor_db=-6.5), 0.022, 0.02, -0.05, offset=0.05, speed=0.8)


def metro_iron(folder):
    """Cast iron, rings of 0.5 m with flanges, painted; profiled from a fast trolley, so that points are 4 cm apart."""
    tun = Tunnel(32.0, circle(2.55, 1.6), (565904.3, 5933101.6, -11.84), 288.0, -1 / 300, 0.016)
    cv = Canvas(tun, 1205)
    rng = cv.rng
    cv.prepare()
    cv.dry += -6.8
    cv.dry += cv.noise(2.5, 1.5, 0.4) + cv.noise(0.4, 0.3, 0.35) + cv.grain(0.9, 0.35)
    rings = np.arange(-0.25, 32.5, 0.5)
    longs = []
    for k, s0 in enumerate(rings):
        cuts = np.arange(0.55 + (k % 2) * 0.6, cv.width, 1.32)
        for u0, u1 in zip(np.r_[0, cuts], np.r_[cuts, cv.width], strict=True):
            cv.add(s0, s0 + 0.5, u0, u1, rng.normal(0, 0.4))
            if u1 - u0 > 1 and rng.random() < 0.025 and 1 < s0 < 31:
                cv.other(box(s0 + 0.035, u0 + 0.035, s0 + 0.465, u1 - 0.035), "rust", -rng.uniform(1.5, 2.8), 0.02, 0.35)
        for c in cuts:
            cv.add(s0, s0 + 0.5, c - 0.025, c + 0.025, -0.5, 0.06)
            longs.append((s0, c))
        cv.add(s0 - 0.025, s0 + 0.025, 0, cv.width, -0.5, 0.0)
    on = np.mod(cv.s + 0.25 + 0.025, 0.5) < 0.05
    cv.relief[on] = 0.06
    # dust lies in the pans of the lower half, on every flange
    cv.dry += (-1.1 * np.clip((np.abs(cv.u - cv.width / 2) - 2.6) / 2.5, 0, 1))[None].astype(np.float32) * (
        1 + 0.3 * cv.noise(1.0, 0.6, 1.0)
    )
    cv.cable(1.35, 0.14, 0.03, -12, every=2.0, dust=-0.5)
    cv.cable(1.52, 0.14, 0.03, -11.5, every=2.0)
    cv.cable(1.7, 0.14, 0.02, -9, every=2.0)
    cv.cable(cv.width - 1.5, 0.13, 0.05, -7, every=2.5)
    cv.case(9.0, 9.6, cv.width - 3.0, cv.width - 2.5, 0.25, -5)
    for a, b, ln in ((6.25, 3.2, 1.5), (21.25, 8.0, 2.5)):  # pans filled with concrete
        cv.other(box(a + 0.03, b, a + ln - 0.03, b + 0.9), "infill", 1.5, 0.01, 0.15)
    for a, b, ln in ((13.25, 4.6, 1.0), (27.25, 6.4, 1.5), (17.75, 2.6, 0.5)):
        cv.other(box(a + 0.02, b, a + ln - 0.02, b + rng.uniform(0.6, 1.2)), "paint", -rng.uniform(1.8, 3.0), 0.008, 0.08)
    for _ in range(7):
        p = cv.free(lambda: cv.streak(rng.uniform(1, 31), _u(cv, 0.18, 0.4), rng.uniform(0.3, 0.9), 0.05, 0.09))
        cv.other(p, "rust", -rng.uniform(1.5, 3.0), 0.015, 0.3)
    for _ in range(3):
        p = cv.free(
            lambda: cv.ragged(
                cv.blob(rng.uniform(2, 30), cv.width / 2 + rng.uniform(-1.5, 1.5), rng.uniform(0.3, 0.9), rng.uniform(0.2, 0.5))
            )
        )
        cv.other(p, "soot", -rng.uniform(1.3, 2.2), 0.12, 0.3)

    def ring_joint():
        s0, u0 = rng.choice(rings[3:-3]), _u(cv, 0.15, 0.45)
        n = rng.uniform(0.8, 2.0)
        return cv.along([(s0, u0), (s0, u0 + n)], rng.uniform(0.09, 0.14))

    def long_joint():
        s0, c = longs[rng.integers(len(longs))]
        g = [cv.along([(s0, c), (s0 + rng.choice([0.5, 1.0]), c)], 0.11)]
        if cv.steep(c) > 0.4:
            g.append(cv.streak(s0 + 0.25, c, rng.uniform(0.5, 1.2), 0.22, 0.12))
        return unary_union(g)

    def pan():
        k = rng.integers(4, len(rings) - 6)
        s0, c = rings[k] + 0.03, _u(cv, 0.2, 0.35)
        return unary_union([cv.blob(s0 + 0.22, c, 0.2, 0.4), cv.streak(s0 + 0.22, c, 0.9, 0.22, 0.12)])

    for _ in range(3):
        cv.leak(ring_joint, "wet joint", soft=0.03, least=0.12)
    for _ in range(2):
        cv.leak(long_joint, "wet joint", soft=0.03, least=0.12)
    cv.leak(pan, "patch", soft=0.04)
    cv.leak(lambda: unary_union([ring_joint(), Point(0, 0)]).buffer(0.05), "wet joint", 5.0, 0.03, film=True, fringe=1.2)
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 29), rng.choice([0.0, cv.width]), rng.uniform(0.5, 0.9), 0.4), "floor edge", soft=0.05
    )
    cv.mobile(folder, kit(phase, 37.0, 0.45, 0.002, 0.7, floor_db=-9, flash=2.0, line=0.12), 0.04, 0.038, 0.05, speed=2.4)


def road_shotcrete(folder):
    """Sprayed concrete of an escape gallery, rough; a small scanner, noisy in range and amplitude."""
    tun = Tunnel(28.0, three_centred(3.3, 2.1, 38, 1.5), (632877.5, 5237095.8, 901.05), 97.0, 1 / 900, 0.04)
    cv = Canvas(tun, 1206)
    rng = cv.rng
    cv.prepare()
    cv.dry += -6.0
    cv.dry += cv.noise(3.0, 2.0, 0.5) + cv.noise(0.6, 0.5, 0.4) + cv.noise(0.15, 0.15, 0.35) + cv.grain(1.0, 0.5)
    rough = cv.noise(1.1, 1.0, 0.02) + cv.noise(0.35, 0.35, 0.007) + cv.noise(0.1, 0.1, 0.0025)
    cv.relief += rough
    for s0 in np.arange(1.0, 28, 1.2):  # arches show through
        cv.relief += (0.02 * np.exp(-(((cv.s - s0) / 0.16) ** 2)))[:, None].astype(np.float32)
    for k, s0 in enumerate(np.arange(1.6, 27.5, 1.6)):  # anchor plates
        for u0 in np.arange(1.8, cv.width - 1, 1.9) + (k % 2) * 0.9:
            if rng.random() < 0.6 and u0 < cv.width - 0.5:
                cv.case(s0 - 0.07, s0 + 0.07, u0 - 0.07, u0 + 0.07, 0.05, rng.uniform(-9, -5))
    for s0 in (9.4, 18.6):  # drainage half pipes under a strip of fresh shotcrete
        cv.other(box(s0 - 0.16, 0.0, s0 + 0.16, cv.width), "drain strip", -1.4, 0.03, 0.25)
        cv.relief += (0.035 * np.exp(-(((cv.s - s0) / 0.13) ** 4)))[:, None].astype(np.float32)
    for _ in range(5):  # another layer, sprayed on another day
        p = cv.free(
            lambda: cv.ragged(
                cv.blob(rng.uniform(1, 27), _u(cv, 0.1, 0.48), rng.uniform(0.4, 1.3), rng.uniform(0.4, 0.9)), 0.03
            )
        )
        cv.other(p, "repair", rng.choice([-2.4, -1.8, -1.6, 1.2]), 0.04, 0.2)
    for _ in range(3):
        p = cv.free(
            lambda: cv.ragged(
                cv.blob(rng.uniform(1, 27), cv.width / 2 + rng.uniform(-1.6, 1.6), rng.uniform(0.4, 1.2), rng.uniform(0.2, 0.5))
            )
        )
        cv.other(p, "soot", -rng.uniform(1.2, 2.4), 0.15, 0.3)
    for _ in range(3):
        p = cv.free(lambda: cv.ragged(cv.streak(rng.uniform(1, 27), _u(cv, 0.2, 0.35), rng.uniform(0.4, 1.0), 0.2, 0.1)))
        cv.other(p, "calcite", 1.6, 0.03, 0.3)
    low = np.minimum(cv.u, cv.width - cv.u)
    cv.dry += (-1.2 * np.exp(-low / 0.3))[None].astype(np.float32) * (1 + 0.3 * cv.noise(0.8, 0.5, 1.0))  # mud of vehicles
    cv.cable(2.3, 0.1, 0.03, -11, every=2.0)
    cv.case(-PAD, 28.5, cv.width - 2.75, cv.width - 2.45, 0.12, -8)

    def patch(lo, hi, a=(0.3, 0.8)):
        return lambda: cv.blob(rng.uniform(2, 26), _u(cv, lo, hi), rng.uniform(*a), rng.uniform(*a) * 0.9)

    def crack():
        path = cv.wander(rng.uniform(2, 24), _u(cv, 0.15, 0.42), rng.uniform(1.2, 2.4), rng.uniform(-0.5, 1.4))
        g = [cv.along(path, 0.1)]
        q = path[len(path) // 2]
        if 0 < q[1] < cv.width and cv.steep(q[1]) > 0.3:
            g.append(cv.streak(q[0], q[1], rng.uniform(0.5, 1.2), 0.22, 0.12))
        return unary_union(g)

    def bolt():
        k = rng.integers(len(cv.objects))
        while cv.objects[k][0] != "box" or cv.objects[k][2] - cv.objects[k][1] > 0.2:
            k = rng.integers(len(cv.objects))
        _, s0, s1, u0, u1, *_ = cv.objects[k]
        a, b = (s0 + s1) / 2, (u0 + u1) / 2
        return unary_union([cv.blob(a, b, 0.2, 0.2), cv.streak(a, b, rng.uniform(0.6, 1.4), 0.24, 0.12)])

    def drain_edge():
        s0, u0 = rng.choice([9.4, 18.6]) + rng.choice([-0.17, 0.17]), _u(cv, 0.12, 0.3)
        return unary_union([cv.along([(s0, u0), (s0, u0 + 1.4)], 0.11), cv.blob(s0, u0, 0.3, 0.25)])

    for _ in range(2):
        cv.leak(patch(0.22, 0.48), "patch", soft=0.07, keep=False)
    for _ in range(2):
        cv.leak(crack, "wet crack", soft=0.05)
    for _ in range(2):
        cv.leak(bolt, "hole", soft=0.05)
    cv.leak(drain_edge, "wet joint", 2.8, 0.05, keep=False)
    cv.leak(patch(0.1, 0.3, (0.5, 0.9)), "patch", 4.6, 0.06, film=True)
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 25), rng.choice([0.0, cv.width]), rng.uniform(0.8, 1.5), 0.5), "floor edge", 2.6, 0.08
    )
    cv.leak(
        patch(0.3, 0.45, (0.25, 0.4)),
        "patch",
        0.9,
        0.12,
        limit="As faint as the noise of this scan and without an edge.",
        keep=False,
    )
    st = [(s0, 0.3 * (-1) ** k, 0.15) for k, s0 in enumerate((2.8, 8.4, 14.0, 19.6, 25.2))]
    cv.static(
        folder,
        kit(pocket, 24.0, 1.2, 0.006, 0.6, floor_db=-8, floor_rough=0.015, weak=14.0, station=0.35),
        st,
        0.0042,
        650,
        7.0,
    )


def rail_box(folder):
    """Cut and cover, single track in a box: damp climbs from the foot of the wall over most of its length."""
    tun = Tunnel(34.0, rectangle(2.6, 2.2, 2.4, 0.25), (363540.9, 5621088.4, 41.37), 333.0, 0.0, -0.009)
    cv = Canvas(tun, 1207)
    rng = cv.rng
    cv.dry += -5.4
    _concrete(cv, 0.3, 0.3, 0.35)
    blocks = [7.5, 17.5, 27.5]
    for b in blocks:
        cv.add(b - 0.012, b + 0.012, 0, cv.width, -1.8, -0.018)
    for s0 in np.arange(0.0, 34.5, 1.25):  # boards of the formwork, ties
        for a, b in ((0, 4.3), (cv.width - 4.3, cv.width)):
            cv.add(s0 - 0.007, s0 + 0.007, a, b, -0.4, 0.002)
            cv.add(s0, s0 + 1.25, a, b, rng.normal(0, 0.25))
        for u0 in (1.0, 2.4, 3.7):
            for v in (u0, cv.width - u0):
                win, m, d, w = cv.field(Point(s0 + 0.6, v).buffer(0.025), 0.008)
                cv.dry[win] -= 1.5 * w
    side = 4.6 - 0.25
    kick = 0.5  # joint between slab and wall
    for v in (kick, cv.width - kick):
        cv.add(-PAD, 35, v - 0.008, v + 0.008, -1.0, -0.006)
    low = np.minimum(cv.u, cv.width - cv.u)
    cv.dry += (-1.1 * np.exp(-((low / 0.8) ** 2)))[None].astype(np.float32) * (1 + 0.3 * cv.noise(1.5, 0.6, 1.0))  # brake dust
    cv.others.append((box(19.5, cv.width - 0.7, 33.8, cv.width), "dust", False))
    cv.dry += (-0.6 * np.exp(-(((cv.u - cv.width / 2) / 0.9) ** 2)))[None].astype(np.float32)  # arc soot above the contact line
    cv.cable(2.0, 0.08, 0.025, -11.5, every=1.25, dust=-0.7)
    cv.cable(2.15, 0.08, 0.025, -11.0, every=1.25)
    cv.cable(cv.width - 1.3, 0.1, 0.05, -6.0, every=2.5)
    cv.case(13.0, 13.8, cv.width - 2.6, cv.width - 1.7, 0.2, -4.0)
    cv.riser(13.4, 0.03, 0.02, cv.width - 4.2, cv.width - 2.6, -8.0)
    for s0 in (4.0, 14.0, 24.0):
        cv.case(s0, s0 + 1.2, 3.2, 3.4, 0.1, -3.0)
    for _ in range(5):
        p = cv.free(
            lambda: box(
                (a := rng.uniform(1, 32)),
                (b := rng.uniform(1.2, cv.width - 2)),
                a + rng.uniform(0.3, 1.0),
                b + rng.uniform(0.25, 0.8),
            )
        )
        cv.other(p, "repair", -rng.uniform(1.5, 3.2), 0.008, 0.12)
    p = cv.free(lambda: box((a := rng.uniform(20, 30)), cv.width - 1.0, a + 2.4, cv.width - 0.1))
    cv.other(p, "bitumen", -3.2, 0.015, 0.12)
    for _ in range(2):
        p = cv.free(
            lambda: cv.ragged(
                cv.along(cv.wander(rng.uniform(2, 30), rng.uniform(1.6, 3.2), 1.6, rng.normal(0, 0.5)), 0.05, 0.5)
            )
        )
        cv.other(p, "paint", -3.5, 0.008, 0.05)
    for b in (7.5, 27.5):
        p = cv.free(lambda b=b: cv.ragged(cv.along([(b, (v := rng.uniform(3, 9))), (b, v + 1.1)], 0.08)))
        cv.other(p, "calcite", 1.7, 0.02, 0.3)
    for _ in range(3):
        p = cv.free(lambda: cv.streak(rng.uniform(2, 32), 1.9, rng.uniform(0.4, 0.9), 0.03, 0.06))
        cv.other(p, "rust", -rng.uniform(1.5, 2.6), 0.01)

    def rising(a, b, v, tongues):
        """Damp from the floor, its height changes along the wall."""
        n = int((b - a) / 0.04)
        x = np.linspace(a, b, n)
        h = v * (
            1
            + 0.45 * ndimage.gaussian_filter1d(rng.normal(size=n), 12) * 5
            + 0.12 * ndimage.gaussian_filter1d(rng.normal(size=n), 3) * 3
        )
        for c in rng.uniform(a + 0.5, b - 0.5, tongues):
            h += rng.uniform(0.15, 0.4) * np.exp(-(((x - c) / rng.uniform(0.12, 0.35)) ** 2))
        h = np.clip(h, 0.14, 1.15) * np.clip(np.minimum(x - a, b - x) / 0.6, 0, 1) ** 0.5
        return np.c_[x, h], x

    def band(a, b, v, tongues, left):
        def build():
            top, x = rising(a, b, v, tongues)
            ring = np.vstack([top, [[b, 0], [a, 0]]])
            if left:
                ring[:, 1] = cv.width - ring[:, 1]
            return Polygon(ring).buffer(0)

        return build

    cv.leak(band(3.2, 21.5, 0.42, 9, False), "rising damp", 2.6, 0.06, fringe=1.0, keep=False)
    cv.leak(band(8.5, 14.2, 0.3, 3, True), "rising damp", 2.1, 0.06, keep=False)
    cv.leak(band(25.0, 27.1, 0.35, 1, False), "floor edge", 2.9, 0.05, keep=False)

    def corner():
        b, left = rng.choice(blocks), rng.random() < 0.5
        u0 = side + 0.15 if not left else cv.width - side - 0.15
        return unary_union(
            [cv.blob(b, u0, 0.35, 0.25), cv.along([(b, u0), (b, u0 + cv.down(u0) * rng.uniform(0.7, 1.5))], 0.1)]
        )

    def roof():
        b = rng.choice(blocks)
        u0 = cv.width / 2 + rng.uniform(-1.4, 0.4)
        return cv.along([(b, u0), (b, u0 + rng.uniform(0.8, 1.5))], rng.uniform(0.1, 0.15))

    def crack():
        path = cv.wander(rng.uniform(2, 32), rng.choice([3.9, cv.width - 3.9]), rng.uniform(1.2, 2.4), np.pi / 2)
        path[:, 1] = path[0, 1] + cv.down(path[0, 1]) * np.abs(path[:, 1] - path[0, 1])
        return cv.along(path, rng.uniform(0.06, 0.1))

    for _ in range(2):
        cv.leak(corner, "corner", soft=0.04)
    cv.leak(roof, "wet joint", soft=0.04)
    for _ in range(2):
        cv.leak(crack, "wet crack", soft=0.03, least=0.12)
    cv.leak(
        lambda: cv.blob(
            rng.uniform(3, 31), cv.width / 2 + rng.uniform(-1.6, 1.6), rng.uniform(0.3, 0.7), rng.uniform(0.25, 0.5)
        ),
        "patch",
        2.5,
        0.08,
    )
    cv.leak(
        lambda: unary_union(
            [cv.blob((a := 0.6 + 1.25 * rng.integers(2, 25)), 3.7, 0.1, 0.1), cv.streak(a, 3.7, 0.9, 0.14, 0.06)]
        ),
        "hole",
        soft=0.02,
    )
    cv.mobile(
        folder, kit(pulsed, 34.0, 0.35, 0.002, 0.8, floor_db=-10.5, floor_rough=0.03), 0.022, 0.021, -0.1, offset=0.1, speed=1.3
    )


def canal_stone(folder):
    """Ashlar of an old tunnel under a canal, every stone its own tone; stations, no reference."""
    tun = Tunnel(26.0, three_centred(3.7, 2.7, 40, 1.9), (512066.4, 5403921.7, 263.9), 176.0, -1 / 350, 0.004)
    cv = Canvas(tun, 1208)
    rng = cv.rng
    cv.prepare()
    cv.dry += -5.9
    courses = [0.0]
    while courses[-1] < cv.width:
        courses.append(courses[-1] + rng.uniform(0.28, 0.42))
    heads = []
    for u0, u1 in zip(courses[:-1], courses[1:], strict=True):
        x = -PAD - rng.uniform(0, 0.6)
        while x < 26.5:
            n = rng.uniform(0.45, 0.95)
            cv.add(max(x, -PAD), x + n, u0, u1, rng.normal(0, 0.7), rng.normal(0, 0.006))
            cv.add(max(x - 0.008, -PAD), max(x + 0.008, -PAD + 0.01), u0, u1, -0.7, -0.012)
            if rng.random() < 0.03 and 1 < x < 24:  # sandstone among limestone
                cv.other(
                    box(x + 0.01, u0 + 0.01, x + n - 0.01, min(u1, cv.width) - 0.01),
                    "dark stone",
                    -rng.uniform(1.4, 2.4),
                    0.008,
                    0.12,
                )
            heads.append((x, u0, u1))
            x += n
        cv.add(-PAD, 27, u0 - 0.008, u0 + 0.008, -0.7, -0.012)
    cv.dry += cv.noise(2.5, 1.5, 0.5) + cv.noise(0.5, 0.5, 0.35) + cv.noise(0.1, 0.1, 0.25) + cv.grain(0.8, 0.35)
    cv.relief += cv.noise(0.25, 0.2, 0.004) + cv.noise(2, 2, 0.01)
    soot = np.exp(-(((cv.u - cv.width / 2 + 0.5) / 1.9) ** 2))[None].astype(np.float32) * np.clip(
        1 + 0.35 * cv.noise(1.6, 0.8, 1.0), 0.2, 1.8
    )
    cv.dry -= 1.5 * soot
    cv.others.append((box(0.2, cv.width / 2 - 2.1, 25.8, cv.width / 2 + 1.1), "soot", False))
    for _ in range(4):
        p = cv.free(
            lambda: cv.ragged(cv.blob(rng.uniform(2, 24), _u(cv, 0.03, 0.2), rng.uniform(0.2, 0.6), rng.uniform(0.15, 0.4)))
        )
        cv.other(p, rng.choice(["lichen", "dust"]), -rng.uniform(1.2, 2.0), 0.06, 0.3)
    for _ in range(4):  # repointed: a net of light mortar; stones replaced by brick
        k = rng.integers(len(courses) - 4)
        p = cv.free(
            lambda k=k: box((a := rng.uniform(1, 23)), courses[k], a + rng.uniform(0.5, 1.3), min(courses[k + 2], cv.width))
        )
        cv.other(p, "repair", rng.choice([-2.8, -2.0, -1.6, 1.4]), 0.01, 0.15)
    for _ in range(4):
        p = cv.free(
            lambda: cv.ragged(
                unary_union(
                    [
                        cv.streak((a := rng.uniform(1, 25)), (b := _u(cv, 0.2, 0.33)), 1.0, 0.2, 0.08),
                        cv.streak(a + 0.15, b, 0.6, 0.12, 0.05),
                    ]
                )
            )
        )
        cv.other(p, "calcite", 2.0, 0.025, 0.3)
    cv.other(cv.free(lambda: box((a := rng.uniform(2, 22)), 1.2, a + 1.2, 1.9)), "paint", -3.3, 0.006, 0.08)
    cv.cable(cv.width - 1.8, 0.07, 0.025, -10, every=1.5, dust=-0.7)
    cv.case(6.0, 6.5, cv.width - 2.7, cv.width - 2.2, 0.15, -4)

    def bed_joint():
        k = rng.integers(3, len(courses) - 4)
        u0 = courses[k]
        a, n = rng.uniform(1.5, 22), rng.uniform(0.6, 1.7)
        g = [cv.along([(a, u0), (a + n, u0)], 0.09)]
        if cv.steep(u0) > 0.3:
            g += [cv.streak(a + n * rng.random(), u0, rng.uniform(0.3, 1.0), 0.18, 0.08) for _ in range(2)]
        return unary_union(g)

    def stair():
        """Along bed and head joints, as a crack in masonry goes."""
        k = rng.integers(4, len(courses) - 6)
        x, pts = rng.uniform(3, 21), []
        for c in courses[k : k + 4]:
            pts += [(x, c), (x + rng.uniform(0.2, 0.4), c)]
            x = pts[-1][0]
        return cv.along(pts, 0.075)

    def curtain():
        a, u0 = rng.uniform(2, 23), _u(cv, 0.24, 0.32)
        g = [cv.along([(a, u0), (a + 0.7, u0)], 0.1)]
        return unary_union(g + [cv.streak(a + x, u0, rng.uniform(0.8, 1.8), 0.22, 0.1) for x in (0.05, 0.35, 0.65)])

    for _ in range(4):
        cv.leak(bed_joint, "wet joint", soft=0.04, least=0.12)
    for _ in range(2):
        cv.leak(stair, "wet crack", soft=0.04)
    cv.leak(curtain, "curtain", 4.2, 0.04, film=True, fringe=1.6)
    cv.leak(
        lambda: cv.blob(
            rng.uniform(3, 23), cv.width / 2 + rng.uniform(-1.2, 1.2), rng.uniform(0.4, 0.8), rng.uniform(0.3, 0.5)
        ),
        "patch",
        2.6,
        0.08,
    )
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 23), rng.choice([0.0, cv.width]), rng.uniform(0.6, 1.2), 0.5), "floor edge", 2.8, 0.08
    )
    cv.leak(
        lambda: cv.blob(rng.uniform(3, 23), _u(cv, 0.15, 0.3), rng.uniform(0.3, 0.5), 0.35),
        "salt fringe",
        2.2,
        0.06,
        fringe=1.8,
    )
    cv.leak(lambda: cv.blob(rng.uniform(3, 23), _u(cv, 0.3, 0.45), 0.13, 0.11), "drip", 3.4, 0.02)
    st = [(s0, -0.5, -0.2) for s0 in (3.0, 9.6, 16.2, 22.8)]
    cv.static(
        folder, kit(phase, 35.0, 0.45, 0.003, 0.65, reference=False, floor_db=-8.5, floor_rough=0.012), st, 0.0028, 1000, 7.5
    )


SCENES = (
    Scene(
        "metro-segments",
        "segments",
        "wet ring joints",
        "A running tunnel of precast rings: joints, crosses and a grout socket leak; dark segments, repairs and soot are dry.",
        metro_segments,
    ),
    Scene(
        "road-cast",
        "cast",
        "wet cracks and block joints",
        "A road tunnel of cast blocks with painted walls and a sooty crown; cracks and block joints leak, resin and form oil do not.",
        road_cast,
    ),
    Scene(
        "rail-brick",
        "brick",
        "damp in soot",
        "A sooty railway tunnel of brick, relined in places; bed joints, weep holes and patches are wet. No reference.",
        rail_brick,
    ),
    Scene(
        "water-dry",
        "cast",
        "no leak",
        "A drained headrace tunnel, dry: manganese, tide mark, repairs, resin, calcite, dried stains.",
        water_dry,
    ),
    Scene(
        "metro-iron",
        "iron",
        "sparse scan of flanged rings",
        "A tunnel of cast iron with flanges, profiled every 4 cm; flange joints weep, rust and paint are dry.",
        metro_iron,
    ),
    Scene(
        "road-shotcrete",
        "shotcrete",
        "noisy scan of a rough lining",
        "An escape gallery of sprayed concrete, scanned with much noise; bolts, cracks and edges of drain strips are wet.",
        road_shotcrete,
    ),
    Scene(
        "rail-box",
        "cast",
        "damp at the foot of the wall",
        "A box of cut and cover in which damp climbs from the floor over 18 m; brake dust and bitumen at the foot are dry.",
        rail_box,
    ),
    Scene(
        "canal-stone",
        "stone",
        "wet joints between stones",
        "Ashlar whose stones differ in tone; bed joints and a stepped crack are wet, dark stones and soot are not. No reference.",
        canal_stone,
    ),
)
