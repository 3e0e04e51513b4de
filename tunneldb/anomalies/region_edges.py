"""Sides by which dark regions end: what they face, what is lost over them, which are sharp and lie on straight lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.arrays import Bool, Float, Int64, Intp
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.pixel_state import PixelState

ACROSS = 0.06
"""The step over a side is measured so far inside and outside, m: a wet patch ends within it, soot doesn't."""

FAR = 0.2
"""It is measured so far outside, too, m: what fades over decimetres, as halos of dust do, is still dark there."""

BRIGHT = 2.0
"""What is brighter than the background by so many standard deviations is so by chance in 2 of 100 pixels."""

SHARP = 0.5
"""Part of the region's mean drop that is lost over a sharp side."""

SLOPES = np.arange(-0.04, 0.05, 0.02)
"""Slopes of lines along the tunnel and around it, on which sides are taken for straight: what is built keeps to these within
some degrees, and so does the unrolled plane."""

NEAR_LINE = 0.02
"""Sides lie on a line up to so far from it, m."""

ASIDE = 0.02
"""What is lost over a sharp side is the mean of the pixels up to so far to either side of it, m."""

FACING = ((-1, 0), (1, 0), (0, -1), (0, 1))
"""Rows and columns from a pixel to its four neighbours."""

UPWARDS = (1, 0)
"""Which of FACING leads to the crown, from rows at arcs above 0 and from those below."""


class Sides(NamedTuple):
    """Sides by which pixels of regions face what is not dark.

    Attributes
    ----------
    label : (n,) int array
        Region.
    facing : (n,) int array
        Which of FACING.
    row, column : (n,) int arrays
        Pixel of the region.
    """

    label: Intp
    facing: Int64
    row: Int64
    column: Int64

    def where(self, mask: Bool) -> Sides:
        """Those of a mask (n,)."""
        return Sides(*(part[mask] for part in self))

    def beyond(self, along: int, aside: int) -> tuple[Int64, Int64]:
        """Row and column of the pixels so many from each side's own, the way that it faces, and so many beside these."""
        down, right = np.array(FACING).T
        return (
            self.row + along * down[self.facing] + aside * right[self.facing],
            self.column + along * right[self.facing] + aside * down[self.facing],
        )


