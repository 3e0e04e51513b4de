"""The truth: outlines of leaks as far as they were seen, and of other marks."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy import ndimage

from .arrays import BoolArray, FloatArray
from .canvas import CELL, Canvas, Window
from .outline import outlines, polygons
from .stances import Stance
from .tracing import Tunnel, trace

STRIDE = 3
HIDDEN_WIDTH = 0.15
SPACING = 0.05
SMALLEST = 0.015

Feature = dict[str, Any]


def leaks(tunnel: Tunnel, stance: Stance, beam: float) -> tuple[list[Feature], shapely.Geometry]:
    """Features of all leaks, and their union in (s, t)."""
    canvas = tunnel.canvas
    reflectance = canvas.reflectance()
    wet = canvas.wet > 0.5
    groups, _ = ndimage.label(ndimage.binary_dilation(wet, iterations=5), np.ones((3, 3)))
    features: list[Feature] = []
    shapes: list[shapely.Polygon] = []
    for number, box in enumerate(ndimage.find_objects(groups), 1):
        window = _padded(canvas, box)
        alone = np.where(groups[window.index] == number, canvas.wet[window.index], 0)
        hidden = _hidden(tunnel, stance, window, beam)
        shape = outlines(np.where(hidden, 0, alone), window.s, window.t)
        parts = polygons(shapely.simplify(shape, 0.002), 0.004, 0.05)
        if sum(part.area for part in parts) < SMALLEST:
            continue
        seen = (alone > 0.5) & ~hidden
        name, limit = _spoken_for(canvas, window, seen)
        properties = {"id": len(features) + 1, "phenomenon": name}
        drop, scatter = _contrast(reflectance, canvas, window, alone > 0.5, seen)
        properties["drop_db"] = round(drop, 2)
        if not limit and drop < max(0.9, 1.2 * scatter):
            limit = "Its contrast lies within the scatter of the lining about it."
        if limit:
            properties["limit"] = limit
        features.append(_feature(tunnel, parts, properties))
        shapes.extend(parts)
    return features, shapely.union_all(shapes)


def others(tunnel: Tunnel, wet: shapely.Geometry) -> list[Feature]:
    """Features of what is dark but dry, or bright; later ones lie over earlier ones."""
    features: list[Feature] = []
    covered = wet
    for mark in reversed(tunnel.canvas.others):
        stride = 3 if mark.weight.size > 1_000_000 else 1
        weight = mark.weight if stride == 1 else ndimage.uniform_filter(mark.weight, stride)
        shape = outlines(weight[::stride, ::stride], mark.window.s[::stride], mark.window.t[::stride])
        shape = shapely.simplify(shape, 0.003 * stride).buffer(0)
        parts = polygons(shapely.difference(shape, covered), 0.004, 0.02)
        if parts:
            features.append(_feature(tunnel, parts, {"kind": mark.kind}))
            covered = shapely.union_all([covered, *parts])
    return features[::-1]


def _padded(canvas: Canvas, box: tuple[slice, slice]) -> Window:
    """Window about a group of cells."""
    rows, columns = box
    pad = 0.7
    return canvas.window(
        rows.start * CELL - pad, rows.stop * CELL + pad, columns.start * CELL - canvas.half - pad,
        columns.stop * CELL - canvas.half + pad,
    )  # fmt: skip


def _hidden(tunnel: Tunnel, stance: Stance, window: Window, beam: float) -> BoolArray:
    """Where the lining is hidden by something wider than a cable."""
    canvas, line = tunnel.canvas, tunnel.line
    s, t = (x.ravel() for x in np.meshgrid(window.s[::STRIDE], window.t[::STRIDE], indexing="ij"))
    u, v = tunnel.section.at(t, canvas.sample(canvas.relief, s, t) + 0.004)
    points = line.local(s, u, v)
    seen = np.zeros(s.size, dtype=bool)
    for origins in stance.towards(tunnel, s, u):
        ways = points - origins
        distance = np.linalg.norm(ways, axis=1)
        near = np.flatnonzero((distance < 25) & ~seen)
        if near.size:
            hits = trace(tunnel, origins[near], ways[near] / distance[near, None], beam)
            seen[near] |= hits.distance > distance[near] - 0.05
    shape = window.s[::STRIDE].size, window.t[::STRIDE].size
    fine = np.kron(~seen.reshape(shape), np.ones((STRIDE, STRIDE), dtype=bool))[: window.s.size, : window.t.size]
    radius = HIDDEN_WIDTH / 2 / CELL
    padded = np.pad(fine, 12, mode="edge")
    kernel = ndimage.distance_transform_edt(padded) > radius
    wide = ndimage.distance_transform_edt(~kernel) <= radius
    return np.asarray((wide & padded)[12:-12, 12:-12])


def _spoken_for(canvas: Canvas, window: Window, seen: BoolArray) -> tuple[str, str]:
    """Phenomenon and limit of that leak which has most of the cells."""
    best, name, limit = -1.0, "patch", ""
    full = np.zeros(canvas.shape, dtype=bool)
    full[window.index] = seen
    for leak in canvas.leaks:
        share = float(leak.weight[full[leak.window.index]].sum())
        if share > best:
            best, name, limit = share, leak.kind, leak.limit
    return name, limit


def _contrast(reflectance: FloatArray, canvas: Canvas, window: Window, wet: BoolArray, seen: BoolArray) -> tuple[float, float]:
    """Drop against the dry lining about a leak, and the scatter of that at the scale of a decimetre."""
    values = reflectance[window.index]
    away = ndimage.distance_transform_edt(~wet) * CELL
    dry = (away > 0.12) & (away < 0.7) & (canvas.drop[window.index] < 0.1)
    smooth = ndimage.uniform_filter(values, 10)
    return float(values[dry].mean() - values[seen].mean()), float(smooth[dry].std())


def _feature(tunnel: Tunnel, parts: list[shapely.Polygon], properties: dict[str, Any]) -> Feature:
    """Polygons in (s, t) as a feature in real coordinates."""
    coordinates = [[_ring(tunnel, ring) for ring in (part.exterior, *part.interiors)] for part in parts]
    single = len(coordinates) == 1
    geometry = {"type": "Polygon" if single else "MultiPolygon", "coordinates": coordinates[0] if single else coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _ring(tunnel: Tunnel, ring: shapely.LinearRing) -> list[list[float]]:
    """Vertices on the lining, no more than 5 cm apart."""
    s, t = shapely.get_coordinates(shapely.segmentize(ring, SPACING * 0.9)).T
    for _ in range(3):
        xyz = _on_lining(tunnel, s, t)
        parts = np.ceil(np.linalg.norm(np.diff(xyz, axis=0), axis=1) / (SPACING * 0.95)).astype(int)
        where = np.append(np.repeat(np.arange(parts.size), parts), parts.size)
        start = np.cumsum(parts) - parts
        place = where + np.append(np.arange(parts.sum()) - np.repeat(start, parts), 0) / np.append(np.repeat(parts, parts), 1)
        s, t = (np.interp(place, np.arange(parts.size + 1), values) for values in (s, t))
    return [[round(float(x), 3) for x in row] for row in _on_lining(tunnel, s, t) + np.array(tunnel.line.origin)]


def _on_lining(tunnel: Tunnel, s: FloatArray, t: FloatArray) -> FloatArray:
    """Local coordinates of places on the lining."""
    u, v = tunnel.section.at(t, tunnel.canvas.sample(tunnel.canvas.relief, s, t))
    return tunnel.line.local(s, u, v)
