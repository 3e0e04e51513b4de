"""Free-standing objects made of balls, rods and bricks: people, equipment, target spheres, loose cables.

A ball is a sphere, a rod a straight tube with round ends, a brick an oriented box. They are defined in space, not in the
frame of the tunnel, so that a sphere is also a sphere in a curve. Rays hit them by closed formulas.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.objects.fixtures import bin_of, bins
from tunneldb.simulate.tunnel.tunnel import Tunnel

BALL, ROD, BRICK = 0.0, 1.0, 2.0
# Columns of a part: kind; then
#   ball:  centre (1:4), radius (7)
#   rod:   one end (1:4), other end (4:7), radius (7)
#   brick: centre (1:4), half sizes (4:7), unit axes (8:17)
COLUMNS = 17
# Half the width of the beam, m: closer to the outline, part of the beam passes.
BEAM = 0.004


def ball(centre: Float, radius: float) -> Float:
    """Return a part that is a sphere; coordinates and radius, m."""
    row = np.zeros(COLUMNS)
    row[0], row[1:4], row[7] = BALL, centre, radius
    return row


def rod(one: Float, other: Float, radius: float) -> Float:
    """Return a part that is a tube with round ends from ``one`` to ``other``, m."""
    row = np.zeros(COLUMNS)
    row[0], row[1:4], row[4:7], row[7] = ROD, one, other, radius
    return row


def brick(centre: Float, size: Sequence[float], axes: Float) -> Float:
    """Return a part that is a box of full ``size`` (3) along unit ``axes`` (3, 3; one per row), m."""
    row = np.zeros(COLUMNS)
    row[0], row[1:4], row[4:7], row[8:] = BRICK, centre, 0.5 * np.asarray(size), np.ravel(axes)
    return row


@dataclass(frozen=True)
class Primitive:
    """Object that stands or hangs free.

    Attributes
    ----------
    kind : str
        person, case, trolley, tripod, bollard, globe, sphere, bracket, cable, catenary, sleeper.
    klass : int
        Class of its points.
    drop : float
        Darkening relative to the lining, dB.
    parts : (n, 17) array
        Balls, rods and bricks in coordinates of the tunnel.
    number : int
        Number of the object in the reference data, from 1; 0: none.
    """

    kind: str
    klass: int
    drop: float
    parts: Float
    number: int = 0

    def extent(self) -> tuple[Float, Float]:
        """Return centres (n, 3) and radii (n,) of balls around its parts."""
        p = self.parts
        is_rod = p[:, :1] == ROD
        middle = np.where(is_rod, 0.5 * (p[:, 1:4] + p[:, 4:7]), p[:, 1:4])
        half = np.linalg.norm(np.where(is_rod, 0.5 * (p[:, 4:7] - p[:, 1:4]), p[:, 4:7]), axis=1)
        return middle, half + p[:, 7]

    def middle(self) -> Float:
        """Return the centre of the box around it, (3,)."""
        middle, radius = self.extent()
        low, high = (middle - radius[:, None]).min(axis=0), (middle + radius[:, None]).max(axis=0)
        return np.asarray(0.5 * (low + high))


@dataclass(frozen=True)
class TargetSphere:
    """Target sphere: number of its points in the reference data, centre (3,), radius, m, and kind of support."""

    id: int
    centre: Float
    radius: float
    kind: str


class Parts(NamedTuple):
    """Parts of all objects for the kernels, relative to the line's origin, listed by chainage."""

    rows: Float
    hulls: Float  # middle (3) and radius of a ball around each part
    labels: Float  # class, drop, number of each part
    bins: Int64
    list: Int64


def parts_table(tunnel: Tunnel, things: Sequence[Primitive]) -> Parts:
    """Arrange the parts of objects for the kernels."""
    line = tunnel.line
    rows = np.vstack([np.empty((0, COLUMNS)), *(t.parts for t in things)])
    hulls = np.empty((len(rows), 4))
    labels = np.empty((len(rows), 3))
    first = 0
    for thing in things:
        middle, radius = thing.extent()
        last = first + len(middle)
        hulls[first:last, :3], hulls[first:last, 3] = middle - line.origin, radius
        labels[first:last] = thing.klass, thing.drop, thing.number
        first = last
    rows[:, 1:4] -= line.origin
    rows[:, 4:7] -= np.where(rows[:, :1] == ROD, line.origin, 0.0)
    s = tunnel.unroll(hulls[:, :3] + line.origin).chainage if len(rows) else np.empty(0)
    return Parts(rows, hulls, labels, *bins(s - hulls[:, 3], s + hulls[:, 3], line.start, line.end))


@inner
def _intersect_ball(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, radius: float) -> tuple[float, float]:
    """Return range to a sphere about 0 from (ox, oy, oz) (1e300: missed), and distance of the ray inside its outline."""
    b = ox * dx + oy * dy + oz * dz
    past = ox * ox + oy * oy + oz * oz - b * b
    root = radius * radius - past
    if root < 0.0:
        return 1e300, 0.0
    return -b - math.sqrt(root), radius - math.sqrt(max(past, 0.0))


