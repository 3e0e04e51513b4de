"""Significant change between two epochs: level of detection of cells, and regions of change."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.stats import norm

from tunneldb.arrays import Bool, Float, Single
from tunneldb.robust import MAD_TO_SIGMA

CONFIDENCE_95 = 1.96
"""Standard deviations that include 95 % of normal errors."""

FALSE_SHARE = 0.05
"""Maximum mean share of false windows among those reported as change in a kilometre (Benjamini & Hochberg, 1995)."""

FAMILY_SHARE = 0.05
"""Share of unchanged kilometres in which a region is reported by chance."""

WINDOW = 3
"""Side of the tested windows, in cells."""

SCALES = (1, 2, 4, 8, 16)
"""Sides of the squares, in cells, for whose means the scatter is measured."""

_MIN_FILLED_SHARE = 0.75  # minimum share of a square's cells for its mean to be used
_MIN_PAIRS = 30  # minimum number of pairs of neighbouring squares for their scatter to be used
MIN_WINDOW_CELLS = 5
"""Minimum number of cells in a tested window."""


@dataclass(frozen=True)
class Scatter:
    """Scatter of means of squares of cells, relative to independent cells with the variance they state.

    Attributes
    ----------
    sides : (k,) float array
        Sides of the squares, in cells.
    factors : (k,) float array
        Factors on the standard deviation of the mean, increasing.
    tail : float
        Factor on the standard deviation of single cells, so that the normal distribution fits at the 95 % level of detection.
    """

    sides: Float
    factors: Float
    tail: float

    def at(self, cells: Float | float) -> Float:
        """Return the factor for a mean of this number of cells; linear in the logarithm of the side."""
        side = np.maximum(np.sqrt(np.asarray(cells, dtype=np.float64)), 1.0)
        return np.asarray(np.interp(np.log(side), np.log(self.sides), self.factors))


@dataclass(frozen=True)
class Region:
    """Connected cells that changed in the same direction, and together by more than their level of detection.

    Attributes
    ----------
    rows, columns : (n,) int arrays
        Cells of the region.
    mean, lod : float
        Mean change and its level of detection, 95 %, m.
    greatest : float
        Greatest mean of a window in the region, signed, m.
    """

    rows: Float
    columns: Float
    mean: float
    lod: float
    greatest: float


def measure_scatter(difference: Single, variance: Single) -> Scatter:
    """Measure the scatter of squares of increasing side from differences between neighbours (Allan, 1966).

    Stretches that moved as a whole contribute only at their edges, and the median ignores these.

    Parameters
    ----------
    difference, variance : (rows, columns) float32 arrays
        Change of cells, m, and its variance if all pixels were independent, m²; NaN where not seen.
    """
    sides, factors, tail = [1.0], [1.0], 1.0
    for side in SCALES:
        mean, expected = _squares(difference, variance, side)
        ratios = []
        for axis in (0, 1):
            step = np.diff(mean, axis=axis)
            first, second = (np.take(expected, range(k, expected.shape[axis] - 1 + k), axis=axis) for k in (0, 1))
            ratios.append((step / np.sqrt(first + second)).ravel())
        ratio = np.concatenate(ratios)
        ratio = ratio[np.isfinite(ratio)]
        if len(ratio) < _MIN_PAIRS:
            break
        factor = MAD_TO_SIGMA * float(np.median(np.abs(ratio)))
        if side == 1:
            factors[0] = factor
            tail = float(np.quantile(np.abs(ratio), 0.95)) / CONFIDENCE_95
        else:
            sides.append(float(side))
            factors.append(max(factor, factors[-1]))
    return Scatter(np.array(sides), np.array(factors), tail)


def _squares(difference: Single, variance: Single, side: int) -> tuple[Float, Float]:
    """Return the means of squares, NaN where too few cells are seen, and their variance."""
    rows, columns = (size // side for size in difference.shape)
    shape = rows, side, columns, side
    cut = (slice(rows * side), slice(columns * side))
    seen = np.isfinite(difference[cut]).reshape(shape)
    count = seen.sum(axis=(1, 3))
    selected = count >= _MIN_FILLED_SHARE * side * side
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.nansum(difference[cut].reshape(shape), axis=(1, 3), dtype=np.float64) / count
        expected = np.nansum(variance[cut].reshape(shape), axis=(1, 3), dtype=np.float64) / count.astype(np.float64) ** 2
    return np.where(selected, mean, np.nan), np.where(selected, expected, np.nan)


def detection_level(variance: Single, removed_error: Single, scatter: Scatter) -> Single:
    """Return the level of detection of cells at 95 %, m, after M3C2 (Lague et al., 2013, eq. 1).

    Parameters
    ----------
    variance : float32 array
        σ₁²/n₁ + σ₂²/n₂ of cells, m².
    removed_error : float32 array
        Standard error of the removed motion at each cell, m: ``reg``.
    scatter : Scatter
        Scatter that the data show, relative to the first.
    """
    return np.asarray(CONFIDENCE_95 * (np.sqrt(variance) * scatter.tail + removed_error), dtype=np.float32)


def change_regions(
    difference: Single, variance: Single, removed_error: Single, scatter: Scatter, place_error: Single
) -> list[Region]:
    """Find regions of significant change.

    Each window of 3 by 3 cells is tested by its mean. Windows are accepted as change up to a mean share FALSE_SHARE of false
    ones. Neighbouring windows that changed in the same direction form a region. A region must be at least as large as a
    window, and differ on average by more than its own level of detection. The share of false windows does not limit the share
    of false regions: where a wall moved, many may be false. So a region also needs a window that occurs by chance in no more
    than FAMILY_SHARE of all kilometres, using the two of its three rows or columns that show it least; or the whole region must
    be equally unlikely without any one line. The change must also exceed the effect of a shift of pixels along a slope of the
    relief; over a wide region slopes cancel.

    Parameters
    ----------
    difference, variance, removed_error, scatter
        See :func:`detection_level`.
    place_error : (2, rows, columns) float32 array
        Effect of one standard error of the pixels' positions, along the tunnel and around it, on the change of cells, m,
        signed; the same for neighbouring cells.
    """
    mean, expected, number = window_means(difference, variance, removed_error, scatter)
    with np.errstate(invalid="ignore"):
        ratio = np.where(number >= MIN_WINDOW_CELLS, mean / expected, np.nan)
    taken = significant(2.0 * norm.sf(np.abs(ratio))) & np.isfinite(difference)
    peak = family_level(float(np.isfinite(ratio).sum()))
    return [
        region
        for sign in (1.0, -1.0)
        for region in _regions(taken & (mean * sign > 0.0), mean, difference, variance, removed_error, scatter, place_error)
        if max(
            _greatest_ratio(region, difference, variance, removed_error, scatter, place_error),
            _ratio_without_line(region, difference, variance, removed_error, scatter, place_error),
        )
        > peak
    ]


def _greatest_ratio(
    region: Region, difference: Single, variance: Single, removed_error: Single, scatter: Scatter, place_error: Single
) -> float:
    """Return the greatest of :func:`window_ratios` in a region, in the direction of its mean."""
    at = region.rows.astype(np.int64), region.columns.astype(np.int64)
    first = [max(int(place.min()) - 1, 0) for place in at]
    cut = slice(first[0], int(at[0].max()) + 2), slice(first[1], int(at[1].max()) + 2)
    ratios = window_ratios(difference[cut], variance[cut], removed_error[cut], scatter, place_error[:, *cut])
    return float(np.nanmax(np.sign(region.mean) * ratios[at[0] - first[0], at[1] - first[1]], initial=0.0))


def _ratio_without_line(
    region: Region, difference: Single, variance: Single, removed_error: Single, scatter: Scatter, place_error: Single
) -> float:
    """Return a region's mean without its most influential row or column, in standard deviations, along its mean."""
    at = region.rows, region.columns
    change, squared, registered = (values[at].astype(np.float64) for values in (difference, variance, removed_error))
    lines = [place - place.min() for place in at]
    sums = [np.bincount(line, change * np.sign(region.mean)) for line in lines]
    which = int(sums[1].max() > sums[0].max())
    kept = lines[which] != sums[which].argmax()
    cells = int(kept.sum())
    if cells < MIN_WINDOW_CELLS:
        return 0.0
    noise = np.sqrt(squared[kept].sum()) / cells * float(scatter.at(cells))
    placed = place_error[:, *at][:, kept].mean(axis=1, dtype=np.float64)
    expected = math.hypot(noise, registered[kept].mean(), *placed)
    return float(np.sign(region.mean) * change[kept].mean() / expected)


