"""Detection of a second tube beside the tunnel in the same scan, by the empty ground between the two in plan.

The points are sorted by stretches of chainage and by their distance right of the axis. Points around the axis without a gap
are the tunnel's own: floor and vault are continuous even where walls are hidden. Points beyond a gap of a pillar's width,
with a floor and a roof over some metres and along several stretches, are a second tube. A niche touches its wall, a train is
below the vault, a cross passage is shorter along the tunnel, and beside an open cut the ground has no roof.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.compiled import kernel, point_kernel
from tunneldb.counted import counted
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.frame import tangents
from tunneldb.geometry.stationing import KILOMETRE, chainage_label
from tunneldb.pointcloud.spool import Rows

STRETCH = 5.0
"""Length of a stretch of chainage, m."""

_STRETCHES = round(KILOMETRE / STRETCH)

CELL = 0.25
"""Width of a cell across the axis, m."""

REACH = 50.0
"""Distance from the axis up to which tubes are distinguished, m."""

MIN_PILLAR_WIDTH = 1.5
"""Least distance between tubes in plan, m; neighbouring parts of one tunnel are closer."""

MIN_TUBE_SIZE = 2.0
"""Least width and height of a tube, m."""

MIN_ROOFED_SHARE = 0.5
"""Least share of a tube's cells with points so far apart in height that they are floor and roof."""

MIN_DENSITY_RATIO = 0.02
"""Ratio to the typical count of a stretch's cells below which a cell has only stray points."""

MAX_PASSAGE_LENGTH = 20.0
"""Greatest length of a cross passage along the tunnel, m; the pillar is assumed to continue over it."""

MIN_TUBE_LENGTH = 10.0
"""Least length of a second tube along the tunnel, m; cross passages are narrower."""


@dataclass(frozen=True)
class SecondTubes:
    """Lateral limits of the tunnel where another tube begins.

    Attributes
    ----------
    km : int
    limits : (2, k) float array
        Least and greatest distance right of the axis of the tunnel's own points, m, in each stretch; infinite if there is no
        second tube.
    """

    km: int
    limits: Float

    @property
    def any(self) -> bool:
        """True if there is a second tube."""
        return bool(np.isfinite(self.limits).any())

    def own(self, rows: Rows, alignment: Alignment) -> Bool:
        """Return True for rows of the tunnel itself."""
        away, stretch = np.empty(len(rows)), np.empty(len(rows), np.int32)
        _place(rows["x"], rows["y"], rows["chainage"], *_axis(alignment), self.km * KILOMETRE, away, stretch)
        return np.asarray((away >= self.limits[0, stretch]) & (away <= self.limits[1, stretch]))

    def note(self, points: int) -> str:
        """Return a note about the number of points that were left out."""
        places = []
        for side, limits in zip(("left", "right"), self.limits, strict=True):
            stretches = np.flatnonzero(np.isfinite(limits))
            if len(stretches):
                low, high = (self.km * KILOMETRE + STRETCH * end for end in (stretches[0], stretches[-1] + 1))
                places.append(f"to the {side} between {chainage_label(low, 0)} and {chainage_label(high, 0)}")
        left = counted(points, "point")
        return f"{left} of a second tube left out, {' and '.join(places)}; results are for the tube around the axis"


def find_second_tubes(parts: Iterable[Rows], alignment: Alignment, km: int) -> SecondTubes:
    """Find second tubes in the rows of a kilometre.

    Parameters
    ----------
    parts : iterable of rows
        Rows of the kilometre, in any order.
    alignment : Alignment
        Given axis.
    km : int
    """
    shape = _STRETCHES, round(2 * REACH / CELL)
    count, low, high = np.zeros(shape, np.int64), np.full(shape, np.inf), np.full(shape, -np.inf)
    axis = _axis(alignment)
    for rows in parts:
        away, which = np.empty(len(rows)), np.empty(len(rows), np.int32)
        _place(rows["x"], rows["y"], rows["chainage"], *axis, km * KILOMETRE, away, which)
        _sort_in(rows["z"], away, which, count, low, high)
    limits = np.full((2, shape[0]), np.nan)
    for stretch in np.flatnonzero(count.any(axis=1)):
        occupied = count[stretch] > max(1.0, MIN_DENSITY_RATIO * float(np.median(count[stretch][count[stretch] > 0])))
        roofed = occupied & (high[stretch] - low[stretch] >= MIN_TUBE_SIZE)
        limits[1, stretch] = _pillar(occupied, roofed)
        limits[0, stretch] = -_pillar(occupied[::-1], roofed[::-1])
    for side in limits:
        _bridge(side)
    return SecondTubes(km, np.where(np.isfinite(limits), limits, [[-np.inf], [np.inf]]))


