"""Synthetic tunnel: a section swept along a centre line, perpendicular to its 3D axis.

Both directions between space and the unrolled plane are exact: coordinates of a point at (chainage, arc, offset),
and chainage, arc, offset and surface normal of a point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Float
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.tunnel.centreline import CentreLine, axis_at
from tunneldb.simulate.tunnel.section import Section, nearest


@inner
def foot(
    plan: Float, profile: Float, x: float, y: float, z: float, s: float, tolerance: float, max_steps: int
) -> tuple[float, float, float, float, float, float, float, float, float, float]:
    """Find the foot of the perpendicular from a point to the axis: Newton's method from chainage ``s``.

    It ends with a step of less than ``tolerance`` m, or after ``max_steps`` steps. That is a ``np.int64``, since Numba would
    compile a version for each literal number. Return the chainage and the last step, then, before that step: u, w, cos and
    sin of the direction, curvature, grade, the length q of the unnormalised tangent, and D, by which (cos, sin, grade) is
    divided to give the gradient of chainage.
    """
    step, u, w, c, n, k, g, q, d = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(max_steps):
        ax, ay, az, c, n, k, g, dg = axis_at(plan, profile, s)
        dx, dy, dz = x - ax, y - ay, z - az
        q = math.sqrt(1.0 + g * g)
        along = dx * c + dy * n
        u = dx * n - dy * c
        w = (dz - g * along) / q
        d = q * q + k * u - dz * dg
        step = (along + dz * g) / d
        s += step
        if abs(step) < tolerance:
            break
    return s, step, u, w, c, n, k, g, q, d


@inner
def gradient(
    gu: float, gw: float, u: float, w: float, c: float, n: float, k: float, g: float, q: float, d: float
) -> tuple[float, float, float]:
    """Return the gradient in space of a function of (u, w) with gradient (gu, gw) there.

    u and w also change with chainage, because the frame of a sloping curve turns about its tangent.
    """
    twist = k * g / q
    s = (gw * u - gu * w) * twist / d
    return gu * n - gw * g * c / q + s * c, -gu * c - gw * g * n / q + s * n, gw / q + s * g


@kernel
def _unroll(plan: Float, profile: Float, parts: Float, xyz: Float, s: Float, tolerance: float, out: Float) -> None:
    """Write chainage, arc, offset and unit normal of points (n, 3) from the line's origin into ``out`` (6, n).

    ``s`` (n,) are chainages near them; the error of the chainage is the square of ``tolerance`` over the bend's radius.
    """
    for i in range(xyz.shape[0]):
        chainage, _, u, w, c, n, k, g, q, d = foot(
            plan, profile, xyz[i, 0], xyz[i, 1], xyz[i, 2], s[i], tolerance, np.int64(20)
        )
        arc, offset, gu, gw = nearest(parts, u, w)
        nx, ny, nz = gradient(gu, gw, u, w, c, n, k, g, q, d)
        norm = math.sqrt(nx * nx + ny * ny + nz * nz)
        out[0, i] = chainage
        out[1, i] = arc
        out[2, i] = offset
        out[3, i] = nx / norm
        out[4, i] = ny / norm
        out[5, i] = nz / norm


class Unrolled(NamedTuple):
    """Chainage, arc and offset (n,), m, and unit normal into the tunnel (n, 3)."""

    chainage: Float
    arc: Float
    offset: Float
    normal: Float


@dataclass(frozen=True)
class Tunnel:
    """Section swept along a centre line."""

    line: CentreLine
    section: Section

    def to_space(self, chainage: Float, arc: Float, offset: Float | float = 0.0) -> Float:
        """Return coordinates (n, 3) of points of the unrolled plane, ``offset`` m off the surface into the tunnel."""
        given = np.atleast_1d(chainage), np.asarray(arc), np.asarray(offset)
        s, a, o = np.broadcast_arrays(*given)
        x, y, z, c, n, _, g, _ = self.line.table(s)
        point, normal = self.section.point(a)
        u, w = (point + o[:, None] * normal).T
        q = np.sqrt(1.0 + g * g)
        return np.column_stack([x + u * n - w * g * c / q, y - u * c - w * g * n / q, z + w / q]) + self.line.origin

    def unroll(self, xyz: Float) -> Unrolled:
        """Return chainage, arc, offset and normal of points (n, 3) within the bend's radius of the axis."""
        points = np.atleast_2d(np.asarray(xyz, float))
        guess = np.linspace(self.line.start, self.line.end, max(2, int((self.line.end - self.line.start) / 5)))
        # Newton's method converges from the nearest of a few axis points.
        _, index = cKDTree(self.line.position(guess)).query(points)
        return self.unroll_near(np.ascontiguousarray(points - self.line.origin), guess[index], 1e-10)

    def unroll_near(self, points: Float, chainage: Float, tolerance: float) -> Unrolled:
        """Return chainage, arc, offset and normal of points (n, 3) from the line's origin, by chainages (n,) near them.

        The last step of Newton's method is shorter than ``tolerance``, m; its square over the bend's radius is the error.
        """
        out = np.empty((6, len(points)))
        _unroll(self.line.plan, self.line.profile, self.section.parts, points, chainage, tolerance, out)
        return Unrolled(out[0], out[1], out[2], out[3:].T)

    def area_factor(self, chainage: Float, arc: Float) -> Float:
        """Return the area on the surface per unit of area in the unrolled plane, at points (n,)."""
        h = 1e-3
        s, a = np.atleast_1d(np.asarray(chainage, float)), np.atleast_1d(np.asarray(arc, float))
        ds = (self.to_space(s + h, a) - self.to_space(s - h, a)) / (2 * h)
        da = (self.to_space(s, a + h) - self.to_space(s, a - h)) / (2 * h)
        return np.linalg.norm(np.cross(ds, da), axis=1)
