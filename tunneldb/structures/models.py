"""Planes and cylinders as rows of numbers: distance, unrolling and its inverse, fits from moments.

A row has a point (3), the normal of a plane or the axis of a cylinder (3), the radius (0 for a plane), the side from which it
is seen (1: from outside, -1: from inside) and a direction of the plane from which arcs count (3). Lengths are metres from the
origin of the voxels.
"""

from __future__ import annotations

import math

import numpy as np

from tunneldb.arrays import Float, Int32
from tunneldb.compiled import inner, point_inner
from tunneldb.geometry.normals import eigenvalues, normal

WIDTH = 11
"""Number of values of a row."""

POINT, AXIS, RADIUS, SIDE, ACROSS = slice(0, 3), slice(3, 6), 6, 7, slice(8, 11)

ANGLES = 36
"""Number of angular classes about an axis for the angle over which a cylinder is seen."""


def with_directions(models: Float, middles: Float) -> Float:
    """Set the direction from which each model's (k, WIDTH) unrolled coordinates count.

    For a plane u is as horizontal as possible and v upwards, to the left of u seen from the scanner's side. For a cylinder u is
    along its axis and v = r·φ around it, 0 in the direction of the middle (k, 3) of its seen part, so that the cut is behind.
    """
    out = models.copy()
    axis = out[:, AXIS]
    up = np.zeros_like(axis)
    up[:, 2] = 1.0
    # Of what lies level, north takes the place of up.
    up[np.abs(axis[:, 2]) > 0.999] = (0.0, 1.0, 0.0)
    level = np.cross(up, axis)
    flat = out[:, RADIUS] == 0.0
    towards = middles - out[:, POINT]
    towards -= np.einsum("ni,ni->n", towards, axis)[:, None] * axis
    length = np.linalg.norm(towards, axis=1)
    around = (~flat) & (length > 1e-6)
    level[around] = towards[around]
    out[:, ACROSS] = level / np.linalg.norm(level, axis=1, keepdims=True)
    return out


def _cross(one: Float, other: Float) -> Float:
    """Return the vector product of two vectors (3,): for so few values NumPy's own takes twenty times as long."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def unroll(model: Float, xyz: Float) -> tuple[Float, Float, Float]:
    """Return unrolled coordinates (u, v) and distance from the surface towards the scanner's side of points (n, 3); m."""
    out = np.empty((len(xyz), 3))
    q = xyz - model[POINT]
    axis, across = model[AXIS], model[ACROSS]
    other = _cross(axis, across)
    if model[RADIUS] == 0.0:
        out[:, 0], out[:, 1], out[:, 2] = q @ across, q @ other, q @ axis
    else:
        x, y = q @ across, q @ other
        out[:, 0] = q @ axis
        out[:, 1] = model[RADIUS] * np.arctan2(y, x)
        out[:, 2] = model[SIDE] * (np.hypot(x, y) - model[RADIUS])
    return out[:, 0], out[:, 1], out[:, 2]


def to_space(model: Float, u: Float, v: Float) -> Float:
    """Place (n, 3) of unrolled coordinates (n,), m: the inverse of `unroll` on the surface."""
    axis, across = model[AXIS], model[ACROSS]
    other = _cross(axis, across)
    if model[RADIUS] == 0.0:
        return np.asarray(model[POINT] + np.multiply.outer(u, across) + np.multiply.outer(v, other))
    angle = v / model[RADIUS]
    ring = np.multiply.outer(np.cos(angle), across) + np.multiply.outer(np.sin(angle), other)
    return np.asarray(model[POINT] + np.multiply.outer(u, axis) + model[RADIUS] * ring)


def normals_at(model: Float, u: Float, v: Float) -> Float:
    """Return the unit normal (n, 3) towards the scanner's side at unrolled coordinates (n,)."""
    axis, across = model[AXIS], model[ACROSS]
    if model[RADIUS] == 0.0:
        return np.broadcast_to(axis, (len(u), 3))
    angle = v / model[RADIUS]
    other = _cross(axis, across)
    return np.asarray(model[SIDE] * (np.multiply.outer(np.cos(angle), across) + np.multiply.outer(np.sin(angle), other)))


