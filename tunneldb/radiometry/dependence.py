"""Whether intensity depends on range or incidence: its course over classes of either."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int64, Intp
from tunneldb.radiometry.roughness import NOTICEABLE

CLASSES = 40
"""Classes over the range of values, at the most; each of at least FEWEST points."""

FEWEST = 30
"""Points of a class that is counted."""

ENDS = (0.001, 0.999)
"""Shares of the points between whose values the classes lie."""

SMALL = 1.0 / 3.0
"""What is left of the dependence is small when it is less of the lining's scatter: it raises that by 5 % then."""

STEEP = 10.0
"""Slopes over incidence are given for so many degrees."""


@dataclass(frozen=True)
class ClassMeans:
    """Intensity over classes of range or incidence; arrays (k,), of classes that hold enough points.

    Attributes
    ----------
    at : float array
        Middle of each class, m or degrees.
    low, middle, high : float arrays
        Quartiles of intensity, dB.
    points : int array
        How many points.
    """

    at: Float
    low: Float
    middle: Float
    high: Float
    points: Int64

    @property
    def slope(self) -> float:
        """Slope of a straight line through the classes' medians, weighted by their points, dB per m or degree."""
        if len(self.at) < 2:
            return float("nan")
        away = self.at - np.average(self.at, weights=self.points)
        return float((self.points * away) @ self.middle / ((self.points * away) @ away))

    @property
    def spread(self) -> float:
        """Standard deviation of the classes' medians, weighted by their points, dB."""
        if len(self.at) == 0:
            return float("nan")
        away = self.middle - np.average(self.middle, weights=self.points)
        return float(np.sqrt(np.average(away**2, weights=self.points)))


def class_means(at: Float, level: Float) -> ClassMeans:
    """Course of intensity (n,), dB, over range, m, or incidence, degrees; NaNs are left out."""
    known = np.isfinite(at) & np.isfinite(level)
    at, level = at[known], level[known]
    none = ClassMeans(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, np.int64))
    if len(at) < FEWEST:
        return none
    first, last = np.quantile(at, ENDS)
    if last <= first:
        return none
    edges = np.linspace(first, last, CLASSES + 1)
    number = np.searchsorted(edges, at, side="right") - 1
    rows = []
    for k, values in _by_class(number, level):
        if 0 <= k < CLASSES and len(values) >= FEWEST:
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
    """Courses over range and incidence, before and after correction.

    Attributes
    ----------
    raw_range, raw_incidence : ClassMeans
        Of intensity as measured.
    range, incidence : ClassMeans
        Of corrected intensity.
    scatter : float
        Half the distance between the quartiles of corrected intensity as a standard deviation, dB.
    """

    raw_range: ClassMeans
    raw_incidence: ClassMeans
    range: ClassMeans
    incidence: ClassMeans
    scatter: float

    @classmethod
    def of(cls, range_m: Float, angle: Float, raw: Float, corrected: Float) -> Dependence:
        """Look at points (n,): range, m, incidence, degrees, raw and corrected intensity, dB."""
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
        """Lines of a table: over what, slopes before and after, deviations of the medians before and after."""
        lines = []
        for name, unit, before, after, by in (
            ("range", "dB/m", self.raw_range, self.range, 1.0),
            ("incidence", f"dB/{STEEP:g}°", self.raw_incidence, self.incidence, STEEP),
        ):
            line = [name]
            line += [f"{by * c.slope:+.3f} {unit}" if len(c.at) > 1 else "" for c in (before, after)]
            line += [f"{c.spread:.2f} dB" if len(c.at) else "" for c in (before, after)]
            lines.append(line)
        return lines

    def verdict(self) -> str:
        """One line that says what of the dependence is left."""
        if not len(self.range.at):
            return "Intensity could not be corrected."
        parts = [("range", self.range.spread), ("incidence", self.incidence.spread)]
        left = [f"{name} (medians differ by {spread:.2f} dB)" for name, spread in parts if spread > NOTICEABLE]
        if left and max(spread for _, spread in parts) < SMALL * self.scatter:
            return (
                f"Good enough for detection: corrected intensity still depends on {' and '.join(left)}, but that is less than a"
                f" third of what lining scatters by anyway, {self.scatter:.2f} dB."
            )
        if left:
            return f"Corrected intensity still depends on {' and '.join(left)}; lining scatters by {self.scatter:.2f} dB."
        return (
            f"Corrected intensity depends neither on range nor on incidence: medians differ by {parts[0][1]:.2f} and"
            f" {parts[1][1]:.2f} dB, under {NOTICEABLE:g} dB; lining scatters by {self.scatter:.2f} dB."
        )
