"""Where scanners stand or travel, and the rays that they send."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import ndimage

from .arrays import FloatArray
from .tracing import Tunnel, trace

STATIC_STEP = 0.0013
COARSE = np.radians(1.5)
LOWEST = np.radians(-58)


@dataclass(frozen=True)
class Rays:
    """Rays of one station or of a part of a drive, ordered by time."""

    source: int
    origins: FloatArray
    directions: FloatArray
    times: FloatArray


class Stance(Protocol):
    """Static stations or a drive."""

    def rays(self, tunnel: Tunnel, rng: np.random.Generator) -> Iterator[Rays]: ...

    def towards(self, tunnel: Tunnel, s: FloatArray, u: FloatArray) -> Iterator[FloatArray]: ...


@dataclass(frozen=True)
class Stations:
    """Scanner on a tripod.

    Attributes
    ----------
    places : tuple
        Chainage, offset and height over the floor of each.
    density : float
        Points per square metre of lining to which each scan is thinned out.
    far : float
        Range to which it is used, metres.
    """

    places: tuple[tuple[float, float, float], ...]
    density: float
    far: float = 20.0
    start: float = 380_000.0

    def origin(self, tunnel: Tunnel, number: int) -> FloatArray:
        """Local coordinates of a station."""
        s, u, v = (np.array([value]) for value in self.places[number])
        return tunnel.line.local(s, u, v)[0]

    def rays(self, tunnel: Tunnel, rng: np.random.Generator) -> Iterator[Rays]:
        """Rays of each station."""
        for number in range(len(self.places)):
            origin = self.origin(tunnel, number)
            keep = self._share(tunnel, origin)
            azimuths = np.arange(0, 2 * np.pi, STATIC_STEP)
            elevations = np.arange(LOWEST, np.pi / 2, STATIC_STEP)
            chosen = []
            for part in np.array_split(azimuths, 40):
                where = np.meshgrid(part / COARSE, (elevations - LOWEST) / COARSE, indexing="ij")
                share = ndimage.map_coordinates(keep, np.stack(where), output=np.float32, order=1, mode="nearest")
                a, e = np.nonzero(rng.random(share.shape, dtype=np.float32) < np.exp(share))
                chosen.append(np.stack([part[a], elevations[e]], axis=1))
            azimuth, elevation = np.concatenate(chosen).T
            flat = np.cos(elevation)
            directions = np.stack([np.cos(azimuth) * flat, np.sin(azimuth) * flat, np.sin(elevation)], axis=1)
            times = self.start + number * 700 + azimuth * 30
            yield Rays(number + 1, np.broadcast_to(origin, directions.shape), directions, times)

    def _share(self, tunnel: Tunnel, origin: FloatArray) -> FloatArray:
        """Logarithm of the share of rays that is kept, over azimuth and elevation."""
        azimuth, elevation = np.meshgrid(
            np.arange(0, 2 * np.pi + COARSE, COARSE), np.arange(LOWEST, np.pi / 2 + COARSE, COARSE), indexing="ij"
        )
        flat = np.cos(elevation)
        directions = np.stack([np.cos(azimuth) * flat, np.sin(azimuth) * flat, np.sin(elevation)], axis=-1).reshape(-1, 3)
        bare = Tunnel(tunnel.line, tunnel.section, tunnel.canvas, (), tunnel.stride)
        hits = trace(bare, np.broadcast_to(origin, directions.shape), directions, 0.0003)
        distance = np.where(np.isfinite(hits.distance), hits.distance, 30.0)
        ends = bare.place(origin + directions * distance[:, None])
        normal_u, normal_v = tunnel.section.normal(ends.t)
        turned = tunnel.line.turn(ends.s, directions)
        cosine = np.abs(turned[:, 1] * normal_u + turned[:, 2] * normal_v)
        floor = ends.v < 0.05
        cosine = np.where(floor, np.abs(directions[:, 2]), cosine)
        wanted = np.where(floor, 0.3, 1.0) * self.density
        full = np.maximum(cosine, 0.12) / (distance**2 * STATIC_STEP**2 * np.maximum(flat.ravel(), 0.01))
        share = np.minimum(1, wanted / full)
        off = (distance > self.far) | (ends.s < -0.7) | (ends.s > tunnel.canvas.length + 0.7)
        return np.log(np.where(off, 1e-6, share)).reshape(azimuth.shape)

    def towards(self, tunnel: Tunnel, s: FloatArray, u: FloatArray) -> Iterator[FloatArray]:
        """Positions from which places on the lining may have been seen."""
        for number in range(len(self.places)):
            yield np.broadcast_to(self.origin(tunnel, number), (s.size, 3))


@dataclass(frozen=True)
class Drive:
    """Profiler on a trolley or a car.

    Attributes
    ----------
    u, v : float
        Offset and height over the floor.
    spacing : float
        Between profiles, metres.
    count : int
        Points of a profile.
    turned : float
        Angle of the profiles against the square section, radians.
    rate : float
        Profiles a second.
    """

    u: float
    v: float
    spacing: float
    count: int
    turned: float = 0.0
    rate: float = 100.0
    start: float = 211_300.0
    lead: float = 6.0

    def position(self, tunnel: Tunnel, s: FloatArray) -> FloatArray:
        """Local coordinates of the scanner at a chainage; the vehicle sways a little."""
        u = self.u + 0.006 * np.sin(s / 2.3) + 0.003 * np.sin(s / 0.9 + 1)
        v = self.v + 0.004 * np.sin(s / 3.1 + 2)
        return tunnel.line.local(s, u, v)

    def rays(self, tunnel: Tunnel, rng: np.random.Generator) -> Iterator[Rays]:
        """Rays in parts of the drive."""
        lines = int((tunnel.canvas.length + 2 * self.lead) / self.spacing)
        foot = np.abs(tunnel.section.at(np.array([tunnel.section.wall(0.0)]))[0][0])
        edge = np.arctan2(self.v, foot + abs(self.u))
        for part in np.array_split(np.arange(lines), 12):
            turn = (np.arange(part.size * self.count) + rng.random()) / self.count + part[0]
            angle = (turn % 1) * 2 * np.pi - np.pi / 2
            down = (np.sin(angle) < 0) & (np.abs(np.cos(angle)) < np.cos(edge))
            keep = ~down | (rng.random(turn.size) < 0.25)
            turn, angle = turn[keep], angle[keep]
            s = turn * self.spacing - self.lead
            across = np.cos(angle)
            aimed = np.stack([across * np.sin(self.turned), across * np.cos(self.turned), np.sin(angle)], axis=1)
            yield Rays(1, self.position(tunnel, s), tunnel.line.unturn(s, aimed), self.start + turn / self.rate)

    def track(self, tunnel: Tunnel) -> tuple[FloatArray, FloatArray]:
        """Times, ten a second, and local coordinates of the scanner."""
        times = np.arange(0, (tunnel.canvas.length + 2 * self.lead) / self.spacing / self.rate + 0.1, 0.1)
        return times + self.start, self.position(tunnel, times * self.rate * self.spacing - self.lead)

    def towards(self, tunnel: Tunnel, s: FloatArray, u: FloatArray) -> Iterator[FloatArray]:
        """Positions from which places on the lining were seen."""
        yield self.position(tunnel, s - (u - self.u) * np.tan(self.turned))
