"""Intersection of rays with the lining of a synthetic tunnel, fixtures, niches and floor, and the wetness there.

The offset of the swept section is a nearly concave function along a ray. So Newton's method, started where the offset
decreases, finds the lining from outside in a few steps. Fixtures are within a known distance of the lining; only
the last part of the ray is marched through their signed distances. Niches are straight boxes.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.lining.leaks import depth_inside
from tunneldb.simulate.objects.fixtures import bin_of, distance, listed_pairs
from tunneldb.simulate.rays.scene import Scene
from tunneldb.simulate.tunnel.section import LINE, nearest
from tunneldb.simulate.tunnel.tunnel import foot, gradient

RANGE, CHAINAGE, ARC, COSINE, START_OFFSET, START_CHAINAGE = range(6)
"""Row numbers of the result of :func:`intersect_lining`: range, chainage, arc and cosine of incidence at the hit on the
lining, and offset and chainage at the ray's start."""

# A Newton step for chainage leaves an error of its square times the curvature, in chainage, u and w: after a step
# of at most this many metres, the next iteration of the ray corrects the rest.
CHAINAGE_TOLERANCE = 0.05


@inner
def _straight(parts: Float, u: float, w: float, du: float, dw: float) -> float:
    """Return the range at which a ray in a section's plane leaves the section, as in a straight tunnel.

    A convex section is inside all its lines; if their first crossing is outside, an arc is hit before.
    """
    flat = 1e300
    round_ = 1e300
    for i in range(parts.shape[0]):
        if parts[i, 0] == LINE:
            for k in range(2):
                side = 1.0 - 2.0 * k
                nu, nw = side * parts[i, 6], -parts[i, 5]
                rate = nu * du + nw * dw
                if rate < -1e-12:
                    flat = min(flat, ((u - side * parts[i, 3]) * nu + (w - parts[i, 4]) * nw) / -rate)
        else:
            h = w - parts[i, 4]
            a = du * du + dw * dw
            b = u * du + h * dw
            root = b * b - a * (u * u + h * h - parts[i, 5] * parts[i, 5])
            if a > 1e-18 and root > 0.0:
                round_ = min(round_, (math.sqrt(root) - b) / a)
    if round_ < flat and (flat > 1e6 or nearest(parts, u + flat * du, w + flat * dw)[1] < -1e-6):
        return round_
    return flat


@kernel
def intersect_lining(
    plan: Float, profile: Float, parts: Float, origin: Float, direction: Float, hint: Float, furthest: float, found: Float
) -> None:
    """Intersect rays (n, 3) with the swept section, into ``found`` (6, n): RANGE, CHAINAGE and so on.

    ``hint`` (n,) are chainages near the origins, m. The range is NaN if nothing is hit within ``furthest`` m.
    """
    for i in range(origin.shape[0]):
        x, y, z = origin[i, 0], origin[i, 1], origin[i, 2]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        s = foot(plan, profile, x, y, z, hint[i], 1e-9, np.int64(20))[0]
        found[0, i] = np.nan
        found[3, i] = 0.0
        found[5, i] = s
        arc = 0.0
        r = 0.0
        for j in range(80):
            s, step, u, w, c, n, k, g, q, det = foot(plan, profile, x, y, z, s, CHAINAGE_TOLERANCE, np.int64(2))
            arc, offset, gu, gw = nearest(parts, u, w)
            nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, det)
            slope = nx * dx + ny * dy + nz * dz
            if j == 0:
                found[4, i] = offset
                advance = _straight(parts, u, w, dx * n - dy * c, (dz - g * (dx * c + dy * n)) / q)
            elif abs(offset) < 1e-7 and abs(step) < 1e-4 and r > 0.0:
                found[0, i] = r
                found[3, i] = -slope / math.sqrt(nx * nx + ny * ny + nz * nz)
                break
            elif offset > 0.0 and r >= furthest:
                break
            else:
                advance = offset if slope > -0.02 and offset > 0.0 else -offset / slope
            advance = min(advance, furthest - r)
            r += advance
            x += advance * dx
            y += advance * dy
            z += advance * dz
            s += advance * (dx * c + dy * n + dz * g) / det
        found[1, i] = s
        found[2, i] = arc


