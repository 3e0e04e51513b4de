"""From painted water to the truth: joined outlines, clipped where something wide hides them, in three dimensions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import shapely
from scipy import ndimage

from .canvas import Canvas, Wet
from .tunnel import Tunnel

CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}


def contour(share: np.ndarray, row0: int, column0: int, cell: float, least: float = 0.003) -> shapely.Geometry:
    """Polygons (chainage, girth) where a field is at least one half; ``least`` is the smallest piece or hole (m2)."""
    f = np.pad(share, 1).astype(float) - 0.5
    f[np.abs(f) < 1e-6] = 1e-6
    inside = f > 0
    a, b, c, d = inside[:-1, :-1], inside[1:, :-1], inside[1:, 1:], inside[:-1, 1:]
    case = a * 1 + b * 2 + c * 4 + d * 8

    def crossing(i: np.ndarray, j: np.ndarray, side: int) -> np.ndarray:
        """Where the level crosses a side of a cell: 0 between a and b, 1 b and c, 2 d and c, 3 a and d."""
        i0, j0 = i + (side == 1), j + (side == 2)
        i1, j1 = (i0 + 1, j0) if side in (0, 2) else (i0, j0 + 1)
        first, last = f[i0, j0], f[i1, j1]
        t = first / (first - last)
        return np.stack([i0 + (i1 - i0) * t, j0 + (j1 - j0) * t], axis=1)

    table = {
        1: [(0, 3)], 14: [(0, 3)], 2: [(0, 1)], 13: [(0, 1)], 4: [(1, 2)], 11: [(1, 2)], 8: [(2, 3)], 7: [(2, 3)],
        3: [(1, 3)], 12: [(1, 3)], 6: [(0, 2)], 9: [(0, 2)], 5: [(0, 3), (1, 2)], 10: [(0, 1), (2, 3)],
    }  # fmt: skip
    lines = []
    for code, pairs in table.items():
        i, j = np.nonzero(case == code)
        for first, last in pairs:
            if len(i):
                lines.append(np.stack([crossing(i, j, first), crossing(i, j, last)], axis=1))
    if not lines:
        return shapely.Polygon()
    segments = np.concatenate(lines)
    faces = shapely.polygonize(shapely.linestrings(segments)).geoms
    kept = []
    for face in faces:
        point = shapely.point_on_surface(face)
        i, j = int(point.x), int(point.y)
        ti, tj = point.x - i, point.y - j
        level = (f[i, j] * (1 - ti) + f[i + 1, j] * ti) * (1 - tj) + (f[i, j + 1] * (1 - ti) + f[i + 1, j + 1] * ti) * tj
        if level > 0:
            kept.append(face)
    shape = shapely.union_all(kept)
    shape = shapely.transform(shape, lambda x: (x + [row0 - 0.5, column0 - 0.5]) * cell)
    shape = shapely.simplify(shape, 0.003)
    parts = []
    for part in shapely.get_parts(shape):
        if part.geom_type == "Polygon" and part.area >= least:
            holes = [ring for ring in part.interiors if shapely.Polygon(ring).area >= least]
            parts.append(shapely.Polygon(part.exterior, holes))
    shape = shapely.make_valid(shapely.MultiPolygon(parts)) if parts else shapely.Polygon()
    return shape


def wide_hidden(seen: np.ndarray, coarse: float, shape: tuple[int, int], cell: float) -> np.ndarray:
    """Where the lining is hidden over more than 0.15 m in every direction, on the fine grid."""
    size = round(0.15 / coarse) + 1
    y, x = np.mgrid[:size, :size] - (size - 1) / 2
    disc = np.hypot(x, y) <= size / 2
    padded = np.pad(~seen, size, mode="edge")
    wide = ndimage.binary_opening(padded, disc)[size:-size, size:-size]
    rows = np.minimum(((np.arange(shape[0]) + 0.5) * cell / coarse).astype(int), seen.shape[0] - 1)
    columns = np.minimum(((np.arange(shape[1]) + 0.5) * cell / coarse).astype(int), seen.shape[1] - 1)
    return wide[rows[:, None], columns[None, :]]


def _groups(canvas: Canvas) -> list[list[Wet]]:
    """Leaks whose water joins."""
    total = np.zeros(canvas.grid.shape, bool)
    for wet in canvas.wets:
        total[wet.window] |= wet.share >= 0.5
    label, _ = ndimage.label(ndimage.binary_dilation(total, iterations=2), structure=np.ones((3, 3)))
    groups: list[tuple[set[int], list[Wet]]] = []
    for wet in canvas.wets:
        own = set(np.unique(label[wet.window][wet.share >= 0.5]).tolist()) - {0}
        members = [wet]
        rest = []
        for other, wets in groups:
            if own & other:
                own, members = own | other, wets + members
            else:
                rest.append((other, wets))
        groups = [*rest, (own, members)]
    return [members for own, members in groups if own]


def leaks(canvas: Canvas, hidden: np.ndarray) -> list[dict]:
    """True leaks: outline in the unrolled plane, drop, phenomenon and limit."""
    cell = canvas.grid.cell
    tone = canvas.tone
    wet_anywhere = canvas.water < -0.12
    found = []
    for members in _groups(canvas):
        rows = slice(min(w.window[0].start for w in members), max(w.window[0].stop for w in members))
        columns = slice(min(w.window[1].start for w in members), max(w.window[1].stop for w in members))
        share = np.zeros((rows.stop - rows.start, columns.stop - columns.start), np.float32)
        for wet in members:
            inner = tuple(slice(a.start - b.start, a.stop - b.start) for a, b in zip(wet.window, (rows, columns), strict=True))
            np.maximum(share[inner], wet.share, out=share[inner])
        share[hidden[rows, columns]] = 0
        shape = contour(share, rows.start, columns.start, cell)
        if shape.is_empty or shape.area < 0.01:
            continue
        main = max(members, key=lambda w: float((w.share >= 0.5).sum()))
        pad = int(0.5 / cell)
        big = slice(max(rows.start - pad, 0), rows.stop + pad), slice(max(columns.start - pad, 0), columns.stop + pad)
        inside = np.zeros(tone[big].shape, bool)
        inside[rows.start - big[0].start :, columns.start - big[1].start :][: share.shape[0], : share.shape[1]] = share >= 0.5
        away = ndimage.distance_transform_edt(~inside) * cell
        about = (away > 0.05) & (away < 0.4) & ~wet_anywhere[big] & ~hidden[big]
        outside = float(np.median(tone[big][about])) if about.sum() > 50 else float(np.mean(canvas.dry[big][inside]))
        drop = outside - float(np.mean(tone[big][inside]))
        if drop < 0.3:  # lost among other tones: what was painted says more than its surroundings
            drop = -float(np.mean(canvas.water[big][inside]))
        found.append(
            {
                "shape": shape,
                "drop_db": round(drop, 2),
                "phenomenon": main.phenomenon,
                "limit": main.limit,
            }
        )
    return found


def marks(canvas: Canvas, hidden: np.ndarray, least: float = 0.01) -> list[dict]:
    """What is dry and dark or bright: outline in the unrolled plane, and kind."""
    found = []
    for mark in canvas.marks:
        share = np.where(hidden[mark.window], 0, mark.share)
        shape = contour(share, mark.window[0].start, mark.window[1].start, canvas.grid.cell)
        if not shape.is_empty and shape.area >= least:
            found.append({"shape": shape, "kind": mark.kind})
    return found


def _lift(shape: shapely.Geometry, tunnel: Tunnel, canvas: Canvas) -> list:
    """Coordinates of a MultiPolygon on the lining."""
    grid = canvas.grid
    polygons = []
    for part in shapely.get_parts(shapely.segmentize(shape, 0.025)):
        if part.geom_type != "Polygon":
            continue
        rings = []
        for ring in (part.exterior, *part.interiors):
            s, u = np.asarray(ring.coords).T
            position, normal = tunnel.section.at(u)
            row = np.clip((s / grid.cell).astype(int), 0, grid.shape[0] - 1)
            column = np.clip((u / grid.cell).astype(int), 0, grid.shape[1] - 1)
            position = position - normal * np.clip(canvas.relief[row, column], -0.03, 0.03)[:, None]
            rings.append(np.round(tunnel.axis.world(s, position[:, 0], position[:, 1]), 4).tolist())
        polygons.append(rings)
    return polygons


def write(path: Path, found: list[dict], tunnel: Tunnel, canvas: Canvas) -> None:
    """A file of outlines in three dimensions."""
    features = []
    for number, item in enumerate(found, 1):
        properties = {"id": number} | {k: v for k, v in item.items() if k != "shape" and v is not None}
        coordinates = _lift(item["shape"], tunnel, canvas)
        single = len(coordinates) == 1
        geometry = {"type": "Polygon" if single else "MultiPolygon", "coordinates": coordinates[0] if single else coordinates}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": CRS, "features": features}))
