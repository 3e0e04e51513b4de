"""Signed distance of points from the lines and arcs of a design profile, and the profile at each chainage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import point_kernel
from tunneldb.shape.outline import Outline, matched
from tunneldb.threads import in_blocks

BLOCK_SECTIONS = 100
"""Number of sections compared with the design at a time."""


@dataclass(frozen=True)
class Profile:
    """Profile that applies from one chainage to another.

    Attributes
    ----------
    name : str
    chainage_from, chainage_to : float
        Along the given axis, m.
    outline : Outline
    """

    name: str
    chainage_from: float
    chainage_to: float
    outline: Outline


@dataclass(frozen=True)
class Stretch:
    """Stretch with one profile, or with a transition between two.

    Attributes
    ----------
    name : str
        Name of the profile, or of both.
    low, high : float
        Chainage, m.
    first, second : Outline
        Outlines at its begin and its end, with equally many elements.
    """

    name: str
    low: float
    high: float
    first: Outline
    second: Outline

    def share(self, chainage: Float) -> Float:
        """Return the progress of the transition at chainages (n,), 0 to 1; 0 if there is no transition."""
        if self.first is self.second:
            return np.zeros(np.shape(chainage))
        return np.asarray(np.clip((chainage - self.low) / (self.high - self.low), 0.0, 1.0))

    def at(self, chainage: float) -> Outline:
        """Return the outline at a chainage, m."""
        share = float(self.share(np.array(chainage)))
        return Outline((1.0 - share) * self.first.elements + share * self.second.elements)


def stretches(profiles: Sequence[Profile]) -> list[Stretch]:
    """Return the profiles of one layer in order of chainage, with linear transitions over gaps between them.

    Notes
    -----
    In a transition begin, end and bulge of each element change linearly from one profile to the next. So lines stay lines and
    arcs stay arcs; the radius of concentric circles changes linearly.

    Raises
    ------
    ValueError
        If two profiles overlap, or no transition between them is possible.
    """
    ordered = sorted(profiles, key=lambda profile: profile.chainage_from)
    found: list[Stretch] = []
    for k, profile in enumerate(ordered):
        if k and ordered[k - 1].chainage_to > profile.chainage_from:
            raise ValueError(f"{ordered[k - 1].name} and {profile.name} overlap")
        if k and ordered[k - 1].chainage_to < profile.chainage_from:
            before = ordered[k - 1]
            try:
                first, second = matched(before.outline, profile.outline)
            except ValueError as error:
                raise ValueError(f"{before.name} and {profile.name}: {error}") from None
            found.append(Stretch(f"{before.name} – {profile.name}", before.chainage_to, profile.chainage_from, first, second))
        found.append(Stretch(profile.name, profile.chainage_from, profile.chainage_to, profile.outline, profile.outline))
    return found


@dataclass(frozen=True)
class Deviation:
    """Deviation of points of sections, arrays (sections, points); NaN where the nearest place is an end of an open outline.

    Attributes
    ----------
    distance : float array
        Orthogonal distance from the outline, positive inside, m.
    share : float array
        Place of the nearest point along the outline, as a share of its length, 0 to 1.
    curvature : float array
        Curvature of the outline at that point, positive where concave as seen from inside, 1/m.
    """

    distance: Float
    share: Float
    curvature: Float


def deviation(stretch: Stretch, chainage: Float, right: Float, up: Float) -> Deviation:
    """Compute the signed deviation of points from a design.

    Parameters
    ----------
    stretch : Stretch
        The design.
    chainage : (c,) float array
        Chainage of the sections, m.
    right, up : (c, n) float arrays
        Points of each section, right of the axis and above it, m.

    Notes
    -----
    The nearest place on an element is that of its line or circle, if it lies within the element, else the nearer end. At a
    vertex the bisector decides the side.
    """
    share = stretch.share(chainage)
    right, up = np.ascontiguousarray(right, np.float64), np.ascontiguousarray(up, np.float64)
    found = Deviation(*(np.empty(right.shape) for _ in range(3)))

    def block(begin: int, end: int) -> None:
        part = slice(begin, end)
        _deviation(
            stretch.first.elements, stretch.second.elements, share[part], stretch.first.closed, right[part], up[part],
            found.distance[part], found.share[part], found.curvature[part],
        )  # fmt: skip

    in_blocks(block, len(right), BLOCK_SECTIONS)
    return found


def signed_distance(outline: Outline, points: Float) -> Float:
    """Return the signed distance of points (n, 2) from an outline, (n,), positive inside, m; NaN beyond open ends."""
    stretch = Stretch("", 0.0, 0.0, outline, outline)
    return deviation(stretch, np.zeros(1), points[None, :, 0], points[None, :, 1]).distance[0]


def strip_area(distance: Float, curvature: Float) -> Float:
    """Return the area between an outline and a parallel at a distance, per metre of the outline, m²/m, with that sign.

    Between an arc of radius r and one of radius r - d the area is d (1 - d / 2 r) per metre of the first.
    """
    return np.asarray(distance * (1.0 - curvature * distance / 2.0))


@point_kernel
def _deviation(
    first: Float,
    second: Float,
    transition: Float,
    closed: bool,
    right: Float,
    up: Float,
    distance: Float,
    share: Float,
    curvature: Float,
) -> None:  # pragma: no cover - compiled
    """Compute :func:`deviation` section by section; the last three arrays are overwritten."""
    count = first.shape[0]
    # For each element: begin, end, inward normal at both; length, bulge; for an arc centre, radius, direction of its middle,
    # cosine of half its angle.
    e = np.empty((count, 16))
    before = np.empty(count + 1)
    for j in range(right.shape[0]):
        g = transition[j]
        before[0] = 0.0
        for k in range(count):
            x0, y0, x1, y1, b = (
                (1.0 - g) * first[k, 0] + g * second[k, 0],
                (1.0 - g) * first[k, 1] + g * second[k, 1],
                (1.0 - g) * first[k, 2] + g * second[k, 2],
                (1.0 - g) * first[k, 3] + g * second[k, 3],
                (1.0 - g) * first[k, 4] + g * second[k, 4],
            )
            chord = np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
            ax, ay = (x1 - x0) / chord, (y1 - y0) / chord
            cosine, sine = (1.0 - b * b) / (1.0 + b * b), 2.0 * b / (1.0 + b * b)  # of half the arc's angle
            e[k, 0], e[k, 1], e[k, 2], e[k, 3] = x0, y0, x1, y1
            # Inward is the direction turned right; the direction is the chord's, turned by minus and plus half the angle.
            e[k, 4], e[k, 5] = ay * cosine - ax * sine, -ax * cosine - ay * sine
            e[k, 6], e[k, 7] = ay * cosine + ax * sine, -ax * cosine + ay * sine
            e[k, 8], e[k, 9] = chord, b
            if abs(b) > 1e-12:
                radius = chord * (1.0 + b * b) / (4.0 * abs(b))
                centre_offset = chord * (1.0 - b * b) / (4.0 * b)
                e[k, 10], e[k, 11] = (x0 + x1) / 2.0 - ay * centre_offset, (y0 + y1) / 2.0 + ax * centre_offset
                e[k, 12] = radius
                side = 1.0 if b > 0.0 else -1.0
                e[k, 13], e[k, 14], e[k, 15] = side * ay, -side * ax, cosine
                e[k, 8] = radius * 4.0 * np.arctan(abs(b))
            before[k + 1] = before[k] + e[k, 8]
        for i in range(right.shape[1]):
            x, y = right[j, i], up[j, i]
            distance[j, i] = share[j, i] = curvature[j, i] = np.nan
            if not (np.isfinite(x) and np.isfinite(y)):
                continue
            best, which, inside = np.inf, -1, True
            for k in range(count):
                if abs(e[k, 9]) > 1e-12:
                    px, py = x - e[k, 10], y - e[k, 11]
                    away = np.sqrt(px * px + py * py)
                    within = px * e[k, 13] + py * e[k, 14] >= away * e[k, 15]
                    off = abs(away - e[k, 12])
                else:
                    along = (x - e[k, 0]) * (e[k, 2] - e[k, 0]) + (y - e[k, 1]) * (e[k, 3] - e[k, 1])
                    within = 0.0 <= along <= e[k, 8] * e[k, 8]
                    off = abs((x - e[k, 0]) * e[k, 4] + (y - e[k, 1]) * e[k, 5])
                if within and off <= best:
                    best, which, inside = off, k, True
                to_begin = np.sqrt((x - e[k, 0]) ** 2 + (y - e[k, 1]) ** 2)
                if to_begin < best:
                    best, which, inside = to_begin, k, False
            if not closed:
                to_end = np.sqrt((x - e[count - 1, 2]) ** 2 + (y - e[count - 1, 3]) ** 2)
                if to_end < best or (not inside and which == 0):
                    continue
            k = which
            if not inside:
                m = k - 1 if k > 0 else count - 1
                nx, ny = e[k, 4] + e[m, 6], e[k, 5] + e[m, 7]
                side = 1.0 if (x - e[k, 0]) * nx + (y - e[k, 1]) * ny >= 0.0 else -1.0
                distance[j, i] = side * best
                share[j, i] = before[k] / before[count]
                curvature[j, i] = 0.0
            elif abs(e[k, 9]) > 1e-12:
                outward = e[k, 9] < 0.0
                px, py = x - e[k, 10], y - e[k, 11]
                away = np.sqrt(px * px + py * py)
                distance[j, i] = e[k, 12] - away if outward else away - e[k, 12]
                turned = np.arctan2(e[k, 13] * py - e[k, 14] * px, e[k, 13] * px + e[k, 14] * py)
                along = e[k, 8] / 2.0 + (-turned if outward else turned) * e[k, 12]
                share[j, i] = (before[k] + along) / before[count]
                curvature[j, i] = (1.0 if outward else -1.0) / e[k, 12]
            else:
                along = ((x - e[k, 0]) * (e[k, 2] - e[k, 0]) + (y - e[k, 1]) * (e[k, 3] - e[k, 1])) / e[k, 8]
                distance[j, i] = (x - e[k, 0]) * e[k, 4] + (y - e[k, 1]) * e[k, 5]
                share[j, i] = (before[k] + along) / before[count]
                curvature[j, i] = 0.0
