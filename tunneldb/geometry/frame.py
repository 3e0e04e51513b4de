r"""Planes across the axis: tangents, segments, and the frame at any chainage.

A segment is between two planes, each perpendicular to the axis at a vertex (Gonçalves et al., 2012, stage 3).
Within the segment the plane turns linearly from the first to the second: the plane at the fraction ``f`` is

.. math:: (1-f)\,(p-v_a)\cdot t_a = f\,(v_b-p)\cdot t_b

so that a point's fraction is ``d_a / (d_a + d_b)``, its distances from the two planes. It is 0 and 1 on them, and so
continuous across segments at any distance from the axis. It differs from the angle on a true circular arc of radius 300 m
by less than 0.2 mm in a segment of 10 m. ``sql/geometry/unroll.sql`` has the same formulas.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int64, Intp
from tunneldb.compiled import inner, point_inner


def tangents(vertices: Float) -> Float:
    """Return unit tangents at equally spaced vertices of an axis.

    The direction at a vertex is that from its predecessor to its successor (Gonçalves et al., 2012, fig. 5), which on a
    circular arc is the tangent itself. The two ends have the tangents of the parabola through the three nearest vertices, exact
    to the same order; an axis of two vertices has the chord.

    Parameters
    ----------
    vertices : (n, 3) float array
        Axis vertices, m, n ≥ 2.

    Returns
    -------
    (n, 3) float array
    """
    direction = np.empty_like(vertices)
    direction[1:-1] = vertices[2:] - vertices[:-2]
    if len(vertices) == 2:
        direction[:] = vertices[1] - vertices[0]
    else:
        direction[0] = -3.0 * vertices[0] + 4.0 * vertices[1] - vertices[2]
        direction[-1] = 3.0 * vertices[-1] - 4.0 * vertices[-2] + vertices[-3]
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def plan_lengths(vertices: Float, tangent: Float) -> Float:
    """Return the plan length of the axis between consecutive vertices, each piece as a circular arc.

    Parameters
    ----------
    vertices, tangent : (n, 3) float arrays
        Axis vertices, m, and unit tangents there.

    Returns
    -------
    (n - 1,) float array
        Chord × (φ/2) / sin(φ/2), with φ the angle in plan between the two tangents; m.
    """
    chord = np.hypot(*(vertices[1:, :2] - vertices[:-1, :2]).T)
    azimuth = np.arctan2(tangent[:, 0], tangent[:, 1])
    half = (np.mod(np.diff(azimuth) + np.pi, 2.0 * np.pi) - np.pi) / 2.0
    return np.asarray(chord / np.sinc(half / np.pi), dtype=np.float64)


@point_inner
def fraction(segments: Float, k: int, x: float, y: float, z: float) -> float:
    """Return the fraction of segment ``k`` for a point; below 0 before the segment, 1 or more after it.

    A segment is a row of 12: vertex_from, vertex_to, tangent_from, tangent_to.
    """
    before = (
        (x - segments[k, 0]) * segments[k, 6] + (y - segments[k, 1]) * segments[k, 7] + (z - segments[k, 2]) * segments[k, 8]
    )
    after = (
        (segments[k, 3] - x) * segments[k, 9] + (segments[k, 4] - y) * segments[k, 10] + (segments[k, 5] - z) * segments[k, 11]
    )
    if before < 0.0:
        return -1.0
    if after <= 0.0:
        return 2.0
    return before / (before + after)


@point_inner
def frame_of(segments: Float, k: int, f: float) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the plane at fraction ``f`` of segment ``k``: origin (3), tangent (3) and horizontal direction to the right (2).

    The origin is the intersection of the cubic Hermite curve through the two vertices with the plane. The direction up is
    (uy nz, -ux nz, ux ny - uy nx).
    """
    g = 1.0 - f
    ax, ay, az = segments[k, 6], segments[k, 7], segments[k, 8]
    bx, by, bz = segments[k, 9], segments[k, 10], segments[k, 11]
    nx, ny, nz = g * ax + f * bx, g * ay + f * by, g * az + f * bz
    flat = nx * nx + ny * ny
    scale = 1.0 / np.sqrt(flat + nz * nz)
    flat = 1.0 / np.sqrt(flat)
    ux, uy = ny * flat, -nx * flat
    nx, ny, nz = nx * scale, ny * scale, nz * scale
    # Relative to the first vertex: coordinates of millions of metres would lose digits.
    cx, cy, cz = segments[k, 3] - segments[k, 0], segments[k, 4] - segments[k, 1], segments[k, 5] - segments[k, 2]
    length = np.sqrt(cx * cx + cy * cy + cz * cz)
    h10, h01, h11 = f * g * g * length, f * f * (3.0 - 2.0 * f), -f * f * g * length
    px = h10 * ax + h01 * cx + h11 * bx
    py = h10 * ay + h01 * cy + h11 * by
    pz = h10 * az + h01 * cz + h11 * bz
    gap = f * (cx * bx + cy * by + cz * bz) * scale - (px * nx + py * ny + pz * nz)
    return (
        segments[k, 0] + px + gap * nx, segments[k, 1] + py + gap * ny, segments[k, 2] + pz + gap * nz,
        nx, ny, nz, ux, uy,
    )  # fmt: skip


def frames_at(segments: Float, segment: Intp | Int64, f: Float) -> Float:
    """Return origin, tangent, right and up, (n, 4, 3), of the planes at fractions (n,) of segments with indices (n,)."""
    x, y, z, nx, ny, nz, ux, uy = frame_of.py_func(segments, segment, f)  # its formulas are valid for arrays, too
    level = np.zeros_like(x)
    frames = [x, y, z, nx, ny, nz, ux, uy, level, uy * nz, -ux * nz, ux * ny - uy * nx]
    return np.stack(frames, axis=-1).reshape(-1, 4, 3)


def segment_rows(vertices: Float, tangent: Float) -> Float:
    """Return rows of 12 (vertex_from, vertex_to, tangent_from, tangent_to) of the segments between consecutive vertices."""
    return np.ascontiguousarray(np.hstack([vertices[:-1], vertices[1:], tangent[:-1], tangent[1:]]))


@inner
def nearest_segment(segments: Float, x: float, y: float, z: float) -> int:
    """Return the index of the segment whose midpoint is nearest to a point."""
    best, which = np.inf, 0
    for k in range(segments.shape[0]):
        dx = 0.5 * (segments[k, 0] + segments[k, 3]) - x
        dy = 0.5 * (segments[k, 1] + segments[k, 4]) - y
        dz = 0.5 * (segments[k, 2] + segments[k, 5]) - z
        distance = dx * dx + dy * dy + dz * dz
        if distance < best:
            best, which = distance, k
    return which


@point_inner
def locate(segments: Float, number: Int64, start: int, x: float, y: float, z: float) -> tuple[int, float]:
    """Return the segment that contains a point and the fraction in it, searching from ``start``; (-1, 0) if none does.

    ``number`` are the segments' numbers, ascending; the search doesn't cross a gap in them.
    """
    k = start
    for _ in range(segments.shape[0] + 1):
        f = fraction(segments, k, x, y, z)
        if f < 0.0:
            if k == 0 or number[k - 1] != number[k] - 1:
                return -1, 0.0
            k -= 1
        elif f >= 1.0:
            if k == segments.shape[0] - 1 or number[k + 1] != number[k] + 1:
                return -1, 0.0
            # A point between the planes of both (where they cross, far from the axis) belongs to the first.
            following = fraction(segments, k + 1, x, y, z)
            k += 1
            if following < 0.0:
                return k, 0.0
        else:
            return k, f
    return -1, 0.0
