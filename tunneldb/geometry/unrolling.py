"""Unrolling of points and its inverse (Gonçalves et al., 2012, stage 5); the same steps as ``sql/geometry/unroll.sql``.

A section is a closed curve of 361 nodes, one per degree from -180° to 180°, each at ``radius`` from the axis and with
``arc``, its length along the section from the crown. Between two sections the nodes and arcs are interpolated linearly
in chainage, so the surface is continuous along the whole tunnel; interpolated arcs are the weighted average of eq. 1.
Along a section the normal is also interpolated between the nodes, so each point near the surface has exactly one foot, and
the inverse is exact.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int64, Intp, Single
from tunneldb.compiled import point_inner, point_kernel
from tunneldb.geometry.frame import frame_of, frames_at, locate, nearest_segment

NODES = 361
CROWN = 180
MAX_OUTSIDE = 3.0
"""Distance outside the surface above which a point is off the tunnel, m (a refuge niche is up to 2-3 m deep)."""

_STEPS = 180
_RADIAN = np.pi / 180.0
_SIN = np.sin(np.radians(np.arange(NODES) - 180.0))
_COS = np.cos(np.radians(np.arange(NODES) - 180.0))


def sections_about(chainages: Float, chainage: Float, reach: float) -> tuple[Intp, Intp, Float]:
    """Return the sections before and after places along the axis, and the weight of the second.

    Two sections bound a stretch if at most ``reach`` apart; the surface extends beyond the last one by half of that.

    Parameters
    ----------
    chainages : (k,) float array
        Chainages of the sections, ascending, m.
    chainage : (n,) float array
        Chainages of the places, m.
    reach : float
        Greatest distance between sections, m.

    Returns
    -------
    before, after : (n,) int arrays
        Indices of sections; -1 if none is near.
    weight : (n,) float array
        Weight of the section after the place, 0 to 1.
    """
    count = len(chainages)
    if count == 0:
        nowhere = np.full(np.shape(chainage), -1)
        return nowhere, nowhere, np.zeros(nowhere.shape)
    before = np.searchsorted(chainages, chainage, side="right") - 1
    after = before + 1
    first, second = chainages[np.maximum(before, 0)], chainages[np.minimum(after, count - 1)]
    gap = second - first
    with np.errstate(divide="ignore", invalid="ignore"):
        between = (before >= 0) & (after < count) & (gap <= reach)
        behind = ~between & (before >= 0) & (chainage - first <= reach / 2)
        ahead = ~between & ~behind & (after < count) & (second - chainage <= reach / 2)
        weight = np.where(between, (chainage - first) / gap, 0.0)
    nearest = np.where(behind, before, np.where(ahead, after, -1))
    return np.where(between, before, nearest), np.where(between, after, nearest), weight


@point_inner
def _sections_about(
    chainages: Float, chainage: float, reach: float, hint: int
) -> tuple[int, int, float]:  # pragma: no cover - compiled
    """Return the result of :func:`sections_about` for one place; ``hint`` is the first guess for the section before."""
    count = chainages.shape[0]
    if 0 <= hint < count - 1 and chainages[hint] <= chainage < chainages[hint + 1]:
        before = hint
    else:
        low, high = 0, count
        while low < high:
            middle = (low + high) >> 1
            if chainages[middle] <= chainage:
                low = middle + 1
            else:
                high = middle
        before = low - 1
    after = before + 1
    if before >= 0 and after < count:
        gap = chainages[after] - chainages[before]
        if gap <= reach:
            return before, after, (chainage - chainages[before]) / gap
    if before >= 0 and chainage - chainages[before] <= reach / 2:
        return before, before, 0.0
    if after < count and chainages[after] - chainage <= reach / 2:
        return after, after, 0.0
    return -1, -1, 0.0


@point_inner
def _node(radius: Float, a: int, b: int, g: float, k: int) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return node ``k`` (-1 to 361, modulo the circle) of the interpolated section: right and up, m."""
    if k < 0:
        k += 360
    elif k >= 360:
        k -= 360
    r = (1.0 - g) * radius[a, k] + g * radius[b, k]
    return r * _SIN[k], r * _COS[k]


