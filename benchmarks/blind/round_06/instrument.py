"""Scanners: what they measure, and where their rays go."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .fields import Array
from .tunnel import Axis, Section

Law = Callable[[Array], Array]


def pulse(r: Array) -> Array:
    """Pulse scanner: inverse square, the near field seen in part only (dB)."""
    return np.asarray(-20 * np.log10(r) + 10 * np.log10(1 - np.exp(-((r / 2.2) ** 2))))


def pulse_log(r: Array) -> Array:
    """Pulse scanner with a logarithmic detector that presses strong echoes together (dB)."""
    level = -17.0 * np.log10(r) - 1.6 * np.exp(-((r - 1.0) / 1.8))
    return np.asarray(level - 0.25 * np.sin(2 * np.pi * np.log2(r)) * np.exp(-r / 12))


def phase(r: Array) -> Array:
    """Phase scanner whose coaxial optics lose light near by (dB)."""
    return np.asarray(-20 * np.log10(r) + 20 * np.log10(1 - np.exp(-r / 3.2)))


def minnaert(k: float, retro: float = 0.0) -> Law:
    """Reflection cos^k, brighter by ``retro`` straight back, as rough mineral surfaces are."""

    def law(cos: Array) -> Array:
        return np.asarray(cos**k * (1 + retro * np.exp(-np.arccos(np.clip(cos, 0, 1)) / 0.12)))

    return law


def oren_nayar(roughness: float) -> Law:
    """Reflection straight back of a surface of rough facets (deviation of slope in radians)."""
    square = roughness**2
    one, two = 1 - 0.5 * square / (square + 0.33), 0.45 * square / (square + 0.09)

    def law(cos: Array) -> Array:
        sine = np.sqrt(np.maximum(1 - cos**2, 0))
        return np.asarray(cos * one + two * sine**2)

    return law


@dataclass(frozen=True)
class Instrument:
    """Radiometry of a scanner.

    Attributes
    ----------
    constant : float
        Amplitude of a white target at 1 m, without the range law (dB).
    distance : callable
        Range law.
    beam : float
        Divergence (rad).
    noise, noise_weak : float
        Deviation of strong echoes, and what weak ones (20 dB) have more (dB).
    threshold : float
        Weaker echoes are lost (dB).
    range_noise : float
        Deviation of the range (m).
    stray : float
        Share of points that are nowhere.
    step : float
        Steps of the amplitude (dB).
    drift : float
        By how much stations, or minutes, differ (dB).
    """

    constant: float = 58.0
    distance: Law = pulse
    beam: float = 3e-4
    noise: float = 0.5
    noise_weak: float = 0.8
    threshold: float = 6.0
    range_noise: float = 0.002
    stray: float = 0.0015
    step: float = 0.01
    drift: float = 0.15


@dataclass
class Aim:
    """Rays: chainage and ``u`` at which they aim, scanner's chainage, ``n`` and ``z``, time, source."""

    s: Array
    u: Array
    at: Array
    n: float
    z: float
    time: Array
    source: int


