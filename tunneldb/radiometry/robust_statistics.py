"""Statistics of dry lining (Xu et al., 2018, eq. 19), robust against parts that are not dry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tunneldb.robust import MAD_TO_SIGMA

SHORTH = 0.4
"""Share of all values in the shortest interval, which locates dry lining."""

CLIP = 1.5
"""Standard deviations from the mean within which values count as dry."""

CLIPPED_SIGMA = 0.7426
"""Standard deviation of a standard normal distribution clipped at ±CLIP."""


@dataclass(frozen=True)
class DryLevel:
    """Mean and standard deviation of dry lining (eq. 19), dB, and the number of values."""

    mean: float
    sigma: float
    count: int

    @property
    def threshold(self) -> float:
        """Lower limit of dry lining by the three-sigma criterion (eq. 20), dB."""
        return self.mean - 3.0 * self.sigma


def plain_statistics(values: NDArray[np.floating]) -> DryLevel:
    """Compute mean and standard deviation (eq. 19) of values that are known to be dry; NaNs are ignored."""
    values = np.asarray(values, dtype=np.float64)
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return DryLevel(np.nan, np.nan, 0)
    return DryLevel(float(values.mean()), float(values.std()), len(values))


def robust_statistics(values: NDArray[np.floating], shorth: float = SHORTH, *, two_sided: bool = False) -> DryLevel:
    """Compute mean and standard deviation of the dry part of values; up to about 30 % may be wet.

    Wet lining is darker, so that it shifts mean, median and standard deviation. The shortest interval with 40 % of the values
    is within the dry part. Above its middle hardly anything is wet, so the median deviation there gives a first σ. Values
    within 1.5σ of the mean are then averaged until mean and σ converge, corrected for the clipping of a normal distribution.

    Parameters
    ----------
    values : float array
        Corrected intensity, dB; NaNs are ignored.
    shorth : float
        Share of all values in the shortest interval: smaller if more of them may not be dry.
    two_sided : bool
        True if the other values may also be brighter: the first σ is then that of the narrower side.
    """
    ordered = np.asarray(values, dtype=np.float64).ravel()
    ordered = np.sort(ordered[np.isfinite(ordered)])
    count = len(ordered)
    if count < 3:
        return plain_statistics(ordered)
    width = max(2, int(np.ceil(shorth * count)))
    start = int(np.argmin(ordered[width - 1 :] - ordered[: count - width + 1]))
    mean = float(_middle(ordered[start : start + width]).mean())
    above = ordered[np.searchsorted(ordered, mean, side="right") :]
    sigma = MAD_TO_SIGMA * float((_middle(above) - mean).mean()) if len(above) else 0.0
    if two_sided:
        below = ordered[: np.searchsorted(ordered, mean, side="left")]
        sigma = min(sigma, MAD_TO_SIGMA * float((mean - _middle(below)).mean())) if len(below) else sigma
    total = np.concatenate([[0.0], np.cumsum(ordered)])
    squares = np.concatenate([[0.0], np.cumsum(ordered**2)])
    first, last = 0, count
    for _ in range(30):
        bounds = np.searchsorted(ordered, [mean - CLIP * sigma, mean + CLIP * sigma], side="left")
        if (bounds[0], bounds[1]) == (first, last) or bounds[1] - bounds[0] < 2:
            break
        first, last = int(bounds[0]), int(bounds[1])
        kept = last - first
        mean = float(total[last] - total[first]) / kept
        variance = float(squares[last] - squares[first]) / kept - mean * mean
        sigma = np.sqrt(max(variance, 0.0)) / CLIPPED_SIGMA
    return DryLevel(mean, float(sigma), last - first)


def _middle(ordered: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the one or two middle values of increasing ones: their mean is the median."""
    return ordered[(len(ordered) - 1) // 2 : len(ordered) // 2 + 1]
