"""Offsets of an epoch in cells of the unrolled plane: a plane is fitted to the pixels of each cell."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Single

STEP = 0.001
"""Step in which offsets are stored, m."""

MIN_SEEN_SHARE = 1.0 / 3.0
"""Minimum share of a cell's pixels that are lining; with less the cell was not seen."""

MIN_SIDE = 3
"""Minimum side of a cell, in pixels: a plane takes three pixels, and scatter needs several."""

SLOPE_LEVEL = 3.0
"""Standard deviations from which a slope is one of the relief."""

EDGE_CELLS = 2
"""Width of the margin beside wide unseen stretches that is not compared, in cells."""

_SUMS = 10
_MIN_PIXELS = 8  # pixels
_MIN_SPREAD = (
    0.2  # minimum spread of the pixels relative to a full cell (1/12 of its side squared): else the plane extrapolates
)


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
    """Offsets of an epoch by cell, (rows, columns) float32 each; NaN where not seen.

    Attributes
    ----------
    offset : m
        Offset of the fitted plane in the middle of the cell, positive inwards.
    variance : m²
        Variance of that, from the scatter of the pixels about the plane, as if independent, and from the rounding of offsets.
    share : 0 to 1
        Share of the cell's pixels that show the lining or a recess of it; 0 where none does.
    """

    offset: Single
    variance: Single
    share: Single


@dataclass
class CellSums:
    """Sums over the pixels of each cell, for fitting planes."""

    grid: CellGrid
    pixel: float
    lining: Single = field(init=False)
    recess: Single = field(init=False)

    def __post_init__(self) -> None:
        self.lining, self.recess = (np.zeros((_SUMS, self.grid.rows * self.grid.columns), np.float32) for _ in range(2))

    def add(self, chainage: Float, arc: Float, offset: Float, lining: Bool) -> None:
        """Add pixels (n,): chainage, arc and offset in the plane of the cells, m, and whether each is lining.

        Other pixels are recessed behind the lining: the back of a niche, or a hollow. NaN is skipped.
        """
        grid = self.grid
        x, y = (chainage - grid.west) / grid.cell, (arc - grid.south) / grid.cell
        with np.errstate(invalid="ignore"):
            valid = (x >= 0) & (x < grid.columns) & (y >= 0) & (y < grid.rows) & np.isfinite(offset)
        x, y, z, shown = x[valid], y[valid], offset[valid], lining[valid]
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
        """Fit planes to the cells that were seen, from their lining, and with ``recesses`` from recesses too."""
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
            (n >= _MIN_PIXELS)
            & (n >= MIN_SEEN_SHARE * pixels)
            & (np.minimum(uu, vv) * 12.0 > _MIN_SPREAD)
            & (determinant * 144.0 > _MIN_SPREAD**2)
        )
        shape = self.grid.rows, self.grid.columns

        def shown(values: Float) -> Single:
            return np.where(seen, values, np.nan).astype(np.float32).reshape(shape)

        return Cells(shown(offset), shown(variance), np.minimum(looked / pixels, 1.0).astype(np.float32).reshape(shape))


def with_hollows(old: CellSums, new: CellSums) -> tuple[Cells, Cells]:
    """Return the cells of two epochs by their lining, and by everything seen where a hollow appeared or was filled.

    A spall deeper than the recess limit of the lining is no longer lining. Where only one epoch shows lining, over 3 by 3 cells
    or more, and the other a recess, both are taken with their recesses, so that different parts of a cell are not compared.
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
    """Return cells without those beside parts not inspected of at least 3 by 3 cells.

    At the foot of a wall, and beside fixtures, cells contain mixed pixels, which differ between epochs. The smoothing in
    the state of pixels reaches one cell further.
    """
    unseen = ndimage.binary_opening(np.isnan(cells.offset), np.ones((3, 3)))
    beside = ndimage.binary_dilation(unseen, np.ones((3, 3)), iterations=EDGE_CELLS)
    offset, variance = (np.where(beside, np.float32(np.nan), values) for values in (cells.offset, cells.variance))
    return Cells(offset, variance, cells.share)


def slopes(cells: Cells, cell: float) -> tuple[Single, Single]:
    """Return the slopes of the lining's relief along the tunnel and around it, (rows, columns), over two cells.

    0 where one of them is not seen, and where the slope is at most SLOPE_LEVEL times its noise.
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
            found.append(np.where(np.abs(slope) > SLOPE_LEVEL * noise, slope, 0.0).astype(np.float32))
    return found[0], found[1]


def rounding_variance(scatter: Float) -> Float:
    """Return the variance (n,) of a mean of offsets from their rounding, m², that their own scatter (n,), m², leaves.

    The mean of values with normal scatter s, rounded to steps q, deviates by at most q / π · exp(-2 π² s² / q²) (Widrow &
    Kollár, 2008, eq. 4.27), depending on its place between two steps; the variance of that sine is half its square.
    """
    return np.asarray(0.5 * (STEP / np.pi * np.exp(-2.0 * (np.pi / STEP) ** 2 * scatter)) ** 2)
