"""Scans of a mechanical profiling sonar below the water of a synthetic canal tunnel.

A fan of narrow beams turns about the tripod's axis. The strongest echo of each beam is recorded, among all surfaces in its cone
within one pulse length. So on a slanting wall it is not from the beam's middle, and at an edge it is from the nearer or the
stronger side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int32
from tunneldb.simulate.canal.cast import NO_HIT, Hits, Scene, cast
from tunneldb.simulate.canal.laser import directions
from tunneldb.simulate.canal.layout import Layout, Tripod
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.canal.section import BED, BOAT, LADDER, OBJECT, PIER, TOWPATH, VAULT, WALL, WATER

FALSE = -2
"""Kind of a false echo."""

# Strength of the echo at normal incidence, relative to masonry; mud absorbs some of it, round bars reflect strongly.
_STRENGTH = {BED: 0.6, WALL: 1.0, VAULT: 1.0, TOWPATH: 1.0, LADDER: 1.5, PIER: 1.0, OBJECT: 1.2, BOAT: 1.5}
_LAMBERT = 1.0  # power of the cosine, in addition to the larger area of a beam on a slanting surface
_RINGS = {1: ((1, 0.0),), 7: ((1, 0.0), (6, 0.4)), 13: ((1, 0.0), (6, 0.35), (6, 0.7)), 19: ((1, 0.0), (6, 0.3), (12, 0.65))}
_BLOCK = 20_000  # beams
# Shares of the false echoes: via the water surface, via a second wall, via side lobes; the others are noise.
_BY_SURFACE, _BY_WALL, _BY_LOBES = 0.4, 0.2, 0.2
_MIN_RANGE = 0.4  # m


@dataclass(frozen=True)
class SonarScan:
    """Scan as in its file, with its reference data.

    Attributes
    ----------
    points : (n, 3) float array
        File's axes, m.
    intensity : (n,) float array
        Intensity above the weakest echo, dB.
    kind : (n,) int array
        Kind of the surface (tunneldb.simulate.canal.section), WATER or FALSE.
    rotation, translation, scale
        A point of the tunnel = rotation @ (scale * point of the file) + translation: (3, 3), (3,) m, and a number.
    tilt : float
        Elevation of the middle of the fan, degrees.
    """

    name: str
    points: Float
    intensity: Float
    kind: Int32
    rotation: Float
    translation: Float
    scale: float
    tilt: float


@dataclass(frozen=True)
class _Echoes:
    """Range, m, strength and source of the strongest echo of each beam."""

    range: Float
    strength: Float
    kind: Int32


def scan_by_sonar(
    parameters: CanalParameters, layout: Layout, tripod: Tripod, number: int, tilt: float, to_tunnel: Float, origin: Float
) -> SonarScan:
    """Simulate one rotation from a tripod.

    Parameters
    ----------
    number : int
        Number of the scan, from 1; it seeds its noise.
    tilt : float
        Elevation of the middle of the fan, degrees.
    to_tunnel, origin : (3, 3), (3,) float arrays
        Rotation and position of the local frame in the tunnel's.
    """
    p = parameters
    rng = np.random.default_rng([p.seed, 3, number])
    session = np.random.default_rng([p.seed, 4]).uniform(-p.sound_speed_spread, p.sound_speed_spread)
    error = session if p.sound_speed_error is None else p.sound_speed_error
    scale = 1.0 + error + rng.uniform(-p.sound_speed_scan_spread, p.sound_speed_scan_spread)
    azimuth = np.radians(np.arange(0.0, 360.0, p.sonar_step))
    elevation = np.radians(tilt + np.linspace(-0.5, 0.5, p.sonar_beams) * p.sonar_swath)
    turn, rise = (grid.ravel() for grid in np.meshgrid(azimuth, elevation, indexing="ij"))
    beams = directions(turn, rise)
    place = np.broadcast_to(tripod.place, beams.shape).copy()
    place[turn > np.pi] += p.sonar_settling * np.append(directions(rng.uniform(0.0, 2.0 * np.pi, 1), np.zeros(1))[0, :2], 0.0)
    echoes = _echoes(p, layout.scene, place, beams, tripod.rotation)
    seen = (echoes.kind != NO_HIT) & (echoes.range > _MIN_RANGE) & (echoes.range < p.sonar_maximum_range)
    seen &= (echoes.kind != WATER) | (rng.random(len(beams)) < p.water_surface_share)
    reach, kind, strength = echoes.range.copy(), echoes.kind.copy(), echoes.strength.copy()
    false = _false_echoes(p, layout.scene, place, beams @ tripod.rotation.T, echoes, seen, rng)
    for beam, wrong in false:
        reach[beam], kind[beam], seen[beam] = wrong, FALSE, True
        strength[beam] *= 0.3
    reach = reach[seen] + rng.normal(0.0, p.sonar_noise, int(seen.sum()))
    flip = np.diag([1.0, -1.0, -1.0]) if p.sonar_z_down else np.eye(3)
    points = (reach / scale)[:, None] * beams[seen] @ flip
    level = 10.0 * np.log10(np.maximum(strength[seen], 1e-12))
    return SonarScan(
        f"sonar-{number}", points, level - level.min(), kind[seen], to_tunnel @ tripod.rotation @ flip,
        to_tunnel @ tripod.place + origin, scale, tilt,
    )  # fmt: skip


def _cone(parameters: CanalParameters) -> tuple[Float, Float]:
    """Return the angles (k, 2) of a beam's rays from its middle, rad, and their two-way weights (k,)."""
    angles = []
    for count, radius in _RINGS[parameters.sub_rays]:
        around = 2.0 * np.pi * (np.arange(count) + 0.5 * (radius > 0.5)) / count
        angles.append(radius * parameters.sonar_beam_width * np.column_stack([np.cos(around), np.sin(around)]))
    off = np.concatenate(angles)
    weight = np.exp(-4.0 * np.log(2.0) * (off**2).sum(axis=1) / parameters.sonar_beam_width**2)
    return np.radians(off), weight


