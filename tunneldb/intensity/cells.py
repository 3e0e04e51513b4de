"""Cells of the lining as they are seen: the units of which a range curve is made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Index = NDArray[np.int64]

CELL = 0.5
"""Side of a cell, m: the lining in it is of one reflectance."""

PATCH = 2.0
"""Side of the patches within which residuals may hang together in any way, m."""

STRETCH = 10.0
"""Length of the stretches that may differ in reflectance as a whole, m: a block of in-situ lining, several rings."""

SECTOR = 1.0
"""Width of the strips along the tunnel that may differ in reflectance as a whole, m."""

RANGE_CLASS = 0.1
"""Views of a cell whose ranges differ less, as a part of the range, may count as one."""

INCIDENCE_CLASS = 5.0
"""Views of a cell whose incidence angles differ less, degrees, may count as one."""

ENOUGH = 4
"""Points of a view beyond so many don't make it surer: what is left is the surface's texture."""


@dataclass(frozen=True)
class Cells:
    """Cells of the lining, each seen in one way or several; arrays (n,) have an element for each view.

    Attributes
    ----------
    cell : (n,) int array
        Number of its cell, 0 to count - 1.
    range_m, cosine, level : (n,) float arrays
        Mean range, m, cosine of the incidence angle and intensity, dB.
    weight : (n,) float array
        Points, at most ENOUGH.
    patch, stretch, sector : (count,) int arrays
        Numbers from 0 of the patch, the stretch and the strip that hold each cell; without a plane there are no strips,
        and all have the number -1.
    """

    cell: Index
    range_m: Float
    cosine: Float
    level: Float
    weight: Float
    patch: Index
    stretch: Index
    sector: Index

    @property
    def count(self) -> int:
        """Number of cells."""
        return len(self.patch)


def group(place: Float, range_m: Float, cosine: Float, level: Float, *, unrolled: bool) -> Cells:
    """Gather points (n,) into cells; places as in :func:`tunneldb.intensity.range_curve.estimate_range_curve`."""
    at = np.floor(place / CELL).astype(np.int64)
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    views = np.column_stack(
        [at, np.floor(np.log(range_m) / RANGE_CLASS).astype(np.int64), np.floor(angle / INCIDENCE_CLASS).astype(np.int64)]
    )
    number, first = _number(views)
    points = np.bincount(number)
    cell, some = _number(at[first])

    def mean(values: Float) -> Float:
        return np.asarray(np.bincount(number, values) / points)

    where = place[first[some]]
    return Cells(
        cell,
        mean(range_m),
        mean(cosine),
        mean(level),
        np.minimum(points, ENOUGH).astype(np.float64),
        _number(np.floor(where / PATCH).astype(np.int64))[0],
        _number(np.floor(where[:, :1] / STRETCH if unrolled else where / STRETCH).astype(np.int64))[0],
        _sectors(where[:, 1]) if unrolled else np.full(len(where), -1),
    )


def _sectors(arc: Float) -> Index:
    sector: Index = np.floor(arc / SECTOR).astype(np.int64)
    return sector - sector.min() if len(sector) else sector


def _number(keys: Index) -> tuple[Index, Index]:
    """Number of each row's (n, m) like among all different ones, from 0, and one row of each."""
    if len(keys) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    # All columns in one integer: sorting rows is slow.
    low = keys.min(axis=0)
    packed = np.zeros(len(keys), np.int64)
    for column, least, most in zip(keys.T, low, keys.max(axis=0), strict=True):
        packed = packed * (most - least + 1) + (column - least)
    _, first, number = np.unique(packed, return_index=True, return_inverse=True)
    return number.reshape(-1), first
