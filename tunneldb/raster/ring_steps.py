"""Steps of the lining, from one ring or stretch of the tunnel to the next.

Between two sections the surface passes evenly from one to the other. Where the radius of the tunnel changes at once, the
offset image steps instead, and does so all round the section. That is no appendage.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from tunneldb.arrays import Float, Int32, Single

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
    found = _found(*_differences(offset, max(1, round(_EVERY / pixel)), row, half, arc, left, right), half)
    out = np.zeros(offset.shape[1])
    far = round(FADE / pixel)
    for column in np.flatnonzero(found).tolist():
        first, stop = max(column - far, 0), min(column + far, len(out))
        place = (np.arange(first, stop) + 0.5 - column) / far
        out[first:stop] += 0.5 * found[column] * (np.sign(place) - place)
    return out.astype(np.float32)


def _half(pixel: float) -> int:
    return max(2, round(_HALF / pixel))


@njit(cache=True, nogil=True)
def _differences(
    offset: Single, every: int, row: int, half: int, arc: Float, left: Float, right: Float
) -> tuple[Int32, Int32]:  # pragma: no cover - compiled
    """How many rows show each difference (columns, 2 BINS + 1), and how many show any (columns,)."""
    rows, columns = offset.shape
    counts, shown = np.zeros((columns, 2 * _BINS + 1), np.int32), np.zeros(columns, np.int32)
    total, held = np.zeros(columns + 1, np.int64), np.zeros(columns + 1, np.int64)
    for i in range((-row) % every, rows, every):
        for j in range(columns):
            known = left[j] < arc[i] < right[j] and not np.isnan(offset[i, j])
            total[j + 1] = total[j] + (np.int64(np.rint(offset[i, j] / _FINE)) if known else 0)
            held[j + 1] = held[j] + known
        for j in range(half, columns - half):
            before, behind = held[j] - held[j - half], held[j + half] - held[j]
            if before > 0 and behind > 0:
                change = (total[j + half] - total[j]) / behind - (total[j] - total[j - half]) / before
                k = int(np.rint(change * (_FINE / _BIN))) + _BINS
                shown[j] += 1
                if 0 <= k <= 2 * _BINS:
                    counts[j, k] += 1
    return counts, shown


@njit(cache=True, nogil=True)
def _found(counts: Int32, shown: Int32, half: int) -> Float:  # pragma: no cover - compiled
    """Step at each column, m, 0 where there is none."""
    columns = counts.shape[0]
    step, found = np.zeros(columns), np.zeros(columns)
    for j in range(columns):
        if shown[j] >= _FEWEST:
            step[j] = _agreed(counts[j], shown[j])
    for j in range(half, columns - half):
        if step[j] != 0.0:
            greatest = True
            for k in range(j - half, j + half + 1):
                # Of equal ones the first.
                greatest &= abs(step[k]) < abs(step[j]) or (k >= j and abs(step[k]) == abs(step[j]))
            if greatest:
                found[j] = step[j]
    return found


@njit(cache=True, nogil=True)
def _agreed(counts: Int32, shown: int) -> float:  # pragma: no cover - compiled
    """Median of the differences, 0 where it is no step or too few rows share it."""
    k, until = 0, counts[0]
    while 2 * until < shown and k < 2 * _BINS:
        k += 1
        until += counts[k]
    step = (k - _BINS) * _BIN
    if abs(step) < LEAST:
        return 0.0
    within = max(LEAST, abs(step) / 3.0)
    alike = 0
    for m in range(2 * _BINS + 1):
        if abs(m - k) * _BIN <= within:
            alike += counts[m]
    return step if alike >= ALL_ROUND * shown else 0.0
