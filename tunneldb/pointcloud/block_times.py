"""When the points of a file were measured, block by block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tunneldb.arrays import Float

LATEST = 2.0**62
"""Greatest time that is told apart, s: one beyond is spoilt, and whole seconds up to it are numbers of eight bytes."""


class BlockTimes:
    """The least and the greatest time of each block of points of a file, which comes chunk by chunk.

    Parameters
    ----------
    block : int
        Points in a block.
    """

    def __init__(self, block: int) -> None:
        self.block = block
        self.low, self.high = np.empty(0), np.empty(0)

    def add(self, first: int, time: Float) -> None:
        """Look at the times (n,) of the points from this number on, s; those that are not finite are passed over."""
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
        """Between which whole seconds, half-open and apart, the times of blocks lie that these ranges of numbers touch."""
        blocks = np.concatenate([np.arange(begin // self.block, (end - 1) // self.block + 1) for begin, end in ranges])
        blocks = blocks[np.isfinite(self.low[blocks])]
        found: list[tuple[int, int]] = []
        for k in blocks[np.argsort(self.low[blocks], kind="stable")].tolist():
            begin, end = (int(np.floor(np.clip(time, -LATEST, LATEST))) for time in (self.low[k], self.high[k]))
            if found and begin <= found[-1][1]:
                found[-1] = (found[-1][0], max(found[-1][1], end + 1))
            else:
                found.append((begin, end + 1))
        return found
