"""What detection is worth on scenes: by leak, by area, by phenomenon, and whether its probabilities are true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import affinity

from benchmarks.blind.run import Outcome
from benchmarks.blind.statistics import Agreement, compare_classes, looks_for_each, ranks, review_curve, wilson
from tunneldb.evaluate.measure import MIN_OVERLAP, Comparison, Figures, compare, figures
from tunneldb.geometry.stationing import KILOMETRE

SMALLEST = 0.1
"""Leaks are demanded from this size on, m²."""

LEAST = 0.05
"""What is called a leak and touches none counts as false from this size on, m²: `leak.min_area`."""

SURE = 0.5
"""Probability from which a leak is called."""

BINS = np.linspace(0.0, 1.0, 11)
"""Limits of the classes of a reliability diagram."""

SIZES = (0.0, SMALLEST, 0.3, 1.0, np.inf)
"""Limits of the classes of size, m²."""

DROPS = (-np.inf, 1.5, 3.0, 6.0, np.inf)
"""Limits of the classes of drop below dry lining, dB."""

LOOKS = (1.0, 1.5, 2.0, 3.0)
"""So many looks for each true leak a review may take: points of its curve."""

MOST = 0.9
"""Share of the true leaks which can be seen at all until which a review goes on."""


@dataclass(frozen=True)
class Scored:
    """Outcomes, laid one behind the other, and what is found held against what is true.

    Attributes
    ----------
    outcomes : sequence of Outcome
    comparison : Comparison
        Of leaks that are demanded and what was taken for leaks.
    phenomena : list of str
        Of each true leak, demanded or not.
    drops : (n,) float array
        Of each true leak, demanded or not, dB.
    small, limited : int
        True leaks that are not demanded: those that could be told, but are smaller than SMALLEST; and those of any size that
        can't be told.
    """

    outcomes: Sequence[Outcome]
    comparison: Comparison
    phenomena: list[str]
    drops: np.ndarray
    small: int
    limited: int


@dataclass(frozen=True)
class Reliability:
    """Classes of stated probability.

    Attributes
    ----------
    count : (n,) int array
        How many anomalies there are in each.
    stated : (n,) float array
        Their mean probability.
    true : (n,) float array
        Share of them that are leaks.
    low, high : (n,) float arrays
        Wilson's interval of it, as if anomalies knew nothing of each other.
    """

    count: np.ndarray
    stated: np.ndarray
    true: np.ndarray
    low: np.ndarray
    high: np.ndarray


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
    drops = np.array([drop for one in outcomes for drop in one.drops], np.float64)
    small = int((asked & (shapely.area(true) < SMALLEST)).sum())
    return Scored(outcomes, compare(true, found, SMALLEST, asked=asked), phenomena, drops, small, int((~asked).sum()))


def row(scored: Scored) -> dict[str, float]:
    """Figures of all scenes together: those of `figures`, and how often a leak was called, and false ones from LEAST on.

    Precision by leak leaves out false ones smaller than SMALLEST, as true ones are; `strict_precision` and `strict_f1` don't.
    """
    c, seen = scored.comparison, sum(one.seen for one in scored.outcomes)
    hit = len(np.unique(c.true_group[c.true_group >= 0]))
    areas = [area for one in scored.outcomes for area in _false(one)]
    false, small = len(areas), sum(area < SMALLEST for area in areas)
    f = figures(c)
    precision = f.right / (f.called + small) if f.called + small else np.nan
    return {
        **asdict(f),
        "false": false,
        "false_small": small,
        "strict_precision": precision,
        "strict_f1": 2.0 * f.recall * precision / (f.recall + precision) if f.recall + precision > 0.0 else f.f1,
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
        out[name] = (int(own.sum()), int((c.covered[own] >= MIN_OVERLAP).sum()), float(share))
    return out


def by_size(scored: Scored) -> list[tuple[str, Figures]]:
    """Figures of each class of size; found leaks are of the class of their own size, and so are those that are wrong."""
    c, out = scored.comparison, []
    for low, high in pairwise(SIZES):
        true, found = ((areas >= low) & (areas < high) for areas in (c.true_area, c.found_area))
        if true.any() or found.any():
            out.append((_between(low, high, "m²"), figures(c, true=true, found=found)))
    return out


def by_drop(scored: Scored) -> list[tuple[str, Figures]]:
    """Figures of each class of drop; found leaks are of that of the darkest true one of their group, wrong ones of none."""
    c = scored.comparison
    drops = scored.drops[c.true]
    groups = np.full(int(max(c.true_group.max(initial=-1), c.found_group.max(initial=-1))) + 2, -np.inf)
    known = np.isfinite(drops)
    np.maximum.at(groups, c.true_group[known], drops[known])
    groups[-1] = np.nan
    theirs = groups[c.found_group]
    out = [
        (_between(low, high, "dB"), figures(c, true=(drops >= low) & (drops < high), found=(theirs >= low) & (theirs < high)))
        for low, high in pairwise(DROPS)
    ]
    if not known.all():
        out.append(("not known", figures(c, true=~known, found=np.zeros(len(c.found), np.bool_))))
    return [(name, f) for name, f in out if f.true or f.called]


def _between(low: float, high: float, unit: str) -> str:
    if low <= 0.0:
        return f"< {high:g} {unit}"
    return f"> {low:g} {unit}" if np.isinf(high) else f"{low:g} to {high:g} {unit}"


def waterproofing(outcomes: Sequence[Outcome], told: bool = False) -> tuple[Agreement, Agreement]:
    """Classes of waterproofing that came out against the true ones, of scenes and of stretches.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of one that was refused no class came out.
    told : bool
        Whether true leaks which can't be told are left out.
    """
    pairs = [(one.told_classes if told else one.true_classes, one.found_classes) for one in outcomes]
    scenes = [(true[0], found[0]) if true and found else (None, None) for true, found in pairs]
    stretches = [pair for true, found in pairs for pair in zip(true[1:], found[1:], strict=True)]
    return (
        compare_classes([true for true, _ in scenes], [found for _, found in scenes]),
        compare_classes([true for true, _ in stretches], [found for _, found in stretches]),
    )


def reliability(outcomes: Sequence[Outcome]) -> Reliability:
    """Sum up how often what is stated to be so probable is a leak."""
    p, leak = labelled(outcomes)
    place = np.clip(np.digitize(p, BINS) - 1, 0, len(BINS) - 2)
    count = np.bincount(place, minlength=len(BINS) - 1)
    held, hits = np.maximum(count, 1), np.bincount(place, leak, len(BINS) - 1)
    return Reliability(count, np.bincount(place, p, len(BINS) - 1) / held, hits / held, *wilson(hits, count))


def calibration_error(outcomes: Sequence[Outcome]) -> float:
    """Mean distance of stated probability and share of leaks over the classes, by their number (Naeini et al., 2015: ECE)."""
    r = reliability(outcomes)
    return float((r.count * np.abs(r.stated - r.true)).sum() / max(r.count.sum(), 1))


def labelled(outcomes: Sequence[Outcome]) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each anomaly of the smallest size and more, and whether at least half of it is wet.

    Those that lie on leaks which can't be told are left out.
    """
    p, leak = [], []
    for one in outcomes:
        wet = shapely.union_all(one.true)
        dim = shapely.union_all([shape for shape, limit in zip(one.true, one.limits, strict=True) if limit])
        for shape, probability in zip(one.found, one.probabilities, strict=True):
            if shape.area < LEAST or shape.intersection(dim).area >= MIN_OVERLAP * shape.area:
                continue
            p.append(probability)
            leak.append(shape.intersection(wet).area >= MIN_OVERLAP * shape.area)
    return np.array(p), np.array(leak, np.float64)


