"""Unrolling of points and its inverse (Gonçalves et al., 2012, stage 5); the same steps as ``sql/geometry/unroll.sql``.

A section is a closed curve of 361 nodes, one per degree from -180° to 180°, each at ``radius`` from the axis and with
``arc``, its length along the section from the crown. Between two sections the nodes, and the arcs, are blended linearly
in chainage, so the surface is continuous along the whole tunnel; the arcs so blended are the weighted average of eq. 1.
Along a section the normal is blended between the nodes too, so each point near the surface has one foot, and the way
back is exact.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from tunneldb.arrays import Float, Int64
from tunneldb.geometry.frame import frame_at, frame_of, locate, nearest_segment

NODES = 361
CROWN = 180
MAX_OUTSIDE = 3.0
"""Farther outside the surface than this, m, a point is off the tunnel (a refuge niche is up to 2-3 m deep)."""

Near = tuple[int, int, int]
NOWHERE: Near = (-1, -1, 0)
"""Segment, section and degree of a point before the first one."""

_STEPS = 180
_SIN = np.sin(np.radians(np.arange(NODES) - 180.0))
_COS = np.cos(np.radians(np.arange(NODES) - 180.0))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def bracket(chainages: Float, chainage: float, reach: float, hint: int = -1) -> tuple[int, int, float]:
    """Sections before and after a chainage and the weight of the second; (-1, -1, 0) where none is near.

    Two sections bound a stretch when at most ``reach`` apart; beyond the last one it goes on unchanged for half of that.
    ``hint`` is where to look first for the section before.
    """
    count = chainages.shape[0]
    if 0 <= hint < count - 1 and chainages[hint] <= chainage < chainages[hint + 1]:
        before = hint
    else:
        low, high = 0, count
        while low < high:
            middle = (low + high) // 2
            if chainages[middle] <= chainage:
                low = middle + 1
            else:
                high = middle
        before = low - 1
    after = before + 1
    has_after = after < count
    if before >= 0 and has_after:
        gap = chainages[after] - chainages[before]
        if gap <= reach:
            return before, after, (chainage - chainages[before]) / gap
    if before >= 0 and chainage - chainages[before] <= reach / 2:
        return before, before, 0.0
    if has_after and chainages[after] - chainage <= reach / 2:
        return after, after, 0.0
    return -1, -1, 0.0


@njit(cache=True, nogil=True, forceinline=True)
def _node(radius: Float, a: int, b: int, g: float, k: int) -> tuple[float, float]:
    """Node ``k`` (-1 to 361, taken round the circle) of the blended section: right and up, m."""
    if k < 0:
        k += 360
    elif k >= 360:
        k -= 360
    r = (1.0 - g) * radius[a, k] + g * radius[b, k]
    return r * _SIN[k], r * _COS[k]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _unit(u: float, w: float) -> tuple[float, float]:
    length = 1.0 / np.sqrt(u * u + w * w)
    return u * length, w * length


@njit(cache=True, nogil=True, forceinline=True)
def _degree(u: float, w: float, hint: int) -> int:
    """Interval (its first node, 0-359) whose angles hold the direction of (u, w), looked for near a hint."""
    k = hint
    for _ in range(4):
        if u * _COS[k] - w * _SIN[k] < 0.0:
            k = k - 1 if k > 0 else 359
        elif u * _COS[k + 1] - w * _SIN[k + 1] >= 0.0:
            k = k + 1 if k < 359 else 0
        else:
            return k
    return int(np.floor(np.degrees(np.arctan2(u, w)) + 180.0)) % 360


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def foot(radius: Float, a: int, b: int, g: float, u: float, w: float, k: int) -> tuple[int, float, float, float, float, float]:
    """Place on the blended section whose normal passes through (u, w), looked for from interval ``k`` on.

    Returns the interval (its first node, 0-359), the share of it, the point (u, w) and the inward unit normal there.
    """
    u0, w0 = _node(radius, a, b, g, k)
    u1, w1 = _node(radius, a, b, g, k + 1)
    ub, wb = _node(radius, a, b, g, k - 1)
    ua, wa = _node(radius, a, b, g, k + 2)
    # How far (u, w) lies ahead of the interval's nodes along the section's direction there; only the signs count yet.
    here = (u - u0) * (u1 - ub) + (w - w0) * (w1 - wb)
    following = (u - u1) * (ua - u0) + (w - w1) * (wa - w0)
    for _ in range(_STEPS):
        if here < 0.0:
            k = k - 1 if k > 0 else 359
            ua, wa, u1, w1, u0, w0 = u1, w1, u0, w0, ub, wb
            ub, wb = _node(radius, a, b, g, k - 1)
            following = here
            here = (u - u0) * (u1 - ub) + (w - w0) * (w1 - wb)
            if here >= 0.0:
                break
        elif following >= 0.0:
            k = k + 1 if k < 359 else 0
            ub, wb, u0, w0, u1, w1 = u0, w0, u1, w1, ua, wa
            ua, wa = _node(radius, a, b, g, k + 2)
            here = following
            following = (u - u1) * (ua - u0) + (w - w1) * (wa - w0)
            if following < 0.0:
                break
        else:
            break
    du0, dw0 = _unit(u1 - ub, w1 - wb)
    du1, dw1 = _unit(ua - u0, wa - w0)
    s = _share(u - u0, w - w0, u1 - u0, w1 - w0, du0, dw0, du1 - du0, dw1 - dw0, here >= 0.0 and following < 0.0)
    du, dw = _unit(du0 + s * (du1 - du0), dw0 + s * (dw1 - dw0))
    return k, s, u0 + s * (u1 - u0), w0 + s * (w1 - w0), dw, -du


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _share(qu: float, qw: float, bu: float, bw: float, du: float, dw: float, eu: float, ew: float, between: bool) -> float:
    """Solve (q - s b) · (d + s e) = 0 for the share of the interval, 0 to 1; ``between``: the ends have different signs."""
    c0 = qu * du + qw * dw
    c1 = qu * eu + qw * ew - bu * du - bw * dw
    c2 = -(bu * eu + bw * ew)
    root = c1 * c1 - 4.0 * c0 * c2
    if between and c1 < 0.0 and root >= 0.0:
        s = 2.0 * c0 / (np.sqrt(root) - c1)
    else:
        # Far from the surface there may be no root: Newton's steps end at an end.
        s = 0.5
        for _ in range(6):
            slope = c1 + 2.0 * c2 * s
            if slope == 0.0:
                break
            s -= (c0 + s * (c1 + s * c2)) / slope
    return min(max(s, 0.0), 1.0)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def surface_at(radius: Float, a: int, b: int, g: float, k: int, s: float) -> tuple[float, float, float, float]:
    """Point of the blended section at share ``s`` of interval ``k`` and the inward unit normal there: u, w, nu, nw."""
    u0, w0 = _node(radius, a, b, g, k)
    u1, w1 = _node(radius, a, b, g, k + 1)
    ub, wb = _node(radius, a, b, g, k - 1)
    ua, wa = _node(radius, a, b, g, k + 2)
    du0, dw0 = _unit(u1 - ub, w1 - wb)
    du1, dw1 = _unit(ua - u0, wa - w0)
    du, dw = _unit(du0 + s * (du1 - du0), dw0 + s * (dw1 - dw0))
    return u0 + s * (u1 - u0), w0 + s * (w1 - w0), dw, -du


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _longitudinal(radius: Float, chainages: Float, a: int, b: int, k: int, s: float, nu: float, nw: float) -> float:
    """Component along the axis of the surface normal, for sections that change with chainage (unnormalised)."""
    if a == b:
        return 0.0
    change = ((1.0 - s) * (radius[b, k] - radius[a, k]) + s * (radius[b, k + 1] - radius[a, k + 1])) / (
        chainages[b] - chainages[a]
    )
    # Sine and cosine of k + s degrees, from those of k and the first terms of their series for less than a degree.
    t = np.radians(s)
    sine, cosine = t * (1.0 - t * t / 6.0), 1.0 - t * t / 2.0 * (1.0 - t * t / 12.0)
    return -change * (nu * (_SIN[k] * cosine + _COS[k] * sine) + nw * (_COS[k] * cosine - _SIN[k] * sine))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def unroll_point(
    segments: Float,
    number: Int64,
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    x: float,
    y: float,
    z: float,
    near: Near,
) -> tuple[Near, float, float, float, float, float, float]:
    """Unroll one point.

    A point that is off the tunnel, looked for from another point on, has to be looked for again from NOWHERE on: not
    done here, for the code would be there twice, which costs a quarter of the speed.

    Parameters
    ----------
    segments, number, ends, chainages, radius, arcs, reach
        The surface, see :class:`tunneldb.geometry.surface.Surface`.
    x, y, z : float
        The point, m.
    near : (segment, section, degree)
        What this function returned for a point near by, or NOWHERE: it shortens the search and does not change what is
        found.

    Returns
    -------
    near : (segment, section, degree)
        For the next point; the segment is -1 when this one is off the tunnel.
    chainage, arc, offset : float
        m; NaN off the tunnel.
    nx, ny, nz : float
        Unit normal of the surface at the point's foot, into the tunnel.
    """
    off = (-1, near[1], near[2]), np.nan, np.nan, np.nan, np.nan, np.nan, np.nan
    k = near[0] if near[0] >= 0 else nearest_segment(segments, x, y, z)
    k, f = locate(segments, number, k, x, y, z)
    if k < 0:
        return off
    chainage = ends[k, 0] + f * (ends[k, 1] - ends[k, 0])
    a, b, g = bracket(chainages, chainage, reach, near[1])
    if a < 0:
        return off
    ox, oy, oz, tx, ty, tz, rx, ry = frame_of(segments, k, f)
    upx, upy, upz = ry * tz, -rx * tz, rx * ty - ry * tx
    u = (x - ox) * rx + (y - oy) * ry
    w = (x - ox) * upx + (y - oy) * upy + (z - oz) * upz
    degree = _degree(u, w, near[2])
    node, s, fu, fw, nu, nw = foot(radius, a, b, g, u, w, degree)
    offset = (u - fu) * nu + (w - fw) * nw
    if offset < -MAX_OUTSIDE:
        return off
    arc = (1.0 - g) * ((1.0 - s) * arcs[a, node] + s * arcs[a, node + 1]) + g * (
        (1.0 - s) * arcs[b, node] + s * arcs[b, node + 1]
    )
    nt = _longitudinal(radius, chainages, a, b, node, s, nu, nw)
    scale = 1.0 / np.sqrt(1.0 + nt * nt)
    return (
        (k, a, degree), chainage, arc, offset,
        (nu * rx + nw * upx + nt * tx) * scale, (nu * ry + nw * upy + nt * ty) * scale, (nw * upz + nt * tz) * scale,
    )  # fmt: skip


@njit(cache=True, nogil=True, parallel=True)
def to_plane_all(
    segments: Float,
    number: Int64,
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
        near = NOWHERE
        i, end = part * block, min(count, (part + 1) * block)
        while i < end:
            afresh = near[0] < 0
            near, chainage, arc, offset, nx, ny, nz = unroll_point(
                segments, number, ends, chainages, radius, arcs, reach, points[i, 0], points[i, 1], points[i, 2], near
            )
            if near[0] < 0 and not afresh:
                continue
            unrolled[i, 0], unrolled[i, 1], unrolled[i, 2] = chainage, arc, offset
            normals[i, 0], normals[i, 1], normals[i, 2] = nx, ny, nz
            i += 1
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
def to_space_all(
    segments: Float,
    which: Int64,
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
