"""Evenness of a lining: gaps beneath a straightedge along and around it, by step of chainage, and uneven areas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.measures.evenness.compute.straightedge import Cells, Gaps, gaps_beneath

ALONG, AROUND = "along", "around"


@dataclass(frozen=True)
class Evenness:
    """Evenness of a stretch of lining, in cells (arc, chainage); the arc decreases with the rows.

    Attributes
    ----------
    cells : Cells
        Deviation from the design, m, positive inside.
    along, around : Gaps
        Gaps beneath straightedges along the tunnel, and around its section on a template with the design's curvature.
    """

    cells: Cells
    along: Gaps
    around: Gaps

    @cached_property
    def gap(self) -> Float:
        """Greater gap of both directions, m; NaN where no straightedge fits."""
        return np.asarray(np.fmax(self.along.gap, self.around.gap))


@dataclass(frozen=True)
class StepEvenness:
    """Evenness of a step of chainage.

    Attributes
    ----------
    seen, measured, over : int
        Numbers of cells seen; of these measured with a straightedge; of these with a gap greater than the limit.
    along, around : (rows,) float arrays
        Greatest gap of each row of cells, m; NaN where none was measured.
    waviness, sigma : float
        Greatest depth of a hollow over the distance to its nearer rim; standard deviation of a cell's mean, m. NaN if none.
    """

    seen: int
    measured: int
    over: int
    along: Float
    around: Float
    waviness: float
    sigma: float


@dataclass(frozen=True)
class UnevenAreas:
    """Areas of edge-connected cells with a gap greater than the limit.

    Attributes
    ----------
    label : (rows, columns) int32 array
        Number of the cell's area, from 1; 0 for none.
    cells : (n,) int array
        Number of cells of each area.
    gap : (n,) float array
        Greatest gap of each area, m.
    along : (n,) bool array
        True if the greatest gap is beneath a straightedge along the tunnel, False if around the section.
    """

    label: Int32
    cells: Int64
    gap: Float
    along: Bool


def evenness(cells: Cells, length: float, cell: float) -> Evenness:
    """Measure the gaps beneath a virtual straightedge of a length, m, on cells of a side, m, along and around."""
    along = gaps_beneath(cells.mean, length, cell)
    across = gaps_beneath(np.ascontiguousarray(cells.mean.T), length, cell)
    return Evenness(cells, along, Gaps(across.gap.T, across.waviness.T))


def step_evenness(found: Evenness, columns: slice, limit: float) -> StepEvenness:
    """Summarise the columns of a step, with a limit of the gap, m."""
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


def uneven_areas(found: Evenness, columns: slice, limit: float) -> UnevenAreas:
    """Return the areas in some columns where the gap is greater than a limit, m."""
    gap = np.nan_to_num(found.gap[:, columns])
    label, count = ndimage.label(gap > limit, output=np.int32)
    numbers = np.arange(1, count + 1)
    greatest = np.asarray(ndimage.maximum(gap, label, numbers))
    along = np.asarray(ndimage.maximum(np.nan_to_num(found.along.gap[:, columns]), label, numbers))
    return UnevenAreas(label, np.bincount(label.ravel(), minlength=count + 1)[1:], greatest, along >= greatest)


def _greatest(gap: Float) -> Float:
    """Return the greatest value of each row, NaN if there is none."""
    return np.asarray(np.fmax.reduce(gap, axis=1, initial=np.nan))
