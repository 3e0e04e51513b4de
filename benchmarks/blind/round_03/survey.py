"""A tunnel is scanned: from rays to the points of a cloud."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .arrays import Floats, Ints, Mask, Rng
from .equipment import Beams, Fixture, nearest_front
from .instrument import Instrument, Law
from .scanners import Scanner
from .tracing import Rays, Tracer, Tunnel

_STEEPEST = 0.1  # cosine below which echoes of the lining are too weak and wide


@dataclass(frozen=True)
class Build:
    """All that makes a scene.

    Attributes
    ----------
    tunnel, scanner, instrument
        What is scanned, and with what.
    seed : int
        Of the scan.
    outliers : float
        Share of points which are echoes of dust, insects and spray.
    has_reference : bool
        Whether the owner has a curve of the amplitude over the range.
    axis_height : float
        Of the axis above the floor.
    misfit : float
        Standard deviation of the places of stations in the registered cloud, m.
    """

    tunnel: Tunnel
    scanner: Scanner
    instrument: Instrument
    seed: int
    outliers: float = 0.001
    has_reference: bool = True
    axis_height: float = 1.5
    misfit: float = 0.0015


@dataclass(frozen=True)
class Cloud:
    """Points of a scan.

    Attributes
    ----------
    site : ndarray
        Site coordinates (n × 3).
    amplitude, time : ndarray
        dB and seconds.
    source : ndarray
        Number of the station.
    wet_at, wet_loss : ndarray
        Chainage and arc (n × 2) of wet lining that was hit, and what the water took there, dB.
    """

    site: Floats
    amplitude: Floats
    time: Floats
    source: Ints
    wet_at: Floats
    wet_loss: Floats


def _pick(beams: Beams, kept: Mask) -> Beams:
    return Beams(*(getattr(beams, name)[kept] for name in Beams.__dataclass_fields__))


def _front_echo(fixtures: tuple[Fixture, ...], law: Law, cosine: Floats, number: Ints, rng: Rng) -> Floats:
    """Echo of equipment, as if the whole beam met it."""
    echo = np.zeros(cosine.size)
    for which, fixture in enumerate(fixtures):
        rows = np.flatnonzero(number == which)
        if rows.size:
            part = cosine[rows]
            echo[rows] = 10.0 ** (fixture.tone / 10.0) * part + fixture.gloss * law.specular(part)
    return echo * 10.0 ** (0.05 * rng.standard_normal(echo.size))


def _block(build: Build, tracer: Tracer, rays: Rays, rng: Rng) -> Cloud:
    tunnel, instrument = build.tunnel, build.instrument
    canvas, law = tunnel.canvas, instrument.law
    t = tracer.ranges(rays)
    met = np.isfinite(t)
    rays = replace(rays, **{name: getattr(rays, name)[met] for name in _PER_RAY})
    beams = tracer.beams(rays, t[met])
    seen = (beams.cosine > _STEEPEST) & (beams.s >= 0.0) & (beams.s <= canvas.length)
    rays = replace(rays, **{name: getattr(rays, name)[seen] for name in _PER_RAY})
    beams = _pick(beams, seen)

    dry = 10.0 ** (canvas.sample(canvas.albedo, beams.s, beams.arc) / 10.0)
    loss = canvas.sample(canvas.drop, beams.s, beams.arc)
    gloss = canvas.sample(canvas.gloss, beams.s, beams.arc)
    diffuse = law.diffuse(beams.cosine)
    shine = gloss * law.specular(beams.cosine)
    wall = dry * 10.0 ** (-loss / 10.0) * diffuse + shine

    front, share, cosine, number = nearest_front(tunnel.fixtures, beams)
    thing = _front_echo(tunnel.fixtures, law, cosine, number, rng)
    echo = share * thing + (1.0 - share) * wall
    # a phase scanner puts what it sees on an edge somewhere between both surfaces
    mixed = (share > 0.02) & (share < 0.98)
    weight = np.where(mixed, share * thing / np.maximum(echo, 1e-9), share > 0.5)
    offset = weight * front
    distance = beams.reach + offset

    amplitude = instrument.amplitude(echo, distance, rays.share, rays.facet, rng)
    noise = instrument.range_noise * np.clip(10.0 ** ((18.0 - amplitude) / 20.0), 1.0, 6.0) * rng.standard_normal(distance.size)
    distance = distance + noise
    wet = loss * (share < 0.5)
    bounced = rng.random(distance.size) < 0.004 * np.clip(wet, 0.0, 6.0)  # by way of the film of water: longer
    distance = distance + bounced * np.abs(rng.normal(0.0, 0.04, distance.size))
    stray = rng.random(distance.size) < build.outliers
    distance = np.where(stray, distance * rng.uniform(0.3, 1.02, distance.size), distance)
    amplitude = np.where(stray, amplitude - np.abs(rng.normal(3.0, 3.0, distance.size)), amplitude)

    kept = (amplitude > instrument.threshold) & (distance > 0.8)
    site = rays.origin[kept] + distance[kept, None] * rays.direction[kept]
    watered = np.flatnonzero((wet > 0.05) & kept & ~stray)
    taken = 10.0 * np.log10((dry[watered] * diffuse[watered] + 1e-9) / wall[watered])
    return Cloud(
        site=site,
        amplitude=amplitude[kept],
        time=rays.time[kept],
        source=rays.source[kept],
        wet_at=np.stack([beams.s[watered], beams.arc[watered]], axis=1),
        wet_loss=taken,
    )


_PER_RAY = ("origin", "direction", "guess", "slant", "time", "share", "source", "facet")


def scan(build: Build) -> Cloud:
    """Scan the tunnel; a registered cloud of several stations has misfits of a millimetre or two between them."""
    rng = np.random.default_rng(build.seed)
    tracer = Tracer(build.tunnel, build.instrument)
    blocks = [_block(build, tracer, rays, rng) for rays in build.scanner.rays(build.tunnel, rng)]
    columns = [np.concatenate([getattr(block, name) for block in blocks]) for name in Cloud.__dataclass_fields__]
    cloud = Cloud(*columns)
    shifts = build.misfit * rng.standard_normal((int(cloud.source.max()) + 1, 3))
    return replace(cloud, site=cloud.site + shifts[cloud.source])
