"""Connected dark regions: cut out of the image of a kilometre, with their drips, and put together across its ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy import sparse
from shapely.geometry import Polygon

from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.drips import Dark, attach_drips
from tunneldb.anomalies.joints import beside
from tunneldb.anomalies.straight_edges import SHARP, straight
from tunneldb.arrays import Bool, Float, Int16, Int64, Single, UInt8
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.polygons import outline

ACROSS = 0.06
"""The step over a rim is measured so far inside and outside, m: a wet patch ends within it, soot doesn't."""

LONG = 0.5
"""Regions that are longer are kept even if they are small, m: joints."""


class RegionProperties(NamedTuple):
    """Sums over the pixels of a region, and over the sides by which they face what is not dark.

    Attributes
    ----------
    sigma : float
        Local standard deviation of dry lining, dB, over the pixels with points.
    recess : float
        Pixels on lining set back behind the wall.
    rim, rim_off, rim_recess : float
        Sides, of them those towards an appendage or the floor, and those towards dry lining set back behind the wall.
    steps : float
        Sides at which the drop was measured on both, ACROSS from them.
    inside, outside : float
        Sum of the drop there, dB.
    sharp, straight : float
        Sides over which half of the region's drop is lost, and those of them that lie on straight lines
        (:func:`tunneldb.anomalies.straight_edges.straight`).
    """

    sigma: float = 0.0
    recess: float = 0.0
    rim: float = 0.0
    rim_off: float = 0.0
    rim_recess: float = 0.0
    steps: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    sharp: float = 0.0
    straight: float = 0.0


@dataclass(frozen=True)
class Region:
    """Dark pixels that hang together by their sides, and what they show.

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
        Sum over those and greatest of the drop below dry lining, dB.
    traits : RegionProperties
        Further sums.
    """

    pixel: float
    column: int
    row: int
    mask: Bool
    filled: int
    drop_sum: float
    drop_max: float
    traits: RegionProperties

    @property
    def stop(self) -> int:
        """Column behind the last one, counted from chainage 0."""
        return self.column + self.mask.shape[1]

    @property
    def area(self) -> float:
        """m² in the unrolled plane."""
        return float(np.count_nonzero(self.mask)) * self.pixel**2

    @property
    def drop_mean(self) -> float:
        """Mean drop over the pixels with points, dB."""
        return self.drop_sum / self.filled

    @property
    def contrast(self) -> float:
        """Mean drop in standard deviations of the dry lining about it."""
        return self.drop_sum / self.traits.sigma if self.traits.sigma > 0 else 0.0

    @property
    def outline(self) -> Polygon:
        """Polygon of (chainage, arc), m."""
        return outline(self.mask, self.column, self.row, self.pixel)


def find_regions(
    part: Bool, dark: Bool, relative: ContrastImage, min_area: float, drips: Callable[[Region], bool]
) -> list[Region]:
    """Connected dark regions of a kilometre that are large or long enough, or are cut by its ends and may be a part of one.

    Drips that hang below a region are a part of it.

    Parameters
    ----------
    part : (rows, columns) bool array
        Dark pixels that may belong to a region; those beyond the ends of the kilometre don't count.
    dark : (rows, columns) bool array
        All dark pixels; sides towards these are no rim.
    relative : ContrastImage
        Their drop.
    min_area : float
        Smaller regions within the kilometre are left out, m².
    drips : callable
        Tells whether a region may have drips.
    """
    grid = relative.grid
    inner = grid.inner
    runs = _runs(part, inner.start, inner.stop)
    if not len(runs):
        return []
    count, label = sparse.csgraph.connected_components(_beside(runs), directed=False)
    pieces = Dark.of(runs, label.astype(np.int64), count)
    ends = pieces.touches(inner.start, inner.stop)
    wanted = ends | (pieces.pixels * grid.pixel**2 >= min_area * (1 - 1e-12)) | (pieces.extent * grid.pixel >= LONG)
    whole, bridges = attach_drips(pieces, wanted, ends, grid)
    alone = _by_label(runs, label, count)
    for k in np.unique(whole[whole != np.arange(count)]).tolist():
        if not drips(_cut_out(alone(k), dark, relative)):
            whole[whole == k] = np.flatnonzero(whole == k)
            bridges = bridges[bridges[:, 3] != k]
    chosen = _by_label(np.concatenate([runs, bridges[:, :3]]), np.concatenate([whole[label], bridges[:, 3]]), count)
    found = [_cut_out(chosen(k), dark, relative) for k in np.unique(whole[wanted]).tolist()]
    return sorted(found, key=lambda region: (region.column, region.row))