def significant(probability: Float) -> Bool:
    """Select significant probabilities by Benjamini & Hochberg's step-up procedure; NaN is never significant."""
    tested = np.sort(probability[np.isfinite(probability)])
    below = np.flatnonzero(tested <= FALSE_SHARE * (np.arange(len(tested)) + 1) / max(len(tested), 1))
    if not len(below):
        return np.zeros(probability.shape, np.bool_)
    with np.errstate(invalid="ignore"):
        return np.asarray(probability <= tested[below[-1]])


def window_means(difference: Single, variance: Single, removed_error: Single, scatter: Scatter) -> tuple[Float, Float, Float]:
    """Return the mean around each cell, its standard deviation, and the number of cells seen there."""
    seen = np.isfinite(difference)

    def total(values: Single) -> Float:
        filled = np.where(seen, values, 0.0).astype(np.float64)
        return np.asarray(ndimage.uniform_filter(filled, WINDOW, mode="constant") * WINDOW**2)

    number = np.rint(total(np.ones_like(difference)))
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = total(difference) / number
        noise = np.sqrt(np.maximum(total(variance), 0.0)) / number * scatter.at(WINDOW**2)
        registered = total(removed_error) / number
    return mean, np.hypot(noise, registered), number


def family_level(windows: float) -> float:
    """Return the ratio that the greatest of so many windows exceeds in at most FAMILY_SHARE of unchanged linings (Šidák).

    Windows overlap, so that it is exceeded less often.
    """
    return float(norm.isf(-np.expm1(np.log1p(-FAMILY_SHARE) / max(windows, 1.0)) / 2.0))


