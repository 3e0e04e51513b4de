"""Fixtures on the lining and recesses in it: cables, trays, boxes, lamps, rails, refuge niches.

A fixture is a tube or a bar swept along the tunnel: its cross-section is constant in (u, w) between two
chainages. A niche is a rectangular recess, straight (not curved with the tunnel), including its floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon, box

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import inner
from tunneldb.simulate.tunnel.tunnel import Tunnel

TUBE, BAR = 0.0, 1.0
LINING, FLOOR, APPENDAGE, NICHE, OUTLIER, RAIL, OBJECT, SPHERE = 0, 1, 2, 3, 4, 5, 6, 7

# Length of chainage bins, m; objects within REACH of a bin are listed in it.
BIN = 2.0
REACH = 1.0


@dataclass(frozen=True)
class Appendage:
    """Fixture on the lining.

    Attributes
    ----------
    kind : str
        cable, pipe, tray, duct, trunking, sheet, box, sign, lamp or rail; walkway, kerb or carriageway.
    start, end : float
        Chainage, m.
    arc : float
        Arc of its middle on the section, m.
    standoff : float
        Distance of its middle from the surface, m.
    width, depth : float
        Size along the section and away from the surface, m; both are the diameter of a tube.
    drop : float
        Darkening relative to the lining, dB.
    """

    kind: str
    start: float
    end: float
    arc: float
    standoff: float
    width: float
    depth: float
    drop: float

    @property
    def is_tube(self) -> bool:
        """True if it is round."""
        return self.kind in ("cable", "pipe")

    @property
    def is_run(self) -> bool:
        """True if it extends along the wall from end to end."""
        return self.kind in ("cable", "pipe", "tray", "duct", "trunking")

    @property
    def klass(self) -> int:
        """Class of its points; surfaces for walking or driving are floor."""
        return {"rail": RAIL, "walkway": FLOOR, "kerb": FLOOR, "carriageway": FLOOR}.get(self.kind, APPENDAGE)

    def footprint(self) -> Polygon:
        """Return the area of the unrolled plane that it covers, seen along the normal."""
        return box(self.start, self.arc - 0.5 * self.width, self.end, self.arc + 0.5 * self.width)


@dataclass(frozen=True)
class Niche:
    """Refuge in the wall: middle chainage, side (+1 right), width, height above the floor, depth; m."""

    chainage: float
    side: int
    width: float = 2.0
    height: float = 2.2
    depth: float = 0.9

    def footprint(self, tunnel: Tunnel) -> Polygon:
        """Return its opening in the unrolled plane."""
        section = tunnel.section
        arcs = np.linspace(0.0, section.floor_arc, 2001)
        w = section.point(arcs)[0][:, 1]
        top = float(arcs[np.argmin(np.abs(w - (section.floor + self.height)))])
        low, high = sorted((self.side * top, self.side * section.floor_arc))
        half = 0.5 * self.width
        return box(self.chainage - half, low, self.chainage + half, high)


# Sill of a niche above the floor, so that its bottom and the floor are two surfaces.
SILL = 0.05


def appendage_table(tunnel: Tunnel, items: list[Appendage]) -> Float:
    """Return rows for the ray kernel: kind, chainage from/to, middle u/w, tangent u/w, half width/depth, class, darkening."""
    rows = np.zeros((len(items), 11))
    for row, item in zip(rows, items, strict=True):
        point, normal = tunnel.section.point(np.array([item.arc]))
        (pu, pw), (nu, nw) = point[0], normal[0]
        row[:] = [
            TUBE if item.is_tube else BAR,
            item.start,
            item.end,
            pu + item.standoff * nu,
            pw + item.standoff * nw,
            -nw,
            nu,
            0.5 * item.width,
            0.5 * item.depth,
            item.klass,
            item.drop,
        ]
    return rows


def niche_table(tunnel: Tunnel, niches: list[Niche]) -> Float:
    """Return rows: chainage from/to, origin (3, from the line's origin), t (3), outward (3), up (3), half width, height, depth.

    The origin is on the axis above the sill; depth is measured from the axis to the back wall.
    """
    rows = np.zeros((len(niches), 17))
    for row, niche in zip(rows, niches, strict=True):
        frame = tunnel.line.frame(np.array([niche.chainage]))
        section = tunnel.section
        arcs = np.linspace(0.0, section.floor_arc, 2001)
        points = section.point(arcs)[0]
        middle = section.floor + 0.5 * niche.height
        wall = float(points[np.argmin(np.abs(points[:, 1] - middle) + 10 * (points[:, 0] < 0)), 0])
        t, up = frame.t[0], frame.w[0]
        origin = frame.position[0] - tunnel.line.origin + (section.floor + SILL) * up
        half = 0.5 * niche.width
        row[:2] = niche.chainage - half - REACH, niche.chainage + half + REACH
        row[2:5], row[5:8], row[8:11], row[11:14] = origin, t, niche.side * frame.u[0], up
        row[14:] = half, niche.height - SILL, wall + niche.depth
    return rows


def bins(low: Float, high: Float, start: float, end: float) -> tuple[Int64, Int64]:
    """List by chainage bin the intervals [low, high] within REACH: (offsets (b+1,), indices)."""
    count = max(1, math.ceil((end - start) / BIN))
    lists = []
    for b in range(count):
        left, right = start + b * BIN - REACH, start + (b + 1) * BIN + REACH
        lists.append(np.flatnonzero((high >= left) & (low <= right)))
    offsets = np.concatenate([[0], np.cumsum([len(x) for x in lists])]).astype(np.int64)
    return offsets, (np.concatenate(lists) if lists else np.empty(0)).astype(np.int64)


@inner
def bin_of(s: float, start: float, offsets: Int64) -> int:
    """Return the bin of a chainage, the first or last one beyond the ends."""
    return min(max(math.floor((s - start) / BIN), 0), offsets.shape[0] - 2)


def listed_pairs(s: Float, start: float, offsets: Int64, listed: Int64) -> tuple[Int64, Int64]:
    """Return pairs of positions at chainages (n,) and the items in their bins: indices of the position, and of the item."""
    b = np.clip(np.floor((s - start) / BIN), 0, len(offsets) - 2).astype(np.int64)
    count = offsets[b + 1] - offsets[b]
    place = np.repeat(np.arange(len(s)), count)
    return place, listed[np.arange(len(place)) + np.repeat(offsets[b] - (np.cumsum(count) - count), count)]


@inner
def distance(items: Float, k: int, s: float, u: float, w: float) -> float:
    """Return the signed distance to row k of :func:`appendage_table`, positive outside; m in (chainage, u, w)."""
    half = 0.5 * (items[k, 2] - items[k, 1])
    a = abs(s - items[k, 1] - half) - half
    du, dw = u - items[k, 3], w - items[k, 4]
    if items[k, 0] == TUBE:
        b = math.sqrt(du * du + dw * dw) - items[k, 7]
        if a <= 0.0 or b <= 0.0:
            return max(a, b)
        return math.sqrt(a * a + b * b)
    b = abs(du * items[k, 5] + dw * items[k, 6]) - items[k, 7]
    c = abs(-du * items[k, 6] + dw * items[k, 5]) - items[k, 8]
    if a <= 0.0 and b <= 0.0 and c <= 0.0:
        return max(a, max(b, c))
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return math.sqrt(a * a + b * b + c * c)


def furnish(tunnel: Tunnel, rng: np.random.Generator) -> list[Appendage]:
    """Return typical fixtures of a railway tunnel: cables, a tray, boxes and lamps, rails on the floor."""
    line, section = tunnel.line, tunnel.section
    start, end = line.start, line.end
    lining = section.floor_arc
    items = [Appendage("tray", start, end, -0.80 * lining, 0.13, 0.30, 0.10, 5.0)]
    for arc in (0.72 * lining, 0.72 * lining + 0.25, -0.62 * lining):
        off, thick, drop = rng.uniform((0.07, 0.04, 5.0), (0.15, 0.07, 7.0)).tolist()
        items.append(Appendage("cable", start, end, arc, off, thick, thick, drop))
    for s in np.arange(start + 12.0, end - 5.0, 30.0).tolist():
        at, drop = s + float(rng.uniform(-3.0, 3.0)), float(rng.uniform(4.0, 6.0))
        items.append(Appendage("box", at, at + 0.6, 0.55 * lining, 0.10, 0.45, 0.20, drop))
    lamps = np.arange(start + 5.0, end - 2.0, 12.0).tolist()
    items += [Appendage("lamp", s, s + 1.2, 0.22 * lining, 0.15, 0.16, 0.12, 5.0) for s in lamps]
    rails = section.half_perimeter - 0.75, 0.75 - section.half_perimeter
    items += [Appendage("rail", start, end, arc, 0.085, 0.07, 0.17, 3.0) for arc in rails]
    return items


def refuges(tunnel: Tunnel, spacing: float = 60.0) -> list[Niche]:
    """Return refuge niches on alternating sides; at least one, in the middle of a short tunnel."""
    start, end = tunnel.line.start, tunnel.line.end
    places = np.arange(start + 0.5 * spacing, end - 3.0, spacing)
    if places.size == 0 and end - start > 10.0:
        places = np.array([0.5 * (start + end)])
    return [Niche(float(s), 1 if i % 2 == 0 else -1) for i, s in enumerate(places)]
