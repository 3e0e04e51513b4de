"""Mappings from the pixels of an image to the unrolled plane.

A pixel coordinate counts from the left and from the upper edge of the image: the middle of the first pixel is at (0.5, 0.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from affine import Affine

from tunneldb.arrays import Float


class Mapping(Protocol):
    """Mapping from pixels (column, row) to places (chainage, arc), m, and back."""

    @property
    def linear(self) -> Affine:
        """Mapping without local corrections."""

    def forward(self, column: Float, row: Float) -> tuple[Float, Float]:
        """Return chainage and arc of pixels, m."""

    def inverse(self, chainage: Float, arc: Float) -> tuple[Float, Float]:
        """Return column and row of places."""


@dataclass(frozen=True)
class AffineMapping:
    """Affine mapping.

    Attributes
    ----------
    linear : Affine
        From (column, row) to (chainage, arc), m.
    """

    linear: Affine

    def forward(self, column: Float, row: Float) -> tuple[Float, Float]:
        """Return chainage and arc of pixels, m."""
        return apply(self.linear, column, row)

    def inverse(self, chainage: Float, arc: Float) -> tuple[Float, Float]:
        """Return column and row of places."""
        return apply(~self.linear, chainage, arc)


@dataclass(frozen=True)
class PiecewiseMapping:
    """Affine mapping with a correction that is linear between knots along the tunnel, and constant beyond the outer ones.

    Attributes
    ----------
    linear : Affine
        From (column, row) to (chainage, arc) before the correction, m.
    knots : (n,) array
        Chainage before the correction, ascending, m.
    chainage_shift, arc_shift : (n,) array
        Corrections at the knots, m. The corrected chainage of the knots ascends too.
    """

    linear: Affine
    knots: Float
    chainage_shift: Float
    arc_shift: Float

    def forward(self, column: Float, row: Float) -> tuple[Float, Float]:
        """Return chainage and arc of pixels, m."""
        along, around = apply(self.linear, column, row)
        return (
            along + np.interp(along, self.knots, self.chainage_shift),
            around + np.interp(along, self.knots, self.arc_shift),
        )

    def inverse(self, chainage: Float, arc: Float) -> tuple[Float, Float]:
        """Return column and row of places."""
        # The shift is linear between the corrected knots as well, as a function of the corrected chainage.
        along = chainage - np.interp(chainage, self.knots + self.chainage_shift, self.chainage_shift)
        return apply(~self.linear, along, arc - np.interp(along, self.knots, self.arc_shift))


def apply(transform: Affine, x: Float, y: Float) -> tuple[Float, Float]:
    """Return transformed coordinates."""
    return transform.a * x + transform.b * y + transform.c, transform.d * x + transform.e * y + transform.f


def pixel_sides(mapping: Mapping) -> tuple[float, float]:
    """Return the length of a pixel along the columns and along the rows of an image, m."""
    linear = mapping.linear
    return float(np.hypot(linear.a, linear.d)), float(np.hypot(linear.b, linear.e))


def outline(mapping: Mapping, columns: int, rows: int) -> tuple[Float, Float]:
    """Return chainage and arc of points on the four edges of an image, m."""
    share = np.linspace(0.0, 1.0, 65)
    zero, one = np.zeros_like(share), np.ones_like(share)
    x = np.concatenate([share, share, zero, one]) * columns
    y = np.concatenate([zero, one, share, share]) * rows
    return mapping.forward(x, y)