def _pillar(occupied: Bool, roofed: Bool) -> float:
    """Return the distance right of the axis of a pillar with a tube behind it, m; NaN without one."""
    middle, gap = len(occupied) // 2, round(MIN_PILLAR_WIDTH / CELL)
    places = np.flatnonzero(occupied) - middle
    if not len(places) or np.abs(places).min() > gap:
        return np.nan
    right = places[places >= -gap]
    wide = np.flatnonzero(np.diff(right) > gap)
    if not len(wide):
        return np.nan
    end, begin = right[wide[0]], right[wide[0] + 1]
    beyond = right[wide[0] + 1 :] + middle
    if np.count_nonzero(roofed[beyond]) < max(MIN_ROOFED_SHARE * len(beyond), MIN_TUBE_SIZE / CELL):
        return np.nan
    return float(CELL * (end + 1 + begin) / 2.0)


def _bridge(limits: Float) -> None:
    """Continue a pillar over passages through it; remove those that are too short for a tube."""
    known = np.flatnonzero(np.isfinite(limits))
    breaks = np.flatnonzero(np.diff(known) > 1 + MAX_PASSAGE_LENGTH / STRETCH)
    for run in np.split(known, breaks + 1):
        if len(run) * STRETCH <= MIN_TUBE_LENGTH:
            limits[run] = np.nan
        else:
            within = np.arange(run[0], run[-1] + 1)
            limits[within] = np.interp(within, run, limits[run])


def _axis(alignment: Alignment) -> tuple[Float, float, float]:
    """Return position and direction of each vertex in plan, (n, 4), the number of the first, and their spacing, m."""
    along = np.column_stack([alignment.vertices[:, :2], tangents(alignment.vertices)[:, :2]])
    return along, float(alignment.number[0]), float(alignment.spacing)


@point_kernel
def _place(
    x: Float, y: Float, chainage: Float, axis: Float, first: float, spacing: float, start: float, away: Float, stretch: Int32
) -> None:  # pragma: no cover - compiled
    """Write the distance of points right of the axis in plan, m, and their stretch of the kilometre from ``start`` on."""
    last = axis.shape[0] - 1
    for i in range(away.shape[0]):
        along = chainage[i] / spacing - first
        after = min(max(math.floor(along) + 1, 1), last)
        share = along - (after - 1)
        a, b = axis[after - 1], axis[after]
        ox, oy = a[0] * (1.0 - share) + b[0] * share, a[1] * (1.0 - share) + b[1] * share
        tx, ty = a[2] * (1.0 - share) + b[2] * share, a[3] * (1.0 - share) + b[3] * share
        away[i] = ((x[i] - ox) * ty - (y[i] - oy) * tx) / math.sqrt(tx * tx + ty * ty)
        stretch[i] = min(max(math.floor((chainage[i] - start) / STRETCH), 0), _STRETCHES - 1)


@kernel
def _sort_in(
    z: Float, away: Float, stretch: Int32, count: Int64, low: Float, high: Float
) -> None:  # pragma: no cover - compiled
    """Count points, with the lowest and highest, in cells of stretch and distance right of the axis."""
    for i in range(away.shape[0]):
        cell = math.floor((away[i] + REACH) / CELL)
        if 0 <= cell < count.shape[1]:
            s = stretch[i]
            count[s, cell] += 1
            low[s, cell] = min(low[s, cell], z[i])
            high[s, cell] = max(high[s, cell], z[i])
