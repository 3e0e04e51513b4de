"""How even a lining is: gaps beneath a straightedge along and around it, by steps of chainage, and where they are too large."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float
from tunneldb.shape.straightedge import Cells, Gaps, gaps_beneath

ALONG, AROUND = "along", "around"


@dataclass(frozen=True)
class Evenness:
    """Of a stretch of lining, in cells (arc, chainage), arc falling with the rows.

    Attributes
    ----------
    cells : Cells
        Deviation from the design, m, positive inside.
    along, around : Gaps
        Beneath straightedges laid along the tunnel, and around its section on a template of the design's curvature.
    """

    cells: Cells
    along: Gaps
    around: Gaps

    @cached_property
    def gap(self) -> Float:
        """The greater gap of both ways, m; NaN where no straightedge could be laid."""
        return np.asarray(np.fmax(self.along.gap, self.around.gap))


@dataclass(frozen=True)
class StepEvenness:
    """Of a step of chainage.

    Attributes
    ----------
    seen, measured, over : int
        Cells seen; of these those beneath a straightedge; of these those with a greater gap than the limit.
    along, around : (rows,) float arrays
        Greatest gap of each row of cells, m; NaN where none could be laid.
    waviness, sigma : float
        Greatest depth of a hollow over the way to its nearer rim; standard deviation of a cell's mean, m. NaN without any.
    """

    seen: int
    measured: int
    over: int
    along: Float
    around: Float
    waviness: float
    sigma: float


@dataclass(frozen=True)
class UnevenArea:
    """Cells that hang together by their sides, with a greater gap than the limit.

    Attributes
    ----------
    mask : (rows, columns) bool array
    row, column : int
        Its first row and column.
    cells : int
    gap : float
        Greatest gap in it, m.
    direction : str
        How the straightedge lay that has it.
    """

    mask: Bool
    row: int
    column: int
    cells: int
    gap: float
    direction: str


def evenness(cells: Cells, length: float, cell: float) -> Evenness:
    """Lay a straightedge of a length, m, on cells of a side, m, along and around."""
    along = gaps_beneath(cells.mean, length, cell)
    across = gaps_beneath(np.ascontiguousarray(cells.mean.T), length, cell)
    return Evenness(cells, along, Gaps(across.gap.T, across.waviness.T))


def step_evenness(found: Evenness, columns: slice, limit: float) -> StepEvenness:
    """Sum up the columns of a step, with a limit of the gap, m."""
    gap, seen = found.gap[:, columns], np.isfinite(found.cells.mean[:, columns])
    waves = np.fmax(found.along.waviness[:, columns], found.around.waviness[:, columns])
    sigma = found.cells.sigma[:, columns][seen]
    return StepEvenness(
        seen=int(seen.sum()),
        measured=int((seen & np.isfinite(gap)).sum()),
        over=int((gap > limit).sum()),
        along=_greatest(found.along.gap[:, columns]),
        around=_greatest(found.around.gap[:, columns]),
        waviness=float(np.fmax.reduce(waves, axis=None, initial=np.nan)),
        sigma=float(np.sqrt(np.mean(sigma**2))) if len(sigma) else np.nan,
    )


def uneven_areas(found: Evenness, columns: slice, limit: float) -> Iterator[UnevenArea]:
    """Where, in some columns, the gap is greater than a limit, m."""
    along, around = found.along.gap[:, columns], found.around.gap[:, columns]
    gap = np.nan_to_num(np.fmax(along, around))
    label, count = ndimage.label(gap > limit)
    for number, (rows, across) in enumerate(ndimage.find_objects(label, count), start=1):
        mask = label[rows, across] == number
        greatest = float(gap[rows, across][mask].max())
        laid_along = np.nan_to_num(along[rows, across])[mask].max() >= greatest
        yield UnevenArea(mask, rows.start, across.start, int(mask.sum()), greatest, ALONG if laid_along else AROUND)


def _greatest(gap: Float) -> Float:
    """Greatest of each row, NaN where there is none."""
    return np.asarray(np.fmax.reduce(gap, axis=1, initial=np.nan))
