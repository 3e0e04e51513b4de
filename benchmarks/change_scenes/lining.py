"""The lining as a function d(s, u): metres inwards of the profile; what it reflects; leaks; movements."""

from __future__ import annotations

import numpy as np
from scipy import ndimage


def smoothstep(x):
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


class Lining:
    def __init__(self, axis, profile, length, seed, ds=0.01):
        self.axis, self.profile, self.length, self.ds = axis, profile, length, ds
        self.ns, self.nu = int(round(length / ds)) + 1, profile.n
        self.rng = np.random.default_rng(seed)
        self.s = np.arange(self.ns) * ds
        self.u = profile.u
        self.d = np.zeros((self.ns, self.nu), np.float32)
        self.db = np.zeros((self.ns, self.nu), np.float32)
        R = axis.R
        k = 1 - profile.x / R if R else np.ones(self.nu)
        self.cell_area = (ds * profile.du * k)[None, :]  # m² a node
        self.on_lining = ~profile.floor

    # --- random fields: periodic in u, standard deviation 1
    def noise(self, ls, lu=None, shape=None, rng=None):
        rng = rng or self.rng
        lu = lu or ls
        ns, nu = shape or (self.ns, self.nu)
        fs, fu = max(1, int(ls / self.ds / 4)), max(1, int(lu / self.ds / 4))
        ms, mu = max(8, ns // fs + 2), max(8, nu // fu)
        a = ndimage.gaussian_filter(
            rng.standard_normal((ms, mu)).astype(np.float32),
            (ls / self.ds / fs / 2.5, lu / self.ds / fu / 2.5),
            mode=("nearest", "wrap"),
        )
        a /= a.std()
        if fs == 1 and fu == 1:
            return a[:ns, :nu]
        y = np.linspace(0, ms - 1.001, ns)
        x = np.arange(nu) * (mu / nu)
        i, j = y.astype(int), x.astype(int)
        p, q = smoothstep(y - i)[:, None].astype(np.float32), smoothstep(x - j)[None, :].astype(np.float32)
        j2 = (j + 1) % mu
        top = a[i][:, j] * (1 - q) + a[i][:, j2] * q
        bot = a[i + 1][:, j] * (1 - q) + a[i + 1][:, j2] * q
        return top * (1 - p) + bot * p

    def add_rough(self, parts, where=None):
        """parts: (wave length m, standard deviation m)."""
        for wave, sd in parts:
            v = self.noise(wave) * np.float32(sd)
            self.d += v if where is None else v * where

    def floor_mask(self):
        return np.broadcast_to(self.profile.floor[None, :], self.d.shape)

    def make_floor(self, kind):
        f = ndimage.gaussian_filter1d(self.profile.floor.astype(np.float32), 3, mode="wrap")[None, :]
        self.d *= 1 - f
        self.db *= 1 - f
        if kind == "ballast":
            self.d += f * (self.noise(0.07) * 0.012 + self.noise(0.6) * 0.008)
            self.db += f * (self.noise(0.06) * 1.5 - 2.0)
        else:
            self.d += f * (self.noise(0.3) * 0.0008 + self.noise(2.5) * 0.002)
            self.db += f * (self.noise(0.8) * 0.7 - 1.0)

    def groove_s(self, at, width, depth, lo=None, hi=None):
        g = np.exp(-0.5 * ((self.s - at) / (width / 2.5)) ** 2).astype(np.float32)[:, None]
        self.d -= depth * g
        self.db -= 1.2 * g

    def texture(self, base=-4.0, low=0.5, fine=0.35, streak=0.4):
        self.db += base + low * self.noise(1.3) + fine * self.noise(0.05) + streak * self.noise(0.25, 1.6)

    # --- linings
    def segments(self, ring=1.5, per_ring=6, step=0.0015, groove=(0.02, 0.013), pockets=True):
        rng = self.rng
        per = self.profile.length
        crown = per / 2
        self.rings = np.arange(0.4, self.length, ring)
        edges = np.r_[-9, self.rings, self.length + 9]
        for k in range(len(edges) - 1):
            rows = np.nonzero((self.s >= edges[k]) & (self.s < edges[k + 1]))[0]
            if not len(rows):
                continue
            cut = np.sort((crown + (np.arange(per_ring) + (0.5 if k % 2 else 0.13)) * per * 1.12 / per_ring - per * 0.56) % per)
            seg = np.searchsorted(cut, self.u) % per_ring
            off = rng.normal(0, step, per_ring).astype(np.float32)
            self.d[rows] += off[seg][None, :]
            self.db[rows] += rng.normal(0, 0.35, per_ring).astype(np.float32)[seg][None, :]
            for c in cut:
                du = np.abs((self.u - c + per / 2) % per - per / 2)
                g = np.exp(-0.5 * (du / (groove[0] / 2.5)) ** 2).astype(np.float32)
                self.d[rows] -= groove[1] * g[None, :]
                self.db[rows] -= 1.2 * g[None, :]
            if pockets and k < len(edges) - 2:
                for c in cut[:-1] + np.diff(cut) / 2:
                    for side in (-0.22, 0.22):
                        for ds in (-0.24, 0.24):
                            self.pocket(edges[k + 1] + ds, c + side * 2.2, 0.07, 0.055, 0.045)
        for r in self.rings:
            self.groove_s(r, *groove)

    def pocket(self, s, u, hs, hu, depth):
        i = np.nonzero(np.abs(self.s - s) < hs + 0.03)[0]
        j = np.nonzero(np.abs(self.u - u) < hu + 0.03)[0]
        if len(i) and len(j):
            a = smoothstep((hs - np.abs(self.s[i] - s)) / 0.02 + 0.5)[:, None]
            b = smoothstep((hu - np.abs(self.u[j] - u)) / 0.02 + 0.5)[None, :]
            self.d[np.ix_(i, j)] -= (depth * a * b).astype(np.float32)
            self.db[np.ix_(i, j)] -= (0.8 * a * b).astype(np.float32)

    def panels(self, every, first=2.0, step=0.002, groove=(0.02, 0.006)):
        edges = np.arange(first, self.length, every)
        k = np.searchsorted(edges, self.s)
        self.d += self.rng.normal(0, step, len(edges) + 1).astype(np.float32)[k][:, None]
        self.db += self.rng.normal(0, 0.3, len(edges) + 1).astype(np.float32)[k][:, None]
        for e in edges:
            self.groove_s(e, *groove)

    def masonry(self, course=0.30, stone=0.55, joint=(0.022, 0.012)):
        """Courses along the tunnel (rows in u), stones of random length."""
        rng = self.rng
        n = int(self.profile.length / course)
        for c in range(n):
            j0, j1 = int(c * self.nu / n), int((c + 1) * self.nu / n)
            uu = (np.arange(j0, j1) + 0.5 - j0) / (j1 - j0)
            bed = np.minimum(uu, 1 - uu) * course
            cuts = np.cumsum(rng.uniform(0.6, 1.4, int(self.length / stone) + 9) * stone) - 2 * stone
            k = np.searchsorted(cuts, self.s)
            lo, hi = cuts[k - 1], cuts[np.minimum(k, len(cuts) - 1)]
            head = np.minimum(self.s - lo, hi - self.s)
            dist = np.minimum(bed[None, :], head[:, None])
            face = smoothstep((dist - joint[0] * 0.25) / (joint[0] * 0.75))
            off, tone = rng.normal(0, 0.004, len(cuts) + 1), rng.normal(0, 0.8, len(cuts) + 1)
            bulge = 0.004 * np.minimum(dist / 0.1, 1.0)
            self.d[:, j0:j1] += ((off[k][:, None] + bulge) * face - joint[1] * (1 - face)).astype(np.float32)
            self.db[:, j0:j1] += (tone[k][:, None] * face + 0.6 * (1 - face)).astype(np.float32)

    # --- places
    def window(self, s, u, half):
        i = np.nonzero(np.abs(self.s - s) <= half)[0]
        j = np.nonzero((np.abs(self.u - u) <= half))[0]
        return slice(i[0], i[-1] + 1), slice(j[0], j[-1] + 1)

    def blob(self, s, u, aspect, side, area_max, irregular=0.25, run=1.0, rng=None):
        """Function phi whose level sets are outlines (window, phi). aspect: extent in u over that in s; run: drawn out downwards."""
        rng = rng or self.rng
        half = 1.6 * np.sqrt(area_max * max(aspect, 1 / aspect)) * max(1.0, run**0.5) + 0.3
        win = self.window(s, u, half)
        ss, uu = self.s[win[0]][:, None] - s, self.u[win[1]][None, :] - u
        down = -uu if side == "r" else uu
        if side != "c" and run > 1:
            uu = np.where(down > 0, uu / run, uu)
        phi = np.hypot(ss * np.sqrt(aspect), uu / np.sqrt(aspect))
        size = np.sqrt(area_max)
        shape = phi.shape
        n = (
            self.noise(0.6 * size + 0.08, shape=shape, rng=rng) * 0.7
            + self.noise(0.25 * size + 0.05, shape=shape, rng=rng) * 0.4
        )
        phi = phi * np.clip(1 + irregular * n, 0.3, 3)
        phi[:, ~self.on_lining[win[1]]] = 9e9
        return win, phi

    def level(self, win, phi, area):
        a = np.broadcast_to(self.cell_area[:, win[1]], phi.shape).ravel()
        o = np.argsort(phi.ravel(), kind="stable")
        k = np.searchsorted(np.cumsum(a[o]), area)
        return phi.ravel()[o[min(k, len(o) - 1)]]

    def soft(self, mask, rim):
        """1 inside, 0 outside, a half on the outline of mask; rim: width over which."""
        m = np.pad(mask, 1)
        d = (ndimage.distance_transform_edt(m) - ndimage.distance_transform_edt(~m))[1:-1, 1:-1] * self.ds
        return smoothstep(d / rim + 0.5)
