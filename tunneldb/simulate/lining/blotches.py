"""Irregular spots on the lining: salts, fringes of leaks, halos of grime, half rings of another shade.

Outlines do not depend on the detection method. Salts are a Boolean model: spots thrown at random until their expected union
covers the requested share (Chiu et al., Stochastic Geometry and its Applications, 2013, 3.1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import kernel
from tunneldb.errors import UserError
from tunneldb.simulate.lining.leaks import Leak, depth_inside, outline_edges, star
from tunneldb.simulate.lining.rings import Rings
from tunneldb.simulate.objects.fixtures import bin_of, bins
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

TRIES = 600
# Limits of the area of a spot of salts, m²; width of the rise of its level, m.
SALT_AREA, SALT_RISE = (0.01, 0.5), 0.02
# Fringes: limits of their level, as a share of that of salts.
FRINGE_LEVEL = (0.5, 1.0)
# Grime shaped like a leak: limits of its area, m², and darkening, dB; width of its halo, m.
HALO_AREA, HALO_DROP, HALO = (0.1, 1.5), (1.5, 5.0), 0.25
# Lengths of lining of one shade where there are no rings, m.
SHADE_LENGTH = (2.0, 8.0)
MIN_CLEARANCE = 0.1  # between halos, and between a halo and a leak, m


@dataclass(frozen=True)
class Blotch:
    """Spot on the lining: kind (salts, fringe, halo, shade), outline in the unrolled plane (m), level added inside (dB).

    From the outline inwards the level rises over ``rise`` m.
    """

    kind: str
    outline: Polygon
    level: float
    rise: float

    def polygon(self) -> Polygon | MultiPolygon:
        """Return the area with at least half of the level."""
        return self.outline.buffer(-0.5 * self.rise) if self.rise else self.outline


class BlotchTable(NamedTuple):
    """Blotches for the kernel: edges and the first edge of each, rows of bounds (4), level and rise, and both by chainage."""

    edges: Float
    first: Int64
    rows: Float
    bins: Int64
    listed: Int64


def blotch_table(blotches: list[Blotch], tunnel: Tunnel) -> BlotchTable:
    """Arrange blotches for the kernel."""
    rows = np.array([[*b.outline.bounds, b.level, b.rise] for b in blotches]).reshape(-1, 6)
    edges, first = outline_edges([b.outline for b in blotches])
    return BlotchTable(edges, first, rows, *bins(rows[:, 0], rows[:, 2], tunnel.line.start, tunnel.line.end))


@kernel
def add_blotches(table: BlotchTable, start: float, s: Float, arc: Float, out: Float) -> None:
    """Add the levels of blotches at positions (n,), dB; ``start`` is the chainage of the tunnel's start, m."""
    for i in range(s.shape[0]):
        x, y = s[i], arc[i]
        b = bin_of(x, start, table.bins)
        for j in range(table.bins[b], table.bins[b + 1]):
            k = table.listed[j]
            if x < table.rows[k, 0] or x > table.rows[k, 2] or y < table.rows[k, 1] or y > table.rows[k, 3]:
                continue
            depth = depth_inside(table.edges, table.first[k], table.first[k + 1], x, y)
            if depth > 0.0:
                share = min(depth / table.rows[k, 5], 1.0) if table.rows[k, 5] > 0.0 else 1.0
                out[i] += table.rows[k, 4] * share * share * (3.0 - 2.0 * share)


def _spot(area: float, s: float, arc: float, rng: np.random.Generator) -> Polygon:
    """Return a spot of irregular shape around a position."""
    shape = star(rng, float(rng.uniform(0.6, 2.5)))
    scale = math.sqrt(area / shape.area)
    return affinity.translate(affinity.scale(shape, scale, scale, origin=(0.0, 0.0)), s, arc)