@point_inner
def _degree(u: float, w: float, hint: int) -> int:  # pragma: no cover - compiled
    """Return the interval (its first node, 0-359) whose angles contain the direction of (u, w), searched from a hint on."""
    k = hint
    for _ in range(4):
        if u * _COS[k] - w * _SIN[k] < 0.0:
            k = k - 1 if k > 0 else 359
        elif u * _COS[k + 1] - w * _SIN[k + 1] >= 0.0:
            k = k + 1 if k < 359 else 0
        else:
            return k
    return int(np.floor(np.degrees(np.arctan2(u, w)) + 180.0)) % 360


@point_inner
def _foot(
    radius: Float, a: int, b: int, g: float, u: float, w: float, k: int
) -> tuple[int, float, float, float, float, float]:  # pragma: no cover - compiled
    """Find the place on the interpolated section whose normal passes through (u, w), searching from interval ``k`` on.

    Return the interval (its first node, 0-359), the fraction of it, the point (u, w) and the inward unit normal there.
    """
    u0, w0 = _node(radius, a, b, g, k)
    u1, w1 = _node(radius, a, b, g, k + 1)
    ub, wb = _node(radius, a, b, g, k - 1)
    ua, wa = _node(radius, a, b, g, k + 2)
    # Distance of (u, w) ahead of the interval's nodes along the section's direction; only the signs matter here.
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
    # Directions of the section at the two nodes, d and d + e, and the share s with (q - s b) · (d + s e) = 0.
    bu, bw = u1 - u0, w1 - w0
    du, dw = u1 - ub, w1 - wb
    length = 1.0 / np.sqrt(du * du + dw * dw)
    du, dw = du * length, dw * length
    eu, ew = ua - u0, wa - w0
    length = 1.0 / np.sqrt(eu * eu + ew * ew)
    eu, ew = eu * length - du, ew * length - dw
    qu, qw = u - u0, w - w0
    c0 = qu * du + qw * dw
    c1 = qu * eu + qw * ew - bu * du - bw * dw
    c2 = -(bu * eu + bw * ew)
    root = c1 * c1 - 4.0 * c0 * c2
    if here >= 0.0 and following < 0.0 and c1 < 0.0 and root >= 0.0:
        s = 2.0 * c0 / (np.sqrt(root) - c1)
    else:
        # Far from the surface there may be no root: Newton's method then stops at an end.
        s = 0.5
        for _ in range(6):
            slope = c1 + 2.0 * c2 * s
            if slope == 0.0:
                break
            s -= (c0 + s * (c1 + s * c2)) / slope
    s = 0.0 if s < 0.0 else (1.0 if s > 1.0 else s)
    du, dw = du + s * eu, dw + s * ew
    length = 1.0 / np.sqrt(du * du + dw * dw)
    return k, s, u0 + s * bu, w0 + s * bw, dw * length, -(du * length)


