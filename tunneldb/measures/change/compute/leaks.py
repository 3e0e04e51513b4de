"""Change of leaks between two surveys: groups of leaks that touch, and the change of their wet area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry import Polygon

TOUCH = 0.1
"""Maximum distance of leaks in one place, m: the error of two registrations, and of a shift along the lining that the shape
does not show."""

SEEN = 0.5
"""Minimum inspected share of a place for it to be called new or dry."""

NAMED = 0.5
"""Minimum share of a leak that must be a joint or a dry dark area in the other survey for it to be of another kind there."""

EDGE = 4.0
"""Width of the edge of a leak in the image, in pixels: with half of it, two of 15 unchanged leaks between two scans would be
reported as shrunk (docs/figures.md)."""

CONFIDENT = 1.96
"""Standard deviations that include 95 % of normal errors."""

MIN_CONTRAST = 3.0
"""Contrast of a leak, in standard deviations of dry lining, if none is stored: the threshold of detection."""


@dataclass(frozen=True)
class Leak:
    """Finding of one survey, with its outline in the unrolled plane of the older one."""

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
        """Union of the wet areas, or of all findings."""
        return shapely.union_all([leak.outline for leak in (*self.old, *self.new)])

    @property
    def wet(self) -> bool:
        """True if one of them is a leak."""
        return any(leak.wet for leak in (*self.old, *self.new))


def groups(old: Sequence[Leak], new: Sequence[Leak]) -> list[Group]:
    """Group findings that touch, across both surveys; a leak and the parts it split into form one group."""
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
    """Return the wet area, and its standard error from resolution and threshold, m².

    Resolution: each of the P / p pixels on the outline is wet by an unknown share, with standard deviation p² / √12; together p
    √(P p / 12). Threshold: one standard deviation of dry lining more or less moves the whole outline by the width of its edge
    over the leak's contrast, P · 4 p / c. P perimeter, p pixel, c contrast.
    """
    area = variance = 0.0
    for leak in leaks:
        if leak.wet:
            length = leak.outline.length
            contrast = max(leak.contrast or MIN_CONTRAST, 1.0)
            area += leak.area
            variance += length * pixel**3 / 12.0 + (length * EDGE * pixel / contrast) ** 2
    return area, float(np.sqrt(variance))


def state_of(group: Group, old: tuple[float, float], new: tuple[float, float], seen_old: float, seen_new: float) -> str:
    """Return the state of a group: new, grown, shrunk, same, dry, kind or unseen.

    Parameters
    ----------
    group : Group
        Group with at least one leak.
    old, new : (float, float)
        Wet area and its standard error, m².
    seen_old, seen_new : float
        Share of the place that each survey inspected. The part that one of them did not inspect may have been wet: a change
        must exceed that.
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
    """Return True if half of the wet area of one survey is another kind in the other."""
    there, beside = (group.old, group.new) if was else (group.new, group.old)
    wet = shapely.union_all([leak.outline for leak in there if leak.wet])
    other = shapely.union_all([leak.outline for leak in beside])
    return bool(shapely.intersection(wet, other).area >= NAMED * wet.area)
