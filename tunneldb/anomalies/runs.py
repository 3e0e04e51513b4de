"""Unbroken runs of pixels (run-length encoding), touching pairs, and connected components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from tunneldb.anomalies.windows import ROWS
from tunneldb.arrays import Bool, Int64, Intp


@dataclass(frozen=True)
class Components:
    """Connected components of runs of pixels.

    Attributes
    ----------
    runs : (n, 3) int array
        Row, first column and column behind the last one of each unbroken run of dark pixels, row by row.
    label : (n,) int array
        Component of each run.
    pixels, extent, width : (k,) int arrays
        Number of pixels of each component, the greater side of its box and that along the tunnel, pixels.
    """

    runs: Int64
    label: Int64
    pixels: Int64
    extent: Int64
    width: Int64

    @classmethod
    def of(cls, runs: Int64) -> Components:
        """Label runs that are connected by the sides of their pixels."""
        count, label = connected(len(runs), *adjacent_runs(runs))
        low, high = np.full((2, count), np.iinfo(np.int64).max), np.full((2, count), -1)
        for axis, (first, last) in enumerate(((runs[:, 0], runs[:, 0] + 1), (runs[:, 1], runs[:, 2]))):
            np.minimum.at(low[axis], label, first)
            np.maximum.at(high[axis], label, last)
        pixels = np.bincount(label, runs[:, 2] - runs[:, 1], count).astype(np.int64)
        return cls(runs, label, pixels, (high - low).max(axis=0), high[1] - low[1])

    def touching(self, first: int, stop: int) -> Bool:
        """Return True for components that reach the first or the last of some columns."""
        cut = np.zeros(len(self.pixels), np.bool_)
        cut[self.label[(self.runs[:, 1] == first) | (self.runs[:, 2] == stop)]] = True
        return cut


def row_runs(mask: Bool, first: int, stop: int) -> Int64:
    """Find runs along the rows of a mask, in some of its columns.

    Returns
    -------
    (n, 3) int array
        Row, first column and column behind the last one, row by row.
    """
    found, wide = [np.empty((0, 3), np.int64)], stop - first + 1
    for top in range(0, len(mask), ROWS):
        part = mask[top : top + ROWS, first:stop]
        edge = np.zeros((len(part), wide), np.bool_)
        edge[:, 0], edge[:, -1] = part[:, 0], part[:, -1]
        np.not_equal(part[:, 1:], part[:, :-1], out=edge[:, 1:-1])
        at = np.flatnonzero(edge)  # begins and ends of runs, alternating
        row = at[::2] // wide
        found.append(np.column_stack([row + top, *(ends - row * wide + first for ends in (at[::2], at[1::2]))]))
    return np.concatenate(found)


def column_runs(mask: Bool, first: int, stop: int) -> Int64:
    """Find runs along some columns of a mask: column, first row and row behind the last one, column by column."""
    edges = []
    for top in range(0, len(mask) + 1, ROWS):
        part = np.zeros((min(ROWS, len(mask) + 1 - top) + 1, stop - first), np.bool_)  # with the row before
        low = max(top - 1, 0)
        selected = mask[low : top + ROWS, first:stop]
        part[low - top + 1 :][: len(selected)] = selected
        row, column = np.nonzero(part[1:] != part[:-1])
        edges.append((column + first) * (len(mask) + 1) + row + top)
    at = np.sort(np.concatenate(edges))
    column = at[::2] // (len(mask) + 1)
    return np.column_stack([column, *(ends - column * (len(mask) + 1) for ends in (at[::2], at[1::2]))])


def adjacent_runs(runs: Int64) -> tuple[Int64, Int64]:
    """Return pairs of runs of neighbouring lines that share sides, by their numbers.

    Parameters
    ----------
    runs : (n, 3) int array
        Line, first place and place behind the last one, in order.

    Returns
    -------
    (m,), (m,) int arrays
        Run of the line before, run of the line after; with n runs in a line and m in the next, at most n + m - 1 pairs.
    """
    if not len(runs):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    line, first, behind = runs.T
    wide = int(behind.max()) + 1
    begin = np.searchsorted(line * wide + behind, (line - 1) * wide + first, side="right")
    end = np.searchsorted(line * wide + first, (line - 1) * wide + behind, side="left")
    number = np.maximum(end - begin, 0)
    return ranges(begin, number), np.repeat(np.arange(len(runs)), number)


def connected(count: int, first: Int64, second: Int64) -> tuple[int, Intp]:
    """Return the number of connected components of a graph with so many nodes, and the component of each node."""
    graph = sparse.coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    components, label = sparse.csgraph.connected_components(graph, directed=False)
    return int(components), label.astype(np.intp)


def ranges(first: Int64, number: Int64) -> Int64:
    """Concatenate ranges of whole numbers, each from its first one with its length."""
    stop = np.cumsum(number)
    total = int(stop[-1]) if len(stop) else 0
    return np.arange(total) + np.repeat(first - (stop - number), number)


def pixels_of(runs: Int64) -> tuple[Int64, Int64]:
    """Return line and place of all pixels of runs (line, first place, place behind the last one)."""
    number = runs[:, 2] - runs[:, 1]
    return np.repeat(runs[:, 0], number), ranges(runs[:, 1], number)
