"""Unrolling of points and its inverse (Gonçalves et al., 2012, stage 5), compiled; the same steps as ``sql/unroll.sql``.

A section is a closed curve of 361 nodes, one per degree from -180° to 180°, each at ``radius`` from the axis and with
``arc``, its length along the section from the crown. Between two sections the nodes, and the arcs, are blended linearly
in chainage, so the surface is continuous along the whole tunnel; the arcs so blended are the weighted average of eq. 1.
Along a section the normal is blended between the nodes too, so each point near the surface has one foot, and the way
back is exact.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from tunneldb.geometry.frame import Float, frame_at, locate, nearest_segment

NODES = 361
CROWN = 180
MAX_OUTSIDE = 3.0
"""Farther outside the surface than this, m, a point is off the tunnel (a refuge niche is up to 2-3 m deep)."""

_STEPS = 180
_SIN = np.sin(np.radians(np.arange(NODES) - 180.0))
_COS = np.cos(np.radians(np.arange(NODES) - 180.0))


@njit(cache=True, nogil=True)
def bracket(chainages: Float, chainage: float, reach: float) -> tuple[int, int, float]:
    """Sections before and after a chainage and the weight of the second; (-1, -1, 0) where none is near.

    Two sections bound a stretch when at most ``reach`` apart; beyond the last one it goes on unchanged for half of that.
    """
    low, high = 0, chainages.shape[0]
    while low < high:
        middle = (low + high) // 2
        if chainages[middle] <= chainage:
            low = middle + 1
        else:
            high = middle
    before, after = low - 1, low
    has_after = after < chainages.shape[0]
    if before >= 0 and has_after:
        gap = chainages[after] - chainages[before]
        if gap <= reach:
            return before, after, (chainage - chainages[before]) / gap
    if before >= 0 and chainage - chainages[before] <= reach / 2:
        return before, before, 0.0
    if has_after and chainages[after] - chainage <= reach / 2:
        return after, after, 0.0
    return -1, -1, 0.0


@njit(cache=True, nogil=True)
def _node(radius: Float, a: int, b: int, g: float, k: int) -> tuple[float, float]:
    """Node ``k`` (taken round the circle) of the blended section: right and up, m."""
    k %= 360
    r = (1.0 - g) * radius[a, k] + g * radius[b, k]
    return r * _SIN[k], r * _COS[k]


@njit(cache=True, nogil=True)
def _direction(radius: Float, a: int, b: int, g: float, k: int) -> tuple[float, float]:
    """Unit direction of the blended section at node ``k``, towards growing angle."""
    u0, w0 = _node(radius, a, b, g, k - 1)
    u1, w1 = _node(radius, a, b, g, k + 1)
    length = np.hypot(u1 - u0, w1 - w0)
    return (u1 - u0) / length, (w1 - w0) / length


@njit(cache=True, nogil=True)
def _ahead(radius: Float, a: int, b: int, g: float, k: int, u: float, w: float) -> float:
    """How far the point (u, w) lies ahead of node ``k`` along the section's direction there, m."""
    nu, nw = _node(radius, a, b, g, k)
    du, dw = _direction(radius, a, b, g, k)
    return (u - nu) * du + (w - nw) * dw


@njit(cache=True, nogil=True)
def foot(radius: Float, a: int, b: int, g: float, u: float, w: float) -> tuple[int, float]:
    """Interval (its first node, 0-359) and the share of it where the blended normal passes through (u, w)."""
    k = int(np.floor(np.degrees(np.arctan2(u, w)) + 180.0)) % 360
    here = _ahead(radius, a, b, g, k, u, w)
    following = _ahead(radius, a, b, g, k + 1, u, w)
    for _ in range(_STEPS):
        if here < 0.0:
            k = (k - 1) % 360
            following = here
            here = _ahead(radius, a, b, g, k, u, w)
            if here >= 0.0:
                break
        elif following >= 0.0:
            k = (k + 1) % 360
            here = following
            following = _ahead(radius, a, b, g, k + 1, u, w)
            if following < 0.0:
                break
        else:
            break
    u0, w0 = _node(radius, a, b, g, k)
    u1, w1 = _node(radius, a, b, g, k + 1)
    du0, dw0 = _direction(radius, a, b, g, k)
    du1, dw1 = _direction(radius, a, b, g, k + 1)
    bu, bw, eu, ew = u1 - u0, w1 - w0, du1 - du0, dw1 - dw0
    qu, qw = u - u0, w - w0
    # (q - s b) · (d0 + s e) = 0
    c0 = qu * du0 + qw * dw0
    c1 = qu * eu + qw * ew - bu * du0 - bw * dw0
    c2 = -(bu * eu + bw * ew)
    s = 0.5
    if here > following:
        s = here / (here - following)
    for _ in range(4):
        slope = c1 + 2.0 * c2 * s
        if slope == 0.0:
            break
        s -= (c0 + s * (c1 + s * c2)) / slope
    return k, min(max(s, 0.0), 1.0)


@njit(cache=True, nogil=True)
def surface_at(radius: Float, a: int, b: int, g: float, k: int, s: float) -> tuple[float, float, float, float]:
    """Point of the blended section at share ``s`` of interval ``k`` and the inward unit normal there: u, w, nu, nw."""
    u0, w0 = _node(radius, a, b, g, k)
    u1, w1 = _node(radius, a, b, g, k + 1)
    du0, dw0 = _direction(radius, a, b, g, k)
    du1, dw1 = _direction(radius, a, b, g, k + 1)
    du = du0 + s * (du1 - du0)
    dw = dw0 + s * (dw1 - dw0)
    length = np.hypot(du, dw)
    return u0 + s * (u1 - u0), w0 + s * (w1 - w0), dw / length, -du / length


