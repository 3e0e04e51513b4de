"""What detection is worth on scenes: by leak, by area, by phenomenon, and whether its probabilities are true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from benchmarks.blind.run import Outcome
from tunneldb.evaluate.measure import HALF, Comparison, compare, figures

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
    """An outcome, and what is found held against what is true."""

    outcome: Outcome
    comparison: Comparison


def hold(outcome: Outcome) -> Scored:
    """Hold what was taken for leaks against the truth; leaks that can't be told are neither demanded nor do they harm."""
    asked = np.array([not limit for limit in outcome.limits], np.bool_)
    shapes = [outcome.found[k] for k in outcome.leaks]
    comparison = compare(outcome.true, shapes, SMALLEST, asked=asked if len(asked) else None)
    return Scored(outcome, comparison)


def row(scored: Sequence[Scored]) -> dict[str, float]:
    """Figures of several scenes together."""
    parts = [figures(one.comparison, one.outcome.seen) for one in scored]
    true, found = sum(p.true for p in parts), sum(p.found for p in parts)
    called, right = sum(p.called for p in parts), sum(p.right for p in parts)
    true_area, found_area = sum(p.true_area for p in parts), sum(p.found_area for p in parts)
    shared = sum(_shared(one.comparison) for one in scored)
    errors = [e for one in scored for e in one.comparison.area_error[one.comparison.true_group >= 0]]
    edges = np.concatenate([d for one in scored for d in one.comparison.edges] or [np.empty(0)])
    hit = sum(len(np.unique(one.comparison.true_group[one.comparison.true_group >= 0])) for one in scored)
    pieces = sum(int((one.comparison.found_group >= 0).sum()) for one in scored)
    false = sum(_false(one) for one in scored)
    return {
        "scenes": len(scored),
        "true": true, "found": found, "called": called, "right": right, "false": false,
        "leak_f1": _f1(found, true, right, called),
        "area_recall": _ratio(shared, true_area), "area_precision": _ratio(shared, found_area),
        "area_f1": _f1(shared, true_area, shared, found_area),
        "area_p95": float(np.quantile(errors, 0.95)) if errors else np.nan,
        "edge_p95": float(np.quantile(edges, 0.95)) if len(edges) else np.nan,
        "pieces": _ratio(pieces, hit),
        "false_per_1000": 1000.0 * _ratio(false, sum(one.outcome.seen for one in scored)),
        "limits": sum(bool(limit) for one in scored for limit in one.outcome.limits),
    }  # fmt: skip


def by_phenomenon(scored: Sequence[Scored]) -> dict[str, tuple[int, int, float]]:
    """Of each phenomenon of true leaks: how many, how many were found, and the share of their area that was."""
    rows: dict[str, list[tuple[float, float]]] = {}
    for one in scored:
        c = one.comparison
        for k, covered, area in zip(c.true, c.covered, c.true_area, strict=True):
            rows.setdefault(one.outcome.phenomena[k], []).append((covered, area))
    out = {}
    for name in sorted(rows):
        covered, area = np.array(rows[name]).T
        out[name] = (len(area), int((covered >= HALF).sum()), float((covered * area).sum() / area.sum()))
    return out


def reliability(scored: Sequence[Scored]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Classes of probability: how many anomalies, their mean probability, and the share of them that are leaks."""
    p, leak = labelled(scored)
    place = np.clip(np.digitize(p, BINS) - 1, 0, len(BINS) - 2)
    count = np.bincount(place, minlength=len(BINS) - 1)
    held = np.maximum(count, 1)
    return count, np.bincount(place, p, len(BINS) - 1) / held, np.bincount(place, leak, len(BINS) - 1) / held


def calibration_error(scored: Sequence[Scored]) -> float:
    """Mean distance of stated probability and share of leaks over the classes, by their number (Naeini et al., 2015: ECE)."""
    count, stated, true = reliability(scored)
    return float((count * np.abs(stated - true)).sum() / max(count.sum(), 1))


def labelled(scored: Sequence[Scored]) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each anomaly of the smallest size and more, and whether at least half of it is wet.

    Those that lie on leaks which can't be told are left out.
    """
    p, leak = [], []
    for one in scored:
        wet = shapely.union_all(one.outcome.true)
        dim = shapely.union_all([t for t, limit in zip(one.outcome.true, one.outcome.limits, strict=True) if limit])
        for shape, probability in zip(one.outcome.found, one.outcome.probabilities, strict=True):
            if shape.area < LEAST or shape.intersection(dim).area >= HALF * shape.area:
                continue
            p.append(probability)
            leak.append(shape.intersection(wet).area >= HALF * shape.area)
    return np.array(p), np.array(leak, np.float64)


def review(scored: Sequence[Scored]) -> float:
    """Leaks to look at for each true one, in order of probability, until nine of ten of those found are seen."""
    p, leak = labelled(scored)
    if not leak.any():
        return np.nan
    seen = np.cumsum(leak[np.argsort(-p, kind="stable")])
    return float((np.searchsorted(seen, 0.9 * seen[-1]) + 1) / (0.9 * seen[-1]))


def _false(one: Scored) -> int:
    """Leaks called at SURE and more that touch no true one."""
    leaks = np.array(one.outcome.leaks, np.int64)
    c = one.comparison
    p = np.array(one.outcome.probabilities)[leaks[c.found]] if len(c.found) else np.empty(0)
    sizes = (
        shapely.area(np.array([one.outcome.found[k] for k in leaks[c.found]], dtype=object)) if len(c.found) else np.empty(0)
    )
    return int(((c.found_group < 0) & (p >= SURE) & (sizes >= LEAST)).sum())


def _shared(c: Comparison) -> float:
    return float(shapely.area(shapely.intersection(shapely.union_all(c.true_shape), shapely.union_all(c.found_shape))))


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole else np.nan


def _f1(hit: float, wanted: float, right: float, given: float) -> float:
    """F1; NaN where nothing is wanted and nothing is given."""
    if not wanted and not given:
        return np.nan
    recall, precision = hit / wanted if wanted else 0.0, right / given if given else 0.0
    return 2.0 * recall * precision / (recall + precision) if recall + precision else 0.0
