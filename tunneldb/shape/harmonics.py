"""Fourier harmonics of a ring's radius by clock position, and chords of the curve that they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float

HOPELESS = 5.0
"""A harmonic is not stated whose standard error is so many times that of as many points evenly around the ring."""

REACH = 30.0
"""A chord ends where there is a point within so many degrees."""

_OWN = 30  # points left over from which on the scale comes from their own residuals


@dataclass(frozen=True)
class Harmonics:
    """The radius about a centre, by clock position α: r = c₀ + Σ (aₖ cos kα + bₖ sin kα), k from 1.

    Attributes
    ----------
    coefficients : (1 + 2 order,) float array
        c₀, a₁, b₁, a₂, b₂ …, m. The first order is small: it is what the centre is off that of the curve.
    covariance : (1 + 2 order, 1 + 2 order) float array
        Theirs, m².
    determined : (order,) bool array
        Which orders the points determine.
    clock : (n,) float array
        Clock positions of the points, growing, °.
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
        """Amplitude of an order and its standard error, m, and the first clock position where it is outwards most, °.

        NaN where the points don't determine it.
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
        """Chord between two clock positions in °, and its standard error, m; NaN without points near the ends.

        Nor is it stated where some order is not determined: the curve runs free in a gap then.
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
        """Whether there is a point within `REACH` of a clock position, °."""
        return bool((np.abs((self.clock - clock + 180.0) % 360.0 - 180.0) <= REACH).any())


def fit_harmonics(clock: Float, radius: Float, orders: int, scale: float) -> Harmonics:
    """Fit harmonics by least squares, all orders at once, so that gaps between points don't mix them.

    Parameters
    ----------
    clock : (n,) float array
        Clock positions of points, °.
    radius : (n,) float array
        Their distances from the centre, m.
    orders : int
        How many are wanted; n points have no more than (n - 1) / 2.
    scale : float
        Standard deviation of a point, m; of many points it is taken from what the harmonics leave.
    """
    orders = min(orders, (len(clock) - 1) // 2)
    design = _design(np.radians(clock), orders)
    coefficients = np.linalg.lstsq(design, radius, rcond=None)[0].astype(np.float64)
    inverse = np.linalg.pinv(design.T @ design).astype(np.float64)
    left, freedom = radius - design @ coefficients, len(clock) - design.shape[1]
    if freedom > _OWN:
        scale = float(np.sqrt(left @ left / freedom))
    inflation = np.sqrt(np.diag(inverse)[1:].reshape(-1, 2).max(axis=1) * len(clock) / 2.0)
    determined = tuple(bool(value <= HOPELESS) for value in inflation)
    return Harmonics(coefficients, (inverse * scale**2).astype(np.float64), determined, np.sort(clock))


def _design(clock: Float, orders: int) -> Float:
    """Rows of 1, cos α, sin α, cos 2α, …, by clock positions in radians."""
    turns = clock[:, None] * np.arange(1, orders + 1)
    both = np.stack([np.cos(turns), np.sin(turns)], axis=2).reshape(len(clock), -1)
    return np.hstack([np.ones((len(clock), 1)), both])
