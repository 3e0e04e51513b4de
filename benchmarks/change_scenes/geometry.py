"""Axis of the tunnel (arc in plan, constant gradient) and its closed profile with a distance table."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree


class Axis:
    """Local metres: s along, x to the right, z up (all from the axis). World = origin + local plan, heading h0, radius R."""

    def __init__(self, origin, heading_deg, radius, gradient):
        self.origin = np.array(origin, float)
        self.h = math.radians(heading_deg)  # clockwise from north
        self.R = float(radius)  # >0: bends to the right; 0: straight
        self.g = float(gradient)

    def to_local(self, p):
        """Plan coordinates p relative to the origin, in the frame (right, forward, up) at s=0 -> s, x, z."""
        if self.R == 0:
            s, x = p[..., 1], p[..., 0]
        else:
            R = self.R
            dx = R - p[..., 0]
            if R > 0:
                s = R * np.arctan2(p[..., 1], dx)
                x = R - np.hypot(dx, p[..., 1])
            else:
                s = -R * np.arctan2(p[..., 1], -dx)
                x = R + np.hypot(dx, p[..., 1])
        return s, x, p[..., 2] - self.g * s

    def from_local(self, s, x, z):
        s, x, z = np.broadcast_arrays(*(np.asarray(v, float) for v in (s, x, z)))
        if self.R == 0:
            return np.stack([x, s, z + self.g * s], -1)
        a = s / self.R
        r = self.R - x
        return np.stack([self.R - r * np.cos(a), r * np.sin(a), z + self.g * s], -1)

    def frame(self, s):
        """Unit vectors (right, forward) in the plan frame at s."""
        a = s / self.R if self.R else np.zeros_like(s)
        c, q = np.cos(a), np.sin(a)
        o = np.zeros_like(c)
        return np.stack([c, -q, o], -1), np.stack([q, c, o], -1)

    def world(self, p):
        """Plan frame -> EPSG:25832."""
        c, q = math.cos(self.h), math.sin(self.h)
        out = np.empty(p.shape)
        out[..., 0] = self.origin[0] + c * p[..., 0] + q * p[..., 1]
        out[..., 1] = self.origin[1] - q * p[..., 0] + c * p[..., 1]
        out[..., 2] = self.origin[2] + p[..., 2]
        return out


def fillet(poly, r):
    """Closed polygon with its corners rounded by radius r (number or one a corner)."""
    poly = np.array(poly, float)
    n = len(poly)
    r = np.broadcast_to(r, n)
    out = []
    for i in range(n):
        a, b, c = poly[i - 1], poly[i], poly[(i + 1) % n]
        u, v = (a - b) / np.linalg.norm(a - b), (c - b) / np.linalg.norm(c - b)
        ang = math.acos(np.clip(u @ v, -1, 1))
        if r[i] <= 0 or ang > math.radians(178):
            out.append(b)
            continue
        t = r[i] / math.tan(ang / 2)
        m = b + (u + v) / np.linalg.norm(u + v) * r[i] / math.sin(ang / 2)
        p, q = b + u * t - m, b + v * t - m
        a0 = math.atan2(p[1], p[0])
        da = (math.atan2(q[1], q[0]) - a0 + math.pi) % (2 * math.pi) - math.pi
        for w in np.linspace(0, 1, 24):
            out.append(m + r[i] * np.array([math.cos(a0 + w * da), math.sin(a0 + w * da)]))
    return np.array(out)


def circle_profile(radius, floor):
    """Circle about (0,0) with a flat floor at height floor; counter-clockwise from floor's right end."""
    a0 = math.asin(floor / radius)
    a = np.linspace(a0, math.pi - a0, 1500)
    arc = np.c_[radius * np.cos(a), radius * np.sin(a)]
    return smooth_corner(arc)


def arch_profile(half_width, wall, floor, rise=None, bow=0.0):
    """Walls from the floor up to the springing at `floor`+wall (bowed outwards by bow), half ellipse above it."""
    rise = rise or half_width
    y0 = floor + wall
    zw = np.linspace(floor, y0, 400)
    right = np.c_[half_width + bow * (np.sin(np.pi * (zw - floor) / wall / 2) - 1), zw]
    a = np.linspace(0, math.pi, 1200)[1:-1]
    arc = np.c_[half_width * np.cos(a), y0 + rise * np.sin(a)]
    left = right[::-1] * [-1, 1]
    return smooth_corner(np.vstack([right, arc, left]))


