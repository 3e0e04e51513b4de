"""Bricks and stones in courses along the tunnel: where each lies, how far it stands out, and the mortar between.

A course runs along the tunnel, every other one is shifted by half a unit. Ends of stones are displaced by chance, so that they
differ in length. Relief and reflectance are made from the same units.
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
    """Limits of what a kind of masonry is drawn from.

    Length and height of a unit, width and depth of the mortar joint, standard deviation of how far units stand out, m; standard
    deviation of their level and level of the mortar, dB; displacement of their ends as a share of the length.
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
    """One masonry, drawn from its :class:`Sizes`; ``length`` 0: there is none. ``face`` bounds how far units stand out, m."""

    length: float
    height: float
    joint: float
    depth: float
    face: float
    level: float
    mortar: float
    jitter: float
    salt: int


def lay_courses(parameters: Parameters, seed: np.random.SeedSequence) -> Masonry:
    """Masonry of the lining, if it is of bricks or stones."""
    sizes = KINDS.get(parameters.lining)
    if sizes is None:
        return Masonry(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0)
    rng = np.random.default_rng(seed)
    length, height, joint, depth, face, level, mortar = (float(rng.uniform(*limits)) for limits in sizes[:7])
    # Even numbers between the bounds have their standard deviation times the root of 3 at most.
    return Masonry(
        length, height, joint, depth, math.sqrt(3.0) * face, level, mortar, sizes.jitter, int(seed.generate_state(1)[0])
    )


@inner
def _end(masonry: Masonry, i: int, j: int) -> float:
    """Where unit i of course j begins, in lengths."""
    return i + masonry.jitter * (_PART * float(mix(i, j, masonry.salt) & _MASK) - 0.5)


@inner
def unit_at(masonry: Masonry, s: float, arc: float) -> tuple[int, int, float]:
    """Number in the course and course of the unit at a place, and the distance to its edge (the joint's middle), m."""
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
    """Height of masonry over the nominal lining, m: units stand out or back, mortar lies deeper."""
    i, j, edge = unit_at(masonry, s, arc)
    if edge < 0.5 * masonry.joint:
        return -masonry.depth
    return masonry.face * (2.0 * _PART * float((mix(i, j, masonry.salt) >> np.uint64(16)) & _MASK) - 1.0)


@kernel
def _units(masonry: Masonry, s: Float, arc: Float, column: Int64, course: Int64, edge: Float) -> None:
    for k in range(s.shape[0]):
        column[k], course[k], edge[k] = unit_at(masonry, s[k], arc[k])


def unit_level(masonry: Masonry, s: Float, arc: Float) -> Float:
    """Level of units and mortar at places (n,), dB."""
    column, course, edge = np.empty(s.size, dtype=np.int64), np.empty(s.size, dtype=np.int64), np.empty(s.size)
    _units(masonry, s, arc, column, course, edge)
    own = masonry.level * normal_field(column, course, masonry.salt + 1)
    return np.where(edge < 0.5 * masonry.joint, masonry.mortar, own)
