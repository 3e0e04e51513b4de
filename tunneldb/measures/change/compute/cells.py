"""Offsets of an epoch in cells of the unrolled plane: a plane is fitted to the pixels of each cell."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single

STEP = 0.001
"""Step in which offsets are stored, m."""

SEEN_SHARE = 1.0 / 3.0
"""A cell of which a smaller share of the pixels is lining was not seen."""

LEAST_SIDE = 3
"""Side of a cell, in pixels, at least: a plane takes three pixels, and a scatter by few says little."""

SLOPE = 3.0
"""Slopes are of relief from so many standard deviations on."""

EDGE = 2
"""Cells so near to a wide stretch of what is not seen are not compared."""

_SUMS = 10
_LEAST = 8  # pixels
_SPREAD = 0.2  # of the pixels in a cell, against that of a full one (1/12 of its side squared): else the plane hangs in the air


@dataclass(frozen=True)
class CellGrid:
    """Cells of a stretch of the unrolled plane: columns along the chainage, rows from the least arc up.

    Attributes
    ----------
    cell : float
        Side, m.
    west, south : float
        Chainage and arc at which the first cell begins, m.
    columns, rows : int
    """

    cell: float
    west: float
    south: float
    columns: int
    rows: int

    @property
    def chainage(self) -> Float:
        """Middles of the columns, m."""
        return np.asarray(self.west + (np.arange(self.columns) + 0.5) * self.cell)

    @property
    def arc(self) -> Float:
        """Middles of the rows, m."""
        return np.asarray(self.south + (np.arange(self.rows) + 0.5) * self.cell)


@dataclass(frozen=True)
class Cells:
    """What an epoch shows of the cells, (rows, columns) float32 each; NaN where it did not see them.

    Attributes
    ----------
    offset : m
        Of the fitted plane in the middle of the cell, positive inwards.
    variance : m²
        Of that, by the scatter of the pixels about the plane, as if they were independent, and by the rounding of offsets.
    share : 0 to 1
        Of the cell's pixels that show the lining or a recess of it; 0 where none does.
    """

    offset: Single
    variance: Single
    share: Single


@dataclass
class CellSums:
    """Sums over the pixels of each cell, of which the planes are made."""

    grid: CellGrid
    pixel: float
    lining: Single = field(init=False)
    recess: Single = field(init=False)

    def __post_init__(self) -> None:
        self.lining, self.recess = (np.zeros((_SUMS, self.grid.rows * self.grid.columns), np.float32) for _ in range(2))

    def add(self, chainage: Float, arc: Float, offset: Float, lining: Bool) -> None:
        """Add pixels (n,): chainage, arc and offset in the plane of the cells, m, and which are lining.

        What else is seen is recessed behind it: the back of a niche, a hollow. NaN is passed over.
        """
        grid = self.grid
        x, y = (chainage - grid.west) / grid.cell, (arc - grid.south) / grid.cell
        with np.errstate(invalid="ignore"):
            held = (x >= 0) & (x < grid.columns) & (y >= 0) & (y < grid.rows) & np.isfinite(offset)
        x, y, z, shown = x[held], y[held], offset[held], lining[held]
        column, row = x.astype(np.int64), y.astype(np.int64)
        if not len(column):
            return
        first, last = int(column.min()), int(column.max()) + 1
        width = last - first
        place = row * width + column - first
        u, v = x - column - 0.5, y - row - 0.5
        for sums, of in ((self.lining, shown), (self.recess, ~shown)):
            if not of.any():
                continue
            part = sums.reshape(_SUMS, grid.rows, grid.columns)[:, :, first:last]
            for k, weight in enumerate((None, u, v, u * u, u * v, v * v, z, u * z, v * z, z * z)):
                count = np.bincount(place[of], None if weight is None else weight[of], minlength=grid.rows * width)
                part[k] += count.reshape(grid.rows, width)

    def cells(self, recesses: bool = False) -> Cells:
        """Planes of the cells that were seen, by their lining, or by their recesses, too."""
        looked = self.lining[0] + self.recess[0].astype(np.float64)
        n, u, v, uu, uv, vv, z, uz, vz, zz = (self.lining + self.recess if recesses else self.lining).astype(np.float64)
        pixels = (self.grid.cell / self.pixel) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, z = u / n, v / n, z / n
            uu, uv, vv = uu / n - u * u, uv / n - u * v, vv / n - v * v
            uz, vz, zz = uz / n - u * z, vz / n - v * z, zz / n - z * z
            determinant = uu * vv - uv * uv
            along, across = (vv * uz - uv * vz) / determinant, (uu * vz - uv * uz) / determinant
            scatter = np.maximum(zz - along * uz - across * vz, 0.0) * n / np.maximum(n - 3.0, 1.0)
            lever = 1.0 / n * (1.0 + (vv * u * u - 2.0 * uv * u * v + uu * v * v) / determinant)
            offset = z - along * u - across * v
            variance = scatter * lever + rounding_variance(scatter)
        seen = (
            (n >= _LEAST)
            & (n >= SEEN_SHARE * pixels)
            & (np.minimum(uu, vv) * 12.0 > _SPREAD)
            & (determinant * 144.0 > _SPREAD**2)
        )
        shape = self.grid.rows, self.grid.columns

        def shown(values: Float) -> Single:
            return np.where(seen, values, np.nan).astype(np.float32).reshape(shape)

        return Cells(shown(offset), shown(variance), np.minimum(looked / pixels, 1.0).astype(np.float32).reshape(shape))


def with_hollows(old: CellSums, new: CellSums) -> tuple[Cells, Cells]:
    """Cells of two epochs by their lining, and by all that they show where a hollow came or was filled.

    A spall deeper than lining may stand back is no lining any more. Where only one epoch shows lining, over 3 by 3 cells and
    more, and the other a recess, both are taken with their recesses, lest the mean of a part is held against that of another.
    """
    cells, deep = ([sums.cells(recesses) for sums in (old, new)] for recesses in (False, True))
    one = np.isnan(cells[0].offset) != np.isnan(cells[1].offset)
    both = np.isfinite(deep[0].offset) & np.isfinite(deep[1].offset)
    hollow = ndimage.binary_opening(one & both, np.ones((3, 3)))
    first, second = (
        Cells(np.where(hollow, d.offset, c.offset), np.where(hollow, d.variance, c.variance), c.share)
        for c, d in zip(cells, deep, strict=True)
    )
    return first, second


def without_edges(cells: Cells) -> Cells:
    """Cells without those beside what is not seen, as far as that is no less than 3 by 3 cells.

    At the foot of a wall, and beside what hangs on it, cells hold mixed pixels, and others in each epoch; what is
    smoothed in the state of pixels reaches a cell further.
    """
    unseen = ndimage.binary_opening(np.isnan(cells.offset), np.ones((3, 3)))
    beside = ndimage.binary_dilation(unseen, np.ones((3, 3)), iterations=EDGE)
    offset, variance = (np.where(beside, np.float32(np.nan), values) for values in (cells.offset, cells.variance))
    return Cells(offset, variance, cells.share)


def slopes(cells: Cells, cell: float) -> tuple[Single, Single]:
    """Slope of the lining's relief along the tunnel and around it, (rows, columns), over two cells.

    0 where one of them is not seen, and where it is no more than SLOPE times its noise: a smooth lining has none.
    """
    found = []
    for axis in (1, 0):
        padding = [(0, 0), (0, 0)]
        padding[axis] = (1, 1)
        count = cells.offset.shape[axis]
        ahead, behind = (np.arange(count) + shift for shift in (2, 0))
        offset, variance = (
            np.pad(values.astype(np.float64), padding, constant_values=np.nan) for values in (cells.offset, cells.variance)
        )
        slope = (np.take(offset, ahead, axis) - np.take(offset, behind, axis)) / (2.0 * cell)
        noise = np.sqrt(np.take(variance, ahead, axis) + np.take(variance, behind, axis)) / (2.0 * cell)
        with np.errstate(invalid="ignore"):
            found.append(np.where(np.abs(slope) > SLOPE * noise, slope, 0.0).astype(np.float32))
    return found[0], found[1]


def rounding_variance(scatter: Float) -> Float:
    """Variance (n,) of a mean of offsets by their rounding, m², beyond what their own scatter (n,), m², averages out.

    The mean of values with normal scatter s, rounded to steps q, is off by at most q / π · exp(-2 π² s² / q²) (Widrow &
    Kollár, 2008, eq. 4.27), wherever between two steps it lies; the sine of that has half the variance.
    """
    return np.asarray(0.5 * (STEP / np.pi * np.exp(-2.0 * (np.pi / STEP) ** 2 * scatter)) ** 2)
