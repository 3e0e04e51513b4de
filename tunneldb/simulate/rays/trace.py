"""Rays from a scanner to their first hits in a synthetic tunnel, and the measured values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.instrument import noise_scale
from tunneldb.simulate.lining.ballast import Ground, bumps, intersect_ground
from tunneldb.simulate.lining.reflectance import Reflectance, level
from tunneldb.simulate.lining.relief import LiningRelief, intersect_relief
from tunneldb.simulate.objects.fixtures import APPENDAGE, FLOOR, LINING, NICHE, OUTLIER
from tunneldb.simulate.objects.mesh import Mesh, intersect_mesh
from tunneldb.simulate.objects.primitives import BEAM, Parts, intersect_parts
from tunneldb.simulate.rays.intersect import intersect_appendages, intersect_lining, intersect_niches, wetness
from tunneldb.simulate.rays.scene import Scene
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Cosine of incidence below which a scanner receives no echo.
MINIMUM_COSINE = 0.087
# Share of the rays near an edge of a free-standing object that give a mixed pixel.
MIXED_SHARE = 0.1
# Least range of the scanner, m.
MIN_RANGE = 1.0
PIECE = 1 << 16  # rays that are traced at a time
BUMP = 0.12  # half the wavelength of the small-scale relief, m


class Echoes(NamedTuple):
    """Measurements of the rays with an echo, (m,) each.

    Attributes
    ----------
    ray
        Number of the ray.
    measured
        Range with its error, m.
    xyz : (m, 3)
        Stored point, relative to the line's origin, m.
    chainage, arc, offset
        Coordinates of the stored point, m.
    klass
        Class of the hit surface.
    leak
        Number of the leak at the hit, -1 for none.
    drop
        Darkening at the hit, dB.
    cosine
        Cosine of incidence.
    range
        Range without error, m.
    thing
        Number of the free-standing object at the hit, 0 for none.
    """

    ray: Int64
    measured: Float
    xyz: Float
    chainage: Float
    arc: Float
    offset: Float
    klass: Int64
    leak: Int64
    drop: Float
    cosine: Float
    range: Float
    thing: Int64

    def take(self, rows: Int64) -> Echoes:
        """Return some of them."""
        return Echoes(*(column[rows] for column in self))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Tracer:
    """Tunnel with its contents, and measurement by a scanner.

    Attributes
    ----------
    tunnel, scene
        Tunnel, fixtures, and leaks.
    parts, ground, reflectance, lining_relief
        Free-standing objects, uneven floor, variation of the lining's reflectance, and its deviation from the section;
        None: none, level, uniform, none.
    outliers : float
        Share of rays that become isolated points.
    stray : float
        1: a fixed share of the rays at fixtures and edges gives mixed pixels; 0: none, the beam's footprint gives them.
    relief : float
        Height of small-scale relief of the lining, m.
    furthest : float
        Greatest range, m.
    mesh : Mesh or None
        Wires in front of the lining.
    noise_growth : float
        Growth of the error of ranges with range (:func:`noise_scale`).
    """

    tunnel: Tunnel
    scene: Scene
    parts: Parts | None
    ground: Ground | None
    reflectance: Reflectance | None
    lining_relief: LiningRelief | None
    outliers: float
    stray: float
    relief: float
    furthest: float
    mesh: Mesh | None = None
    noise_growth: float = 0.0

    def trace(self, origin: Float, direction: Float, hint: Float, noise: Float, chance: Float) -> Echoes:
        """Cast rays.

        Parameters
        ----------
        origin, direction : (n, 3)
            Origins relative to the line's origin, m; unit vectors.
        hint : (n,)
            Chainage near each origin, m.
        noise : (n,)
            Range error, m.
        chance : (n, 2)
            Uniform random numbers for outliers and their positions.
        """
        pieces = []
        for begin in range(0, max(len(origin), 1), PIECE):
            some = slice(begin, begin + PIECE)
            piece = self._trace(origin[some], direction[some], hint[some], noise[some], chance[some])
            pieces.append(piece._replace(ray=piece.ray + begin))
        return Echoes(*(np.concatenate(columns) for columns in zip(*pieces, strict=True)))

    def _trace(self, origin: Float, direction: Float, hint: Float, noise: Float, chance: Float) -> Echoes:
        """Cast rays, in pieces whose arrays fit into the processor's cache."""
        scene, n = self.scene, len(origin)
        start, end, floor_arc, reach, _, _ = scene.ends.tolist()
        shape = scene.plan, scene.profile, scene.parts
        found = np.empty((6, n))
        intersect_lining(*shape, origin, direction, hint, 2.0 * self.furthest, found)
        wall, s, arc, cosine, offset0, s0 = found
        klass = np.where(np.abs(arc) > floor_arc, FLOOR, LINING)
        leak, drop, height, thing, edge = np.full(n, -1), np.zeros(n), np.zeros(n), np.zeros(n, np.int64), np.ones(n)
        if self.ground is not None:
            on_floor = klass == FLOOR
            intersect_ground(self.ground, *shape[:2], origin, direction, found, on_floor)
            klass = np.where(on_floor, FLOOR, LINING)
        is_open = np.isnan(wall)
        inside = offset0 > 0.0
        r = wall.copy()
        which = np.full(n, -1)
        if len(scene.items):
            intersect_appendages(
                *shape[:2], start, reach, scene.items, scene.item_bins, scene.item_list, origin, direction, found, r, which
            )
            met = np.flatnonzero(which >= 0)
            klass[met] = scene.items[which[met], 9]
            drop[met] = scene.items[which[met], 10]
        bare = np.flatnonzero((klass == LINING) & inside & ~is_open)
        if len(scene.niches):
            bare = self._niches(bare, origin, direction, found, r, klass, leak, drop)
        if self.lining_relief is not None:
            on_floor = np.empty(len(bare), dtype=bool)
            intersect_relief(self.lining_relief, *shape, origin, direction, bare, found, on_floor)
            r[bare] = wall[bare]
            klass[bare[on_floor]] = FLOOR
        if self.relief > 0.0:
            height[bare] = self.relief * bumps(s[bare], arc[bare], BUMP)
        bare = bare[klass[bare] == LINING]
        at = s[bare], arc[bare]
        leak[bare], drop[bare] = wetness(scene, *at)
        if self.reflectance is not None:
            drop[bare] -= level(self.reflectance, *at)
        if self.mesh is not None:
            rays, at_wire = intersect_mesh(self.mesh, self.tunnel, origin, direction, bare, found, r)
            r[rays], klass[rays], drop[rays], leak[rays], height[rays] = at_wire, APPENDAGE, self.mesh.drop, -1, 0.0
        behind = wall
        if self.parts is not None:
            r[is_open] = 2.0 * self.furthest
            behind = wall.copy()
            far = r.copy()
            which = np.full(n, -1)
            intersect_parts(self.parts, start, origin, direction, found, r, which, edge)
            met = np.flatnonzero(which >= 0)
            s[met] = s0[met] + (s[met] - s0[met]) * r[met] / far[met]
            behind[met], height[met], leak[met] = far[met], 0.0, -1
            kind, darker, number = self.parts.labels[which[met]].T
            klass[met], drop[met], thing[met] = kind, darker, number
            is_open &= which < 0
        # Written with NOT: if the incidence is undefined (NaN), the echo is kept.
        keep = np.flatnonzero(inside & ~is_open & ~((r > self.furthest) | (cosine < MINIMUM_COSINE)))
        true = r[keep]
        noise = noise[keep] * noise_scale(self.noise_growth, true)
        measured = true + noise
        if self.relief > 0.0:
            measured = true + (noise - height[keep] / np.maximum(cosine[keep], 0.3))
        klass, drop, leak, thing = klass[keep], drop[keep], leak[keep], thing[keep]
        is_stray = self._stray(measured, klass, thing, behind[keep], edge[keep], chance[keep])
        klass[is_stray], leak[is_stray], thing[is_stray] = OUTLIER, -1, 0
        drop[is_stray] += 3.0
        xyz = origin[keep] + measured[:, None] * direction[keep]
        place = self.tunnel.unroll_near(xyz, s[keep], 1e-3)
        echoes = Echoes(
            keep,
            measured,
            xyz,
            place.chainage,
            place.arc,
            place.offset,
            klass,
            leak,
            drop,
            np.minimum(cosine[keep], 1.0),
            true,
            thing,
        )
        within = (measured >= MIN_RANGE) & (measured <= self.furthest) & (place.chainage >= start) & (place.chainage <= end)
        return echoes if within.all() else echoes.take(np.flatnonzero(within))

    def _niches(
        self,
        bare: Int64,
        origin: Float,
        direction: Float,
        found: Float,
        r: Float,
        klass: Int64,
        leak: Int64,
        drop: Float,
    ) -> Int64:
        """Replace hits of rays that enter niches, among those without other hits; return the other rays."""
        wall, s, _, cosine, _, _ = found
        into, hit, c, is_back = intersect_niches(self.scene, origin, direction, bare, s[bare], wall[bare])
        rays = bare[into]
        r[rays], cosine[rays], klass[rays] = hit, c, NICHE
        if self.scene.ends[5] > 0.0:
            back = rays[is_back]
            place = self.tunnel.unroll_near(origin[back] + r[back, None] * direction[back], s[back], 1e-6)
            leak[back], drop[back] = wetness(self.scene, place.chainage, place.arc)
        return np.delete(bare, into)

    def _stray(self, measured: Float, klass: Int64, thing: Int64, behind: Float, edge: Float, chance: Float) -> Int64:
        """Move isolated points and mixed pixels; return their indices."""
        candidates = np.flatnonzero(chance[:, 0] < self.outliers + max(MIXED_SHARE, 0.01) * self.stray)
        u, v = chance[candidates].T
        is_isolated = u < self.outliers
        kind, number = klass[candidates], thing[candidates]
        is_mixed = (kind == APPENDAGE) & (number == 0) & (u < self.outliers + 0.01 * self.stray)
        is_mixed |= (number > 0) & (edge[candidates] < BEAM)
        r = measured[candidates]
        # Most isolated points are in the air, some behind the wall (multipath).
        isolated = np.where(v < 0.7, MIN_RANGE + v / 0.7 * (0.95 * r - MIN_RANGE), r * (1.0 + 0.5 * (v - 0.7)))
        # A mixed pixel: the beam hits an edge and the surface behind it.
        mixed = r + v * (behind[candidates] - r)
        measured[candidates] = np.where(is_isolated, isolated, np.where(is_mixed, mixed, r))
        return candidates[is_isolated | is_mixed]
