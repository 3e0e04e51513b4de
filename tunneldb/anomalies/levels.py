"""Dark regions with two levels: a leak in slightly darker lining, or a wet core in damp lining."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.runs import Components, row_runs
from tunneldb.arrays import Bool, Float
from tunneldb.raster.geotiff import NODATA, STEP

MIN_RATIO = 2.0
"""Minimum ratio of the two levels; a single patch, which ends at half of its contrast, has no such parts."""

SMOOTHING_WIDTH = 0.1
"""Width of the average before levels are separated, m: noise and drops of water are no levels."""

MIN_AREA = 0.05
"""Minimum area of a part, m²."""

MAX_RIM_WIDTH = 0.1
"""Maximum width of a remaining rim that is added to the darker part, m."""

MAX_BOX_PIXELS = 8_000_000
"""Maximum size of a region's box, pixels: larger ones are networks of joints or similar, no patches."""

BINS = 40
"""Number of darkening classes between which levels are separated."""


def weaker_parts(dark: Bool, contrast: ContrastImage) -> Bool:
    """Mark the weaker parts of dark regions that have two levels.

    The levels are separated where their means differ most (Otsu, 1979). If the darker one is MIN_RATIO times as dark, pixels
    below half of its contrast are the weaker part, because all boundaries are at half of the contrast.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels.
    contrast : ContrastImage
        Their darkening.
    """
    found = np.zeros(dark.shape, np.bool_)
    grid = contrast.grid
    runs = row_runs(dark, grid.inner.start, grid.inner.stop)
    if not len(runs):
        return found
    components = Components.of(runs)
    large = components.pixels * grid.pixel**2 >= 2.0 * MIN_AREA
    order = np.argsort(components.label, kind="stable")
    starts = np.searchsorted(components.label[order], np.arange(len(components.pixels) + 1))
    for k in np.flatnonzero(large).tolist():
        own = runs[order[starts[k] : starts[k + 1]]]
        top, stop, left, right = own[:, 0].min(), own[:, 0].max() + 1, own[:, 1].min(), own[:, 2].max()
        if (stop - top) * (right - left) > MAX_BOX_PIXELS:
            continue
        mask = np.zeros((stop - top, right - left), np.bool_)
        for row, first, last in (own - [top, left, left]).tolist():
            mask[row, first:last] = True
        weak = _weaker(mask, contrast.drop[top:stop, left:right], grid.pixel)
        if weak is not None:
            found[top:stop, left:right] |= weak
    return found


def _weaker(mask: Bool, drop: np.ndarray, pixel: float) -> Bool | None:
    """Return the weaker part of one region; None if it has a single level."""
    selected = mask & (drop != NODATA)
    side = 2 * round(SMOOTHING_WIDTH / pixel / 2) + 1
    weight = ndimage.uniform_filter(selected.astype(np.float32), side)
    level = ndimage.uniform_filter(np.where(selected, drop, 0).astype(np.float32), side) / np.maximum(weight, 1e-6)
    level *= np.float32(STEP["corrected"])
    above, below = _otsu(level[selected])
    if not above >= MIN_RATIO * max(below, 1e-6):
        return None
    strong = mask & (level > 0.5 * above) & (weight > 1e-6)
    strong = _larger(strong, MIN_AREA / pixel**2)
    if not strong.any():
        return None
    narrow = np.ones((max(1, round(MAX_RIM_WIDTH / pixel)),) * 2, np.bool_)
    weak = _larger(ndimage.binary_opening(mask & ~strong, narrow), MIN_AREA / pixel**2)
    return weak if weak.any() else None


def _otsu(values: Float) -> tuple[float, float]:
    """Return the means of the values above and below the limit with the greatest variance between them."""
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
    """Return the pieces of a mask with at least so many pixels."""
    pieces, _ = ndimage.label(mask)
    kept = np.bincount(pieces.ravel()) >= pixels
    kept[0] = False
    return np.asarray(kept[pieces])