@njit(cache=True, nogil=True)
def _longitudinal(radius: Float, chainages: Float, a: int, b: int, k: int, s: float, nu: float, nw: float) -> float:
    """Component along the axis of the surface normal, for sections that change with chainage (unnormalised)."""
    if a == b:
        return 0.0
    change = ((1.0 - s) * (radius[b, k] - radius[a, k]) + s * (radius[b, k + 1] - radius[a, k + 1])) / (
        chainages[b] - chainages[a]
    )
    angle = np.radians(k + s - 180.0)
    return -change * (nu * np.sin(angle) + nw * np.cos(angle))


@njit(cache=True, nogil=True)
def _unroll_one(
    segments: Float,
    number: NDArray[np.int64],
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    start: int,
    point: Float,
    frame: Float,
    out: Float,
    normal: Float,
) -> int:
    """Unroll one point into ``out`` (chainage, arc, offset) and ``normal``; return its segment, -1 if off the tunnel."""
    out[:] = np.nan
    normal[:] = np.nan
    k, f = locate(segments, number, start, point[0], point[1], point[2])
    if k < 0:
        return -1
    frame_at(segments[k], f, frame)
    chainage = ends[k, 0] + f * (ends[k, 1] - ends[k, 0])
    a, b, g = bracket(chainages, chainage, reach)
    if a < 0:
        return -1
    x, y, z = point[0] - frame[0, 0], point[1] - frame[0, 1], point[2] - frame[0, 2]
    u = x * frame[2, 0] + y * frame[2, 1] + z * frame[2, 2]
    w = x * frame[3, 0] + y * frame[3, 1] + z * frame[3, 2]
    node, s = foot(radius, a, b, g, u, w)
    fu, fw, nu, nw = surface_at(radius, a, b, g, node, s)
    offset = (u - fu) * nu + (w - fw) * nw
    if offset < -MAX_OUTSIDE:
        return -1
    out[0] = chainage
    out[1] = (1.0 - g) * ((1.0 - s) * arcs[a, node] + s * arcs[a, node + 1]) + g * (
        (1.0 - s) * arcs[b, node] + s * arcs[b, node + 1]
    )
    out[2] = offset
    nt = _longitudinal(radius, chainages, a, b, node, s, nu, nw)
    length = np.sqrt(1.0 + nt * nt)
    for axis in range(3):
        normal[axis] = (nu * frame[2, axis] + nw * frame[3, axis] + nt * frame[1, axis]) / length
    return k


@njit(cache=True, nogil=True, parallel=True)
def unroll_all(
    segments: Float,
    number: NDArray[np.int64],
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    points: Float,
) -> tuple[Float, Float]:
    """Unroll points (n, 3): (chainage, arc, offset) and normals, both (n, 3); NaN off the tunnel."""
    count = points.shape[0]
    unrolled = np.empty((count, 3))
    normals = np.empty((count, 3))
    block = 4096
    for part in prange((count + block - 1) // block):
        frame = np.empty((4, 3))
        near = -1
        for i in range(part * block, min(count, (part + 1) * block)):
            if near >= 0:
                near = _unroll_one(
                    segments, number, ends, chainages, radius, arcs, reach, near, points[i], frame,
                    unrolled[i], normals[i],
                )  # fmt: skip
            if near < 0:
                start = nearest_segment(segments, points[i, 0], points[i, 1], points[i, 2])
                near = _unroll_one(
                    segments, number, ends, chainages, radius, arcs, reach, start, points[i], frame,
                    unrolled[i], normals[i],
                )  # fmt: skip
    return unrolled, normals


@njit(cache=True, nogil=True)
def _roll_one(
    segment: Float,
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    unrolled: Float,
    frame: Float,
    out: Float,
) -> None:
    out[:] = np.nan
    a, b, g = bracket(chainages, unrolled[0], reach)
    if a < 0:
        return
    arc = unrolled[1]
    low, high = 0, NODES - 1
    if arc < (1.0 - g) * arcs[a, low] + g * arcs[b, low] - 1e-6:
        return
    if arc > (1.0 - g) * arcs[a, high] + g * arcs[b, high] + 1e-6:
        return
    while high - low > 1:
        middle = (low + high) // 2
        if (1.0 - g) * arcs[a, middle] + g * arcs[b, middle] <= arc:
            low = middle
        else:
            high = middle
    first = (1.0 - g) * arcs[a, low] + g * arcs[b, low]
    second = (1.0 - g) * arcs[a, low + 1] + g * arcs[b, low + 1]
    s = (arc - first) / (second - first)
    u, w, nu, nw = surface_at(radius, a, b, g, low, s)
    u += unrolled[2] * nu
    w += unrolled[2] * nw
    frame_at(segment, (unrolled[0] - ends[0]) / (ends[1] - ends[0]), frame)
    for axis in range(3):
        out[axis] = frame[0, axis] + u * frame[2, axis] + w * frame[3, axis]


@njit(cache=True, nogil=True, parallel=True)
def roll_all(
    segments: Float,
    which: NDArray[np.int64],
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    unrolled: Float,
) -> Float:
    """Points (n, 3) of (chainage, arc, offset) rows (n, 3), each in the segment ``which``; NaN off the tunnel (-1)."""
    count = unrolled.shape[0]
    points = np.empty((count, 3))
    for i in prange(count):
        frame = np.empty((4, 3))
        k = which[i]
        if k < 0:
            points[i, :] = np.nan
        else:
            _roll_one(segments[k], ends[k], chainages, radius, arcs, reach, unrolled[i], frame, points[i])
    return points
