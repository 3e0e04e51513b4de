"""What hangs on the lining or stands before it: distance functions in local metres (s, x, z)."""

from __future__ import annotations

import numpy as np


class Cable:
    def __init__(self, profile, u, off, r, s0=-9, s1=99, sag=0.012, span=1.2, phase=0.0, db=-7.0):
        x, z, nx, nz = profile.point(u)
        self.x, self.z, self.r = x + nx * off, z + nz * off, r
        self.s0, self.s1, self.sag, self.span, self.phase, self.db = s0, s1, sag, span, phase, db
        self.reach = off + r + 0.05

    def sdf(self, s, x, z):
        sag = self.sag * np.sin(np.pi * (s - self.phase) / self.span) ** 2
        d = np.hypot(x - self.x, z - self.z + sag) - self.r
        out = np.maximum(self.s0 - s, s - self.s1)
        return np.where(out > 0, np.hypot(np.maximum(d, 0), out), d) if self.s0 > -5 or self.s1 < 90 else d


class Box:
    """Box on the lining: from `gap` to gap+depth off it, half height ht along the profile, half length hs; period repeats it along s."""

    def __init__(self, profile, u, s, depth, ht, hs, gap=0.0, period=None, s0=-9, s1=99, db=-4.0):
        x, z, nx, nz = profile.point(u)
        self.c = (x + nx * (gap + depth / 2), z + nz * (gap + depth / 2))
        self.n, self.t = (nx, nz), (nz, -nx)
        self.hn, self.ht, self.hs, self.s, self.period, self.s0, self.s1, self.db = depth / 2, ht, hs, s, period, s0, s1, db
        self.reach = (gap + depth) * 1.1 + 0.05
        self.reach += 0.0 if ht < 0.4 else 0.15

    def sdf(self, s, x, z):
        ds = s - self.s
        if self.period:
            p = self.period
            lo, hi = np.ceil((self.s0 - self.s) / p), np.floor((self.s1 - self.s) / p)
            ds = ds - p * np.clip(np.round(ds / p), lo, hi)
        dx, dz = x - self.c[0], z - self.c[1]
        a = np.abs(ds) - self.hs
        b = np.abs(dx * self.n[0] + dz * self.n[1]) - self.hn
        c = np.abs(dx * self.t[0] + dz * self.t[1]) - self.ht
        out = np.sqrt(np.maximum(a, 0) ** 2 + np.maximum(b, 0) ** 2 + np.maximum(c, 0) ** 2)
        return out + np.minimum(np.maximum(a, np.maximum(b, c)), 0)


def tray(profile, u, off=0.12, n=3, r=0.02, pitch=0.055, span=1.2, phase=0.0, s0=-9, s1=99, db=-7.0, rng=None):
    """n cables one over the other on brackets."""
    rng = rng or np.random.default_rng(1)
    out = [Box(profile, u, phase, off + r + 0.02, 0.5 * pitch * n + 0.03, 0.02, period=span, s0=s0, s1=s1, db=-3.0)]
    for i in range(n):
        out.append(
            Cable(
                profile,
                u + (i - (n - 1) / 2) * pitch,
                off + rng.normal(0, 0.006),
                r * rng.uniform(0.8, 1.25),
                s0=s0,
                s1=s1,
                sag=rng.uniform(0.004, 0.02),
                span=span,
                phase=phase,
                db=db + rng.normal(0, 0.8),
            )
        )
    return out


def pipe(profile, u, off, r, span=2.5, phase=0.3, s0=-9, s1=99, db=-3.0):
    return [
        Cable(profile, u, off, r, sag=0.0, s0=s0, s1=s1, db=db),
        Box(profile, u, phase, off, 0.04, 0.03, period=span, s0=s0, s1=s1, db=-3.0),
    ]