@dataclass(frozen=True)
class Static:
    """Tripod scans: stations (chainage, ``n``, height above the floor); thinned to ``density`` points/m² a station."""

    stations: tuple[tuple[float, float, float], ...]
    reach: float
    density: float
    step: float = 1.6e-3
    below: float = -58.0

    def aims(self, section: Section, length: float, rng: np.random.Generator) -> Iterator[Aim]:
        """Rays of all stations."""
        elevation = np.arange(np.radians(self.below), np.pi / 2, self.step)
        for number, (s0, n0, h) in enumerate(self.stations, 1):
            z0 = section.floor + h
            azimuths = np.arange(0, 2 * np.pi, self.step)
            kept = []
            for part in np.array_split(azimuths, 8):
                az, el = (g.ravel() for g in np.meshgrid(part, elevation, indexing="ij"))
                across = np.cos(el) * np.sin(az)
                up = np.sin(el)
                u = section.towards(n0, z0, across, up)
                n1, z1, mn, mz, _, _ = section.at(u)
                flat = np.hypot(across, up)
                r = np.hypot(n1 - n0, z1 - z0) / np.maximum(flat, 1e-6)
                s = s0 + r * np.cos(el) * np.cos(az)
                dense = -(across * mn + up * mz) / (np.maximum(np.cos(el), 1e-3) * (r * self.step) ** 2)
                # Where the scan is denser than wanted, points are left out by chance.
                lower = np.where(np.abs(u) > section.foot, 0.6, 1.0) * self.density
                chosen = (rng.random(len(u)) * np.maximum(dense, lower) < lower) & (s > 0) & (s < length) & (r < self.reach)
                kept.append((s[chosen], u[chosen], az[chosen]))
            s, u, az = (np.concatenate(values) for values in zip(*kept, strict=True))
            time = 3.0e8 + number * 900 + az / (2 * np.pi) * 300
            yield Aim(s, u, np.full(len(s), s0), n0, z0, time, number)

    def views(self, section: Section, s: Array, u: Array) -> Iterator[tuple[Array, float, float]]:
        """Scanner positions from which places on the lining may have been seen."""
        for s0, n0, h in self.stations:
            yield np.full(len(s), s0), n0, section.floor + h

    def track(self, axis: Axis, section: Section) -> Array:
        """Rows of number, x, y, z."""
        s, n, h = (np.array(values) for values in zip(*self.stations, strict=True))
        centre, _, right = axis.frame(s)
        centre = centre + right * n[:, None]
        centre[:, 2] += section.floor + h
        return np.column_stack([np.arange(1, len(s) + 1), centre])


@dataclass(frozen=True)
class Mobile:
    """Profiler on a van: ``yaw`` turns its plane from square to the tunnel (degrees); ``pitch`` is the distance of profiles."""

    n: float
    height: float
    yaw: float
    pitch: float
    step: float
    speed: float = 1.4
    reach: float = 25.0
    start: float = 3.1e8

    def chainage(self, time: Array) -> Array:
        """Where the van is; its speed varies a little."""
        t = time - self.start
        return np.asarray(-8 + self.speed * (t + 0.6 * np.sin(t / 5.0)))

    def _lead(self, section: Section, u: Array) -> Array:
        return np.asarray((section.at(u)[0] - self.n) * np.tan(np.radians(self.yaw)))

    def aims(self, section: Section, length: float, rng: np.random.Generator) -> Iterator[Aim]:
        """Rays in parts of the drive."""
        z0 = section.floor + self.height
        angle = np.arange(-np.radians(160), np.radians(160), self.step)
        u = section.towards(self.n, z0, np.sin(angle) * np.cos(np.radians(self.yaw)), np.cos(angle))
        lead = self._lead(section, u)
        line = self.pitch / self.speed
        lines = int((length + 16) / self.pitch * 1.1)
        for part in np.array_split(np.arange(lines), 4):
            time = self.start + (part[:, None] + angle[None] / (2 * np.pi)) * line
            at = self.chainage(time)
            s = at + lead
            keep = (s > 0) & (s < length)
            if keep.any():
                around = np.broadcast_to(u, s.shape)[keep]
                jitter = rng.normal(0, 0.0015, len(around))
                yield Aim(s[keep], around + jitter, at[keep], self.n, z0, time[keep], 1)

    def views(self, section: Section, s: Array, u: Array) -> Iterator[tuple[Array, float, float]]:
        """Scanner positions from which places on the lining were seen."""
        yield s - self._lead(section, u), self.n, section.floor + self.height

    def track(self, axis: Axis, section: Section, length: float) -> Array:
        """Rows of time, x, y, z."""
        time = self.start + np.arange(-1, (length + 20) / self.speed * 1.1, 0.1)
        centre, _, right = axis.frame(self.chainage(time))
        centre = centre + right * self.n
        centre[:, 2] += section.floor + self.height
        return np.column_stack([time, centre])
