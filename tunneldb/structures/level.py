"""The level of a surface by incidence: what it shows where it is as it should be (Ono et al., 3.3 and 3.4).

The paper parts a cluster into classes of cos θ and fits a normal distribution to the histogram of each. Here the middle of each
class is the robust mode of its pixels, and between the middles the level is interpolated, so that no step runs over a surface
where two classes meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, Intp
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

INCIDENCE_SLOPES = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0)
"""Losses over lg cos θ that are tried first, dB: none, Lambert's 10, gloss more."""

RANGE_SLOPES = (-20.0, -40.0, 20.0)
"""The same over lg R: the inverse square, and what scanners make of it near by."""

SHORTH_OF_ALL = 0.4
"""Share of all pixels of a surface that lie nearest together about the right curve."""

CLIP = 2.5
"""Pixels within so many standard deviations of the curve refine it."""

MOST_OFF, MOST_WIDE = 2.0, 1.5
"""A class lies no farther off the curve in standard deviations, and scatters no more than so many times as much, or it is
covered by something else."""

GLOSS = 0.95
"""Cosine from which a class may be as bright as it likes."""

MOST_PIXELS = 60_000
"""Pixels by which the curve is found."""

TURNS = 4
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

    A smooth curve is found first, a + b lg cos θ + c (lg cos θ)², for which most pixels lie nearest together; then the robust
    mode of each class is its level, unless it lies off the curve: a class may be covered by a spot altogether.

    Parameters
    ----------
    cosine, range_m, value, points : (n,) float arrays
        Cosine of incidence, range, m, mean level, dB, and number of points of each pixel.
    by_range : bool
        Whether the level may also go by range. On a plane it need not: there cos θ tells the range.
    """
    usable = cosine >= np.cos(np.radians(STEEPEST))
    cosine, range_m, value, points = cosine[usable], range_m[usable], value[usable], points[usable]
    middles, order, starts = _classes(np.floor(cosine / CLASS).astype(np.int64), cosine, points)
    empty = np.empty(0)
    if not len(middles):
        return LevelCurve(empty, empty, empty, 0.0, 0.0)
    log_range = np.log10(range_m)
    middle = float(np.median(log_range))
    by_range = by_range and float(np.ptp(log_range)) > LEAST_SPAN
    smooth, slope, spread = _smooth(np.log10(cosine), log_range - middle, value, by_range=by_range)
    curve: Float = np.asarray(np.polyval(smooth, np.log10(middles)), np.float64)
    level, sigma = curve.copy(), np.full(len(middles), max(spread, LEAST_SIGMA))
    for _ in range(TURNS):
        rest = value - np.interp(cosine, middles, level) - slope * (log_range - middle)
        for k in range(len(middles)):
            found = robust_statistics(rest[order[starts[k] : starts[k + 1]]], SHORTH, two_sided=True)
            at, wide = level[k] + found.mean, max(found.sigma, LEAST_SIGMA)
            # Gloss makes what is seen squarely brighter than any smooth curve.
            if abs(at - curve[k]) <= MOST_OFF * spread or (at > curve[k] and middles[k] > GLOSS):
                level[k], sigma[k] = at, min(wide, MOST_WIDE * max(spread, LEAST_SIGMA))
            else:
                level[k] = curve[k]
    return LevelCurve(middles, level, sigma, middle, slope)


def _smooth(x: Float, along: Float, value: Float, *, by_range: bool) -> tuple[Float, float, float]:
    """Polynomial of lg cos θ, slope over lg R and standard deviation of a surface's level."""
    if len(x) > MOST_PIXELS:
        step = -(-len(x) // MOST_PIXELS)
        x, along, value = x[::step], along[::step], value[::step]
    degree = 0 if np.ptp(x) < 0.01 else 1 if np.ptp(x) < 0.08 else 2
    best = (np.inf, np.zeros(degree + 1))
    slopes = (0.0, *RANGE_SLOPES) if by_range else (0.0,)
    slope = 0.0
    for loss in INCIDENCE_SLOPES if degree else (0.0,):
        for fall in slopes:
            rest = np.sort(value - loss * x - fall * along)
            width = max(2, int(np.ceil(SHORTH_OF_ALL * len(rest))))
            if len(rest) < width + 1:
                continue
            lengths = rest[width - 1 :] - rest[: len(rest) - width + 1]
            at = int(np.argmin(lengths))
            if lengths[at] < best[0]:
                start = np.zeros(degree + 1)
                start[-1] = np.median(rest[at : at + width])
                if degree:
                    start[-2] = loss
                best, slope = (float(lengths[at]), start), fall
    smooth, spread = best[1], 0.0
    for _ in range(TURNS):
        rest = value - np.polyval(smooth, x) - slope * along
        found = robust_statistics(rest, SHORTH_OF_ALL, two_sided=True)
        smooth[-1] += found.mean
        spread = max(found.sigma, LEAST_SIGMA)
        near = np.abs(rest - found.mean) < CLIP * spread
        if near.sum() < 10 * (degree + 2):
            break
        columns = [x[near] ** k for k in range(degree, -1, -1)] + ([along[near]] if by_range else [])
        solution = np.linalg.lstsq(np.column_stack(columns), value[near], rcond=None)[0]
        smooth = np.asarray(solution[: degree + 1], np.float64)
        slope = float(solution[-1]) if by_range else 0.0
    return smooth, slope, spread


def _classes(number: Int64, value: Float, points: Float) -> tuple[Float, Intp, Intp]:
    """Mean value of the classes that hold enough points; the values in order of these, and where each begins."""
    held, place = np.unique(number, return_inverse=True)
    enough = np.bincount(place, points, len(held)) >= FEWEST
    place = np.where(enough[place], np.cumsum(enough)[place] - 1, len(held))
    order = np.argsort(place, kind="stable")
    count = int(enough.sum())
    starts = np.searchsorted(place[order], np.arange(count + 1))
    order = order[: starts[-1]]
    number_of = np.diff(starts)
    middles: Float = np.asarray(np.add.reduceat(value[order], starts[:-1]) / number_of if count else [], np.float64)
    return middles, order, starts
