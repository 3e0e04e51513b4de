"""Level of an intact surface by incidence (Ono et al., 3.3 and 3.4).

The paper divides a cluster into classes of cos θ and fits a normal distribution to the histogram of each. But a class may be
covered by rust completely, which its own histogram cannot show; and 0.05 of cos θ is 18° at right angles to a surface, over
which gloss loses several decibels. Here the shape of the level over θ comes from differences between nearby places: pairs
across the edge of a spot are few, and outliers, however large the spot is. The level is where most pixels then are, and is
fitted again to these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64
from tunneldb.compiled import kernel
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.robust import MAD_TO_SIGMA

CLASS = 0.05
"""Width of a class of θ, radians: at 45° about equal to the paper's 0.05 of cos θ (Table 1)."""

CLASSES = int(np.pi / CLASS) + 1

MIN_LEVEL_POINTS = 30
"""Minimum number of points of a level."""

MAX_INCIDENCE = 80.0
"""Maximum incidence, degrees: beyond it the beam covers over six times its width."""

SHORTH = 0.25
"""Share of the values in the shortest interval, which locates the level: up to half of a surface may differ."""

MIN_RANGE_SPAN = 0.01
"""Span of lg R below which range has no effect on a surface."""

BEND = 0.3
"""Standard deviation of the change of the level's slope from class to class, dB per class: gloss and oblique paint do no
more."""

SLOPE = 1.0
"""Standard deviation of the slope itself, dB per class, 20 dB per radian: noise of few pixels would make more."""

RANGE_SLOPE = 20.0
"""Standard deviation of the slope over lg R, dB."""

TUKEY = 4.0
"""Limits of weights, in standard deviations: differences count less beyond the first, and not at all beyond the second."""

MAX_PAIRS, MAX_PIXELS = 20_000, 40_000
"""Approximate number of pairs of places for the shape, and of pixels for the level."""

MAX_PIXEL_POINTS = 8.0
"""Maximum number of points that count in a pixel: a surface's unevenness does not depend on how often it is measured."""

FITS = 8
"""Maximum number of reweighting rounds …"""

SETTLED = 0.005
"""… which end when the level changes by less, dB."""

MAX_SCATTER_RATIO = 1.5
"""Ratio of the scatter to that elsewhere from which another material covers the surface."""

OWN = 2.5
"""Standard deviations from the level within which pixels belong to the surface itself."""

OWN_MAD = 0.98
"""Ratio of the median deviation of a normal distribution truncated there to that of the whole one."""

MIN_SIGMA = 0.05
"""Minimum scatter of the level, dB: most rounded values may be equal."""


@dataclass(frozen=True)
class LevelCurve:
    """Level of a surface over θ, and over lg R if range was not corrected otherwise.

    Attributes
    ----------
    angle, level, sigma : (k,) float arrays
        Angles of incidence, radians, in growing order; the level there and the standard deviation about it, dB.
    seen : (n,) int array
        Classes of θ with enough points.
    middle, slope : float
        lg R of the middle of the surface, and the level's slope over lg R, dB; 0 if range has no effect.
    """

    angle: Float
    level: Float
    sigma: Float
    seen: Int64
    middle: float
    slope: float

    def known(self, angle: Float) -> Bool:
        """Return True where the level is known (n,): in a class with enough points, or half a class beside it."""
        enough = np.zeros(CLASSES + 2, np.bool_)
        enough[self.seen + 1] = True
        place = angle / CLASS
        at = np.floor(place + 0.5).astype(np.int64)
        return np.asarray((enough[at] | enough[at + 1]) & (place <= np.radians(MAX_INCIDENCE) / CLASS))

    def __call__(self, angle: Float, range_m: Float) -> Float:
        """Return the level at angles of incidence, radians, and ranges (n,), dB."""
        by_angle = np.interp(angle, self.angle, self.level)
        return np.asarray(by_angle + self.slope * (np.log10(range_m) - self.middle)) if self.slope else by_angle

    def sigmas(self, angle: Float) -> Float:
        """Return the standard deviation there, dB."""
        return np.interp(angle, self.angle, self.sigma)

    def own(self, angle: Float, range_m: Float, value: Float) -> Bool:
        """Return True for pixels (n,) at the level."""
        return np.asarray(np.abs(value - self(angle, range_m)) < OWN * self.sigmas(angle))


UNKNOWN = LevelCurve(np.zeros(1), np.zeros(1), np.ones(1), np.empty(0, np.int64), 0.0, 0.0)
"""Level of a surface with too few pixels."""


