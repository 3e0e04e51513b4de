"""What a scanner records in the tunnel: geometry of beams, law of reflection, noise, mixed pixels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .geometry import Array
from .objects import cover
from .tunnel import Tunnel

NEAR, FAR = 1.5, 25.0
LEAST_COSINE = 0.17
PIECE = 400_000


@dataclass(frozen=True)
class Law:
    """How the dry lining reflects: a power of the cosine, with a share ``gloss`` in a lobe ``lobe`` degrees wide."""

    power: float = 1.0
    gloss: float = 0.0
    lobe: float = 10.0

    def db(self, cos: Array) -> Array:
        """Loss against reflection square to the surface."""
        angle = np.degrees(np.arccos(np.clip(cos, -1, 1)))
        return decibel((1 - self.gloss) * cos**self.power + self.gloss * np.exp(-((angle / self.lobe) ** 2)))


@dataclass(frozen=True)
class Instrument:
    """A scanner.

    Attributes
    ----------
    phase : bool
        Whether ranges of mixed pixels lie between the surfaces; a pulse scanner takes one or the other.
    constant : float
        Amplitude in dB of a white target at 1 m by the law of distance alone.
    decay : float
        Loss per tenfold range in dB.
    dim : float
        Range in m below which its optics see only part of the spot.
    hump : tuple of float
        Height in dB, place and width in m of a hump that its amplifier leaves on the curve.
    beam : tuple of float
        Diameter at its exit in m and divergence in rad.
    noise : tuple of float
        Deviation of amplitude in dB: constant part, part at 0 dB that grows as the signal sinks.
    jitter : float
        Deviation of range in m for a strong signal.
    step : float
        Resolution of the amplitude in dB.
    outliers : float
        Share of points that are nowhere.
    """

    phase: bool = True
    constant: float = 42.0
    decay: float = 20.0
    dim: float = 1.2
    hump: tuple[float, float, float] = (0.0, 6.0, 2.0)
    beam: tuple[float, float] = (0.0035, 0.0003)
    noise: tuple[float, float] = (0.35, 1.5)
    jitter: float = 0.0012
    step: float = 0.02
    outliers: float = 0.0012

    def curve(self, r: Array) -> Array:
        """Amplitude over range of a white target square to the beam."""
        seen = decibel(1 - np.exp(-((r / self.dim) ** 3)))
        height, place, width = self.hump
        return self.constant - self.decay * np.log10(r) + seen + height * np.exp(-(((r - place) / width) ** 2))


@dataclass
class Points:
    """A piece of the cloud, in the frame of chainage 0."""

    xyz: Array
    amplitude: Array
    time: Array
    station: int


def decibel(power: Array) -> Array:
    """10 lg."""
    return 10 * np.log10(np.maximum(power, 1e-12))


def trace(t: Tunnel, origin: Array, d: Array) -> Array:
    """Length of rays to the lining; NaN where none is within reach."""
    c, u, w = t.axis.from_frame(origin)
    local = t.axis.direction(c, d)
    slant = np.maximum(np.hypot(local[:, 1], local[:, 2]), 0.06)
    length = before = np.zeros(len(d))
    room = room_before = t.section.clearance(u, w)
    for turn in range(19):
        if turn < 14:
            longer = np.minimum(length + 0.95 * room / slant, 40.0)
        else:
            change = room - room_before
            longer = np.clip(length - room * (length - before) / np.where(np.abs(change) < 1e-9, 1e9, change), 0, 40.0)
        before, room_before, length = length, room, longer
        _, u, w = t.axis.from_frame(origin + length[:, None] * d)
        room = t.section.clearance(u, w)
    return np.where(np.abs(room) < 0.004, length, np.nan)


def shoot(t: Tunnel, tool: Instrument, law: Law, origin: Array, d: Array, time: Array, station: int) -> Points:
    """Record rays from origins (n, 3) in directions (n, 3), both in the frame of chainage 0."""
    rng = t.rng
    length = trace(t, origin, d)
    good = np.isfinite(length) & (length < FAR) & (length > 1.0)
    origin, d, time, length = origin[good], d[good], time[good], length[good]
    c, u, w = t.axis.from_frame(origin + length[:, None] * d)
    local = t.axis.direction(c, d)
    s = t.section.arc(u, w)
    tilt_c, tilt_s = _slopes(t, c, s)
    nu, nw = t.section.inward(s)
    smooth = -(local[:, 1] * nu + local[:, 2] * nw)
    cos = (smooth + local[:, 0] * tilt_c + (local[:, 2] * nu - local[:, 1] * nw) * tilt_s) / np.sqrt(1 + tilt_c**2 + tilt_s**2)
    cos = np.maximum(cos, 0.08)
    beam = (tool.beam[0] + tool.beam[1] * length) / 2
    front = cover(t.things, np.stack([c, u, w], axis=1), local, length, beam, rng)
    wall = length - t.canvas.sample(t.canvas.relief, c, s) / np.maximum(smooth, 0.2)
    canvas = t.canvas
    wet = canvas.sample(canvas.film, c, s) * 3.0 * np.exp(-((np.degrees(np.arccos(np.clip(cos, -1, 1))) / 4.0) ** 2))
    wall_db = canvas.sample(canvas.dry, c, s) - canvas.sample(canvas.drop, c, s) + law.db(cos) + decibel(1 + wet)
    thing = length + front.tau
    wall_db = tool.curve(np.maximum(wall, 0.5)) + wall_db
    lobe = np.exp(-((np.degrees(np.arccos(np.clip(front.cos, 0, 1))) / 12.0) ** 2))
    thing_db = tool.curve(np.maximum(thing, 0.5)) + front.db + decibel((1 - front.gloss) * front.cos + front.gloss * 4 * lobe)
    wall_power, thing_power = (1 - front.share) * 10 ** (wall_db / 10), front.share * 10 ** (thing_db / 10)
    amplitude = decibel(wall_power + thing_power)
    part = thing_power / (wall_power + thing_power)
    close = np.abs(front.tau) < 0.4
    merged = wall + part * (thing - wall)
    nearest = np.where(part > 0.5, thing, wall)
    r = np.where(close | tool.phase, merged, nearest)
    if not tool.phase:
        amplitude = np.where(close, amplitude, decibel(np.maximum(wall_power, thing_power)))
    spread = np.hypot(tool.noise[0], tool.noise[1] * 10 ** (-amplitude / 20))
    amplitude = amplitude + spread * rng.standard_normal(len(r))
    r = r + tool.jitter * np.clip(10 ** ((25 - amplitude) / 30), 0.6, 4) * rng.standard_normal(len(r))
    stray = rng.random(len(r)) < tool.outliers
    r[stray] *= rng.uniform(0.35, 1.0, int(stray.sum()))
    amplitude[stray] -= rng.uniform(2, 12, int(stray.sum()))
    keep = (r > NEAR) & (r < FAR) & (c > 0) & (c < t.axis.length) & ((smooth > LEAST_COSINE) | (front.share > 0.5))
    xyz = (origin + r[:, None] * d)[keep]
    return Points(xyz, np.round(amplitude[keep] / tool.step) * tool.step, time[keep], station)


def _slopes(t: Tunnel, c: Array, s: Array) -> tuple[Array, Array]:
    """Slopes of a rough surface along the tunnel and along the arc."""
    if not t.roughness:
        return np.zeros_like(c), np.zeros_like(c)
    h, relief = 0.02, t.canvas.relief
    along = t.canvas.sample(relief, c + h, s) - t.canvas.sample(relief, c - h, s)
    around = t.canvas.sample(relief, c, s + h) - t.canvas.sample(relief, c, s - h)
    return np.clip(along / (2 * h), -0.7, 0.7), np.clip(around / (2 * h), -0.7, 0.7)


def station_rays(step: float, lowest: float, rng: np.random.Generator) -> Array:
    """Directions of a tripod scanner, thinned towards the zenith to one angular spacing."""
    rows = []
    turn = rng.uniform(0, 2 * np.pi)
    for elevation in np.arange(lowest, np.pi / 2, step):
        count = max(int(2 * np.pi * np.cos(elevation) / step), 6)
        azimuth = turn + np.linspace(0, 2 * np.pi, count, endpoint=False)
        flat = np.cos(elevation)
        rows.append(np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.full(count, np.sin(elevation))], axis=1))
    return np.concatenate(rows)


def static(t: Tunnel, tool: Instrument, law: Law, stations: Array, step: float, lowest: float = -0.95) -> Iterator[Points]:
    """Scan from tripods at (n, 3) in (c, u, w)."""
    for number, place in enumerate(stations, start=1):
        rays = station_rays(step, lowest, t.rng)
        at = t.axis.to_frame(*(np.array([v]) for v in place))
        offset = t.rng.normal(0, 0.08)
        clock = 1000.0 * number + np.linspace(0, 300, len(rays))
        for i in range(0, len(rays), PIECE):
            d = rays[i : i + PIECE]
            points = shoot(t, tool, law, np.repeat(at, len(d), axis=0), d, clock[i : i + PIECE], number)
            points.amplitude += offset
            yield points


@dataclass(frozen=True)
class Trolley:
    """A profiler pushed along the track.

    Attributes
    ----------
    u, w : float
        Where it is in the section.
    speed : float
        In m/s.
    rate : float
        Turns of the mirror per second.
    rays : int
        Points per turn.
    unsteady : float
        Deviation of its speed as a share.
    blind : float
        Half the angle below it that the trolley hides, in rad.
    yaw : float
        Angle of the plane of scanning against the section, in rad.
    """

    u: float
    w: float
    speed: float
    rate: float
    rays: int
    unsteady: float = 0.1
    blind: float = 0.5
    yaw: float = 0.0

    def path(self, length: float) -> tuple[Array, Array]:
        """Times and places (c, u, w) of the scanner, twenty a second."""
        margin = 0.5 + 5 * np.tan(abs(self.yaw))
        span = length + 2 * margin
        time = np.arange(0, span / (self.speed * (1 - self.unsteady)) + 0.05, 0.05)
        pace = self.speed * (1 + self.unsteady * np.sin(2 * np.pi * time / 11.0) * np.cos(2 * np.pi * time / 31.0))
        c = np.concatenate([[0.0], np.cumsum(pace[:-1] * 0.05)]) - margin
        keep = c < length + margin
        time, c = time[keep], c[keep]
        u = self.u + 0.004 * np.sin(2 * np.pi * c / 6.2)
        w = self.w + 0.002 * np.sin(2 * np.pi * c / 3.1 + 1)
        return time, np.stack([c, u, w], axis=1)


def mobile(t: Tunnel, tool: Instrument, law: Law, trolley: Trolley, start: float) -> Iterator[Points]:
    """Scan from a trolley; ``start`` is the time at its first place."""
    time, places = trolley.path(t.axis.length)
    path = t.axis.to_frame(*places.T)
    count = int((time[-1] - time[0]) * trolley.rate)
    angle = np.linspace(trolley.blind, 2 * np.pi - trolley.blind, trolley.rays)
    side, up = np.sin(angle), -np.cos(angle)
    piece = max(PIECE // trolley.rays, 1)
    for first in range(0, count, piece):
        turns = np.arange(first, min(first + piece, count))
        when = ((turns[:, None] + angle[None, :] / (2 * np.pi)) / trolley.rate).ravel()
        origin = np.stack([np.interp(when, time, path[:, k]) for k in range(3)], axis=1)
        bend = np.interp(when, time, places[:, 0]) / t.axis.radius + trolley.yaw
        across = np.tile(side, len(turns))
        d = np.stack([-across * np.sin(bend), across * np.cos(bend), np.tile(up, len(turns))], axis=1)
        yield shoot(t, tool, law, origin, d, start + when, 1)
