"""A survey: rays in, points with amplitudes out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray, IntArray
from .instrument import Instrument
from .noise import line
from .solids import Place
from .stances import Rays, Stance, Stations
from .tracing import FLOOR, LINING, Hits, Tunnel, trace

FOOT = 0.008
GLINT = 4.0
PULSE = 0.35


@dataclass(frozen=True)
class Cloud:
    """Points in local coordinates."""

    xyz: FloatArray
    amplitude: FloatArray
    time: FloatArray
    source: IntArray


def survey(tunnel: Tunnel, instrument: Instrument, stance: Stance, rng: np.random.Generator) -> Cloud:
    """Scan a tunnel."""
    parts = [_observe(tunnel, instrument, rays, rng) for rays in stance.rays(tunnel, rng)]
    cloud = Cloud(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("xyz", "amplitude", "time", "source")))
    moved: FloatArray
    gain: FloatArray
    if isinstance(stance, Stations):
        shifts = rng.normal(0, 0.0015, (len(stance.places) + 1, 3))
        gains = rng.normal(0, 0.15, len(stance.places) + 1)
        moved, gain = shifts[cloud.source], gains[cloud.source]
    else:
        moved = 0.002 * np.stack([line(rng, cloud.time, 3.0) for _ in range(3)], axis=1)
        gain = 0.12 * line(rng, cloud.time, 6.0)
    quantum = instrument.quantum
    return Cloud(cloud.xyz + moved, np.rint((cloud.amplitude + gain) / quantum) * quantum, cloud.time, cloud.source)


def _observe(tunnel: Tunnel, instrument: Instrument, rays: Rays, rng: np.random.Generator) -> Cloud:
    """Points of one station or part of a drive."""
    hits = trace(tunnel, rays.origins, rays.directions, instrument.beam)
    ends = np.where(np.isfinite(hits.distance), hits.distance, 1.0)
    place = tunnel.place(rays.origins + rays.directions * ends[:, None])
    good = np.isfinite(hits.distance) & (place.s > 0) & (place.s < tunnel.canvas.length) & (hits.distance > 1.0)
    origins, directions = rays.origins[good], rays.directions[good]
    distance: FloatArray = hits.distance[good]
    target = hits.target[good]
    place = place.part(np.flatnonzero(good))
    level = _level(tunnel, instrument, place, directions, target, rng)
    amplitude: FloatArray = instrument.range_db(distance) + level
    edge = Hits(distance, target, hits.miss[good], hits.passed[good], hits.edge[good])
    distance, amplitude = _mix(tunnel, instrument, edge, amplitude)
    stray = np.flatnonzero(rng.random(distance.size) < 0.0012)
    distance[stray] = np.maximum(0.8, distance[stray] + rng.normal(0, 0.25, stray.size) - rng.exponential(0.15, stray.size))
    amplitude[stray] -= rng.uniform(1, 9, stray.size)
    weak = 1 + 10 ** ((instrument.threshold + 8 - amplitude) / 20)
    sigma = instrument.range_noise * np.clip(weak, 1, 5) + np.where(target == FLOOR, 0.015, 0.0)
    xyz = origins + directions * (distance + sigma * rng.standard_normal(distance.size))[:, None]
    source = np.full(distance.size, rays.source, dtype=np.uint16)
    return Cloud(xyz, instrument.noisy(rng, amplitude), rays.times[good], source)


def _level(
    tunnel: Tunnel, instrument: Instrument, place: Place, directions: FloatArray, target: IntArray, rng: np.random.Generator
) -> FloatArray:
    """Reflectance and incidence of what the rays met, dB."""
    canvas = tunnel.canvas
    aimed = tunnel.line.turn(place.s, directions)
    level = np.zeros(target.size)
    lining = np.flatnonzero(target == LINING)
    s, t = place.s[lining], place.t[lining]
    relief = canvas.relief
    slope_s = (canvas.sample(relief, s + FOOT, t) - canvas.sample(relief, s - FOOT, t)) / (2 * FOOT)
    slope_t = (canvas.sample(relief, s, t + FOOT) - canvas.sample(relief, s, t - FOOT)) / (2 * FOOT)
    slope_s, slope_t = np.clip(slope_s, -3, 3), np.clip(slope_t, -3, 3)
    normal_u, normal_v = tunnel.section.normal(t)
    # The tangent of growing girth is the normal, turned by a right angle.
    u, v = normal_u - slope_t * normal_v, normal_v + slope_t * normal_u
    along, across, up = aimed[lining].T
    cosine = -(-slope_s * along + u * across + v * up) / np.sqrt(1 + slope_s**2 + slope_t**2)
    angle = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    glint = 10 * np.log10(1 + GLINT * canvas.sample(canvas.film, s, t) * np.exp(-((angle / 3.5) ** 2)))
    level[lining] = canvas.sample(canvas.reflectance(), s, t) + instrument.incidence_db(cosine) + glint
    floor = np.flatnonzero(target == FLOOR)
    sleeper = (place.s[floor] % 0.65 < 0.26) & (np.abs(place.u[floor] % 3.8 - 1.9) < 1.3)
    stones = np.where(sleeper, rng.normal(-6, 0.5, floor.size), rng.normal(-8, 1.3, floor.size))
    tilted = np.abs(aimed[floor, 2]) * rng.uniform(0.6, 1.0, floor.size)
    level[floor] = stones + instrument.incidence_db(tilted)
    for number, body in enumerate(tunnel.solids):
        hit = np.flatnonzero(target == number)
        if not hit.size:
            continue
        cosine = _facing(tunnel, number, place.part(hit), aimed[hit])
        level[hit] = body.albedo + instrument.incidence_db(cosine) + 0.4 * rng.standard_normal(hit.size)
    return level


def _facing(tunnel: Tunnel, number: int, at: Place, aimed: FloatArray) -> FloatArray:
    """Cosine of incidence on a body, from the slope of its distance along and against the ray."""
    body, section = tunnel.solids[number], tunnel.section
    step = 0.004

    def distance(shift: FloatArray) -> FloatArray:
        u, v = at.u + shift[:, 1], at.v + shift[:, 2]
        return body.distance(Place(at.s + shift[:, 0], u, v, section.girth(u, v), section.depth(u, v)))

    fall = (distance(-step * aimed) - distance(step * aimed)) / (2 * step)
    return np.asarray(np.clip(fall, 0.05, 1))


def _mix(tunnel: Tunnel, instrument: Instrument, hits: Hits, amplitude: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Range and amplitude where the beam has also touched the edge of a body before."""
    distance = hits.distance.copy()
    both = np.flatnonzero((hits.miss < 1) & (hits.edge >= 0) & (hits.target != hits.edge))
    share = np.clip(0.5 * (1 - hits.miss[both]), 0.02, 0.5)
    albedo = np.array([body.albedo for body in tunnel.solids] or [0.0])[hits.edge[both]]
    before = share * 10 ** ((instrument.range_db(hits.passed[both]) + albedo - 3) / 10)
    behind = (1 - share) * 10 ** (amplitude[both] / 10)
    between = (before * hits.passed[both] + behind * distance[both]) / (before + behind)
    apart = (distance[both] - hits.passed[both] > PULSE) & (not instrument.blends)
    first = before > behind
    alone = np.where(first, hits.passed[both], distance[both])
    amplitude[both] = 10 * np.log10(np.where(apart, np.maximum(before, behind), before + behind))
    distance[both] = np.where(apart, alone, between)
    return distance, amplitude
