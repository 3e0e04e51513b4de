"""Level of the background: a sum of what holds everywhere, in a column, in a row and in a tile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int16, Int64, Single
from tunneldb.compiled import kernel
from tunneldb.raster.geotiff import NODATA, STEP

PER_DECIBEL = 1.0 / STEP["corrected"]

ROWS = 64
"""Rows that are worked on at a time."""


@dataclass(frozen=True)
class BackgroundLevel:
    """Level of the background everywhere in the picture of a kilometre.

    Attributes
    ----------
    tile : int
        Side of a tile, pixels; divides a block.
    base : float
        Level of the kilometre, dB.
    rings : (columns,) float32 array
        Level of each column beyond it, dB.
    bands : (rows, blocks) float32 array
        Level of each row beyond those at the middle of each block, dB; interpolated between them.
    smooth : (tiles down, tiles along) float32 array
        Level at the middle of each tile beyond those, dB; interpolated between them.
    """

    tile: int
    base: float
    rings: Single
    bands: Single
    smooth: Single

    def lines(self, rows: Int64) -> Single:
        """All but the rings in some rows (n,), at the middles of the tiles: (n, tiles along), dB."""
        tiles, blocks = self.smooth.shape[1], self.bands.shape[1]
        before, after, w = _between((np.arange(tiles) + 0.5) * blocks / tiles - 0.5, blocks)
        bands = self.bands[np.ix_(rows, before)]
        lines: Single = np.float32(self.base) + (bands + w * (self.bands[np.ix_(rows, after)] - bands))
        above, below, w = _between((rows + 0.5) / self.tile - 0.5, len(self.smooth))
        smooth = self.smooth[above]
        lines += smooth
        lines += w[:, None] * (self.smooth[below] - smooth)
        return lines

    def levels(self, rows: slice, columns: slice) -> Single:
        """Level in some rows and columns, dB."""
        column = np.arange(columns.start, columns.stop)
        before, w = self._place(column)
        after = np.minimum(before + 1, self.smooth.shape[1] - 1)
        lines = self.lines(np.arange(rows.start, rows.stop))
        levels: Single = (self.rings[columns] + lines[:, before]) + w * (lines[:, after] - lines[:, before])
        return levels

    def subtract(self, level: Int16) -> None:
        """Put the level of the background less that of the pixels in the place of these (rows, columns), steps of 0.01 dB."""
        middles, weights = self.weights()
        for top in range(0, len(level), ROWS):
            part = level[top : top + ROWS]
            _subtract(part, self.lines(np.arange(top, top + len(part))), self.rings, middles, weights)

    def weights(self) -> tuple[Int64, Single]:
        """How compiled functions interpolate between the middles of tiles.

        Returns
        -------
        middles : (tiles + 2,) int array
            First column that lies behind the middle of each tile; before and behind these the first column and the last + 1.
        weights : (columns,) float32 array
            Of the tile whose middle lies behind a column, 0 to 1; that before it has the rest.
        """
        before, w = self._place(np.arange(len(self.rings)))
        middles = np.searchsorted(before, np.arange(self.smooth.shape[1]))
        return np.concatenate([[0], middles, [len(before)]]), w

    def _place(self, column: Int64) -> tuple[Int64, Single]:
        """The last tile whose middle lies before each column, the first for those before it, and the weight of the next one."""
        at = (column.astype(np.float32) + np.float32(0.5)) * np.float32(1.0 / self.tile) - np.float32(0.5)
        before = np.maximum(at, np.float32(0.0)).astype(np.int64)
        return before, np.maximum(at - before.astype(np.float32), np.float32(0.0))


def _between(place: Float, count: int) -> tuple[Int64, Int64, Single]:
    """The two of so many nodes, one apart, about each place, and how near it lies to the second, 0 to 1."""
    before = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
    return before, np.minimum(before + 1, count - 1), np.clip(place - before, 0.0, 1.0).astype(np.float32)


@kernel
def _subtract(
    level: Int16, lines: Single, rings: Single, middles: Int64, weights: Single
) -> None:  # pragma: no cover - compiled
    """Level of the background less levels (rows, columns), in the place of these, steps; NODATA stays."""
    per_step, tiles = np.float32(PER_DECIBEL), lines.shape[1]
    for i in range(level.shape[0]):
        for m in range(tiles + 1):  # between the middles of tiles m - 1 and m
            before = lines[i, m - 1 if m > 0 else 0]
            rise = lines[i, m if m < tiles else tiles - 1] - before
            for j in range(middles[m], middles[m + 1]):
                if level[i, j] != NODATA:
                    drop = np.rint((rings[j] + before + weights[j] * rise) * per_step) - level[i, j]
                    level[i, j] = min(max(drop, NODATA + 1), -NODATA - 1)
