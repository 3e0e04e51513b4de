"""Joints: narrow straight dark lines, around the tunnel or along it, that must not tie leaks together."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

from tunneldb.arrays import Bool, Float, Int64

NARROW_AROUND, NARROW_ALONG = 0.08, 0.06
"""Joints are at most 2 cm wide; the beam, the pixels and grout widen them, but not to more, m. Along the tunnel there are
painted stripes of 10 cm, which are to stay in one piece."""

LONG_AROUND, LONG_ALONG = 1.0, 0.5
"""Water that runs down a wall keeps no straight line for longer, and runs along the tunnel no farther, m."""

STRAIGHT = 0.015
"""Standard deviation of the middle of a joint about a straight line, m: it is built to millimetres, pixels are larger."""


def find_joints(dark: Bool, first: int, stop: int, pixel: float) -> Bool:
    """Find the pixels of narrow straight lines around the tunnel or along it that are long enough.

    Parameters
    ----------
    dark : (rows, columns) bool array
        Dark pixels.
    first, stop : int
        Columns that count.
    pixel : float
        Side of a pixel, m.
    """
    found = np.zeros(dark.shape, np.bool_)
    if 2 * pixel > NARROW_AROUND:
        return found  # a line of two pixels may be anything
    across, along = short_runs(dark, first, stop, max(2, round(NARROW_AROUND / pixel)), max(2, round(NARROW_ALONG / pixel)))
    for runs, upright in ((across, True), (along, False)):
        long = round((LONG_AROUND if upright else LONG_ALONG) / pixel)
        if len(runs) < long:
            continue
        chosen = runs[_straight(runs, long, max(STRAIGHT / pixel, 0.75))]
        _draw(found, chosen, upright)
    return found


def _straight(runs: Int64, long: int, wander: float) -> Bool:
    """Which runs, of a line and from a place up to another one each, are parts of a long straight line across these lines."""
    first, second = beside(runs)
    graph = sparse.coo_array((np.ones(len(first), np.int8), (first, second)), shape=(len(runs), len(runs)))
    count, label = sparse.csgraph.connected_components(graph, directed=False)
    at, middle = runs[:, 0].astype(np.float64), 0.5 * (runs[:, 1] + runs[:, 2])

    def mean(values: NDArray[np.floating]) -> Float:
        return np.asarray(np.bincount(label, values, count)) / number

    number = np.bincount(label, minlength=count)
    at, middle = at - mean(at)[label], middle - mean(middle)[label]
    spread, tilt = mean(at * at), mean(at * middle)
    slope = tilt / np.maximum(spread, 1e-9)
    left = np.sqrt(np.maximum(mean(middle * middle) - slope * tilt, 0.0))
    low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, -1)
    np.minimum.at(low, label, runs[:, 0])
    np.maximum.at(high, label, runs[:, 0])
    # One run a line: no net, no branches.
    straight = (high - low + 1 >= long) & (left <= wander) & (np.abs(slope) < 0.1) & (number <= 1.2 * (high - low + 1))
    return np.asarray(straight[label], dtype=np.bool_)


@njit(cache=True, nogil=True)
def beside(runs: Int64) -> tuple[Int64, Int64]:  # pragma: no cover - compiled
    """Runs of neighbouring lines that share sides; of n runs in a line with m in the next, at most n + m - 1 do."""
    first, second = np.empty(2 * len(runs), np.int64), np.empty(2 * len(runs), np.int64)
    count, above = 0, 0
    for k in range(runs.shape[0]):
        while above < k and (
            runs[above, 0] < runs[k, 0] - 1 or (runs[above, 0] == runs[k, 0] - 1 and runs[above, 2] <= runs[k, 1])
        ):
            above += 1
        m = above
        while m < k and runs[m, 0] == runs[k, 0] - 1 and runs[m, 1] < runs[k, 2]:
            first[count], second[count] = m, k
            count += 1
            m += 1
    return first[:count], second[:count]


@njit(cache=True, nogil=True)
def short_runs(dark: Bool, first: int, stop: int, wide: int, high: int) -> tuple[Int64, Int64]:  # pragma: no cover - compiled
    """Unbroken runs of dark pixels no wider or higher: (row, column, column behind) and (column, row, row behind), in order."""
    rows = dark.shape[0]
    across, along = np.empty((1024, 3), np.int64), np.empty((1024, 3), np.int64)
    flat, upright = 0, 0
    for i in range(rows):
        for j in range(first, stop):
            if not dark[i, j]:
                continue
            if j == first or not dark[i, j - 1]:
                behind = j + 1
                while behind < stop and behind - j <= wide and dark[i, behind]:
                    behind += 1
                if behind - j <= wide:
                    if flat == len(across):
                        across = longer(across)
                    across[flat] = i, j, behind
                    flat += 1
            if i == 0 or not dark[i - 1, j]:
                behind = i + 1
                while behind < rows and behind - i <= high and dark[behind, j]:
                    behind += 1
                if behind - i <= high:
                    if upright == len(along):
                        along = longer(along)
                    along[upright] = j, i, behind
                    upright += 1
    along = along[:upright]
    return across[:flat], along[np.argsort(along[:, 0] * rows + along[:, 1])]


@njit(cache=True, nogil=True)
def longer(values: NDArray[np.integer]) -> NDArray[np.integer]:  # pragma: no cover - compiled
    """An array with twice the room along its first axis."""
    out = np.empty((2 * len(values), *values.shape[1:]), values.dtype)
    out[: len(values)] = values
    return out


@njit(cache=True, nogil=True)
def _draw(image: Bool, runs: Int64, upright: bool) -> None:  # pragma: no cover - compiled
    for k in range(runs.shape[0]):
        for m in range(runs[k, 1], runs[k, 2]):
            if upright:
                image[runs[k, 0], m] = True
            else:
                image[m, runs[k, 0]] = True
