"""Make the scan of a site."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.known.radiometry import Instrument, Law, mix_db
from benchmarks.blind.known.rays import Hits
from benchmarks.blind.known.scanner import FARTHEST, NEAREST, Profiler, Stations, Sweep
from benchmarks.blind.known.section import Array
from benchmarks.blind.known.site import Site
from benchmarks.blind.known.trace import on_relief

RANGE_NOISE = 0.0012
STRAY = 0.0012
MIXED = 0.35


@dataclass(frozen=True)
class Optics:
    """What decides the strength of echoes: instrument, reflection, mean reflectance of the lining (dB)."""

    instrument: Instrument
    law: Law
    lining_db: float


@dataclass
class Scan:
    """Points of a scan; ``u`` and ``s`` are of use where ``wall`` is true. ``path`` is the scanner's: time, u, y, z."""

    local: Array
    amplitude: Array
    time: Array
    station: NDArray[np.int_]
    u: Array
    s: Array
    wall: NDArray[np.bool_]
    path: Array | None


def scan(site: Site, scanner: Stations | Profiler, optics: Optics, rng: np.random.Generator) -> Scan:
    """Scan a site."""
    path: Array | None = None
    sweeps: Iterator[Sweep]
    if isinstance(scanner, Profiler):
        path = scanner.trajectory(site, rng)
        sweeps = scanner.sweeps(site, rng, path)
    else:
        sweeps = scanner.sweeps(site, rng)
    parts = [_record(site, sweep, optics, rng) for sweep in sweeps]
    columns = [np.concatenate([part[k] for part in parts]) for k in range(7)]
    local, amplitude, time, station, u, s, wall = columns
    return Scan(local, amplitude, time, station, u, s, wall, path)


def _wall_db(site: Site, hits: Hits, optics: Optics) -> Array:
    """Amplitude of the wall; the relief of a fine pattern lengthens the ranges of ``hits``."""
    surface, law = site.surface, optics.law
    wet = surface.sample(surface.wet, hits.u, hits.s)
    value = optics.lining_db + surface.dry_db(hits.u, hits.s) - wet
    if surface.pattern is not None:
        fine, recess = surface.pattern(hits.u, hits.s, optics.instrument.beam(hits.t))
        value += fine
        hits.t = hits.t + np.clip(recess / np.maximum(hits.cos, 0.3), -0.03, 0.03)
    return value + optics.instrument.range_db(hits.t) + law.incidence_db(hits.cos) + law.sheen_db(hits.cos, wet)


def _record(site: Site, sweep: Sweep, optics: Optics, rng: np.random.Generator) -> tuple[NDArray[np.generic], ...]:
    rays, tool = sweep.rays, optics.instrument
    hits = on_relief(site, rays, sweep.hits)
    lost = ~np.isfinite(hits.t)
    hits.t[lost] = sweep.hits.t[lost]
    wall_db = _wall_db(site, hits, optics)
    hits.t[lost] = np.inf
    beam = tool.beam(sweep.hits.t)
    t, level = hits.t.copy(), wall_db.copy()
    share = np.ones_like(t)
    edge_t, edge_db, edge_share = np.full_like(t, np.inf), np.zeros_like(t), np.zeros_like(t)
    for item in site.items:
        met = item.meet(rays, hits, beam)
        echo = tool.range_db(met.t) + 10.0 * np.log10(met.cos) + item.colour
        front = (met.share >= 0.5) & (met.t < t[met.index])
        index = met.index[front]
        t[index], level[index], share[index] = met.t[front], echo[front], met.share[front]
        edge = (met.share < 0.5) & (met.share > 0.0) & (met.t < edge_t[met.index])
        index = met.index[edge]
        edge_t[index], edge_db[index], edge_share[index] = met.t[edge], echo[edge], met.share[edge]
    wall = t == hits.t
    graze = wall & (edge_t < t)
    behind = ~wall & (share < 1.0) & np.isfinite(hits.t)
    front_t, back_t = np.where(graze, edge_t, t), hits.t
    front_share = np.where(graze, edge_share, share)
    front_db = np.where(graze, edge_db, level)
    both = np.flatnonzero(graze | behind)
    level[both] = mix_db(front_db[both], wall_db[both], front_share[both])
    mixed = both[(rng.random(len(both)) < MIXED) & (back_t[both] - front_t[both] > 0.02)]
    t[mixed] = front_share[mixed] * front_t[mixed] + (1.0 - front_share[mixed]) * back_t[mixed]
    wall[mixed] = False
    stray = rng.random(len(t)) < STRAY
    t[stray] *= rng.uniform(0.75, 1.04, int(stray.sum()))
    level[stray] -= rng.uniform(3.0, 14.0, int(stray.sum()))
    wall &= ~stray & (hits.s < site.section.lining)
    amplitude = tool.noisy(level, rng)
    t += RANGE_NOISE * rng.standard_normal(len(t))
    good = np.isfinite(t) & (t > NEAREST) & (t < FARTHEST)
    local = rays.origin[good] + t[good, None] * rays.direction[good]
    station = np.full(int(good.sum()), sweep.station)
    return local, amplitude[good], rays.time[good], station, hits.u[good], hits.s[good], wall[good]
