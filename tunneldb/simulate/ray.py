"""Rays from a scanner to the first thing they meet in a synthetic tunnel.

The offset of the swept section is a nearly concave function along a ray, so that Newton's method, started where the
offset falls, finds the lining in a few steps from beyond. Appendages stand within a known distance of the lining;
only the last part of the ray is marched through their signed distances. Niches are straight boxes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tunneldb.simulate.coat import Coat, level
from tunneldb.simulate.furniture import (
    APPENDAGE,
    FLOOR,
    LINING,
    NICHE,
    OUTLIER,
    Appendage,
    Niche,
    appendage_table,
    bin_of,
    bins,
    distance,
    niche_table,
)
from tunneldb.simulate.ground import Ground, bump, meet_ground
from tunneldb.simulate.leaks import EDGE, Leak, depth_inside, edge_table
from tunneldb.simulate.section import LINE, nearest
from tunneldb.simulate.skin import Skin, meet_skin
from tunneldb.simulate.things import BEAM, Parts, meet_parts
from tunneldb.simulate.tunnel import Tunnel, gradient, newton_step

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Beyond this incidence the echo is lost, as scanners lose it.
MINIMUM_COSINE = 0.087
# Share of the rays past an edge of a free-standing thing that give a mixed pixel.
MIXED = 0.1
# Least range of the scanner, m.
NEAREST = 1.0

# A Newton step for chainage leaves an error of its square times the curvature, in chainage, u and w: after a step
# of this many metres the next iteration of the ray corrects what is left.
LOOSE = 0.05


class Scene(NamedTuple):
    """A tunnel and what is in it, as flat arrays for the kernels."""

    plan: Array
    profile: Array
    parts: Array
    # chainage of both ends, arc of the floor's corner, reach of the appendages off the lining, half a leak's edge,
    # number of leaks in niches
    ends: Array
    items: Array
    item_bins: Index
    item_list: Index
    niches: Array
    niche_bins: Index
    niche_list: Index
    edges: Array
    edge_first: Index
    leaks: Array
    leak_bins: Index
    leak_list: Index


def scene(tunnel: Tunnel, items: list[Appendage], niches: list[Niche], leaks: list[Leak], edge: float = EDGE) -> Scene:
    """Lay a tunnel and its contents out for the kernels; leaks go from dry to wet over ``edge`` m."""
    line = tunnel.line
    item_rows, niche_rows = appendage_table(tunnel, items), niche_table(tunnel, niches)
    edges, first, leak_rows = edge_table(leaks)
    wet_niches = float(sum(leak.kind == "niche" for leak in leaks))
    reach = max((i.standoff + 0.5 * i.depth for i in items), default=0.0)
    return Scene(
        line.plan,
        line.profile,
        tunnel.section.parts,
        np.array([line.start, line.end, tunnel.section.floor_arc, 1.1 * reach + 0.02, 0.5 * edge, wet_niches]),
        item_rows,
        *bins(item_rows[:, 1], item_rows[:, 2], line.start, line.end),
        niche_rows,
        *bins(niche_rows[:, 0], niche_rows[:, 1], line.start, line.end),
        edges,
        first,
        leak_rows,
        *bins(leak_rows[:, 0], leak_rows[:, 2], line.start, line.end),
    )


@njit(cache=True, nogil=True)
def _straight(parts: Array, u: float, w: float, du: float, dw: float) -> float:
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
def _lining(sc: Scene, o: Array, d: Array, s: float, furthest: float) -> tuple[float, float, float, float, float, float]:
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
def _item(sc: Scene, o: Array, d: Array, s: float, r: float, wall: float) -> tuple[float, int, float]:
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
def _niche(sc: Scene, o: Array, d: Array, s: float, r: float) -> tuple[float, float, bool]:
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
def _unrolled(sc: Scene, o: Array, d: Array, r: float, s: float) -> tuple[float, float]:
    """Chainage and arc of the place at range r, ``s`` a chainage near it."""
    x, y, z = o[0] + r * d[0], o[1] + r * d[1], o[2] + r * d[2]
    for _ in range(10):
        found = newton_step(sc.plan, sc.profile, x, y, z, s)
        s += found[0]
        if abs(found[0]) < 1e-6:
            break
    return s, nearest(sc.parts, found[1], found[2])[0]


@njit(cache=True, nogil=True)
def _uneven(sc: Scene, ground: Ground, o: Array, d: Array, s: float, r: float, on_floor: bool) -> tuple[float, float, bool]:
    """Range to ballast or a cambered floor where a ray meets the section at range r, cosine, whether it is floor."""
    x, y, z = o[0] + r * d[0], o[1] + r * d[1], o[2] + r * d[2]
    _, u, w, c, n, k, g, q, det = newton_step(sc.plan, sc.profile, x, y, z, s)
    gx, gy, gz = gradient(0.0, 1.0, u, w, c, n, k, g, q, det)
    return meet_ground(ground, o, d, r, u, w, c, n, gx * d[0] + gy * d[1] + gz * d[2], on_floor)


@njit(cache=True, nogil=True)
def _wetness(sc: Scene, s: float, arc: float) -> tuple[int, float]:
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


@njit(cache=True, nogil=True)
def trace(
    sc: Scene,
    parts: Parts | None,
    ground: Ground | None,
    coat: Coat | None,
    skin: Skin | None,
    origin: Array,
    direction: Array,
    hint: Array,
    noise: Array,
    chance: Array,
    outliers: float,
    stray: float,
    relief: float,
    furthest: float,
    out: Array,
) -> None:
    """Shoot rays.

    Parameters
    ----------
    parts, ground, coat, skin
        What stands free, the uneven floor, how bright the lining is from place to place, and where it departs from
        the section. Without them (None) the kernel is compiled without what they need.
    origin, direction : (n, 3)
        From the line's origin, m; unit vectors.
    hint : (n,)
        Chainage near each origin, m.
    noise : (n,)
        Range error, m.
    chance : (n, 2)
        Uniform numbers that decide on outliers and where they fall.
    outliers : float
        Share of rays that become isolated points.
    stray : float
        1: a fixed share of the rays at appendages and edges give mixed pixels; 0: none, the beam's footprint does.
    relief : float
        Height of small-scale relief of the lining, m.
    furthest : float
        Greatest range, m.
    out : (n, 13), without ``parts`` (n, 12)
        range (NaN: no echo), x, y, z, chainage, arc, offset, class, leak (-1: none), drop (dB), cosine of
        incidence, true range, thing (0: none). Chainage, arc and offset are those of the stored point; leak, drop
        and cosine those of the spot that the laser met.
    """
    for i in range(origin.shape[0]):
        o, d = origin[i], direction[i]
        wall, s, arc, cosine, offset0, s0 = _lining(sc, o, d, hint[i], 2.0 * furthest)
        out[i, 0] = np.nan
        is_open = math.isnan(wall)
        if offset0 <= 0.0:
            continue
        if parts is None and is_open:
            continue
        klass = FLOOR if abs(arc) > sc.ends[2] else LINING
        leak = -1
        drop = 0.0
        height = 0.0
        thing = 0
        edge = 1.0
        if is_open:
            wall = 2.0 * furthest
        elif ground is not None:
            hit, c, is_floor = _uneven(sc, ground, o, d, s, wall, klass == FLOOR)
            if not math.isnan(hit):
                wall, cosine, klass = hit, c, FLOOR if is_floor else LINING
        r = wall
        if not is_open and sc.items.shape[0] > 0:
            # The offset is concave along the ray, so it cannot fall below the appendages' reach before here.
            begin = wall * max(0.0, 1.0 - sc.ends[3] / offset0)
            hit, which, c = _item(sc, o, d, s0 + (s - s0) * begin / wall, begin, wall)
            if which >= 0:
                r, cosine = hit, c
                klass = int(sc.items[which, 9])
                drop = sc.items[which, 10]
        if r == wall and klass == LINING and not is_open:
            hit, c, is_back = _niche(sc, o, d, s, wall)
            if not math.isnan(hit):
                r, cosine, klass = hit, c, NICHE
                if is_back and sc.ends[5] > 0.0:
                    leak, drop = _wetness(sc, *_unrolled(sc, o, d, r, s))
            else:
                if skin is not None:
                    r, s, arc, cosine, is_floor = meet_skin(skin, sc.plan, sc.profile, sc.parts, o, d, wall, s, cosine)
                    wall = r
                    klass = FLOOR if is_floor else LINING
                if klass == LINING:
                    leak, drop = _wetness(sc, s, arc)
                    if coat is not None:
                        drop -= level(coat, s, arc)
                if relief > 0.0:
                    height = relief * bump(s, arc, 0.12)
        behind = wall
        if parts is not None:
            hit, which, c, inside = meet_parts(parts, sc.ends[0], o, d, s0, s, r)
            if which >= 0:
                s = s0 + (s - s0) * hit / r
                behind = r
                r, cosine, edge, height, leak = hit, c, inside, 0.0, -1
                klass = int(parts.labels[which, 0])
                drop = parts.labels[which, 1]
                thing = int(parts.labels[which, 2])
            elif is_open:
                continue
        if r > furthest or cosine < MINIMUM_COSINE:
            continue
        true_range = r
        r += noise[i] - height / max(cosine, 0.3)
        v = chance[i, 1]
        if chance[i, 0] < outliers:
            # Most isolated points hang in the air, some lie behind the wall (multipath).
            r = NEAREST + v / 0.7 * (0.95 * r - NEAREST) if v < 0.7 else r * (1.0 + 0.5 * (v - 0.7))
            klass = OUTLIER
        elif (klass == APPENDAGE and thing == 0 and chance[i, 0] < outliers + 0.01 * stray) or (
            thing > 0 and edge < BEAM and chance[i, 0] < outliers + MIXED * stray
        ):
            r += v * (behind - r)  # a mixed pixel: the beam meets an edge and what lies behind it
            klass = OUTLIER
        if r < NEAREST or r > furthest:
            continue
        if klass == OUTLIER:
            leak = -1
            thing = 0
            drop += 3.0
        x, y, z = o[0] + r * d[0], o[1] + r * d[1], o[2] + r * d[2]
        for _ in range(10):
            found = newton_step(sc.plan, sc.profile, x, y, z, s)
            s += found[0]
            if abs(found[0]) < 1e-3:
                break
        arc, offset, _, _ = nearest(sc.parts, found[1], found[2])
        if s < sc.ends[0] or s > sc.ends[1]:
            continue
        out[i, 0] = r
        out[i, 1] = x
        out[i, 2] = y
        out[i, 3] = z
        out[i, 4] = s
        out[i, 5] = arc
        out[i, 6] = offset
        out[i, 7] = klass
        out[i, 8] = leak
        out[i, 9] = drop
        out[i, 10] = min(cosine, 1.0)
        out[i, 11] = true_range
        if parts is not None:
            out[i, 12] = thing
