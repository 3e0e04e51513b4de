r"""Ellipses that may be circles: distances of points from them, and least-squares fits.

The parameters stay determined where an ellipse is round. With the mean radius R = (a + b)/2 and
p + iq = (a - b)/2 · exp(2iφ), φ being the direction of the longest diameter, its points are

.. math:: X(s) = c + R (\cos s, \sin s) + p (\cos s, -\sin s) + q (\sin s, \cos s)

which is linear in all five: near a circle p and q are the second harmonic of the radius, and the circle is p = q = 0. The
distance is to the nearest point, by Newton's method (Ahn, Rauh & Warnecke, 2001, orthogonal distance). Its derivative by
the parameters is the movement of that point along the normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from tunneldb.arrays import Float
from tunneldb.shape.tukey import weights

CIRCLE, ELLIPSE = 3, 5
"""Parameters that are free: centre and radius; and p, q."""

_NEWTON = 12
_TINY = 1e-12
_MAX_ROUNDS, _CONVERGED = 50, 1e-8  # m


@dataclass(frozen=True)
class Ellipse:
    """Ellipse in the plane of a ring.

    Attributes
    ----------
    parameters : (5,) float array
        Centre to the right and upwards, mean radius R, p, q, m.
    covariance : (5, 5) float array
        Covariance of the parameters, m²; zero for fixed ones.
    """

    parameters: Float
    covariance: Float

    @property
    def centre(self) -> Float:
        """Centre (2,), right and up, m."""
        return self.parameters[:2]

    @property
    def radius(self) -> float:
        """Mean of the semi-axes, m."""
        return float(self.parameters[2])

    @property
    def flattening(self) -> float:
        """Half the difference of the semi-axes, m; the largest less the smallest diameter is four times that."""
        return float(np.hypot(self.parameters[3], self.parameters[4]))

    @cached_property
    def flattening_se(self) -> float:
        """Standard error of the flattening, m; that of p and q if it is too small to have a direction."""
        pq = self.covariance[3:, 3:]
        e = self.flattening
        if e * e <= np.trace(pq) / 2.0:
            return float(np.sqrt(np.trace(pq) / 2.0))
        slope = self.parameters[3:] / e
        return float(np.sqrt(slope @ pq @ slope))

    @property
    def axes(self) -> tuple[float, float]:
        """Semi-axes, the longer one first, m."""
        return self.radius + self.flattening, self.radius - self.flattening

    @cached_property
    def axes_se(self) -> tuple[float, float]:
        """Standard errors of the semi-axes, m."""
        e = self.flattening
        turn = self.parameters[3:] / e if e > 0.0 else np.array([1.0, 0.0])
        both = [np.concatenate([[1.0], sign * turn]) for sign in (1.0, -1.0)]
        long, short = (float(np.sqrt(slope @ self.covariance[2:, 2:] @ slope)) for slope in both)
        return long, short

    @property
    def direction(self) -> float:
        """Clock position of the longest diameter, ° from up to the right, 0 to 180."""
        angle = np.degrees(np.arctan2(self.parameters[4], self.parameters[3])) / 2.0
        return float((90.0 - angle) % 180.0)

    @cached_property
    def direction_se(self) -> float:
        """Standard error of the direction, °; at most 52°, that of an unknown direction."""
        e = self.flattening
        unknown = 180.0 / np.sqrt(12.0)
        if e <= 0.0:
            return unknown
        across = np.array([-self.parameters[4], self.parameters[3]]) / e
        return min(float(np.degrees(np.sqrt(across @ self.covariance[3:, 3:] @ across)) / (2.0 * e)), unknown)

    def distance(self, xy: Float) -> Float:
        """Return the distance (n,) of points (n, 2) from the ellipse, outwards positive, m."""
        return distances(self.parameters, xy)[0]


def distances(parameters: Float, xy: Float) -> tuple[Float, Float]:
    """Compute the distances of points from an ellipse, and their derivatives by the parameters.

    Parameters
    ----------
    parameters : (5,) float array
        Parameters as in `Ellipse`, m.
    xy : (n, 2) float array
        Points, m.

    Returns
    -------
    distance : (n,) float array
        Outwards positive, m.
    slopes : (n, 5) float array
        Derivatives by the parameters.
    """
    radius, p, q = parameters[2:]
    dx, dy = (xy - parameters[:2]).T
    s = np.arctan2(dy, dx)
    for _ in range(_NEWTON if p != 0.0 or q != 0.0 else 0):
        c, d = np.cos(s), np.sin(s)
        ex, ey = dx - ((radius + p) * c + q * d), dy - (q * c + (radius - p) * d)
        tx, ty = -(radius + p) * d + q * c, -q * d + (radius - p) * c
        bend = tx * tx + ty * ty + ex * ((radius + p) * c + q * d) + ey * (q * c + (radius - p) * d)
        # Inside the evolute the second derivative is not usable: the first alone also leads to a nearest point.
        step = (ex * tx + ey * ty) / np.where(bend > 0.1 * radius**2, bend, tx * tx + ty * ty)
        s = s + np.clip(step, -0.5, 0.5)
        if np.abs(step).max(initial=0.0) < _TINY:
            break
    c, d = np.cos(s), np.sin(s)
    nx, ny = -q * d + (radius - p) * c, (radius + p) * d - q * c
    length = np.maximum(np.hypot(nx, ny), _TINY)
    nx, ny = nx / length, ny / length
    out = (dx - ((radius + p) * c + q * d)) * nx + (dy - (q * c + (radius - p) * d)) * ny
    return out, -np.column_stack([nx, ny, nx * c + ny * d, nx * c - ny * d, nx * d + ny * c])


def solve(xy: Float, start: Float, free: int, limit: float | None = None, beside: Float | None = None) -> Float:
    """Fit an ellipse by least squares of distances, or by Tukey's loss.

    Parameters
    ----------
    xy : (n, 2) float array
        Points, m, n at least ``free``.
    start : (5,) float array
        Initial parameters; those beyond ``free`` stay fixed.
    free : int
        CIRCLE or ELLIPSE.
    limit : float, optional
        Distance from which a point has no weight (Tukey's biweight), m; without it all count equally.
    beside : (n, m) float array, optional
        Columns of further effects on the distances, fitted together with the ellipse.

    Returns
    -------
    (5 + m,) float array
        Parameters, and the coefficient of each column.
    """
    more = np.empty((len(xy), 0)) if beside is None else beside
    if limit is not None:
        return _reweighted(xy, start, free, limit, more)

    def whole(x: Float) -> Float:
        return np.concatenate([x[:free], start[free:]])

    def residuals(x: Float) -> Float:
        return distances(whole(x), xy)[0] - more @ x[free:]

    def slopes(x: Float) -> Float:
        return np.hstack([distances(whole(x), xy)[1][:, :free], -more])

    begun = np.concatenate([start[:free], np.zeros(more.shape[1])])
    found = least_squares(residuals, begun, slopes, method="trf", xtol=1e-10, ftol=1e-12, gtol=1e-12)
    return np.concatenate([whole(found.x), found.x[free:]])


def _reweighted(xy: Float, start: Float, free: int, limit: float, more: Float) -> Float:
    """Fit an ellipse with Tukey's loss, by iteratively reweighted least squares (Huber, 1981, 7.8)."""
    parameters, beside = start.copy(), np.zeros(more.shape[1])
    for _ in range(_MAX_ROUNDS):
        distance, slope = distances(parameters, xy)
        slopes = np.hstack([slope[:, :free], -more])
        off = distance - more @ beside
        weight = weights(off / limit)[:, None]
        step = np.linalg.lstsq(slopes.T @ (weight * slopes), -(weight * slopes).T @ off, rcond=1e-12)[0]
        parameters[:free] += step[:free]
        beside += step[free:]
        if np.abs(step).max() < _CONVERGED:
            break
    return np.concatenate([parameters, beside])
