"""Drips: small dark pieces below a wet patch, on the way that water takes, are a part of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from tunneldb.arrays import Bool, Int64
from tunneldb.raster.grid import Grid

GAP = 0.12
"""Water that runs down a wall leaves dry places no longer than this, m."""

WIDE = 0.3
"""A drip is no wider, m."""


@dataclass(frozen=True)
class Dark:
    """Connected pieces of dark pixels.

    Attributes
    ----------
    runs : (n, 3) int array
        Row, first column and column behind the last one of each unbroken run of dark pixels, row by row.
    label : (n,) int array
        Piece that each run is of.
    pixels, extent, width : (k,) int arrays
        Pixels of each piece, the greater side of its box and that along the tunnel, pixels.
    """

    runs: Int64
    label: Int64
    pixels: Int64
    extent: Int64
    width: Int64

    @classmethod
    def of(cls, runs: Int64, label: Int64, count: int) -> Dark:
        """Measure the pieces of runs that are labelled."""
        low, high = np.full((2, count), np.iinfo(np.int64).max), np.full((2, count), -1)
        for axis, (first, last) in enumerate(((runs[:, 0], runs[:, 0] + 1), (runs[:, 1], runs[:, 2]))):
            np.minimum.at(low[axis], label, first)
            np.maximum.at(high[axis], label, last)
        pixels = np.bincount(label, runs[:, 2] - runs[:, 1], count).astype(np.int64)
        return cls(runs, label, pixels, (high - low).max(axis=0), high[1] - low[1])

    def touches(self, first: int, stop: int) -> Bool:
        """Tell which pieces reach the first of some columns or the last."""
        cut = np.zeros(len(self.pixels), np.bool_)
        cut[self.label[(self.runs[:, 1] == first) | (self.runs[:, 2] == stop)]] = True
        return cut


def attach_drips(pieces: Dark, wanted: Bool, cut: Bool, grid: Grid) -> tuple[Int64, Int64]:
    """Find what each piece is a part of.

    A drip is narrower than WIDE, smaller than what it hangs below, and begins within GAP of it, towards the crown, or of
    another drip of it.

    Parameters
    ----------
    pieces : Dark
        Connected pieces.
    wanted : (k,) bool array
        Those that are regions of their own: what drips hang below.
    cut : (k,) bool array
        Those that an end of the kilometre cuts: how large they are is not known, so that they are no drips, and that all
        others are taken for smaller.
    grid : Grid
        The pixels.

    Returns
    -------
    whole : (k,) int array
        Piece that each one is a part of; itself, where it is none's.
    bridges : (m, 4) int array
        Row, first column, column behind the last one and whole of the pixels by which the drips hang together with theirs.
    """
    runs = pieces.runs
    starts = np.searchsorted(runs[:, 0], np.arange(grid.rows + 1))
    crown = grid.bottom + grid.rows  # rows before this one lie at arcs above 0
    gap = max(1, round(GAP / grid.pixel))
    above, row, column, distance = _above(runs, pieces.label, starts, (pieces.width <= WIDE / grid.pixel) & ~cut, crown, gap)
    whole = np.arange(len(pieces.pixels))
    for _ in range(8):  # a drip below a drip below a drip …
        hung = np.flatnonzero((above >= 0) & (whole == np.arange(len(whole))))
        root = whole[above[hung]]
        ready = wanted[root] & (cut[root] | (pieces.pixels[hung] < pieces.pixels[root])) & (root != hung)
        if not ready.any():
            break
        whole[hung[ready]] = root[ready]
    # One that drips hang below may itself have become a drip of a larger one.
    while not np.array_equal(whole, whole[whole]):
        whole = whole[whole]
    drips = np.flatnonzero(whole != np.arange(len(whole)))
    bridges = [
        (row[k] + (step if row[k] < crown else -step), column[k], column[k] + 1, whole[k])
        for k in drips.tolist()
        for step in range(1, int(distance[k]))
    ]
    return whole, np.array(bridges, dtype=np.int64).reshape(-1, 4)


@njit(cache=True, nogil=True)
def _above(
    runs: Int64, label: Int64, starts: Int64, narrow: Bool, crown: int, gap: int
) -> tuple[Int64, Int64, Int64, Int64]:  # pragma: no cover - compiled
    """The nearest other piece within a gap above each narrow one, -1 for none, from which pixel it is seen, and how far."""
    count = len(narrow)
    above, row, column = np.full(count, -1, np.int64), np.zeros(count, np.int64), np.zeros(count, np.int64)
    distance = np.full(count, gap + 1, np.int64)
    rows = len(starts) - 1
    for k in range(len(runs)):
        own = label[k]
        if not narrow[own]:
            continue
        i = runs[k, 0]
        up = 1 if i < crown else -1
        for j in range(runs[k, 1], runs[k, 2]):
            for step in range(1, distance[own]):
                m = i + up * step
                if m < 0 or m >= rows:
                    break
                low, high = starts[m], starts[m + 1]
                while low < high:
                    middle = (low + high) // 2
                    if runs[middle, 2] <= j:
                        low = middle + 1
                    else:
                        high = middle
                if low < starts[m + 1] and runs[low, 1] <= j:
                    if label[low] != own:
                        above[own], row[own], column[own], distance[own] = label[low], i, j, step
                    break
    return above, row, column, distance
