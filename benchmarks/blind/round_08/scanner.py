"""Laser scanners, static and moving: their rays, what these meet, and the amplitude that comes back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from benchmarks.blind.round_08.fittings import Fittings, windows
from benchmarks.blind.round_08.surface import Surface
from benchmarks.blind.round_08.tunnel import Array, Axis, Section

MIN_RANGE, MAX_RANGE = 1.5, 25.0


@dataclass(frozen=True)
class Instrument:
    """What a scanner does to amplitude and range.

    Attributes
    ----------
    law : callable
        Amplitude over range, in dB, of a target of level 0 square to the beam.
    speckle : float
        Scatter of amplitude where the signal is strong, in dB.
    floor : float
        Amplitude at which noise reaches 3 dB; a few dB beneath it nothing is recorded.
    drift : float
        Slow change of amplitude during a scan, in dB.
    offsets : float
        Scatter between stations, in dB.
    jitter : float
        Scatter of range, in metres.
    mixed : float
        Share of rays at edges that come back from between near and far.
    exponent : float
        Of the cosine of incidence for the lining: 1 is Lambert's law, less is rough.
    lobe : float
        Width of the mirroring lobe, as the tangent of incidence.
    digit : float
        Step of the recorded amplitude, in dB.
    """

    law: Callable[[Array], Array]
    speckle: float = 0.5
    floor: float = -40.0
    drift: float = 0.2
    offsets: float = 0.1
    jitter: float = 0.0015
    mixed: float = 0.4
    exponent: float = 1.0
    lobe: float = 0.25
    digit: float = 0.01

    def incidence(self, cosine: Array, gloss: Array | float) -> Array:
        """Amplitude over the cosine of incidence, in dB."""
        mirror = np.exp(-(1.0 / np.maximum(cosine, 0.02) ** 2 - 1.0) / self.lobe**2)
        return 10.0 * np.log10(cosine**self.exponent + gloss * mirror)


@dataclass
class Sweep:
    """Rays of one station or of one drive, in rows and columns.

    Attributes
    ----------
    origin : array of (rows, 3)
        Where they start.
    direction : array of (rows, columns, 3)
        Unit vectors.
    row, column : array
        Azimuth and elevation of a static scan; chainage and angle from the zenith of a moving one.
    moving : bool
        Which of the two it is.
    time : array of (rows,)
        Seconds.
    scan : int
        Number of the station.
    step : float
        Angle between rays.
    advance : float
        Between profiles of a moving scanner, in metres.
    """

    origin: Array
    direction: Array
    row: Array
    column: Array
    moving: bool
    time: Array
    scan: int
    step: float
    advance: float = 0.0

    def near(self, axis: Axis, centre: Array, radius: float) -> tuple[Array, Array]:
        """Rows and columns of rays that may pass through a ball."""
        if self.moving:
            s, h, v = (float(value) for value in axis.to_tunnel(centre))
            rows = windows(self.row, s, radius + 0.1, None)
            _, h0, v0 = axis.to_tunnel(self.origin[rows].mean(axis=0) if rows.size else self.origin[0])
            away = float(np.hypot(h - h0, v - v0))
            half = np.pi if away < radius * 1.2 else float(np.arcsin(radius / away)) + 0.02
            return rows, windows(self.column, float(np.arctan2(h - h0, v - v0)), half, 2 * np.pi)
        d = centre - self.origin[0]
        away = float(np.linalg.norm(d))
        half = np.pi if away < radius * 1.05 else float(np.arcsin(radius / away))
        rise = float(np.arcsin(d[2] / away))
        reach = np.sin(half) / max(np.cos(rise), 1e-6)
        turn = np.pi if half >= np.pi / 2 or reach >= 1.0 else float(np.arcsin(reach))
        rows = windows(self.row, float(np.arctan2(d[1], d[0])), turn + 0.01, 2 * np.pi)
        return rows, windows(self.column, rise, half + 0.01, None)


def station(axis: Axis, s: float, h: float, v: float, scan: int, step: float) -> Sweep:
    """Rays of a scanner on its tripod; ``step`` in degrees, the cone beneath it is blind."""
    angle = np.radians(step)
    row = np.arange(-np.pi, np.pi, angle)
    column = np.arange(np.radians(-55.0), np.radians(89.9), angle)
    rise, turn = np.cos(column)[None, :], row[:, None]
    direction = np.stack(
        [np.cos(turn) * rise, np.sin(turn) * rise, np.broadcast_to(np.sin(column), (row.size, column.size))], -1
    )
    origin = np.repeat(axis.to_local(s, h, v)[None], row.size, axis=0)
    time = 3600.0 + 420.0 * scan + np.arange(row.size) * 0.06
    return Sweep(origin, direction, row, column, False, time, scan, angle)


def drive(axis: Axis, length: float, h: float, v: float, advance: float, rays: int, speed: float, seed: int) -> Sweep:
    """Rays of a profile scanner on a vehicle that sways a little."""
    rng = np.random.default_rng(seed)
    row = np.arange(-1.0, length + 1.0, advance)
    sway = ndimage.gaussian_filter1d(rng.standard_normal((2, row.size)), 2.0 / advance, axis=1)
    sway *= 0.012 / sway.std(axis=1, keepdims=True)
    column = np.linspace(-np.pi, np.pi, rays, endpoint=False)
    _, right = axis.frame(row)
    # The mirror's plane stands a fraction of a degree askew, as calibration leaves it.
    yaw = np.radians(0.15)
    ahead, _ = axis.frame(row)
    right = right * np.cos(yaw) + ahead * np.sin(yaw)
    up = np.array([0.0, 0.0, 1.0])
    direction = np.sin(column)[None, :, None] * right[:, None, :] + np.cos(column)[None, :, None] * up
    origin = axis.to_local(row, h + sway[0], v + sway[1])
    return Sweep(origin, direction, row, column, True, 208_800.0 + (row + 1.0) / speed, 1, 2 * np.pi / rays, advance)


@dataclass
class Cloud:
    """Points of a scan, relative to the origin; level is amplitude with range and (dry) incidence taken off."""

    xyz: Array
    amplitude: Array
    level: Array
    time: Array
    scan: Array
    s: Array
    u: Array
    lining: Array


def _cast(sweep: Sweep, axis: Axis, section: Section, surface: Surface, fittings: Fittings) -> tuple[Array, ...]:
    """Distance, cosine of incidence, chainage, girth and fitting (-1: lining) of every ray; NaN where it meets nothing near."""
    shape = sweep.direction.shape[:2]
    origin = np.repeat(sweep.origin, shape[1], axis=0)
    direction = sweep.direction.reshape(-1, 3)
    s0, h0, v0 = (float(np.mean(value)) for value in axis.to_tunnel(sweep.origin))
    _, right = axis.frame(np.array(s0))
    side = np.sin(np.tile(sweep.column, shape[0])) if sweep.moving else direction @ right
    across = np.maximum(np.hypot(side, direction[:, 2]), 1e-3)
    t = section.reach(h0, v0, np.arctan2(side, direction[:, 2])) / across
    live = np.flatnonzero(t < MAX_RANGE + 3.0)
    o, d, t = origin[live], direction[live], t[live]
    slope = [
        gradient.astype(np.float32) for gradient in np.gradient(ndimage.gaussian_filter(surface.relief, 1.0), surface.step)
    ]
    for _ in range(7):
        s, h, v = axis.to_tunnel(o + t[:, None] * d)
        u, inside, normal_h, normal_v = section.nearest(h, v)
        cell = surface.index(s, u)
        ahead, right = axis.frame(s)
        fall = -(np.einsum("ij,ij->i", d, right) * normal_h + d[:, 2] * normal_v)
        gap = inside + surface.relief[cell]
        t = np.clip(t + np.clip(gap / np.maximum(fall, 0.15), -1.0, 1.0), 0.1, MAX_RANGE + 10.0)
    # The normal leans with the relief: outward relief grows along s and along u.
    along = np.einsum("ij,ij->i", d, ahead)
    around = np.einsum("ij,ij->i", d, right) * -normal_v + d[:, 2] * normal_h
    cosine = (fall - along * slope[0][cell] - around * slope[1][cell]) / np.sqrt(1 + slope[0][cell] ** 2 + slope[1][cell] ** 2)
    good = (np.abs(gap) < 0.02) & (s >= 0.0) & (s < surface.length) & (fall > 0.03)
    out = [np.full(shape[0] * shape[1], np.nan) for _ in range(4)]
    for target, value in zip(out, (t, np.clip(cosine, 0.03, 1.0), s, u), strict=True):
        target[live] = np.where(good, value, np.nan)
    reach, cosine, s, u = (value.reshape(shape) for value in out)
    fitting = np.full(shape, -1)
    for number, piece in enumerate(fittings.pieces):
        rows, columns = sweep.near(axis, piece.centre, piece.radius)
        if not rows.size or not columns.size:
            continue
        block = np.ix_(rows, columns)
        there = sweep.direction[block].reshape(-1, 3)
        distance, lean = piece.meet(np.repeat(sweep.origin[rows], columns.size, axis=0), there)
        distance, lean = distance.reshape(rows.size, -1), lean.reshape(rows.size, -1)
        nearer = distance < np.where(np.isnan(reach[block]), MAX_RANGE, reach[block])
        for target, value in ((reach, distance), (cosine, lean), (fitting, number)):
            target[block] = np.where(nearer, value, target[block])
    return reach, cosine, s, u, fitting


def observe(
    sweep: Sweep, axis: Axis, section: Section, surface: Surface, fittings: Fittings, instrument: Instrument, density: float
) -> Cloud:
    """Scan: cast rays, and record amplitude and place of those that come back, thinned to a density per square metre."""
    rng = np.random.default_rng(8_000 + sweep.scan)
    reach, cosine, s, u, fitting = _cast(sweep, axis, section, surface, fittings)
    cell = surface.index(np.nan_to_num(s), np.nan_to_num(u))
    on = fitting < 0
    look = np.array([(piece.db, piece.gloss) for piece in fittings.pieces] or [(0.0, 0.0)])[fitting]
    dry_gloss = np.where(on, surface.gloss[cell], look[..., 1])
    gloss = dry_gloss + np.where(on, surface.film[cell], 0.0)
    level = np.where(on, surface.db[cell], look[..., 0] + rng.normal(0.0, 0.4, reach.shape))
    bare = instrument.law(reach) + instrument.incidence(cosine, dry_gloss)
    signal = bare - instrument.incidence(cosine, dry_gloss) + instrument.incidence(cosine, gloss) + level
    # At an edge the beam is shared by what is near and what is far.
    jump = np.abs(np.diff(reach, axis=1)) > 0.06
    split = np.zeros(reach.shape, bool)
    split[:, :-1] = jump & (rng.random(jump.shape) < instrument.mixed)
    share = rng.uniform(0.1, 0.9, reach.shape)
    beside, beside_reach = np.roll(signal, -1, axis=1), np.roll(reach, -1, axis=1)
    with np.errstate(invalid="ignore"):
        blend = 10.0 * np.log10(share * 10.0 ** (signal / 10.0) + (1.0 - share) * 10.0 ** (beside / 10.0))
    signal, reach = np.where(split, blend, signal), np.where(split, share * reach + (1.0 - share) * beside_reach, reach)
    spread = reach * sweep.step
    across = sweep.advance if sweep.moving else spread * np.cos(sweep.column)[None, :]
    keep = rng.random(reach.shape) < density * spread * across / cosine
    keep &= (reach >= MIN_RANGE) & (reach <= MAX_RANGE) & (signal + rng.normal(0.0, 1.5, reach.shape) > instrument.floor - 3.0)
    rows, columns = np.nonzero(keep)
    signal, bare, reach, split = signal[keep], bare[keep], reach[keep], split[keep]
    scatter = np.hypot(instrument.speckle, 3.0 * 10.0 ** ((instrument.floor - signal) / 20.0))
    warm = ndimage.gaussian_filter1d(rng.standard_normal(sweep.row.size), sweep.row.size / 12.0)
    warm = instrument.drift * (warm - warm.mean()) / warm.std()
    amplitude = signal + scatter * rng.standard_normal(signal.size) + warm[rows] + rng.normal(0.0, instrument.offsets)
    amplitude = np.round(amplitude / instrument.digit) * instrument.digit
    measured = reach + rng.normal(0.0, instrument.jitter, reach.size)
    xyz = sweep.origin[rows] + measured[:, None] * sweep.direction[rows, columns]
    lining = on[keep] & ~split & (np.nan_to_num(u[keep]) < section.lined)
    time = sweep.time[rows] + columns * 1e-5
    scan = np.full(rows.size, sweep.scan)
    return Cloud(xyz, amplitude, amplitude - bare, time, scan, s[keep], u[keep], lining)
