"""From the picture of a kilometre relative to dry lining to what is dark in it: leaks, joints and other dark spots."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numba import njit
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.boundary import refine_boundary
from tunneldb.anomalies.joints import find_joints
from tunneldb.anomalies.regions import Region, find_regions
from tunneldb.anomalies.threshold import dark_pixels, filter_size
from tunneldb.anomalies.verdict import Verdict, judge
from tunneldb.arrays import Bool, Float, Int32, Int64, UInt8
from tunneldb.raster.grid import Grid
from tunneldb.raster.image import WET_EDGE

GAP = 5.0
"""Lining that is seen nowhere along more of the tunnel was not scanned there, m; profiles lie closer."""

MIN_JOINT = 0.5
"""Joints that are seen over less are left out, m."""


@dataclass(frozen=True)
class Found:
    """An anomaly in the unrolled plane.

    Attributes
    ----------
    outline : Polygon
        (chainage, arc), m.
    drop_mean, drop_max : float
        Mean and greatest drop below dry lining, dB.
    contrast : float
        Mean drop in standard deviations of the dry lining about it.
    image_share : float
        Share of its pixels into which points fell, 0 to 1.
    verdict : Verdict
        What it is.
    """

    outline: Polygon
    drop_mean: float
    drop_max: float
    contrast: float
    image_share: float
    verdict: Verdict

    @classmethod
    def of(cls, region: Region, min_area: float) -> Found | None:
        """Make an anomaly of a region; None if it holds no point or is too small.

        Leaks and dark spots must not be smaller than ``min_area``, m², joints no shorter than MIN_JOINT.
        """
        if not region.filled:
            return None
        verdict = judge(region)
        if verdict.kind == "joint":
            if max(region.mask.shape) * region.pixel < MIN_JOINT:
                return None
        elif region.area < min_area * (1 - 1e-12):
            return None
        share = region.filled / np.count_nonzero(region.mask)
        return cls(region.outline, region.drop_mean, region.drop_max, region.contrast, float(share), verdict)


@dataclass(frozen=True)
class Detection:
    """What is dark in a kilometre.

    Attributes
    ----------
    found : list of Found
        Anomalies within the kilometre, in order of chainage.
    cut : list of Region
        Dark regions that reach an end of the kilometre, whatever their size.
    dark : (rows, columns) bool array
        Dark pixels, before small regions were left out.
    wet : (rows, columns) bool array
        Those of leaks.
    size : int
        Side of the median filter, pixels.
    pixels, wet_pixels : int
        Lining pixels of the kilometre, and how many of them are in leaks.
    """

    found: list[Found]
    cut: list[Region]
    dark: Bool
    wet: Bool
    size: int
    pixels: int
    wet_pixels: int


def find_anomalies(relative: ContrastImage, dry: BackgroundMap, min_area: float) -> Detection:
    """Find what is dark in a kilometre.

    Parameters
    ----------
    relative : ContrastImage
        State and drop of its pixels.
    dry : BackgroundMap
        What they are relative to.
    min_area : float
        Smaller leaks are left out, m² in the unrolled plane.
    """
    grid, state = relative.grid, relative.state
    lining, could = _columns(state, grid.inner.start, grid.inner.stop)
    size = filter_size(_filled(lining, could, round(GAP / grid.pixel)))
    pixels = int(lining.sum())
    wet = np.zeros(state.shape, np.bool_)
    if not dry.count:
        return Detection([], [], wet.copy(), wet, size, pixels, 0)
    dark = refine_boundary(dark_pixels(relative, size), relative, size)
    found, cut, leaks = [], [], []
    ends = (grid.first_column + grid.inner.start, grid.first_column + grid.inner.stop)
    for region in _regions(dark, relative, min_area):
        anomaly = Found.of(region, min_area)
        if region.column == ends[0] or region.stop == ends[1]:
            cut.append(region)
        elif anomaly is not None:
            found.append(anomaly)
        if anomaly is not None and anomaly.verdict.kind == "leak":
            leaks.append(region)
    _draw(wet, leaks, grid)
    wet &= dark
    return Detection(found, cut, dark, wet, size, pixels, sum(region.filled for region in leaks))


def _regions(dark: Bool, relative: ContrastImage, min_area: float) -> list[Region]:
    """Regions of the dark pixels, joints cut off from what they run through."""
    inner = relative.grid.inner
    joints = find_joints(dark, inner.start, inner.stop, relative.grid.pixel)
    if not joints.any():
        return find_regions(dark, dark, relative, min_area, _may_drip)
    parts = [find_regions(part, dark, relative, min_area, _may_drip) for part in (dark & ~joints, joints)]
    return sorted([*parts[0], *parts[1]], key=lambda region: (region.column, region.row))


def _may_drip(region: Region) -> bool:
    return bool(region.filled) and judge(region).kind == "leak"


def dry_places(relative: ContrastImage, found: Detection, chainage: Float, arc: Float) -> Bool:
    """Tell which places (n,) in the unrolled plane, m, lie on lining of the kilometre that is neither dark nor next to it."""
    row, column = relative.grid.place(chainage, arc)
    inner = relative.grid.inner
    dry: Bool = _dry(relative.state, found.dark, row, column, inner.start, inner.stop)
    return dry


def _draw(image: Bool, drawn: Iterable[Region], grid: Grid) -> None:
    """Draw the masks of regions."""
    for region in drawn:
        rows, columns = region.mask.shape
        top, left = grid.bottom + grid.rows - region.row - rows, region.column - grid.first_column
        image[top : top + rows, left : left + columns] |= region.mask[::-1]


def _filled(lining: Int64, could: Int64, gap: int) -> float:
    """Share of the pixels that could show lining that do, where the tunnel was scanned: without gaps of more columns."""
    columns = np.flatnonzero(lining)
    if len(columns) == 0:
        return 1.0
    until = np.concatenate([[0], np.cumsum(could)])
    step = np.diff(columns, append=columns[-1] + 1)
    scanned = np.where(step > gap, 1, step)
    # Floor and niches are marked whether or not they hold points.
    return float(lining.sum() / (until[columns + scanned] - until[columns]).sum())


@njit(cache=True, nogil=True)
def _columns(state: UInt8, first: int, stop: int) -> tuple[Int64, Int64]:  # pragma: no cover - compiled
    """Pixels of each column that show lining, and that could."""
    lining, could = np.zeros(stop - first, np.int64), np.zeros(stop - first, np.int64)
    for i in range(state.shape[0]):
        for j in range(first, stop):
            lining[j - first] += 1 <= state[i, j] <= 2
            could[j - first] += state[i, j] <= 2
    return lining, could


@njit(cache=True, nogil=True)
def _dry(
    state: UInt8,
    dark: Bool,
    row: Int32,
    column: Int32,
    first: int,
    stop: int,
) -> Bool:  # pragma: no cover - compiled
    dry = np.zeros(len(row), np.bool_)
    for k in range(len(row)):
        i, j = row[k], column[k]
        if first <= j < stop and 1 <= state[i, j] <= 2:
            dry[k] = True
            for m in range(max(i - WET_EDGE, 0), min(i + WET_EDGE + 1, state.shape[0])):
                for n in range(max(j - WET_EDGE, 0), min(j + WET_EDGE + 1, state.shape[1])):
                    if dark[m, n]:
                        dry[k] = False
    return dry
