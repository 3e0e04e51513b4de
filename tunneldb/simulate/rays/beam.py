"""Footprint of the beam: at the edge of an object, a recess or a step, the echo is a mixture of two surfaces.

A second ray is cast at random within the footprint of each ray. If it hits another surface, the edge between them is found by
bisection, and the share of the footprint beyond the edge is that of a circular segment. The echo is the mean of both by
power, as in a phase-shift scanner or one that does not separate close echoes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.simulate.objects.fixtures import FLOOR, OUTLIER, RAIL
from tunneldb.simulate.radiometry import SYSTEM_CONSTANT, Radiometry, range_term
from tunneldb.simulate.rays.trace import Echoes
from tunneldb.simulate.scanner import Rays
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Echoes of rays (by index) in other directions, without noise and stray points.
Shoot = Callable[[Int64, Float], Echoes]

EXIT_DIAMETER = 0.006  # m; diameter of the beam at the scanner
MIN_STEP = 0.005  # least difference of range between two surfaces, m
MIN_SHARE = 0.02  # least share of the footprint that changes an echo
HALVINGS = 5


def footprint_offsets(direction: Float, rng: np.random.Generator) -> tuple[Float, Float]:
    """Return uniform random places in footprints: vectors across the rays (n, 3), 1 at the rim, and their lengths (n,)."""
    other = np.where(np.abs(direction[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    one = np.cross(direction, other)
    one /= np.linalg.norm(one, axis=1)[:, None]
    two = np.cross(direction, one)
    radius, angle = np.sqrt(rng.random(len(direction))), rng.uniform(0.0, 2.0 * np.pi, len(direction))
    return radius[:, None] * (np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two), radius


def segment_share(distance: Float) -> Float:
    """Return the share of a circle's area beyond a chord at a distance (in radii) from its centre."""
    x = np.clip(distance, 0.0, 1.0)
    return np.asarray((np.arccos(x) - x * np.sqrt(1.0 - x * x)) / np.pi)


class _Spot(NamedTuple):
    """Hits of rays, (n,) each: range (NaN: no echo), cosine of incidence, class, darkening."""

    range: Float
    cosine: Float
    klass: Float
    drop: Float

    def amplitude(self, radiometry: Radiometry) -> Float:
        """Return the amplitude of the echo, dB."""
        is_ground = (self.klass == FLOOR) | (self.klass == RAIL)
        return radiometry.amplitude(self.range, radiometry.reflectance(self.cosine, is_ground, self.drop))

    def take(self, rows: Int64 | Bool) -> _Spot:
        """Return some of them."""
        return _Spot(*(column[rows] for column in self))


def blur(
    echoes: Echoes,
    rays: Rays,
    divergence: float,
    shoot: Shoot,
    tunnel: Tunnel,
    radiometry: Radiometry,
    rng: np.random.Generator,
) -> Echoes:
    """Mix the echoes at edges.

    Parameters
    ----------
    echoes : Echoes
        Echoes of single rays.
    rays : Rays
        All rays.
    divergence : float
        Full angle of the beam, mrad.
    shoot : callable
        Function that casts rays in other directions.
    """
    direction = rays.direction[echoes.ray]
    across, offset = footprint_offsets(direction, rng)
    radius = 0.5 * (EXIT_DIAMETER + 1e-3 * divergence * echoes.range)

    def at(rows: Int64, share: Float | float) -> _Spot:
        """Cast rays towards a share of the way from the centre to the second ray."""
        turned = direction[rows] * echoes.range[rows, None] + np.reshape(share, (-1, 1)) * radius[rows, None] * across[rows]
        there = shoot(echoes.ray[rows], turned / np.linalg.norm(turned, axis=1)[:, None])
        spots = np.full((4, len(rows)), np.nan)
        spots[:, there.ray] = there.range, there.cosine, there.klass, there.drop
        return _Spot(*spots)

    candidates = np.flatnonzero(echoes.klass != OUTLIER)
    second = at(candidates, 1.0)
    slant = np.minimum(echoes.cosine[candidates], second.cosine)
    plane = 1.5 * radius[candidates] * np.sqrt(1.0 - slant**2) / slant
    is_edge = np.abs(second.range - echoes.range[candidates]) > MIN_STEP + plane  # False without an echo
    rows, second = candidates[is_edge], second.take(is_edge)
    if not len(rows):
        return echoes
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        there = at(rows, middle).range
        is_first = np.abs(there - echoes.range[rows]) < np.abs(there - second.range)
        low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)
    share = segment_share(0.5 * (low + high) * offset[rows])
    mixed = share >= MIN_SHARE
    rows, second, share = rows[mixed], second.take(mixed), share[mixed]
    before = echoes.take(rows)
    first = _Spot(before.range, before.cosine, before.klass.astype(float), before.drop)
    one = (1.0 - share) * 10.0 ** (0.1 * first.amplitude(radiometry))
    two = share * 10.0 ** (0.1 * second.amplitude(radiometry))
    distance = (one * first.range + two * second.range) / (one + two)
    level = 10.0 * np.log10(one + two) - SYSTEM_CONSTANT - range_term(distance, radiometry.near_loss)
    measured = distance + before.measured - before.range
    xyz = rays.origin[before.ray] + measured[:, None] * direction[rows]
    place = tunnel.unroll(xyz + tunnel.line.origin)
    plain = radiometry.reflectance(first.cosine, np.zeros(len(rows), dtype=bool), np.zeros(len(rows)))
    after = before._replace(
        measured=measured,
        xyz=xyz,
        chainage=place.chainage,
        arc=place.arc,
        offset=place.offset,
        klass=np.full(len(rows), OUTLIER),
        leak=np.full(len(rows), -1),
        drop=plain - level,
        range=distance,
        thing=np.zeros(len(rows), dtype=np.int64),
    )
    for column, values in zip(echoes, after, strict=True):
        column[rows] = values
    return echoes
