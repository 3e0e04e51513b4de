"""The level of a surface by incidence: what it shows where it is as it should be (Ono et al., 3.3 and 3.4).

The paper parts a cluster into classes of cos θ and fits a normal distribution to the histogram of each. A class may be covered by
rust altogether, though, and then its own histogram cannot tell; and 0.05 of cos θ is 18° at right angles to a surface, over which
gloss loses several decibels. Here the shape of the level over θ comes from differences between places that lie close to each
other: those across the edge of a spot are few, and outliers, however large the spot is. Where most pixels then lie is the level,
and the robust mode of each class mends what is left of the shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.robust import MAD_TO_SIGMA

CLASS = 0.05
"""Width of a class of θ, radians: at 45° about what the paper's 0.05 of cos θ is (Table 1)."""

FEWEST = 30
"""Fewer points tell no level."""

STEEPEST = 80.0
"""Beyond this incidence nothing is judged, degrees: there the beam is smeared over six times its width."""

SHORTH = 0.25
"""Share of the values in the shortest interval that marks the level: up to half of a surface may be something else."""

LEAST_SPAN = 0.01
"""Span of lg R below which range makes no difference on a surface."""

BEND = 0.3
"""Standard deviation of how the slope of the level changes from class to class, dB per class: gloss and slanting paint do no
more."""

SLOPE = 1.0
"""The same of the slope itself, dB per class, 20 dB per radian: of few pixels noise would make more."""

RANGE_SLOPE = 20.0
"""The same of the slope over lg R, dB."""

TUKEY = 4.0
"""Differences count less the greater they are, and from so many standard deviations on not at all."""

MOST_PAIRS = 40_000
"""Pairs of places by which the shape is found."""

MOST_POINTS = 8.0
"""Pixels of more points count no more than these: what is uneven about a surface does not go by how often it is measured."""

FITS = 8
"""Times that their weights are found again."""

MOST_WIDE = 1.5
"""Where the surface scatters more than so many times as much as elsewhere, something else covers it."""

OWN = 2.5
"""Pixels within so many standard deviations of the level are of the surface itself."""

LEAST_SIGMA = 0.01
"""The level scatters by no less, dB: rounding."""


@dataclass(frozen=True)
class LevelCurve:
    """Level of a surface over θ, and where range was not corrected otherwise, over lg R.

    Attributes
    ----------
    angle, level, sigma : (k,) float arrays
        Angles of incidence, radians, in growing order; the level there and the standard deviation about it, dB.
    seen : (n,) int array
        Classes of θ that hold enough points.
    middle, slope : float
        lg R of the middle of the surface, and what the level changes by over lg R, dB; 0 where range has no part in it.
    """

    angle: Float
    level: Float
    sigma: Float
    seen: Int64
    middle: float
    slope: float

    def known(self, cosine: Float) -> Bool:
        """Where the level is known (n,): within a class that holds enough points, or half a class beside it."""
        if not len(self.seen):
            return np.zeros(np.shape(cosine), np.bool_)
        place = np.arccos(cosine) / CLASS
        near = np.isin(np.floor(place - 0.5), self.seen) | np.isin(np.floor(place + 0.5), self.seen)
        return np.asarray(near & (place <= np.radians(STEEPEST) / CLASS))

    def __call__(self, cosine: Float, range_m: Float) -> Float:
        """Level at incidences and ranges (n,), dB."""
        by_angle = np.interp(np.arccos(cosine), self.angle, self.level)
        return np.asarray(by_angle + self.slope * (np.log10(range_m) - self.middle))

    def sigmas(self, cosine: Float) -> Float:
        """Standard deviation there, dB."""
        return np.interp(np.arccos(cosine), self.angle, self.sigma)

    def own(self, cosine: Float, range_m: Float, value: Float) -> Bool:
        """Which pixels (n,) lie at the level."""
        return np.asarray(np.abs(value - self(cosine, range_m)) < OWN * self.sigmas(cosine))


UNKNOWN = LevelCurve(np.zeros(1), np.zeros(1), np.ones(1), np.empty(0, np.int64), 0.0, 0.0)
"""Of a surface of which too little was seen."""


def level_curve(
    cosine: Float, range_m: Float, value: Float, points: Float, pairs: Int64, own: Bool | None = None, *, by_range: bool
) -> LevelCurve:
    """Find the level of a surface from its pixels.

    Parameters
    ----------
    cosine, range_m, value, points : (n,) float arrays
        Cosine of incidence, range, m, mean level, dB, and number of points of each pixel.
    pairs : (m, 2) int array
        Pixels that lie close to each other.
    own : (n,) bool array or None
        Pixels that another scan knows to be of the surface itself; None where none does.
    by_range : bool
        Whether the level may also go by range. On a plane it need not: there θ tells the range.
    """
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    usable = angle <= np.radians(STEEPEST)
    seen = _seen(angle[usable], points[usable])
    if not len(seen):
        return UNKNOWN
    pairs = pairs[usable[pairs].all(axis=1)]
    angle, value, points, log_range = angle[usable], value[usable], points[usable], np.log10(range_m[usable])
    pairs = (np.cumsum(usable) - 1)[pairs]
    middle = float(np.median(log_range))
    by_range = by_range and float(np.ptp(log_range)) > LEAST_SPAN
    low, high = float(angle.min()), float(angle.max())
    knots = np.linspace(low, max(high, low + 1e-6), max(int(np.ceil((high - low) / CLASS)), 1) + 1)
    columns = _rises(angle, knots)
    if by_range:
        columns = np.column_stack([columns, log_range - middle])
    prior = _prior(len(knots) - 1, by_range=by_range)
    found = _shape(columns, value, points, pairs, prior)
    bare = value - columns @ found
    told = own[usable] if own is not None else np.zeros(len(bare), np.bool_)
    start = robust_statistics(bare[told] if points[told].sum() >= FEWEST else bare, SHORTH, two_sided=True)
    found, level, spread = _fit(columns, value, points, prior, found, start.mean, max(start.sigma, LEAST_SIGMA))
    shape = level + np.concatenate([[0.0], np.cumsum(found[: len(knots) - 1])])
    sigma = _sigmas(angle, value - level - columns @ found, knots, spread)
    return LevelCurve(knots, shape, sigma, seen, middle, float(found[-1]) if by_range else 0.0)