def window_ratios(difference: Single, variance: Single, removed_error: Single, scatter: Scatter, place_error: Single) -> Float:
    """Return the least mean of each window without one row or column, in standard deviations; NaN with too few cells.

    Pixels hit a groove narrower than a cell differently in each epoch, and similarly in all cells along it. A single line of
    cells is therefore one error and not a change. 0 where the rest without a line has the opposite sign.
    """
    seen = np.isfinite(difference)
    rows, columns = difference.shape
    lines: list[list[Float]] = []
    for values in (difference, variance, removed_error, *place_error, np.ones_like(difference)):
        padded = np.pad(np.where(seen, values, 0.0).astype(np.float64), 1)
        across, along = (sum_of_three(padded, axis) for axis in (1, 0))
        lines.append([across[k : k + rows] for k in range(WINDOW)] + [along[:, k : k + columns] for k in range(WINDOW)])
    totals = [of[0] + of[1] + of[2] for of in lines]
    lowest, greatest = np.full(difference.shape, np.inf), np.full(difference.shape, -np.inf)
    factor = float(scatter.at(WINDOW**2))
    for line in zip(*lines, strict=True):
        change, squared, registered, along, around, number = (total - one for total, one in zip(totals, line, strict=True))
        expected = np.sqrt(np.maximum(squared, 0.0) * factor**2 + registered**2 + along**2 + around**2)
        ratio = np.divide(change, expected, out=np.zeros_like(change), where=(number > 0.5) & (expected > 0.0))
        np.minimum(lowest, ratio, out=lowest)
        np.maximum(greatest, ratio, out=greatest)
    value = np.where(lowest > 0.0, lowest, np.minimum(greatest, 0.0))
    return np.where(totals[-1] >= MIN_WINDOW_CELLS, value, np.nan)


def sum_of_three(values: Float, axis: int) -> Float:
    """Sum neighbouring triples along an axis; the result is two shorter than the values."""
    count = values.shape[axis]
    return np.asarray(sum(np.take(values, range(k, count - 2 + k), axis=axis) for k in range(WINDOW)))


def _regions(
    taken: Bool,
    mean: Float,
    difference: Single,
    variance: Single,
    removed_error: Single,
    scatter: Scatter,
    place_error: Single,
) -> Iterator[Region]:
    # A window half inside a region shows half its change: there the region ends.
    labels, count = ndimage.label(taken)
    if not count:
        return
    half = 0.5 * np.abs(ndimage.median(mean, labels, np.arange(count + 1)))
    labels, _ = ndimage.label(taken & (np.abs(mean) >= half[labels]))
    for k, place in enumerate(ndimage.find_objects(labels), start=1):
        rows, columns = np.nonzero(labels[place] == k)
        cells = len(rows)
        if cells < WINDOW**2:
            continue
        rows, columns = rows + place[0].start, columns + place[1].start
        at = rows, columns
        pooled = float(difference[at].mean(dtype=np.float64))
        noise = float(np.sqrt(variance[at].sum(dtype=np.float64))) / cells * float(scatter.at(cells))
        placed = place_error[:, *at].mean(axis=1, dtype=np.float64)
        lod = CONFIDENCE_95 * (noise + math.hypot(removed_error[at].mean(dtype=np.float64), *placed))
        if abs(pooled) > lod:
            windows = mean[at]
            yield Region(rows, columns, pooled, lod, float(windows[np.abs(windows).argmax()]))
