"""Detect leaks, joints and other dark areas in the contrast image of a kilometre."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.level_map import BackgroundMap
from tunneldb.anomalies.boundary import refine_boundary
from tunneldb.anomalies.evidence import EvidenceModel
from tunneldb.anomalies.features import measure_regions
from tunneldb.anomalies.hidden import behind_strips
from tunneldb.anomalies.joints import crossed_joints, find_joints
from tunneldb.anomalies.levels import weaker_parts
from tunneldb.anomalies.records import Anomaly
from tunneldb.anomalies.regions import Region, find_regions
from tunneldb.anomalies.threshold import dark_pixels, filter_size
from tunneldb.anomalies.verdict import classify
from tunneldb.anomalies.windows import count_about, count_in_columns, on_lining, row_blocks
from tunneldb.arrays import Bool, Float, Int64, UInt8
from tunneldb.finding_kind import FindingKind
from tunneldb.raster.grid import PixelGrid
from tunneldb.raster.image import WET_EDGE
from tunneldb.raster.state import PixelState

MIN_UNSCANNED_LENGTH = 5.0
"""Length of the tunnel without any seen lining from which it was not scanned, m; profiles are closer."""

MAX_SINGLE_SPACINGS = 1.6
"""Maximum length of a spot on a single profile, in spacings: half a gap is closed on either side of it."""

RIM = 0.06
"""Width of the rim of water that is no region of its own, m: pixels of 4 cm, and the blur of a boundary."""

MIN_JOINT_LENGTH = 0.5
"""Minimum seen length of joints, m."""


@dataclass(frozen=True)
class Detection:
    """Dark areas of a kilometre.

    Attributes
    ----------
    anomalies : list of Anomaly
        Anomalies within the kilometre, in order of chainage.
    cut : list of Region
        Dark regions that reach an end of the kilometre, whatever their size.
    dark : (rows, columns) bool array
        Dark pixels, before small regions were left out.
    wet : (rows, columns) bool array
        Dark pixels of leaks.
    size : int
        Side of the median filter, pixels.
    pixels, wet_pixels : int
        Number of lining pixels of the kilometre, and of these in leaks.
    """

    anomalies: list[Anomaly]
    cut: list[Region]
    dark: Bool
    wet: Bool
    size: int
    pixels: int
    wet_pixels: int


@dataclass(frozen=True)
class DarkPixels:
    """Dark pixels of a picture.

    Attributes
    ----------
    pixels : (rows, columns) bool array
        All dark pixels.
    water : (rows, columns) bool array or None
        Those of them that a segmentation network classifies as water; None if there is none.
    size : int
        Side of the median filter that was applied, pixels.
    """

    pixels: Bool
    water: Bool | None
    size: int


def find_anomalies(
    contrast: ContrastImage, background: BackgroundMap, min_area: float, model: EvidenceModel | None = None
) -> Detection:
    """Find leaks, joints and other dark areas in a kilometre.

    Parameters
    ----------
    contrast : ContrastImage
        State and darkening of its pixels.
    background : BackgroundMap
        Background that they are relative to.
    min_area : float
        Minimum area of a leak, m² in the unrolled plane.
    model : EvidenceModel, optional
        Model that classifies regions; by default the one of the program. The extent of regions does not depend on it.
    """
    grid, state = contrast.grid, contrast.state
    lining, _ = _lining_in_columns(state, grid.inner)
    pixels = int(lining.sum())
    wet = np.zeros(state.shape, np.bool_)
    if not background.count:
        return Detection([], [], wet.copy(), wet, filter_size(1.0), pixels, 0)
    dark = find_dark(contrast)
    anomalies, cut, leaks = [], [], []
    ends = (grid.first_column + grid.inner.start, grid.first_column + grid.inner.stop)
    regions = find_dark_regions(dark, contrast, min_area)
    classified = _classified(regions, min_area, model)
    if contrast.spacing:
        classified = _without_joints(regions, classified, contrast.spacing)
    for region, anomaly in zip(regions, classified, strict=True):
        if region.column == ends[0] or region.stop == ends[1]:
            cut.append(region)
        elif anomaly is not None:
            anomalies.append(anomaly)
        if anomaly is not None and anomaly.verdict.kind == FindingKind.LEAK:
            leaks.append(region)
    _draw(wet, leaks, grid)
    wet &= dark.pixels
    return Detection(anomalies, cut, dark.pixels, wet, dark.size, pixels, sum(region.filled for region in leaks))


def is_large_enough(region: Region, min_area: float) -> bool:
    """Return True if a region has points, and is large enough for a leak, m², or long enough for a joint."""
    large = region.area >= min_area * (1 - 1e-12) or max(region.mask.shape) * region.pixel >= MIN_JOINT_LENGTH
    return bool(region.filled) and large


def classify_region(
    region: Region, min_area: float, features: Float | None = None, model: EvidenceModel | None = None
) -> Anomaly | None:
    """Classify a region by its features and a model; None if it has no points or is too small.

    Leaks and dry dark areas must not be smaller than ``min_area``, m², joints no shorter than MIN_JOINT_LENGTH.
    """
    if not is_large_enough(region, min_area):
        return None
    verdict = classify(region, features, model)
    if verdict.kind == FindingKind.JOINT:
        if max(region.mask.shape) * region.pixel < MIN_JOINT_LENGTH:
            return None
    elif region.area < min_area * (1 - 1e-12):
        return None
    share = region.measured / np.count_nonzero(region.mask)
    return Anomaly(region.outline, region.darkening_mean, region.darkening_max, region.contrast, float(share), verdict)


def _classified(regions: Sequence[Region], min_area: float, model: EvidenceModel | None) -> list[Anomaly | None]:
    """Classify the regions of a kilometre, each compared with those around it; None for those that are too small."""
    found: list[Anomaly | None] = [None] * len(regions)
    large_enough = [k for k, region in enumerate(regions) if is_large_enough(region, min_area)]
    for k, features in zip(large_enough, measure_regions([regions[k] for k in large_enough]), strict=True):
        found[k] = classify_region(regions[k], min_area, features, model)
    return found


def find_dark(contrast: ContrastImage) -> DarkPixels:
    """Mark dark pixels: above the threshold, or water, with the boundaries moved to half of their contrast."""
    lining, possible = _lining_in_columns(contrast.state, contrast.grid.inner)
    size = filter_size(_scanned_share(lining, possible, round(MIN_UNSCANNED_LENGTH / contrast.grid.pixel)))
    dark = refine_boundary(dark_pixels(contrast, size), contrast, size)
    water = contrast.wet()
    if water is not None:
        water = refine_boundary(water, contrast, size)
        dark |= water
    return DarkPixels(dark, water, size)


def find_dark_regions(dark: DarkPixels, contrast: ContrastImage, min_area: float) -> list[Region]:
    """Find the regions of dark pixels that may be leaks, joints or dry dark areas, with joints cut off."""
    inner, pixel = contrast.grid.inner, contrast.grid.pixel
    pixels, water = dark.pixels, dark.water
    rest = pixels if water is None else pixels & ~_widened(water, round(RIM / pixel))
    joints = find_joints(rest, inner.start, inner.stop, pixel, contrast.spacing)
    plain = rest & ~joints
    weak = weaker_parts(plain, contrast)
    # For the darker region, the weaker part of a region is not dark lining: the region ends at it.
    parts = [(plain & ~weak, pixels & ~weak), (weak, pixels), (joints, pixels)]
    if water is not None:
        parts.append((water, water))
    found = []
    for part, others in parts:
        if part.any():
            whole = part | behind_strips(part, contrast.state, inner.start, inner.stop, pixel)
            found += find_regions(whole, others, contrast, min_area, _may_drip)
    return sorted(found, key=lambda region: region.place)


def _widened(mask: Bool, by: int) -> Bool:
    """Return the pixels of a mask and those within a square about each."""
    size = 2 * by + 1
    return np.asarray(ndimage.maximum_filter(mask.view(np.uint8), size) > 0)


def _may_drip(region: Region) -> bool:
    # By the program's own model: the extent of a region must not change with what is learned from it.
    return bool(region.filled) and classify(region).kind == FindingKind.LEAK


def _without_joints(regions: Sequence[Region], classified: Sequence[Anomaly | None], spacing: float) -> list[Anomaly | None]:
    """Reclassify as joints those leaks on single profiles that repeat at the ring length."""
    found = list(classified)
    single = [
        k
        for k, (region, anomaly) in enumerate(zip(regions, classified, strict=True))
        if anomaly is not None
        and anomaly.verdict.kind == FindingKind.LEAK
        and region.mask.shape[1] * region.pixel < MAX_SINGLE_SPACINGS * spacing
    ]
    middle = np.array([0.5 * (regions[k].column + regions[k].stop) * regions[k].pixel for k in single])
    for k, even in zip(single, crossed_joints(middle, spacing).tolist(), strict=True):
        anomaly = found[k]
        if even and anomaly is not None:
            verdict = replace(anomaly.verdict, kind=FindingKind.JOINT, reasons=("thin", "sparse"), confidence=even)
            found[k] = replace(anomaly, verdict=verdict)
    return found


def background_places(contrast: ContrastImage, detection: Detection, chainage: Float, arc: Float) -> Bool:
    """Return True for places (n,) in the unrolled plane, m, on lining that is neither dark nor next to dark pixels."""
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
    """Return the share of possible lining pixels that show lining, in the scanned tunnel: without gaps of more columns.

    Parameters
    ----------
    lining, possible : (columns,) int arrays
        Pixels of each column that show lining, and that could show it.
    gap : int
        Maximum gap, columns.
    """
    columns = np.flatnonzero(lining)
    if len(columns) == 0:
        return 1.0
    until = np.concatenate([[0], np.cumsum(possible)])
    step = np.diff(columns, append=columns[-1] + 1)
    scanned = np.where(step > gap, 1, step)
    # Floor and niches are marked whether or not they have points.
    return float(lining.sum() / (until[columns + scanned] - until[columns]).sum())


def _lining_in_columns(state: UInt8, columns: slice) -> tuple[Int64, Int64]:
    """Count the pixels of some columns that show lining, and that could show it."""
    lining, possible = np.zeros((2, columns.stop - columns.start), np.int64)
    for rows, _ in row_blocks(len(state), 0):
        here = state[rows, columns]
        lining += count_in_columns(on_lining(here))
        possible += count_in_columns(here <= PixelState.RECESS)
    return lining, possible
