"""Ray casting in a canal: sphere tracing by clearance (Hart, 1996), closed formulas for ladders.

A ray ends on the first surface, on the water, or nowhere: beyond its limit or outside the canal's ends.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int32
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.canal.centreline import stationed
from tunneldb.simulate.canal.section import LADDER, WATER, Section, clearance
from tunneldb.threads import in_blocks

_STEPS = 800
_STEP_SHARE = 0.85  # share of the clearance per step
_MIN_STEP = 0.001  # m least step; skipped surfaces are found by bisection
_TOLERANCE = 1e-4  # m
_HALVINGS = 14
_NORMAL_STEP = 0.01  # m between the points for a normal
_BLOCK = 20_000  # rays
NO_HIT = -1
# Cylinders: one end, unit axis, length, radius, ladder x 100 + rung (stiles: rung 0).
CYLINDER_COLUMNS = 9
# Frames: middle, three unit axes, half sizes along them, first cylinder and the one after the last.
FRAME_COLUMNS = 17


class Scene(NamedTuple):
    """All objects for rays: section, solids (n, 10), cylinders (n, 9) of ladders, and a frame (n, 17) around each ladder."""

    section: Section
    solids: Float
    cylinders: Float
    frames: Float


@inner
def _passes(f: Float, k: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> bool:  # pragma: no cover
    """Return True if a ray crosses the frame of a ladder (slabs; Kay and Kajiya, 1986)."""
    near, far = 0.0, 1e9
    wx, wy, wz = ox - f[k, 0], oy - f[k, 1], oz - f[k, 2]
    for a in range(3):
        j = 3 + 3 * a
        p = wx * f[k, j] + wy * f[k, j + 1] + wz * f[k, j + 2]
        d = dx * f[k, j] + dy * f[k, j + 1] + dz * f[k, j + 2]
        h = f[k, 12 + a]
        if abs(d) < 1e-12:
            if abs(p) > h:
                return False
            continue
        one, two = (-h - p) / d, (h - p) / d
        near, far = max(near, min(one, two)), min(far, max(one, two))
        if near > far:
            return False
    return True


@inner
def _cylinder(
    r: Float, k: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float
) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return range to a cylinder from outside (1e9: missed) and cosine of incidence."""
    wx, wy, wz = ox - r[k, 0], oy - r[k, 1], oz - r[k, 2]
    along = wx * r[k, 3] + wy * r[k, 4] + wz * r[k, 5]
    slope = dx * r[k, 3] + dy * r[k, 4] + dz * r[k, 5]
    px, py, pz = wx - along * r[k, 3], wy - along * r[k, 4], wz - along * r[k, 5]
    qx, qy, qz = dx - slope * r[k, 3], dy - slope * r[k, 4], dz - slope * r[k, 5]
    square = qx * qx + qy * qy + qz * qz
    if square < 1e-12:
        return 1e9, 0.0
    half = px * qx + py * qy + pz * qz
    root = half * half - square * (px * px + py * py + pz * pz - r[k, 7] * r[k, 7])
    if root < 0.0:
        return 1e9, 0.0
    root = math.sqrt(root)
    t = (-half - root) / square
    if t <= 0.0 or not 0.0 <= along + t * slope <= r[k, 6]:
        return 1e9, 0.0
    return t, root / r[k, 7]


@inner
def first_hit(
    scene: Scene, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, limit: float
) -> tuple[float, int, int, float]:  # pragma: no cover - compiled
    """Return range, kind, part of a ladder and cosine of incidence at the first hit of a local ray; kind -1: nowhere."""
    end, kind, part, cosine = limit, NO_HIT, 0, 0.0
    if oz * dz < 0.0 and -oz / dz < end:
        end, kind, cosine = -oz / dz, WATER, abs(dz)
    for k in range(scene.frames.shape[0]):
        if _passes(scene.frames, k, ox, oy, oz, dx, dy, dz):
            for j in range(int(scene.frames[k, 15]), int(scene.frames[k, 16])):
                at, slant = _cylinder(scene.cylinders, j, ox, oy, oz, dx, dy, dz)
                if at < end:
                    end, kind, part, cosine = at, LADDER, int(scene.cylinders[j, 8]), slant
    t, last = 0.0, 0.0
    for _ in range(_STEPS):
        x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
        free, surface = clearance(scene.section, scene.solids, x, y, z)
        if free < _TOLERANCE:
            if free < 0.0:
                low, high = last, t
                for _ in range(_HALVINGS):
                    t = 0.5 * (low + high)
                    free, which = clearance(scene.section, scene.solids, ox + t * dx, oy + t * dy, oz + t * dz)
                    if free < 0.0:
                        high, surface = t, which
                    else:
                        low = t
            if t >= end:
                return end, kind, part, cosine
            x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
            if abs(stationed(scene.section.radius, x, y)[0]) > scene.section.half_length:
                return limit, NO_HIT, 0, 0.0
            free = clearance(scene.section, scene.solids, x, y, z)[0]
            gx = clearance(scene.section, scene.solids, x + _NORMAL_STEP, y, z)[0] - free
            gy = clearance(scene.section, scene.solids, x, y + _NORMAL_STEP, z)[0] - free
            gz = clearance(scene.section, scene.solids, x, y, z + _NORMAL_STEP)[0] - free
            size = math.sqrt(gx * gx + gy * gy + gz * gz)
            slant = abs(gx * dx + gy * dy + gz * dz) / max(size, 1e-12)
            return t, surface, 0, slant
        last = t
        t += max(_STEP_SHARE * free, _MIN_STEP)
        if last >= end:
            return end, kind, part, cosine
    return limit, NO_HIT, 0, 0.0


@kernel
def _cast(
    scene: Scene, origin: Float, direction: Float, limit: Float, at: Float, kind: Int32, part: Int32, cosine: Float
) -> None:  # pragma: no cover - compiled
    for i in range(direction.shape[0]):
        at[i], kind[i], part[i], cosine[i] = first_hit(
            scene,
            origin[i, 0],
            origin[i, 1],
            origin[i, 2],
            direction[i, 0],
            direction[i, 1],
            direction[i, 2],
            limit[i],
        )


class Hits(NamedTuple):
    """Ends of rays, arrays of n: range m, kind (-1: nowhere), part of a ladder (100 x ladder + rung), cosine."""

    range: Float
    kind: Int32
    part: Int32
    cosine: Float


def cast(scene: Scene, origin: Float, direction: Float, limit: Float | float) -> Hits:
    """Cast local rays (unit directions (n, 3)) from their origins ((3,) or (n, 3)) up to a range."""
    count = len(direction)
    start = np.ascontiguousarray(np.broadcast_to(origin, (count, 3)), dtype=float)
    ends = np.ascontiguousarray(np.broadcast_to(limit, (count,)), dtype=float)
    way = np.ascontiguousarray(direction, dtype=float)
    hits = Hits(np.empty(count), np.empty(count, np.int32), np.empty(count, np.int32), np.empty(count))

    def block(a: int, b: int) -> None:
        _cast(scene, start[a:b], way[a:b], ends[a:b], *(column[a:b] for column in hits))

    in_blocks(block, count, _BLOCK)
    return hits
