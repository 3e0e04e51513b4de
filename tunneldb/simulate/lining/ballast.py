"""Unevenness: camber and ballast, a field of stones, above the flat floor of the section; relief of the lining.

Ballast is a height over plan coordinates, so that rays from all directions hit the same stones. A stone is a randomly
displaced dome of random size and height in each cell of a grid (Worley, 1996, with paraboloids).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.noise_field import mix
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.section import Section
from tunneldb.simulate.tunnel.tunnel import foot, gradient

CELL = 0.045  # m; one stone per cell
STONE = (0.015, 0.030)  # radii of stones, m: stones of 3 to 6 cm
GAP_HEIGHT = -1.0  # between stones, in heights of a dome
MAX_HEIGHT = 1.5


class Ground(NamedTuple):
    """Heights above the section's floor, for the kernels.

    ``scale`` and ``level`` convert the field of stones to metres (0: none), ``camber`` is the fall of the floor from its
    middle to both walls (m/m), ``low`` and ``high`` bound the height, ``floor`` is that of the section.
    """

    scale: float
    level: float
    salt: int
    camber: float
    half_width: float
    floor: float
    low: float
    high: float


@inner
def stones(x: float, y: float, salt: int) -> float:
    """Return the height of the stones at a position, in heights of a dome: -1 to 1.5."""
    fx, fy = math.floor(x / CELL), math.floor(y / CELL)
    best = GAP_HEIGHT
    part = 1.0 / 65535.0
    mask = np.uint64(0xFFFF)
    for i in range(-1, 2):
        for j in range(-1, 2):
            h = mix(int(fx) + i, int(fy) + j, salt)
            cx = (fx + i + 0.1 + 0.8 * part * float(h & mask)) * CELL
            cy = (fy + j + 0.1 + 0.8 * part * float((h >> np.uint64(16)) & mask)) * CELL
            radius = STONE[0] + (STONE[1] - STONE[0]) * part * float((h >> np.uint64(32)) & mask)
            lift = part * float((h >> np.uint64(48)) & mask) - 0.5
            square = ((x - cx) ** 2 + (y - cy) ** 2) / (radius * radius)
            best = max(best, lift + 1.0 - square)
    return best


@kernel
def _many(x: Float, y: Float, salt: int, out: Float) -> None:
    for i in range(x.shape[0]):
        out[i] = stones(x[i], y[i], salt)


@lru_cache(maxsize=1)
def _moments() -> tuple[float, float]:
    """Return mean and standard deviation of the field of stones, from a million positions."""
    x, y = np.random.default_rng(0).uniform(0.0, 1000.0, (2, 1_000_000))
    out = np.empty(x.size)
    _many(x, y, 0, out)
    return float(out.mean()), float(out.std())


def make_ground(parameters: Parameters, section: Section, salt: int) -> Ground | None:
    """Return the requested camber and ballast; ballast has mean height 0 and standard deviation ``parameters.ballast``."""
    if parameters.ballast == 0.0 and parameters.camber == 0.0:
        return None
    mean, spread = _moments() if parameters.ballast > 0.0 else (0.0, 1.0)
    scale = parameters.ballast / spread
    camber = parameters.camber / 100.0
    rise = camber * section.half_width
    return Ground(
        scale,
        -mean * scale,
        salt,
        camber,
        section.half_width,
        section.floor,
        (GAP_HEIGHT - mean) * scale,
        (MAX_HEIGHT - mean) * scale + rise,
    )


@inner
def height(ground: Ground, x: float, y: float, u: float) -> float:
    """Return the height above the section's floor at plan coordinates from the line's origin, ``u`` m right of the axis."""
    h = ground.camber * (ground.half_width - abs(u))
    if ground.scale > 0.0:
        h += ground.scale * stones(x, y, ground.salt) + ground.level
    return h


@kernel
def intersect_ground(
    ground: Ground, plan: Float, profile: Float, origin: Float, direction: Float, found: Float, on_floor: Bool
) -> None:
    """Intersect rays (n, 3) that hit the section with ballast or a cambered floor.

    Parameters
    ----------
    found : (6, n)
        Range and chainage of the hit on the section, rows as of :func:`intersect_lining`; range and cosine are replaced for
        hits on the ground, or on the wall below the section's corner.
    on_floor : (n,)
        In: True for hits on the section's floor; out: True for hits on the floor.
    """
    for i in range(origin.shape[0]):
        r = found[0, i]
        if math.isnan(r) or found[4, i] <= 0.0:
            continue
        ox, oy = origin[i, 0], origin[i, 1]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        _, _, u, w, c, n, k, g, q, det = foot(
            plan, profile, ox + r * dx, oy + r * dy, origin[i, 2] + r * dz, found[1, i], 0.0, np.int64(1)
        )
        gx, gy, gz = gradient(0.0, 1.0, u, w, c, n, k, g, q, det)
        # Near its end the tunnel's frame hardly turns along a ray: it moves by du and dw per metre.
        dw = gx * dx + gy * dy + gz * dz
        du = dx * n - dy * c
        above = w - ground.floor
        if dw > -1e-3 or (not on_floor[i] and above > ground.high):
            continue
        flat = math.sqrt(max(1.0 - dw * dw, 1e-12))
        step = min(0.005 / flat, 0.25 * (ground.high - ground.low) / -dw + 1e-6)
        t = (ground.high - above) / dw
        end = (ground.low - above) / dw + step if on_floor[i] else 0.0
        before = t
        is_wall = False
        while t <= end:
            v = u + t * du
            if on_floor[i] and abs(v) > ground.half_width and v * du > 0.0:
                is_wall = True  # below the corner of the section the wall continues
                found[0, i] = r + (math.copysign(ground.half_width, v) - u) / du
                found[3, i] = abs(du)
                on_floor[i] = False
                break
            if above + t * dw <= height(ground, ox + (r + t) * dx, oy + (r + t) * dy, v):
                break
            before = t
            t += step
        if is_wall or t > end:  # or it passes above the ground to the wall
            continue
        for _ in range(16):
            middle = 0.5 * (before + t)
            if above + middle * dw > height(ground, ox + (r + middle) * dx, oy + (r + middle) * dy, u + middle * du):
                before = middle
            else:
                t = middle
        r += t
        x, y, v = ox + r * dx, oy + r * dy, u + t * du
        h = 0.001
        gx = (height(ground, x + h, y, v + h * n) - height(ground, x - h, y, v - h * n)) / (2.0 * h)
        gy = (height(ground, x, y + h, v - h * c) - height(ground, x, y - h, v + h * c)) / (2.0 * h)
        found[0, i] = r
        found[3, i] = (gx * dx + gy * dy - dw) / math.sqrt(1.0 + gx * gx + gy * gy)
        on_floor[i] = True


@kernel
def _bumps(s: Float, arc: Float, size: float, out: Float) -> None:
    for k in range(s.shape[0]):
        x, y = s[k] / size, arc[k] / size
        fx, fy = math.floor(x), math.floor(y)
        tx, ty = x - fx, y - fy
        tx, ty = tx * tx * (3.0 - 2.0 * tx), ty * ty * (3.0 - 2.0 * ty)
        total = 0.0
        for i in range(2):
            for j in range(2):
                h = math.sin((fx + i) * 12.9898 + (fy + j) * 78.233) * 43758.5453
                value = 2.0 * (h - math.floor(h)) - 1.0
                total += value * (tx if i else 1.0 - tx) * (ty if j else 1.0 - ty)
        out[k] = total


def bumps(s: Float, arc: Float, size: float) -> Float:
    """Return smooth pseudo-random relief, -1 to 1, at positions (n,), of wavelength about two ``size`` m (value noise)."""
    out = np.empty(s.size)
    _bumps(s, arc, size, out)
    return out
