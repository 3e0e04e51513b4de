"""Sides of dark regions: what they face, the step across them, and which are sharp and on straight lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.arrays import Bool, Float, Int64, Intp
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.state import PixelState

STEP_DISTANCE = 0.06
"""Distance inside and outside of a side at which the step is measured, m: a wet patch ends within it, soot does not."""

FAR_STEP_DISTANCE = 0.2
"""Second distance outside, m: areas that fade over decimetres, such as halos of dust, are still dark there."""

BRIGHT_LEVEL = 2.0
"""Standard deviations above the background that occur by chance in 2 of 100 pixels."""

SHARP_SHARE = 0.5
"""Minimum share of the region's mean darkening that is lost across a sharp side."""

SLOPES = np.arange(-0.04, 0.05, 0.02)
"""Slopes of lines along the tunnel and around it for straight sides: built objects, and the unrolled plane, follow these
within some degrees."""

MAX_LINE_DISTANCE = 0.02
"""Maximum distance of a side from its line, m."""

SIDE_HALF_WIDTH = 0.02
"""Half-width of the mean along a side for its step, m."""

FACING = ((-1, 0), (1, 0), (0, -1), (0, 1))
"""Rows and columns from a pixel to its four neighbours."""

UPWARDS = (1, 0)
"""Index in FACING that leads to the crown, from rows at arcs above 0 and from those below."""


class Sides(NamedTuple):
    """Sides of region pixels that face pixels that are not dark.

    Attributes
    ----------
    label : (n,) int array
        Region number.
    facing : (n,) int array
        Index in FACING.
    row, column : (n,) int arrays
        Pixel of the region.
    """

    label: Intp
    facing: Int64
    row: Int64
    column: Int64

    def where(self, mask: Bool) -> Sides:
        """Return the sides of a mask (n,)."""
        return Sides(*(part[mask] for part in self))

    def beyond(self, along: int, aside: int) -> tuple[Int64, Int64]:
        """Return row and column of the pixels so many from each side, in its direction, and so many beside these."""
        down, right = np.array(FACING).T
        return (
            self.row + along * down[self.facing] + aside * right[self.facing],
            self.column + along * right[self.facing] + aside * down[self.facing],
        )