def _by_label(runs: Int64, label: Int64, count: int) -> Callable[[int], Int64]:
    """What gives the runs of a label."""
    order = np.argsort(label, kind="stable")
    stops = np.concatenate([[0], np.cumsum(np.bincount(label, minlength=count))])
    return lambda k: runs[order[stops[k] : stops[k + 1]]]


def _cut_out(runs: Int64, dark: Bool, relative: ContrastImage) -> Region:
    grid = relative.grid
    top, bottom = int(runs[:, 0].min()), int(runs[:, 0].max())
    first = int(runs[:, 1].min())
    mask = np.zeros((bottom - top + 1, int(runs[:, 2].max()) - first), np.bool_)
    across = max(1, round(ACROSS / grid.pixel))
    sums = _read(
        runs, dark, relative.drop, relative.state, relative.sigma, relative.tile, mask, top, first, across, STEP["corrected"]
    )
    least = SHARP * float(sums[1]) / max(float(sums[0]), 1.0) / STEP["corrected"]
    sides = straight(runs, dark, relative.drop, relative.state, across, least)
    return Region(
        grid.pixel,
        grid.first_column + first,
        grid.bottom + grid.rows - 1 - bottom,
        mask[::-1],
        int(sums[0]),
        float(sums[1]),
        float(sums[2]),
        RegionProperties(*sums[3:].tolist(), *map(float, sides)),
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
        RegionProperties(*(float(sum(sums)) for sums in zip(*(part.traits for part in parts), strict=True))),
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


def _beside(runs: Int64) -> sparse.coo_array:
    """Pairs of runs of neighbouring rows that share sides."""
    first, second = beside(runs)
    return sparse.coo_array((np.ones(len(first), np.int8), (first, second)), shape=(len(runs), len(runs)))


@njit(cache=True, nogil=True)
def _runs(wet: Bool, first: int, stop: int) -> Int64:  # pragma: no cover - compiled
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
def _read(
    runs: Int64,
    dark: Bool,
    drop: Int16,
    state: UInt8,
    sigma: Single,
    tile: int,
    mask: Bool,
    top: int,
    left: int,
    across: int,
    step: float,
) -> Float:  # pragma: no cover - compiled
    """Draw a region's runs into its mask and sum up what they show: filled, drop's sum and maximum, and the traits."""
    sums = np.zeros(11)
    sums[2] = -np.inf
    rows, columns = dark.shape
    for k in range(runs.shape[0]):
        i = runs[k, 0]
        for j in range(runs[k, 1], runs[k, 2]):
            mask[i - top, j - left] = True
            if not dark[i, j]:
                continue  # between a drip and what it hangs below
            sums[4] += state[i, j] == 2
            if drop[i, j] != NODATA:
                value = drop[i, j] * step
                sums[0] += 1
                sums[1] += value
                sums[2] = max(sums[2], value)
                sums[3] += sigma[i // tile, j // tile]
            for di, dj in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                m, n = i + di, j + dj
                if m < 0 or m >= rows or n < 0 or n >= columns or dark[m, n]:
                    continue
                sums[5] += 1
                sums[6] += state[m, n] >= 3
                sums[7] += state[m, n] == 2
                # The step: what is dark there behind the rim, and what is not before it.
                m, n = i + across * di, j + across * dj
                p, q = i - (across - 1) * di, j - (across - 1) * dj
                if m < 0 or m >= rows or n < 0 or n >= columns or p < 0 or p >= rows or q < 0 or q >= columns:
                    continue
                if dark[p, q] and not dark[m, n] and drop[p, q] != NODATA and 1 <= state[m, n] <= 2:
                    sums[8] += 1
                    sums[9] += drop[p, q] * step
                    sums[10] += drop[m, n] * step
    return sums
