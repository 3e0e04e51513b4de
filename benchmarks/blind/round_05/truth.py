"""Outlines of what an inspector would draw, on the lining and without what is hidden."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely
from scipy import ndimage
from shapely import unary_union
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry import box as rectangle
from shapely.geometry.base import BaseGeometry

from .geometry import Array
from .objects import cover
from .tunnel import Leak, Tunnel

GRID = 0.02
NARROW = 0.15
SMALLEST = 0.02
SEEN_COSINE = 0.3
SEEN_RANGE = 14.0
Views = Callable[[Array, Array], list[Array]]


def seen_from(t: Tunnel, stations: Array) -> Views:
    """Origins of all tripods for each point of the lining."""

    def views(c: Array, u: Array) -> list[Array]:
        return [np.repeat(t.axis.to_frame(*(np.array([v]) for v in place)), len(c), axis=0) for place in stations]

    return views


def seen_passing(t: Tunnel, u: float, w: float, yaw: float) -> Views:
    """Origin of the profiler when its plane passes each point of the lining."""

    def views(c: Array, across: Array) -> list[Array]:
        return [t.axis.to_frame(c + np.tan(yaw) * (across - u), np.full(len(c), u), np.full(len(c), w))]

    return views


def hidden(t: Tunnel, shape: BaseGeometry, views: Views) -> BaseGeometry:
    """What about an outline no beam reaches, but at grazing incidence or from far; narrow strips left out."""
    c0, s0, c1, s1 = shape.bounds
    cs = np.arange(c0 - 0.3, c1 + 0.3, GRID)
    ss = np.arange(s0 - 0.3, s1 + 0.3, GRID)
    cc, ss2 = (a.ravel() for a in np.meshgrid(cs, ss))
    u, w = t.section.at(ss2)
    nu, nw = t.section.inward(ss2)
    frame = t.axis.to_frame(cc, u, w)
    dark = np.ones(len(cc), bool)
    for origin in views(cc, u):
        ray = frame - origin
        length = np.linalg.norm(ray, axis=1)
        local = t.axis.direction(cc, ray / length[:, None])
        front = cover(t.things, np.stack([cc, u, w], axis=1), local, length, np.full(len(cc), 1e-3), t.rng)
        facing = -(local[:, 1] * nu + local[:, 2] * nw) > SEEN_COSINE
        dark &= ~((front.share < 0.5) & (length < SEEN_RANGE) & facing)
    reach = int(np.ceil(NARROW / 2 / GRID))
    y, x = np.ogrid[-reach : reach + 1, -reach : reach + 1]
    disc = x**2 + y**2 <= (NARROW / 2 / GRID) ** 2
    wide = ndimage.binary_opening(dark.reshape(len(ss), len(cs)), disc)
    cells = []
    for j in np.flatnonzero(wide.any(axis=0)):
        edges = np.flatnonzero(np.diff(np.pad(wide[:, j].astype(np.int8), 1)))
        h = GRID / 2
        cells += [
            rectangle(cs[j] - h, ss[a] - h, cs[j] + h, ss[b - 1] + h) for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]
    return unary_union(cells).buffer(0.002).simplify(0.012)


def outlines(t: Tunnel, views: Views) -> list[tuple[BaseGeometry, dict[str, object]]]:
    """Leaks that water joins as one, without what is hidden, with their properties."""
    whole = unary_union([leak.shape for leak in t.leaks])
    pieces = whole.geoms if isinstance(whole, MultiPolygon) else [whole]
    found: list[tuple[BaseGeometry, dict[str, object]]] = []
    for piece in [p for p in pieces if not p.is_empty]:
        members = [leak for leak in t.leaks if leak.shape.intersects(piece)]
        main = max(members, key=lambda leak: leak.shape.area)
        shape = tidy(piece.difference(hidden(t, piece, views)), SMALLEST)
        if shape.is_empty:
            continue
        found.append((shape, _properties(t, shape, main, len(found) + 1)))
    return found


def _properties(t: Tunnel, shape: BaseGeometry, main: Leak, number: int) -> dict[str, object]:
    window, signed = t.canvas.distance(shape, 0.02)
    drop = float(t.canvas.drop[window][signed > 0].mean())
    entry: dict[str, object] = {"id": number, "drop_db": round(drop, 2), "phenomenon": main.phenomenon}
    if main.limit:
        entry["limit"] = main.limit
    return entry


def tidy(shape: BaseGeometry, smallest: float = 0.0005) -> BaseGeometry:
    """Only polygons that are not crumbs, with vertices close together."""
    clean = shape.buffer(0).simplify(0.002)
    parts = clean.geoms if hasattr(clean, "geoms") else [clean]
    return shapely.segmentize(MultiPolygon([p for p in parts if isinstance(p, Polygon) and p.area > smallest]), 0.04)


def geometry(t: Tunnel, shape: BaseGeometry) -> dict[str, object]:
    """GeoJSON of an outline of (chainage, arc), in the world."""
    parts = shape.geoms if isinstance(shape, MultiPolygon) else [shape]
    rings = [[_ring(t, np.asarray(r.coords)) for r in (p.exterior, *p.interiors)] for p in parts]
    if len(rings) == 1:
        return {"type": "Polygon", "coordinates": rings[0]}
    return {"type": "MultiPolygon", "coordinates": rings}


def _ring(t: Tunnel, coords: Array) -> list[list[float]]:
    world = t.axis.to_world(t.surface(coords[:, 0], coords[:, 1]))
    return [[round(float(v), 4) for v in row] for row in world]
