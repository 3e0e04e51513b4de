"""Where a ray meets the lining of a synthetic tunnel, what stands on it, its niches and its floor, and how wet it is there.

The offset of the swept section is a nearly concave function along a ray, so that Newton's method, started where the
offset falls, finds the lining in a few steps from beyond. Appendages stand within a known distance of the lining;
only the last part of the ray is marched through their signed distances. Niches are straight boxes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tunneldb.arrays import Float
from tunneldb.simulate.lining.ballast import Ground, meet_ground
from tunneldb.simulate.lining.leaks import depth_inside
from tunneldb.simulate.objects.fixtures import bin_of, distance
from tunneldb.simulate.rays.scene import Scene
from tunneldb.simulate.tunnel.section import LINE, nearest
from tunneldb.simulate.tunnel.tunnel import gradient, newton_step

# A Newton step for chainage leaves an error of its square times the curvature, in chainage, u and w: after a step
# of this many metres the next iteration of the ray corrects what is left.
LOOSE = 0.05


@njit(cache=True, nogil=True)
def _straight(parts: Float, u: float, w: float, du: float, dw: float) -> float:
    """Range at which a ray of a section's plane leaves the section, as in a straight tunnel.

    A convex section lies inside all its lines; where their first crossing is outside, an arc is met before.
    """
    flat = 1e300
    round_ = 1e300
    for i in range(parts.shape[0]):
        if parts[i, 0] == LINE:
            for side in (1.0, -1.0):
                nu, nw = side * parts[i, 6], -parts[i, 5]
                rate = nu * du + nw * dw
                if rate < -1e-12:
                    flat = min(flat, ((u - side * parts[i, 3]) * nu + (w - parts[i, 4]) * nw) / -rate)
        else:
            h = w - parts[i, 4]
            a = du * du + dw * dw
            b = u * du + h * dw
            root = b * b - a * (u * u + h * h - parts[i, 5] ** 2)
            if a > 1e-18 and root > 0.0:
                round_ = min(round_, (math.sqrt(root) - b) / a)
    if round_ < flat and (flat > 1e6 or nearest(parts, u + flat * du, w + flat * dw)[1] < -1e-6):
        return round_
    return flat


@njit(cache=True, nogil=True)
def meet_lining(sc: Scene, o: Float, d: Float, s: float, furthest: float) -> tuple[float, float, float, float, float, float]:
    """Range along a ray to the swept section, chainage, arc and cosine there, then at the start: offset, chainage.

    Range is NaN when nothing is met within ``furthest``.
    """
    x, y, z = o[0], o[1], o[2]
    for _ in range(20):
        step, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
        s += step
        if abs(step) < 1e-9:
            break
    s0 = s
    offset0 = 0.0
    arc = 0.0
    r = 0.0
    for i in range(80):
        step, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
        s += step
        if abs(step) > LOOSE:
            step, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
            s += step
        arc, offset, gu, gw = nearest(sc.parts, u, w)
        nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, det)
        slope = nx * d[0] + ny * d[1] + nz * d[2]
        if i == 0:
            offset0 = offset
            du = d[0] * n - d[1] * c
            dw = (d[2] - g * (d[0] * c + d[1] * n)) / q
            advance = min(_straight(sc.parts, u, w, du, dw), furthest)
            r = advance
            x += advance * d[0]
            y += advance * d[1]
            z += advance * d[2]
            s += advance * (d[0] * c + d[1] * n + d[2] * g) / det
            continue
        if abs(offset) < 1e-7 and abs(step) < 1e-4 and r > 0.0:
            norm = math.sqrt(nx * nx + ny * ny + nz * nz)
            return r, s, arc, -slope / norm, offset0, s0
        advance = offset if slope > -0.02 and offset > 0.0 else -offset / slope
        if offset > 0.0 and r >= furthest:
            return np.nan, s, arc, 0.0, offset0, s0
        advance = min(advance, furthest - r)
        r += advance
        x += advance * d[0]
        y += advance * d[1]
        z += advance * d[2]
        s += advance * (d[0] * c + d[1] * n + d[2] * g) / det
    return np.nan, s, arc, 0.0, offset0, s0


@njit(cache=True, nogil=True)
def meet_item(sc: Scene, o: Float, d: Float, s: float, r: float, wall: float) -> tuple[float, int, float]:
    """March from range r to the lining at ``wall``: range to an appendage (NaN: none), which, cosine there."""
    r_begin = r
    for _ in range(200):
        x, y, z = o[0] + r * d[0], o[1] + r * d[1], o[2] + r * d[2]
        step, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
        s += step
        if abs(step) > LOOSE:
            step, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
            s += step
        b = bin_of(s, sc.ends[0], sc.item_bins)
        near = 0.8  # below the REACH of a bin's list
        which = -1
        for j in range(sc.item_bins[b], sc.item_bins[b + 1]):
            gap = distance(sc.items[sc.item_list[j]], s, u, w)
            if gap < near:
                near = gap
                which = sc.item_list[j]
        if near < 1e-4:
            if r == r_begin and r == 0.0:
                return np.nan, -1, 0.0
            row = sc.items[which]
            h = 1e-5
            gs = (distance(row, s + h, u, w) - distance(row, s - h, u, w)) / (2 * h)
            gu = (distance(row, s, u + h, w) - distance(row, s, u - h, w)) / (2 * h)
            gw = (distance(row, s, u, w + h) - distance(row, s, u, w - h)) / (2 * h)
            nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, det)
            nx, ny, nz = nx + gs * c / det, ny + gs * n / det, nz + gs * g / det
            norm = math.sqrt(nx * nx + ny * ny + nz * nz)
            return r, which, -(nx * d[0] + ny * d[1] + nz * d[2]) / norm
        advance = 0.96 * near
        r += advance
        if r >= wall:
            return np.nan, -1, 0.0
        s += advance * (d[0] * c + d[1] * n + d[2] * g) / det
    return np.nan, -1, 0.0


@njit(cache=True, nogil=True)
def meet_niche(sc: Scene, o: Float, d: Float, s: float, r: float) -> tuple[float, float, bool]:
    """Range to the inside of a niche whose opening the ray passes at range r (NaN: none), cosine, whether its back wall."""
    b = bin_of(s, sc.ends[0], sc.niche_bins)
    for j in range(sc.niche_bins[b], sc.niche_bins[b + 1]):
        row = sc.niches[sc.niche_list[j]]
        leave = 1e300
        cosine = 0.0
        is_back = False
        inside = True
        for axis in range(3):
            a = row[5 + 3 * axis : 8 + 3 * axis]
            at = (o[0] + r * d[0] - row[2]) * a[0] + (o[1] + r * d[1] - row[3]) * a[1] + (o[2] + r * d[2] - row[4]) * a[2]
            rate = d[0] * a[0] + d[1] * a[1] + d[2] * a[2]
            low, high = 0.0, row[16]
            if axis == 0:
                low, high = -row[14], row[14]
            elif axis == 2:
                high = row[15]
            if at < low or at > high:
                inside = False
                break
            if abs(rate) > 1e-12:
                to = ((high if rate > 0.0 else low) - at) / rate
                if to < leave:
                    leave = to
                    cosine = abs(rate)
                    is_back = axis == 1
        if inside:
            return r + leave, cosine, is_back
    return np.nan, 0.0, False


@njit(cache=True, nogil=True)
def unrolled(sc: Scene, o: Float, d: Float, r: float, s: float) -> tuple[float, float]:
    """Chainage and arc of the place at range r, ``s`` a chainage near it."""
    x, y, z = o[0] + r * d[0], o[1] + r * d[1], o[2] + r * d[2]
    for _ in range(10):
        found = newton_step(sc.plan, sc.profile, x, y, z, s)
        s += found[0]
        if abs(found[0]) < 1e-6:
            break
    return s, nearest(sc.parts, found[1], found[2])[0]


@njit(cache=True, nogil=True)
def meet_uneven(sc: Scene, ground: Ground, o: Float, d: Float, s: float, r: float, on_floor: bool) -> tuple[float, float, bool]:
    """Range to ballast or a cambered floor where a ray meets the section at range r, cosine, whether it is floor."""
    x, y, z = o[0] + r * d[0], o[1] + r * d[1], o[2] + r * d[2]
    _, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
    gx, gy, gz = gradient(0.0, 1.0, u, w, c, n, k, g, q, det)
    return meet_ground(ground, o, d, r, u, w, c, n, gx * d[0] + gy * d[1] + gz * d[2], on_floor)


@njit(cache=True, nogil=True)
def wetness(sc: Scene, s: float, arc: float) -> tuple[int, float]:
    """Number of the leak that holds a point of the lining (-1: none) and drop there, dB."""
    edge = sc.ends[4]
    leak, drop = -1, 0.0
    b = bin_of(s, sc.ends[0], sc.leak_bins)
    for j in range(sc.leak_bins[b], sc.leak_bins[b + 1]):
        i = sc.leak_list[j]
        row = sc.leaks[i]
        if s < row[0] - edge or s > row[2] + edge or arc < row[1] - edge or arc > row[3] + edge:
            continue
        depth = depth_inside(sc.edges, sc.edge_first[i], sc.edge_first[i + 1], s, arc)
        if depth > -edge:
            share = min(0.5 * (depth + edge) / edge, 1.0)
            if depth > 0.0:
                leak = i
            drop = max(drop, row[4] * share * share * (3.0 - 2.0 * share))
    return leak, drop
