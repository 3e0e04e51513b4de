"""Greatest departures of a ring from its own circle, inwards and outwards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.shape.adjustment import Adjustment
from tunneldb.shape.ellipse import distances

SECTOR = 2.0
"""Sector size, °: with many points the median of each sector is used, because the greatest of thousands is noise."""

MIN_POINTS_FOR_SECTORS = 1800
"""Minimum number of points for medians by sector: twice what all sectors together need."""

MIN_SECTOR_POINTS = 5
"""Minimum number of points of a sector."""

_MEDIAN_ERROR = 1.2533  # standard error of a median relative to that of a mean: √(π/2)


@dataclass(frozen=True)
class Departure:
    """Place where the ring departs from its circle.

    Attributes
    ----------
    size, size_se : float
        Departure in the requested direction, and its standard error, m.
    clock : float
        Clock position, °.
    """

    size: float
    size_se: float
    clock: float


def clock_of(xy: Float, centre: Float) -> Float:
    """Return clock positions (n,) of points (n, 2), right and up, about a centre (2,): ° clockwise from up, 0 to 360."""
    return np.degrees(np.arctan2(xy[:, 0] - centre[0], xy[:, 1] - centre[1])) % 360.0


def departures(xy: Float, adjustment: Adjustment) -> tuple[Departure, Departure]:
    """Return the greatest departures of used points inwards and outwards from the circle with the mean radius."""
    ellipse, used = adjustment.ellipse, adjustment.used
    points = xy[used]
    round_ = np.concatenate([ellipse.parameters[:3], [0.0, 0.0]])
    off, slopes = distances(round_, points)
    slopes[:, 3:] = 0.0
    clock = clock_of(points, ellipse.centre)
    own = adjustment.scale**2 - 2.0 * np.einsum(
        "ij,jk,ik->i", slopes, ellipse.covariance, distances(ellipse.parameters, points)[1]
    )
    if len(points) >= MIN_POINTS_FOR_SECTORS:
        off, clock, slopes, own = _sectors(off, clock, slopes, adjustment.scale)
    variance = own + np.einsum("ij,jk,ik->i", slopes, ellipse.covariance, slopes)
    found = []
    for sign in (-1.0, 1.0):
        k = int(np.argmax(sign * off))
        found.append(Departure(float(sign * off[k]), float(np.sqrt(max(variance[k], 0.0))), float(clock[k])))
    return found[0], found[1]


def _sectors(off: Float, clock: Float, slopes: Float, scale: float) -> tuple[Float, Float, Float, Float]:
    """Return medians by sector: departure, clock position, slopes, and variance from the points' noise."""
    sector = np.floor(clock / SECTOR).astype(int)
    order = np.argsort(sector, kind="stable")
    starts = np.flatnonzero(np.diff(sector[order], prepend=-1))
    groups = [group for group in np.split(order, starts[1:]) if len(group) >= MIN_SECTOR_POINTS]
    middle = np.array([np.median(off[group]) for group in groups])
    at = np.array([np.median(clock[group]) for group in groups])
    mean = np.array([slopes[group].mean(axis=0) for group in groups])
    return middle, at, mean, np.array([(_MEDIAN_ERROR * scale) ** 2 / len(group) for group in groups])
