"""Outlines of lines and arcs about the axis: length, enclosed area, and self-intersections."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from tunneldb.arrays import Float

TOLERANCE = 1e-6
"""Distance below which ends are one point, m."""

_CHORD_ERROR = 1e-4  # m, of the chords that are tested for crossings


@dataclass(frozen=True)
class Outline:
    """Lines and arcs, each beginning where the one before ends, clockwise when looking up-chainage.

    An open outline runs from the left foot over the crown to the right foot; inside is on its right-hand side.

    Attributes
    ----------
    elements : (m, 5) float array
        Begin and end, each right of the axis and above it, m, and the bulge: the tangent of a quarter of the arc's angle,
        0 for a line, negative where it bulges outwards (clockwise), as in DXF.
    """

    elements: Float

    @classmethod
    def of(cls, vertices: Float, bulges: Float, closed: bool) -> Outline:
        """Make an outline of vertices and of the bulges between them.

        Parameters
        ----------
        vertices : (n, 2) float array
            Right of the axis and above it, m, in either direction.
        bulges : (n,) float array
            Bulge of the element that begins at each vertex, positive counterclockwise; the last one is used only if closed.
        closed : bool
            True if the last vertex is joined to the first.

        Notes
        -----
        A closed outline begins straight below the axis, or else at its lowest vertex, so that places along outlines of
        different size correspond.
        """
        ends = np.roll(vertices, -1, axis=0)
        elements = np.column_stack([vertices, ends, bulges])[: None if closed else -1]
        if _turning_area(elements) > 0.0:
            elements = _reversed(elements)
        return cls(np.ascontiguousarray(_begun_below(elements) if closed else elements))

    @property
    def closed(self) -> bool:
        """True if it ends where it begins."""
        return bool(np.hypot(*(self.elements[-1, 2:4] - self.elements[0, :2])) < TOLERANCE)

    @cached_property
    def lengths(self) -> Float:
        """Length of each element, (m,), m."""
        return element_lengths(self.elements)

    @property
    def length(self) -> float:
        """Length, m."""
        return float(self.lengths.sum())

    @property
    def area(self) -> float:
        """Enclosed area, m²; for an open outline closed by the straight line from foot to foot."""
        return -_turning_area(self.elements)

    def places(self, share: Float) -> tuple[Float, Float]:
        """Return points and inward unit normals, both (n, 2), at shares (n,) of the length, 0 to 1."""
        ends = np.cumsum(self.lengths)
        along = np.clip(share, 0.0, 1.0) * ends[-1]
        k = np.minimum(np.searchsorted(ends, along, side="right"), len(ends) - 1)
        within = (along - (ends[k] - self.lengths[k])) / self.lengths[k]
        return _within(self.elements[k], within)

    def curvature(self, share: Float) -> Float:
        """Return the curvature at shares (n,) of the length, 1/m, positive where concave as seen from inside."""
        ends = np.cumsum(self.lengths)
        begin, end, bulge = self.elements[:, :2], self.elements[:, 2:4], self.elements[:, 4]
        each = -4.0 * bulge / (np.hypot(*(end - begin).T) * (1.0 + bulge**2))
        k = np.minimum(np.searchsorted(ends, share * ends[-1], side="right"), len(ends) - 1)
        return np.asarray(each[k])

    def flattened(self, chord_error: float = _CHORD_ERROR) -> Float:
        """Return vertices (n, 2) of chords that deviate from the arcs by no more than the error, m."""
        parts = []
        for element, length in zip(self.elements, self.lengths, strict=True):
            turn = 4.0 * abs(np.arctan(element[4]))
            radius = length / turn if turn > 0.0 else np.inf
            step = 2.0 * np.arccos(max(1.0 - chord_error / radius, 0.5)) if turn > 0.0 else 1.0
            count = max(int(np.ceil(turn / step)), 1)
            parts.append(_within(np.tile(element, (count, 1)), np.arange(count) / count)[0])
        return np.vstack([*parts, self.elements[-1:, 2:4]])

    def crossing(self) -> tuple[int, int] | None:
        """Return the numbers, from 0, of two elements that cross or touch other than end to end; None if there are none."""
        line = self.flattened()
        whole = shapely.LineString(line)
        if whole.is_simple:
            return None
        chords = [Outline(element[None]).flattened() for element in self.elements]
        lines = shapely.linestrings(np.vstack(chords), indices=np.repeat(np.arange(len(chords)), [len(c) for c in chords]))
        first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
        for a, b in sorted(zip(first.tolist(), second.tolist(), strict=True)):
            if a >= b:
                continue
            shared = [lines[a].boundary.intersection(lines[b].boundary)] if b == a + 1 or (a == 0 and self.closed) else []
            rest = lines[a].intersection(lines[b])
            for point in shared:
                rest = rest.difference(point.buffer(10.0 * TOLERANCE))
            if not rest.is_empty:
                return a, b
        return None

    def cut(self, shares: Float) -> Outline:
        """Return the same outline with its elements also cut at shares of its length, increasing, 0 to 1."""
        ends = np.cumsum(self.lengths)
        parts = []
        for k, (element, length) in enumerate(zip(self.elements, self.lengths, strict=True)):
            begin = ends[k] - length
            inner = (shares * ends[-1] - begin) / length
            inner = inner[(inner * length > TOLERANCE) & ((1.0 - inner) * length > TOLERANCE)]
            at = np.concatenate([[0.0], inner, [1.0]])
            points = _within(np.tile(element, (len(at), 1)), at)[0]
            points[0], points[-1] = element[:2], element[2:4]
            bulges = np.tan(np.diff(at) * np.arctan(element[4]))
            parts.append(np.column_stack([points[:-1], points[1:], bulges]))
        return Outline(np.vstack(parts))


def matched(first: Outline, second: Outline) -> tuple[Outline, Outline]:
    """Cut two outlines into equally many elements; elements with the same number correspond in a transition.

    Outlines with the same elements in the same order stay as they are. Others are cut at the shares of the length at which
    either has a vertex.

    Raises
    ------
    ValueError
        If one is closed and the other open.
    """
    if first.closed != second.closed:
        raise ValueError("no transition is possible between a closed and an open outline")
    if np.array_equal(np.sign(first.elements[:, 4]), np.sign(second.elements[:, 4])):
        return first, second
    shares = [np.cumsum(outline.lengths)[:-1] / outline.length for outline in (first, second)]
    both = np.unique(np.concatenate(shares))
    min_share = TOLERANCE / min(first.length, second.length)
    both = both[np.diff(both, prepend=-1.0) > 4.0 * min_share]
    cuts = first.cut(both), second.cut(both)
    if len(cuts[0].elements) != len(cuts[1].elements):
        raise ValueError("the outlines have vertices too close to each other")
    return cuts


def element_lengths(elements: Float) -> Float:
    """Return the length of elements (m, 5), (m,), m."""
    chord = np.hypot(elements[:, 2] - elements[:, 0], elements[:, 3] - elements[:, 1])
    bulge = np.abs(elements[:, 4])
    with np.errstate(divide="ignore", invalid="ignore"):
        arc = chord * (1.0 + bulge**2) / bulge * np.arctan(bulge)
    return np.asarray(np.where(bulge > 0.0, arc, chord), dtype=np.float64)


def _turning_area(elements: Float) -> float:
    """Return the area left of the way along elements and straight back, m²: between vertices, plus arc segments."""
    x0, y0, x1, y1, bulge = elements.T
    turn = 4.0 * np.arctan(bulge)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.hypot(x1 - x0, y1 - y0) * (1.0 + bulge**2) / (4.0 * np.abs(bulge))
        segments = np.where(bulge == 0.0, 0.0, radius**2 * (turn - np.sin(turn)) / 2.0)
    back = elements[-1, 2] * elements[0, 1] - elements[0, 0] * elements[-1, 3]
    return float(((x0 * y1 - x1 * y0).sum() + back) / 2.0 + segments.sum())


def _reversed(elements: Float) -> Float:
    turned = elements[::-1][:, [2, 3, 0, 1, 4]]
    turned[:, 4] *= -1.0
    return turned


def _begun_below(elements: Float) -> Float:
    """Return the same closed outline, beginning straight below the axis, where it is lowest."""
    outline = Outline(elements)
    line = outline.flattened()
    x, y = line.T
    over = np.flatnonzero((x[:-1] > 0.0) & (x[1:] <= 0.0) & (y[:-1] + y[1:] < y.min() + y.max()))  # clockwise: to the left
    if not len(over):
        return np.roll(elements, -int(np.argmin(elements[:, 1])), axis=0)
    share = _share_below(outline, line, int(over[np.argmin(y[over])]))
    cut = outline.cut(np.array([share]))
    begins = np.hypot(cut.elements[:, 0], cut.elements[:, 1] - outline.places(np.array([share]))[0][0, 1])
    return np.roll(cut.elements, -int(np.argmin(begins)), axis=0)


def _share_below(outline: Outline, line: Float, k: int) -> float:
    """Return the share of the length at which the outline passes below the axis, near chord k (secant method)."""
    steps = np.hypot(*np.diff(line, axis=0).T)
    low, high = (steps[:k].sum() / steps.sum(), steps[: k + 1].sum() / steps.sum())
    low, high = low - 1e-6, high + 1e-6
    for _ in range(60):
        middle = (low + high) / 2.0
        right = outline.places(np.array([middle]))[0][0, 0] > 0.0
        low, high = (middle, high) if right else (low, middle)
    return float((low + high) / 2.0)


def _within(elements: Float, at: Float) -> tuple[Float, Float]:
    """Return points and inward unit normals, both (n, 2), at shares (n,) of the lengths of elements (n, 5)."""
    begin, end, bulge = elements[:, :2], elements[:, 2:4], elements[:, 4]
    chord = end - begin
    length = np.hypot(*chord.T)[:, None]
    ahead = chord / length
    left = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    half = 2.0 * np.arctan(bulge)  # half of the arc's angle
    # The chord to a point at angle a is sin(a/2)/sin(half) of the arc's chord long, and turned against it by half - a/2.
    turned = half * at
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(bulge == 0.0, at, np.sin(turned) / np.where(bulge == 0.0, 1.0, np.sin(half)))
    off = turned - half
    points = begin + (share[:, None] * length) * (np.cos(off)[:, None] * ahead + np.sin(off)[:, None] * left)
    way = half * (2.0 * at - 1.0)
    direction = np.cos(way)[:, None] * ahead + np.sin(way)[:, None] * left
    return points, np.column_stack([direction[:, 1], -direction[:, 0]])
