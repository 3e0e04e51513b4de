"""Closed formulas of the scoring: intervals of shares, what a review sees in order of probability, and tables of classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Z = 1.959963984540054
"""97.5 % quantile of the normal distribution: intervals hold the true share in 95 of 100 cases."""

CLASSES = 4
"""Classes of waterproofing; the first is the driest."""

Array = NDArray[np.float64]


def wilson(hits: ArrayLike, count: ArrayLike) -> tuple[Array, Array]:
    """Interval of 95 % of shares (Wilson, 1927, J. Am. Stat. Assoc. 22, 209–212), for trials that know nothing of each other.

    Parameters
    ----------
    hits, count : (n,) arrays
        How many of how many.

    Returns
    -------
    low, high : (n,) float arrays
        0 to 1; 0 and 1 where nothing was counted.
    """
    hits, count = np.asarray(hits, np.float64), np.asarray(count, np.float64)
    middle = (hits + Z**2 / 2) / (count + Z**2)
    half = Z / (count + Z**2) * np.sqrt(hits * (count - hits) / np.maximum(count, 1.0) + Z**2 / 4)
    # At no hit and at nothing but hits an end is 0 or 1, which rounding misses.
    return np.where(hits == 0.0, 0.0, middle - half), np.where(hits == count, 1.0, middle + half)


def ranks(probabilities: Array, shows: Sequence[Sequence[int]], true: int) -> Array:
    """Find which look shows each true leak first, if one looks at what was found in order of probability.

    Parameters
    ----------
    probabilities : (n,) float array
    shows : n sequences of int
        Numbers of the true leaks that one sees who looks at each.
    true : int
        How many true leaks there are.

    Returns
    -------
    (true,) float array
        From 1 on; infinite for leaks that no look shows.
    """
    out = np.full(true, np.inf)
    for look, k in enumerate(np.argsort(-np.asarray(probabilities, np.float64), kind="stable"), 1):
        for number in shows[k]:
            out[number] = min(out[number], look)
    return out


def review_curve(first: Array, looks: Sequence[float]) -> list[float]:
    """Share of the true leaks, whose ranks are given, that is seen after so many looks for each of them; NaN without leaks."""
    return [float((first <= round(times * len(first))).mean()) if len(first) else np.nan for times in looks]


def looks_for_each(first: Array, share: float) -> float:
    """Looks for each true leak seen, until such a share of those that can be seen at all is; NaN if none can."""
    seen = np.sort(first[np.isfinite(first)])
    needed = int(np.ceil(share * len(seen) - 1e-9))
    return float(seen[needed - 1] / needed) if needed else np.nan


@dataclass(frozen=True)
class Agreement:
    """How classes that came out stand to the true ones.

    Attributes
    ----------
    table : (4, 4) int array
        How many there are of each true class (rows) and each that came out (columns).
    unknown : int
        How many have no class, true or found; they are not in the table.
    right, near, lenient, strict : int
        The same class; one class off, to either side; too good a class; too bad a one.
    """

    table: NDArray[np.int64]
    unknown: int
    right: int
    near: int
    lenient: int
    strict: int


def compare_classes(true: Sequence[int | None], found: Sequence[int | None]) -> Agreement:
    """Hold classes that came out against true ones, place by place."""
    table = np.zeros((CLASSES, CLASSES), np.int64)
    known = [(a, b) for a, b in zip(true, found, strict=True) if a is not None and b is not None]
    for a, b in known:
        table[a - 1, b - 1] += 1
    return Agreement(
        table,
        len(true) - len(known),
        int(np.trace(table)),
        int(np.trace(table, 1) + np.trace(table, -1)),
        int(np.tril(table, -1).sum()),
        int(np.triu(table, 1).sum()),
    )