def _seen(angle: Float, points: Float) -> Int64:
    """Classes of θ that hold enough points."""
    number = np.floor(angle / CLASS).astype(np.int64)
    return np.flatnonzero(np.bincount(number, points) >= FEWEST)


def _rises(angle: Float, knots: Float) -> Float:
    """Which share of the rise from each knot to the next lies below angles (n,): (n, knots - 1)."""
    place = (angle - knots[0]) / (knots[1] - knots[0])
    return np.clip(place[:, None] - np.arange(len(knots) - 1), 0.0, 1.0)


def _prior(rises: int, *, by_range: bool) -> Float:
    """Inverse covariance of the rises and of the slope over lg R: they are about 0, and rises change little."""
    bend = np.diff(np.eye(rises), axis=0)
    prior = np.zeros((rises + by_range, rises + by_range))
    prior[:rises, :rises] = bend.T @ bend / BEND**2 + np.eye(rises) / SLOPE**2
    if by_range:
        prior[-1, -1] = 1.0 / RANGE_SLOPE**2
    return prior


def _shape(columns: Float, value: Float, points: Float, pairs: Int64, prior: Float) -> Float:
    """Rises of the level: least squares of differences, with Huber's weights and then Tukey's."""
    found = np.zeros(columns.shape[1])
    if not len(pairs):
        return found
    if len(pairs) > MOST_PAIRS:
        pairs = pairs[:: -(-len(pairs) // MOST_PAIRS)]
    one, other = pairs.T
    design = columns[one] - columns[other]
    seen = value[one] - value[other]
    weight = 1.0 / (1.0 / np.minimum(points[one], MOST_POINTS) + 1.0 / np.minimum(points[other], MOST_POINTS))
    weight /= weight.mean()
    for turn in range(FITS):
        rest = np.abs(seen - design @ found)
        sigma = max(MAD_TO_SIGMA * float(np.median(rest)), LEAST_SIGMA)
        size = rest / (TUKEY * sigma)
        # The start may be far off.
        robust = np.minimum(1.0, 0.4 / np.maximum(size, 1e-12)) if turn < 3 else np.maximum(1.0 - size**2, 0.0) ** 2
        counted = weight * robust / sigma**2
        found = np.linalg.solve(design.T @ (counted[:, None] * design) + prior, design.T @ (counted * seen))
    return found


def _fit(
    columns: Float, value: Float, points: Float, prior: Float, found: Float, level: float, spread: float
) -> tuple[Float, float, float]:
    """Rises, level at the first knot and standard deviation of what lies about the level: least squares with Tukey's weights."""
    if len(value) > MOST_PAIRS:
        step = -(-len(value) // MOST_PAIRS)
        columns, value, points = columns[::step], value[::step], points[::step]
    design = np.column_stack([columns, np.ones(len(columns))])
    whole = np.zeros((design.shape[1], design.shape[1]))
    whole[:-1, :-1] = prior
    weight = np.minimum(points, MOST_POINTS)
    weight = weight / weight.mean()
    for _ in range(FITS):
        rest = value - level - columns @ found
        near = np.abs(rest) < OWN * spread
        if near.sum() < FEWEST:
            break
        spread = max(robust_statistics(rest[near], two_sided=True).sigma, LEAST_SIGMA)
        counted = weight * np.maximum(1.0 - (rest / (TUKEY * spread)) ** 2, 0.0) ** 2 / spread**2
        solved = np.linalg.solve(design.T @ (counted[:, None] * design) + whole, design.T @ (counted * value))
        found, level = solved[:-1], float(solved[-1])
    return found, level, spread


def _sigmas(angle: Float, rest: Float, knots: Float, spread: float) -> Float:
    """Standard deviation of the surface itself about its level at each knot, dB."""
    near = np.abs(rest) < 2.0 * OWN * spread
    angle, rest = angle[near], rest[near]
    out = np.full(len(knots), spread)
    order = np.argsort(angle)
    angle, rest = angle[order], rest[order]
    for k, knot in enumerate(knots):
        low, high = np.searchsorted(angle, [knot - CLASS, knot + CLASS])
        if high - low >= FEWEST:
            out[k] = np.clip(robust_statistics(rest[low:high], two_sided=True).sigma, LEAST_SIGMA, MOST_WIDE * spread)
    return out