@point_inner
def distance(model: Float, x: float, y: float, z: float) -> float:  # pragma: no cover - compiled
    """Return the distance of a place from a surface, towards the scanner's side, m."""
    qx, qy, qz = x - model[0], y - model[1], z - model[2]
    along = qx * model[3] + qy * model[4] + qz * model[5]
    if model[6] == 0.0:
        return along
    wx, wy, wz = qx - along * model[3], qy - along * model[4], qz - along * model[5]
    return model[7] * (math.sqrt(wx * wx + wy * wy + wz * wz) - model[6])


@point_inner
def gradient(model: Float, x: float, y: float, z: float) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return the normal of a surface beneath a place, towards the scanner's side."""
    if model[6] == 0.0:
        return model[3], model[4], model[5]
    qx, qy, qz = x - model[0], y - model[1], z - model[2]
    along = qx * model[3] + qy * model[4] + qz * model[5]
    wx, wy, wz = qx - along * model[3], qy - along * model[4], qz - along * model[5]
    length = math.sqrt(wx * wx + wy * wy + wz * wz)
    if length < 1e-12:
        return 0.0, 0.0, 0.0
    scale = model[7] / length
    return wx * scale, wy * scale, wz * scale


@inner
def fit_plane(total: Float, model: Float) -> float:  # pragma: no cover - compiled
    """Write the plane of summed moments (10,) into a model with a known side, and return the rms distance, m."""
    n = total[0]
    x, y, z = total[1] / n, total[2] / n, total[3] / n
    xx, yy, zz = total[4] / n - x * x, total[5] / n - y * y, total[6] / n - z * z
    xy, xz, yz = total[7] / n - x * y, total[8] / n - x * z, total[9] / n - y * z
    least, _, _ = eigenvalues(xx, yy, zz, xy, xz, yz)
    nx, ny, nz = normal(xx, yy, zz, xy, xz, yz, least)
    if nx * model[3] + ny * model[4] + nz * model[5] < 0.0:
        nx, ny, nz = -nx, -ny, -nz
    if nx != 0.0 or ny != 0.0 or nz != 0.0:
        model[0], model[1], model[2] = x, y, z
        model[3], model[4], model[5] = nx, ny, nz
    model[6], model[7] = 0.0, 1.0
    return math.sqrt(max(least, 0.0))


