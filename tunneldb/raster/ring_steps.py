"""Steps of the lining, from one ring or stretch of the tunnel to the next.

Between two sections the surface changes smoothly from one to the other. Where the radius of the tunnel changes abruptly, the
offset image has a step instead, all around the section. Such a step is not a fixture.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, Single
from tunneldb.compiled import point_kernel

MIN_STEP = 0.01
"""Minimum step that is removed, m: smaller ones are under a third of the distance from which a pixel is off its plane."""

MAX_STEP = 0.16
"""Maximum step of a lining, m."""

FADE_LENGTH = 1.0
"""Length over which the correction on either side of a step fades out, m."""

MIN_ROW_SHARE = 0.6
"""Minimum share of the rows with the same step, within a third of it or MIN_STEP."""

_HALF_LENGTH = 0.1  # length before and behind a place over which offsets are compared, m
_ROW_DISTANCE = 0.08  # distance of sampled rows, m
_MIN_ROWS = 12  # minimum number of rows
_OFFSET_STEP = 2.0**-14  # m: offsets are summed in whole multiples, so that sums do not depend on where they begin
_BIN, _BINS = 0.0025, round(MAX_STEP / 0.0025)


def reach(pixel: float) -> int:
    """Return the maximum distance, in pixels, of data that the correction at a column depends on."""
    return round(FADE_LENGTH / pixel) + 2 * _half(pixel) + 1


def steps(offset: Single, pixel: float, row: int, arc: Float, left: Float, right: Float) -> Single:
    """Return the correction of the offset of each column that removes all steps.

    The step at a column is the median over the rows of the difference between the mean offsets before and behind it. A fixture
    that continues is the same before and behind. On either side half the step is subtracted, decreasing with the distance.

    Parameters
    ----------
    offset : (rows, columns) float32 array
        Offset image, m, NaN without a point.
    pixel : float
        Side of a pixel, m.
    row : int
        Number of its first row in a larger image.
    arc : (rows,) float array
        Arcs of the rows, m.
    left, right : (columns,) float arrays
        Limits of the walls, as arcs, m.

    Returns
    -------
    (columns,) float32 array
        m; the same for a column farther than :func:`reach` from the ends, in any part.
    """
    half = _half(pixel)
    columns = offset.shape[1]
    counts, shown = np.zeros((columns, 2 * _BINS + 1), np.int32), np.zeros(columns, np.int32)
    total, selected = np.zeros(columns + 1, np.int64), np.zeros(columns + 1, np.int64)
    _differences(
        np.ascontiguousarray(offset),
        max(1, round(_ROW_DISTANCE / pixel)),
        row,
        half,
        arc,
        left,
        right,
        counts,
        shown,
        total,
        selected,
    )
    found = _greatest(_agreed(counts, shown), half)
    out = np.zeros(columns)
    far = round(FADE_LENGTH / pixel)
    for column in np.flatnonzero(found).tolist():
        first, stop = max(column - far, 0), min(column + far, len(out))
        place = (np.arange(first, stop) + 0.5 - column) / far
        out[first:stop] += 0.5 * found[column] * (np.sign(place) - place)
    return out.astype(np.float32)


def _half(pixel: float) -> int:
    return max(2, round(_HALF_LENGTH / pixel))


@point_kernel
def _differences(
    offset: Single, every: int, row: int, half: int, arc: Float, left: Float, right: Float,
    counts: Int32, shown: Int32, total: Int64, held: Int64,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Count the rows with each difference (columns, 2 BINS + 1), and those with any (columns,).

    ``total`` and ``held`` (columns + 1,) are cumulative sums along a row; the first of each is 0.
    """
    rows, columns = offset.shape
    for i in range((-row) % every, rows, every):
        for j in range(columns):
            value = offset[i, j]
            if left[j] < arc[i] < right[j] and not np.isnan(value):
                total[j + 1], held[j + 1] = total[j] + np.int64(np.rint(value / _OFFSET_STEP)), held[j] + 1
            else:
                total[j + 1], held[j + 1] = total[j], held[j]
        for j in range(half, columns - half):
            before, behind = held[j] - held[j - half], held[j + half] - held[j]
            if before > 0 and behind > 0:
                change = (total[j + half] - total[j]) / behind - (total[j] - total[j - half]) / before
                k = int(np.rint(change * (_OFFSET_STEP / _BIN))) + _BINS
                shown[j] += 1
                if 0 <= k <= 2 * _BINS:
                    counts[j, k] += 1


def _agreed(counts: Int32, shown: Int32) -> Float:
    """Return the median difference at each column, m; 0 if it is no step or too few rows have or share it."""
    step = np.zeros(len(shown))
    rows = np.flatnonzero(shown >= _MIN_ROWS)
    counts, shown = counts[rows], shown[rows]
    until = np.cumsum(counts, axis=1)
    median = np.minimum((2 * until < shown[:, None]).sum(axis=1), 2 * _BINS)
    found = (median - _BINS) * _BIN
    within = np.maximum(MIN_STEP, np.abs(found) / 3.0)
    near = np.abs(np.arange(2 * _BINS + 1) - median[:, None]) * _BIN <= within[:, None]
    alike = (counts * near).sum(axis=1)
    step[rows] = np.where((np.abs(found) >= MIN_STEP) & (alike >= MIN_ROW_SHARE * shown), found, 0.0)
    return step


def _greatest(step: Float, half: int) -> Float:
    """Return the steps that are the greatest within ``half`` columns, the first of equal ones; 0 elsewhere and at the ends."""
    height, out = np.abs(step), np.zeros_like(step)
    for column in np.flatnonzero(step).tolist():
        if half <= column < len(step) - half:
            before, behind = height[column - half : column], height[column : column + half + 1]
            if before.max() < height[column] == behind.max():
                out[column] = step[column]
    return out
