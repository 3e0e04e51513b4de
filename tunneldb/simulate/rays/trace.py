"""Rays from a scanner to the first thing they meet in a synthetic tunnel, and what is measured there."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tunneldb.arrays import Float
from tunneldb.simulate.lining.ballast import Ground, bump
from tunneldb.simulate.lining.reflectance import Reflectance, level
from tunneldb.simulate.lining.relief import LiningRelief, meet_skin
from tunneldb.simulate.objects.fixtures import APPENDAGE, FLOOR, LINING, NICHE, OUTLIER
from tunneldb.simulate.objects.primitives import BEAM, Parts, meet_parts
from tunneldb.simulate.rays.intersect import meet_item, meet_lining, meet_niche, meet_uneven, unrolled, wetness
from tunneldb.simulate.rays.scene import Scene
from tunneldb.simulate.tunnel.section import nearest
from tunneldb.simulate.tunnel.tunnel import newton_step

# Beyond this incidence the echo is lost, as scanners lose it.
MINIMUM_COSINE = 0.087
# Share of the rays past an edge of a free-standing thing that give a mixed pixel.
MIXED = 0.1
# Least range of the scanner, m.
NEAREST = 1.0


@njit(cache=True, nogil=True)
def trace(
    sc: Scene,
    parts: Parts | None,
    ground: Ground | None,
    coat: Reflectance | None,
    skin: LiningRelief | None,
    origin: Float,
    direction: Float,
    hint: Float,
    noise: Float,
    chance: Float,
    outliers: float,
    stray: float,
    relief: float,
    furthest: float,
    out: Float,
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
        wall, s, arc, cosine, offset0, s0 = meet_lining(sc, o, d, hint[i], 2.0 * furthest)
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
            hit, c, is_floor = meet_uneven(sc, ground, o, d, s, wall, klass == FLOOR)
            if not math.isnan(hit):
                wall, cosine, klass = hit, c, FLOOR if is_floor else LINING
        r = wall
        if not is_open and sc.items.shape[0] > 0:
            # The offset is concave along the ray, so it cannot fall below the appendages' reach before here.
            begin = wall * max(0.0, 1.0 - sc.ends[3] / offset0)
            hit, which, c = meet_item(sc, o, d, s0 + (s - s0) * begin / wall, begin, wall)
            if which >= 0:
                r, cosine = hit, c
                klass = int(sc.items[which, 9])
                drop = sc.items[which, 10]
        if r == wall and klass == LINING and not is_open:
            hit, c, is_back = meet_niche(sc, o, d, s, wall)
            if not math.isnan(hit):
                r, cosine, klass = hit, c, NICHE
                if is_back and sc.ends[5] > 0.0:
                    leak, drop = wetness(sc, *unrolled(sc, o, d, r, s))
            else:
                if skin is not None:
                    r, s, arc, cosine, is_floor = meet_skin(skin, sc.plan, sc.profile, sc.parts, o, d, wall, s, cosine)
                    wall = r
                    klass = FLOOR if is_floor else LINING
                if klass == LINING:
                    leak, drop = wetness(sc, s, arc)
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
