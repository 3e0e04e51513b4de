"""Bricks and stones in courses along the tunnel: positions, heights, and the mortar between.

Every other course is shifted by half a unit. Ends of stones are displaced at random, so that their lengths differ. Relief and
reflectance are based on the same units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.compiled import inner, kernel
from tunneldb.simulate.noise_field import mix, normal_field
from tunneldb.simulate.parameters import Parameters

_PART = 1.0 / 65535.0
_MASK = np.uint64(0xFFFF)


class Sizes(NamedTuple):
    """Limits of the random parameters of a kind of masonry.

    Length and height of a unit, width and depth of the mortar joint, standard deviation of the heights of units, m; standard
    deviation of their level, and level of the mortar, dB; displacement of their ends as a share of the length.
    """

    length: tuple[float, float]
    height: tuple[float, float]
    joint: tuple[float, float]
    depth: tuple[float, float]
    face: tuple[float, float]
    level: tuple[float, float]
    mortar: tuple[float, float]
    jitter: float


# Bricks of 0.18 to 0.30 by 0.05 to 0.10 m hold those of the standards (0.24 x 0.071 m, DIN 105); ashlar from small to large.
KINDS = {
    "brick": Sizes((0.18, 0.30), (0.05, 0.10), (0.006, 0.016), (0.002, 0.015), (0.0005, 0.004), (0.4, 2.0), (-2.0, 3.0), 0.0),
    "stone": Sizes((0.30, 0.80), (0.18, 0.45), (0.010, 0.030), (0.004, 0.030), (0.002, 0.012), (0.5, 2.0), (-2.0, 3.0), 0.5),
}


class Masonry(NamedTuple):
    """One masonry, drawn from its :class:`Sizes`; ``length`` 0: none. ``face`` bounds the heights of units, m."""

    length: float
    height: float
    joint: float
    depth: float
    face: float
    level: float
    mortar: float
    jitter: float
    salt: int


def make_masonry(parameters: Parameters, seed: np.random.SeedSequence) -> Masonry:
    """Return the masonry of the lining, if it is of bricks or stones."""
    sizes = KINDS.get(parameters.lining)
    if sizes is None:
        return Masonry(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0)
    rng = np.random.default_rng(seed)
    length, height, joint, depth, face, level, mortar = (float(rng.uniform(*limits)) for limits in sizes[:7])
    # Uniform numbers are at most √3 standard deviations from their mean.
    return Masonry(
        length, height, joint, depth, math.sqrt(3.0) * face, level, mortar, sizes.jitter, int(seed.generate_state(1)[0])
    )


@inner
def _end(masonry: Masonry, i: int, j: int) -> float:
    """Return the start of unit i of course j, in lengths."""
    return i + masonry.jitter * (_PART * float(mix(i, j, masonry.salt) & _MASK) - 0.5)


@inner
def unit_at(masonry: Masonry, s: float, arc: float) -> tuple[int, int, float]:
    """Return index in the course and course of the unit at a position, and the distance to its edge (the joint's middle), m."""
    y = arc / masonry.height
    j = math.floor(y)
    x = s / masonry.length + 0.5 * (j & 1)
    i = math.floor(x)
    if x < _end(masonry, i, j):
        i -= 1
    elif x >= _end(masonry, i + 1, j):
        i += 1
    along = min(x - _end(masonry, i, j), _end(masonry, i + 1, j) - x) * masonry.length
    return i, j, min(along, min(y - j, j + 1.0 - y) * masonry.height)


@inner
def unit_height(masonry: Masonry, s: float, arc: float) -> float:
    """Return the height of masonry above the nominal lining, m: units are in front or behind, mortar is deeper."""
    i, j, edge = unit_at(masonry, s, arc)
    if edge < 0.5 * masonry.joint:
        return -masonry.depth
    return masonry.face * (2.0 * _PART * float((mix(i, j, masonry.salt) >> np.uint64(16)) & _MASK) - 1.0)


@kernel
def _units(masonry: Masonry, s: Float, arc: Float, column: Int64, course: Int64, edge: Float) -> None:
    for k in range(s.shape[0]):
        column[k], course[k], edge[k] = unit_at(masonry, s[k], arc[k])


def unit_level(masonry: Masonry, s: Float, arc: Float) -> Float:
    """Return the level of units and mortar at positions (n,), dB."""
    column, course, edge = np.empty(s.size, dtype=np.int64), np.empty(s.size, dtype=np.int64), np.empty(s.size)
    _units(masonry, s, arc, column, course, edge)
    own = masonry.level * normal_field(column, course, masonry.salt + 1)
    return np.where(edge < 0.5 * masonry.joint, masonry.mortar, own)
