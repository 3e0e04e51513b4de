"""The beam's footprint: where its edge of a thing, a recess or a lip passes through, the echo is a mixture of two surfaces.

A second ray is shot at random within the footprint of each. Where it meets another surface, the edge between is found by
halving, and the footprint's share beyond it is that of a circle's segment. The echo is the mean of both by power, as a
phase-shift scanner or one that does not tell close echoes apart has it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.objects.fixtures import FLOOR, OUTLIER, RAIL
from tunneldb.simulate.radiometry import SYSTEM_CONSTANT, Radiometry, range_term
from tunneldb.simulate.scanner import Rays
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Rows as of :func:`trace` for rays (by index) in other directions, without noise and stray points.
Shoot = Callable[[Int64, Float], Float]

EXIT = 0.006  # diameter of the beam at the scanner, m
STEP = 0.005  # least difference of range between two surfaces, m
LEAST = 0.02  # least share of the footprint that changes an echo
HALVINGS = 5


def aside(direction: Float, rng: np.random.Generator) -> tuple[Float, Float]:
    """Places within footprints, even over the disc: vectors across the rays (n, 3), 1 at the rim, and their lengths (n,)."""
    other = np.where(np.abs(direction[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    one = np.cross(direction, other)
    one /= np.linalg.norm(one, axis=1)[:, None]
    two = np.cross(direction, one)
    radius, angle = np.sqrt(rng.random(len(direction))), rng.uniform(0.0, 2.0 * np.pi, len(direction))
    return radius[:, None] * (np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * two), radius


def segment_share(distance: Float) -> Float:
    """Share of a circle's area beyond a chord at a distance (in radii) from its centre."""
    x = np.clip(distance, 0.0, 1.0)
    return np.asarray((np.arccos(x) - x * np.sqrt(1.0 - x * x)) / np.pi)


def _level(radiometry: Radiometry, rows: Float) -> tuple[Float, Float]:
    """Range-free part and amplitude of echoes, dB."""
    ground = (rows[:, 7] == FLOOR) | (rows[:, 7] == RAIL)
    level = radiometry.reflectance(rows[:, 10], ground, rows[:, 9])
    return level, radiometry.amplitude(rows[:, 11], level)


def blur(
    out: Float,
    rays: Rays,
    index: Int64,
    divergence: float,
    shoot: Shoot,
    tunnel: Tunnel,
    radiometry: Radiometry,
    rng: np.random.Generator,
) -> None:
    """Mix the echoes at edges, in place.

    Parameters
    ----------
    out : (n, 12 or 13)
        Rows of :func:`trace` with an echo.
    rays, index : Rays, (n,)
        All rays, and which of them each row is of.
    divergence : float
        Full angle of the beam, mrad.
    shoot : callable
        Shoots rays in other directions.
    """
    direction = rays.direction[index]
    across, beside = aside(direction, rng)
    radius = 0.5 * (EXIT + 1e-3 * divergence * out[:, 11])

    def at(rows: Int64, share: Float | float) -> Float:
        """Shoot towards a share of the way to the place beside the middle."""
        turned = direction[rows] * out[rows, 11:12] + np.reshape(share, (-1, 1)) * radius[rows, None] * across[rows]
        there = shoot(index[rows], turned / np.linalg.norm(turned, axis=1)[:, None])
        there[np.isnan(there[:, 0])] = np.nan  # no echo: the other columns are not set
        return there

    candidates = np.flatnonzero(out[:, 7] != OUTLIER)
    second = at(candidates, 1.0)
    slant = np.minimum(out[candidates, 10], second[:, 10])
    plane = 1.5 * radius[candidates] * np.sqrt(1.0 - slant**2) / slant
    is_edge = np.abs(second[:, 11] - out[candidates, 11]) > STEP + plane  # False without an echo
    rows, second = candidates[is_edge], second[is_edge]
    if not len(rows):
        return
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        there = at(rows, middle)[:, 11]
        is_first = np.abs(there - out[rows, 11]) < np.abs(there - second[:, 11])
        low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)
    share = segment_share(0.5 * (low + high) * beside[rows])
    mixed = share >= LEAST
    rows, second, share = rows[mixed], second[mixed], share[mixed]
    first = out[rows]
    one = (1.0 - share) * 10.0 ** (0.1 * _level(radiometry, first)[1])
    two = share * 10.0 ** (0.1 * _level(radiometry, second)[1])
    distance = (one * first[:, 11] + two * second[:, 11]) / (one + two)
    level = 10.0 * np.log10(one + two) - SYSTEM_CONSTANT - range_term(distance, radiometry.near_loss)
    measured = distance + first[:, 0] - first[:, 11]
    xyz = rays.origin[index[rows]] + measured[:, None] * direction[rows]
    place = tunnel.unroll(xyz + tunnel.line.origin)
    plain = radiometry.reflectance(first[:, 10], np.zeros(len(rows), dtype=bool), np.zeros(len(rows)))
    out[rows, 0], out[rows, 1:4] = measured, xyz
    out[rows, 4], out[rows, 5], out[rows, 6] = place.chainage, place.arc, place.offset
    out[rows, 7], out[rows, 8], out[rows, 9], out[rows, 11] = OUTLIER, -1.0, plain - level, distance
    out[rows, 12:] = 0.0
