"""Dark regions of two levels: a leak in lining that is a little darker anyway, a wet core in what is only damp."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.runs import Components, row_runs
from tunneldb.arrays import Bool, Float
from tunneldb.raster.geotiff import NODATA, STEP

RATIO = 2.0
"""The darker part is so many times as dark as the other: of one patch, which ends at half of its contrast, no part is."""

SMOOTH = 0.1
"""Drops are averaged over so much before parts are told, m: noise and drops of water make no parts."""

LEAST_AREA = 0.05
"""A part is no smaller, m²."""

NARROW = 0.1
"""What is left about the darker part and no wider belongs to it, m."""

LARGEST = 8_000_000
"""Boxes of regions of more pixels are networks of joints and the like, no patches."""

BINS = 40
"""Classes of the drop, between which parts are divided."""


def weaker_parts(dark: Bool, contrast: ContrastImage) -> Bool:
    """Mark the weaker parts of dark regions that hold two levels.

    The two are divided where they differ most in the mean (Otsu, 1979). If the darker is RATIO times as dark, what lies below
    half of its contrast is the weaker part: just as all boundaries lie at half of the contrast.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels.
    contrast : ContrastImage
        Their drop.
    """
    found = np.zeros(dark.shape, np.bool_)
    grid = contrast.grid
    runs = row_runs(dark, grid.inner.start, grid.inner.stop)
    if not len(runs):
        return found
    components = Components.of(runs)
    large = components.pixels * grid.pixel**2 >= 2.0 * LEAST_AREA
    order = np.argsort(components.label, kind="stable")
    starts = np.searchsorted(components.label[order], np.arange(len(components.pixels) + 1))
    for k in np.flatnonzero(large).tolist():
        own = runs[order[starts[k] : starts[k + 1]]]
        top, stop, left, right = own[:, 0].min(), own[:, 0].max() + 1, own[:, 1].min(), own[:, 2].max()
        if (stop - top) * (right - left) > LARGEST:
            continue
        mask = np.zeros((stop - top, right - left), np.bool_)
        for row, first, last in (own - [top, left, left]).tolist():
            mask[row, first:last] = True
        weak = _weaker(mask, contrast.drop[top:stop, left:right], grid.pixel)
        if weak is not None:
            found[top:stop, left:right] |= weak
    return found


def _weaker(mask: Bool, drop: np.ndarray, pixel: float) -> Bool | None:
    """Weaker part of one region; None if it is all of one level."""
    held = mask & (drop != NODATA)
    side = 2 * round(SMOOTH / pixel / 2) + 1
    weight = ndimage.uniform_filter(held.astype(np.float32), side)
    level = ndimage.uniform_filter(np.where(held, drop, 0).astype(np.float32), side) / np.maximum(weight, 1e-6)
    level *= np.float32(STEP["corrected"])
    above, below = _otsu(level[held])
    if not above >= RATIO * max(below, 1e-6):
        return None
    strong = mask & (level > 0.5 * above) & (weight > 1e-6)
    strong = _larger(strong, LEAST_AREA / pixel**2)
    if not strong.any():
        return None
    narrow = np.ones((max(1, round(NARROW / pixel)),) * 2, np.bool_)
    weak = _larger(ndimage.binary_opening(mask & ~strong, narrow), LEAST_AREA / pixel**2)
    return weak if weak.any() else None


def _otsu(values: Float) -> tuple[float, float]:
    """Means of the values above and below the limit between which most of the variance lies."""
    if len(values) < 2 or values.min() == values.max():
        return 0.0, 0.0
    count, edges = np.histogram(values, BINS)
    middle = 0.5 * (edges[1:] + edges[:-1])
    below, total = np.cumsum(count)[:-1], np.cumsum(count * middle)
    above = len(values) - below
    low, high = total[:-1] / np.maximum(below, 1), (total[-1] - total[:-1]) / np.maximum(above, 1)
    best = int(np.argmax(below * above * (high - low) ** 2))
    return float(high[best]), float(low[best])


def _larger(mask: Bool, pixels: float) -> Bool:
    """Pieces of a mask of so many pixels and more."""
    pieces, _ = ndimage.label(mask)
    kept = np.bincount(pieces.ravel()) >= pixels
    kept[0] = False
    return np.asarray(kept[pieces])
