"""Wet patches of irregular shape, as polygons in the unrolled plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import affinity
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.prepared import prep

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import inner
from tunneldb.errors import UserError
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Width of a patch's transition from dry to wet, m.
EDGE = 0.008
# Least distance of a leak to the tunnel's ends, to the floor, to obstacles, to other leaks, m.
END, FLOOR_MARGIN, OBSTACLE_MARGIN, LEAK_MARGIN = 1.0, 0.3, 0.25, 0.3


@dataclass(frozen=True)
class Leak:
    """Wet patch: id, outline in the unrolled plane (m), area on the surface (m²), darkening (dB).

    ``kind`` is wall, joint (along one), niche (on its back wall), or a particular place: cable (across fixtures along the
    wall), foot (beside the floor), springline, pocket (a bolt's), ring (from foot to foot) or panel. With drips the outline
    has several parts.
    """

    id: int
    polygon: Polygon | MultiPolygon
    area_surface: float
    drop: float
    kind: str = "wall"

    @property
    def area(self) -> float:
        """Area in the unrolled plane, m²."""
        return float(self.polygon.area)


def star(rng: np.random.Generator, elongation: float) -> Polygon:
    """Return a closed curve around the origin, its radius perturbed by a few harmonics; longer along arc."""
    angle = np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    radius = np.ones_like(angle)
    for k in range(2, 9):
        radius += rng.normal(0.0, 0.22 / k) * np.cos(k * angle + rng.uniform(0.0, 2.0 * np.pi))
    radius = np.maximum(radius, 0.35)
    return Polygon(np.column_stack([radius * np.cos(angle), elongation * radius * np.sin(angle)]))


def wet_patch(rng: np.random.Generator, area: float, down: int, holed: bool) -> Polygon:
    """Return a patch of the given area around the origin; large ones have drips in the direction ``down`` (+1 or -1 in arc)."""
    patch: BaseGeometry = star(rng, float(rng.uniform(0.8, 1.8)))
    if area > 0.3:
        for _ in range(int(rng.integers(1, 4))):
            width, length = rng.uniform(0.12, 0.22), rng.uniform(1.0, 2.2)
            x = rng.uniform(-0.6, 0.6)
            y = np.linspace(0.0, down * length, 20)
            taper = np.linspace(1.0, 0.5, 20)
            sway = x + 0.08 * np.sin(3.0 * y + rng.uniform(0.0, 6.0))
            left = np.column_stack([sway - width * taper, y])
            right = np.column_stack([sway + width * taper, y])[::-1]
            patch = patch.union(Polygon(np.vstack([left, right])).buffer(0.03))
    if holed:
        patch = patch.difference(affinity.scale(star(rng, 1.0), 0.35, 0.35))
    if not isinstance(patch, Polygon):
        patch = max(patch.geoms, key=lambda g: g.area)
    scale = math.sqrt(area / patch.area)
    return affinity.scale(patch.simplify(0.004), scale, scale, origin=(0.0, 0.0))


class FreeArea:
    """Free area for leaks on the lining, away from obstacles, floor, tunnel ends and other leaks.

    ``runs`` are the fixtures along the tunnel, walls and floor, which a leak may be allowed to cross.
    """

    def __init__(self, tunnel: Tunnel, obstacles: list[Polygon], runs: Sequence[Polygon] = ()) -> None:
        line = tunnel.line
        self.start, self.end = line.start + END, line.end - END
        self.lowest = tunnel.section.floor_arc - FLOOR_MARGIN
        self._taken = [prep(o.buffer(OBSTACLE_MARGIN)) for o in obstacles]
        self._runs = [prep(r.buffer(OBSTACLE_MARGIN)) for r in runs]
        self._foot = tunnel.section.floor_arc
        self._leaks: list[BaseGeometry] = []

    def fits(self, outline: BaseGeometry, across: bool = False) -> bool:
        """Return True if a leak fits there; with ``across`` it may extend to the floor and cross fixtures along the tunnel."""
        left, low, right, high = outline.bounds
        lowest, taken = (self._foot, self._taken) if across else (self.lowest, self._taken + self._runs)
        inside = low >= -lowest and high <= lowest and left > self.start and right < self.end
        return inside and outline.is_valid and not any(t.intersects(outline) for t in taken)

    def reserve(self, outline: BaseGeometry) -> None:
        """Reserve an area."""
        self._leaks.append(outline)
        self._taken.append(prep(outline.buffer(LEAK_MARGIN)))

    def fits_drip(self, drip: BaseGeometry, leak: BaseGeometry) -> bool:
        """Return True if a drip fits there: on the lining, separate from its own leak and from all others."""
        others = [k for k in self._leaks if k is not leak]
        low, high = drip.bounds[1::2]
        inside = low > -self.lowest and high < self.lowest
        return inside and drip.distance(leak) > EDGE and all(drip.distance(k) > 0.5 * LEAK_MARGIN for k in others)


def place(
    tunnel: Tunnel,
    free_area: FreeArea,
    count: int,
    area: tuple[float, float],
    drop: tuple[float, float],
    rng: np.random.Generator,
) -> list[Leak]:
    """Place ``count`` patches on free areas of the lining.

    Areas are log-uniform between the limits (m²), darkenings uniform (dB); every third patch of 0.5 m² or more has
    a hole. The largest are placed first, so that they fit into a crowded tunnel.
    """
    line = tunnel.line
    sizes = np.sort(np.exp(rng.uniform(math.log(area[0]), math.log(area[1]), count)))[::-1]
    end_margin = min(3.0, 0.1 * (line.end - line.start))
    leaks = []
    for number, size in enumerate(sizes):
        for _ in range(600):
            s = float(rng.uniform(line.start + end_margin, line.end - end_margin))
            arc = float(rng.uniform(-free_area.lowest, free_area.lowest))
            polygon = wet_patch(rng, float(size), 1 if arc >= 0 else -1, number % 3 == 0 and size >= 0.5)
            for _ in range(2):  # simplification changed the area slightly
                factor = math.sqrt(size / polygon.area)
                polygon = affinity.scale(polygon, factor, factor, origin=(0.0, 0.0))
            polygon = affinity.translate(polygon, s, arc)
            if free_area.fits(polygon):
                break
        else:
            raise UserError(f"no room on the lining for leak {number + 1} of {count} ({size:.2f} m²); use fewer or smaller")
        free_area.reserve(polygon)
        centre = polygon.representative_point()
        factor = float(tunnel.area_factor(np.array([centre.x]), np.array([centre.y]))[0])
        leaks.append((polygon, polygon.area * factor, float(rng.uniform(*drop))))
    leaks.sort(key=lambda item: item[0].centroid.x)
    return [Leak(i + 1, *item) for i, item in enumerate(leaks)]


def outline_edges(outlines: Sequence[Polygon | MultiPolygon]) -> tuple[Float, Int64]:
    """Return rows of edges (x1, y1, x2, y2) of outlines with their holes, and the first edge of each outline (n+1,)."""
    edges, first = [np.empty((0, 4))], [0]
    for outline in outlines:
        own = []
        for part in getattr(outline, "geoms", [outline]):
            for ring in (part.exterior, *part.interiors):
                xy = np.asarray(ring.coords)
                own.append(np.hstack([xy[:-1], xy[1:]]))
        edges += own
        first.append(first[-1] + sum(len(e) for e in own))
    return np.ascontiguousarray(np.vstack(edges)), np.array(first, dtype=np.int64)


def edge_table(leaks: list[Leak]) -> tuple[Float, Int64, Float]:
    """Return rows of edges (x1, y1, x2, y2), first edge of each leak (n+1,), and per leak: bounds (4) and darkening."""
    rows = np.zeros((len(leaks), 5))
    for row, leak in zip(rows, leaks, strict=True):
        row[:4], row[4] = leak.polygon.bounds, leak.drop
    return *outline_edges([leak.polygon for leak in leaks]), rows


@inner
def depth_inside(edges: Float, begin: int, end: int, x: float, y: float) -> float:
    """Return the distance of a point to the edges of a polygon, m, positive inside (holes are outside)."""
    best = 1e300
    inside = False
    for i in range(begin, end):
        x1, y1, x2, y2 = edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3]
        ex, ey = x2 - x1, y2 - y1
        share = ((x - x1) * ex + (y - y1) * ey) / (ex * ex + ey * ey)
        share = min(max(share, 0.0), 1.0)
        qx, qy = x - x1 - share * ex, y - y1 - share * ey
        best = min(best, qx * qx + qy * qy)
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * ex / ey:
            inside = not inside
    return math.sqrt(best) if inside else -math.sqrt(best)
