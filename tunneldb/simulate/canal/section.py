"""Surfaces of a canal as one implicit function: clearance from walls, vault, towpath, bed, piers, objects and boat.

Clearance is the distance to the nearest surface or less, m; 0 on a surface, negative behind it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int32
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.canal.centreline import stationed
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.noise_field import value_noise

BED, WALL, VAULT, TOWPATH, LADDER, PIER, OBJECT, BOAT, WATER = range(9)
KINDS = ("bed", "wall", "vault", "towpath", "ladder", "pier or niche", "object", "boat", "water surface")

_MAX_NOISE_SIGMA = 2.34  # of value noise, in standard deviations
_COURSE_HEIGHT, _STONE_LENGTH = 0.30, 0.60  # height of a course, length of a stone, m
_JOINT = 0.012  # half width of a joint, m
# Solids: kind of solid, kind of surface, middle (s, o, z), half sizes, cosine and sine of the turn about the vertical.
BOX, RECESS, BALL, HULL = 0.0, 1.0, 2.0, 3.0
SOLID_COLUMNS = 10


class Section(NamedTuple):
    """Cross-section and relief for compiled functions; lengths in m, heights above the water.

    ``radius`` is that of the axis; ``half`` the canal's half width at the water; ``slope`` and ``slope_below`` tangents of the
    batter; ``vault`` the offset and height of the vault's centre and its radius; ``side`` that of the towpath (0: none).
    """

    radius: float
    half_length: float
    half: float
    slope: float
    slope_below: float
    vault_offset: float
    vault_height: float
    vault_radius: float
    side: float
    towpath_width: float
    towpath_height: float
    depth: float
    bed_rise: float
    bed_relief: float
    bed_length: float
    roughness: float
    roughness_length: float
    joint_depth: float
    salt: int


def section(parameters: CanalParameters) -> Section:
    """Return the cross-section for some parameters."""
    p = parameters
    slope = math.tan(math.radians(p.batter))
    side = p.towpath_side()
    ledge = p.towpath_width if side else 0.0
    span = 0.5 * (p.width + ledge) + p.springing * slope
    radius = max(p.vault_radius, 1.02 * span)
    return Section(
        float(p.radius),
        0.5 * p.length,
        0.5 * p.width,
        slope,
        math.tan(math.radians(p.batter_below)),
        0.5 * side * ledge,
        p.springing - math.sqrt(radius * radius - span * span),
        radius,
        float(side),
        ledge,
        p.towpath_height,
        p.depth,
        p.bed_rise,
        p.bed_relief,
        p.bed_length,
        p.roughness,
        p.roughness_length,
        p.joint_depth,
        int(p.seed) * 64 + 7,
    )


@inner
def bed_height(c: Section, s: float, o: float) -> float:  # pragma: no cover - compiled
    """Return the height of the silt at a station and offset."""
    across = min(abs(o) / c.half, 1.2)
    z = -c.depth + c.bed_rise * across * across * across * across
    if c.bed_relief > 0.0:
        u, v = s / c.bed_length, o / c.bed_length
        z += c.bed_relief * (
            0.92 * value_noise(u, v, c.salt + 1)
            + 0.36 * value_noise(2.3 * u, 2.3 * v, c.salt + 2)
            + 0.1 * value_noise(9.0 * u, 9.0 * v, c.salt + 3)
        )
    return z


@inner
def _stones(c: Section, s: float, v: float, face: int) -> float:  # pragma: no cover - compiled
    """Return the relief of masonry towards the canal, at a station and a position along the section."""
    height = 0.0
    if c.roughness > 0.0:
        a, b = s / c.roughness_length, v / c.roughness_length
        height += c.roughness * (
            0.9 * value_noise(a, b, c.salt + 8 + face) + 0.43 * value_noise(4.0 * a, 4.0 * b, c.salt + 16 + face)
        )
    if c.joint_depth > 0.0:
        row = math.floor(v / _COURSE_HEIGHT)
        up = v - row * _COURSE_HEIGHT
        along = s / _STONE_LENGTH + 0.5 * (row % 2)
        along = (along - math.floor(along)) * _STONE_LENGTH
        away = min(min(up, _COURSE_HEIGHT - up), min(along, _STONE_LENGTH - along))
        height -= c.joint_depth * max(0.0, 1.0 - away / _JOINT)
    return height


@inner
def _solid(solids: Float, k: int, s: float, o: float, z: float) -> float:  # pragma: no cover - compiled
    """Return the distance to a solid from outside, or a bound of it; if negative, to a recess's bounds from inside."""
    ds, do, dz = s - solids[k, 2], o - solids[k, 3], z - solids[k, 4]
    if solids[k, 0] == BALL:
        return math.sqrt(ds * ds + do * do + dz * dz) - solids[k, 5]
    u = ds * solids[k, 8] + do * solids[k, 9]
    v = do * solids[k, 8] - ds * solids[k, 9]
    a, b = solids[k, 5], solids[k, 6]
    if solids[k, 0] == HULL:
        along = min(abs(u) / a, 1.0)
        narrow = b * (1.0 - along * along * along)
        return 0.55 * max(max(abs(u) - a, abs(v) - narrow + 0.3 * max(0.0, -dz)), abs(dz) - solids[k, 7])
    return max(max(abs(u) - a, abs(v) - b), abs(dz) - solids[k, 7])


