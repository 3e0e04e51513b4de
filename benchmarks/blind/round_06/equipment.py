"""What hangs and stands before the lining, and where rays meet it.

Rays are given in the frame of the place on the lining at which they aim: ``a`` along the tunnel from there, ``n`` to the
right and ``z`` up from the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .fields import Array

NOTHING = -1


@dataclass(frozen=True)
class Tube:
    """Cable, pipe or fan along the tunnel; ``sag`` between hangers that are ``span`` apart; fans have ends.

    ``db`` is its reflectance, ``gloss`` its mirror reflection.
    """

    n: float
    z: float
    radius: float
    db: float
    s0: float = -np.inf
    s1: float = np.inf
    sag: float = 0.0
    span: float = 1.5
    gloss: float = 0.0


@dataclass(frozen=True)
class Box:
    """Lamp, cabinet, tray, sign or kerb; ``tilt`` turns it about the tunnel's direction (radians, from n towards z)."""

    n: float
    z: float
    half_n: float
    half_z: float
    db: float
    s0: float = -np.inf
    s1: float = np.inf
    tilt: float = 0.0
    gloss: float = 0.0


Thing = Tube | Box


@dataclass
class Rays:
    """Rays from (``a``, ``n0``, ``z0``) to (0, ``n1``, ``z1``); ``s`` is the chainage of the target."""

    s: Array
    a: Array
    n0: Array
    z0: Array
    n1: Array
    z1: Array


@dataclass
class Hits:
    """First things met: share ``t`` of the way, index, ``normal`` (a, n, z), share of the beam; loss of what passes."""

    t: Array
    thing: Array
    normal: Array
    share: Array
    passed: Array


def trace(things: Sequence[Thing], rays: Rays, beam: Array) -> Hits:
    """Where the rays end; ``beam`` is the radius of the footprint (m)."""
    count = len(rays.s)
    hits = Hits(
        np.ones(count), np.full(count, NOTHING, np.int16), np.zeros((count, 3), np.float32), np.ones(count), np.ones(count)
    )
    dn, dz = rays.n1 - rays.n0, rays.z1 - rays.z0
    flat = np.hypot(dn, dz)
    low, high = rays.s + np.minimum(rays.a, 0), rays.s + np.maximum(rays.a, 0)
    for index, thing in enumerate(things):
        reach = thing.radius + thing.sag if isinstance(thing, Tube) else float(np.hypot(thing.half_n, thing.half_z))
        beside = np.abs(dn * (thing.z - rays.z0) - dz * (thing.n - rays.n0)) < (reach + beam) * flat
        ahead = dn * (thing.n - rays.n0) + dz * (thing.z - rays.z0) > -reach * flat
        near = np.flatnonzero(beside & ahead & (low <= thing.s1) & (high >= thing.s0))
        if not len(near):
            continue
        if isinstance(thing, Tube):
            _meet_tube(index, thing, rays, near, beam[near], hits)
        else:
            _meet_box(index, thing, rays, near, beam[near], hits)
    return hits


def _record(index: int, near: Array, t: Array, valid: Array, normal: Array, share: Array, hits: Hits) -> None:
    first = valid & (t < hits.t[near])
    at = near[first]
    hits.t[at], hits.thing[at], hits.share[at] = t[first], index, share[first]
    hits.normal[at] = normal[first]


def _meet_tube(index: int, tube: Tube, rays: Rays, near: Array, beam: Array, hits: Hits) -> None:
    n0, z0, a, s = rays.n0[near], rays.z0[near], rays.a[near], rays.s[near]
    dn, dz = rays.n1[near] - n0, rays.z1[near] - z0
    length = np.hypot(dn, dz)
    zc = np.full(len(near), tube.z)
    if tube.sag:
        t = ((tube.n - n0) * dn + (tube.z - z0) * dz) / length**2
        x = np.mod((s + a * (1 - t)) / tube.span, 1)
        zc = tube.z - tube.sag * 4 * x * (1 - x)
    off = (dn * (zc - z0) - dz * (tube.n - n0)) / length
    closest = ((tube.n - n0) * dn + (zc - z0) * dz) / length**2
    share = np.clip(0.5 + (tube.radius - np.abs(off)) / (2 * beam), 0, 1)
    t = closest - np.sqrt(np.maximum(tube.radius**2 - off**2, 0)) / length
    at = s + a * (1 - t)
    along = (at > tube.s0) & (at < tube.s1)
    normal = np.stack([np.zeros_like(t), (n0 + t * dn - tube.n) / tube.radius, (z0 + t * dz - zc) / tube.radius], -1)
    valid = along & (t > 0.02) & (t < 1) & (share > 0)
    hit = valid & (np.abs(off) < tube.radius)
    _record(index, near, t, hit, normal, share, hits)
    grazed = valid & ~hit
    hits.passed[near[grazed]] *= 1 - share[grazed]
    if np.isfinite(tube.s0):
        for end, sign in ((tube.s0, -1.0), (tube.s1, 1.0)):
            with np.errstate(divide="ignore", invalid="ignore"):
                t = 1 - (end - s) / a
            radial = np.hypot(n0 + t * dn - tube.n, z0 + t * dz - zc)
            disc = np.isfinite(t) & (t > 0.02) & (t < 1) & (radial < tube.radius) & (a * sign > 0)
            _record(index, near, t, disc, np.tile([sign, 0.0, 0.0], (len(near), 1)), np.ones(len(near)), hits)


def _meet_box(index: int, box: Box, rays: Rays, near: Array, beam: Array, hits: Hits) -> None:
    c, q = np.cos(box.tilt), np.sin(box.tilt)
    n0, z0, a, s = rays.n0[near] - box.n, rays.z0[near] - box.z, rays.a[near], rays.s[near]
    dn, dz = rays.n1[near] - rays.n0[near], rays.z1[near] - rays.z0[near]
    starts = [n0 * c + z0 * q, z0 * c - n0 * q]
    steps = [dn * c + dz * q, dz * c - dn * q]
    halves = [box.half_n, box.half_z]
    if np.isfinite(box.s0):
        starts.append(s + a - (box.s0 + box.s1) / 2)
        steps.append(-a)
        halves.append((box.s1 - box.s0) / 2)
    enter, leave = np.full(len(near), -np.inf), np.full(len(near), np.inf)
    face = np.zeros(len(near), np.int8)
    for k, (start, step, half) in enumerate(zip(starts, steps, halves, strict=True)):
        safe = np.where(np.abs(step) < 1e-9, 1e-9, step)
        one, two = (-half - start) / safe, (half - start) / safe
        first = np.minimum(one, two)
        face = np.where(first > enter, k, face).astype(np.int8)
        enter, leave = np.maximum(enter, first), np.minimum(leave, np.maximum(one, two))
    valid = (enter < leave) & (enter > 0.02) & (enter < 1)
    margin = np.full(len(near), np.inf)
    normals = np.zeros((len(near), 3))
    for k, (start, step, half) in enumerate(zip(starts, steps, halves, strict=True)):
        margin = np.where(face == k, margin, np.minimum(margin, half - np.abs(start + enter * step)))
        sign = np.where(face == k, -np.sign(step), 0)
        normals += sign[:, None] * np.array([(0, c, q), (0, -q, c), (1, 0, 0)][k])
    share = np.clip(0.5 + margin / (2 * beam), 0, 1)
    _record(index, near, enter, valid, normals, share, hits)
