"""The lining unrolled: reflectance, gloss, relief and water on a raster of a centimetre, and the brushes that paint it.

Levels are 10 lg of the reflectance. `drop` is what water takes from it, `film` how much of a film stands on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy import ndimage


def smooth_step(x):
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def random_field(shape, h, ls, lu, rng):
    """Gaussian random field of unit variance with lengths of correlation `ls`, `lu` (m)."""
    cs, cu = max(h, ls / 2.5), max(h, lu / 2.5)
    n0, n1 = int(np.ceil(shape[0] * h / cs)) + 8, int(np.ceil(shape[1] * h / cu)) + 8
    sig = (ls / cs / 1.8, lu / cu / 1.8)
    c = ndimage.gaussian_filter(rng.standard_normal((n0, n1)).astype(np.float32), sig, mode="wrap")
    c /= max(float(c.std()), 1e-6)
    x = (np.arange(shape[0]) + rng.random()) * (h / cs) + 2
    y = (np.arange(shape[1]) + rng.random()) * (h / cu) + 2
    i, j = x.astype(int), y.astype(int)
    fx, fy = (x - i).astype(np.float32)[:, None], (y - j).astype(np.float32)[None]
    a = c[i] * (1 - fx) + c[i + 1] * fx
    return a[:, j] * (1 - fy) + a[:, j + 1] * fy


@dataclass
class Window:
    """A rectangle of the raster."""

    i0: int
    i1: int
    j0: int
    j1: int
    h: float

    @property
    def shape(self):
        return self.i1 - self.i0, self.j1 - self.j0

    @property
    def cut(self):
        return slice(self.i0, self.i1), slice(self.j0, self.j1)

    @property
    def s(self):
        return ((np.arange(self.i0, self.i1) + 0.5) * self.h).astype(np.float32)[:, None]

    @property
    def u(self):
        return ((np.arange(self.j0, self.j1) + 0.5) * self.h).astype(np.float32)[None]


@dataclass
class Mark:
    """Something to go into `truth.geojson` or `other.geojson`."""

    name: str
    win: Window
    mask: np.ndarray
    props: dict = field(default_factory=dict)


class Sheet:
    def __init__(self, section, length, level, kr=0.3, h=0.01, seed=0):
        self.sec, self.length, self.h = section, float(length), h
        self.girth = section.girth
        self.ns, self.nu = int(round(length / h)), int(np.ceil(self.girth / h))
        self.shape = (self.ns, self.nu)
        self.rng = np.random.default_rng(seed)
        self.level = np.full(self.shape, level, np.float32)
        self.kr = np.full(self.shape, kr, np.float32)
        self.ks = np.zeros(self.shape, np.float32)
        self.disp = np.zeros(self.shape, np.float32)
        self.drop = np.zeros(self.shape, np.float32)
        self.film = np.zeros(self.shape, np.float32)
        self.own_kr = kr
        uu = (np.arange(self.nu) + 0.5) * h
        self.steep = section.steepness(np.minimum(uu, self.girth - 1e-6)).astype(np.float32)
        self.yu, self.zu = (a.astype(np.float32) for a in section.at(uu))
        self.crown = section.crown
        self.leaks: list[Mark] = []
        self.others: list[Mark] = []

    # ------------------------------------------------------------------------------------------------------------------ helpers

    def window(self, s0, s1, u0, u1):
        h = self.h
        i0, i1 = np.clip([int(np.floor(s0 / h)), int(np.ceil(s1 / h))], 0, self.ns)
        j0, j1 = np.clip([int(np.floor(u0 / h)), int(np.ceil(u1 / h))], 0, self.nu)
        return Window(int(i0), int(max(i1, i0 + 1)), int(j0), int(max(j1, j0 + 1)), h)

    @property
    def all(self):
        return Window(0, self.ns, 0, self.nu, self.h)

    def noise(self, ls, lu=None, win=None):
        return random_field((win or self.all).shape, self.h, ls, ls if lu is None else lu, self.rng)

    def side(self, u):
        """+1 where water runs to greater `u`."""
        return 1 if u >= self.crown else -1

    def foot(self, side):
        return self.girth if side > 0 else 0.0

    def u_of(self, z, side):
        return self.sec.u_at_height(z, side)

    def other(self, kind, win, mask, **props):
        if mask.any():
            self.others.append(Mark(kind, win, mask.astype(bool), {"kind": kind, **props}))

    # -------------------------------------------------------------------------------------------------------------- dry painting

    def mottle(self, *parts):
        """Adds noise: (length, dB) or (length in s, length in u, dB)."""
        for p in parts:
            ls, lu, a = p if len(p) == 3 else (p[0], p[0], p[1])
            self.level += np.float32(a) * self.noise(ls, lu)

    def rect(
        self, s0, s1, u0, u1, dlevel=0.0, disp=0.0, soft=0.01, level=None, kr=None, ks=None, wobble=0.0, kind=None, **props
    ):
        """A rectangle with an edge of `soft` (m); `level` sets, `dlevel` adds."""
        if u0 > u1:
            u0, u1 = u1, u0
        m = soft + 3 * wobble + 0.02
        w = self.window(s0 - m, s1 + m, u0 - m, u1 + m)
        d = np.minimum(np.minimum(w.s - s0, s1 - w.s), np.minimum(w.u - u0, u1 - w.u))
        if wobble:
            d = d + wobble * self.noise(0.12, win=w)
        a = smooth_step(d / max(soft, 1e-3) + 0.5).astype(np.float32)
        self._lay(w, a, dlevel, disp, level, kr, ks)
        if kind:
            self.other(kind, w, a > 0.5, **props)
        return w, a

    def disc(self, s, u, r, dlevel=0.0, disp=0.0, soft=0.01, level=None, kr=None, ks=None, kind=None, ring=0.0):
        w = self.window(s - r - soft - 0.02, s + r + soft + 0.02, u - r - soft - 0.02, u + r + soft + 0.02)
        q = np.hypot(w.s - s, w.u - u)
        a = smooth_step((r - q) / max(soft, 1e-3) + 0.5).astype(np.float32)
        if ring:
            a = a * smooth_step((q - r + ring) / max(soft, 1e-3) + 0.5)
        self._lay(w, a, dlevel, disp, level, kr, ks)
        if kind:
            self.other(kind, w, a > 0.5)
        return w, a

    def _lay(self, w, a, dlevel=0.0, disp=0.0, level=None, kr=None, ks=None):
        c = w.cut
        if level is not None:
            self.level[c] += a * (np.float32(level) - self.level[c])
        if np.any(dlevel):
            self.level[c] += a * np.asarray(dlevel, np.float32)
        if np.any(disp):
            self.disp[c] += a * np.asarray(disp, np.float32)
        if kr is not None:
            self.kr[c] += a * (np.float32(kr) - self.kr[c])
        if ks is not None:
            self.ks[c] += a * (np.float32(ks) - self.ks[c])

    def hoop(self, s, u0, u1, width, dlevel=0.0, disp=0.0, soft=0.006, **k):
        """A line round the tunnel."""
        return self.rect(s - width / 2, s + width / 2, u0, u1, dlevel, disp, soft, **k)

    def along(self, u, s0, s1, width, dlevel=0.0, disp=0.0, soft=0.006, **k):
        """A line along the tunnel."""
        return self.rect(s0, s1, u - width / 2, u + width / 2, dlevel, disp, soft, **k)

    def path(self, pts, width, dlevel=0.0, disp=0.0, soft=0.01, level=None, kind=None, vary=0.0):
        """A line through points (s, u)."""
        w, d = self.distance(pts, width / 2 + soft + 0.03)
        hw = width / 2
        if vary:
            hw = hw * (1 + vary * self.noise(0.3, win=w))
        a = smooth_step((hw - d) / max(soft, 1e-3) + 0.5).astype(np.float32)
        self._lay(w, a, dlevel, disp, level)
        if kind:
            self.other(kind, w, a > 0.5)
        return w, a

    def distance(self, pts, margin):
        """Distance from a polyline, in a window about it."""
        p = np.asarray(pts, float)
        w = self.window(p[:, 0].min() - margin, p[:, 0].max() + margin, p[:, 1].min() - margin, p[:, 1].max() + margin)
        on = np.ones(w.shape, bool)
        for a, b in zip(p[:-1], p[1:]):
            n = int(np.hypot(*(b - a)) / (self.h * 0.5)) + 2
            t = np.linspace(0, 1, n)[:, None]
            q = a * (1 - t) + b * t
            i = np.clip((q[:, 0] / self.h).astype(int) - w.i0, 0, w.shape[0] - 1)
            j = np.clip((q[:, 1] / self.h).astype(int) - w.j0, 0, w.shape[1] - 1)
            on[i, j] = False
        return w, (ndimage.distance_transform_edt(on) * self.h).astype(np.float32)

    def wander(self, s, u, heading, length, step=0.06, turn=0.35, pull=0.15):
        """A crack: a walk from (s, u) that keeps to its heading (degrees, 0 along s, 90 towards greater u)."""
        a0 = np.radians(heading)
        a, p = a0, [(s, u)]
        for _ in range(int(length / step)):
            a += self.rng.normal(0, turn) - pull * (a - a0)
            s, u = s + step * np.cos(a), u + step * np.sin(a)
            p.append((s, u))
        p = np.array(p)
        p[:, 0] = np.clip(p[:, 0], 0.02, self.length - 0.02)
        p[:, 1] = np.clip(p[:, 1], 0.02, self.girth - 0.02)
        return p

    # ------------------------------------------------------------------------------------------------------------------- wetness

    def run(self, s, u, length, n=500, blur=0.02, fill=2.0, unrest=0.035, braid=0.12, relief=0.0, width=0.02, keep=None):
        """Where water goes that comes out at (s, u) and runs down the lining: window and wetness 0 to 1.

        `s`, `u` may be arrays of sources. Threads follow a field of small unevenness (`braid`), so that they join and part.
        """
        rng = self.rng
        s, u = np.atleast_1d(np.asarray(s, float)), np.atleast_1d(np.asarray(u, float))
        k = rng.integers(0, len(s), n)
        ps, pu = s[k] + rng.normal(0, width, n), u[k] + rng.normal(0, width / 2, n)
        left = rng.gamma(5.0, length / 5.0, n)
        top = float(left.max()) + 0.3
        w = self.window(s.min() - 0.35 * top - 0.3, s.max() + 0.35 * top + 0.3, u.min() - top, u.max() + top)
        f = self.noise(0.07, 0.35, w)
        g = self.noise(0.35, 1.2, w)
        slope_f = np.gradient(f, axis=0) * 0.9 + np.gradient(g, axis=0) * 0.7
        if relief:
            slope_f = slope_f + relief * np.gradient(ndimage.gaussian_filter(self.disp[w.cut], 3), axis=0) / self.h
        slope_f = slope_f / max(float(np.abs(slope_f).mean()), 1e-6)
        dirn = np.where(pu >= self.crown, 1.0, -1.0)
        v = np.zeros(n)
        hits = []
        h = self.h
        for _ in range(int(top / h) + 1):
            i = np.clip((ps / h).astype(int) - w.i0, 0, w.shape[0] - 1)
            j = np.clip((pu / h).astype(int), 0, self.nu - 1)
            jw = np.clip(j - w.j0, 0, w.shape[1] - 1)
            hits.append(i * w.shape[1] + jw)
            st = np.abs(self.steep[j])
            go = np.clip(st * 2.5, 0.05, 1.0)
            v = 0.8 * v - 0.2 * braid * slope_f[i, jw] + rng.normal(0, unrest, len(ps))
            ps = ps + v * h
            pu = pu + dirn * go * h + (1 - go) * rng.normal(0, h, len(ps))
            left = left - h
            ok = (left > 0) & (pu > 0) & (pu < self.girth) & (ps > 0) & (ps < self.length)
            if keep is not None:
                ok &= keep(ps, pu)
            if not ok.any():
                break
            ps, pu, left, v, dirn = ps[ok], pu[ok], left[ok], v[ok], dirn[ok]
        c = np.bincount(np.concatenate(hits), minlength=w.shape[0] * w.shape[1]).reshape(w.shape).astype(np.float32)
        c = ndimage.gaussian_filter(c, blur / h)
        top = np.percentile(c[c > 0.02 * c.max()], 85)  # where most of the water goes
        wet = 1 - np.exp(-c / max(float(top), 1e-6) * fill)
        # films break up on a rough surface
        wet = wet * np.clip(1 + 0.25 * self.noise(0.05, 0.15, w) + 0.2 * self.noise(0.2, 0.6, w), 0.3, 1.3)
        return w, np.clip(wet, 0, 1).astype(np.float32)

    def blob(self, s, u, a, b, rough=0.35, fringe=0.25, scale=0.3, power=2.0):
        """An uneven patch with half axes `a` (along s) and `b` (along u)."""
        m = 1 + 2.5 * rough
        w = self.window(s - m * a, s + m * a, u - m * b, u + m * b)
        q = (np.abs((w.s - s) / a) ** power + np.abs((w.u - u) / b) ** power) ** (1 / power)
        n = self.noise(scale * 2, win=w)
        q = q + rough * (0.75 * (n - 0.8 * n.mean()) + 0.4 * self.noise(scale * 0.6, win=w))
        return w, smooth_step((1 - q) / fringe + 0.5).astype(np.float32)

    def seam(self, pts, width, rough=0.4, fringe=0.6, scale=0.3, taper=True, lean=0.35, gaps=0.0):
        """Wet on both sides of a line, wide and narrow by turns, more on one side than on the other (`lean`), with dry gaps."""
        w, d = self.distance(pts, 2.2 * width + 0.12)
        n1, n2, n3 = self.noise(scale * 2.4, win=w), self.noise(scale * 0.7, win=w), self.noise(0.06, win=w)
        n1 = n1 - 0.8 * n1.mean()
        hw = width / 2 * (1 + rough * (1.3 * n1 + 0.8 * n2 + 0.35 * n3))
        if lean:
            p = np.asarray(pts, float)
            e = (p[-1] - p[0]) / max(np.hypot(*(p[-1] - p[0])), 1e-6)
            across = (w.s - p[0, 0]) * e[1] - (w.u - p[0, 1]) * e[0]
            hw = hw * (1 + lean * np.tanh(across / (0.3 * width)) * np.clip(self.noise(1.2, win=w), -1, 1))
        if gaps:
            hw = hw * np.clip(1 + gaps * np.minimum(self.noise(0.7, win=w) + 0.3, 0), 0, 1)
        if taper:
            p = np.asarray(pts, float)
            mid = (p[0] + p[-1]) / 2
            half = max(np.hypot(*(p[-1] - p[0])) / 2, 0.1)
            q = np.hypot(w.s - mid[0], w.u - mid[1]) / half
            hw = hw * np.sqrt(np.clip(1.15 - q**4, 0.05, 1.15))
        return w, smooth_step((hw - d) / np.maximum(fringe * width / 2, 0.015) + 0.5).astype(np.float32)

    def merge(self, *parts):
        """The union of several (window, wetness)."""
        i0, i1 = min(p[0].i0 for p in parts), max(p[0].i1 for p in parts)
        j0, j1 = min(p[0].j0 for p in parts), max(p[0].j1 for p in parts)
        w = Window(i0, i1, j0, j1, self.h)
        a = np.zeros(w.shape, np.float32)
        for q, b in parts:
            c = (slice(q.i0 - i0, q.i1 - i0), slice(q.j0 - j0, q.j1 - j0))
            a[c] = np.maximum(a[c], b)
        return w, a

    def wet(self, part, drop, phenomenon, film=0.0, uneven=0.18, salt=0.0, salt_in=0.0, halo=0.0, edge=None, limit=None):
        """Lays water: the level falls by `drop` where it is fully wet, by a third to a half in a damp halo about it (m).

        `salt`: efflorescence (dB) about the edge; `salt_in`: lime in the run itself. `edge`: wetness at which an inspector draws.
        """
        w, a = part
        if edge is None:  # a decibel shows; of faint ones the half
            edge = float(np.clip(1.0 / drop, 0.18, 0.42))
        core = self._one(a > edge)
        if core is None:
            raise ValueError(f"nothing is wet of {phenomenon}")
        out = ndimage.distance_transform_edt(~core) * self.h
        a = a * smooth_step(1.6 - out / 0.12)
        if halo:
            g = int(1.6 * halo / self.h)
            big = self.window((w.i0 - g) * self.h, (w.i1 + g) * self.h, (w.j0 - g) * self.h, (w.j1 + g) * self.h)
            w, a = self.merge((w, a), (big, np.zeros(big.shape, np.float32)))
            core = a > 0.4
            out = ndimage.distance_transform_edt(~core) * self.h
            wide = halo * np.clip(0.8 + 0.55 * self.noise(0.5, win=w) + 0.35 * self.noise(0.12, win=w), 0.02, None)
            a = np.maximum(a, 0.46 * smooth_step(1.25 - out / wide)).astype(np.float32)
        mask = self._one(a > edge)
        n = 1 + uneven * (0.7 * self.noise(0.25, win=w) + 0.5 * self.noise(0.05, 0.12, w))
        c = w.cut
        self.drop[c] = np.maximum(self.drop[c], (drop * a * n).astype(np.float32))
        self.film[c] = np.maximum(self.film[c], (film * smooth_step(a * 1.6 - 0.6)).astype(np.float32))
        out = ndimage.distance_transform_edt(~mask) * self.h
        if salt:
            inn = ndimage.distance_transform_edt(mask) * self.h
            ring = np.exp(-(((out - 0.03) / 0.035) ** 2)) * np.exp(-((inn / 0.02) ** 2))
            patchy = smooth_step(0.5 + 0.7 * self.noise(0.25, win=w) + 0.35 * self.noise(0.05, win=w))
            self.level[c] += (salt * ring * patchy).astype(np.float32)
            bright = salt * ring * patchy > 0.8
            self.other("efflorescence", w, bright & ~mask)
        if salt_in:
            lime = smooth_step((a - 0.6) / 0.3) * smooth_step(0.3 + 0.8 * self.noise(0.10, 0.45, w))
            self.level[c] += (salt_in * lime).astype(np.float32)
            self.disp[c] += (0.006 * lime).astype(np.float32)
        closed = ndimage.binary_closing(np.pad(mask, 12), iterations=5)[12:-12, 12:-12] | mask
        closed = _fill_holes(closed, int(0.05 / self.h**2))
        mark = Mark(phenomenon, w, closed, {"phenomenon": phenomenon})
        if limit:
            mark.props["limit"] = limit
        self.leaks.append(mark)
        return mark

    def _one(self, mask):
        """The greatest piece and what lies within a hand's breadth of it."""
        mask = ndimage.binary_opening(mask, iterations=1)
        lab, k = ndimage.label(mask, structure=np.ones((3, 3)))
        if not k:
            return None
        size = np.bincount(lab.ravel())
        size[0] = 0
        new = lab == int(np.argmax(size))
        while True:
            near = ndimage.distance_transform_edt(~new) * self.h < 0.06
            more = np.isin(lab, np.unique(lab[near & (lab > 0)]))
            if more.sum() == new.sum():
                return new
            new = more

    def stain(self, part, dlevel, kind, record=0.4, uneven=0.3):
        """A dry run or patch: level alone."""
        w, a = part
        n = 1 + uneven * self.noise(0.15, win=w)
        self.level[w.cut] += (dlevel * a * n).astype(np.float32)
        self.other(kind, w, a > record)


