"""Scan of a tunnel: what the beams meet, and what the instrument makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .casting import Hits, Tunnel, bilinear
from .instrument import Instrument, Matt
from .section import Alignment, Array

# What a point shows that is on no single surface.
MIXED = -2
# Ranges that a surveyor keeps, in metres.
NEAREST, FARTHEST = 1.45, 25.0


@dataclass
class Cloud:
    """Points of a scan, with what is known of them.

    Attributes
    ----------
    xyz : ndarray
        Coordinates.
    amplitude, range_part, incidence_part : ndarray
        In dB; the latter two as made, of dry lining.
    u, s : ndarray
        Chainage and place on the girth.
    met : ndarray
        ``LINING``, ``MIXED``, or index of the fitting.
    time : ndarray
        In seconds.
    station : ndarray
        Number of the station.
    """

    xyz: Array
    amplitude: Array
    range_part: Array
    incidence_part: Array
    u: Array
    s: Array
    met: NDArray[np.int32]
    time: Array
    station: NDArray[np.uint16]

    def take(self, index: NDArray[np.intp] | NDArray[np.bool_]) -> Cloud:
        """Some of the points."""
        return Cloud(**{name: value[index] for name, value in vars(self).items()})


def joined(clouds: Sequence[Cloud]) -> Cloud:
    """Several clouds as one."""
    return Cloud(**{name: np.concatenate([getattr(c, name) for c in clouds]) for name in vars(clouds[0])})


@dataclass
class Drive:
    """Rays of one station or one drive: where each begins, when, and its direction."""

    start: Array
    time: Array
    rays: Array
    station: int


def station(number: int, u: float, resolution: float, time: float, rng: np.random.Generator) -> Drive:
    """Rays of a static scan: a fan about the horizontal, turned about the vertical; nothing straight below the tripod."""
    azimuths = np.arange(0, 2 * np.pi, resolution)
    elevations = np.arange(-1.05, np.pi / 2, resolution)
    # Towards the zenith lines crowd: a surveyor's filter thins them, so that they need not be cast.
    azimuth, elevation = np.meshgrid(azimuths, elevations, indexing="ij")
    keep = rng.random(azimuth.shape) < np.maximum(np.cos(elevation), 0.03)
    azimuth, elevation = azimuth[keep], elevation[keep]
    level = np.cos(elevation)
    rays = np.column_stack([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(elevation)])
    return Drive(np.full(len(rays), u), time + 180 * azimuth / (2 * np.pi), rays, number)


def drive(u0: float, u1: float, spacing: float, resolution: float, speed: float, time: float, tilt: float = 0.0) -> Drive:
    """Rays of a profile scanner that moves along the tunnel and turns about its axis, tilted out of the section or not."""
    per_turn = round(2 * np.pi / resolution)
    turns = round((u1 - u0) / spacing)
    share = np.arange(per_turn * turns) / per_turn
    angle = 2 * np.pi * np.mod(share, 1)
    rays = np.column_stack([np.full(len(angle), np.sin(tilt)), np.cos(tilt) * np.cos(angle), np.cos(tilt) * np.sin(angle)])
    start = u0 + share * spacing
    return Drive(start, time + (start - u0) / speed, rays, 1)


def scan(
    tunnel: Tunnel, alignment: Alignment, rays: Drive, instrument: Instrument, matt: Matt, rng: np.random.Generator
) -> Cloud:
    """Scan a tunnel from one station or in one drive.

    Parameters
    ----------
    tunnel : Tunnel
        The lining with its fittings.
    alignment : Alignment
        Where it lies.
    rays : Drive
        The beams.
    instrument : Instrument
        The scanner.
    matt : Matt
        How the lining scatters.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    Cloud
    """
    order = np.argsort(np.arctan2(rays.rays[:, 2], rays.rays[:, 1]))
    start, time, way = rays.start[order], rays.time[order], rays.rays[order]
    hits = tunnel.cast(start, way)
    shifted = way + rng.normal(0, instrument.beam, way.shape)
    shifted /= np.linalg.norm(shifted, axis=1)[:, None]
    turned = np.argsort(np.arctan2(shifted[:, 2], shifted[:, 1]))
    edge = tunnel.cast(start[turned], shifted[turned])
    back = np.empty_like(turned)
    back[turned] = np.arange(len(turned))
    edge = Hits(**{name: value[back] for name, value in vars(edge).items()})

    local, reach, level, spread, matte = _returned(tunnel, alignment, start, way, hits, instrument, matt)
    _, _, level_edge, _, _ = _returned(tunnel, alignment, start, shifted, edge, instrument, matt)
    both = np.isfinite(edge.distance) & np.isfinite(hits.distance)
    step = np.where(both, edge.distance, 0.0) - np.where(both, hits.distance, 0.0)
    gap = np.abs(step)
    mixed = ((edge.met != hits.met) | (gap > 0.12)) & (gap > 0.015) & (gap < instrument.mixing)
    share = np.where(mixed, rng.random(len(way)), 0.0)
    power = (1 - share) * 10 ** (level / 10) + np.where(mixed, share * 10 ** (np.minimum(level_edge, 100) / 10), 0.0)
    amplitude = instrument.constant + 10 * np.log10(power)

    elapsed = (time - time.min()) / (np.ptp(time) + 1e-9)
    phase = rng.uniform(0, 2 * np.pi, 3)
    wander = sum(np.sin(2 * np.pi * f * elapsed + p) / f for f, p in zip((0.7, 1.6, 3.1), phase, strict=True))
    amplitude += instrument.drift * (wander + rng.normal())
    amplitude += rng.normal(size=len(way)) * instrument.noise * (1 + 10 ** ((instrument.weak - amplitude) / 20))
    amplitude = np.round(amplitude / instrument.step) * instrument.step
    world = alignment.place(local + (share * step)[:, None] * way)
    stand = alignment.place(np.column_stack([start, np.broadcast_to(tunnel.origin, (len(way), 2))]))
    world += (world - stand) / np.maximum(reach, 0.1)[:, None] * rng.normal(0, instrument.range_noise, len(way))[:, None]
    met = np.where(mixed, MIXED, hits.met).astype(np.int32)
    number = np.full(len(way), rays.station, dtype=np.uint16)
    cloud = Cloud(world, amplitude, spread, matte, hits.u, hits.s, met, time, number)
    faint = (instrument.limit - amplitude) / 1.5
    seen = np.isfinite(hits.distance) & (reach > NEAREST) & (reach < FARTHEST) & (rng.normal(size=len(way)) > faint)
    return cloud.take(seen)


def _returned(
    tunnel: Tunnel, alignment: Alignment, start: Array, way: Array, hits: Hits, instrument: Instrument, matt: Matt
) -> tuple[Array, Array, Array, Array, Array]:
    """Place, range and level of what rays met, with the parts of the range and of the incidence on dry lining."""
    distance = np.where(np.isfinite(hits.distance), hits.distance, 1.0)
    stand = np.column_stack([start, np.broadcast_to(tunnel.origin, (len(way), 2))])
    local = stand + distance[:, None] * way
    sight = alignment.place(stand) - alignment.place(local)
    reach = np.linalg.norm(sight, axis=1)
    cosine = (sight * alignment.turn(hits.u, hits.normal)).sum(axis=1) / reach
    i, j = tunnel.cells(hits.u, hits.s)
    canvas = tunnel.canvas
    lining = bilinear(canvas.base, i, j) + bilinear(canvas.water, i, j)
    spread, matte = instrument.range_law(reach), matt.law(cosine)
    level = lining + matt.law(cosine, bilinear(canvas.sheen, i, j))
    for index, fitting in enumerate(tunnel.fittings):
        on = hits.met == index
        if on.any():
            level[on] = fitting.level + (0.0 if fitting.retro else matt.law(cosine[on], fitting.sheen))
    return local, reach, level + spread, spread, matte


def thinned(cloud: Cloud, spacing: float, most: int, rng: np.random.Generator) -> Cloud:
    """One point for each cube of space, drawn by lot, and not more than a number of them."""
    order = rng.permutation(len(cloud.time))
    cubes = np.floor((cloud.xyz[order] - cloud.xyz.min(axis=0)) / spacing).astype(np.int64)
    _, first = np.unique((cubes[:, 0] << 40) | (cubes[:, 1] << 20) | cubes[:, 2], return_index=True)
    kept = order[first]
    if len(kept) > most:
        kept = rng.choice(kept, most, replace=False)
    return cloud.take(kept[np.lexsort((cloud.time[kept], cloud.station[kept]))])