def smooth_corner(arc, r=0.06):
    """Closes an arc (counter-clockwise, from right foot to left foot) by the floor with rounded feet."""
    # cut r*1.5 of the arc at each end and join by a small quadratic curve
    d = np.r_[0, np.cumsum(np.hypot(*np.diff(arc, axis=0).T))]
    keep = (d > r) & (d < d[-1] - r)
    foot_r, foot_l = arc[0], arc[-1]
    body = arc[keep]

    def bez(p, c, q):
        w = np.linspace(0, 1, 25)[:, None]
        return (1 - w) ** 2 * p + 2 * w * (1 - w) * c + w**2 * q

    fl = foot_l + [r, 0]
    fr = foot_r - [r, 0]
    return np.vstack([bez(fr, foot_r, body[0])[:-1], body, bez(body[-1], foot_l, fl)[1:]])


class Profile:
    """Closed, counter-clockwise; u is arc length from the middle of the floor (right foot first)."""

    def __init__(self, pts, step=0.01):
        pts = np.asarray(pts, float)
        zmin = pts[:, 1].min()
        # closed: start at floor's middle
        poly = np.vstack([[0.0, zmin], pts, [0.0, zmin]])
        d = np.r_[0, np.cumsum(np.hypot(*np.diff(poly, axis=0).T))]
        k = np.r_[True, np.diff(d) > 1e-9]
        poly, d = poly[k], d[k]
        self.length = d[-1]
        self.n = int(round(self.length / step))
        self.du = self.length / self.n
        fine = 4 * self.n
        uf = np.arange(fine) * self.length / fine
        xf, zf = np.interp(uf, d, poly[:, 0]), np.interp(uf, d, poly[:, 1])
        tx, tz = np.roll(xf, -1) - np.roll(xf, 1), np.roll(zf, -1) - np.roll(zf, 1)
        m = np.hypot(tx, tz)
        tx, tz = tx / m, tz / m
        self.u = uf[::4]
        self.x, self.z = xf[::4], zf[::4]
        self.tx, self.tz = tx[::4], tz[::4]
        self.nx, self.nz = -self.tz, self.tx  # inward (left of the direction of travel)
        self.floor_z = zmin
        self.floor = self.z < zmin + 0.03
        # distance table
        self.h = 0.01
        self.x0, self.z0 = xf.min() - 0.25, zf.min() - 0.25
        nx, nz = int((xf.max() + 0.25 - self.x0) / self.h) + 2, int((zf.max() + 0.25 - self.z0) / self.h) + 2
        gx, gz = np.meshgrid(self.x0 + np.arange(nx) * self.h, self.z0 + np.arange(nz) * self.h, indexing="ij")
        q = np.c_[gx.ravel(), gz.ravel()]
        tree = cKDTree(np.c_[xf, zf])
        _, i = tree.query(q, workers=1)
        vx, vz = q[:, 0] - xf[i], q[:, 1] - zf[i]
        a = vx * tx[i] + vz * tz[i]
        b = -vx * tz[i] + vz * tx[i]
        half = self.length / fine
        a = np.clip(a, -half, half)
        r2 = vx * vx + vz * vz
        self.sd = np.where(np.abs(b) > 0.3, np.sign(b) * np.sqrt(np.maximum(r2 - a * a, 0)), b).reshape(nx, nz)
        self.ut = (uf[i] + a).reshape(nx, nz)
        self.shape = (nx, nz)

    def cell(self, x, z):
        fx, fz = (x - self.x0) / self.h, (z - self.z0) / self.h
        np.clip(fx, 0, self.shape[0] - 1.001, out=fx)
        np.clip(fz, 0, self.shape[1] - 1.001, out=fz)
        i, j = fx.astype(np.int64), fz.astype(np.int64)
        return i * self.shape[1] + j, fx - i, fz - j

    def dist(self, cell):
        k, a, b = cell
        t, w = self.sd.ravel(), self.shape[1]
        return (t[k] * (1 - b) + t[k + 1] * b) * (1 - a) + (t[k + w] * (1 - b) + t[k + w + 1] * b) * a

    def arc(self, cell):
        k, a, b = cell
        t, w, L = self.ut.ravel(), self.shape[1], self.length
        c = t[k]
        e = [t[k + m] - c for m in (1, w, w + 1)]
        e = [v - L * np.round(v / L) for v in e]
        return (c + e[0] * b * (1 - a) + e[1] * a * (1 - b) + e[2] * a * b) % L

    def at(self, side, where):
        """u of a place: ('r'|'l', height above floor) on the wall, ('c', metres right of the crown along the lining)."""
        crown = self.length / 2
        if side == "c":
            return crown - where
        m = (self.u < crown) & ~self.floor
        k = np.argmin(np.abs(self.z[m] - (self.floor_z + where)))
        u = self.u[m][k]
        return u if side == "r" else self.length - u

    def point(self, u):
        j = int(round(u / self.du)) % self.n
        return self.x[j], self.z[j], self.nx[j], self.nz[j]
