"""What detection is worth on scenes: by leak, by area, by phenomenon, and whether its probabilities are true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import shapely
from shapely import affinity

from benchmarks.blind.run import Outcome
from tunneldb.evaluate.measure import HALF, Comparison, compare, figures
from tunneldb.geometry.stationing import KILOMETRE

SMALLEST = 0.1
"""Leaks are demanded from this size on, m²."""

LEAST = 0.05
"""What is called a leak and touches none counts as false from this size on, m²: `leak.min_area`."""

SURE = 0.5
"""Probability from which a leak is called."""

BINS = np.linspace(0.0, 1.0, 11)
"""Limits of the classes of a reliability diagram."""


@dataclass(frozen=True)
class Scored:
    """Outcomes, laid one behind the other, and what is found held against what is true."""

    outcomes: Sequence[Outcome]
    comparison: Comparison
    phenomena: list[str]
    """Of each true leak."""


def hold(outcomes: Sequence[Outcome]) -> Scored:
    """Hold what was taken for leaks against the truth; leaks that can't be told are neither demanded nor do they harm.

    Each scene is laid into a kilometre of its own, so that none touches another's leaks.
    """
    true, found = [], []
    for k, one in enumerate(outcomes):
        true += [affinity.translate(shape, k * KILOMETRE) for shape in one.true]
        found += [affinity.translate(one.found[n], k * KILOMETRE) for n in one.leaks]
    asked = np.array([not limit for one in outcomes for limit in one.limits], np.bool_)
    phenomena = [name for one in outcomes for name in one.phenomena]
    return Scored(outcomes, compare(true, found, SMALLEST, asked=asked), phenomena)


def row(scored: Scored) -> dict[str, float]:
    """Figures of all scenes together: those of `figures`, and how often a leak was called, and false ones from LEAST on."""
    c, seen = scored.comparison, sum(one.seen for one in scored.outcomes)
    hit = len(np.unique(c.true_group[c.true_group >= 0]))
    false = sum(_false(one) for one in scored.outcomes)
    return {
        **asdict(figures(c)),
        "false": false,
        "false_per_1000": 1000.0 * false / seen if seen else np.nan,
        "pieces": int((c.found_group >= 0).sum()) / hit if hit else np.nan,
    }


def by_phenomenon(scored: Scored) -> dict[str, tuple[int, int, float]]:
    """Of each phenomenon of true leaks: how many, how many were found, and the share of their area that was."""
    c = scored.comparison
    names = np.array([scored.phenomena[k] for k in c.true], dtype=object)
    out = {}
    for name in sorted(set(names)):
        own = names == name
        share = (c.covered[own] * c.true_area[own]).sum() / c.true_area[own].sum()
        out[name] = (int(own.sum()), int((c.covered[own] >= HALF).sum()), float(share))
    return out


def reliability(outcomes: Sequence[Outcome]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Classes of probability: how many anomalies, their mean probability, and the share of them that are leaks."""
    p, leak = labelled(outcomes)
    place = np.clip(np.digitize(p, BINS) - 1, 0, len(BINS) - 2)
    count = np.bincount(place, minlength=len(BINS) - 1)
    held = np.maximum(count, 1)
    return count, np.bincount(place, p, len(BINS) - 1) / held, np.bincount(place, leak, len(BINS) - 1) / held


def calibration_error(outcomes: Sequence[Outcome]) -> float:
    """Mean distance of stated probability and share of leaks over the classes, by their number (Naeini et al., 2015: ECE)."""
    count, stated, true = reliability(outcomes)
    return float((count * np.abs(stated - true)).sum() / max(count.sum(), 1))


def labelled(outcomes: Sequence[Outcome]) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each anomaly of the smallest size and more, and whether at least half of it is wet.

    Those that lie on leaks which can't be told are left out.
    """
    p, leak = [], []
    for one in outcomes:
        wet = shapely.union_all(one.true)
        dim = shapely.union_all([shape for shape, limit in zip(one.true, one.limits, strict=True) if limit])
        for shape, probability in zip(one.found, one.probabilities, strict=True):
            if shape.area < LEAST or shape.intersection(dim).area >= HALF * shape.area:
                continue
            p.append(probability)
            leak.append(shape.intersection(wet).area >= HALF * shape.area)
    return np.array(p), np.array(leak, np.float64)


def review(outcomes: Sequence[Outcome]) -> float:
    """Leaks to look at for each true one, in order of probability, until nine of ten of those found are seen."""
    p, leak = labelled(outcomes)
    if not leak.any():
        return np.nan
    seen = np.cumsum(leak[np.argsort(-p, kind="stable")])
    return float((np.searchsorted(seen, 0.9 * seen[-1]) + 1) / (0.9 * seen[-1]))


def _false(one: Outcome) -> int:
    """Leaks called at SURE and more, from LEAST on, that touch no true one."""
    wet = shapely.union_all(one.true)
    called = [one.found[k] for k in one.leaks if one.probabilities[k] >= SURE]
    return sum(shape.area >= LEAST and shape.intersection(wet).area == 0.0 for shape in called)