def _echoes(parameters: CanalParameters, scene: Scene, place: Float, beams: Float, rotation: Float) -> _Echoes:
    """Return the strongest echo of beams (n, 3), file's axes but upright, from positions (n, 3), local frame."""
    off, weight = _cone(parameters)
    table = np.zeros(max(_STRENGTH) + 2)
    table[list(_STRENGTH)] = list(_STRENGTH.values())
    out = _Echoes(np.full(len(beams), np.inf), np.zeros(len(beams)), np.full(len(beams), NO_HIT, np.int32))
    for begin in range(0, len(beams), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        middle = beams[part]
        side = np.cross(middle, [0.0, 0.0, 1.0])
        side /= np.linalg.norm(side, axis=1)[:, None]
        over = np.cross(side, middle)
        rays = middle[:, None] + off[:, :1] * side[:, None] + off[:, 1:] * over[:, None]
        rays /= np.linalg.norm(rays, axis=2)[..., None]
        start = np.repeat(place[part], len(off), axis=0)
        hits = cast(scene, start, rays.reshape(-1, 3) @ rotation.T, parameters.sonar_maximum_range + 1.0)
        _strongest(parameters, hits, table, weight, out, part)
    return out


def _strongest(parameters: CanalParameters, hits: Hits, table: Float, weight: Float, out: _Echoes, part: slice) -> None:
    """Select the range cell with the most energy of each beam; its echo is the mean of the rays in it."""
    shape = (-1, len(weight))
    reach, kind, cosine = (column.reshape(shape) for column in (hits.range, hits.kind, hits.cosine))
    solid = (kind != NO_HIT) & (kind != WATER)
    power = np.where(solid, table[np.where(solid, kind, 0)] * weight * cosine**_LAMBERT, 0.0)
    within = (reach[:, None, :] >= reach[:, :, None]) & (reach[:, None, :] < reach[:, :, None] + parameters.sonar_resolution)
    energy = (within * power[:, None, :]).sum(axis=2)
    best = energy.argmax(axis=1)
    row = np.arange(len(best))
    chosen = within[row, best] * power
    total = chosen.sum(axis=1)
    met = total > 1e-4
    mean = (chosen * np.where(np.isfinite(reach), reach, 0.0)).sum(axis=1) / np.where(met, total, 1.0)
    water = (kind == WATER).all(axis=1)
    strongest = kind[row, chosen.argmax(axis=1)]
    out.range[part] = np.where(met, mean, np.where(water, reach[:, 0], np.inf))
    out.strength[part] = np.where(met, total, 0.05)
    out.kind[part] = np.where(met, strongest, np.where(water, WATER, NO_HIT))


def _false_echoes(
    parameters: CanalParameters, scene: Scene, place: Float, ways: Float, echoes: _Echoes, seen: Bool, rng: np.random.Generator
) -> list[tuple[Int32, Float]]:
    """Return the beams whose echo is false, and their ranges, m; ``ways`` (n, 3) are the beams in the local frame."""
    count = round(parameters.false_share * int(seen.sum()))
    by_surface, by_wall, by_lobes = (round(share * count) for share in (_BY_SURFACE, _BY_WALL, _BY_LOBES))
    out = []
    up = np.flatnonzero(echoes.kind == WATER)
    beam = rng.choice(up, min(by_surface, len(up)), replace=False)
    start = place[beam] + echoes.range[beam, None] * ways[beam]
    start[:, 2] = -1e-6
    out.append(_bounced(scene, start, ways[beam] * [1.0, 1.0, -1.0], echoes.range[beam], beam))
    walls = np.flatnonzero(seen & (echoes.kind == WALL))
    beam = rng.choice(walls, min(by_wall, len(walls)), replace=False)
    # off a wall and back from the other one: the walls are treated as vertical mirrors along the axis
    start = place[beam] + 0.98 * echoes.range[beam, None] * ways[beam]
    out.append(_bounced(scene, start, ways[beam] * [1.0, -1.0, 1.0], echoes.range[beam], beam))
    visible = np.flatnonzero(seen)
    beam = rng.choice(visible, min(by_lobes, len(visible)), replace=False)
    lobe = np.clip(beam + rng.integers(-12, 13, len(beam)), 0, len(ways) - 1)  # some degrees above or below
    known = np.isfinite(echoes.range[lobe])
    out.append((beam[known].astype(np.int32), echoes.range[lobe][known]))
    beam = rng.choice(visible, min(max(count - sum(len(b) for b, _ in out), 0), len(visible)), replace=False)
    out.append((beam.astype(np.int32), rng.uniform(_MIN_RANGE, min(15.0, parameters.sonar_maximum_range), len(beam))))
    return out


def _bounced(scene: Scene, start: Float, ways: Float, before: Float, beam: Float) -> tuple[Int32, Float]:
    """Return beams (n,) that continued from positions (n, 3) after ``before`` (n,) m and hit something, and their ranges."""
    hits = cast(scene, start, ways, 15.0)
    met = (hits.kind != NO_HIT) & (hits.kind != WATER) & (hits.range > 0.3)
    return beam[met].astype(np.int32), before[met] + hits.range[met]
