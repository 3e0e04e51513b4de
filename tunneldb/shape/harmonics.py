"""Fourier harmonics of a ring's radius by clock position, and chords of the fitted curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float

MAX_ERROR_INFLATION = 5.0
"""Maximum inflation of a harmonic's standard error, compared with as many points evenly around the ring."""

REACH = 30.0
"""Maximum angle from a chord's end to the nearest point, °."""

_MIN_OWN_FREEDOM = 30  # minimum redundancy for the scale to come from the ring's own residuals


@dataclass(frozen=True)
class Harmonics:
    """Radius about a centre, by clock position α: r = c₀ + Σ (aₖ cos kα + bₖ sin kα), k from 1.

    Attributes
    ----------
    coefficients : (1 + 2 order,) float array
        c₀, a₁, b₁, a₂, b₂ …, m. The first order is small: the offset between this centre and that of the curve.
    covariance : (1 + 2 order, 1 + 2 order) float array
        Covariance of the coefficients, m².
    determined : (order,) bool array
        True for orders that the points determine.
    clock : (n,) float array
        Clock positions of the points, increasing, °.
    """

    coefficients: Float
    covariance: Float
    determined: tuple[bool, ...]
    clock: Float

    @property
    def orders(self) -> int:
        """Highest order."""
        return len(self.coefficients) // 2

    def amplitude(self, order: int) -> tuple[float, float, float]:
        """Return an order's amplitude and its standard error, m, and the first clock position of its maximum, °.

        NaN if the points do not determine it.
        """
        if order > self.orders or not self.determined[order - 1]:
            return float("nan"), float("nan"), float("nan")
        rows = slice(2 * order - 1, 2 * order + 1)
        ab, covariance = self.coefficients[rows], self.covariance[rows, rows]
        size = float(np.hypot(*ab))
        wide = np.trace(covariance) / 2.0
        variance = wide if size**2 <= wide else ab @ covariance @ ab / size**2
        clock = np.degrees(np.arctan2(ab[1], ab[0])) / order % (360.0 / order)
        return size, float(np.sqrt(variance)), float(clock)

    def chord(self, first: float, second: float) -> tuple[float, float]:
        """Return the chord between two clock positions in °, and its standard error, m; NaN without points near the ends.

        NaN also if some order is not determined, because the curve is then arbitrary in a gap.
        """
        if not (all(self.determined) and self.near(first) and self.near(second)):
            return float("nan"), float("nan")
        clock = np.radians([first, second])
        rows = _design(clock, self.orders)
        out = np.column_stack([np.sin(clock), np.cos(clock)])
        ends = out * (rows @ self.coefficients)[:, None]
        span = ends[0] - ends[1]
        length = float(np.linalg.norm(span))
        slope = (out @ span / length * [1.0, -1.0]) @ rows
        return length, float(np.sqrt(slope @ self.covariance @ slope))

    def near(self, clock: float) -> bool:
        """Return True if there is a point within `REACH` of a clock position, °."""
        return bool((np.abs((self.clock - clock + 180.0) % 360.0 - 180.0) <= REACH).any())


def fit_harmonics(clock: Float, radius: Float, orders: int, scale: float) -> Harmonics:
    """Fit harmonics by least squares, all orders together, so that gaps between points do not mix them.

    Parameters
    ----------
    clock : (n,) float array
        Clock positions of points, °.
    radius : (n,) float array
        Their distances from the centre, m.
    orders : int
        Number of orders requested; n points determine at most (n - 1) / 2.
    scale : float
        Standard deviation of a point, m; with many points the residuals give it.
    """
    orders = min(orders, (len(clock) - 1) // 2)
    design = _design(np.radians(clock), orders)
    coefficients = np.linalg.lstsq(design, radius, rcond=None)[0].astype(np.float64)
    inverse = np.linalg.pinv(design.T @ design).astype(np.float64)
    left, freedom = radius - design @ coefficients, len(clock) - design.shape[1]
    if freedom > _MIN_OWN_FREEDOM:
        scale = float(np.sqrt(left @ left / freedom))
    inflation = np.sqrt(np.diag(inverse)[1:].reshape(-1, 2).max(axis=1) * len(clock) / 2.0)
    determined = tuple(bool(value <= MAX_ERROR_INFLATION) for value in inflation)
    return Harmonics(coefficients, (inverse * scale**2).astype(np.float64), determined, np.sort(clock))


def _design(clock: Float, orders: int) -> Float:
    """Return rows of 1, cos α, sin α, cos 2α, … for clock positions in radians."""
    turns = clock[:, None] * np.arange(1, orders + 1)
    both = np.stack([np.cos(turns), np.sin(turns)], axis=2).reshape(len(clock), -1)
    return np.hstack([np.ones((len(clock), 1)), both])