class Edges:
    """Dark pixels of a kilometre, and the sides of its regions.

    With profiles far apart, a region ends along the tunnel somewhere between two of them. Then only the sides that face up and
    down show how sharp and how straight it is.

    Parameters
    ----------
    dark : (rows, columns) bool array
        All dark pixels; regions do not end at these.
    contrast : ContrastImage
        Their state and darkening.
    """

    def __init__(self, dark: Bool, contrast: ContrastImage) -> None:
        self.dark, self.state, self.drop = dark, contrast.state, contrast.drop
        self.sigma, self.tile = contrast.sigma, contrast.tile
        self.crown = contrast.grid.bottom + contrast.grid.rows
        self.far = max(1, round(FAR_STEP_DISTANCE / contrast.grid.pixel))
        self.across = max(1, round(STEP_DISTANCE / contrast.grid.pixel))
        self.half_width = max(1, round(SIDE_HALF_WIDTH / contrast.grid.pixel))
        self.near = max(1, round(MAX_LINE_DISTANCE / contrast.grid.pixel))
        self.facings = 2 if contrast.spacing else len(FACING)

    def sides(self, label: Intp, row: Int64, column: Int64) -> Sides:
        """Return the sides of dark pixels (n,), in order of direction and then of the pixels."""
        found = []
        for facing, (down, right) in enumerate(FACING):
            m, n = row + down, column + right
            free = np.flatnonzero(self._inside(m, n))
            free = free[~self.dark[m[free], n[free]]]
            found.append(Sides(label[free], np.full(len(free), facing), row[free], column[free]))
        return Sides(*map(np.concatenate, zip(*found, strict=True)))

    def perimeter(self, sides: Sides, count: int) -> Float:
        """Count the sides of each region, by what they face: see :class:`RegionProperties`.

        All, towards a fixture or the floor, towards recessed lining, towards a fixture above, towards the floor: (regions, 5).
        """
        state = self.state[sides.beyond(1, 0)]
        off = state > PixelState.RECESS
        above = sides.facing == np.where(sides.row < self.crown, UPWARDS[0], UPWARDS[1])
        masks = (
            np.ones(len(state), np.bool_), off, state == PixelState.RECESS, (state == PixelState.OFF) & above,
            state == PixelState.FLOOR,
        )  # fmt: skip
        return np.column_stack([np.bincount(sides.label[mask], minlength=count) for mask in masks]).astype(np.float64)

    def steps(self, sides: Sides, count: int) -> Float:
        """Sum the darkening where it is known STEP_DISTANCE from both sides: number, sum inside and outside, dB.

        Then the number also known FAR_STEP_DISTANCE outside, the sum there, and the number beside bright lining: (regions, 6).
        """
        sides = sides.where(sides.facing < self.facings)
        for along, usable in ((1 - self.across, self._interior), (self.across, self._background)):
            sides = sides.where(self._inside(*sides.beyond(along, 0)))
            sides = sides.where(usable(*sides.beyond(along, 0)))
        drops = [self.drop[sides.beyond(along, 0)] for along in (1 - self.across, self.across)]
        sums = [np.bincount(sides.label, drop, count) * STEP["corrected"] for drop in drops]
        row, column = sides.beyond(self.across, 0)
        sigma = self.sigma[row // self.tile, np.minimum(column // self.tile, self.sigma.shape[1] - 1)]
        bright = drops[1] * STEP["corrected"] < -BRIGHT_LEVEL * sigma
        far = sides.where(self._inside(*sides.beyond(self.far, 0)))
        far = far.where(self._background(*far.beyond(self.far, 0)))
        outside = np.bincount(far.label, self.drop[far.beyond(self.far, 0)], count) * STEP["corrected"]
        number, known = (np.bincount(one.label, minlength=count) for one in (sides, far))
        return np.column_stack([number, *sums, known, outside, np.bincount(sides.label[bright], minlength=count)])

    def straight(self, sides: Sides, mean_drop: Float) -> Int64:
        """Count the sharp sides of regions, and those of them on one straight line for each of the four directions.

        Built objects end along the tunnel and around it, on four lines; water ends anywhere. Sides that face fixtures, the
        floor or other dark pixels are not counted.

        Parameters
        ----------
        sides : Sides
            Sides of all regions.
        mean_drop : (regions,) float array
            Mean darkening of each, dB.

        Returns
        -------
        (regions, 2) int array
        """
        count = len(mean_drop)
        sides = sides.where(sides.facing < self.facings)
        sides = sides.where(self.state[sides.beyond(1, 0)] <= PixelState.RECESS)
        sides = sides.where(self._lost(sides) >= SHARP_SHARE * mean_drop[sides.label] / STEP["corrected"])
        upright = sides.facing >= 2  # faces along the tunnel, and is on a line around it
        along, across = np.where(upright, sides.row, sides.column), np.where(upright, sides.column, sides.row)
        on_line = _max_count_on_line(len(FACING) * sides.label + sides.facing, along, across, len(FACING) * count, self.near)
        return np.column_stack([np.bincount(sides.label, minlength=count), on_line.reshape(count, len(FACING)).sum(axis=1)])

    def _lost(self, sides: Sides) -> Float:
        """Return the mean darkening inside sides minus that outside, steps of the image; -inf where either is hidden."""
        sums, selected = np.zeros((2, len(sides.label)), np.int64), np.zeros((2, len(sides.label)), np.int64)
        hidden = np.zeros(len(sides.label), np.bool_)
        for aside in range(-self.half_width, self.half_width + 1):
            for k, (along, usable) in enumerate(((1 - self.across, self._interior), (self.across, self._background))):
                row, column = sides.beyond(along, aside)
                there = np.flatnonzero(self._inside(row, column))
                row, column = row[there], column[there]
                if k:
                    hidden[there] |= self.state[row, column] > PixelState.RECESS
                good = usable(row, column)
                sums[k, there[good]] += self.drop[row[good], column[good]]
                selected[k, there[good]] += 1
        mean = sums / np.maximum(selected, 1)
        return np.where(hidden | (selected == 0).any(axis=0), -np.inf, mean[0] - mean[1])

    def _inside(self, row: Int64, column: Int64) -> Bool:
        """Return True for pixels in the image."""
        rows, columns = self.dark.shape
        return (row >= 0) & (row < rows) & (column >= 0) & (column < columns)

    def _interior(self, row: Int64, column: Int64) -> Bool:
        """Return True for pixels that are dark and have points."""
        return self.dark[row, column] & (self.drop[row, column] != NODATA)

    def _background(self, row: Int64, column: Int64) -> Bool:
        """Return True for pixels of the lining that have points and are not dark."""
        state = self.state[row, column]
        seen = (state == PixelState.LINING) | (state == PixelState.RECESS)
        return seen & ~self.dark[row, column] & (self.drop[row, column] != NODATA)


def _max_count_on_line(group: Int64, along: Int64, across: Int64, count: int, near: int) -> Int64:
    """Return the largest number of places of each group on one line: up to so many pixels across from it."""
    largest = np.zeros(count, np.int64)
    found, first = np.unique(group, return_index=True)
    start = np.zeros(count, np.int64)
    start[found] = along[first]
    for slope in SLOPES:
        place = np.rint(across - slope * (along - start[group])).astype(np.int64)
        low = int(place.min(initial=0))
        wide = int(place.max(initial=0)) - low + 2 * near + 1  # groups far enough apart not to share a line
        line, selected = np.unique(group * wide + (place - low), return_counts=True)
        total = np.concatenate([[0], np.cumsum(selected)])
        within = total[np.searchsorted(line, line + 2 * near, side="right")] - total[:-1]
        np.maximum.at(largest, line // wide, within)
    return largest
