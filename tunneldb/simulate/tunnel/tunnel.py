"""A synthetic tunnel: a section swept along a centre line, perpendicular to its 3D axis.

Both directions between space and the unrolled plane are exact: coordinates of a point at (chainage, arc, offset),
and chainage, arc, offset and surface normal of a point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.simulate.tunnel.centreline import CentreLine, axis_at
from tunneldb.simulate.tunnel.section import Section, nearest, on_section


@njit(cache=True, nogil=True, inline="always")
def newton_step(
    plan: Float, profile: Float, x: float, y: float, z: float, s: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """One Newton step towards the chainage whose perpendicular plane holds the point.

    Returns the step, then at ``s``: u, w, cos and sin of the direction, curvature, grade, the length q of the
    unnormalised tangent, and D, by which (cos, sin, grade) is divided to give the gradient of chainage.
    """
    ax, ay, az, c, n, k, g, dg = axis_at(plan, profile, s)
    dx, dy, dz = x - ax, y - ay, z - az
    q = math.sqrt(1.0 + g * g)
    along = dx * c + dy * n
    u = dx * n - dy * c
    w = (dz - g * along) / q
    d = q * q + k * u - dz * dg
    return (along + dz * g) / d, u, w, c, n, k, g, q, d


@njit(cache=True, nogil=True, inline="always")
def gradient(
    gu: float, gw: float, u: float, w: float, c: float, n: float, k: float, g: float, q: float, d: float
) -> tuple[float, float, float]:
    """Gradient in space of a function of (u, w) with gradient (gu, gw) there.

    u and w also change with chainage, because the frame of a sloping curve turns about its tangent.
    """
    twist = k * g / q
    s = (gw * u - gu * w) * twist / d
    return gu * n - gw * g * c / q + s * c, -gu * c - gw * g * n / q + s * n, gw / q + s * g


@njit(cache=True, nogil=True)
def _unroll_many(plan: Float, profile: Float, parts: Float, xyz: Float, s: Float, out: Float) -> None:
    for i in range(xyz.shape[0]):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        chainage = s[i]
        for _ in range(20):
            step, u, w, c, n, k, g, q, d = newton_step(plan, profile, x, y, z, chainage)
            chainage += step
            if abs(step) < 1e-10:
                break
        arc, offset, gu, gw = nearest(parts, u, w)
        nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, d)
        norm = math.sqrt(nx * nx + ny * ny + nz * nz)
        out[i, 0] = chainage
        out[i, 1] = arc
        out[i, 2] = offset
        out[i, 3] = nx / norm
        out[i, 4] = ny / norm
        out[i, 5] = nz / norm


@njit(cache=True, nogil=True)
def _roll_many(plan: Float, profile: Float, parts: Float, s: Float, arc: Float, offset: Float, out: Float) -> None:
    for i in range(s.shape[0]):
        ax, ay, az, c, n, _, g, _ = axis_at(plan, profile, s[i])
        pu, pw, nu, nw = on_section(parts, arc[i])
        u, w = pu + offset[i] * nu, pw + offset[i] * nw
        q = math.sqrt(1.0 + g * g)
        out[i, 0] = ax + u * n - w * g * c / q
        out[i, 1] = ay - u * c - w * g * n / q
        out[i, 2] = az + w / q


class Unrolled(NamedTuple):
    """Chainage, arc and offset (n,), m, and unit normal into the tunnel (n, 3)."""

    chainage: Float
    arc: Float
    offset: Float
    normal: Float


@dataclass(frozen=True)
class Tunnel:
    """A section swept along a centre line."""

    line: CentreLine
    section: Section

    def to_space(self, chainage: Float, arc: Float, offset: Float | float = 0.0) -> Float:
        """Coordinates (n, 3) of points of the unrolled plane, ``offset`` m off the surface into the tunnel."""
        given = np.atleast_1d(chainage), np.asarray(arc), np.asarray(offset)
        s, a, o = (np.array(x, dtype=float) for x in np.broadcast_arrays(*given))
        out = np.empty((s.size, 3))
        _roll_many(self.line.plan, self.line.profile, self.section.parts, s, a, o, out)
        return out + self.line.origin

    def unroll(self, xyz: Float) -> Unrolled:
        """Chainage, arc, offset and normal of points (n, 3) within the bend's radius of the axis."""
        points = np.atleast_2d(np.asarray(xyz, float))
        out = np.empty((len(points), 6))
        guess = np.linspace(self.line.start, self.line.end, max(2, int((self.line.end - self.line.start) / 5)))
        # The nearest of a few axis points is a start from which Newton's method converges.
        _, index = cKDTree(self.line.position(guess)).query(points)
        _unroll_many(
            self.line.plan,
            self.line.profile,
            self.section.parts,
            np.ascontiguousarray(points - self.line.origin),
            guess[index],
            out,
        )
        return Unrolled(out[:, 0], out[:, 1], out[:, 2], out[:, 3:])

    def area_factor(self, chainage: Float, arc: Float) -> Float:
        """Area on the surface for a unit of area in the unrolled plane, at points (n,)."""
        h = 1e-3
        s, a = np.atleast_1d(np.asarray(chainage, float)), np.atleast_1d(np.asarray(arc, float))
        ds = (self.to_space(s + h, a) - self.to_space(s - h, a)) / (2 * h)
        da = (self.to_space(s, a + h) - self.to_space(s, a - h)) / (2 * h)
        return np.linalg.norm(np.cross(ds, da), axis=1)
