"""Outlines of fields on the unrolled lining."""

from __future__ import annotations

import numpy as np
import shapely

from .arrays import BoolArray, FloatArray

HALF = 0.5


def outlines(weight: FloatArray, s: FloatArray, t: FloatArray) -> shapely.Geometry:
    """Polygons, in (s, t), of where a field exceeds one half, by marching squares."""
    step_s, step_t = s[1] - s[0], t[1] - t[0]
    w = np.pad(weight.astype(float), 1)
    inside = w > HALF
    if not inside.any():
        return shapely.MultiPolygon()
    x = np.concatenate([[s[0] - step_s], s, [s[-1] + step_s]])
    y = np.concatenate([[t[0] - step_t], t, [t[-1] + step_t]])
    along = _crossings(w, inside, x, y)
    across = _crossings(w.T, inside.T, y, x)[:, :, ::-1].transpose(1, 0, 2)
    # The sides of a cell: below, above (crossed along s), left, right (crossed along t).
    sides = (along[:, :-1], along[:, 1:], across[:-1], across[1:])
    crossed = np.stack([~np.isnan(side[..., 0]) for side in sides])
    count = crossed.sum(0)
    segments = []
    for first in range(4):
        for second in range(first + 1, 4):
            cell = (count == 2) & crossed[first] & crossed[second]
            segments.append(np.stack([sides[first][cell], sides[second][cell]], axis=1))
    saddle = count == 4
    low_in = inside[:-1, :-1][saddle]
    full = (w[:-1, :-1] + w[1:, :-1] + w[:-1, 1:] + w[1:, 1:])[saddle] > 4 * HALF
    # Joined across the middle, a saddle cuts off the two corners that are outside, else those that are inside.
    turned = low_in == full
    for pairs, which in ((((0, 3), (1, 2)), turned), (((0, 2), (1, 3)), ~turned)):
        for a, b in pairs:
            segments.append(np.stack([sides[a][saddle][which], sides[b][saddle][which]], axis=1))
    faces = shapely.polygonize(shapely.linestrings(np.concatenate(segments))).geoms
    middles = [face.representative_point() for face in faces]
    rows = np.clip(np.rint([(p.x - x[0]) / step_s for p in middles]).astype(int), 0, x.size - 1)
    columns = np.clip(np.rint([(p.y - y[0]) / step_t for p in middles]).astype(int), 0, y.size - 1)
    kept = [face for face, row, column in zip(faces, rows, columns, strict=True) if inside[row, column]]
    return shapely.union_all(kept) if kept else shapely.MultiPolygon()


def _crossings(w: FloatArray, inside: BoolArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Points where the field passes one half between neighbours along the first index; NaN where it does not."""
    points = np.full((x.size - 1, y.size, 2), np.nan)
    i, j = np.nonzero(inside[:-1] != inside[1:])
    share = (HALF - w[i, j]) / (w[i + 1, j] - w[i, j])
    points[i, j, 0] = x[i] + share * (x[i + 1] - x[i])
    points[i, j, 1] = y[j]
    return points


def polygons(shape: shapely.Geometry, smallest: float, hole: float = 0.0) -> list[shapely.Polygon]:
    """Parts of a geometry from an area on, with holes smaller than `hole` filled."""
    kept = []
    for part in shapely.get_parts(shape):
        if part.geom_type == "Polygon" and part.area >= smallest:
            rings = [ring for ring in part.interiors if shapely.Polygon(ring).area >= hole]
            kept.append(shapely.Polygon(part.exterior, rings))
    return kept
