"""Distance of what stands in a tunnel from the outline that is to be clear, by metre and by clock; what stands inside."""

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
"""Cells by clock, of 5°, from straight above the outline's middle to the right."""

NEAR = 0.5
"""Points nearer to the outline are held to be real only in a group, m."""

PIECE = 10.0
"""Infringements longer than that are kept in pieces, m, at whole multiples."""

TRACK = (PointClass.GROUND, PointClass.RAIL)
PASSING = (PointClass.OBJECT, PointClass.SPHERE)
"""What may be gone tomorrow, people and vehicles among them: its infringements are stated, and do not count."""


@dataclass(frozen=True)
class Grouping:
    """When points are held to be real: so many within a radius, m; lengths along are shrunk first (Spacing.shrink)."""

    points: int = 3
    radius: float = 0.3
    shrink: float = 1.0


@dataclass(frozen=True)
class Section:
    """A metre of a track held against the outline; lengths in m.

    Attributes
    ----------
    chainage : float
        Of its beginning.
    margin : float
        Least distance, positive outside of the outline, NaN where nothing counts.
    index : int
        Which point that is, -1 for none.
    clock : float
        Direction of that point, degrees from straight above to the right.
    margins : (72,) float array
        Least distance by direction, NaN where nothing that counts was seen.
    seen : float
        Share of the directions with a return of anything, ground and rails too.
    points, inside, stray, passing, ground : int
        Points that count; of them inside; and inside, but without company, passing, ground or rail.
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
    """A group of points of one class inside the outline: which points (k,), deepest first, and how deep the first is, m."""

    points: Int64
    klass: int
    depth: float


@dataclass(frozen=True)
class Clearance:
    """Sections in order, and what stands inside."""

    sections: list[Section]
    infringements: list[Infringement]
    margin: Float


def clearance(
    places: Float, classes: UInt8, begins: Float, outlines: Sequence[Outline], grouping: Grouping | None = None
) -> Clearance:
    """Hold points against an outline.

    Parameters
    ----------
    places : (n, 3) float array
        Chainage, right of the track's middle and above its running surface, m; NaN where there is no track.
    classes : (n,) uint8 array
    begins : (s,) float array
        Chainage at which sections begin, growing, m.
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
        held = order[first:stop]
        held = held[np.isfinite(places[held, 1])]
        margin[held] = -signed_distance(outline, places[held, 1:])
        bounds.append(held)
    real, infringements = _groups(places, classes, margin, grouping)
    sections = [
        _section(begin, _middle(outline), held, places, classes, margin, real)
        for begin, outline, held in zip(begins.tolist(), outlines, bounds, strict=True)
    ]
    return Clearance(sections, infringements, margin)


def clock(places: Float, middle: Float) -> Float:
    """Direction of places (n, 2) from the middle of an outline, degrees from straight above to the right, 0 to 360."""
    return np.asarray(np.degrees(np.arctan2(places[:, 0] - middle[0], places[:, 1] - middle[1])) % 360.0)


def _middle(outline: Outline) -> Float:
    ends = outline.elements[:, :2]
    return np.asarray((ends.min(axis=0) + ends.max(axis=0)) / 2.0)


def _groups(places: Float, classes: UInt8, margin: Float, grouping: Grouping) -> tuple[Bool, list[Infringement]]:
    """Which points are held to be real, and the groups of those inside."""
    real = np.isin(classes, [*TRACK, PointClass.NOISE], invert=True) & np.isfinite(margin)
    # The lining was told by the surface that its points make; alone is only what stands off it, or in.
    doubted = np.flatnonzero(real & (margin < NEAR) & ((classes != PointClass.LINING) | (margin < 0.0)))
    scaled = places[doubted] * np.array([grouping.shrink, 1.0, 1.0])
    labels = dbscan(scaled, grouping.radius, grouping.points)
    real[doubted[labels < 0]] = False
    within = (labels >= 0) & (margin[doubted] < 0.0)
    inside, labels = doubted[within], labels[within]
    piece = np.floor(places[inside, 0] / PIECE).astype(np.int64)
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
    begin: float, middle: Float, held: Int64, places: Float, classes: UInt8, margin: Float, real: Bool
) -> Section:  # fmt: skip
    at = clock(places[held, 1:], middle)
    cell = np.minimum((at / (360.0 / DIRECTIONS)).astype(np.int64), DIRECTIONS - 1)
    seen = len(np.unique(cell[classes[held] != PointClass.NOISE])) / DIRECTIONS
    within = margin[held] < 0.0
    passing = np.isin(classes[held], PASSING)
    ground = np.isin(classes[held], TRACK)
    counts = real[held] & ~passing
    margins = np.full(DIRECTIONS, np.inf)
    np.minimum.at(margins, cell[counts], margin[held][counts])
    margins[np.isinf(margins)] = np.nan
    k = int(np.argmin(np.where(counts, margin[held], np.inf))) if counts.any() else -1
    return Section(
        begin, float(margin[held[k]]) if k >= 0 else np.nan, int(held[k]) if k >= 0 else -1,
        float(at[k]) if k >= 0 else np.nan, margins, seen, int(counts.sum()), int((within & counts).sum()),
        int((within & ~real[held] & ~ground).sum()), int((within & real[held] & passing).sum()), int((within & ground).sum()),
    )  # fmt: skip