@inner
def _intersect_rod(
    rows: Float, k: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float
) -> tuple[float, float, float]:
    """Return range to a rod (1e300: missed), distance inside its outline, cosine there."""
    radius = rows[k, 7]
    bx, by, bz = rows[k, 4] - rows[k, 1], rows[k, 5] - rows[k, 2], rows[k, 6] - rows[k, 3]
    ax, ay, az = ox - rows[k, 1], oy - rows[k, 2], oz - rows[k, 3]
    length2 = bx * bx + by * by + bz * bz
    bd = bx * dx + by * dy + bz * dz
    ba = bx * ax + by * ay + bz * az
    best = 1e300
    inside = 0.0
    share = 0.0
    # The tube: the ray's distance to its axis, both seen along the axis.
    a = length2 - bd * bd
    if a > 1e-12 * length2:
        da = dx * ax + dy * ay + dz * az
        b = length2 * da - ba * bd
        c = length2 * (ax * ax + ay * ay + az * az - radius * radius) - ba * ba
        root = b * b - a * c
        if root > 0.0:
            t = (-b - math.sqrt(root)) / a
            y = (ba + t * bd) / length2
            if 0.0 <= y <= 1.0:
                best = t
                share = y
                inside = radius - math.sqrt(max(radius * radius - root / (a * length2), 0.0))
    for end in range(2):
        t, gap = _intersect_ball(ax - end * bx, ay - end * by, az - end * bz, dx, dy, dz, radius)
        if t < best:
            best = t
            share = float(end)
            inside = gap
    if best > 1e299:
        return best, 0.0, 0.0
    nx = (ax + best * dx - share * bx) / radius
    ny = (ay + best * dy - share * by) / radius
    nz = (az + best * dz - share * bz) / radius
    return best, inside, -(nx * dx + ny * dy + nz * dz)


@inner
def _intersect_brick(
    rows: Float, k: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float
) -> tuple[float, float, float]:
    """Return range to a brick (1e300: missed), distance inside its outline, cosine there."""
    enter = -1e300
    leave = 1e300
    cosine = 0.0
    for axis in range(3):
        first = 8 + 3 * axis
        ex, ey, ez = rows[k, first], rows[k, first + 1], rows[k, first + 2]
        at = (ox - rows[k, 1]) * ex + (oy - rows[k, 2]) * ey + (oz - rows[k, 3]) * ez
        rate = dx * ex + dy * ey + dz * ez
        half = rows[k, 4 + axis]
        if abs(rate) < 1e-12:
            if abs(at) > half:
                return 1e300, 0.0, 0.0
            continue
        near, far = (-half - at) / rate, (half - at) / rate
        if near > far:
            near, far = far, near
        if near > enter:
            enter = near
            cosine = abs(rate)
        leave = min(leave, far)
    if enter > leave:
        return 1e300, 0.0, 0.0
    # Near the outline a ray is only slightly inside it.
    return enter, 0.5 * (leave - enter), cosine


@kernel
def intersect_parts(
    parts: Parts, start: float, origin: Float, direction: Float, found: Float, r: Float, which: Int64, inside: Float
) -> None:
    """Find the first part that rays (n, 3) hit before anything else.

    Parameters
    ----------
    start : float
        Chainage of the tunnel's start, m.
    found : (6, n)
        Hits of the rays without parts, rows as of :func:`intersect_lining`; the cosine is replaced.
    r : (n,)
        Range to the hit, replaced.
    which : (n,)
        Index of the part; unchanged if none is hit.
    inside : (n,)
        Distance of the ray inside the part's outline, m; unchanged if none is hit.
    """
    for i in range(origin.shape[0]):
        if found[4, i] <= 0.0:
            continue
        ox, oy, oz = origin[i, 0], origin[i, 1], origin[i, 2]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        one, other = bin_of(found[5, i], start, parts.bins), bin_of(found[1, i], start, parts.bins)
        step = 1 if other >= one else -1
        for b in range(one, other + step, step):
            for j in range(parts.bins[b], parts.bins[b + 1]):
                k = parts.list[j]
                x, y, z = ox - parts.hulls[k, 0], oy - parts.hulls[k, 1], oz - parts.hulls[k, 2]
                along = x * dx + y * dy + z * dz
                radius = parts.hulls[k, 3]
                if x * x + y * y + z * z - along * along > radius * radius or -along - radius > r[i] or along > radius:
                    continue
                if parts.rows[k, 0] == BALL:
                    radius = parts.rows[k, 7]
                    t, gap = _intersect_ball(x, y, z, dx, dy, dz, radius)
                    share = (radius - gap) / radius
                    c = math.sqrt(max(0.0, 1.0 - share * share))
                elif parts.rows[k, 0] == ROD:
                    t, gap, c = _intersect_rod(parts.rows, k, ox, oy, oz, dx, dy, dz)
                else:
                    t, gap, c = _intersect_brick(parts.rows, k, ox, oy, oz, dx, dy, dz)
                if 0.0 < t < r[i]:
                    r[i], which[i], found[3, i], inside[i] = t, k, c, gap
