"""Outlines of what is true: of leaks as far as a scanner sees them, and of stains."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt
from shapely.geometry import MultiPolygon, Polygon

from .arrays import Floats, Mask
from .canvas import CELL, Canvas
from .equipment import Beams, blocked
from .survey import Build, Cloud

_COARSE = 3  # cells; visibility is found on that grid
_STRIP = 0.15  # what is hidden by something narrower counts as seen, m
_LEAST = 0.015  # m², smaller parts are not drawn
_VERTEX = 0.025  # m between vertices


@dataclass(frozen=True)
class Outline:
    """An outline in chainage and arc, and its properties."""

    shape: MultiPolygon
    properties: dict[str, str | float | int]


def _hidden(build: Build, rows: slice, columns: slice) -> Mask:
    """Cells of a window that no viewpoint sees past the equipment."""
    tunnel, canvas = build.tunnel, build.tunnel.canvas
    s, a = (grid.ravel() for grid in np.meshgrid(canvas.s[rows][::_COARSE], canvas.a[columns][::_COARSE], indexing="ij"))
    u, v = tunnel.on_lining(s, a)
    site = tunnel.alignment.to_site(s, u, v)
    phi = tunnel.profile.phi_at(a)
    normal, tangent = tunnel.profile.frame_at(phi)
    seen = np.zeros(s.size, dtype=bool)
    for place in build.scanner.viewpoints(s, u, v):
        way = site - tunnel.alignment.to_site(*place)
        reach = np.linalg.norm(way, axis=1)
        ds, du, dv = tunnel.alignment.direction_to_local(way / reach[:, None], s)
        cosine = -(du * normal[0] + dv * normal[1])
        d_arc = du * tangent[0] + dv * tangent[1]
        beams = Beams(s, u, v, ds, du, dv, reach, a, d_arc, cosine, np.full(s.size, 0.002))
        seen |= (cosine > 0.1) & ~blocked(tunnel.fixtures, beams)
    shape = (
        len(range(*rows.indices(canvas.shape[0])[:2], _COARSE)),
        len(range(*columns.indices(canvas.shape[1])[:2], _COARSE)),
    )
    fine = np.repeat(np.repeat(~seen.reshape(shape), _COARSE, axis=0), _COARSE, axis=1)
    return fine[: rows.stop - rows.start, : columns.stop - columns.start]


def _wide(hidden: Mask) -> Mask:
    """Hidden places wider than a strip that may be drawn across."""
    if not hidden.any():
        return hidden
    # outside of the window it may go on: the border does not make it narrower
    padded = np.pad(hidden, 20, mode="edge")
    core = distance_transform_edt(padded) > 0.5 * _STRIP / CELL
    grown = distance_transform_edt(~core) <= 0.5 * _STRIP / CELL if core.any() else core
    return hidden & grown[20:-20, 20:-20]


def _polygons(mask: Mask, s0: float, a0: float) -> MultiPolygon:
    """Outline of a mask whose first cell has its lower corner at (s0, a0)."""
    if not mask.any():
        return MultiPolygon()
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    turn = np.diff(padded, axis=1)
    row, begin = np.nonzero(turn == 1)
    _, end = np.nonzero(turn == -1)
    boxes = shapely.box(s0 + CELL * row, a0 + CELL * begin, s0 + CELL * (row + 1), a0 + CELL * end)
    whole = shapely.union_all(boxes)
    smooth = whole.buffer(CELL).buffer(-2 * CELL).buffer(CELL).simplify(0.4 * CELL)
    parts = smooth.geoms if isinstance(smooth, MultiPolygon) else [smooth]
    big = [_plug(part) for part in parts if isinstance(part, Polygon) and part.area >= _LEAST]
    return MultiPolygon(big)


def _plug(part: Polygon) -> Polygon:
    """Without holes that nobody would draw."""
    return Polygon(part.exterior, [ring for ring in part.interiors if Polygon(ring).area > 0.02])


def _window(mask: Mask) -> tuple[slice, slice]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _outline(build: Build, mask: Mask, rows: slice, columns: slice) -> MultiPolygon:
    canvas = build.tunnel.canvas
    within = (canvas.s[rows] > 0.0) & (canvas.s[rows] < canvas.length)
    drawn = mask & within[:, None]
    if drawn.any():
        drawn = drawn & ~_wide(_hidden(build, rows, columns))
    return _polygons(drawn, canvas.s[rows.start] - CELL / 2, canvas.a[columns.start] - CELL / 2)


def leak_outlines(build: Build, cloud: Cloud) -> list[Outline]:
    """All leaks that can be seen, with the drop which the scanner met within them."""
    canvas = build.tunnel.canvas
    found: list[Outline] = []
    for number in sorted({leak.owner for leak in canvas.leaks}):
        mask = canvas.owner == number
        if not mask.any():
            continue
        rows, columns = _window(mask)
        shape = _outline(build, mask[rows, columns], rows, columns)
        if shape.is_empty:
            continue
        near = np.flatnonzero(_in_bounds(cloud.wet_at, shape.bounds))
        inside = near[shapely.contains_xy(shape, *cloud.wet_at[near].T)]
        members = [leak for leak in canvas.leaks if leak.owner == number]
        properties: dict[str, str | float | int] = {
            "id": len(found) + 1,
            "drop_db": round(float(cloud.wet_loss[inside].mean()), 2) if inside.size else 0.0,
            "phenomenon": members[0].phenomenon,
        }
        if all(leak.limit for leak in members):
            properties["limit"] = str(members[0].limit)
        found.append(Outline(shape, properties))
    return found


def _in_bounds(points: Floats, bounds: tuple[float, float, float, float]) -> Mask:
    return (points[:, 0] >= bounds[0]) & (points[:, 1] >= bounds[1]) & (points[:, 0] <= bounds[2]) & (points[:, 1] <= bounds[3])


def stain_outlines(build: Build) -> list[Outline]:
    """Stains as far as they can be seen and no leak lies on them."""
    canvas = build.tunnel.canvas
    found: list[Outline] = []
    for stain in canvas.stains:
        dry = stain.inside & (canvas.owner[stain.rows, stain.columns] == 0)
        shape = _outline(build, dry, stain.rows, stain.columns)
        if not shape.is_empty:
            found.append(Outline(shape, {"id": len(found) + 1, "kind": stain.kind}))
    return found


def on_lining(build: Build, shape: MultiPolygon) -> list[list[list[list[float]]]]:
    """National 3D coordinates of an outline, as GeoJSON has them."""
    dense = shapely.segmentize(shape, _VERTEX)
    return [[_ring(build, ring) for ring in (part.exterior, *part.interiors)] for part in shapely.get_parts(dense)]


def _national(build: Build, plan: Floats) -> Floats:
    u, v = build.tunnel.on_lining(plan[:, 0], plan[:, 1])
    return build.tunnel.alignment.to_national(build.tunnel.alignment.to_site(plan[:, 0], u, v))


def _ring(build: Build, ring: shapely.LinearRing) -> list[list[float]]:
    plan = np.array(ring.coords)
    steep = np.linalg.norm(np.diff(_national(build, plan), axis=0), axis=1) > 1.6 * _VERTEX
    pieces = np.where(steep, 12, 1)  # over the edge of a panel, say
    part = np.concatenate([np.arange(count) / count for count in pieces])
    at = np.repeat(np.arange(pieces.size), pieces)
    dense = np.vstack([plan[at] + part[:, None] * np.diff(plan, axis=0)[at], plan[-1:]])
    xyz = _national(build, dense)
    return [[round(float(value), 4) for value in point] for point in xyz]


def length_of(canvas: Canvas, spacing: float) -> Floats:
    """Chainages of an axis that reaches a little beyond the scan."""
    return np.linspace(-3.0, canvas.length + 3.0, math.ceil((canvas.length + 6.0) / spacing) + 1)
