"""From the contrast image of a kilometre to what is dark in it: leaks, joints and other dark spots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.boundary import refine_boundary
from tunneldb.anomalies.joints import crossed_joints, find_joints
from tunneldb.anomalies.regions import Region, find_regions
from tunneldb.anomalies.threshold import dark_pixels, filter_size
from tunneldb.anomalies.verdict import Verdict, classify
from tunneldb.anomalies.windows import count_about, count_in_columns, on_lining, row_blocks
from tunneldb.arrays import Bool, Float, Int64, UInt8
from tunneldb.raster.grid import PixelGrid
from tunneldb.raster.image import WET_EDGE
from tunneldb.raster.pixel_state import PixelState

GAP = 5.0
"""Lining that is seen nowhere along more of the tunnel was not scanned there, m; profiles lie closer."""

SINGLE = 1.6
"""What a single profile shows is no longer than so many spacings: half a gap that is closed to either side of it."""

MIN_JOINT = 0.5
"""Joints that are seen over less are left out, m."""


@dataclass(frozen=True)
class Anomaly:
    """An anomaly in the unrolled plane.

    Attributes
    ----------
    outline : Polygon
        (chainage, arc), m.
    drop_mean, drop_max : float
        Mean and greatest drop below the background, dB.
    contrast : float
        Mean drop in standard deviations of the background about it.
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
    def of(cls, region: Region, min_area: float) -> Anomaly | None:
        """Make an anomaly of a region; None if it holds no point or is too small.

        Leaks and dark spots must not be smaller than ``min_area``, m², joints no shorter than MIN_JOINT.
        """
        if not region.filled:
            return None
        verdict = classify(region)
        if verdict.kind == "joint":
            if max(region.mask.shape) * region.pixel < MIN_JOINT:
                return None
        elif region.area < min_area * (1 - 1e-12):
            return None
        share = region.measured / np.count_nonzero(region.mask)
        return cls(region.outline, region.drop_mean, region.drop_max, region.contrast, float(share), verdict)


@dataclass(frozen=True)
class Detection:
    """What is dark in a kilometre.

    Attributes
    ----------
    anomalies : list of Anomaly
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

    anomalies: list[Anomaly]
    cut: list[Region]
    dark: Bool
    wet: Bool
    size: int
    pixels: int
    wet_pixels: int


def find_anomalies(contrast: ContrastImage, background: BackgroundMap, min_area: float) -> Detection:
    """Find what is dark in a kilometre.

    Parameters
    ----------
    contrast : ContrastImage
        State and drop of its pixels.
    background : BackgroundMap
        What they are relative to.
    min_area : float
        Smaller leaks are left out, m² in the unrolled plane.
    """
    grid, state = contrast.grid, contrast.state
    lining, possible = _lining_in_columns(state, grid.inner)
    size = filter_size(_scanned_share(lining, possible, round(GAP / grid.pixel)))
    pixels = int(lining.sum())
    wet = np.zeros(state.shape, np.bool_)
    if not background.count:
        return Detection([], [], wet.copy(), wet, size, pixels, 0)
    dark = refine_boundary(dark_pixels(contrast, size), contrast, size)
    anomalies, cut, leaks = [], [], []
    ends = (grid.first_column + grid.inner.start, grid.first_column + grid.inner.stop)
    regions = _regions(dark, contrast, min_area)
    judged = [Anomaly.of(region, min_area) for region in regions]
    if contrast.spacing:
        judged = _without_joints(regions, judged, contrast.spacing)
    for region, anomaly in zip(regions, judged, strict=True):
        if region.column == ends[0] or region.stop == ends[1]:
            cut.append(region)
        elif anomaly is not None:
            anomalies.append(anomaly)
        if anomaly is not None and anomaly.verdict.kind == "leak":
            leaks.append(region)
    _draw(wet, leaks, grid)
    wet &= dark
    return Detection(anomalies, cut, dark, wet, size, pixels, sum(region.filled for region in leaks))


def _regions(dark: Bool, contrast: ContrastImage, min_area: float) -> list[Region]:
    """Regions of the dark pixels, joints cut off from what they run through."""
    inner = contrast.grid.inner
    joints = find_joints(dark, inner.start, inner.stop, contrast.grid.pixel, contrast.spacing)
    if not joints.any():
        return find_regions(dark, dark, contrast, min_area, _may_drip)
    parts = [find_regions(part, dark, contrast, min_area, _may_drip) for part in (dark & ~joints, joints)]
    return sorted([*parts[0], *parts[1]], key=lambda region: region.place)


def _without_joints(regions: Sequence[Region], judged: Sequence[Anomaly | None], spacing: float) -> list[Anomaly | None]:
    """Take leaks that a single profile shows and that repeat as rings do for what they are, joints that profiles cross."""
    found = list(judged)
    single = [
        k
        for k, (region, anomaly) in enumerate(zip(regions, judged, strict=True))
        if anomaly is not None and anomaly.verdict.kind == "leak" and region.mask.shape[1] * region.pixel < SINGLE * spacing
    ]
    middle = np.array([0.5 * (regions[k].column + regions[k].stop) * regions[k].pixel for k in single])
    for k, even in zip(single, crossed_joints(middle, spacing).tolist(), strict=True):
        anomaly = found[k]
        if even and anomaly is not None:
            found[k] = replace(anomaly, verdict=Verdict("joint", ("thin", "sparse"), even))
    return found


def _may_drip(region: Region) -> bool:
    return bool(region.filled) and classify(region).kind == "leak"


def background_places(contrast: ContrastImage, detection: Detection, chainage: Float, arc: Float) -> Bool:
    """Tell which places (n,) in the unrolled plane, m, lie on lining of the kilometre that is neither dark nor next to it."""
    inner = contrast.grid.inner
    clear = np.zeros(contrast.state.shape, np.bool_)
    for rows, about in row_blocks(len(clear), WET_EDGE):
        bare = count_about(detection.dark[about], rows, about, WET_EDGE) == 0
        clear[rows, inner] = (bare & on_lining(contrast.state[rows]))[:, inner]
    return contrast.grid.pick(clear, chainage, arc)


def _draw(image: Bool, drawn: Iterable[Region], grid: PixelGrid) -> None:
    """Draw the masks of regions."""
    for region in drawn:
        rows, columns = region.mask.shape
        top, left = grid.bottom + grid.rows - region.row - rows, region.column - grid.first_column
        image[top : top + rows, left : left + columns] |= region.mask[::-1]


def _scanned_share(lining: Int64, possible: Int64, gap: int) -> float:
    """Share of the pixels that could show lining that do, where the tunnel was scanned: without gaps of more columns.

    Parameters
    ----------
    lining, possible : (columns,) int arrays
        Pixels of each column that show lining, and that could.
    gap : int
        Columns.
    """
    columns = np.flatnonzero(lining)
    if len(columns) == 0:
        return 1.0
    until = np.concatenate([[0], np.cumsum(possible)])
    step = np.diff(columns, append=columns[-1] + 1)
    scanned = np.where(step > gap, 1, step)
    # Floor and niches are marked whether or not they hold points.
    return float(lining.sum() / (until[columns + scanned] - until[columns]).sum())


def _lining_in_columns(state: UInt8, columns: slice) -> tuple[Int64, Int64]:
    """Pixels of some columns that show lining, and that could."""
    lining, possible = np.zeros((2, columns.stop - columns.start), np.int64)
    for rows, _ in row_blocks(len(state), 0):
        here = state[rows, columns]
        lining += count_in_columns(on_lining(here))
        possible += count_in_columns(here <= PixelState.RECESS)
    return lining, possible