class Edges:
    """What is dark in a kilometre, and how regions end on it.

    Where profiles lie apart, a region ends along the tunnel between two of them, nobody knows where or how. Then the sides that
    face up and down alone tell how sharp and how straight it is.

    Parameters
    ----------
    dark : (rows, columns) bool array
        All dark pixels; regions don't end at these.
    contrast : ContrastImage
        Their state and drop.
    """

    def __init__(self, dark: Bool, contrast: ContrastImage) -> None:
        self.dark, self.state, self.drop = dark, contrast.state, contrast.drop
        self.sigma, self.tile = contrast.sigma, contrast.tile
        self.crown = contrast.grid.bottom + contrast.grid.rows
        self.far = max(1, round(FAR / contrast.grid.pixel))
        self.across = max(1, round(ACROSS / contrast.grid.pixel))
        self.aside = max(1, round(ASIDE / contrast.grid.pixel))
        self.near = max(1, round(NEAR_LINE / contrast.grid.pixel))
        self.facings = 2 if contrast.spacing else len(FACING)

    def sides(self, label: Intp, row: Int64, column: Int64) -> Sides:
        """Sides of dark pixels (n,), in order of direction and then of the pixels."""
        found = []
        for facing, (down, right) in enumerate(FACING):
            m, n = row + down, column + right
            free = np.flatnonzero(self._inside(m, n))
            free = free[~self.dark[m[free], n[free]]]
            found.append(Sides(label[free], np.full(len(free), facing), row[free], column[free]))
        return Sides(*map(np.concatenate, zip(*found, strict=True)))

    def perimeter(self, sides: Sides, count: int) -> Float:
        """Sides of each of so many regions, by what they face: see :class:`RegionProperties`.

        All, towards an appendage or the floor, towards lining in a recess, towards an appendage above, towards the floor:
        (regions, 5).
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
        """Where the drop is known on both sides, ACROSS from them: how many, sum of the drop inside and outside, dB.

        Then of how many it is known FAR outside, too, the sum there, and how many lie beside bright lining: (regions, 6).
        """
        sides = sides.where(sides.facing < self.facings)
        for along, usable in ((1 - self.across, self._interior), (self.across, self._background)):
            sides = sides.where(self._inside(*sides.beyond(along, 0)))
            sides = sides.where(usable(*sides.beyond(along, 0)))
        drops = [self.drop[sides.beyond(along, 0)] for along in (1 - self.across, self.across)]
        sums = [np.bincount(sides.label, drop, count) * STEP["corrected"] for drop in drops]
        row, column = sides.beyond(self.across, 0)
        sigma = self.sigma[row // self.tile, np.minimum(column // self.tile, self.sigma.shape[1] - 1)]
        bright = drops[1] * STEP["corrected"] < -BRIGHT * sigma
        far = sides.where(self._inside(*sides.beyond(self.far, 0)))
        far = far.where(self._background(*far.beyond(self.far, 0)))
        outside = np.bincount(far.label, self.drop[far.beyond(self.far, 0)], count) * STEP["corrected"]
        number, known = (np.bincount(one.label, minlength=count) for one in (sides, far))
        return np.column_stack([number, *sums, known, outside, np.bincount(sides.label[bright], minlength=count)])

    def straight(self, sides: Sides, mean_drop: Float) -> Int64:
        """Count the sharp sides of regions, and those of them that lie on one straight line for each of the four directions.

        What was built ends along the tunnel and around it, on four lines; water ends anywhere. Sides that face appendages, the
        floor or other dark pixels don't count.

        Parameters
        ----------
        sides : Sides
            Of all regions.
        mean_drop : (regions,) float array
            Mean drop of each, dB.

        Returns
        -------
        (regions, 2) int array
        """
        count = len(mean_drop)
        sides = sides.where(sides.facing < self.facings)
        sides = sides.where(self.state[sides.beyond(1, 0)] <= PixelState.RECESS)
        sides = sides.where(self._lost(sides) >= SHARP * mean_drop[sides.label] / STEP["corrected"])
        upright = sides.facing >= 2  # faces along the tunnel, and lies on a line around it
        along, across = np.where(upright, sides.row, sides.column), np.where(upright, sides.column, sides.row)
        most = _most_on_a_line(len(FACING) * sides.label + sides.facing, along, across, len(FACING) * count, self.near)
        return np.column_stack([np.bincount(sides.label, minlength=count), most.reshape(count, len(FACING)).sum(axis=1)])

    def _lost(self, sides: Sides) -> Float:
        """Mean drop inside sides less that outside, steps of the drop; -inf where either is hidden."""
        sums, held = np.zeros((2, len(sides.label)), np.int64), np.zeros((2, len(sides.label)), np.int64)
        hidden = np.zeros(len(sides.label), np.bool_)
        for aside in range(-self.aside, self.aside + 1):
            for k, (along, usable) in enumerate(((1 - self.across, self._interior), (self.across, self._background))):
                row, column = sides.beyond(along, aside)
                there = np.flatnonzero(self._inside(row, column))
                row, column = row[there], column[there]
                if k:
                    hidden[there] |= self.state[row, column] > PixelState.RECESS
                good = usable(row, column)
                sums[k, there[good]] += self.drop[row[good], column[good]]
                held[k, there[good]] += 1
        mean = sums / np.maximum(held, 1)
        return np.where(hidden | (held == 0).any(axis=0), -np.inf, mean[0] - mean[1])

    def _inside(self, row: Int64, column: Int64) -> Bool:
        """Which pixels lie in the image."""
        rows, columns = self.dark.shape
        return (row >= 0) & (row < rows) & (column >= 0) & (column < columns)

    def _interior(self, row: Int64, column: Int64) -> Bool:
        """Which pixels are dark and hold points."""
        return self.dark[row, column] & (self.drop[row, column] != NODATA)

    def _background(self, row: Int64, column: Int64) -> Bool:
        """Which pixels of the lining hold points and are not dark."""
        state = self.state[row, column]
        seen = (state == PixelState.LINING) | (state == PixelState.RECESS)
        return seen & ~self.dark[row, column] & (self.drop[row, column] != NODATA)


def _most_on_a_line(group: Int64, along: Int64, across: Int64, count: int, near: int) -> Int64:
    """Most of the places of each of so many groups that lie on one line: up to so many pixels across from it."""
    most = np.zeros(count, np.int64)
    found, first = np.unique(group, return_index=True)
    start = np.zeros(count, np.int64)
    start[found] = along[first]
    for slope in SLOPES:
        place = np.rint(across - slope * (along - start[group])).astype(np.int64)
        low = int(place.min(initial=0))
        wide = int(place.max(initial=0)) - low + 2 * near + 1  # so far apart that no line is near places of two groups
        line, held = np.unique(group * wide + (place - low), return_counts=True)
        total = np.concatenate([[0], np.cumsum(held)])
        within = total[np.searchsorted(line, line + 2 * near, side="right")] - total[:-1]
        np.maximum.at(most, line // wide, within)
    return most
