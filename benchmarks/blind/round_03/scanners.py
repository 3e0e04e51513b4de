"""How scanners sweep a tunnel: from stations, or in profiles from a vehicle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .arrays import Floats, Rng
from .profile import Profile
from .tracing import Rays, Tunnel

EPOCH = 389_214_600.0  # adjusted standard GPS time of the first point
_BLOCK = 600_000


class Scanner(Protocol):
    """A way to scan."""

    def rays(self, tunnel: Tunnel, rng: Rng) -> Iterator[Rays]:
        """Rays in blocks, in the order of time."""

    def viewpoints(self, s: Floats, u: Floats, v: Floats) -> list[tuple[Floats, Floats, Floats]]:
        """From where (local) places on the lining are scanned."""


def _section_guess(profile: Profile, u: float, v: float, ds: Floats, du: Floats, dv: Floats) -> tuple[Floats, Floats, Floats]:
    """Range to the plain straight tunnel, cosine of the incidence, length of the direction within the section."""
    table, hit = profile.ranges_from(u, v)
    angle = np.arctan2(du, dv)
    flat = np.hypot(du, dv)
    distance = profile.look_up_turn(table, angle) / np.maximum(flat, 1e-6)
    normal, _ = profile.frame_at(profile.look_up_turn(hit, angle))
    return distance, -(du * normal[0] + dv * normal[1]), flat


@dataclass(frozen=True)
class Stations:
    """Scans from a tripod.

    Attributes
    ----------
    places : tuple
        Chainage, offset and height above the floor of each.
    step : float
        Angle between rays, rad.
    density : float
        Points/m² to which the cloud is thinned where it is denser.
    reach : float
        Greatest range that is kept.
    lowest : float
        Elevation in degrees below which the tripod hides all.
    """

    places: tuple[tuple[float, float, float], ...]
    step: float
    density: float
    reach: float = 16.0
    lowest: float = -58.0

    def rays(self, tunnel: Tunnel, rng: Rng) -> Iterator[Rays]:
        columns = math.ceil(2.0 * math.pi / self.step)
        elevations = np.arange(math.radians(self.lowest), math.pi / 2, self.step)
        at_once = max(1, 1_500_000 // elevations.size)
        for number, (s, u, v) in enumerate(self.places, start=1):
            origin = tunnel.alignment.to_site(np.array([s]), np.array([u]), np.array([v]))
            for start in range(0, columns, at_once):
                azimuth = self.step * np.arange(start, min(start + at_once, columns)) + rng.uniform(0.0, 0.2) * self.step
                around, up = (grid.ravel() for grid in np.meshgrid(azimuth, elevations, indexing="ij"))
                ds, du, dv = np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)
                guess, slant, _ = _section_guess(tunnel.profile, u, v, ds, du, dv)
                density = np.clip(slant, 0.0, 1.0) / (guess**2 * self.step**2 * np.cos(up))
                chance = np.where((guess < self.reach) & (slant > 0.06), self.density / np.maximum(density, 1e-3), 0.0)
                end = s + ds * guess
                kept = np.flatnonzero((rng.random(ds.size) < chance) & (end > -0.5) & (end < tunnel.canvas.length + 0.5))
                local = np.stack([ds[kept], du[kept], dv[kept]], axis=1)
                time = (number - 1) * 420.0 + 300.0 * around[kept] / (2.0 * math.pi) + 0.02 * up[kept]
                yield Rays(
                    origin=np.broadcast_to(origin, local.shape),
                    direction=tunnel.alignment.direction_to_site(local, np.full(kept.size, s)),
                    guess=guess[kept],
                    slant=slant[kept],
                    slack=0.0,
                    time=EPOCH + time,
                    share=time / (420.0 * len(self.places)),
                    source=np.full(kept.size, number),
                    facet=np.zeros(kept.size, dtype=np.int64),
                )

    def viewpoints(self, s: Floats, u: Floats, v: Floats) -> list[tuple[Floats, Floats, Floats]]:
        near = [place for place in self.places if np.abs(s - place[0]).min() < self.reach]
        return [(np.full(s.shape, place[0]), np.full(s.shape, place[1]), np.full(s.shape, place[2])) for place in near]


@dataclass(frozen=True)
class Profiler:
    """Profiles from a vehicle.

    Attributes
    ----------
    u, v : float
        Place of the mirror in the section.
    spacing : float
        Mean distance between profiles, m.
    points : int
        Rays in a turn of the mirror.
    rate : float
        Turns a second.
    yaw : float
        Turn of the plane of the profiles about the vertical, degrees.
    sway : float
        How far the vehicle sways and its speed changes (m).
    facets : int
        Of the mirror, one for each profile.
    blind : float
        Half angle about the plumb line in degrees below which the vehicle hides all.
    """

    u: float
    v: float
    spacing: float
    points: int
    rate: float = 100.0
    yaw: float = 0.0
    sway: float = 0.015
    facets: int = 1
    blind: float = 35.0

    @property
    def speed(self) -> float:
        """Mean speed in m/s."""
        return self.spacing * self.rate

    def lead(self, profile: Profile) -> float:
        """How far before the portal the first profile is needed."""
        return 0.4 + 2.0 * float(profile.radius.max()) * math.tan(math.radians(abs(self.yaw)))

    def place(self, time: Floats, lead: float) -> tuple[Floats, Floats, Floats]:
        """Chainage, offset and height of the mirror at seconds after the start."""
        s = -lead + self.speed * time + 4.0 * self.sway * np.sin(0.9 * time)
        return s, self.u + self.sway * np.sin(1.3 * time + 0.4), self.v + 0.4 * self.sway * np.sin(2.9 * time)

    def duration(self, tunnel: Tunnel) -> float:
        """Seconds of the drive."""
        return (tunnel.canvas.length + 2.0 * self.lead(tunnel.profile)) / self.speed

    def rays(self, tunnel: Tunnel, rng: Rng) -> Iterator[Rays]:
        lead, duration = self.lead(tunnel.profile), self.duration(tunnel)
        turns = int(duration * self.rate)
        at_once = max(1, _BLOCK // self.points)
        yaw = math.radians(self.yaw)
        for start in range(0, turns, at_once):
            turn = np.repeat(np.arange(start, min(start + at_once, turns)), self.points)
            part = np.tile((np.arange(self.points) + 0.5) / self.points, turn.size // self.points)
            time = (turn + part) / self.rate
            s, u, v = self.place(time, lead)
            angle = 2.0 * math.pi * part - math.pi
            local = np.stack([np.sin(angle) * math.sin(yaw), np.sin(angle) * math.cos(yaw), np.cos(angle)], axis=1)
            guess, slant, _ = _section_guess(tunnel.profile, self.u, self.v, local[:, 0], local[:, 1], local[:, 2])
            end = s + local[:, 0] * guess
            clear = np.abs(angle) < math.pi - math.radians(self.blind)
            kept = np.flatnonzero((end > -0.3) & (end < tunnel.canvas.length + 0.3) & (slant > 0.06) & clear)
            yield Rays(
                origin=tunnel.alignment.to_site(s, u, v)[kept],
                direction=tunnel.alignment.direction_to_site(local[kept], s[kept]),
                guess=guess[kept],
                slant=slant[kept],
                slack=2.0 * self.sway,
                time=EPOCH + time[kept],
                share=time[kept] / duration,
                source=np.ones(kept.size, dtype=np.int64),
                facet=turn[kept] % self.facets,
            )

    def viewpoints(self, s: Floats, u: Floats, v: Floats) -> list[tuple[Floats, Floats, Floats]]:
        along = s - (u - self.u) * math.tan(math.radians(self.yaw))
        return [(along, np.full(s.shape, self.u), np.full(s.shape, self.v))]

    def trajectory(self, tunnel: Tunnel) -> tuple[Floats, Floats]:
        """Times and site coordinates, ten a second."""
        time = np.arange(-0.5, self.duration(tunnel) + 0.6, 0.1)
        s, u, v = self.place(time, self.lead(tunnel.profile))
        return EPOCH + time, tunnel.alignment.to_site(s, u, v)
