"""Clearance around a track: distance of points from an outline by metre and direction, and infringements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int64, UInt8
from tunneldb.classification.classes import PointClass
from tunneldb.classification.objects.dbscan import dbscan
from tunneldb.shape.outline import Outline
from tunneldb.shape.profile import signed_distance

STEP = 1.0
"""Length of a section, m; sections begin at whole metres."""

DIRECTIONS = 72
"""Number of direction cells, of 5° each, clockwise from straight above the outline's middle."""

ISOLATION_DISTANCE = 0.5
"""Distance from the outline within which isolated points are ignored, m."""

MAX_INFRINGEMENT_LENGTH = 10.0
"""Maximum length of an infringement, m; longer ones are split at whole multiples."""

TRACK_CLASSES = (PointClass.GROUND, PointClass.RAIL)
TEMPORARY_CLASSES = (PointClass.OBJECT, PointClass.SPHERE)
"""Classes that may be temporary, such as people and vehicles: their infringements are reported, but do not count."""


@dataclass(frozen=True)
class Grouping:
    """Minimum number of neighbours within a radius, m, for a real point; lengths along are shrunk first (Spacing.shrink)."""

    points: int = 3
    radius: float = 0.3
    shrink: float = 1.0


@dataclass(frozen=True)
class Section:
    """Clearance of one metre of a track; lengths in m.

    Attributes
    ----------
    chainage : float
        Chainage of its beginning.
    margin : float
        Least distance, positive outside the outline; NaN if no point counts.
    index : int
        Index of the nearest point, -1 if none.
    clock : float
        Direction of that point, degrees from straight above to the right.
    margins : (72,) float array
        Least distance by direction; NaN where no point that counts was seen.
    seen : float
        Share of directions with a return of any class, ground and rails included.
    points, inside, stray, passing, ground : int
        Numbers of points that count; of these inside; and inside but isolated, temporary, or ground or rail.
    """

    chainage: float
    margin: float
    index: int
    clock: float
    margins: Float
    seen: float
    points: int
    inside: int
    stray: int
    passing: int
    ground: int


@dataclass(frozen=True)
class Infringement:
    """Group of points of one class inside the outline: indices (k,), deepest first, and the greatest depth, m."""

    points: Int64
    klass: int
    depth: float


@dataclass(frozen=True)
class Clearance:
    """Sections in order, and infringements."""

    sections: list[Section]
    infringements: list[Infringement]
    margin: Float


def clearance(
    places: Float, classes: UInt8, begins: Float, outlines: Sequence[Outline], grouping: Grouping | None = None
) -> Clearance:
    """Compare points with an outline.

    Parameters
    ----------
    places : (n, 3) float array
        Chainage, right of the track's middle and above its running surface, m; NaN without a track.
    classes : (n,) uint8 array
    begins : (s,) float array
        Chainage at which each section begins, increasing, m.
    outlines : sequence of s Outline
        In the track's frame, closed.
    grouping : Grouping, optional
    """
    grouping = grouping or Grouping()
    margin = np.full(len(places), np.nan)
    bounds: list[Int64] = []
    order = np.argsort(places[:, 0], kind="stable")
    growing = places[order, 0]
    for begin, outline in zip(begins.tolist(), outlines, strict=True):
        first, stop = np.searchsorted(growing, [begin, begin + STEP])
        valid = order[first:stop]
        valid = valid[np.isfinite(places[valid, 1])]
        margin[valid] = -signed_distance(outline, places[valid, 1:])
        bounds.append(valid)
    real, infringements = _groups(places, classes, margin, grouping)
    sections = [
        _section(begin, _middle(outline), valid, places, classes, margin, real)
        for begin, outline, valid in zip(begins.tolist(), outlines, bounds, strict=True)
    ]
    return Clearance(sections, infringements, margin)


def clock(places: Float, middle: Float) -> Float:
    """Return the direction of places (n, 2) from an outline's middle, degrees clockwise from straight above, 0 to 360."""
    return np.asarray(np.degrees(np.arctan2(places[:, 0] - middle[0], places[:, 1] - middle[1])) % 360.0)


def _middle(outline: Outline) -> Float:
    ends = outline.elements[:, :2]
    return np.asarray((ends.min(axis=0) + ends.max(axis=0)) / 2.0)


def _groups(places: Float, classes: UInt8, margin: Float, grouping: Grouping) -> tuple[Bool, list[Infringement]]:
    """Return which points are real, and the groups of those inside."""
    real = np.isin(classes, [*TRACK_CLASSES, PointClass.NOISE], invert=True) & np.isfinite(margin)
    # The lining is classified by the surface that its points form; only points off that surface can be isolated.
    doubted = np.flatnonzero(real & (margin < ISOLATION_DISTANCE) & ((classes != PointClass.LINING) | (margin < 0.0)))
    scaled = places[doubted] * np.array([grouping.shrink, 1.0, 1.0])
    labels = dbscan(scaled, grouping.radius, grouping.points)
    real[doubted[labels < 0]] = False
    within = (labels >= 0) & (margin[doubted] < 0.0)
    inside, labels = doubted[within], labels[within]
    piece = np.floor(places[inside, 0] / MAX_INFRINGEMENT_LENGTH).astype(np.int64)
    key = np.column_stack([labels, piece, classes[inside].astype(np.int64)])
    _, number = np.unique(key, axis=0, return_inverse=True)
    found = []
    for k in range(int(number.max(initial=-1)) + 1):
        part = inside[number == k]
        part = part[np.argsort(margin[part], kind="stable")]
        found.append(Infringement(part, int(classes[part[0]]), -float(margin[part[0]])))
    found.sort(key=lambda one: float(places[one.points[0], 0]))
    return real, found


def _section(
    begin: float, middle: Float, chosen: Int64, places: Float, classes: UInt8, margin: Float, real: Bool
) -> Section:  # fmt: skip
    at = clock(places[chosen, 1:], middle)
    cell = np.minimum((at / (360.0 / DIRECTIONS)).astype(np.int64), DIRECTIONS - 1)
    seen = len(np.unique(cell[classes[chosen] != PointClass.NOISE])) / DIRECTIONS
    within = margin[chosen] < 0.0
    passing = np.isin(classes[chosen], TEMPORARY_CLASSES)
    ground = np.isin(classes[chosen], TRACK_CLASSES)
    counts = real[chosen] & ~passing
    margins = np.full(DIRECTIONS, np.inf)
    np.minimum.at(margins, cell[counts], margin[chosen][counts])
    margins[np.isinf(margins)] = np.nan
    k = int(np.argmin(np.where(counts, margin[chosen], np.inf))) if counts.any() else -1
    return Section(
        begin, float(margin[chosen[k]]) if k >= 0 else np.nan, int(chosen[k]) if k >= 0 else -1,
        float(at[k]) if k >= 0 else np.nan, margins, seen, int(counts.sum()), int((within & counts).sum()),
        int((within & ~real[chosen] & ~ground).sum()), int((within & real[chosen] & passing).sum()),
        int((within & ground).sum()),
    )  # fmt: skip
