"""Construction of a lining along the tunnel: blocks cast in place, or rings of segments with bolt pockets."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

SEGMENTS = 6  # of a ring
# Standard deviation of the level of a block, a ring and a segment, dB.
BLOCK_LEVEL, RING_LEVEL, SEGMENT_LEVEL = 0.4, 0.8, 0.3
# Limits of width (m) and darkening (dB) of joints.
CAST_WIDTH, CAST_DROP = (0.010, 0.020), (2.0, 4.0)
SEAM_WIDTH, SEAM_DROP = (0.005, 0.012), (2.0, 5.0)
# Bolt pockets: size along the tunnel and the arc, distance of the middle from the ring joint, m; shares of a
# segment's length at which they lie; limits of depth (m) and of darkening (dB).
POCKET = (0.15, 0.20)
POCKET_FROM_JOINT = 0.25
POCKETS = (0.25, 0.75)
POCKET_DEPTH, POCKET_DROP = (0.05, 0.08), (1.0, 3.0)
# Chamfers of ring joints: width and depth, m; limits of their slant, degrees.
CHAMFER, CHAMFER_DEPTH, CHAMFER_SLANT = 0.05, 0.015, (0.2, 1.5)


class Rings(NamedTuple):
    """Rings (or blocks) of a lining, ring i from ``first + i * length`` on; n of them, with m segments each.

    Segment k of ring i begins at arc ``shift[i] + k * period``; the full circle of the arc is ``m * period``; blocks
    cast in one piece have m = 0. A lining without rings has ``length`` 0.

    Attributes
    ----------
    first, length : float
        Chainage of the first joint and distance between joints, m.
    level : (n,)
        Level added to the ring, dB.
    joint_width, joint_drop : (n + 1,)
        Width of ring joints, m, and their darkening, dB.
    period : float
        Length of a segment along the arc, m.
    shift : (n,)
        Arc of a joint between segments, m.
    segment_level, seam_width, seam_drop : (n, m)
        Level of a segment, dB; width, m, and darkening, dB, of the joint at its start.
    pocket_drop : (n, m, 2)
        Darkening of the bolt pockets of a segment, dB.
    pocket_depth : float
        Depth of bolt pockets, m; 0: none.
    askew : (n + 1,)
        Chamfers of ring joints: chainage gained with arc, m/m; empty if joints are sharp.
    """

    first: float
    length: float
    level: Float
    joint_width: Float
    joint_drop: Float
    period: float
    shift: Float
    segment_level: Float
    seam_width: Float
    seam_drop: Float
    pocket_drop: Float
    pocket_depth: float
    askew: Float


def build(parameters: Parameters, tunnel: Tunnel, seed: np.random.SeedSequence, chamfered: np.random.SeedSequence) -> Rings:
    """Return the requested rings of a lining; chamfers have their own random numbers."""
    p, line = parameters, tunnel.line
    shape = np.random.default_rng(seed)
    length = p.ring_length()
    period = 2.0 * tunnel.section.half_perimeter / SEGMENTS
    if length == 0.0:
        none, wide = np.empty(0), np.empty((0, 0))
        return Rings(0.0, 0.0, none, none, none, period, none, wide, wide, wide, np.empty((0, 0, 2)), 0.0, none)
    first = line.start - float(shape.uniform(0.0, length))
    n = math.ceil((line.end - first) / length) + 1
    segmented = p.lining == "segments"
    m = SEGMENTS if segmented else 0
    width, drop = (SEAM_WIDTH, SEAM_DROP) if segmented else (CAST_WIDTH, CAST_DROP)
    # Joints are staggered: every other ring is turned by about half a segment.
    turned = 0.5 * (np.arange(n) % 2) + shape.uniform(-0.1, 0.1, n)
    return Rings(
        first,
        length,
        shape.normal(0.0, RING_LEVEL if segmented else BLOCK_LEVEL, n),
        shape.uniform(*width, n + 1),
        shape.uniform(*drop, n + 1),
        period,
        period * turned,
        shape.normal(0.0, SEGMENT_LEVEL, (n, m)),
        shape.uniform(*width, (n, m)),
        shape.uniform(*drop, (n, m)),
        shape.uniform(*POCKET_DROP, (n, m, 2)),
        float(shape.uniform(*POCKET_DEPTH)) if segmented else 0.0,
        _askew(n + 1 if p.chamfers else 0, np.random.default_rng(chamfered)),
    )


def _askew(count: int, rng: np.random.Generator) -> Float:
    """Return the gain of chamfers in chainage with arc, m/m, either way."""
    return np.tan(np.radians(rng.uniform(*CHAMFER_SLANT, count))) * rng.choice([-1.0, 1.0], count)


@inner
def chamfer_depth(rings: Rings, s: float, arc: float) -> float:
    """Return the depth of the chamfer of a ring joint at a position, m: a groove with plane sides; 0: none."""
    if rings.askew.shape[0] == 0:
        return 0.0
    nearest = math.floor((s - rings.first) / rings.length + 0.5)
    deepest = 0.0
    for j in range(max(nearest - 1, 0), min(nearest + 2, rings.askew.shape[0])):
        off = abs(s - rings.first - j * rings.length - rings.askew[j] * arc) / math.sqrt(1.0 + rings.askew[j] ** 2)
        deepest = max(deepest, CHAMFER_DEPTH * (1.0 - 2.0 * off / CHAMFER))
    return deepest


@inner
def ring_of(rings: Rings, s: float) -> int:
    """Return the index of the ring at a chainage, the first or last one beyond the ends."""
    return min(max(math.floor((s - rings.first) / rings.length), 0), rings.level.shape[0] - 1)


@inner
def pocket_drop(rings: Rings, s: float, arc: float) -> float:
    """Return the darkening of the bolt pocket at a position, dB; 0: none."""
    if rings.pocket_depth == 0.0:
        return 0.0
    i = ring_of(rings, s)
    if abs(s - rings.first - i * rings.length - POCKET_FROM_JOINT) > 0.5 * POCKET[0]:
        return 0.0
    x = (arc - rings.shift[i]) / rings.period
    k = math.floor(x)
    for j in range(2):
        if abs(x - k - POCKETS[j]) * rings.period <= 0.5 * POCKET[1]:
            return rings.pocket_drop[i, k % rings.pocket_drop.shape[1], j]
    return 0.0


@kernel
def _ring_level(rings: Rings, s: Float, arc: Float, out: Float) -> None:
    m = rings.segment_level.shape[1]
    for p in range(s.shape[0]):
        i = ring_of(rings, s[p])
        total = rings.level[i]
        x = (s[p] - rings.first) / rings.length
        j = min(max(math.floor(x + 0.5), 0), rings.level.shape[0])
        drop = rings.joint_drop[j] if abs(x - j) * rings.length <= 0.5 * rings.joint_width[j] else 0.0
        if m > 0:
            y = (arc[p] - rings.shift[i]) / rings.period
            total += rings.segment_level[i, math.floor(y) % m]
            k = math.floor(y + 0.5)
            if abs(y - k) * rings.period <= 0.5 * rings.seam_width[i, k % m]:
                drop = max(drop, rings.seam_drop[i, k % m])
            drop = max(drop, pocket_drop(rings, s[p], arc[p]))
        out[p] = total - drop


def ring_level(rings: Rings, s: Float, arc: Float) -> Float:
    """Return the level of rings, segments, joints and pockets at positions (n,) of the lining, dB."""
    out = np.zeros(s.size)
    if rings.length > 0.0:
        _ring_level(rings, s, arc, out)
    return out
