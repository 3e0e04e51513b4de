"""Outlines of what was painted on the lining, as far as the scanner could see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import Polygon

from .canvas import STEP, Canvas
from .frames import Array, Mask, Tunnel
from .trace import Echoes

COARSE = 2
STRIP = 0.075
SMALLEST = 0.008
# Segments of each case of marching squares: corners are counted 1, 2, 4, 8 from (0, 0) by (1, 0) and (1, 1) to (0, 1), edges 0
# to 3 likewise from the one between the first two corners.
CASES: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((3, 0),),
    2: ((0, 1),),
    3: ((3, 1),),
    4: ((1, 2),),
    5: ((3, 0), (1, 2)),
    6: ((0, 2),),
    7: ((3, 2),),
    8: ((2, 3),),
    9: ((0, 2),),
    10: ((0, 1), (2, 3)),
    11: ((1, 2),),
    12: ((1, 3),),
    13: ((0, 1),),
    14: ((3, 0),),
}


@dataclass(frozen=True)
class Region:
    """A leak, or something else: its parts in chainage and girth, and its properties."""

    parts: list[Polygon]
    properties: dict[str, object]


def contours(field: Array, origin: tuple[float, float]) -> list[Polygon]:
    """Areas in which a field on nodes 1 cm apart is positive."""
    level = np.pad(np.where(field == 0.0, 1e-7, field), 1, constant_values=-0.01)
    corners = np.stack([level[:-1, :-1], level[1:, :-1], level[1:, 1:], level[:-1, 1:]])
    case = ((corners > 0) * np.array([1, 2, 4, 8])[:, None, None]).sum(axis=0)
    segments = []
    for number, pairs in CASES.items():
        rows, columns = np.nonzero(case == number)
        for pair in pairs:
            ends = [_crossing(level, edge, rows, columns) for edge in pair]
            segments.append(np.stack(ends, axis=1))
    lines = np.concatenate(segments)
    lines = lines[np.abs(lines[:, 0] - lines[:, 1]).max(axis=1) > 0]
    faces = shapely.get_parts(shapely.polygonize(shapely.linestrings(lines)))
    areas = []
    for face in faces:
        spot = face.representative_point()
        value = ndimage.map_coordinates(level, [[spot.x], [spot.y]], order=1)[0]
        if value > 0:
            scaled = shapely.transform(face, lambda points: (points - 1) * STEP + np.array(origin))
            areas.append(scaled)
    return areas


def _crossing(level: Array, edge: int, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Array:
    """Where the field is zero on an edge of cells; cells that share the edge get the very same point."""
    if edge in (0, 2):
        columns = columns + (edge == 2)
        here, there = level[rows, columns], level[rows + 1, columns]
        return np.stack([rows + here / (here - there), columns.astype(float)], axis=-1)
    rows = rows + (edge == 1)
    here, there = level[rows, columns], level[rows, columns + 1]
    return np.stack([rows.astype(float), columns + here / (here - there)], axis=-1)


def hidden(canvas: Canvas, echoes: Echoes) -> Array:
    """Distance to lining that nobody saw, on every second node; negative inside it.

    Only what is wider than 15 cm counts: it has room for a disc of that width without any point.
    """
    shape = ((len(canvas.u) + 1) // COARSE, (len(canvas.v) + 1) // COARSE)
    empty = np.ones(shape, bool)
    seen = echoes.on_lining
    rows = np.clip(np.round(echoes.u[seen] / STEP / COARSE).astype(int), 0, shape[0] - 1)
    columns = np.clip(np.round((echoes.v[seen] - canvas.v[0]) / STEP / COARSE).astype(int), 0, shape[1] - 1)
    empty[rows, columns] = False
    size = STEP * COARSE
    discs = ndimage.distance_transform_edt(empty) * size > STRIP
    if not discs.any():
        return np.full(shape, 1.0)
    dark = ndimage.distance_transform_edt(~discs) * size < STRIP
    distance: Array = ndimage.distance_transform_edt(~dark) - ndimage.distance_transform_edt(dark)
    return distance * size


def _clip(field: Array, first: tuple[int, int], unseen: Array) -> Array:
    """Cut off what nobody saw."""
    rows = (first[0] + np.arange(field.shape[0])) / COARSE
    columns = (first[1] + np.arange(field.shape[1])) / COARSE
    place = np.stack(np.meshgrid(rows, columns, indexing="ij"))
    clipped: Array = np.minimum(field, ndimage.map_coordinates(unseen, place, order=1, mode="nearest"))
    return clipped


def _clean(parts: list[Polygon]) -> list[Polygon]:
    """Fewer vertices, and neither specks nor pinholes."""
    cleaned = []
    for part in parts:
        holes = [ring for ring in part.interiors if Polygon(ring).area > SMALLEST]
        slim = Polygon(part.exterior, holes).simplify(0.003)
        if slim.area > SMALLEST:
            cleaned.append(slim)
    return cleaned


def _paler(canvas: Canvas, box: tuple[slice, ...], mine: Mask) -> float:
    """How much brighter the dry surface of a leak is than that about it (crusts inside, soot), dB."""
    wide = tuple(slice(max(0, side.start - 40), side.stop + 40) for side in box)
    shade, water = canvas.shade[wide], canvas.water[wide]
    about = (water < -0.1) & (np.abs(canvas.v[wide[1]]) < canvas.tunnel.section.foot)
    return float(canvas.shade[box][mine].mean() - np.median(shade[about])) if about.any() else 0.0


def leaks(canvas: Canvas, echoes: Echoes) -> list[Region]:
    """True leaks: what water joins is one."""
    unseen = hidden(canvas, echoes)
    labels, count = ndimage.label(canvas.water > 0, structure=np.ones((3, 3)))
    seen = echoes.only(echoes.on_lining)
    rows = np.clip(np.round(seen.u / STEP).astype(int), 0, labels.shape[0] - 1)
    columns = np.clip(np.round((seen.v - canvas.v[0]) / STEP).astype(int), 0, labels.shape[1] - 1)
    at = labels[rows, columns]
    loss = np.bincount(at, -seen.water, count + 1) / np.maximum(np.bincount(at, minlength=count + 1), 1)
    regions: list[Region] = []
    for label, box in enumerate(ndimage.find_objects(labels), start=1):
        box = tuple(slice(max(0, side.start - 2), side.stop + 2) for side in box)
        mine = labels[box] == label
        field = np.where(mine | (labels[box] == 0), canvas.water[box], -0.005).astype(float)
        first = (box[0].start, box[1].start)
        origin = (first[0] * STEP, canvas.v[0] + first[1] * STEP)
        parts = _clean(contours(_clip(field, first, unseen), origin))
        if not parts:
            continue
        water = canvas.waters[int(np.bincount(canvas.owner[box][mine]).argmax())]
        properties: dict[str, object] = {
            "id": len(regions) + 1,
            "drop_db": round(float(loss[label]) - _paler(canvas, box, mine), 2),
            "phenomenon": water.phenomenon,
        }
        if water.limit:
            properties["limit"] = water.limit
        regions.append(Region(parts, properties))
    return regions


def others(canvas: Canvas, echoes: Echoes) -> list[Region]:
    """What is dark but dry, or bright."""
    unseen = hidden(canvas, echoes)
    regions: list[Region] = []
    for mark in canvas.marks:
        rows = slice(mark.first[0], mark.first[0] + mark.field.shape[0])
        columns = slice(mark.first[1], mark.first[1] + mark.field.shape[1])
        dry = np.minimum(mark.field.astype(float), -canvas.water[rows, columns])
        origin = (mark.first[0] * STEP, canvas.v[0] + mark.first[1] * STEP)
        parts = _clean(contours(_clip(dry, mark.first, unseen), origin)) if dry.max() > 0 else []
        if parts:
            regions.append(Region(parts, {"id": len(regions) + 1, "kind": mark.kind}))
    return regions


def collection(tunnel: Tunnel, canvas: Canvas, regions: list[Region]) -> dict[str, object]:
    """Regions as GeoJSON in world coordinates."""

    def ring(line: shapely.LinearRing) -> list[list[float]]:
        points = shapely.get_coordinates(line.segmentize(0.012))
        edge = tunnel.section.foot - 2 * STEP
        depth = canvas.sample(canvas.relief, points[:, 0], np.clip(points[:, 1], -edge, edge))
        world = tunnel.axis.to_world(tunnel.surface(points[:, 0], points[:, 1], depth))
        rounded: list[list[float]] = np.round(world, 4).tolist()
        return rounded

    features = []
    for region in regions:
        rings = [[ring(part.exterior), *(ring(hole) for hole in part.interiors)] for part in region.parts]
        many = len(rings) > 1
        geometry = {"type": "MultiPolygon" if many else "Polygon", "coordinates": rings if many else rings[0]}
        features.append({"type": "Feature", "properties": region.properties, "geometry": geometry})
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    return {"type": "FeatureCollection", "crs": crs, "features": features}
