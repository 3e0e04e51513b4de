"""From the unrolled image of a kilometre to leaks: threshold, polygons, statistics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import rasterio.features
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely.geometry import Polygon

from tunneldb.intensity.dry import Dry, plain_statistics, robust_statistics
from tunneldb.leak.image import Accumulator, Window
from tunneldb.leak.lining import State, block_columns
from tunneldb.leak.polygon import polygons
from tunneldb.leak.threshold import filter_size, wet_pixels

SAMPLE = 2_000_000
"""Pixels, about, that the statistics of dry lining are drawn from."""

WET_EDGE = 3
"""Pixels about a wet one that don't count as dry lining."""

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
        Share of the polygon's pixels into which points fell, 0 to 1.
    """

    outline: Polygon
    drop_mean: float
    drop_max: float
    image_share: float


@dataclass(frozen=True)
class Detection:
    """Leaks of a kilometre and what they were told by.

    Attributes
    ----------
    dry : Dry
        Mean and standard deviation of dry lining pixels, dB.
    leaks : list of Found
        In order of chainage.
    wet : (rows, columns) bool array
        Pixels found wet, before small regions were left out.
    pixels, wet_pixels : int
        Lining pixels, and how many of them are wet.
    """

    dry: Dry
    leaks: list[Found]
    wet: NDArray[np.bool_]
    pixels: int
    wet_pixels: int


def detect(
    image: Accumulator, state: NDArray[np.uint8], min_area: float, dry_regions: list[Polygon] | None = None
) -> Detection:
    """Find the leaks of a kilometre.

    Parameters
    ----------
    image : Accumulator
        The sums of all points.
    state : (rows, columns) uint8 array
        What each pixel shows, see :func:`tunneldb.leak.lining.states`.
    min_area : float
        Smaller leaks are left out, m² in the unrolled plane.
    dry_regions : list of Polygon, optional
        Dry lining drawn by the user, in the unrolled plane; without it the dry pixels are told from the wet
        ones robustly.
    """
    grid = image.grid
    blocks = image.blocks()
    dry = _dry_statistics(image, state, blocks, dry_regions or [])
    lining = int(np.count_nonzero(state == State.LINING))
    size = filter_size(_filled(state, round(GAP / grid.pixel)))
    wet = np.zeros(state.shape, np.bool_)
    if dry.count:
        for block in blocks:
            columns = block_columns(grid, block)
            window = image.window(columns.start - size, columns.stop + size)
            inner = slice(columns.start - window.columns.start, columns.stop - window.columns.start)
            here = state[:, window.columns]
            closed = (here == State.OFF) | (here == State.FLOOR)
            found = wet_pixels(window.corrected, here == State.LINING, closed, dry.threshold, size)
            wet[:, columns] = found[:, inner]
    outlines = polygons(wet, grid.transform(), min_area)
    return Detection(
        dry=dry,
        leaks=_statistics(image, blocks, outlines, dry.mean),
        wet=wet,
        pixels=lining,
        wet_pixels=int(np.count_nonzero(wet & (state == State.LINING))),
    )


def _filled(state: NDArray[np.uint8], gap: int) -> float:
    """Share of the pixels that could show lining that do, where the tunnel was scanned: not in gaps of more columns."""
    lining = np.count_nonzero(state == State.LINING, axis=0)
    seen = np.flatnonzero(lining)
    if len(seen) == 0:
        return 1.0
    # Floor and niches are marked whether or not they hold points.
    possible = np.count_nonzero(state <= State.LINING, axis=0)
    ends = np.concatenate([[-gap - 1], seen, [len(lining) + gap]])
    for k in np.flatnonzero(np.diff(ends) > gap):
        possible[max(ends[k] + 1, 0) : ends[k + 1]] = 0
    return float(lining.sum() / possible.sum())


def dry_pixels(image: Accumulator, state: NDArray[np.uint8], found: Detection) -> NDArray[np.bool_]:
    """Lining pixels that are neither wet nor next to a wet one."""
    dry = state == State.LINING
    for block in image.blocks():
        columns = block_columns(image.grid, block)
        near = slice(max(columns.start - WET_EDGE, 0), columns.stop + WET_EDGE)
        wet = found.wet[:, near]
        if wet.any():
            edge = ndimage.maximum_filter(wet.view(np.uint8), 2 * WET_EDGE + 1)
            dry[:, columns] &= edge[:, columns.start - near.start :][:, : columns.stop - columns.start] == 0
    return dry


def _dry_statistics(image: Accumulator, state: NDArray[np.uint8], blocks: list[int], dry_regions: list[Polygon]) -> Dry:
    """Statistics of dry lining pixels (eq. 19): of those in the drawn regions, or of all, robustly."""
    lining = int(np.count_nonzero(state == State.LINING))
    every = 1 if dry_regions else max(1, lining // SAMPLE)
    values = []
    for block in blocks:
        columns = block_columns(image.grid, block)
        chosen = state[:, columns] == State.LINING
        if dry_regions:
            chosen &= _inside(image, columns, dry_regions)
        if chosen.any():
            values.append(image.window(columns.start, columns.stop).corrected[chosen][::every])
    if not values:
        return plain_statistics(np.zeros(0))
    together = np.concatenate(values)
    return plain_statistics(together) if dry_regions else robust_statistics(together)


def _inside(image: Accumulator, columns: slice, regions: list[Polygon]) -> NDArray[np.bool_]:
    """Pixels whose centres lie in one of the polygons."""
    shape = (image.grid.rows, columns.stop - columns.start)
    transform = image.grid.transform(columns.start)
    inside = rasterio.features.geometry_mask(regions, shape, transform, invert=True)
    return np.asarray(inside, dtype=np.bool_)


def _statistics(image: Accumulator, blocks: list[int], outlines: list[Polygon], dry_mean: float) -> list[Found]:
    """Drop and image share of each leak, gathered block by block."""
    count = len(outlines)
    pixels, filled, total = np.zeros(count), np.zeros(count), np.zeros(count)
    greatest = np.full(count, -np.inf)
    for block in blocks if count else []:
        columns = block_columns(image.grid, block)
        transform = image.grid.transform(columns.start)
        west, east = transform.c, transform.c + (columns.stop - columns.start) * transform.a
        touching = [k for k, o in enumerate(outlines) if o.bounds[0] < east and o.bounds[2] > west]
        if touching:
            window = image.window(columns.start, columns.stop)
            labels = rasterio.features.rasterize(
                [(outlines[k], k + 1) for k in touching],
                window.count.shape,
                transform=transform,
                dtype=np.int32,
            )
            _gather(window, labels, dry_mean, pixels, filled, total, greatest)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, share = total / filled, filled / pixels
    return [
        Found(shapely.normalize(outline), float(mean[k]), float(greatest[k]), float(share[k]))
        for k, outline in enumerate(outlines)
        if filled[k]
    ]


def _gather(
    window: Window,
    labels: NDArray[np.int32],
    dry_mean: float,
    pixels: NDArray[np.float64],
    filled: NDArray[np.float64],
    total: NDArray[np.float64],
    greatest: NDArray[np.float64],
) -> None:
    count = len(pixels)
    pixels += np.bincount(labels.ravel(), minlength=count + 1)[1:]
    inside = (labels > 0) & (window.count > 0)
    leak = labels[inside] - 1
    drop = dry_mean - window.corrected[inside].astype(np.float64)
    filled += np.bincount(leak, minlength=count)
    total += np.bincount(leak, weights=drop, minlength=count)
    np.maximum.at(greatest, leak, drop)
