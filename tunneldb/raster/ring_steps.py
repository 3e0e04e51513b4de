"""Steps of the lining, from one ring or stretch of the tunnel to the next.

Between two sections the surface passes evenly from one to the other. Where the radius of the tunnel changes at once, the
offset image steps instead, and does so all round the section. That is no appendage.
"""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float, Int32, Int64, Single
from tunneldb.compiled import point_kernel

LEAST = 0.01
"""Lower steps do no harm, m: they are a third of the distance from which a pixel is off its plane."""

GREATEST = 0.16
"""Higher steps are not those of a lining, m."""

FADE = 1.0
"""Length over which what is taken off on either side of a step fades out, m."""

ALL_ROUND = 0.6
"""Share of the rows that must show the same step, within a third of it or LEAST."""

_HALF = 0.1  # m before and behind a place whose offsets are compared
_EVERY = 0.08  # from one row that is looked at to the next, m
_FEWEST = 12  # rows that tell
_FINE = 2.0**-14  # m: offsets are summed in whole multiples, so that sums don't depend on where they begin
_BIN, _BINS = 0.0025, round(GREATEST / 0.0025)


def reach(pixel: float) -> int:
    """How far, in pixels, what is taken off at a column depends on others at most."""
    return round(FADE / pixel) + 2 * _half(pixel) + 1


def steps(offset: Single, pixel: float, row: int, arc: Float, left: Float, right: Float) -> Single:
    """What to take off the offset of each column so that no step remains.

    The step at a column is the median over the rows of the difference between the mean offsets before and behind it: what
    hangs on the wall and goes on is the same before and behind, whatever it hides. On either side half the step is taken
    off, and less and less with the distance.

    Parameters
    ----------
    offset : (rows, columns) float32 array
        Offset image, m, NaN where there is no point.
    pixel : float
        Side of a pixel, m.
    row : int
        Number of its first row in an image of which it is a part.
    arc : (rows,) float array
        Arcs of the rows, m.
    left, right : (columns,) float arrays
        Arcs between which lie the walls, m.

    Returns
    -------
    (columns,) float32 array
        m; the same for a column farther than :func:`reach` from the ends whichever part it is seen in.
    """
    half = _half(pixel)
    columns = offset.shape[1]
    counts, shown = np.zeros((columns, 2 * _BINS + 1), np.int32), np.zeros(columns, np.int32)
    total, held = np.zeros(columns + 1, np.int64), np.zeros(columns + 1, np.int64)
    _differences(
        np.ascontiguousarray(offset), max(1, round(_EVERY / pixel)), row, half, arc, left, right, counts, shown, total, held
    )
    found = _greatest(_agreed(counts, shown), half)
    out = np.zeros(columns)
    far = round(FADE / pixel)
    for column in np.flatnonzero(found).tolist():
        first, stop = max(column - far, 0), min(column + far, len(out))
        place = (np.arange(first, stop) + 0.5 - column) / far
        out[first:stop] += 0.5 * found[column] * (np.sign(place) - place)
    return out.astype(np.float32)


def _half(pixel: float) -> int:
    return max(2, round(_HALF / pixel))


@point_kernel
def _differences(
    offset: Single, every: int, row: int, half: int, arc: Float, left: Float, right: Float,
    counts: Int32, shown: Int32, total: Int64, held: Int64,
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Count the rows that show each difference (columns, 2 BINS + 1), and those that show any (columns,).

    ``total`` and ``held`` (columns + 1,) hold sums along a row; the first of each is 0.
    """
    rows, columns = offset.shape
    for i in range((-row) % every, rows, every):
        for j in range(columns):
            value = offset[i, j]
            if left[j] < arc[i] < right[j] and not np.isnan(value):
                total[j + 1], held[j + 1] = total[j] + np.int64(np.rint(value / _FINE)), held[j] + 1
            else:
                total[j + 1], held[j + 1] = total[j], held[j]
        for j in range(half, columns - half):
            before, behind = held[j] - held[j - half], held[j + half] - held[j]
            if before > 0 and behind > 0:
                change = (total[j + half] - total[j]) / behind - (total[j] - total[j - half]) / before
                k = int(np.rint(change * (_FINE / _BIN))) + _BINS
                shown[j] += 1
                if 0 <= k <= 2 * _BINS:
                    counts[j, k] += 1


def _agreed(counts: Int32, shown: Int32) -> Float:
    """Median of the differences at each column, m, 0 where it is no step or too few rows show it or share it."""
    step = np.zeros(len(shown))
    rows = np.flatnonzero(shown >= _FEWEST)
    counts, shown = counts[rows], shown[rows]
    until = np.cumsum(counts, axis=1)
    median = np.minimum((2 * until < shown[:, None]).sum(axis=1), 2 * _BINS)
    found = (median - _BINS) * _BIN
    within = np.maximum(LEAST, np.abs(found) / 3.0)
    near = np.abs(np.arange(2 * _BINS + 1) - median[:, None]) * _BIN <= within[:, None]
    alike = (counts * near).sum(axis=1)
    step[rows] = np.where((np.abs(found) >= LEAST) & (alike >= ALL_ROUND * shown), found, 0.0)
    return step


def _greatest(step: Float, half: int) -> Float:
    """Steps that are the greatest within ``half`` columns, of equal ones the first; 0 elsewhere, as next to the ends."""
    height, out = np.abs(step), np.zeros_like(step)
    for column in np.flatnonzero(step).tolist():
        if half <= column < len(step) - half:
            before, behind = height[column - half : column], height[column : column + half + 1]
            if before.max() < height[column] == behind.max():
                out[column] = step[column]
    return out
