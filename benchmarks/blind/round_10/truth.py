"""Outlines of what is wet, and of what is not, in real coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy import ndimage
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from .canvas import Canvas
from .scanner import Mobile, Static, Tunnel, visible

CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
_STRIP = 0.15


def _ball(radius: float, pixel: float) -> np.ndarray:
    """A disc to open and close pictures with."""
    n = max(round(radius / pixel), 1)
    y, x = np.mgrid[-n : n + 1, -n : n + 1]
    return x * x + y * y <= (n + 0.3) ** 2


def _grown(mask: np.ndarray, distance: float, pixel: float) -> np.ndarray:
    """A mask made larger by a distance."""
    return ndimage.distance_transform_edt(~mask) * pixel <= distance


def _closed(mask: np.ndarray, distance: float, pixel: float) -> np.ndarray:
    """A mask without gaps narrower than twice a distance."""
    n = int(np.ceil(distance / pixel)) + 1
    wide = np.pad(mask, n)
    wide = _grown(wide, distance, pixel)
    return (ndimage.distance_transform_edt(wide) * pixel > distance)[n:-n, n:-n]


def outline(mask: np.ndarray, s0: float, u0: float, pixel: float) -> BaseGeometry:
    """Polygon (s, u) about the pixels of a mask whose first is at ``(s0, u0)``."""
    boxes = []
    for row in np.flatnonzero(mask.any(axis=1)):
        change = np.flatnonzero(np.diff(np.concatenate([[0], mask[row].astype(np.int8), [0]])))
        top, bottom = u0 + (row - 0.5) * pixel, u0 + (row + 0.5) * pixel
        for a, b in zip(change[::2], change[1::2], strict=True):
            boxes.append(box(s0 + (a - 0.5) * pixel, top, s0 + (b - 0.5) * pixel, bottom))
    area = shapely.union_all(boxes, grid_size=1e-4)
    half = 0.5 * pixel
    area = area.buffer(half).buffer(-2 * half).buffer(half).simplify(0.4 * pixel).buffer(0)
    return area


def _pieces(area: BaseGeometry, least: float) -> list[Polygon]:
    """Polygons of a geometry, without crumbs and tiny holes."""
    parts = [p for p in getattr(area, "geoms", [area]) if isinstance(p, Polygon) and p.area >= least]
    return [Polygon(p.exterior, [h for h in p.interiors if Polygon(h).area >= 0.02]) for p in parts]


def lifted(tunnel: Tunnel, pieces: list[Polygon]) -> dict[str, Any]:
    """GeoJSON of polygons of the unrolled lining, on the lining."""
    canvas = tunnel.canvas
    sheets = []
    at_s, at_u = np.concatenate([np.array(p.exterior.coords) for p in pieces]).T
    window = canvas.window(at_s.min() - 0.1, at_s.max() + 0.1, at_u.min() - 0.1, at_u.max() + 0.1)
    even = ndimage.gaussian_filter(canvas.bump[window.at], 0.015 / canvas.pixel)
    for piece in pieces:
        rings = []
        for ring in (piece.exterior, *piece.interiors):
            place = np.array(shapely.segmentize(ring, 0.02).coords)
            at, _, normal = canvas.profile.at(place[:, 1])
            where = [(place[:, 1] - window.u[0, 0]) / canvas.pixel, (place[:, 0] - window.s[0, 0]) / canvas.pixel]
            at = at + normal * ndimage.map_coordinates(even, where, order=1, mode="nearest")[:, None]
            rings.append(np.round(tunnel.alignment.world(place[:, 0], at[:, 0], at[:, 1]), 4).tolist())
        sheets.append(rings)
    if len(sheets) == 1:
        return {"type": "Polygon", "coordinates": sheets[0]}
    return {"type": "MultiPolygon", "coordinates": sheets}


def hidden(tunnel: Tunnel, pattern: Static | Mobile) -> np.ndarray:
    """Pixels of the canvas that lie behind something wider than 0.15 m, on the floor, or outside the scan."""
    canvas, cell = tunnel.canvas, 0.03
    seen, s, u = visible(tunnel, pattern, cell)
    dark = ~ndimage.binary_closing(np.pad(seen, 2, mode="edge"), np.ones((2, 2)))[2:-2, 2:-2]
    core = ndimage.binary_opening(np.pad(dark, 4, mode="edge"), _ball(_STRIP / 2 - 0.01, cell))[4:-4, 4:-4]
    wide = ndimage.binary_dilation(core, iterations=1) & dark
    w = canvas.whole()
    rows = np.clip(np.round((w.u[:, 0] - u[0]) / cell).astype(int), 0, len(u) - 1)
    columns = np.clip(np.round((w.s[0] - s[0]) / cell).astype(int), 0, len(s) - 1)
    out = wide[np.ix_(rows, columns)]
    out |= (w.u < canvas.profile.foot_left + 0.02) | (w.u > canvas.profile.foot_right - 0.02)
    out |= (w.s < 0) | (w.s > canvas.length)
    return out


def _drop(canvas: Canvas, parts: np.ndarray, at: tuple[slice, slice], unfit: np.ndarray) -> float:
    """By how much a leak is darker than the dry lining within 0.3 m of it that is not ``unfit`` to compare with."""
    pad = int(0.3 / canvas.pixel)
    start = [max(a.start - pad, 0) for a in at]
    about = tuple(slice(first, a.stop + pad) for first, a in zip(start, at, strict=True))
    mask = np.zeros(canvas.base[about].shape, dtype=bool)
    row, column = at[0].start - start[0], at[1].start - start[1]
    mask[row : row + parts.shape[0], column : column + parts.shape[1]] = parts
    ring = _grown(mask, 0.3, canvas.pixel) & ~unfit[about] & ~mask
    dry, wet = canvas.base[about], canvas.wet[about]
    if ring.sum() * canvas.pixel**2 < 0.02:
        return float(wet[mask].mean())
    return float(dry[ring].mean() - (dry - wet)[mask].mean())


def leaks(tunnel: Tunnel, shade: np.ndarray) -> list[dict[str, Any]]:
    """Features of the true leaks."""
    canvas: Canvas = tunnel.canvas
    pixel = canvas.pixel
    wet = canvas.label > 0
    if not wet.any():
        return []
    groups, _ = ndimage.label(_grown(wet, 0.04, pixel))
    out = []
    for number, at in enumerate(ndimage.find_objects(groups), start=1):
        mine = (groups[at] == number) & wet[at]
        pad = np.pad(mine, 12)
        parts = _closed(pad, 0.03, pixel)[12:-12, 12:-12] & ~shade[at]
        names, counts = np.unique(canvas.label[at][mine], return_counts=True)
        painted = canvas.leaks[int(names[counts.argmax()]) - 1]
        s0, u0 = at[1].start * pixel - canvas.margin, canvas.profile.low + at[0].start * pixel
        if not parts.any():
            continue
        pieces = _pieces(outline(parts, s0, u0, pixel), 0.004)
        if not pieces:
            continue
        drop = _drop(canvas, parts, at, shade | (groups > 0))
        properties: dict[str, Any] = {"drop_db": round(drop, 2), "phenomenon": painted.phenomenon}
        if painted.limit:
            properties["limit"] = painted.limit
        area = sum(p.area for p in pieces)
        out.append({"type": "Feature", "properties": properties, "geometry": lifted(tunnel, pieces), "area": area})
    out.sort(key=lambda f: -f["area"])
    for number, feature in enumerate(out, start=1):
        feature.pop("area")
        feature["properties"] = {"id": number} | feature["properties"]
    return out


def others(tunnel: Tunnel, shade: np.ndarray) -> list[dict[str, Any]]:
    """Features of what is dark or bright for other reasons."""
    canvas = tunnel.canvas
    out: list[dict[str, Any]] = []
    for dry in canvas.others:
        mask = dry.mask & ~shade[dry.window.at]
        if not mask.any():
            continue
        if mask.all():
            s, u = dry.window.s[0], dry.window.u[:, 0]
            area: BaseGeometry = box(s[0], u[0], s[-1], u[-1])
        else:
            area = outline(mask, float(dry.window.s[0, 0]), float(dry.window.u[0, 0]), canvas.pixel)
        pieces = _pieces(area, 0.01)
        if pieces:
            properties = {"id": len(out) + 1, "kind": dry.kind}
            shape = lifted(tunnel, pieces if len(pieces) == 1 else list(MultiPolygon(pieces).geoms))
            out.append({"type": "Feature", "properties": properties, "geometry": shape})
    return out
