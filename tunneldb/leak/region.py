"""Connected wet regions: cut out of the image of a kilometre, and put together across its ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from affine import Affine
from numba import njit
from numpy.typing import NDArray
from scipy import sparse
from shapely.geometry import Polygon

from tunneldb.leak.image import Grid
from tunneldb.leak.polygon import outline
from tunneldb.leak.raster import NODATA, STEP

Mask = NDArray[np.bool_]
Int = NDArray[np.int64]


@dataclass(frozen=True)
class Region:
    """Wet pixels that hang together by their sides, and what they show.

    Attributes
    ----------
    pixel : float
        Side of a pixel, m.
    column, row : int
        Chainage and arc of the lowest corner of the mask, pixels.
    mask : (rows, columns) bool array
        Its pixels, the first row at the lowest arc.
    filled : int
        How many of them hold points.
    drop_sum, drop_max : float
        Sum over those and greatest of the drop below the mean of dry lining, dB.
    """

    pixel: float
    column: int
    row: int
    mask: Mask
    filled: int
    drop_sum: float
    drop_max: float

    @property
    def stop(self) -> int:
        """Column behind the last one, counted from chainage 0."""
        return self.column + self.mask.shape[1]

    @property
    def area(self) -> float:
        """m² in the unrolled plane."""
        return float(np.count_nonzero(self.mask)) * self.pixel**2

    @property
    def outline(self) -> Polygon:
        """Polygon of (chainage, arc), m."""
        west, north = self.column * self.pixel, (self.row + self.mask.shape[0]) * self.pixel
        return outline(self.mask[::-1], Affine(self.pixel, 0.0, west, 0.0, -self.pixel, north))


def regions(wet: Mask, level: NDArray[np.int16], grid: Grid, dry_mean: float, min_area: float) -> list[Region]:
    """Connected wet regions of a kilometre that are large enough, or are cut by its ends and may be a part of one that is.

    Parameters
    ----------
    wet : (rows, columns) bool array
        Wet pixels; those beyond the ends of the kilometre don't count.
    level : (rows, columns) int16 array
        Corrected intensity, in steps of the stored image.
    grid : Grid
        The pixels.
    dry_mean : float
        Mean of dry lining, dB.
    min_area : float
        Smaller regions within the kilometre are left out, m².
    """
    inner = grid.inner
    runs = _runs(wet, inner.start, inner.stop)
    if not len(runs):
        return []
    count, label = sparse.csgraph.connected_components(_beside(runs), directed=False)
    pixels = np.bincount(label, runs[:, 2] - runs[:, 1], count)
    cut = np.zeros(count, np.bool_)
    cut[label[(runs[:, 1] == inner.start) | (runs[:, 2] == inner.stop)]] = True
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(np.bincount(label, minlength=count))
    wanted = np.flatnonzero(cut | (pixels * grid.pixel**2 >= min_area * (1 - 1e-12)))
    found = [_cut_out(runs[order[(ends[k - 1] if k else 0) : ends[k]]], level, grid, dry_mean) for k in wanted.tolist()]
    return sorted(found, key=lambda region: (region.column, region.row))


def _cut_out(runs: Int, level: NDArray[np.int16], grid: Grid, dry_mean: float) -> Region:
    top, bottom = int(runs[0, 0]), int(runs[-1, 0])
    first = int(runs[:, 1].min())
    mask = np.zeros((bottom - top + 1, int(runs[:, 2].max()) - first), np.bool_)
    filled, total, lowest = _read(runs, level, mask, top, first)
    step = STEP["corrected"]
    return Region(
        grid.pixel,
        grid.first_column + first,
        grid.bottom + grid.rows - 1 - bottom,
        mask[::-1],
        filled,
        filled * dry_mean - total * step,
        dry_mean - lowest * step,
    )


def unite(parts: Sequence[Region]) -> Region:
    """Make one region of several that touch one another."""
    if len(parts) == 1:
        return parts[0]
    column, row = min(part.column for part in parts), min(part.row for part in parts)
    mask = np.zeros((max(p.row + p.mask.shape[0] for p in parts) - row, max(p.stop for p in parts) - column), np.bool_)
    for part in parts:
        mask[part.row - row :, part.column - column :][: part.mask.shape[0], : part.mask.shape[1]] |= part.mask
    return Region(
        parts[0].pixel,
        column,
        row,
        mask,
        sum(part.filled for part in parts),
        float(sum(part.drop_sum for part in parts)),
        max(part.drop_max for part in parts),
    )


def together(parts: Sequence[Region]) -> list[list[int]]:
    """Which of the parts touch, at their first and last columns: groups of their numbers, in order of chainage."""
    pairs = [
        (a, b)
        for a, before in enumerate(parts)
        for b, after in enumerate(parts)
        if before.stop == after.column and _touch(before, after)
    ]
    first, second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    graph = sparse.coo_array((np.ones(len(pairs)), (first, second)), shape=(len(parts), len(parts)))
    count, label = sparse.csgraph.connected_components(graph, directed=False)
    # In order of place, whatever order the kilometres came in.
    places = sorted(range(len(parts)), key=lambda k: (parts[k].column, parts[k].row))
    groups: list[list[int]] = [[] for _ in range(count)]
    for k in places:
        groups[label[k]].append(k)
    return sorted(groups, key=lambda group: places.index(group[0]))


def _touch(before: Region, after: Region) -> bool:
    """Tell whether a pixel of the last column lies beside one of the other region's first column."""
    if before.pixel != after.pixel:
        return False
    low, high = max(before.row, after.row), min(before.row + len(before.mask), after.row + len(after.mask))
    return low < high and bool(
        (before.mask[low - before.row : high - before.row, -1] & after.mask[low - after.row : high - after.row, 0]).any()
    )


def _beside(runs: Int) -> sparse.coo_array:
    """Pairs of runs of neighbouring rows that share sides."""
    first, second = _pairs(runs)
    return sparse.coo_array((np.ones(len(first), np.int8), (first, second)), shape=(len(runs), len(runs)))


@njit(cache=True, nogil=True)
def _runs(wet: Mask, first: int, stop: int) -> Int:  # pragma: no cover - compiled
    """Row, first column and column behind the last one of each unbroken run of wet pixels, row by row."""
    count = 0
    for i in range(wet.shape[0]):
        before = False
        for j in range(first, stop):
            count += wet[i, j] and not before
            before = wet[i, j]
    runs = np.empty((count, 3), np.int64)
    count = 0
    for i in range(wet.shape[0]):
        before = False
        for j in range(first, stop):
            if wet[i, j] and not before:
                runs[count, 0], runs[count, 1] = i, j
                count += 1
            if wet[i, j]:
                runs[count - 1, 2] = j + 1
            before = wet[i, j]
    return runs


@njit(cache=True, nogil=True)
def _pairs(runs: Int) -> tuple[Int, Int]:  # pragma: no cover - compiled
    """Runs of neighbouring rows that share sides; of n runs in a row with m in the next, at most n + m - 1 do."""
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
def _read(
    runs: Int, level: NDArray[np.int16], mask: Mask, top: int, left: int
) -> tuple[int, float, float]:  # pragma: no cover - compiled
    """Draw a region's runs into its mask; how many pixels hold points, the sum of their levels and the lowest."""
    filled, total, lowest = 0, 0.0, np.inf
    for k in range(runs.shape[0]):
        for j in range(runs[k, 1], runs[k, 2]):
            mask[runs[k, 0] - top, j - left] = True
            value = level[runs[k, 0], j]
            if value != NODATA:
                filled += 1
                total += value
                lowest = min(lowest, float(value))
    return filled, total, lowest
