"""Where the lining departs from its nominal section: lips between rings, a change of radius, bolt pockets, shotcrete.

The surface lies ``height`` m off the nominal one along its normal, into the tunnel. A ray is marched from where the
highest place could be met, so that what it meets, and what that hides, is right for deep pockets and slanting rays too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tunneldb.arrays import Float
from tunneldb.simulate.lining.rings import Rings, pocket_drop, ring_of
from tunneldb.simulate.noise_field import clouds
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.section import nearest
from tunneldb.simulate.tunnel.tunnel import Tunnel, gradient, newton_step

# Relief of shotcrete: wavelengths, m, and standard deviations, m; its fields lie within 2.4 standard deviations.
ROUGH_SIZE, ROUGH = (0.25, 0.08), (0.006, 0.002)
ROUGH_MOST = 2.4
# Least and greatest step of the march, m; share of the gap to the surface that a step takes.
SHORTEST, LONGEST, SHARE = 0.002, 0.02, 0.9
HALVINGS = 17
CLOSE = 1e-6  # m
# A surface passed by more than this is met from the side, m.
SIDE = 5e-4


class LiningRelief(NamedTuple):
    """Relief of the lining for the kernels.

    Attributes
    ----------
    rings : Rings
    step : (n,)
        Height of each ring, m.
    wider : (2,)
        Chainage from which the section is wider, and by how much, m.
    rough : float
        1: shotcrete; 0: smooth.
    salt : int
        Of the fields.
    low, high : float
        Bounds of the height, m.
    floor_arc, floor : float
        Arc of the section's corner and height of its floor, m: below, nothing is moved.
    """

    rings: Rings
    step: Float
    wider: Float
    rough: float
    salt: int
    low: float
    high: float
    floor_arc: float
    floor: float


def wider_from(tunnel: Tunnel) -> float:
    """Chainage from which on the section is wider, where it is, m."""
    return 0.5 * (tunnel.line.start + tunnel.line.end)


def skin(parameters: Parameters, tunnel: Tunnel, rings: Rings, seed: np.random.SeedSequence) -> LiningRelief | None:
    """Relief as asked; None: the surface is the nominal one."""
    p = parameters
    is_rough = p.lining == "shotcrete"
    if not (is_rough or rings.pocket_depth or p.ring_step or p.radius_step):
        return None
    rng = np.random.default_rng(seed)
    step = np.clip(rng.standard_normal(rings.level.size), -3.0, 3.0) * p.ring_step
    rough = ROUGH_MOST * sum(ROUGH) if is_rough else 0.0
    return LiningRelief(
        rings,
        step,
        np.array([wider_from(tunnel), p.radius_step]),
        1.0 if is_rough else 0.0,
        int(seed.generate_state(1)[0]),
        min(0.0, float(step.min(initial=0.0))) - rings.pocket_depth - p.radius_step - rough,
        max(0.0, float(step.max(initial=0.0))) + rough,
        tunnel.section.floor_arc,
        tunnel.section.floor,
    )


@njit(cache=True, nogil=True)
def _rough(skin: LiningRelief, s: float, arc: float) -> float:
    """Height of shotcrete, m."""
    total = 0.0
    for i in range(2):
        total += ROUGH[i] * clouds(s / ROUGH_SIZE[i], arc / ROUGH_SIZE[i], skin.salt + i)
    return total


@njit(cache=True, nogil=True)
def height(skin: LiningRelief, s: float, arc: float) -> float:
    """Height of the lining over the nominal section at a chainage and an arc, m, positive into the tunnel."""
    if abs(arc) > skin.floor_arc:
        return 0.0
    total = -skin.wider[1] if s > skin.wider[0] else 0.0
    if skin.rings.length > 0.0:
        total += skin.step[ring_of(skin.rings, s)]
        if pocket_drop(skin.rings, s, arc) > 0.0:
            total -= skin.rings.pocket_depth
    if skin.rough > 0.0:
        total += _rough(skin, s, arc)
    return total


@njit(cache=True, nogil=True)
def meet_skin(
    skin: LiningRelief, plan: Float, profile: Float, parts: Float, o: Float, d: Float, r: float, s: float, cosine: float
) -> tuple[float, float, float, float, bool]:
    """Range at which a ray that meets the nominal section at range r, chainage s, meets the lining.

    Also chainage, arc and cosine there, and whether it is the floor that goes on where the lining stands back.
    """
    slant = max(cosine, 0.1)
    back = skin.high / slant + SHORTEST
    before = t = r - back
    end = r + 2.0 * (SHORTEST - skin.low) / slant + 0.2
    s1, a1, gap, w, found = _gap(skin, plan, profile, parts, o, d, t, s)
    for _ in range(6):
        if gap > 0.0:
            break
        # The section bends away: begin farther back.
        back *= 2.0
        before = t = r - back
        s1, a1, gap, w, found = _gap(skin, plan, profile, parts, o, d, t, s)
    above = gap
    while gap > 0.0 and w > skin.floor and t < end:
        before, above = t, gap
        t += min(max(SHARE * gap / slant, SHORTEST), LONGEST)
        s1, a1, gap, w, found = _gap(skin, plan, profile, parts, o, d, t, s1)
    for i in range(HALVINGS):
        if t - before < CLOSE or (-CLOSE < gap <= 0.0):
            break
        # A smooth surface is found where the chord crosses it, a step in it by halving.
        share = above / (above - gap) if i < 3 and gap < 0.0 else 0.5
        middle = before + share * (t - before) + (0.5 * CLOSE if i < 3 else 0.0)
        s2, a2, gap2, w2, found2 = _gap(skin, plan, profile, parts, o, d, middle, s1)
        if gap2 > 0.0 and w2 > skin.floor:
            before, above = middle, gap2
        else:
            t, s1, a1, gap, w, found = middle, s2, a2, gap2, w2, found2
    _, u, _, c, n, k, g, q, det = found
    tx, ty, tz = c / q, n / q, g / q
    if gap > 0.0 and w <= skin.floor:
        gx, gy, gz = gradient(0.0, 1.0, u, w, c, n, k, g, q, det)
        norm = math.sqrt(gx * gx + gy * gy + gz * gz)
        return t, s1, a1, -(gx * d[0] + gy * d[1] + gz * d[2]) / norm, True
    _, _, gu, gw = nearest(parts, u, w)
    nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, det)
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    # Into the direction of growing arc.
    ax, ay, az = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    if gap < -SIDE:
        s0, a0, _, _, _ = _gap(skin, plan, profile, parts, o, d, before, s1)
        is_end = abs(height(skin, s1, a0) - height(skin, s0, a0)) > SIDE
        fx, fy, fz = (tx, ty, tz) if is_end else (ax, ay, az)
        return t, s1, a1, abs(fx * d[0] + fy * d[1] + fz * d[2]), False
    if skin.rough > 0.0:
        h = 0.005
        hs = (_rough(skin, s1 + h, a1) - _rough(skin, s1 - h, a1)) / (2.0 * h)
        ha = (_rough(skin, s1, a1 + h) - _rough(skin, s1, a1 - h)) / (2.0 * h)
        nx, ny, nz = nx - hs * tx - ha * ax, ny - hs * ty - ha * ay, nz - hs * tz - ha * az
        norm = math.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / norm, ny / norm, nz / norm
    return t, s1, a1, -(nx * d[0] + ny * d[1] + nz * d[2]), False


@njit(cache=True, nogil=True)
def _gap(
    skin: LiningRelief, plan: Float, profile: Float, parts: Float, o: Float, d: Float, t: float, s: float
) -> tuple[float, float, float, float, tuple[float, float, float, float, float, float, float, float, float]]:
    """At range t: chainage, arc, gap to the lining, height over the axis; what :func:`newton_step` found."""
    x, y, z = o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]
    found = newton_step(plan, profile, x, y, z, s)
    s += found[0]
    if abs(found[0]) > 1e-3:
        found = newton_step(plan, profile, x, y, z, s)
        s += found[0]
    arc, offset, _, _ = nearest(parts, found[1], found[2])
    return s, arc, offset - height(skin, s, arc), found[2], found
