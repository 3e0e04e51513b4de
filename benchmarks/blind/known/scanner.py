"""Static stations and profilers: which rays they send."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.blind.known.rays import Hits, Rays
from benchmarks.blind.known.section import Array

if TYPE_CHECKING:
    from benchmarks.blind.known.site import Site

NEAREST, FARTHEST = 1.5, 25.0


@dataclass(frozen=True)
class Sweep:
    """Rays of one station or of some profiles, and where they meet the smooth lining or floor."""

    station: int
    rays: Rays
    hits: Hits


@dataclass(frozen=True)
class Stations:
    """Static scans, thinned to one point a cell and station as in delivered clouds.

    Attributes
    ----------
    places : tuple
        (chainage, y, z) of each.
    angle : float
        Angular step, radians.
    cell : float
        Side of the thinning cell.
    far : float
        Longest range that is kept.
    """

    places: tuple[tuple[float, float, float], ...]
    angle: float
    cell: float
    far: float = 18.0

    def sweeps(self, site: Site, rng: np.random.Generator) -> Iterator[Sweep]:
        """One sweep a station."""
        start = 200_000.0
        for number, place in enumerate(self.places, start=1):
            yield self._sweep(site, rng, number, place, start)
            start += 600.0

    def _sweep(
        self, site: Site, rng: np.random.Generator, number: int, place: tuple[float, float, float], start: float
    ) -> Sweep:
        u0, y0, z0 = place
        azimuth = np.arange(0.0, 2 * np.pi, self.angle) + rng.uniform(0, self.angle)
        elevation = np.arange(np.radians(-62.0), np.radians(90.0), self.angle)
        az, el = (grid.ravel() for grid in np.meshgrid(azimuth, elevation, indexing="ij"))
        flat = np.cos(el)
        direction = np.column_stack([flat * np.cos(az), flat * np.sin(az), np.sin(el)])
        flat_two = np.hypot(direction[:, 1], direction[:, 2])
        s, gap = site.section.cast(y0, z0, np.arctan2(direction[:, 2], direction[:, 1]))
        t = gap / np.maximum(flat_two, 1e-6)
        u = u0 + t * direction[:, 0]
        good = (t > NEAREST) & (t < min(self.far, FARTHEST)) & (u > 0.0) & (u < site.length)
        kept = np.flatnonzero(good)
        kept = kept[self._thin(u[kept], s[kept], site, rng)]
        time = start + 300.0 * kept / len(az)
        rays = Rays(np.tile([u0, y0, z0], (len(kept), 1)), direction[kept], time, 0.0)
        sort = kept[rays.order]
        return Sweep(number, rays, _hits(site, t[sort], u[sort], s[sort], rays))

    def _thin(self, u: Array, s: Array, site: Site, rng: np.random.Generator) -> Array:
        columns = int(site.section.total / self.cell) + 1
        key = (u / self.cell).astype(np.int64) * columns + (s / self.cell).astype(np.int64)
        shuffled = rng.permutation(len(key))
        slot = np.full(int(key.max()) + 1, -1, np.int64)
        slot[key[shuffled]] = shuffled
        chosen: Array = np.sort(slot[slot >= 0])
        return chosen


@dataclass(frozen=True)
class Profiler:
    """A mobile profiler.

    Attributes
    ----------
    y, z : float
        Its mean place in the section.
    spacing : float
        Distance of profiles at mean speed.
    angle : float
        Angular step, radians.
    speed, wander : float
        m/s; and by how much its place varies (m, standard deviation).
    blind : float
        Half angle downwards that the vehicle hides, degrees.
    """

    y: float
    z: float
    spacing: float
    angle: float
    speed: float = 1.2
    wander: float = 0.015
    blind: float = 28.0

    def trajectory(self, site: Site, rng: np.random.Generator) -> Array:
        """Rows of time, chainage, y, z, ten a second."""
        duration = site.length / self.speed
        time = np.arange(0.0, duration + 0.45, 0.1)
        knots = np.linspace(0.0, duration + 0.5, max(6, int(duration / 3.0)))
        moves = np.clip(rng.normal(0.0, self.wander, (2, len(knots))), -2 * self.wander, 2 * self.wander)
        y = self.y + np.interp(time, knots, moves[0])
        z = self.z + np.interp(time, knots, 0.5 * moves[1])
        pace = self.speed * (1.0 + 0.06 * np.sin(2 * np.pi * time / 11.0))
        u = np.concatenate([[0.0], np.cumsum(0.05 * (pace[1:] + pace[:-1]))]) - 0.05
        return np.column_stack([310_000.0 + time, u, y, z])

    def sweeps(self, site: Site, rng: np.random.Generator, path: Array) -> Iterator[Sweep]:
        """Sweeps of some two hundred profiles."""
        turn = self.spacing / self.speed
        times = np.arange(path[0, 0] + 0.06, path[-1, 0] - 0.01, turn)
        for start in range(0, len(times), 250):
            sweep = self._sweep(site, rng, times[start : start + 250], turn, path)
            if sweep is not None:
                yield sweep

    def _sweep(self, site: Site, rng: np.random.Generator, times: Array, turn: float, path: Array) -> Sweep | None:
        y0, z0 = (np.interp(times, path[:, 0], path[:, k]) for k in (2, 3))
        blind = np.radians(self.blind)
        columns: list[tuple[Array, Array, Array]] = []
        for k in range(len(times)):
            phi = np.arange(-np.pi / 2 + blind, 1.5 * np.pi - blind, self.angle) + rng.uniform(0, self.angle)
            s, gap = site.section.cast(float(y0[k]), float(z0[k]), phi)
            columns.append((phi, s, gap))
        count = [len(column[0]) for column in columns]
        phi, s, t = (np.concatenate([column[k] for column in columns]) for k in range(3))
        time = np.repeat(times, count) + turn * (phi + np.pi / 2) / (2 * np.pi)
        u = np.interp(time, path[:, 0], path[:, 1])
        origin = np.column_stack([u, np.repeat(y0, count), np.repeat(z0, count)])
        direction = np.column_stack([np.zeros_like(phi), np.cos(phi), np.sin(phi)])
        good = (u > 0.0) & (u < site.length) & (t > NEAREST) & (t < FARTHEST)
        if not good.any():
            return None
        rays = Rays(origin[good], direction[good], time[good], 3.0 * self.wander)
        sort = np.flatnonzero(good)[rays.order]
        return Sweep(1, rays, _hits(site, t[sort], u[sort], s[sort], rays))


def _hits(site: Site, t: Array, u: Array, s: Array, rays: Rays) -> Hits:
    ty, tz = site.section.tangent(s)
    cos = -(rays.direction[:, 2] * ty - rays.direction[:, 1] * tz)
    return Hits(t, u, s, np.clip(cos, 0.02, 1.0))