def _polygons(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a shape."""
    return [part for part in getattr(shape, "geoms", [shape]) if isinstance(part, Polygon) and part.area > 1e-4]


def _salts(p: Parameters, lining: Polygon, taken: BaseGeometry, rng: np.random.Generator) -> list[Blotch]:
    """Return bright salts over a share of the lining, away from leaks."""
    if p.salts == 0.0:
        return []
    low, high = (math.log(area) for area in SALT_AREA)
    mean = (SALT_AREA[1] - SALT_AREA[0]) / (high - low)  # of areas that are log-uniform
    count = -math.log1p(-0.01 * p.salts) * lining.area / mean
    left, bottom, right, top = lining.bounds
    spots = [
        _spot(math.exp(rng.uniform(low, high)), rng.uniform(left, right), rng.uniform(bottom, top), rng)
        for _ in range(max(1, round(count)))
    ]
    covered = unary_union(spots).intersection(lining).difference(taken)
    return [Blotch("salts", part, p.salt_level, SALT_RISE) for part in _polygons(covered)]


def _fringes(p: Parameters, lining: Polygon, leaks: list[Leak], wet: BaseGeometry, rng: np.random.Generator) -> list[Blotch]:
    """Return bright salts around each leak, where its water dries."""
    fringes = []
    for leak in leaks if p.salt_fringe else []:
        if leak.kind == "niche":
            continue
        level = p.salt_level * float(rng.uniform(*FRINGE_LEVEL))
        around = leak.polygon.buffer(p.salt_fringe).intersection(lining).difference(wet)
        fringes += [Blotch("fringe", part, level, min(SALT_RISE, 0.4 * p.salt_fringe)) for part in _polygons(around)]
    return fringes


def _halos(p: Parameters, lining: Polygon, taken: BaseGeometry, rng: np.random.Generator) -> list[Blotch]:
    """Return grime shaped like leaks, fading over a wide halo."""
    halos: list[Blotch] = []
    left, bottom, right, top = lining.bounds
    for number in range(p.halos):
        for _ in range(TRIES):
            area = math.exp(rng.uniform(math.log(HALO_AREA[0]), math.log(HALO_AREA[1])))
            spot = _spot(area, rng.uniform(left, right), rng.uniform(bottom, top), rng).buffer(HALO)
            margin = spot.buffer(MIN_CLEARANCE)
            if lining.contains(spot) and not margin.intersects(taken) and not any(margin.intersects(h.outline) for h in halos):
                break
        else:
            raise UserError(f"no room on the lining for halo {number + 1} of {p.halos}; use fewer halos or leaks")
        halos.append(Blotch("halo", spot, -float(rng.uniform(*HALO_DROP)), HALO))
    return halos


def _shades(p: Parameters, tunnel: Tunnel, rings: Rings, rng: np.random.Generator) -> list[Blotch]:
    """Return half rings, from the crown down, each darker or brighter than its neighbours by a step."""
    if p.shade == 0.0:
        return []
    line, lowest = tunnel.line, tunnel.section.floor_arc
    if rings.length:
        edges = rings.first + np.arange(rings.level.size + 1) * rings.length
    else:
        edges = line.start + np.cumsum(rng.uniform(*SHADE_LENGTH, math.ceil((line.end - line.start) / SHADE_LENGTH[0])))
    edges = np.unique(np.concatenate([[line.start], edges[(edges > line.start) & (edges < line.end)], [line.end]]))
    shades = []
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        for low, high in ((-lowest, 0.0), (0.0, lowest)):
            shades.append(Blotch("shade", box(begin, low, end, high), p.shade * float(rng.standard_normal()), 0.0))
    return shades


def place_blotches(
    parameters: Parameters,
    tunnel: Tunnel,
    rings: Rings,
    leaks: list[Leak],
    taken: list[BaseGeometry],
    seed: np.random.SeedSequence,
) -> list[Blotch]:
    """Return the requested salts, fringes, halos and shades, away from leaks; halos also avoid ``taken``.

    Raises
    ------
    UserError
        If there is no space for all halos.
    """
    p, line, lowest = parameters, tunnel.line, tunnel.section.floor_arc
    streams = [np.random.default_rng(s) for s in seed.spawn(4)]
    lining = box(line.start, -lowest, line.end, lowest)
    wet = unary_union([leak.polygon for leak in leaks])
    full = unary_union([wet, *taken])
    shapely.prepare(full)
    salts, fringes = _salts(p, lining, full, streams[0]), _fringes(p, lining, leaks, wet, streams[1])
    return salts + fringes + _halos(p, lining, full, streams[2]) + _shades(p, tunnel, rings, streams[3])
