"""Deviation of the lining from its nominal section: lips and chamfers of rings, changes of radius, bolt pockets, roughness.

The surface is ``height`` m off the nominal one along its normal, into the tunnel. A ray is marched from the first possible hit
on, so that hits and occlusions are also right for deep pockets and slanting rays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.lining.masonry import Masonry, unit_height
from tunneldb.simulate.lining.ring_shape import RingShape, departure
from tunneldb.simulate.lining.rings import CHAMFER_DEPTH, Rings, chamfer_depth, pocket_drop, ring_of
from tunneldb.simulate.noise_field import mix, value_noise
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.section import nearest
from tunneldb.simulate.tunnel.tunnel import Tunnel, foot, gradient

# Relief by lining: wavelengths and standard deviations of smooth fields, m, limited to 2.4 standard deviations.
ROUGH = {
    "shotcrete": ((0.25, 0.006), (0.08, 0.002)),
    "rough_shotcrete": ((0.6, 0.025), (0.2, 0.010), (0.06, 0.004)),
    "brick": ((0.05, 0.0006),),
    "stone": ((0.15, 0.004), (0.05, 0.0015)),
    "rock": ((0.05, 0.003),),
}
MAX_ROUGH_SIGMA = 2.4
# Facets of unlined rock: sizes and greatest heights, m.
FACETS = {"rock": ((0.8, 0.15), (0.25, 0.04))}
# Limits of the factor of a tunnel's relief to these.
ROUGHNESS_FACTOR = {"rough_shotcrete": (0.5, 1.5), "brick": (0.3, 2.0), "stone": (0.3, 2.0), "rock": (0.4, 1.6)}
_PART = 1.0 / 65535.0
_MASK = np.uint64(0xFFFF)
# Least and greatest step of the march, m; share of the gap to the surface that a step takes.
MIN_STEP, MAX_STEP, STEP_SHARE = 0.002, 0.02, 0.9
HALVINGS = 17
TOLERANCE = 1e-6  # m
# Depth behind a surface above which it is hit from the side, m.
SIDE_DEPTH = 5e-4


class LiningRelief(NamedTuple):
    """Relief of the lining for the kernels.

    Attributes
    ----------
    rings : Rings
    step : (n,)
        Height of each ring, m.
    shape : RingShape
        Other deviations of rings from the section.
    wider : (2,)
        Chainage from which the section is wider, and by how much, m.
    rough : (k, 2)
        Wavelengths and standard deviations of smooth fields, m.
    facets : (k, 2)
        Sizes and greatest heights of facets, m.
    masonry : Masonry
    salt : int
        Salt of the random fields.
    low, high : float
        Bounds of the height, m.
    floor_arc, floor : float
        Arc of the section's corner and height of its floor, m: the floor has no relief.
    """

    rings: Rings
    step: Float
    shape: RingShape
    wider: Float
    rough: Float
    facets: Float
    masonry: Masonry
    salt: int
    low: float
    high: float
    floor_arc: float
    floor: float


def wider_from(tunnel: Tunnel) -> float:
    """Return the chainage from which the section is wider, if it is, m."""
    return 0.5 * (tunnel.line.start + tunnel.line.end)


def lining_relief(
    parameters: Parameters,
    tunnel: Tunnel,
    rings: Rings,
    shape: RingShape,
    masonry: Masonry,
    seed: np.random.SeedSequence,
) -> LiningRelief | None:
    """Return the requested relief; None: the surface is the nominal one."""
    p = parameters
    if not (p.lining in ROUGH or rings.pocket_depth or p.chamfers or p.ring_step or p.radius_step) and shape.plain:
        return None
    rng = np.random.default_rng(seed)
    step = np.clip(rng.standard_normal(rings.level.size), -3.0, 3.0) * p.ring_step
    scale = np.array([1.0, float(rng.uniform(*ROUGHNESS_FACTOR[p.lining])) if p.lining in ROUGHNESS_FACTOR else 1.0])
    rough = np.array(ROUGH.get(p.lining, ())).reshape(-1, 2) * scale
    facets = np.array(FACETS.get(p.lining, ())).reshape(-1, 2) * scale
    max_height = MAX_ROUGH_SIGMA * float(rough[:, 1].sum()) + float(facets[:, 1].sum()) + masonry.face
    reach = np.hypot(*shape.ellipse[:, :2].T) + np.hypot(*shape.ellipse[:, 2:].T)
    away = float((reach + np.abs(shape.stand).max(axis=1, initial=0.0)).max(initial=0.0))
    grooves = masonry.depth + (CHAMFER_DEPTH if p.chamfers else 0.0)
    return LiningRelief(
        rings,
        step,
        shape,
        np.array([wider_from(tunnel), p.radius_step]),
        rough,
        facets,
        masonry,
        int(seed.generate_state(1)[0]),
        min(0.0, float(step.min(initial=0.0))) - rings.pocket_depth - p.radius_step - max_height - grooves - away,
        max(0.0, float(step.max(initial=0.0))) + max_height + away,
        tunnel.section.floor_arc,
        tunnel.section.floor,
    )


@inner
def _node(i: int, j: int, salt: int) -> float:
    """Return the height of a node, -1 to 1."""
    return 2.0 * _PART * float((mix(i, j, salt) >> np.uint64(32)) & _MASK) - 1.0


@inner
def facet(x: float, y: float, salt: int) -> float:
    """Return a surface of plane triangles, -1 to 1: nodes on a unit grid, each cell divided along either diagonal."""
    i, j = math.floor(x), math.floor(y)
    tx, ty = x - i, y - j
    a, b, c, d = _node(i, j, salt), _node(i + 1, j, salt), _node(i, j + 1, salt), _node(i + 1, j + 1, salt)
    if mix(i, j, salt) & np.uint64(1):
        if tx + ty < 1.0:
            return a + (b - a) * tx + (c - a) * ty
        return d + (c - d) * (1.0 - tx) + (b - d) * (1.0 - ty)
    if tx > ty:
        return a + (b - a) * tx + (d - b) * ty
    return a + (d - c) * tx + (c - a) * ty


@inner
def _rough(relief: LiningRelief, s: float, arc: float) -> float:
    """Return the height of a rough surface without steps, m."""
    total = -chamfer_depth(relief.rings, s, arc)
    for i in range(relief.rough.shape[0]):
        size = relief.rough[i, 0]
        total += relief.rough[i, 1] * value_noise(s / size, arc / size, relief.salt + i)
    for i in range(relief.facets.shape[0]):
        size = relief.facets[i, 0]
        total += relief.facets[i, 1] * facet(s / size, arc / size, relief.salt + 10 + i)
    return total


@inner
def height(relief: LiningRelief, s: float, arc: float) -> float:
    """Return the height of the lining above the nominal section at a chainage and an arc, m, positive into the tunnel."""
    if abs(arc) > relief.floor_arc:
        return 0.0
    total = -relief.wider[1] if s > relief.wider[0] else 0.0
    if relief.rings.length > 0.0:
        i = ring_of(relief.rings, s)
        total += relief.step[i] + departure(relief.rings, relief.shape, i, arc)
        if pocket_drop(relief.rings, s, arc) > 0.0:
            total -= relief.rings.pocket_depth
    if relief.masonry.length > 0.0:
        total += unit_height(relief.masonry, s, arc)
    return total + _rough(relief, s, arc)


@inner
def _gap(
    relief: LiningRelief, plan: Float, profile: Float, parts: Float, x: float, y: float, z: float, s: float
) -> tuple[float, float, float, float, tuple[float, ...]]:
    """Return arc, distance to the lining along the normal, gradient (u, w) of the offset, and :func:`foot` of a position."""
    found = foot(plan, profile, x, y, z, s, 1e-3, np.int64(2))
    arc, offset, gu, gw = nearest(parts, found[2], found[3])
    return arc, offset - height(relief, found[0], arc), gu, gw, found


@kernel
def intersect_relief(
    relief: LiningRelief,
    plan: Float,
    profile: Float,
    parts: Float,
    origin: Float,
    direction: Float,
    rays: Int64,
    found: Float,
    is_floor: Bool,
) -> None:
    """Intersect some ``rays`` (m,) that hit the nominal section with the lining.

    Replaces range, chainage, arc and cosine in ``found`` (6, n), rows as of :func:`intersect_lining`; ``is_floor`` (m,) is set
    for rays that hit the floor where it continues below a receding lining.
    """
    for m in range(rays.shape[0]):
        i = rays[m]
        x, y, z = origin[i, 0], origin[i, 1], origin[i, 2]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        r, s = found[0, i], found[1, i]
        slant = max(found[3, i], 0.1)
        back = relief.high / slant + MIN_STEP
        end = r + 2.0 * (MIN_STEP - relief.low) / slant + 0.2
        t = r
        for _ in range(7):
            t = r - back
            arc, gap, gu, gw, at = _gap(relief, plan, profile, parts, x + t * dx, y + t * dy, z + t * dz, s)
            if gap > 0.0:
                break
            back *= 2.0  # the section curves away: begin farther back
        before, above = t, gap
        while gap > 0.0 and at[3] > relief.floor and t < end:
            before, above = t, gap
            t += min(max(STEP_SHARE * gap / slant, MIN_STEP), MAX_STEP)
            arc, gap, gu, gw, at = _gap(relief, plan, profile, parts, x + t * dx, y + t * dy, z + t * dz, at[0])
        for j in range(HALVINGS):
            if t - before < TOLERANCE or (-TOLERANCE < gap <= 0.0):
                break
            # A smooth surface is found by the secant method, a step by bisection.
            share = above / (above - gap) if j < 3 and gap < 0.0 else 0.5
            middle = before + share * (t - before) + (0.5 * TOLERANCE if j < 3 else 0.0)
            at_middle = _gap(relief, plan, profile, parts, x + middle * dx, y + middle * dy, z + middle * dz, at[0])
            if at_middle[1] > 0.0 and at_middle[4][3] > relief.floor:
                before, above = middle, at_middle[1]
            else:
                t = middle
                arc, gap, gu, gw, at = at_middle
        s, _, u, w, c, n, k, g, q, det = at
        found[0, i] = t
        found[1, i] = s
        found[2, i] = arc
        is_floor[m] = gap > 0.0 and w <= relief.floor
        if is_floor[m]:
            gu, gw = 0.0, 1.0
        nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, det)
        norm = math.sqrt(nx * nx + ny * ny + nz * nz)
        if is_floor[m]:
            found[3, i] = -(nx * dx + ny * dy + nz * dz) / norm
            continue
        nx, ny, nz = nx / norm, ny / norm, nz / norm
        tx, ty, tz = c / q, n / q, g / q
        # In the direction of increasing arc.
        ax, ay, az = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
        if gap < -SIDE_DEPTH:
            at_before = _gap(relief, plan, profile, parts, x + before * dx, y + before * dy, z + before * dz, s)
            is_end = abs(height(relief, s, at_before[0]) - height(relief, at_before[4][0], at_before[0])) > SIDE_DEPTH
            if is_end:
                ax, ay, az = tx, ty, tz
            found[3, i] = abs(ax * dx + ay * dy + az * dz)
            continue
        if relief.rough.shape[0] > 0 or relief.rings.askew.shape[0] > 0:
            h = 0.005
            hs = (_rough(relief, s + h, arc) - _rough(relief, s - h, arc)) / (2.0 * h)
            ha = (_rough(relief, s, arc + h) - _rough(relief, s, arc - h)) / (2.0 * h)
            nx, ny, nz = nx - hs * tx - ha * ax, ny - hs * ty - ha * ay, nz - hs * tz - ha * az
            norm = math.sqrt(nx * nx + ny * ny + nz * nz)
            nx, ny, nz = nx / norm, ny / norm, nz / norm
        found[3, i] = -(nx * dx + ny * dy + nz * dz)