@inner
def clearance(c: Section, solids: Float, x: float, y: float, z: float) -> tuple[float, int]:  # pragma: no cover - compiled
    """Return the clearance of a local position, and the kind of the nearest surface.

    Relief is computed only near its surface; elsewhere its greatest height is subtracted.
    """
    s, o = stationed(c.radius, x, y)
    slope = c.slope if z > 0.0 else c.slope_below
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    max_relief = 1.33 * _MAX_NOISE_SIGMA * c.roughness
    best, kind = 1e9, WALL
    for face in range(2):
        side = 1.0 if face == 0 else -1.0
        wall = (c.half + slope * z - side * o) * cosine
        d, surface = wall, WALL
        if side == c.side and z - c.towpath_height > wall:
            d, surface = z - c.towpath_height, TOWPATH
        if d < 2.0 * max_relief + 0.05:
            d -= _stones(c, s, z if surface == WALL else o, face if surface == WALL else 3)
        else:
            d -= max_relief
        for k in range(solids.shape[0]):
            if solids[k, 0] == RECESS and solids[k, 3] * side > 0.0:
                inside = -_solid(solids, k, s, o, z)
                if inside > d:
                    d, surface = inside, PIER
        if d < best:
            best, kind = d, surface
        if side == c.side:
            d = (c.half + c.towpath_width + slope * z - side * o) * cosine
            d -= _stones(c, s, z, 4) if d < 2.0 * max_relief + 0.05 else max_relief
            if d < best:
                best, kind = d, WALL
    if z > c.vault_height:
        across, up = o - c.vault_offset, z - c.vault_height
        d = c.vault_radius - math.hypot(across, up)
        d -= _stones(c, s, c.vault_radius * math.atan2(across, up), 5) if d < 2.0 * max_relief + 0.05 else max_relief
        if d < best:
            best, kind = d, VAULT
    top = 1.38 * _MAX_NOISE_SIGMA * c.bed_relief + 2.0 * c.bed_rise
    d = z + c.depth - top
    if d < 0.25 * top + 0.05:
        d = 0.85 * (z - bed_height(c, s, o))
    if d < best:
        best, kind = d, BED
    for k in range(solids.shape[0]):
        if solids[k, 0] != RECESS:
            d = _solid(solids, k, s, o, z)
            if d < best:
                best, kind = d, int(solids[k, 1])
    return best, kind


@kernel
def _clearances(c: Section, solids: Float, xyz: Float, out: Float, kind: Int32) -> None:  # pragma: no cover - compiled
    for i in range(xyz.shape[0]):
        out[i], kind[i] = clearance(c, solids, xyz[i, 0], xyz[i, 1], xyz[i, 2])


def clearances(c: Section, solids: Float, local: Float) -> tuple[Float, Int32]:
    """Return clearance (n,) m and kind of the nearest surface (n,) of local points (n, 3), without ladders."""
    out, kind = np.empty(len(local)), np.empty(len(local), dtype=np.int32)
    _clearances(c, solids, np.ascontiguousarray(local, dtype=float), out, kind)
    return out, kind


@kernel
def _beds(c: Section, s: Float, o: Float, out: Float) -> None:  # pragma: no cover - compiled
    for i in range(s.shape[0]):
        out[i] = bed_height(c, s[i], o[i])


def bed_heights(c: Section, s: Float, o: Float) -> Float:
    """Return the height (n,) of the silt above the water (negative) at stations and offsets (n,), without objects."""
    out = np.empty(len(s))
    _beds(c, np.ascontiguousarray(s, dtype=float), np.ascontiguousarray(o, dtype=float), out)
    return out