def review(outcomes: Sequence[Outcome]) -> tuple[float, list[float], float]:
    """What a review sees that looks at what was found, of whatever kind, in order of its probability.

    Looked at is what is no smaller than LEAST; who looks at it sees the true leaks that it shares an area with. What shows
    none that is demanded, and lies by half on others, is left out.

    Returns
    -------
    each : float
        Looks for each true leak seen, until MOST of those that can be seen at all are.
    shares : list of float
        Share of all true leaks seen after so many looks as LOOKS says for each of them.
    all : float
        Share of them seen after looking at everything.
    """
    p: list[float] = []
    shows: list[list[int]] = []
    true = 0
    for one in outcomes:
        asked = [shape.area >= SMALLEST and not limit for shape, limit in zip(one.true, one.limits, strict=True)]
        demanded = [shape for shape, wanted in zip(one.true, asked, strict=True) if wanted]
        others = shapely.union_all([shape for shape, wanted in zip(one.true, asked, strict=True) if not wanted])
        for shape, probability in zip(one.found, one.probabilities, strict=True):
            shared = np.flatnonzero(shapely.area(shapely.intersection(demanded, shape)) > 0.0) if demanded else np.empty(0, int)
            if shape.area < LEAST or (not len(shared) and shape.intersection(others).area >= MIN_OVERLAP * shape.area):
                continue
            p.append(probability)
            shows.append((true + shared).tolist())
        true += len(demanded)
    first = ranks(np.array(p), shows, true)
    return looks_for_each(first, MOST), review_curve(first, LOOKS), float(np.isfinite(first).mean()) if true else np.nan


def _false(one: Outcome) -> list[float]:
    """Areas of leaks called at SURE and more, from LEAST on, that touch no true one, m²."""
    wet = shapely.union_all(one.true)
    called = [one.found[k] for k in one.leaks if one.probabilities[k] >= SURE]
    return [shape.area for shape in called if shape.area >= LEAST and shape.intersection(wet).area == 0.0]
