"""Shape of one ring from its points: its plane, then circle, ellipse and harmonics in the plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from tunneldb.arrays import Bool, Float
from tunneldb.counted import counted
from tunneldb.shape.adjustment import MAX_ERROR_INFLATION, Adjustment, adjust, begin
from tunneldb.shape.departures import Departure, clock_of, departures
from tunneldb.shape.ellipse import CIRCLE, ELLIPSE, solve
from tunneldb.shape.harmonics import Harmonics, fit_harmonics
from tunneldb.shape.limits import MAX_TESTED_SINGLY
from tunneldb.shape.plane import RingPlane, fit_plane

MIN_POINTS = 5
"""Minimum number of points: a circle and two points to check it."""

FLAT = RingPlane(np.zeros(3), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), 0.0)
"""Plane of points given in the plane itself: right is x, up is z."""

_POOLED_FREEDOM = 24
"""Minimum redundancy of all rings together for estimating the accuracy of a point from them."""


class RingRefusedError(ValueError):
    """Points that form no ring; the message gives the reason, as a remark."""


@dataclass(frozen=True)
class Ring:
    """Fitted ring.

    Attributes
    ----------
    plane : RingPlane
        Plane of the ring.
    adjustment : Adjustment
        Ellipse, or circle if the points do not determine an ellipse.
    harmonics : Harmonics
        Harmonics of the radius about the ellipse's centre.
    inward, outward : Departure
        Greatest departures from the circle with the mean radius.
    gap : float
        Widest angle at the centre without a point, °.
    along : (n,) float array
        Distance of each point from the plane, up-chainage, m.
    circle : (3,) float array
        Best-fit circle of all points: centre to the right and upwards in the plane, and radius, m.
    """

    plane: RingPlane
    adjustment: Adjustment
    harmonics: Harmonics
    inward: Departure
    outward: Departure
    gap: float
    along: Float
    circle: Float

    @property
    def is_ellipse(self) -> bool:
        """True if the ellipse is determined."""
        return self.adjustment.free == ELLIPSE

    @property
    def used(self) -> Bool:
        """True for points used by the fit, (n,)."""
        return self.adjustment.used

    @property
    def centre(self) -> Float:
        """Centre in space (3,), m."""
        return self.plane.to_space(self.adjustment.ellipse.centre)

    @property
    def circle_centre(self) -> Float:
        """Centre of the best-fit circle in space (3,), m."""
        return self.plane.to_space(self.circle[:2])

    @property
    def centre_covariance(self) -> Float:
        """Covariance of the centre (3, 3), m²: from the fit in the plane, and from the plane along the tunnel."""
        across = np.vstack([self.plane.right, self.plane.up])
        along = self.plane.spread**2 / max(int(self.used.sum()), 1)
        within = across.T @ self.adjustment.ellipse.covariance[:2, :2] @ across
        return np.asarray(within + along * np.outer(self.plane.normal, self.plane.normal))


def fit_ring(
    points: Float,
    ahead: Float | None = None,
    *,
    across: bool = False,
    offset: Float | None = None,
    sigma: float | None = None,
    orders: int = 3,
) -> Ring:
    """Fit the shape of a ring.

    Parameters
    ----------
    points : (n, 2) or (n, 3) float array
        Points, m: right and up in the ring's plane, or in space. From eight of a total station to thousands of a scan.
    ahead : (3,) float array, optional
        Direction of the axis up-chainage; required for points in space.
    across : bool
        Use the plane across ``ahead`` instead of the plane of the points: for points of a scan, which fill the ring's length.
    offset : (n,) float array, optional
        Distance of each point from the lining, towards the centre, m.
    sigma : float, optional
        Standard deviation of a point across the lining, m; with few points it decides which one is an outlier.
    orders : int
        Number of harmonics requested.

    Raises
    ------
    RingRefusedError
        If there are fewer than 5 points, or they determine no circle.
    """
    if len(points) < MIN_POINTS:
        raise RingRefusedError(f"only {counted(len(points), 'point')}; a ring needs {MIN_POINTS}")
    plane = _plane(points, ahead, across)
    xy = points if points.shape[1] == 2 else plane.project(points)
    start = begin(xy)
    if start is None:
        raise RingRefusedError("the points lie on a line")
    if offset is not None:
        out = xy - start[:2]
        xy = xy + out / np.linalg.norm(out, axis=1)[:, None] * offset[:, None]
        start[2] += float(np.median(offset))
    adjustment = _adjusted(xy, start, sigma)
    ellipse, used = adjustment.ellipse, adjustment.used
    clock = clock_of(xy[used], ellipse.centre)
    radius = np.linalg.norm(xy[used] - ellipse.centre, axis=1)
    harmonics = fit_harmonics(clock, radius, orders, adjustment.scale)
    along = np.zeros(len(points)) if points.shape[1] == 2 else plane.along(points)
    circle = solve(xy, start, CIRCLE)[:CIRCLE]
    return Ring(plane, adjustment, harmonics, *departures(xy, adjustment), _gap(clock), along, circle)


def _plane(points: Float, ahead: Float | None, across: bool) -> RingPlane:
    if points.shape[1] == 2:
        return FLAT
    if ahead is None:
        raise ValueError("points in space need the direction of the axis")
    if across:
        return RingPlane.across(np.median(points, axis=0), ahead)
    plane = fit_plane(points, ahead)
    if plane is None:
        raise RingRefusedError("the points lie on a line or in a horizontal plane: no plane across the tunnel")
    return plane


def _adjusted(xy: Float, start: Float, sigma: float | None) -> Adjustment:
    """Fit an ellipse if it is determined, else a circle; raise an error if neither is."""
    if len(xy) > ELLIPSE:
        ellipse = adjust(xy, start, ELLIPSE, sigma)
        if ellipse.inflation <= MAX_ERROR_INFLATION[ELLIPSE] and ellipse.freedom > 0 and _sensible(ellipse):
            return ellipse
    circle = adjust(xy, start, CIRCLE, sigma)
    if not circle.inflation <= MAX_ERROR_INFLATION[CIRCLE]:
        seen = 360.0 - _gap(clock_of(xy[circle.used], circle.ellipse.centre))
        raise RingRefusedError(f"the points cover {seen:.0f}° of a circle, too little to determine it")
    return circle


def _sensible(adjustment: Adjustment) -> bool:
    """Return True for a plausible ellipse: one through stray points is flattened to less than half."""
    return adjustment.ellipse.radius > 0.0 and adjustment.ellipse.flattening < adjustment.ellipse.radius / 3.0


def _gap(clock: Float) -> float:
    """Return the widest angle without a point, °."""
    at = np.sort(clock)
    return float(np.diff(at, append=at[0] + 360.0).max())


def pooled_sigma(rings: Sequence[Ring]) -> float | None:
    """Estimate the standard deviation of a point from all rings of few points together, m; None if they determine none.

    The median of the rings' own variances, each divided by its median under the null hypothesis, so that rings with outliers
    do not change it.
    """
    few = [ring.adjustment for ring in rings if ring.adjustment.freedom > 0 and len(ring.used) <= MAX_TESTED_SINGLY]
    if sum(one.freedom for one in few) < _POOLED_FREEDOM:
        return None
    ratios = [one.sigma**2 * one.freedom / chi2.median(one.freedom) for one in few]
    return float(np.sqrt(np.median(ratios)))


@dataclass(frozen=True)
class RingPoints:
    """Points of one ring, for `fit_ring`; lengths in m."""

    points: Float
    ahead: Float | None = None
    offset: Float | None = None


def fit_rings(
    rings: Sequence[RingPoints], sigma: float | None = None, orders: int = 3
) -> tuple[list[Ring | str], float | None]:
    """Fit many rings of few points: first each by itself, then with the standard deviation pooled from all.

    Parameters
    ----------
    rings
        Points of each.
    sigma : float, optional
        Standard deviation of a point, m, if known; else it is estimated.
    orders : int
        Number of harmonics requested.

    Returns
    -------
    rings : list of Ring or str
        Each ring, or the reason why there is none.
    sigma : float or None
        Standard deviation of a point that was used, m.
    """
    if sigma is None:
        alone = [_tried(ring, None, orders) for ring in rings]
        sigma = pooled_sigma([ring for ring in alone if isinstance(ring, Ring)])
        if sigma is None:
            return alone, None
    return [_tried(ring, sigma, orders) for ring in rings], sigma


def _tried(ring: RingPoints, sigma: float | None, orders: int) -> Ring | str:
    try:
        return fit_ring(ring.points, ring.ahead, offset=ring.offset, sigma=sigma, orders=orders)
    except RingRefusedError as refused:
        return str(refused)
