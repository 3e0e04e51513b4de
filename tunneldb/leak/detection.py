"""From the picture of a kilometre to leaks: threshold, regions, statistics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import rasterio.features
from numba import njit
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.intensity.dry import Dry, plain_statistics, robust_statistics
from tunneldb.leak.lining import State
from tunneldb.leak.picture import WET_EDGE, Picture
from tunneldb.leak.raster import STEP
from tunneldb.leak.region import Region, regions
from tunneldb.leak.threshold import filter_size, wet_pixels

Float = NDArray[np.float64]

SAMPLE = 2_000_000
"""Pixels, about, that the statistics of dry lining are drawn from."""

GAP = 5.0
"""Lining that is seen nowhere along more of the tunnel was not scanned there, m; profiles lie closer."""


@dataclass(frozen=True)
class Found:
    """A leak in the unrolled plane.

    Attributes
    ----------
    outline : Polygon
        (chainage, arc), m.
    drop_mean, drop_max : float
        Mean and greatest drop below the mean of dry lining, dB.
    image_share : float
        Share of its pixels into which points fell, 0 to 1.
    """

    outline: Polygon
    drop_mean: float
    drop_max: float
    image_share: float

    @classmethod
    def of(cls, region: Region, min_area: float) -> Found | None:
        """Make a leak of a region; None if it is smaller than ``min_area``, m², or holds no point."""
        if region.area < min_area * (1 - 1e-12) or not region.filled:
            return None
        share = region.filled / np.count_nonzero(region.mask)
        return cls(region.outline, region.drop_sum / region.filled, region.drop_max, float(share))


@dataclass(frozen=True)
class Detection:
    """Leaks of a kilometre and what they were told by.

    Attributes
    ----------
    dry : Dry
        Mean and standard deviation of dry lining pixels, dB.
    leaks : list of Found
        Those within the kilometre, in order of chainage.
    cut : list of Region
        Wet regions that reach an end of the kilometre, whatever their size.
    wet : (rows, columns) bool array
        Pixels found wet, before small regions were left out.
    pixels, wet_pixels : int
        Lining pixels of the kilometre, and how many of them are wet.
    """

    dry: Dry
    leaks: list[Found]
    cut: list[Region]
    wet: NDArray[np.bool_]
    pixels: int
    wet_pixels: int


def detect(picture: Picture, min_area: float, dry_regions: list[Polygon] | None = None) -> Detection:
    """Find the leaks of a kilometre.

    Parameters
    ----------
    picture : Picture
        State and intensity of its pixels.
    min_area : float
        Smaller leaks are left out, m² in the unrolled plane.
    dry_regions : list of Polygon, optional
        Dry lining drawn by the user, in the unrolled plane; without it the dry pixels are told from the wet
        ones robustly.
    """
    grid, state, level = picture.grid, picture.state, picture.level
    lining, could = _columns(state, grid.inner.start, grid.inner.stop)
    dry = _dry_statistics(picture, int(lining.sum()), dry_regions or [])
    if not dry.count:
        return Detection(dry, [], [], np.zeros(state.shape, np.bool_), int(lining.sum()), 0)
    size = filter_size(_filled(lining, could, round(GAP / grid.pixel)))
    wet = wet_pixels(state, level, dry.threshold / STEP["corrected"], size)
    leaks, cut = [], []
    ends = (grid.first_column + grid.inner.start, grid.first_column + grid.inner.stop)
    for region in regions(wet, level, grid, dry.mean, min_area):
        if region.column == ends[0] or region.stop == ends[1]:
            cut.append(region)
        elif (leak := Found.of(region, min_area)) is not None:
            leaks.append(leak)
    return Detection(dry, leaks, cut, wet, int(lining.sum()), _wet_lining(state, wet, grid.inner.start, grid.inner.stop))


def dry_places(picture: Picture, found: Detection, chainage: Float, arc: Float) -> NDArray[np.bool_]:
    """Tell which places (n,) in the unrolled plane, m, lie on lining of the kilometre that is neither wet nor next to it."""
    row, column = picture.grid.place(chainage, arc)
    inner = picture.grid.inner
    dry: NDArray[np.bool_] = _dry(picture.state, found.wet, row, column, inner.start, inner.stop)
    return dry


def _filled(lining: NDArray[np.int64], could: NDArray[np.int64], gap: int) -> float:
    """Share of the pixels that could show lining that do, where the tunnel was scanned: without gaps of more columns."""
    columns = np.flatnonzero(lining)
    if len(columns) == 0:
        return 1.0
    until = np.concatenate([[0], np.cumsum(could)])
    step = np.diff(columns, append=columns[-1] + 1)
    scanned = np.where(step > gap, 1, step)
    # Floor and niches are marked whether or not they hold points.
    return float(lining.sum() / (until[columns + scanned] - until[columns]).sum())


def _dry_statistics(picture: Picture, lining: int, dry_regions: list[Polygon]) -> Dry:
    """Statistics of dry lining pixels (eq. 19): of those in the drawn regions, or of all, robustly."""
    inner, step = picture.grid.inner, STEP["corrected"]
    if dry_regions:
        parts = [picture.level[:, columns][chosen] for columns, chosen in _inside(picture, dry_regions)]
        return plain_statistics(np.concatenate(parts) * step if parts else np.zeros(0))
    sample = _sample(picture.state, picture.level, inner.start, inner.stop, max(1, lining // SAMPLE))
    return robust_statistics(sample * step)


def _inside(picture: Picture, polygons: list[Polygon]) -> list[tuple[slice, NDArray[np.bool_]]]:
    """Lining pixels of the kilometre whose centres lie in one of the polygons, block by block."""
    grid, found = picture.grid, []
    for start in range(grid.inner.start, grid.inner.stop, grid.block_columns):
        columns = slice(start, start + grid.block_columns)
        transform, shape = grid.transform(start), (grid.rows, grid.block_columns)
        west, east = transform.c, transform.c + shape[1] * transform.a
        near = [polygon for polygon in polygons if polygon.bounds[0] < east and polygon.bounds[2] > west]
        if near:
            inside = rasterio.features.geometry_mask(near, shape, transform, invert=True)
            found.append(
                (columns, inside & (picture.state[:, columns] >= State.LINING) & (picture.state[:, columns] <= State.RECESS))
            )
    return found


@njit(cache=True, nogil=True)
def _columns(
    state: NDArray[np.uint8], first: int, stop: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:  # pragma: no cover - compiled
    """Pixels of each column that show lining, and that could."""
    lining, could = np.zeros(stop - first, np.int64), np.zeros(stop - first, np.int64)
    for i in range(state.shape[0]):
        for j in range(first, stop):
            lining[j - first] += 1 <= state[i, j] <= 2
            could[j - first] += state[i, j] <= 2
    return lining, could


@njit(cache=True, nogil=True)
def _sample(
    state: NDArray[np.uint8], level: NDArray[np.int16], first: int, stop: int, every: int
) -> NDArray[np.int16]:  # pragma: no cover - compiled
    """Level of every n-th lining pixel."""
    seen, kept = 0, np.empty(2 * SAMPLE, np.int16)
    for i in range(state.shape[0]):
        for j in range(first, stop):
            if 1 <= state[i, j] <= 2:
                if seen % every == 0:
                    kept[seen // every] = level[i, j]
                seen += 1
    return kept[: (seen + every - 1) // every]


@njit(cache=True, nogil=True)
def _wet_lining(state: NDArray[np.uint8], wet: NDArray[np.bool_], first: int, stop: int) -> int:  # pragma: no cover - compiled
    count = 0
    for i in range(state.shape[0]):
        for j in range(first, stop):
            count += wet[i, j] and 1 <= state[i, j] <= 2
    return count


@njit(cache=True, nogil=True)
def _dry(
    state: NDArray[np.uint8],
    wet: NDArray[np.bool_],
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    first: int,
    stop: int,
) -> NDArray[np.bool_]:  # pragma: no cover - compiled
    dry = np.zeros(len(row), np.bool_)
    for k in range(len(row)):
        i, j = row[k], column[k]
        if first <= j < stop and 1 <= state[i, j] <= 2:
            dry[k] = True
            for m in range(max(i - WET_EDGE, 0), min(i + WET_EDGE + 1, state.shape[0])):
                for n in range(max(j - WET_EDGE, 0), min(j + WET_EDGE + 1, state.shape[1])):
                    if wet[m, n]:
                        dry[k] = False
    return dry
