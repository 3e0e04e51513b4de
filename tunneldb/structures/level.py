"""The level of a surface by incidence: what it shows where it is as it should be (Ono et al., 3.3 and 3.4).

The paper parts a cluster into classes of cos θ and fits a normal distribution to the histogram of each. Here the middle of each
class is the robust mode of its pixels, and between the middles the level is interpolated, so that no step runs over a surface
where two classes meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.radiometry.robust_statistics import robust_statistics

CLASS = 0.05
"""Width of a class of cos θ (Table 1)."""

FEWEST = 30
"""Fewer points tell no level."""

STEEPEST = 80.0
"""Beyond this incidence nothing is judged, degrees: there the beam is smeared over six times its width."""

SHORTH = 0.25
"""Share of the values in the shortest interval that marks the level: up to half of a surface may be something else."""

LEAST_SPAN = 0.01
"""Span of lg R below which range makes no difference on a surface."""

TURNS = 6
"""Times that level and residuals are found in turns."""

LEAST_SIGMA = 0.01
"""The level scatters by no less, dB: rounding."""


@dataclass(frozen=True)
class LevelCurve:
    """Level of a surface over cos θ, and where range was not corrected otherwise, over lg R.

    Attributes
    ----------
    cosine, level, sigma : (n,) float arrays
        Middles of the classes, in growing order, level and standard deviation there, dB.
    middle, slope : float
        lg R of the middle of the surface, and what the level changes by over lg R, dB; 0 where range has no part in it.
    """

    cosine: Float
    level: Float
    sigma: Float
    middle: float
    slope: float

    def known(self, cosine: Float) -> Bool:
        """Where the level is known (n,): within half a class of a middle or between two that follow each other."""
        if not len(self.cosine):
            return np.zeros(np.shape(cosine), np.bool_)
        after = np.clip(np.searchsorted(self.cosine, cosine), 0, len(self.cosine) - 1)
        before = np.maximum(after - 1, 0)
        gap = np.minimum(np.abs(self.cosine[after] - cosine), np.abs(self.cosine[before] - cosine))
        return np.asarray((gap <= CLASS) & (cosine >= np.cos(np.radians(STEEPEST))))

    def __call__(self, cosine: Float, range_m: Float) -> Float:
        """Level at incidences and ranges (n,), dB."""
        return np.asarray(np.interp(cosine, self.cosine, self.level) + self.slope * (np.log10(range_m) - self.middle))

    def sigmas(self, cosine: Float) -> Float:
        """Standard deviation there, dB."""
        return np.interp(cosine, self.cosine, self.sigma)


def level_curve(cosine: Float, range_m: Float, value: Float, points: Float, *, by_range: bool) -> LevelCurve:
    """Find the level of a surface from its pixels.

    Parameters
    ----------
    cosine, range_m, value, points : (n,) float arrays
        Cosine of incidence, range, m, mean level, dB, and number of points of each pixel.
    by_range : bool
        Whether the level may also go by range. On a plane it need not: there cos θ tells the range.
    """
    usable = cosine >= np.cos(np.radians(STEEPEST))
    cosine, range_m, value, points = cosine[usable], range_m[usable], value[usable], points[usable]
    number = np.floor(cosine / CLASS).astype(np.int64)
    middles, order, starts = _classes(number, cosine, points)
    empty = np.empty(0)
    if not len(middles):
        return LevelCurve(empty, empty, empty, 0.0, 0.0)
    level, sigma = np.zeros(len(middles)), np.full(len(middles), LEAST_SIGMA)
    log_range = np.log10(range_m)
    slope, middle = 0.0, float(np.median(log_range))
    by_range = by_range and float(np.ptp(log_range)) > LEAST_SPAN
    for _ in range(TURNS):
        rest = value - np.interp(cosine, middles, level) - slope * (log_range - middle)
        for k in range(len(middles)):
            found = robust_statistics(rest[order[starts[k] : starts[k + 1]]], SHORTH, two_sided=True)
            level[k] += found.mean
            sigma[k] = max(found.sigma, LEAST_SIGMA)
        if by_range:
            rest = value - np.interp(cosine, middles, level) - slope * (log_range - middle)
            near = np.abs(rest) < 2.0 * np.interp(cosine, middles, sigma)
            x = log_range[near] - middle
            square = float(x @ x)
            slope += float(x @ rest[near]) / square if square > 0.0 else 0.0
    return LevelCurve(middles, level, sigma, middle, slope)


def _classes(number: np.ndarray, value: Float, points: Float) -> tuple[Float, np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Mean value of the classes that hold enough points; the values in order of these, and where each begins."""
    held, place = np.unique(number, return_inverse=True)
    enough = np.bincount(place, points, len(held)) >= FEWEST
    place = np.where(enough[place], np.cumsum(enough)[place] - 1, len(held))
    order = np.argsort(place, kind="stable")
    count = int(enough.sum())
    starts = np.searchsorted(place[order], np.arange(count + 1))
    order = order[: starts[-1]]
    number_of = np.diff(starts)
    middles = np.add.reduceat(value[order], starts[:-1]) / number_of if count else np.empty(0)
    return middles, order, starts
