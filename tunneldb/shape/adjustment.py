"""Robust adjustment of an ellipse or circle: few points are tested one by one, many are weighted after Tukey."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, norm
from scipy.stats import t as student

from tunneldb.arrays import Bool, Float
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.circle import nearest_to_half, taubin
from tunneldb.shape.ellipse import CIRCLE, ELLIPSE, Ellipse, distances, solve
from tunneldb.shape.limits import LEVEL_KNOWN_SIGMA, LEVEL_OWN_SIGMA, LEVEL_WORSE_SIGMA, MAX_OUTLIER_SHARE, MAX_TESTED_SINGLY
from tunneldb.shape.tukey import CUT, rate, weights

MAX_ERROR_INFLATION = {CIRCLE: 10.0, ELLIPSE: 5.0}
"""Limit of the inflation of the worst standard error: a circle or an ellipse beyond it is not reported.

The inflation compares with as many points evenly around the ring. With dense points a circle needs 90° of a ring, an ellipse
210°. An ellipse needs more than its noise requires: shape that is neither circle nor ellipse is magnified in the same way.
"""

EXTRA_ORDERS = (3,)
"""Orders of harmonics that are fitted to many points together with an ellipse. Without them the ellipse shifts where a part
of the ring was not seen. With a fourth order, a ring without its floor determines no ellipse."""

MAX_EXTRA_INFLATION = 25.0
"""Inflation of the worst standard error from which the extra harmonics are left out. Dense points over more than half a ring
reach 18, points in a few places any number."""

_ROUNDS = 8
_MIN_SCALE = 1e-6  # m


@dataclass(frozen=True)
class Adjustment:
    """Ellipse or circle with the points and the scale that it is based on.

    Attributes
    ----------
    ellipse : Ellipse
        Ellipse with its covariance.
    free : int
        CIRCLE or ELLIPSE.
    distance : (n,) float array
        Distance of all points from it, outwards positive, m; with many points less the harmonics that were fitted with it.
    used : (n,) bool array
        True for points with weight.
    sigma : float
        Standard deviation of a point's distance, from the points used, m; NaN without redundancy.
    scale : float
        Scale of the standard errors: sigma, or the standard deviation known beforehand, m.
    freedom : int
        Points used minus parameters.
    inflation : float
        Ratio of the worst standard error to that of as many points evenly around the ring; for an ellipse computed without the
        harmonics.
    """

    ellipse: Ellipse
    free: int
    distance: Float
    used: Bool
    sigma: float
    scale: float
    freedom: int
    inflation: float


def begin(xy: Float) -> Float | None:
    """Return the circle to start with, as parameters (5,), m; None if the points lie on a line."""
    found = taubin(xy) if len(xy) <= MAX_TESTED_SINGLY else nearest_to_half(xy)
    return None if found is None else np.concatenate([found, [0.0, 0.0]])


def adjust(xy: Float, start: Float, free: int, sigma: float | None = None) -> Adjustment:
    """Adjust a circle or an ellipse.

    Parameters
    ----------
    xy : (n, 2) float array
        Points, m, n at least ``free``.
    start : (5,) float array
        Initial circle, from `begin`.
    free : int
        CIRCLE or ELLIPSE.
    sigma : float, optional
        Standard deviation of a point's distance, if known, m. With few points it decides which point is an outlier.
    """
    return _few(xy, start, free, sigma) if len(xy) <= MAX_TESTED_SINGLY else _many(xy, start, free)


def _few(xy: Float, start: Float, free: int, sigma: float | None) -> Adjustment:
    used = np.ones(len(xy), bool)
    may_go = int(np.ceil(len(xy) * MAX_OUTLIER_SHARE))
    while True:
        parameters = solve(xy[used], start, free)
        wrong = _worst(xy[used], parameters, free, sigma) if (~used).sum() < may_go else None
        if wrong is None:
            break
        used[np.flatnonzero(used)[wrong]] = False
    distance, slopes = distances(parameters, xy)
    slopes = slopes[used, :free]
    freedom = int(used.sum()) - free
    square = float(distance[used] @ distance[used])
    own = np.sqrt(square / freedom) if freedom > 0 else np.nan
    scale = _scale(own, freedom, sigma)
    inverse = np.linalg.pinv(slopes.T @ slopes).astype(np.float64)
    ellipse = Ellipse(parameters, _padded(inverse * scale**2))
    return Adjustment(ellipse, free, distance, used, float(own), scale, freedom, _inflation(inverse, int(used.sum())))


def _worst(xy: Float, parameters: Float, free: int, sigma: float | None) -> int | None:
    """Return the worst outlier, or None (Baarda, 1968; with its own residuals, Pope, 1976).

    Each point is compared with the ellipse through all others: its residual is divided by the residual's standard deviation,
    which is smaller for a point that pulls the ellipse towards itself.
    """
    distance, slopes = distances(parameters, xy)
    slopes = slopes[:, :free]
    freedom = len(xy) - free - (sigma is None)
    if freedom < 2:  # all residuals are equal: the outlier cannot be identified
        return None
    share = 1.0 - np.einsum("ij,jk,ik->i", slopes, np.linalg.pinv(slopes.T @ slopes), slopes)
    with np.errstate(divide="ignore", invalid="ignore"):
        lifted = np.where(share > 1e-6, distance**2 / share, 0.0)  # decrease of the sum of squares without the point
    worst = int(np.argmax(lifted))
    if sigma is not None:
        return worst if lifted[worst] > (sigma * norm.isf(LEVEL_KNOWN_SIGMA / (2 * len(xy)))) ** 2 else None
    left = max(float(distance @ distance - lifted[worst]), _MIN_SCALE**2) / freedom
    return worst if lifted[worst] > left * student.isf(LEVEL_OWN_SIGMA / (2 * len(xy)), freedom) ** 2 else None


def _scale(own: float, freedom: int, sigma: float | None) -> float:
    """Return the standard deviation of a point for the standard errors, m: the known one, unless the ring is clearly worse."""
    if sigma is None:
        return float(own)
    if freedom > 0 and own**2 * freedom > sigma**2 * chi2.isf(LEVEL_WORSE_SIGMA, freedom):
        return float(own)
    return sigma


def _many(xy: Float, start: Float, free: int) -> Adjustment:
    """Adjust to many points; an ellipse together with extra harmonics, so that its errors include their effect."""
    alone = _weighted(xy, start, free, np.empty((len(xy), 0)))
    if free != ELLIPSE or alone.inflation > MAX_ERROR_INFLATION[ELLIPSE]:
        return alone
    together = _weighted(xy, start, free, _beside(xy, start))
    return replace(together, inflation=alone.inflation) if together.inflation <= MAX_EXTRA_INFLATION else alone


def _beside(xy: Float, start: Float) -> Float:
    """Return the harmonics of the extra orders at the points' directions from the initial centre, (n, 2) per order."""
    angle = np.arctan2(*(xy - start[:2]).T)
    return np.column_stack([wave(order * angle) for order in EXTRA_ORDERS for wave in (np.cos, np.sin)])