def _fill_holes(mask, most):
    """Fills holes of at most `most` cells."""
    lab, k = ndimage.label(~mask)
    if not k:
        return mask
    size = np.bincount(lab.ravel())
    edge = np.unique(np.r_[lab[0], lab[-1], lab[:, 0], lab[:, -1]])
    fill = size <= most
    fill[edge] = False
    fill[0] = False
    return mask | fill[lab]


def outline(mask, win, h, coarse=1, smooth=0.012):
    """Outline of a mask in the plane (s, u), m."""
    m = mask
    if coarse > 1:
        n0, n1 = (-m.shape[0]) % coarse, (-m.shape[1]) % coarse
        p = np.pad(m, ((0, n0), (0, n1))).astype(np.float32)
        m = p.reshape(p.shape[0] // coarse, coarse, p.shape[1] // coarse, coarse).mean((1, 3)) > 0.5
    g = h * coarse
    q = np.pad(m, ((0, 0), (1, 1))).astype(np.int8)
    d = np.diff(q, axis=1)
    r0, c0 = np.nonzero(d == 1)
    r1, c1 = np.nonzero(d == -1)
    if not len(r0):
        return shapely.Polygon()
    b = shapely.box(win.i0 * h + r0 * g, win.j0 * h + c0 * g, win.i0 * h + (r0 + 1) * g, win.j0 * h + c1 * g)
    p = shapely.union_all(b)
    k = max(smooth, 0.7 * g)
    p = p.buffer(k, quad_segs=4).buffer(-2 * k, quad_segs=4).buffer(k, quad_segs=4)
    return p.simplify(0.004 * coarse)
