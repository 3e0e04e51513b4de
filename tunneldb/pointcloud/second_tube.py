"""A tube beside the tunnel in the same scan, told by the empty ground between the two, seen from above.

The points are sorted by stretches of chainage and by how far right of the axis they lie. About the axis lie the tunnel's own
points, without a gap: floor and vault close it where walls are hidden. Beyond a gap as wide as a pillar, what has a floor
and a roof over some metres, along several stretches, is a second tube. A niche touches its wall, a train stands below the
vault, a cross passage is shorter along the tunnel, and beside an open cut there is ground without a roof.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.frame import tangents
from tunneldb.geometry.stationing import KILOMETRE, chainage_label
from tunneldb.pointcloud.spool import Rows

STRETCH = 5.0
"""m of chainage looked at together."""

CELL = 0.25
"""m across the axis."""

REACH = 50.0
"""m from the axis; farther points are not told apart."""

PILLAR = 1.5
"""Tubes are farther apart, and no two neighbouring parts of one tunnel are, seen from above, m."""

NARROWEST = 2.0
"""A tube is as wide and as high, m."""

ROOFED = 0.5
"""Share of a tube's cells that have points at heights so far apart that they are floor and roof."""

FAINT = 0.02
"""Cells with a smaller share of what others of their stretch hold have strays only."""

LONGEST_PASSAGE = 20.0
"""Along the tunnel, m: over so much the pillar is taken to go on; a second tube is seen along more than a passage."""

SHORTEST = 10.0
"""A second tube is seen along more of the tunnel, m: cross passages are narrower."""


@dataclass(frozen=True)
class SecondTubes:
    """Where the tunnel ends to its sides, because another tube begins.

    Attributes
    ----------
    km : int
    limits : (2, k) float array
        Least and greatest distance right of the axis of what is the tunnel's own, m, in each stretch; infinite where there
        is no second tube.
    """

    km: int
    limits: Float

    @property
    def any(self) -> bool:
        """Whether there is a second tube."""
        return bool(np.isfinite(self.limits).any())

    def own(self, rows: Rows, alignment: Alignment) -> Bool:
        """Which rows are the tunnel's own."""
        away, stretch = _away(rows, alignment), _stretch(rows, self.km)
        return np.asarray((away >= self.limits[0, stretch]) & (away <= self.limits[1, stretch]))

    def note(self, points: int) -> str:
        """What is to be known of so many points that were left out."""
        places = []
        for side, limits in zip(("left", "right"), self.limits, strict=True):
            held = np.flatnonzero(np.isfinite(limits))
            if len(held):
                low, high = (self.km * KILOMETRE + STRETCH * end for end in (held[0], held[-1] + 1))
                places.append(f"to the {side} between {chainage_label(low, 0)} and {chainage_label(high, 0)}")
        return f"{points} points of a second tube left out, {' and '.join(places)}: what is told is of the tube about the axis"


def find_second_tubes(parts: Iterable[Rows], alignment: Alignment, km: int) -> SecondTubes:
    """Find second tubes in the rows of a kilometre.

    Parameters
    ----------
    parts : iterable of rows
        Rows of the kilometre, in any order.
    alignment : Alignment
        The given axis.
    km : int
    """
    shape = round(KILOMETRE / STRETCH), round(2 * REACH / CELL)
    count, low, high = np.zeros(shape, np.int64), np.full(shape, np.inf), np.full(shape, -np.inf)
    for rows in parts:
        cell = np.floor((_away(rows, alignment) + REACH) / CELL).astype(np.int64)
        within = (cell >= 0) & (cell < shape[1])
        at = _stretch(rows, km)[within], cell[within]
        np.add.at(count, at, 1)
        np.minimum.at(low, at, rows["z"][within])
        np.maximum.at(high, at, rows["z"][within])
    limits = np.full((2, shape[0]), np.nan)
    for stretch in np.flatnonzero(count.any(axis=1)):
        held = count[stretch] > max(1.0, FAINT * float(np.median(count[stretch][count[stretch] > 0])))
        roofed = held & (high[stretch] - low[stretch] >= NARROWEST)
        limits[1, stretch] = _pillar(held, roofed)
        limits[0, stretch] = -_pillar(held[::-1], roofed[::-1])
    for side in limits:
        _bridge(side)
    return SecondTubes(km, np.where(np.isfinite(limits), limits, [[-np.inf], [np.inf]]))


def _pillar(held: Bool, roofed: Bool) -> float:
    """How far right of the axis a pillar is with a tube behind it, m; NaN without one."""
    middle, gap = len(held) // 2, round(PILLAR / CELL)
    places = np.flatnonzero(held) - middle
    if not len(places) or np.abs(places).min() > gap:
        return np.nan
    right = places[places >= -gap]
    wide = np.flatnonzero(np.diff(right) > gap)
    if not len(wide):
        return np.nan
    end, begin = right[wide[0]], right[wide[0] + 1]
    beyond = right[wide[0] + 1 :] + middle
    if np.count_nonzero(roofed[beyond]) < max(ROOFED * len(beyond), NARROWEST / CELL):
        return np.nan
    return float(CELL * (end + 1 + begin) / 2.0)


def _bridge(limits: Float) -> None:
    """Carry a pillar on over passages through it; forget those that are too short for a tube."""
    known = np.flatnonzero(np.isfinite(limits))
    breaks = np.flatnonzero(np.diff(known) > 1 + LONGEST_PASSAGE / STRETCH)
    for run in np.split(known, breaks + 1):
        if len(run) * STRETCH <= SHORTEST:
            limits[run] = np.nan
        else:
            within = np.arange(run[0], run[-1] + 1)
            limits[within] = np.interp(within, run, limits[run])


def _stretch(rows: Rows, km: int) -> np.ndarray:
    last = round(KILOMETRE / STRETCH) - 1
    return np.clip((rows["chainage"] - km * KILOMETRE) // STRETCH, 0, last).astype(np.int64)


def _away(rows: Rows, alignment: Alignment) -> Float:
    """How far right of the axis points lie, in plan, m."""
    tangent, place = tangents(alignment.vertices), rows["chainage"] / alignment.spacing - alignment.number[0]
    after = np.clip(np.floor(place).astype(np.int64) + 1, 1, len(tangent) - 1)
    share = place - (after - 1)
    x, y, ahead_x, ahead_y = (
        values[after - 1] * (1.0 - share) + values[after] * share for values in (*alignment.vertices.T[:2], *tangent.T[:2])
    )
    return np.asarray(((rows["x"] - x) * ahead_y - (rows["y"] - y) * ahead_x) / np.hypot(ahead_x, ahead_y))
