"""Level of the background: a sum of a base and of parts by column, by row and by tile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int16, Int64, Single
from tunneldb.compiled import kernel
from tunneldb.raster.geotiff import NODATA, STEP

PER_DECIBEL = 1.0 / STEP["corrected"]

ROWS = 64
"""Number of rows processed together."""


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
        Level of each column relative to it, dB.
    bands : (rows, blocks) float32 array
        Level of each row relative to those, at the middle of each block, dB; interpolated between blocks.
    smooth : (tiles down, tiles along) float32 array
        Level relative to those, at the middle of each tile, dB; interpolated between tiles.
    """

    tile: int
    base: float
    rings: Single
    bands: Single
    smooth: Single

    def lines(self, rows: Int64) -> Single:
        """Return all parts except the rings in some rows (n,), at the middles of the tiles: (n, tiles along), dB."""
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
        """Return the level in some rows and columns, dB."""
        column = np.arange(columns.start, columns.stop)
        before, w = self._place(column)
        after = np.minimum(before + 1, self.smooth.shape[1] - 1)
        lines = self.lines(np.arange(rows.start, rows.stop, rows.step or 1))
        levels: Single = (self.rings[columns] + lines[:, before]) + w * (lines[:, after] - lines[:, before])
        return levels

    def subtract(self, level: Int16) -> None:
        """Replace pixels (rows, columns) by the level of the background minus their level, in steps of 0.01 dB."""
        middles, weights = self.weights()
        for top in range(0, len(level), ROWS):
            part = level[top : top + ROWS]
            _subtract(part, self.lines(np.arange(top, top + len(part))), self.rings, middles, weights)

    def weights(self) -> tuple[Int64, Single]:
        """Return the interpolation between the middles of tiles, for compiled functions.

        Returns
        -------
        middles : (tiles + 2,) int array
            First column behind the middle of each tile; at the ends the first column and the last + 1.
        weights : (columns,) float32 array
            Weight of the tile whose middle is behind a column, 0 to 1; the tile before has the rest.
        """
        before, w = self._place(np.arange(len(self.rings)))
        middles = np.searchsorted(before, np.arange(self.smooth.shape[1]))
        return np.concatenate([[0], middles, [len(before)]]), w

    def _place(self, column: Int64) -> tuple[Int64, Single]:
        """Return the last tile whose middle is before each column (else the first), and the weight of the next one."""
        at = (column.astype(np.float32) + np.float32(0.5)) * np.float32(1.0 / self.tile) - np.float32(0.5)
        before = np.maximum(at, np.float32(0.0)).astype(np.int64)
        return before, np.maximum(at - before.astype(np.float32), np.float32(0.0))


def _between(place: Float, count: int) -> tuple[Int64, Int64, Single]:
    """Return the two nodes, one apart, around each place, and the weight of the second, 0 to 1."""
    before = np.clip(np.floor(place).astype(np.int64), 0, count - 1)
    return before, np.minimum(before + 1, count - 1), np.clip(place - before, 0.0, 1.0).astype(np.float32)


@kernel
def _subtract(
    level: Int16, lines: Single, rings: Single, middles: Int64, weights: Single
) -> None:  # pragma: no cover - compiled
    """Replace levels (rows, columns) by the level of the background minus them, steps; NODATA stays."""
    per_step, tiles = np.float32(PER_DECIBEL), lines.shape[1]
    for i in range(level.shape[0]):
        for m in range(tiles + 1):  # between the middles of tiles m - 1 and m
            before = lines[i, m - 1 if m > 0 else 0]
            rise = lines[i, m if m < tiles else tiles - 1] - before
            for j in range(middles[m], middles[m + 1]):
                if level[i, j] != NODATA:
                    drop = np.rint((rings[j] + before + weights[j] * rise) * per_step) - level[i, j]
                    level[i, j] = min(max(drop, NODATA + 1), -NODATA - 1)