@point_kernel
def to_plane(
    segments: Float,
    number: Int64,
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    low: Float,
    high: Float,
    points: Float,
    unrolled: Float,
    normals: Float,
) -> None:  # pragma: no cover - compiled
    """Unroll a block of points.

    The previous point's result (segment, section, degree) only speeds up the search for the next point; it does not change
    the result.

    Parameters
    ----------
    segments, number, ends, chainages, radius, arcs, reach
        The surface, see :class:`tunneldb.geometry.surface.Surface`.
    low, high : (3,) float arrays
        Points outside this box count as off the tunnel, m.
    points : (n, 3) float array
        Points, m.
    unrolled, normals : (n, 3) float arrays
        Overwritten: chainage, arc and offset, m, and the unit normal of the surface at the point's foot, into the tunnel;
        NaN off the tunnel.
    """
    k, section, degree = np.int64(-1), np.int64(-1), np.int64(0)  # not literals: called functions would compile twice
    i = 0
    while i < points.shape[0]:
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if x < low[0] or x > high[0] or y < low[1] or y > high[1] or z < low[2] or z > high[2]:
            for axis in range(3):
                unrolled[i, axis] = normals[i, axis] = np.nan
            i += 1
            continue
        afresh = k < 0
        if afresh:
            k = nearest_segment(segments, x, y, z)
        k, f = locate(segments, number, k, x, y, z)
        found = False
        if k >= 0:
            chainage = ends[k, 0] + f * (ends[k, 1] - ends[k, 0])
            a, b, g = _sections_about(chainages, chainage, reach, section)
            if a >= 0:
                ox, oy, oz, tx, ty, tz, rx, ry = frame_of(segments, k, f)
                upx, upy, upz = ry * tz, -rx * tz, rx * ty - ry * tx
                u = (x - ox) * rx + (y - oy) * ry
                w = (x - ox) * upx + (y - oy) * upy + (z - oz) * upz
                degree_here = _degree(u, w, degree)
                node, s, fu, fw, nu, nw = _foot(radius, a, b, g, u, w, degree_here)
                offset = (u - fu) * nu + (w - fw) * nw
                if not offset < -MAX_OUTSIDE:
                    found = True
                    section, degree = a, degree_here
                    unrolled[i, 0] = chainage
                    unrolled[i, 1] = (1.0 - g) * ((1.0 - s) * arcs[a, node] + s * arcs[a, node + 1]) + g * (
                        (1.0 - s) * arcs[b, node] + s * arcs[b, node + 1]
                    )
                    unrolled[i, 2] = offset
                    # Component of the normal along the axis, for sections that change with chainage.
                    nt = 0.0
                    if a != b:
                        change = (
                            (1.0 - s) * (radius[b, node] - radius[a, node]) + s * (radius[b, node + 1] - radius[a, node + 1])
                        ) / (chainages[b] - chainages[a])
                        # Sine and cosine of node + s degrees, from those of the node and the first terms of their series.
                        t = s * _RADIAN
                        sine, cosine = t * (1.0 - t * t / 6.0), 1.0 - t * t / 2.0 * (1.0 - t * t / 12.0)
                        nt = -change * (
                            nu * (_SIN[node] * cosine + _COS[node] * sine) + nw * (_COS[node] * cosine - _SIN[node] * sine)
                        )
                    scale = 1.0 / np.sqrt(1.0 + nt * nt)
                    normals[i, 0] = (nu * rx + nw * upx + nt * tx) * scale
                    normals[i, 1] = (nu * ry + nw * upy + nt * ty) * scale
                    normals[i, 2] = (nw * upz + nt * tz) * scale
        if not found:
            k = np.int64(-1)
            if not afresh:
                continue  # the same point again, with a search over all segments
            for axis in range(3):
                unrolled[i, axis] = normals[i, axis] = np.nan
        i += 1


@point_kernel
def section_points(
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    chainage: Float,
    arc: Float,
    offset: Single,
    right: Float,
    up: Float,
) -> None:  # pragma: no cover - compiled
    """Return positions of pixels in the planes of their columns; the same steps as `to_space`.

    Parameters
    ----------
    chainages, radius, arcs, reach
        The surface, see :class:`tunneldb.geometry.surface.Surface`.
    chainage : (c,) float array
        Chainages of the columns, m.
    arc : (r,) float array
        Arcs of the rows, m.
    offset : (r, c) float32 array
        Offset from the surface, m.
    right, up : (c, r) float arrays
        Overwritten: position relative to the axis, m; NaN without an offset or off the surface.
    """
    section, node = np.int64(-1), np.int64(0)
    for j in range(chainage.shape[0]):
        a, b, g = _sections_about(chainages, chainage[j], reach, section)
        section = a
        for i in range(arc.shape[0]):
            right[j, i] = up[j, i] = np.nan
            at = arc[i]
            if a < 0 or not np.isfinite(offset[i, j]):
                continue
            while node > 0 and (1.0 - g) * arcs[a, node] + g * arcs[b, node] > at:
                node -= 1
            while node < NODES - 2 and (1.0 - g) * arcs[a, node + 1] + g * arcs[b, node + 1] <= at:
                node += 1
            first = (1.0 - g) * arcs[a, node] + g * arcs[b, node]
            last = (1.0 - g) * arcs[a, node + 1] + g * arcs[b, node + 1]
            if at < first - 1e-6 or at > last + 1e-6:
                continue
            s = (at - first) / (last - first)
            u0, w0 = _node(radius, a, b, g, node)
            u1, w1 = _node(radius, a, b, g, node + 1)
            ub, wb = _node(radius, a, b, g, node - 1)
            ua, wa = _node(radius, a, b, g, node + 2)
            length = 1.0 / np.sqrt((u1 - ub) ** 2 + (w1 - wb) ** 2)
            du, dw = (u1 - ub) * length, (w1 - wb) * length
            length = 1.0 / np.sqrt((ua - u0) ** 2 + (wa - w0) ** 2)
            du, dw = du + s * ((ua - u0) * length - du), dw + s * ((wa - w0) * length - dw)
            length = 1.0 / np.sqrt(du * du + dw * dw)
            right[j, i] = u0 + s * (u1 - u0) + offset[i, j] * dw * length
            up[j, i] = w0 + s * (w1 - w0) - offset[i, j] * du * length


