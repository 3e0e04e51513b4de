"""Shape of rings and blocks: each an ellipse around a centre beside the axis, with its segments displaced inwards or outwards.

Looking up-chainage, positions across the axis are u to the right and w upwards, m. For a section of radius R a ring is

    x(t) = c + R (cos t, sin t) + p (cos t, -sin t) + q (sin t, cos t)

with the semi-axes R ± √(p² + q²). Its height above the nominal section is measured along that section's normal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import inner
from tunneldb.simulate.lining.rings import Rings
from tunneldb.simulate.parameters import Parameters

MAX_TILT = 20.0
"""Greatest angle of the largest diameter to the horizontal, degrees: rings settle."""

MAX_SIGMA = 3.0
"""Limit of random numbers, standard deviations."""


class RingShape(NamedTuple):
    """Deviation of each of n rings from the nominal section; only round sections have ellipses and centres of their own.

    Attributes
    ----------
    radius : float
        Radius of the section, m.
    ellipse : (n, 4)
        Centre u and w, p and q of each ring, m.
    stand : (n, m)
        Inward displacement of each of the m segments, m.
    """

    radius: float
    ellipse: Float
    stand: Float

    @property
    def plain(self) -> bool:
        """True if all rings have the shape of the section."""
        return not (self.ellipse.any() or self.stand.any())


def shape(parameters: Parameters, rings: Rings, seed: np.random.SeedSequence) -> RingShape:
    """Return the requested shapes; each kind has its own random numbers."""
    p, n = parameters, rings.level.size
    oval, moved, stood = (np.random.default_rng(one) for one in seed.spawn(3))
    ellipse = np.zeros((n, 4))
    ellipse[:, :2] = np.clip(moved.standard_normal((n, 2)), -MAX_SIGMA, MAX_SIGMA) * p.ring_shift
    # Largest minus smallest diameter is four times the length of (p, q), whose angle is twice that of the diameter.
    size = oval.uniform(*p.ovality, n) / 100.0 * 2.0 * p.section_radius / 4.0
    turn = 2.0 * np.radians(oval.uniform(-MAX_TILT, MAX_TILT, n))
    ellipse[:, 2], ellipse[:, 3] = size * np.cos(turn), size * np.sin(turn)
    stand = np.clip(stood.standard_normal(rings.segment_level.shape), -MAX_SIGMA, MAX_SIGMA) * p.segment_step
    return RingShape(p.section_radius, ellipse, stand)


@inner
def departure(rings: Rings, shape: RingShape, i: int, arc: float) -> float:
    """Return the height of ring i at an arc, m, positive into the tunnel."""
    total = 0.0
    if shape.stand.shape[1] > 0:
        segment = math.floor((arc - rings.shift[i]) / rings.period)
        total += shape.stand[i, segment % shape.stand.shape[1]]
    x, y, p, q = shape.ellipse[i]
    if x == 0.0 and y == 0.0 and p == 0.0 and q == 0.0:
        return total
    # The ray from the section's centre intersects the ellipse where |M⁻¹ (t d - c)| = 1.
    radius = shape.radius
    du, dw = math.sin(arc / radius), math.cos(arc / radius)
    a, b, d = radius + p, q, radius - p
    gx, gy = d * du - b * dw, a * dw - b * du
    hx, hy = d * x - b * y, a * y - b * x
    gg, gh, hh = gx * gx + gy * gy, gx * hx + gy * hy, hx * hx + hy * hy
    det = a * d - b * b
    return total + radius - (gh + math.sqrt(gh * gh - gg * (hh - det * det))) / gg