@kernel
def intersect_appendages(
    plan: Float,
    profile: Float,
    start: float,
    reach: float,
    items: Float,
    bins: Int64,
    listed: Int64,
    origin: Float,
    direction: Float,
    found: Float,
    r: Float,
    which: Int64,
) -> None:
    """March the last part of rays to the lining, and find hits on fixtures.

    Parameters
    ----------
    start, reach : float
        Chainage of the tunnel's start; greatest distance of fixtures from the lining, m.
    items, bins, listed
        Rows of :func:`appendage_table`, by chainage.
    found : (6, n)
        Hits of rays without fixtures; the cosine is replaced.
    r : (n,)
        Their ranges, replaced.
    which : (n,)
        Row of the fixture, unchanged if none is hit.
    """
    for i in range(origin.shape[0]):
        wall = found[0, i]
        if math.isnan(wall) or found[4, i] <= 0.0:
            continue
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        # The offset is concave along the ray, so it cannot be less than the fixtures' reach before this point.
        begin = wall * max(0.0, 1.0 - reach / found[4, i])
        s = found[5, i] + (found[1, i] - found[5, i]) * begin / wall
        at = begin
        for _ in range(200):
            x, y, z = origin[i, 0] + at * dx, origin[i, 1] + at * dy, origin[i, 2] + at * dz
            s, _, u, w, c, n, k, g, q, det = foot(plan, profile, x, y, z, s, CHAINAGE_TOLERANCE, np.int64(2))
            b = bin_of(s, start, bins)
            gap = 0.8  # below the REACH of a bin's list
            nearby = np.int64(-1)
            for j in range(bins[b], bins[b + 1]):
                to = distance(items, listed[j], s, u, w)
                if to < gap:
                    gap = to
                    nearby = listed[j]
            if gap < 1e-4:
                if at > 0.0:
                    h = 1e-5
                    gs = (distance(items, nearby, s + h, u, w) - distance(items, nearby, s - h, u, w)) / (2 * h)
                    gu = (distance(items, nearby, s, u + h, w) - distance(items, nearby, s, u - h, w)) / (2 * h)
                    gw = (distance(items, nearby, s, u, w + h) - distance(items, nearby, s, u, w - h)) / (2 * h)
                    nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, det)
                    nx, ny, nz = nx + gs * c / det, ny + gs * n / det, nz + gs * g / det
                    r[i] = at
                    which[i] = nearby
                    found[3, i] = -(nx * dx + ny * dy + nz * dz) / math.sqrt(nx * nx + ny * ny + nz * nz)
                break
            advance = 0.96 * gap
            at += advance
            if at >= wall:
                break
            s += advance * (dx * c + dy * n + dz * g) / det


def intersect_niches(
    scene: Scene, origin: Float, direction: Float, rays: Int64, s: Float, r: Float
) -> tuple[Int64, Float, Float, Bool]:
    """Intersect some ``rays`` (m,), which cross the lining at chainages and ranges (m,), with the inside of a niche behind.

    Return the indices of hits among the m, their ranges and cosines there, and True for hits on the back wall.
    """
    passing, niche = listed_pairs(s, scene.ends[0], scene.niche_bins, scene.niche_list)
    row, t = scene.niches[niche], r[passing]
    o, d = origin[rays[passing]], direction[rays[passing]]
    leave = np.full(len(t), 1e300)
    cosine = np.zeros(len(t))
    is_back = np.zeros(len(t), dtype=bool)
    inside = np.ones(len(t), dtype=bool)
    x, y, z = (o[:, k] + t * d[:, k] - row[:, 2 + k] for k in range(3))
    zero = np.zeros(len(t))
    limits = ((-row[:, 14], row[:, 14]), (zero, row[:, 16]), (zero, row[:, 15]))
    for axis, (low, high) in enumerate(limits):
        a, b, c = row[:, 5 + 3 * axis : 8 + 3 * axis].T
        at = x * a + y * b + z * c
        rate = d[:, 0] * a + d[:, 1] * b + d[:, 2] * c
        inside &= ~((at < low) | (at > high))
        moves = np.abs(rate) > 1e-12
        to = (np.where(rate > 0.0, high, low) - at) / np.where(moves, rate, 1.0)
        first = moves & (to < leave)
        leave = np.where(first, to, leave)
        cosine = np.where(first, np.abs(rate), cosine)
        is_back = np.where(first, axis == 1, is_back)
    return passing[inside], (t + leave)[inside], cosine[inside], is_back[inside]


@kernel
def _wetness(
    edges: Float, first: Int64, leaks: Float, bins: Int64, listed: Int64, start: float, edge: float, s: Float, arc: Float,
    leak: Int64, drop: Float,
) -> None:  # fmt: skip
    for i in range(s.shape[0]):
        x, y = s[i], arc[i]
        leak[i] = -1
        drop[i] = 0.0
        b = bin_of(x, start, bins)
        for j in range(bins[b], bins[b + 1]):
            k = listed[j]
            if x < leaks[k, 0] - edge or x > leaks[k, 2] + edge or y < leaks[k, 1] - edge or y > leaks[k, 3] + edge:
                continue
            depth = depth_inside(edges, first[k], first[k + 1], x, y)
            if depth > -edge:
                share = min(0.5 * (depth + edge) / edge, 1.0)
                if depth > 0.0:
                    leak[i] = k
                drop[i] = max(drop[i], leaks[k, 4] * share * share * (3.0 - 2.0 * share))


def wetness(scene: Scene, s: Float, arc: Float) -> tuple[Int64, Float]:
    """Return the leak numbers (n,) at positions on the lining (-1: none), and the darkening there, dB."""
    leak, drop = np.empty(s.size, dtype=np.int64), np.empty(s.size)
    _wetness(
        scene.edges, scene.edge_first, scene.leaks, scene.leak_bins, scene.leak_list, scene.ends[0], scene.ends[4], s, arc,
        leak, drop,
    )  # fmt: skip
    return leak, drop