def level_curve(
    angle: Float,
    range_m: Float,
    value: Float,
    points: Float,
    pairs: Int64,
    own: Bool | None = None,
    *,
    by_range: bool,
    one_surface: bool = True,
) -> LevelCurve:
    """Find the level of a surface from its pixels.

    Parameters
    ----------
    angle, range_m, value, points : (n,) float arrays
        Angle of incidence, radians, range, m, mean level, dB, and number of points of each pixel.
    pairs : (m, 2) int array
        Pairs of nearby pixels.
    own : (n,) bool array or None
        Pixels that another scan knows to be of the surface itself; None where none does.
    by_range : bool
        True if the level may also depend on range. On a plane it need not: there θ determines the range.
    one_surface : bool
        True if most of it is one surface, so that the level is fitted again to most pixels. With several materials each
        covers its own incidences, and such a fit would jump from one to the other.
    """
    usable = angle <= np.radians(MAX_INCIDENCE)
    seen = _seen(angle[usable], points[usable])
    if not len(seen):
        return UNKNOWN
    pairs = pairs[usable[pairs].all(axis=1)]
    taken = np.flatnonzero(usable)
    taken = np.union1d(taken[:: -(-len(taken) // MAX_PIXELS)], pairs)
    pairs = np.searchsorted(taken, pairs)
    angle, value, points, log_range = angle[taken], value[taken], points[taken], np.log10(range_m[taken])
    middle = float(np.median(log_range))
    by_range = by_range and float(np.ptp(log_range)) > MIN_RANGE_SPAN
    low, high = float(angle.min()), float(angle.max())
    knots = np.linspace(low, max(high, low + 1e-6), max(int(np.ceil((high - low) / CLASS)), 1) + 1)
    basis = _Basis((angle - low) / (knots[1] - low), log_range - middle, len(knots), by_range)
    weight = np.minimum(points, MAX_PIXEL_POINTS)
    told = own[taken] if own is not None else np.zeros(len(value), np.bool_)
    if points[told].sum() < MIN_LEVEL_POINTS:
        told = np.ones(len(value), np.bool_)
    clear = told[pairs].all(axis=1)
    enough = np.bincount(basis.first[pairs[clear, 0]], minlength=len(knots)) >= MIN_LEVEL_POINTS
    # The other scan may know pixels of few incidences; elsewhere all pairs show the shape.
    found = _shape(basis, value, weight, pairs[clear | ~enough[basis.first[pairs[:, 0]]]])
    start = robust_statistics((value - basis(found))[told], SHORTH, two_sided=True)
    found[: len(knots)] += start.mean
    spread = max(start.sigma, MIN_SIGMA)
    if one_surface:
        found, spread = _fit(basis, value, weight, found, spread)
    sigma = _sigmas(angle, value - basis(found), knots, spread)
    return LevelCurve(knots, found[: len(knots)], sigma, seen, middle, float(found[-1]) if by_range else 0.0)


def _seen(angle: Float, points: Float) -> Int64:
    """Return the classes of θ with enough points."""
    number = np.floor(angle / CLASS).astype(np.int64)
    return np.flatnonzero(np.bincount(number, points) >= MIN_LEVEL_POINTS)


class _Basis:
    """Level at knots, between which it is straight, and a slope over lg R.

    Parameters
    ----------
    place : (n,) float array
        Classes of the pixels, in knots from the first.
    along : (n,) float array
        lg R.
    knots : int
    by_range : bool
    """

    def __init__(self, place: Float, along: Float, knots: int, by_range: bool) -> None:
        self.first = np.clip(place.astype(np.int64), 0, knots - 2)
        self.share = place - self.first
        self.along, self.by_range = along if by_range else np.zeros(len(place)), by_range
        self.prior = self._prior(knots)

    def _prior(self, knots: int) -> Float:
        """Return the prior inverse covariance: rises from knot to knot, their changes and the slope are about 0."""
        rise, bend = np.diff(np.eye(knots), axis=0), np.diff(np.eye(knots), n=2, axis=0)
        prior = np.zeros((knots + 1, knots + 1))
        prior[:knots, :knots] = bend.T @ bend / BEND**2 + rise.T @ rise / SLOPE**2 + 1e-9 * np.eye(knots)
        prior[-1, -1] = 1.0 / RANGE_SLOPE**2
        return prior

    def __call__(self, found: Float) -> Float:
        """Return the level of the pixels (n,)."""
        level = found[self.first] + self.share * np.diff(found)[self.first]
        return np.asarray(level + found[-1] * self.along if self.by_range else level)

    def solve(self, one: Int64, other: Int64, seen: Float, weight: Float) -> Float:
        """Solve weighted least squares of levels ``one``, minus those of ``other`` if that is not empty."""
        size = len(self.prior)
        matrix, right = self.prior.copy(), np.zeros(size)
        _accumulate(self.first, self.share, self.along, one, other, seen, weight, matrix, right)
        return np.asarray(np.linalg.solve(matrix, right))


def _shape(basis: _Basis, value: Float, weight: Float, pairs: Int64) -> Float:
    """Fit the level up to a constant: least squares of differences, with Huber's and then Tukey's weights."""
    found = np.zeros(len(basis.prior))
    if not len(pairs):
        return found
    one, other = np.ascontiguousarray(pairs.T)
    seen = value[one] - value[other]
    both = weight[one] * weight[other] / (weight[one] + weight[other])
    both /= both.mean()
    for turn in range(FITS):
        rest = value - basis(found)
        off = np.abs(rest[one] - rest[other])
        sigma = max(MAD_TO_SIGMA * float(np.median(off)), MIN_SIGMA)
        size = off / (TUKEY * sigma)
        # The start may be far off.
        robust = np.minimum(1.0, 0.4 / np.maximum(size, 1e-12)) if turn < 3 else np.maximum(1.0 - size**2, 0.0) ** 2
        before, found = found, basis.solve(one, other, seen, both * robust / sigma**2)
        if turn > 3 and np.ptp(np.diff(found[:-1] - before[:-1], prepend=0.0)) < SETTLED:
            break
    return found


def _fit(basis: _Basis, value: Float, weight: Float, found: Float, spread: float) -> tuple[Float, float]:
    """Fit the level, and the standard deviation about it: least squares with Tukey's weights."""
    every, nothing = np.arange(len(value)), np.empty(0, np.int64)
    weight = weight / weight.mean()
    for _ in range(FITS):
        rest = value - basis(found)
        near = np.abs(rest) < OWN * spread
        if near.sum() < MIN_LEVEL_POINTS:
            break
        spread = max(float(MAD_TO_SIGMA * np.median(np.abs(rest[near]))) / OWN_MAD, MIN_SIGMA)
        counted = weight * np.maximum(1.0 - (rest / (TUKEY * spread)) ** 2, 0.0) ** 2 / spread**2
        before, found = found, basis.solve(every, nothing, value, counted)
        if np.abs(found[:-1] - before[:-1]).max() < SETTLED:
            break
    return found, spread


@kernel
def _accumulate(
    first: Int64, share: Float, along: Float, one: Int64, other: Int64, seen: Float, weight: Float, matrix: Float, right: Float
) -> None:  # pragma: no cover - compiled
    last = len(right) - 1
    at, part = np.empty(5, np.int64), np.empty(5)
    for m in range(len(one)):
        w = weight[m]
        if w <= 0.0:
            continue
        i, size = one[m], 2
        at[0], at[1], part[0], part[1] = first[i], first[i] + 1, 1.0 - share[i], share[i]
        beyond = along[i]
        if len(other):
            j, size = other[m], 4
            at[2], at[3], part[2], part[3] = first[j], first[j] + 1, share[j] - 1.0, -share[j]
            beyond -= along[j]
        if beyond != 0.0:
            at[size], part[size] = last, beyond
            size += 1
        for a in range(size):
            right[at[a]] += w * part[a] * seen[m]
            for b in range(size):
                matrix[at[a], at[b]] += w * part[a] * part[b]


def _sigmas(angle: Float, rest: Float, knots: Float, spread: float) -> Float:
    """Return the standard deviation of the surface itself about its level at each knot, dB."""
    near = np.abs(rest) < 2.0 * OWN * spread
    angle, rest = angle[near], rest[near]
    out = np.full(len(knots), spread)
    order = np.argsort(angle)
    angle, rest = angle[order], rest[order]
    for k, knot in enumerate(knots):
        low, high = np.searchsorted(angle, [knot - CLASS, knot + CLASS])
        if high - low >= MIN_LEVEL_POINTS:
            out[k] = np.clip(robust_statistics(rest[low:high], two_sided=True).sigma, MIN_SIGMA, MAX_SCATTER_RATIO * spread)
    return out
