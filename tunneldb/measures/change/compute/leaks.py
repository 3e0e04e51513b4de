"""What became of leaks between two surveys: groups of those that touch each other, and the change of their wet area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry import Polygon

TOUCH = 0.1
"""Leaks so near to each other are of one place, m: what two registrations, and a shift along the lining that the shape does
not show, may be off."""

SEEN = 0.5
"""A place of which a survey saw less is not told: neither new nor dry."""

NAMED = 0.5
"""Of a leak so much must be a joint or a dark spot in the other survey, for it to be of another kind there."""

EDGE = 4.0
"""Width of the edge of a leak in the image, in pixels: with half of it, two of 15 leaks that had not changed between two scans
would be said to have shrunk (docs/figures.md)."""

CONFIDENT = 1.96
"""Standard deviations within which 95 % of normal errors lie."""

LEAST_CONTRAST = 3.0
"""Of a leak, in standard deviations of dry lining, where none is stored: the threshold of detection."""


@dataclass(frozen=True)
class Leak:
    """A finding of one survey: its outline is in the unrolled plane of the older one."""

    id: int
    kind: str
    wet: bool
    area: float
    contrast: float | None
    outline: Polygon


@dataclass(frozen=True)
class Group:
    """Findings of both surveys in one place."""

    old: Sequence[Leak]
    new: Sequence[Leak]

    @property
    def outline(self) -> shapely.Geometry:
        """What is wet in either, or where it is."""
        return shapely.union_all([leak.outline for leak in (*self.old, *self.new)])

    @property
    def wet(self) -> bool:
        """Whether one of them is a leak."""
        return any(leak.wet for leak in (*self.old, *self.new))


def groups(old: Sequence[Leak], new: Sequence[Leak]) -> list[Group]:
    """Groups of findings that touch, from one survey to the other; a leak that fell apart and its parts are one."""
    count = len(old) + len(new)
    if not count:
        return []
    tree = shapely.STRtree([leak.outline for leak in new])
    first, second = tree.query(np.array([leak.outline for leak in old], object), predicate="dwithin", distance=TOUCH)
    links = coo_array((np.ones(len(first), np.int8), (first, second + len(old))), shape=(count, count))
    number, member = connected_components(links, directed=False)
    found: list[tuple[list[Leak], list[Leak]]] = [([], []) for _ in range(number)]
    for k, leak in enumerate((*old, *new)):
        found[member[k]][0 if k < len(old) else 1].append(leak)
    return [Group(*pair) for pair in found]


def wet_area(leaks: Sequence[Leak], pixel: float) -> tuple[float, float]:
    """Wet area, and its standard error by resolution and threshold, m².

    Resolution: each of the P / p pixels that the outline passes is wet by a share that is not known, with standard deviation
    p² / √12; together p √(P p / 12). Threshold: one standard deviation of dry lining more or less moves the whole outline by
    the width of its edge over the leak's contrast, P · 4 p / c. P perimeter, p pixel, c contrast.
    """
    area = variance = 0.0
    for leak in leaks:
        if leak.wet:
            length = leak.outline.length
            contrast = max(leak.contrast or LEAST_CONTRAST, 1.0)
            area += leak.area
            variance += length * pixel**3 / 12.0 + (length * EDGE * pixel / contrast) ** 2
    return area, float(np.sqrt(variance))


def state_of(group: Group, old: tuple[float, float], new: tuple[float, float], seen_old: float, seen_new: float) -> str:
    """What became of a group: new, grown, shrunk, same, dry, kind or unseen.

    Parameters
    ----------
    group : Group
        One of which is wet.
    old, new : (float, float)
        Wet area and its standard error, m².
    seen_old, seen_new : float
        Share of the place that each survey saw. Water in what one of them did not see may have been there: it must be grown, or
        shrunk, by more than that.
    """
    was, now = (any(leak.wet for leak in leaks) for leaks in (group.old, group.new))
    if was and now:
        change = new[0] - old[0]
        doubt = CONFIDENT * float(np.hypot(old[1], new[1]))
        if abs(change) <= doubt:
            return "same"
        hidden = float(group.outline.area) * (1.0 - (seen_old if change > 0.0 else seen_new))
        return "unseen" if abs(change) <= doubt + hidden else "grown" if change > 0.0 else "shrunk"
    if (seen_new if was else seen_old) < SEEN:
        return "unseen"
    if _named_otherwise(group, was):
        return "kind"
    return "dry" if was else "new"


def _named_otherwise(group: Group, was: bool) -> bool:
    """Whether half of what is wet in one survey is something else in the other: a dark spot beside it says nothing on it."""
    there, beside = (group.old, group.new) if was else (group.new, group.old)
    wet = shapely.union_all([leak.outline for leak in there if leak.wet])
    other = shapely.union_all([leak.outline for leak in beside])
    return bool(shapely.intersection(wet, other).area >= NAMED * wet.area)