@inner
def fit_cylinder(
    moments: Float, centroid: Float, held: Int32, count: int, noise: float, model: Float, turns: int
) -> float:  # pragma: no cover - compiled
    """Fit a cylinder to voxels ``held`` (count,), Gauss-Newton with Tukey's weights, and return the rms distance, m.

    The centroid of a voxel's points is inside the surface by their variance along the tangent over twice the radius, which is
    added.
    """
    system, right = np.empty((5, 5)), np.empty(5)
    rms = np.inf
    for turn in range(turns):
        ax, ay, az = model[3], model[4], model[5]
        # Two directions across the axis.
        if abs(ax) < 0.7:
            ux, uy, uz = 0.0, az, -ay
        else:
            ux, uy, uz = -az, 0.0, ax
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        ux, uy, uz = ux / length, uy / length, uz / length
        vx, vy, vz = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
        # The point of the axis in the middle of what is seen.
        middle, weight = 0.0, 0.0
        for m in range(count):
            i = held[m]
            n = moments[i, 0]
            middle += n * (
                (centroid[i, 0] - model[0]) * ax + (centroid[i, 1] - model[1]) * ay + (centroid[i, 2] - model[2]) * az
            )
            weight += n
        middle /= weight
        model[0] += middle * ax
        model[1] += middle * ay
        model[2] += middle * az
        system[:] = 0.0
        right[:] = 0.0
        squares, weights = 0.0, 0.0
        reach = 5.0 * max(noise, 0.0005) if turn > 1 else 1e9
        for m in range(count):
            i = held[m]
            n = moments[i, 0]
            cx, cy, cz = centroid[i, 0], centroid[i, 1], centroid[i, 2]
            qx, qy, qz = cx - model[0], cy - model[1], cz - model[2]
            t = qx * ax + qy * ay + qz * az
            wx, wy, wz = qx - t * ax, qy - t * ay, qz - t * az
            rho = math.sqrt(wx * wx + wy * wy + wz * wz)
            if rho < 1e-9:
                continue
            ex, ey, ez = wx / rho, wy / rho, wz / rho
            tx, ty, tz = ay * ez - az * ey, az * ex - ax * ez, ax * ey - ay * ex
            spread = (
                tx * tx * (moments[i, 4] / n - cx * cx)
                + ty * ty * (moments[i, 5] / n - cy * cy)
                + tz * tz * (moments[i, 6] / n - cz * cz)
                + 2.0 * tx * ty * (moments[i, 7] / n - cx * cy)
                + 2.0 * tx * tz * (moments[i, 8] / n - cx * cz)
                + 2.0 * ty * tz * (moments[i, 9] / n - cy * cz)
            )
            r = rho + max(spread, 0.0) / (2.0 * max(model[6], 0.005)) - model[6]
            if abs(r) >= reach:
                continue
            tukey = (1.0 - (r / reach) ** 2) ** 2
            w = tukey * n / (1.0 + 0.02 * n)
            g0, g1 = -(ex * ux + ey * uy + ez * uz), -(ex * vx + ey * vy + ez * vz)
            row = (g0, g1, t * g0, t * g1, -1.0)
            for a in range(5):
                right[a] -= w * row[a] * r
                for b in range(a + 1):
                    system[a, b] += w * row[a] * row[b]
            squares += w * r * r
            weights += w
        if weights <= 0.0:
            return np.inf
        for a in range(5):
            system[a, a] += 1e-9 * weights
            for b in range(a):
                system[b, a] = system[a, b]
        step = np.linalg.solve(system, right)
        most = 0.5 * max(model[6], 0.01)
        for a in (0, 1, 4):
            step[a] = min(max(step[a], -most), most)
        model[0] += step[0] * ux + step[1] * vx
        model[1] += step[0] * uy + step[1] * vy
        model[2] += step[0] * uz + step[1] * vz
        ax, ay, az = (
            ax + step[2] * ux + step[3] * vx,
            ay + step[2] * uy + step[3] * vy,
            az + step[2] * uz + step[3] * vz,
        )
        length = math.sqrt(ax * ax + ay * ay + az * az)
        model[3], model[4], model[5] = ax / length, ay / length, az / length
        model[6] = max(model[6] + step[4], 0.002)
        rms = math.sqrt(squares / weights)
        if turn > 2 and abs(step[4]) < 1e-6 and abs(step[0]) + abs(step[1]) < 1e-6:
            break
    return rms


@inner
def seen_angle(model: Float, centroid: Float, held: Int32, count: int) -> float:  # pragma: no cover - compiled
    """Return the angle about its axis over which voxels show a cylinder, radians."""
    ax, ay, az = model[3], model[4], model[5]
    if abs(ax) < 0.7:
        ux, uy, uz = 0.0, az, -ay
    else:
        ux, uy, uz = -az, 0.0, ax
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    vx, vy, vz = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
    seen = np.zeros(36, np.int64)
    for m in range(count):
        i = held[m]
        qx, qy, qz = centroid[i, 0] - model[0], centroid[i, 1] - model[1], centroid[i, 2] - model[2]
        angle = math.atan2(qx * vx + qy * vy + qz * vz, qx * ux + qy * uy + qz * uz)
        seen[int((angle + math.pi) / (2.0 * math.pi) * 36) % 36] += 1
    number = 0
    for k in range(36):
        if seen[k] > 0:
            number += 1
    return number * 2.0 * math.pi / 36.0
