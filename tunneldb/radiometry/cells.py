"""Cells of the lining with their views: the units of the range-curve regression."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.radiometry.oren_nayar import incidence_db
from tunneldb.radiometry.range_spline import RangeSpline

CELL = 0.5
"""Side of a cell, m: its lining is assumed to have one reflectance."""

RING = 2.0
"""Length of the rings within which residuals of views may be correlated in any way, m."""

STRETCH = 5.0
"""Length of the stretches that may differ in reflectance in any way, m: at most half a block of in-situ lining."""

MAX_VIEW_POINTS = 4
"""Maximum number of points that make a view more certain: the rest is the surface's texture."""


ROUGHNESS = np.arange(0.0, 60.1, 2.5)
"""Tested roughnesses, degrees; between two of them the effect of incidence is interpolated from the nearest three."""


@dataclass(frozen=True)
class Cells:
    """Cells of the lining, each seen by one or several scans; arrays (n, …) have an element for each view.

    Attributes
    ----------
    cell : (n,) int array
        Number of the cell, 0 to count - 1.
    basis : (n, p) float array
        Means of the functions of range.
    incidence : (n, s) float array
        Means of the effect of incidence, dB, for each of ROUGHNESS.
    level : (n,) float array
        Mean intensity, dB.
    side_offset : (n,) float array
        Mean distance of a view's points from the middle of its cell, around the section, m; 0 without an unrolled plane.
    weight : (n,) float array
        Number of points, at most MAX_VIEW_POINTS.
    stretch, ring, alike : (count,) int arrays
        Numbers from 0 of each cell's stretch, of its ring (a stretch without an unrolled plane), and of the strip of its
        stretch, one cell wide, in which cells are compared with each other (likewise).
    row, column : (count,) int arrays
        Place of each cell in the unrolled plane, in cells from the first along and across; -1 without one.
    """

    cell: Int64
    basis: Float
    incidence: Float
    level: Float
    side_offset: Float
    weight: Float
    stretch: Int64
    ring: Int64
    alike: Int64
    row: Int64
    column: Int64

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.stretch)

    @property
    def overlapping(self) -> int:
        """Number of cells that several scans saw."""
        return int(np.count_nonzero(np.bincount(self.cell) > 1))

    def incidence_at(self, roughness: float) -> Float:
        """Return the mean effect of incidence (n,), dB, for a roughness, degrees."""
        k = int(np.clip(np.rint((roughness - ROUGHNESS[0]) / (ROUGHNESS[1] - ROUGHNESS[0])), 1, len(ROUGHNESS) - 2))
        x = (roughness - ROUGHNESS[k]) / (ROUGHNESS[1] - ROUGHNESS[0])
        return np.asarray(self.incidence[:, k - 1 : k + 2] @ np.array([0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)]))


@dataclass(frozen=True)
class IntensitySamples:
    """Points with range, incidence and intensity.

    Attributes
    ----------
    place : (n, 2) or (n, 3) float array
        Chainage and arc, or coordinates in space, m.
    scan : (n,) int array
        Scan number of each point.
    range_m, cosine : (n,) float arrays
        Range, m, and cosine of the incidence angle.
    level : (n,) float array
        Intensity, dB.
    """

    place: Float
    scan: NDArray[np.integer]
    range_m: Float
    cosine: Float
    level: Float

    def some(self, chosen: Bool) -> IntensitySamples:
        """Return the selected points."""
        return IntensitySamples(
            self.place[chosen], self.scan[chosen], self.range_m[chosen], self.cosine[chosen], self.level[chosen]
        )


def count_cells(place: Float) -> int:
    """Return the number of cells that points at places (n, 2) or (n, 3), m, lie in."""
    return len(_number(np.floor(place / CELL).astype(np.int64))[1])


def group(samples: IntensitySamples, spline: RangeSpline, *, unrolled: bool) -> Cells:
    """Group points into cells; ``unrolled`` is True for places in the unrolled plane of a tunnel."""
    at = np.floor(samples.place / CELL).astype(np.int64)
    number, first = _number(np.column_stack([at, samples.scan.astype(np.int64)]))
    points = np.bincount(number)
    cell, some = _number(at[first])

    def mean(values: Float) -> Float:
        return np.asarray(np.bincount(number, values) / points)

    where = samples.place[first[some]]
    stretch = _number(np.floor(where[:, :1] / STRETCH if unrolled else where / STRETCH).astype(np.int64))[0]
    row, column = (_places(where[:, axis]) if unrolled else np.full(len(where), -1) for axis in (0, 1))
    return Cells(
        cell,
        np.column_stack([mean(column) for column in spline(samples.range_m).T]),
        np.column_stack([mean(incidence_db(samples.cosine, roughness)) for roughness in ROUGHNESS]),
        mean(samples.level),
        mean(samples.place[:, 1] - (at[:, 1] + 0.5) * CELL) if unrolled else np.zeros(len(points)),
        np.minimum(points, MAX_VIEW_POINTS).astype(np.float64),
        stretch,
        _number(np.floor(where[:, :1] / RING).astype(np.int64))[0] if unrolled else stretch,
        _number(np.column_stack([stretch, column]))[0] if unrolled else stretch,
        row,
        column,
    )


def _places(along: Float) -> Int64:
    at: Int64 = np.floor(along / CELL).astype(np.int64)
    return at - at.min() if len(at) else at


def _number(keys: Int64) -> tuple[Int64, Int64]:
    """Return the number of each row (n, m) among all unique ones, from 0, and one row of each."""
    if len(keys) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    # All columns in one integer, because sorting rows is slow.
    low = keys.min(axis=0)
    packed = np.zeros(len(keys), np.int64)
    for column, least, most in zip(keys.T, low, keys.max(axis=0), strict=True):
        packed = packed * (most - least + 1) + (column - least)
    _, first, number = np.unique(packed, return_index=True, return_inverse=True)
    return number.reshape(-1), first
