"""Times at which the points of a file were measured, block by block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tunneldb.arrays import Float

MAX_TIME = 2.0**62
"""Greatest valid time, s: greater times are invalid, and whole seconds up to it fit into eight bytes."""


class BlockTimes:
    """Least and greatest time of each block of points of a file that is read in chunks.

    Parameters
    ----------
    block : int
        Number of points in a block.
    """

    def __init__(self, block: int) -> None:
        self.block = block
        self.low, self.high = np.empty(0), np.empty(0)

    def add(self, first: int, time: Float) -> None:
        """Add the times (n,) of points from index ``first`` on, s; times that are not finite are ignored."""
        if not len(time):
            return
        time = np.where(np.isfinite(time), time, np.nan)
        blocks = np.arange(first // self.block, (first + len(time) - 1) // self.block + 1)
        starts = np.maximum(blocks * self.block - first, 0)
        more = np.full(max(blocks[-1] + 1 - len(self.low), 0), np.nan)
        self.low, self.high = np.append(self.low, more), np.append(self.high, more)
        self.low[blocks] = np.fmin(self.low[blocks], np.fmin.reduceat(time, starts))
        self.high[blocks] = np.fmax(self.high[blocks], np.fmax.reduceat(time, starts))

    def seconds(self, ranges: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
        """Return disjoint half-open intervals of whole seconds that hold the times of the blocks in these index ranges."""
        blocks = np.concatenate([np.arange(begin // self.block, (end - 1) // self.block + 1) for begin, end in ranges])
        blocks = blocks[np.isfinite(self.low[blocks])]
        found: list[tuple[int, int]] = []
        for k in blocks[np.argsort(self.low[blocks], kind="stable")].tolist():
            begin, end = (int(np.floor(np.clip(time, -MAX_TIME, MAX_TIME))) for time in (self.low[k], self.high[k]))
            if found and begin <= found[-1][1]:
                found[-1] = (found[-1][0], max(found[-1][1], end + 1))
            else:
                found.append((begin, end + 1))
        return found
