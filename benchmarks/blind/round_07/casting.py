"""Rays against a lining and its fittings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .canvas import Canvas
from .fittings import Fitting
from .section import Array, Section

LINING = -1


def bilinear(grid: NDArray[np.float32], i: Array, j: Array) -> Array:
    """Values of a grid between its cells."""
    i, j = np.clip(i, 0, grid.shape[0] - 1.001), np.clip(j, 0, grid.shape[1] - 1.001)
    i0, j0 = i.astype(np.int32), j.astype(np.int32)
    fi, fj = (i - i0).astype(np.float32), (j - j0).astype(np.float32)
    top = grid[i0, j0] * (1 - fj) + grid[i0, j0 + 1] * fj
    return (top * (1 - fi) + (grid[i0 + 1, j0] * (1 - fj) + grid[i0 + 1, j0 + 1] * fj) * fi).astype(float)


@dataclass
class Hits:
    """Where rays end: distance, place on the lining, normal and what was met."""

    distance: Array
    u: Array
    s: Array
    normal: Array
    met: NDArray[np.int32]


class Tunnel:
    """A lining with its fittings, for rays from one line along the tunnel.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    fittings : sequence of Fitting
        What is before it.
    offset, height : float
        The line on which the scanner stands or moves.
    steps : int
        Steps in which a ray searches the unevenness of the lining.
    """

    def __init__(self, canvas: Canvas, fittings: Sequence[Fitting], offset: float, height: float, steps: int = 2) -> None:
        self.canvas, self.fittings, self.steps = canvas, fittings, steps
        self.origin = np.array([offset, height])
        self.angles, self.chords = canvas.section.first_hits((offset, height))
        self.slopes = [np.asarray(g, dtype=np.float32) for g in np.gradient(canvas.height, canvas.cell)]

    def cells(self, u: Array, s: Array) -> tuple[Array, Array]:
        """Places on the canvas, counted in cells."""
        return u / self.canvas.cell - 0.5, (s - self.canvas.origin) / self.canvas.cell - 0.5

    def cast(self, start: Array, rays: Array) -> Hits:
        """Follow rays that start at some chainages and are sorted by their angle about the axis."""
        section: Section = self.canvas.section
        angle = np.arctan2(rays[:, 2], rays[:, 1])
        near = np.round((angle + np.pi) / (2 * np.pi) * len(self.angles)).astype(int) % len(self.angles)
        chord = self.chords[near]
        first = section.points[chord] - self.origin
        tangent, normal = section.tangents[chord], section.normals[chord]
        slant = -(rays[:, 1:] * normal).sum(axis=1)
        distance = -(first * normal).sum(axis=1) / np.maximum(slant, 1e-9)
        glide = (rays[:, 1:] * tangent).sum(axis=1)
        s = section.s[chord] + ((distance[:, None] * rays[:, 1:] - first) * tangent).sum(axis=1)
        distance = self._uneven(start, rays, distance, s, slant, glide)
        flat = -(first * normal).sum(axis=1) / np.maximum(slant, 1e-9)
        s += (distance - flat) * glide
        u = start + distance * rays[:, 0]
        inside = (u > 0) & (u < self.canvas.length)
        i, j = self.cells(u, s)
        along, around = (bilinear(slope, i, j) for slope in self.slopes)
        facing = np.column_stack([-along, normal - around[:, None] * tangent])
        facing /= np.linalg.norm(facing, axis=1)[:, None]
        hits = Hits(np.where(inside, distance, np.inf), u, s, facing, np.full(len(rays), LINING, dtype=np.int32))
        self._fittings(start, rays, angle, hits)
        return hits

    def _uneven(self, start: Array, rays: Array, flat: Array, s: Array, slant: Array, glide: Array) -> Array:
        """Distance to the uneven lining, from that to the even one."""
        height = self.canvas.height
        slant = np.maximum(slant, 0.08)

        def below(distance: Array) -> Array:
            i, j = self.cells(start + distance * rays[:, 0], s + (distance - flat) * glide)
            return bilinear(height, i, j) - (flat - distance) * slant

        high, low = float(height.max()) + 1e-4, float(height.min()) - 1e-4
        before = flat - high / slant
        behind = flat - low / slant
        found = np.zeros(len(flat), dtype=bool)
        for k in range(1, self.steps + 1):
            probe = flat - (high + (low - high) * k / self.steps) / slant
            open_rays = ~found
            hit = open_rays & (below(probe) >= 0)
            before = np.where(open_rays & ~hit, probe, before)
            behind = np.where(hit, probe, behind)
            found |= hit
        for _ in range(5):
            middle = (before + behind) / 2
            inside = below(middle) >= 0
            behind, before = np.where(inside, middle, behind), np.where(inside, before, middle)
        return (before + behind) / 2

    def _fittings(self, start: Array, rays: Array, angle: Array, hits: Hits) -> None:
        for index, fitting in enumerate(self.fittings):
            corners = np.array(fitting.shape.corners()) - self.origin
            middle = np.arctan2(*corners.mean(axis=0)[::-1])
            spread = np.mod(np.arctan2(corners[:, 1], corners[:, 0]) - middle + np.pi, 2 * np.pi) - np.pi
            low, high = middle + spread.min() - 1e-3, middle + spread.max() + 1e-3
            for turn in (-2 * np.pi, 0.0, 2 * np.pi):
                a, b = np.searchsorted(angle, [low + turn, high + turn])
                if a == b:
                    continue
                part = slice(a, b)
                origin = np.column_stack([start[part], np.broadcast_to(self.origin, (b - a, 2))])
                distance, normal = fitting.shape.meet(origin, rays[part])
                closer = np.flatnonzero(distance < hits.distance[part]) + a
                hits.distance[closer] = distance[closer - a]
                hits.normal[closer] = normal[closer - a]
                hits.met[closer] = index
                hits.u[closer] = start[closer] + distance[closer - a] * rays[closer, 0]
