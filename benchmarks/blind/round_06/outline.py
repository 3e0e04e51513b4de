"""Outlines of fields on a grid, as polygons."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from .fields import Array

CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}


def polygons(s: Array, u: Array, field: Array) -> list[shapely.Polygon]:
    """Areas of (s, u) in which ``field`` on the grid is negative, by marching squares; beyond the grid it is positive."""
    padded = np.pad(np.asarray(field, float), 1, constant_values=0.05)
    padded = np.where(padded == 0, 1e-6, padded)
    ds, du = s[1] - s[0], u[1] - u[0]
    i, j = np.meshgrid(np.arange(padded.shape[0] - 1), np.arange(padded.shape[1] - 1), indexing="ij")
    corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    values = [padded[corner] for corner in corners]
    crossings, cut = [], []
    for k in range(4):
        # Edges are walked in growing direction, so that neighbours find the same point.
        first, second = (k, (k + 1) % 4) if k < 2 else ((k + 1) % 4, k)
        a, b = values[first], values[second]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where((a < 0) != (b < 0), a / (a - b), 0.0)
        x, y = (p + t * (q - p) for p, q in zip(corners[first], corners[second], strict=True))
        crossings.append(np.stack([s[0] + (x - 1) * ds, u[0] + (y - 1) * du], -1))
        cut.append((a < 0) != (b < 0))
    cuts = np.stack(cut)
    number = cuts.sum(0)
    pieces = []
    for one in range(4):
        for two in range(one + 1, 4):
            mask = (number == 2) & cuts[one] & cuts[two]
            pieces.append(np.stack([crossings[one][mask], crossings[two][mask]], 1))
    saddle = number == 4
    middle = sum(values)[saddle] < 0 if saddle.any() else np.zeros(0, bool)
    joined = (values[0][saddle] < 0) == middle
    for pairs, mask in ((((0, 1), (2, 3)), joined), (((3, 0), (1, 2)), ~joined)):
        for one, two in pairs:
            pieces.append(np.stack([crossings[one][saddle][mask], crossings[two][saddle][mask]], 1))
    segments = np.round(np.concatenate(pieces), 6)
    segments = segments[(segments[:, 0] != segments[:, 1]).any(-1)]
    if not len(segments):
        return []
    faces = shapely.get_parts(shapely.polygonize(list(shapely.linestrings(segments))))
    found = []
    for face in faces:
        point = face.representative_point()
        if face.area > 5e-4 and _below(padded, (point.x - s[0]) / ds + 1, (point.y - u[0]) / du + 1):
            found.append(face)
    return found


def _below(grid: Array, x: float, y: float) -> bool:
    i, j = int(np.clip(x, 0, grid.shape[0] - 2)), int(np.clip(y, 0, grid.shape[1] - 2))
    f, g = x - i, y - j
    upper = grid[i, j] * (1 - g) + grid[i, j + 1] * g
    return bool(upper * (1 - f) + (grid[i + 1, j] * (1 - g) + grid[i + 1, j + 1] * g) * f < 0)


def feature(parts: list[shapely.Polygon], place: Callable[[Array, Array], Array], properties: dict[str, Any]) -> dict[str, Any]:
    """GeoJSON feature; ``place`` gives the points in space."""

    def ring(coordinates: Iterable[tuple[float, float]]) -> list[list[float]]:
        outline = shapely.LinearRing(coordinates)
        # Where the lining steps back the points are set closer.
        for step in (0.045, 0.01, 0.004):
            line = shapely.get_coordinates(shapely.segmentize(outline, step))
            spots = place(line[:, 0], line[:, 1])
            if np.linalg.norm(np.diff(spots, axis=0), axis=1).max() < 0.0495:
                break
        points = [[round(float(c), 4) for c in spot] for spot in spots]
        points[-1] = points[0]
        return points

    area = [[ring(part.exterior.coords), *(ring(hole.coords) for hole in part.interiors)] for part in parts]
    if len(area) == 1:
        geometry: dict[str, Any] = {"type": "Polygon", "coordinates": area[0]}
    else:
        geometry = {"type": "MultiPolygon", "coordinates": area}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def write(path: Path, features: list[dict[str, Any]]) -> None:
    """Write a GeoJSON file in EPSG:25832."""
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": CRS, "features": features}), encoding="utf-8")