def _weighted(xy: Float, start: Float, free: int, extra: Float) -> Adjustment:
    parameters, scale, distance = start, np.inf, distances(start, xy)[0]
    for step in range(_ROUNDS):
        before = scale
        scale = max(MAD_TO_SIGMA * float(np.median(np.abs(distance))), _MIN_SCALE)
        if step > 1 and abs(scale - before) < 1e-3 * scale:
            break
        found = solve(xy, parameters, free if step else CIRCLE, CUT * scale, extra)
        parameters = found[:ELLIPSE]
        distance = distances(parameters, xy)[0] - extra @ found[ELLIPSE:]
    slopes = np.hstack([distances(parameters, xy)[1][:, :free], -extra])
    count = slopes.shape[1]
    u = distance / (CUT * scale)
    used = np.abs(u) < 1.0
    freedom = int(used.sum()) - count
    # Variance of robust estimates (Huber, 1981, section 7.6): influence of each residual, and its derivative.
    influence = weights(u) * distance
    outer = np.linalg.pinv(slopes.T @ (slopes * rate(u)[:, None]))
    inner = slopes[used].T @ slopes[used]
    covariance = (outer @ inner @ outer)[:free, :free] * float(influence @ influence) / max(freedom, 1)
    sigma = float(np.sqrt(influence @ distance / max(weights(u).sum() - count, 1.0)))
    inverse = np.linalg.pinv(inner)[:free, :free].astype(np.float64)
    inflation = _inflation(inverse, int(used.sum()))
    ellipse = Ellipse(parameters, _padded(covariance))
    return Adjustment(ellipse, free, distance, used, max(sigma, scale), scale, freedom, inflation)


def _padded(covariance: Float) -> Float:
    whole = np.zeros((ELLIPSE, ELLIPSE))
    whole[: len(covariance), : len(covariance)] = covariance
    return whole


def _inflation(inverse: Float, count: int) -> float:
    """Return the worst standard error relative to even points on a circle: 1/√n of the radius, √(2/n) of the others."""
    even = np.full(len(inverse), 2.0 / count)
    even[2] = 1.0 / count
    return float(np.sqrt((np.diag(inverse) / even).max()))
