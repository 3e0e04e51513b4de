"""Lines that a drawing of a tunnel is made of, from its surface: axis, chainage ticks, strip, profiles of sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from tunneldb.anomalies.geometries import to_map
from tunneldb.arrays import Bool, Float
from tunneldb.geometry.surface import Surface

STEP = 10.0
"""Distance of ticks, m of chainage."""

HUNDRED = 100.0
"""Distance of longer ticks with a chainage label, m."""

PIECES = 4
"""Length of straight pieces of the axis in a segment; on a radius of 300 m a piece of 2.5 m leaves the arc by 3 mm."""

TOLERANCE = 0.002
"""Maximum deviation of a drawn section, or an outline in space, from the original, m."""


@dataclass(frozen=True)
class Profile:
    """A cross-section as seen looking up-chainage.

    Attributes
    ----------
    chainage : float
        Its place, m.
    right, up : (n,) float arrays
        Vertices from straight below the axis over the left wall and the crown, m from the axis; not closed.
    """

    chainage: float
    right: Float
    up: Float


def stretches(surface: Surface, low: float, high: float) -> list[Float]:
    """Return the chainages of the axis vertices between two chainages (m), an array for each part without a gap."""
    parts: list[list[Float]] = []
    last = None
    for number, (first, second) in zip(surface.number.tolist(), surface.ends, strict=True):
        start, end = max(first, low), min(second, high)
        if start >= end:
            continue
        if last is None or number != last + 1:
            parts.append([])
        piece = np.linspace(start, end, PIECES + 1)
        parts[-1].append(piece)
        last = number
    return [np.unique(np.concatenate(part)) for part in parts]


def axis_line(surface: Surface, chainages: Float) -> Float:
    """Return points (n, 3) of the axis at chainages (n,), in the tunnel's SRID, m."""
    return np.asarray(surface.frames(chainages)[:, 0])


def tick_chainages(surface: Surface, low: float, high: float, step: float = STEP) -> Float:
    """Return whole multiples of ``step`` (m) between two chainages at which the tunnel has an axis."""
    low, high = max(low, surface.ends[0, 0]), min(high, surface.ends[-1, 1])
    chainages = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step
    return np.asarray(chainages[surface.segment_index(chainages) >= 0], dtype=np.float64)


def ticks(surface: Surface, chainages: Float) -> Float:
    """Return horizontal lines across the axis, (n, 2, 3), from left to right; longer at each hundred metres."""
    frames = surface.frames(chainages)
    half = np.where(is_hundred(chainages), 3.0, 1.0)
    across = frames[:, 2] * half[:, None]
    return np.stack([frames[:, 0] - across, frames[:, 0] + across], axis=1)


def is_hundred(chainages: Float) -> Bool:
    """Return True for chainages (m) at whole hundreds."""
    return np.asarray(np.abs(chainages / HUNDRED - np.round(chainages / HUNDRED)) < 1e-6)


def edges(surface: Surface, chainages: Float) -> tuple[Float, Float]:
    """Return the left and right edge of the unrolled lining, (n, 2) rows of chainage and arc, m, where sections exist."""
    arcs = np.column_stack(surface.arc_range(chainages))
    there = np.isfinite(arcs[:, 0])
    left, right = (np.column_stack([chainages, arcs[:, k]])[there] for k in (0, 1))
    return left, right


def outline(surface: Surface, chainages: Float) -> Polygon | None:
    """Return the unrolled lining along ``chainages`` as a polygon of chainage and arc, m; None without sections."""
    left, right = edges(surface, chainages)
    return Polygon(np.concatenate([left, right[::-1]])) if len(left) > 1 else None


def on_map(surface: Surface, unrolled: Float) -> Float:
    """Return places (n, 2) of the unrolled plane on the map beside the axis, in the tunnel's SRID."""
    return to_map(surface, np.asarray(unrolled, dtype=np.float64))


def profiles(surface: Surface, low: float, high: float) -> list[Profile]:
    """Return the sections between two chainages, simplified to the vertices that their form needs."""
    angle = np.radians(np.arange(-180.0, 181.0))
    inside = (surface.chainages >= low) & (surface.chainages <= high)
    found = []
    for chainage, radius in zip(surface.chainages[inside], surface.radius[inside], strict=True):
        line = LineString(np.column_stack([radius * np.sin(angle), radius * np.cos(angle)]))
        right, up = shapely.get_coordinates(shapely.simplify(line, TOLERANCE)).T
        found.append(Profile(float(chainage), right, up))
    return found


def plain_ring(ring: Float) -> Float:
    """Simplify an open ring in space (n, 3) within the tolerance (Douglas and Peucker)."""
    closed = np.concatenate([ring, ring[:1]])
    far = int(np.argmax(np.linalg.norm(closed - closed[0], axis=1)))
    kept = np.zeros(len(closed), dtype=bool)
    kept[[0, far, -1]] = True
    pieces = [(0, far), (far, len(closed) - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        along = closed[last] - closed[first]
        away = closed[first + 1 : last] - closed[first]
        share = np.clip(away @ along / max(along @ along, 1e-12), 0.0, 1.0)
        distance = np.linalg.norm(away - share[:, None] * along, axis=1)
        if distance.max() > TOLERANCE:
            middle = first + 1 + int(distance.argmax())
            kept[middle] = True
            pieces += [(first, middle), (middle, last)]
    return np.asarray(closed[:-1][kept[:-1]])


def in_space(surface: Surface, profile: Profile) -> Float:
    """Return the vertices (n, 3) of a profile in the tunnel's SRID, m."""
    origin, _, right, up = surface.frames(np.array([profile.chainage]))[0]
    return np.asarray(origin + profile.right[:, None] * right + profile.up[:, None] * up)


def wet_parts(surface: Surface, chainage: float, outlines: Sequence[Polygon]) -> list[Float]:
    """Return outlines (chainage, arc) on the section at a chainage: lines (n, 2) right of and above the axis, m."""
    k = int(np.argmin(np.abs(surface.chainages - chainage)))
    arcs, radius = surface.arcs[k], surface.radius[k]
    cut = LineString([(chainage, arcs[0] - 1.0), (chainage, arcs[-1] + 1.0)])
    angle = np.radians(np.arange(-180.0, 181.0))
    nodes = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    found = []
    for part in shapely.get_parts(shapely.intersection(np.array(outlines, dtype=object), cut)):
        ends = shapely.get_coordinates(part)[:, 1]
        if len(ends) > 1:
            at = np.unique(np.concatenate([[ends.min(), ends.max()], arcs[(arcs > ends.min()) & (arcs < ends.max())]]))
            found.append(np.column_stack([np.interp(at, arcs, nodes[:, axis]) for axis in (0, 1)]))
    return found
