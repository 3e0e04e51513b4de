"""Dependence of intensity on range and incidence, as medians over classes of either."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64, Intp
from tunneldb.radiometry.roughness import NOTICEABLE

CLASSES = 40
"""Maximum number of classes over the range of values; each has at least MIN_CLASS_POINTS points."""

MIN_CLASS_POINTS = 30
"""Minimum number of points of a class."""

END_QUANTILES = (0.001, 0.999)
"""Quantiles of the points that limit the classes."""

SMALL_SHARE = 1.0 / 3.0
"""Residual dependence, relative to the lining's scatter, below which it is small: it then raises the scatter by 5 %."""

SLOPE_ANGLE = 10.0
"""Angle for which slopes over incidence are given, degrees."""


@dataclass(frozen=True)
class ClassMeans:
    """Intensity over classes of range or incidence; arrays (k,), of classes with enough points.

    Attributes
    ----------
    at : float array
        Middle of each class, m or degrees.
    low, middle, high : float arrays
        Quartiles of intensity, dB.
    points : int array
        Number of points.
    """

    at: Float
    low: Float
    middle: Float
    high: Float
    points: Int64

    @property
    def slope(self) -> float:
        """Return the slope of a straight line through the classes' medians, weighted by their points, dB per m or degree."""
        if len(self.at) < 2:
            return float("nan")
        away = self.at - np.average(self.at, weights=self.points)
        return float((self.points * away) @ self.middle / ((self.points * away) @ away))

    @property
    def spread(self) -> float:
        """Return the standard deviation of the classes' medians, weighted by their points, dB."""
        if len(self.at) == 0:
            return float("nan")
        away = self.middle - np.average(self.middle, weights=self.points)
        return float(np.sqrt(np.average(away**2, weights=self.points)))


def class_means(at: Float, level: Float) -> ClassMeans:
    """Compute intensity (n,), dB, over classes of range, m, or incidence, degrees; NaNs are ignored."""
    known = np.isfinite(at) & np.isfinite(level)
    at, level = at[known], level[known]
    none = ClassMeans(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, np.int64))
    if len(at) < MIN_CLASS_POINTS:
        return none
    first, last = np.quantile(at, END_QUANTILES)
    if last <= first:
        return none
    edges = np.linspace(first, last, CLASSES + 1)
    number = np.searchsorted(edges, at, side="right") - 1
    rows = []
    for k, values in _by_class(number, level):
        if 0 <= k < CLASSES and len(values) >= MIN_CLASS_POINTS:
            rows.append([0.5 * (edges[k] + edges[k + 1]), *np.quantile(values, (0.25, 0.5, 0.75)), len(values)])
    if not rows:
        return none
    table = np.array(rows)
    return ClassMeans(table[:, 0], table[:, 1], table[:, 2], table[:, 3], table[:, 4].astype(np.int64))


def _by_class(number: Intp, level: Float) -> list[tuple[int, Float]]:
    order = np.argsort(number, kind="stable")
    there, first = np.unique(number[order], return_index=True)
    return list(zip(there.tolist(), np.split(level[order], first[1:]), strict=True))


@dataclass(frozen=True)
class Dependence:
    """Dependence on range and incidence, before and after correction.

    Attributes
    ----------
    raw_range, raw_incidence : ClassMeans
        Classes of measured intensity.
    range, incidence : ClassMeans
        Classes of corrected intensity.
    scatter : float
        Robust standard deviation of corrected intensity, from the interquartile range, dB.
    """

    raw_range: ClassMeans
    raw_incidence: ClassMeans
    range: ClassMeans
    incidence: ClassMeans
    scatter: float

    @classmethod
    def of(cls, range_m: Float, angle: Float, raw: Float, corrected: Float) -> Dependence:
        """Evaluate points (n,): range, m, incidence, degrees, raw and corrected intensity, dB."""
        known = corrected[np.isfinite(corrected)]
        low, high = np.quantile(known, (0.25, 0.75)) if len(known) else (np.nan, np.nan)
        return cls(
            class_means(range_m, raw),
            class_means(angle, raw),
            class_means(range_m, corrected),
            class_means(angle, corrected),
            float(high - low) / 1.349,
        )

    def rows(self) -> list[list[str]]:
        """Return table rows: variable, slopes before and after, deviations of the medians before and after."""
        lines = []
        for name, unit, before, after, by in (
            ("range", "dB/m", self.raw_range, self.range, 1.0),
            ("incidence", f"dB/{SLOPE_ANGLE:g}°", self.raw_incidence, self.incidence, SLOPE_ANGLE),
        ):
            line = [name]
            line += [f"{by * c.slope:+.3f} {unit}" if len(c.at) > 1 else "" for c in (before, after)]
            line += [f"{c.spread:.2f} dB" if len(c.at) else "" for c in (before, after)]
            lines.append(line)
        return lines

    def verdict(self) -> str:
        """Return one line on the remaining dependence."""
        if not len(self.range.at):
            return "Intensity could not be corrected."
        parts = [("range", self.range.spread), ("incidence", self.incidence.spread)]
        left = [f"{name} (medians differ by {spread:.2f} dB)" for name, spread in parts if spread > NOTICEABLE]
        if left and max(spread for _, spread in parts) < SMALL_SHARE * self.scatter:
            return (
                f"Sufficient for detection: corrected intensity still depends on {' and '.join(left)}, but by less than a"
                f" third of the scatter of the lining, {self.scatter:.2f} dB."
            )
        if left:
            return f"Corrected intensity still depends on {' and '.join(left)}; scatter of the lining {self.scatter:.2f} dB."
        return (
            f"Corrected intensity depends neither on range nor on incidence: medians differ by {parts[0][1]:.2f} and"
            f" {parts[1][1]:.2f} dB, under {NOTICEABLE:g} dB; scatter of the lining {self.scatter:.2f} dB."
        )
