"""Ray casting from a station: each ray is tested with the surfaces in its part of the view.

The view is divided into tiles of azimuth and zenith; a tile lists the surfaces whose covering balls are visible in it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int32, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.structure.shapes import hulls
from tunneldb.threads import in_blocks

TILE = math.radians(1.0)
MARGIN = math.radians(0.1)  # more than a beam's half width
_STEPS = 64  # steps of sphere tracing for a bend
_TOLERANCE = 2e-6  # m


class View(NamedTuple):
    """Possible view of a station: tiles from ``low`` (azimuth, zenith, rad) on, and the surfaces listed in each."""

    low: Float
    columns: int
    lines: int
    begin: Int64
    list: Int64


def view(rows: Float, station: Float) -> View:
    """Sort surfaces (n, 17) into the tiles of a station's view."""
    spans = []
    for number, row in enumerate(rows):
        ball = hulls(row)
        away = ball[:, :3] - station
        distance = np.maximum(np.linalg.norm(away, axis=1), 1e-6)
        half = np.where(distance > ball[:, 3], np.arcsin(np.minimum(ball[:, 3] / distance, 1.0)), math.pi) + MARGIN
        zenith = np.arccos(away[:, 2] / distance)
        azimuth = np.arctan2(away[:, 0], away[:, 1])
        sine = np.sin(zenith)
        wide = np.where(sine > np.sin(np.minimum(half, 1.5)), np.arcsin(np.clip(np.sin(half) / sine, 0.0, 1.0)), math.pi)
        spans.append(
            np.column_stack([azimuth - wide, azimuth + wide, zenith - half, zenith + half, np.full(len(ball), number)])
        )
    span = np.vstack(spans)
    span[:, :2] = np.clip(span[:, :2], -math.pi, math.pi)
    span[:, 2:4] = np.clip(span[:, 2:4], 0.0, math.pi)
    low = np.array([span[:, 0].min(), span[:, 2].min()])
    columns = int((span[:, 1].max() - low[0]) / TILE) + 1
    lines = int((span[:, 3].max() - low[1]) / TILE) + 1
    pairs = []
    for first, last, top, bottom, number in span:
        column = np.arange(int((first - low[0]) / TILE), int((last - low[0]) / TILE) + 1)
        line = np.arange(int((top - low[1]) / TILE), int((bottom - low[1]) / TILE) + 1)
        pairs.append(((column[:, None] * lines + line).ravel() * len(rows)) + int(number))
    keys = np.unique(np.concatenate(pairs))
    tile = keys // len(rows)
    begin = np.searchsorted(tile, np.arange(columns * lines + 1))
    return View(low, columns, lines, begin.astype(np.int64), (keys % len(rows)).astype(np.int64))


@inner
def _bend(x: float, y: float, z: float, dx: float, dy: float, dz: float, major: float, minor: float, angle: float) -> float:
    """Return the range to a bend from (x, y, z) in its frame (1e300: missed), by sphere tracing of its arc (Hart, 1996)."""
    reach = major + minor
    b = x * dx + y * dy + z * dz
    root = b * b - (x * x + y * y + z * z - reach * reach)
    if root < 0.0:
        return 1e300
    root = math.sqrt(root)
    t = max(-b - root, 0.0)
    for _ in range(_STEPS):
        px, py, pz = x + t * dx, y + t * dy, z + t * dz
        ring = math.hypot(px, py) - major
        gap = math.sqrt(ring * ring + pz * pz) - minor
        if gap < _TOLERANCE:
            at = math.atan2(py, px)
            if 0.0 <= at <= angle:
                return t
            gap = max(minor, 1e-3)  # on the missing part of the torus
        t += gap
        if t > -b + root:
            break
    return 1e300


@inner
def _hit(rows: Float, k: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    """Return the range to a surface (1e300: missed)."""
    wx, wy, wz = ox - rows[k, 1], oy - rows[k, 2], oz - rows[k, 3]
    x = wx * rows[k, 4] + wy * rows[k, 5] + wz * rows[k, 6]
    y = wx * rows[k, 7] + wy * rows[k, 8] + wz * rows[k, 9]
    z = wx * rows[k, 10] + wy * rows[k, 11] + wz * rows[k, 12]
    a = dx * rows[k, 4] + dy * rows[k, 5] + dz * rows[k, 6]
    b = dx * rows[k, 7] + dy * rows[k, 8] + dz * rows[k, 9]
    c = dx * rows[k, 10] + dy * rows[k, 11] + dz * rows[k, 12]
    kind = rows[k, 0]
    if kind == 1.0:
        square = a * a + b * b
        if square < 1e-12:
            return 1e300
        half = x * a + y * b
        root = half * half - square * (x * x + y * y - rows[k, 13] * rows[k, 13])
        if root < 0.0:
            return 1e300
        root = math.sqrt(root)
        for sign in (-1.0, 1.0):  # from outside, or through an open end from inside
            t = (-half + sign * root) / square
            if t > 0.0 and 0.0 <= z + t * c <= rows[k, 14]:
                return t
        return 1e300
    if kind == 3.0:
        return _bend(x, y, z, a, b, c, rows[k, 13], rows[k, 14], rows[k, 15])
    if abs(c) < 1e-9:
        return 1e300
    t = -z / c
    u, v = x + t * a, y + t * b
    if kind == 0.0:
        inside = abs(u) <= rows[k, 13] and abs(v) <= rows[k, 14]
    else:
        square = u * u + v * v
        inside = rows[k, 13] * rows[k, 13] <= square <= rows[k, 14] * rows[k, 14]
    return t if inside and t > 0.0 else 1e300


@kernel
def _cast(
    rows: Float, begin: Int64, listed: Int64, origin: Float, direction: Float, tile: Int64, distance: Float, which: Int32
) -> None:
    for i in range(direction.shape[0]):
        best, number = 1e299, -1
        for j in range(begin[tile[i]], begin[tile[i] + 1]):
            k = listed[j]
            t = _hit(rows, k, origin[0], origin[1], origin[2], direction[i, 0], direction[i, 1], direction[i, 2])
            if t < best:
                best, number = t, k
        distance[i], which[i] = best, number


def cast(rows: Float, seen: View, station: Float, direction: Float) -> tuple[Float, Int32]:
    """Return range (n,) m (inf: none) and surface (n,) (-1: none) of the first hits of unit rays (n, 3) of a station."""
    azimuth = np.arctan2(direction[:, 0], direction[:, 1])
    zenith = np.arccos(np.clip(direction[:, 2], -1.0, 1.0))
    column = np.clip(((azimuth - seen.low[0]) / TILE).astype(np.int64), 0, seen.columns - 1)
    line = np.clip(((zenith - seen.low[1]) / TILE).astype(np.int64), 0, seen.lines - 1)
    tile = column * seen.lines + line
    distance, which = np.empty(len(direction)), np.empty(len(direction), dtype=np.int32)

    def block(first: int, last: int) -> None:
        part = slice(first, last)
        _cast(rows, seen.begin, seen.list, station, direction[part], tile[part], distance[part], which[part])

    in_blocks(block, len(direction), 1 << 16)
    distance[which < 0] = np.inf
    return distance, which