def to_space(
    segments: Float,
    which: Intp | Int64,
    ends: Float,
    chainages: Float,
    radius: Float,
    arcs: Float,
    reach: float,
    unrolled: Float,
) -> Float:
    """Return points (n, 3) of (chainage, arc, offset) rows (n, 3), each in the segment ``which``; NaN off the tunnel (-1)."""
    points = np.full((len(unrolled), 3), np.nan)
    a, b, g = sections_about(chainages, unrolled[:, 0], reach)
    inside = np.flatnonzero((which >= 0) & (a >= 0))
    chainage, arc, offset = unrolled[inside].T
    k, a, b, g = which[inside], a[inside], b[inside], g[inside]
    h = 1.0 - g
    on_section = ~(arc < h * arcs[a, 0] + g * arcs[b, 0] - 1e-6) & ~(arc > h * arcs[a, -1] + g * arcs[b, -1] + 1e-6)
    if not on_section.all():
        inside, chainage, arc, offset = inside[on_section], chainage[on_section], arc[on_section], offset[on_section]
        k, a, b, g, h = k[on_section], a[on_section], b[on_section], g[on_section], h[on_section]
    low, high = np.zeros(len(arc), np.intp), np.full(len(arc), NODES - 1)
    for _ in range(int(NODES - 1).bit_length()):
        middle = (low + high) >> 1
        within = h * arcs[a, middle] + g * arcs[b, middle] <= arc
        within |= middle == 0
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    first = h * arcs[a, low] + g * arcs[b, low]
    s = (arc - first) / (h * arcs[a, low + 1] + g * arcs[b, low + 1] - first)
    (u0, w0), (u1, w1), (ub, wb), (ua, wa) = (_nodes(radius, a, b, g, low + step) for step in (0, 1, -1, 2))
    du, dw = _unit(u1 - ub, w1 - wb)
    eu, ew = _unit(ua - u0, wa - w0)
    du, dw = _unit(du + s * (eu - du), dw + s * (ew - dw))
    u = u0 + s * (u1 - u0) + offset * dw
    w = w0 + s * (w1 - w0) - offset * du
    frame = frames_at(segments, k, (chainage - ends[k, 0]) / (ends[k, 1] - ends[k, 0]))
    points[inside] = frame[:, 0] + u[:, None] * frame[:, 2] + w[:, None] * frame[:, 3]
    return points


def _nodes(radius: Float, a: Intp, b: Intp, g: Float, k: Intp) -> tuple[Float, Float]:
    """Return nodes (n,) of interpolated sections, modulo the circle: right and up, m."""
    k = k % 360
    r = (1.0 - g) * radius[a, k] + g * radius[b, k]
    return r * _SIN[k], r * _COS[k]


def _unit(u: Float, w: Float) -> tuple[Float, Float]:
    length = 1.0 / np.sqrt(u * u + w * w)
    return u * length, w * length
