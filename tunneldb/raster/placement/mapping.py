"""Mappings from the pixels of an image to the unrolled plane.

A pixel coordinate counts from the left and from the upper edge of the image: the middle of the first pixel is at (0.5, 0.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from affine import Affine

from tunneldb.arrays import Float


class Mapping(Protocol):
    """Mapping from pixels (column, row) to places (chainage, arc), m."""

    @property
    def linear(self) -> Affine:
        """Mapping without local corrections."""

    def forward(self, column: Float, row: Float) -> tuple[Float, Float]:
        """Return chainage and arc of pixels, m."""

    def uncorrected(self, chainage: Float) -> tuple[Float, Float]:
        """Return chainages without the local correction, and the local correction of the arc there, m."""

    def bounds(self, columns: int, rows: int) -> Bounds:
        """Return a rectangle of the unrolled plane around an image."""


class Bounds(NamedTuple):
    """Rectangle in the unrolled plane, m."""

    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float


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

    def uncorrected(self, chainage: Float) -> tuple[Float, Float]:
        """Return chainages without the local correction, and the local correction of the arc there, m."""
        return chainage, np.zeros_like(chainage)

    def bounds(self, columns: int, rows: int) -> Bounds:
        """Return a rectangle of the unrolled plane around an image."""
        chainage, arc = apply(self.linear, np.array([0.0, columns, 0.0, columns]), np.array([0.0, 0.0, rows, rows]))
        return Bounds(float(chainage.min()), float(chainage.max()), float(arc.min()), float(arc.max()))


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

    def uncorrected(self, chainage: Float) -> tuple[Float, Float]:
        """Return chainages without the local correction, and the local correction of the arc there, m."""
        # The shift is linear between the corrected knots as well, as a function of the corrected chainage.
        along = chainage - np.interp(chainage, self.knots + self.chainage_shift, self.chainage_shift)
        return along, np.interp(along, self.knots, self.arc_shift)

    def bounds(self, columns: int, rows: int) -> Bounds:
        """Return a rectangle of the unrolled plane around an image."""
        west, east, low, high = AffineMapping(self.linear).bounds(columns, rows)
        ends = np.array([west, east])
        west, east = (ends + np.interp(ends, self.knots, self.chainage_shift)).tolist()
        return Bounds(west, east, low + float(self.arc_shift.min()), high + float(self.arc_shift.max()))


def apply(transform: Affine, x: Float, y: Float) -> tuple[Float, Float]:
    """Return transformed coordinates."""
    return transform.a * x + transform.b * y + transform.c, transform.d * x + transform.e * y + transform.f


def inverse(mapping: Mapping, chainage: Float, arc: Float) -> tuple[Float, Float]:
    """Return column and row of places."""
    along, shift = mapping.uncorrected(chainage)
    return apply(~mapping.linear, along, arc - shift)


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
