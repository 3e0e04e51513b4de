"""Unrolled image of a kilometre, accumulated from points in any order in limited memory.

A pixel has weighted sums over its points: several stations are blended by the weights of their views
(:func:`tunneldb.raster.projection.pixel_weight`). Only the blocks used last are in memory; the others are in a file in the
temporary folder.
"""

from __future__ import annotations

import errno
import os
import tempfile
from collections import OrderedDict
from dataclasses import dataclass
from types import TracebackType
from typing import BinaryIO

import numpy as np

from tunneldb.arrays import Bool, Int32, Int64, Single, Whole
from tunneldb.compiled import kernel, point_inner, point_kernel
from tunneldb.errors import UserError
from tunneldb.raster.grid import Grid
from tunneldb.raster.projection import WEIGHT, Pixels
from tunneldb.threads import in_blocks, threads

MEMORY = 400_000_000
"""Bytes of memory for sums."""

CHANNELS = 4
"""Number of sums of a pixel: weight and, weighted, offset, raw and corrected intensity."""

OFFSET, LEVEL = 2.0**-11, 2.0**-7
"""Steps of offset (m) and intensity (dB) for summing whole numbers, half a millimetre and less than a stored
step."""

MAX_STEPS = 2**14 - 1
"""Maximum number of steps that a point adds per unit of its weight: 8 m, 128 dB."""

MAX_WEIGHT_SUM = 2**17 - WEIGHT
"""Sum of weights from which a pixel accepts no more points, so that no sum exceeds 2³¹. It is 2,047 points seen at right
angles from nearby, 0.4 mm apart in a pixel of 2 cm. Larger pixels have 64-bit sums and are never full."""


@dataclass(frozen=True)
class Window:
    """Weighted means over a few columns of the image; (rows, columns) arrays, NaN in pixels without a point.

    Attributes
    ----------
    columns : slice
        Columns of the grid.
    weight : int array
        Weights of the points in the pixel, 0 without a point.
    offset : float32 array
        Mean offset from the section surface, m.
    raw, corrected : float32 arrays
        Mean raw and corrected intensity, dB.
    """

    columns: slice
    weight: Whole
    offset: Single
    raw: Single
    corrected: Single

    def cut(self, columns: slice) -> Window:
        """Return the part of the columns within a slice of the grid's columns."""
        here = slice(columns.start - self.columns.start, columns.stop - self.columns.start)
        return Window(columns, self.weight[:, here], self.offset[:, here], self.raw[:, here], self.corrected[:, here])


class Accumulator:
    """Sums of all points of a kilometre by pixel.

    Use it as a context manager: it deletes its file at the end.

    Parameters
    ----------
    grid : Grid
        The pixels.
    memory : int
        Bytes of memory for sums, at least those of one block.
    """

    def __init__(self, grid: Grid, memory: int = MEMORY) -> None:
        self.grid = grid
        self._shape = (grid.rows, grid.block_columns, CHANNELS)
        small = grid.pixel < 0.0201
        self._type = np.dtype(np.int32 if small else np.int64)
        self._full = MAX_WEIGHT_SUM if small else np.iinfo(np.int64).max
        self._bytes = self._type.itemsize * int(np.prod(self._shape))
        self._room = max(1, memory // self._bytes)
        self._blocks: OrderedDict[int, Whole] = OrderedDict()
        """Blocks in memory, the one used last at the end."""
        self._changed: set[int] = set()
        self._spilled: set[int] = set()
        self._file: BinaryIO | None = None

    def __enter__(self) -> Accumulator:
        """Return the accumulator."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Free memory and file."""
        self._blocks.clear()
        if self._file:
            self._file.close()

    def add(self, pixels: Pixels, count: int) -> None:
        """Add points.

        Offset and intensity are rounded to OFFSET and LEVEL and summed as whole numbers. So sums are exact, and independent of
        the order of the points, as long as no pixel is MAX_WEIGHT_SUM.

        Parameters
        ----------
        pixels : Pixels
            Pixels and values of the points; those with column -1 are skipped.
        count : int
            Number of its points to add.

        Raises
        ------
        UserError
            If the temporary folder has no space for the blocks that do not fit in memory.
        """
        pixels = pixels.part(0, count)
        width = self.grid.block_columns
        marked = np.zeros(self.grid.columns // width, np.bool_)
        _touched(pixels.column, width, marked)
        touched = np.flatnonzero(marked).tolist()
        # Blocks in memory first, before fetching another one removes them.
        for block in sorted(touched, key=lambda b: b not in self._blocks):
            self._add(block, pixels)
            self._changed.add(block)

    def _add(self, block: int, pixels: Pixels) -> None:
        """Add the points of a block; each thread has its own rows."""
        sums, first, parts = self._fetch(block), block * self.grid.block_columns, threads()

        def rows(part: int, _: int) -> None:
            _add(sums, first, *pixels, self._full, part, parts)

        in_blocks(rows, parts, 1)

    def blocks(self) -> list[int]:
        """Return the blocks, counted from 0, that have points."""
        return sorted(self._spilled | self._blocks.keys())

    def inner_blocks(self) -> list[int]:
        """Return the blocks of the kilometre itself that have points."""
        width, inner = self.grid.block_columns, self.grid.inner
        return [block for block in self.blocks() if inner.start <= block * width < inner.stop]

    def window(self, start: int, stop: int) -> Window:
        """Return the means over the columns from ``start`` up to ``stop``, limited to the grid."""
        start, stop = max(start, 0), min(stop, self.grid.columns)
        width = self.grid.block_columns
        selected = set(self.blocks())
        weight = np.zeros((self.grid.rows, stop - start), self._type)
        means = np.empty((CHANNELS - 1, *weight.shape), np.float32)
        for block in range(start // width, (stop - 1) // width + 1):
            first, last = max(block * width, start), min((block + 1) * width, stop)
            if block in selected:
                _means(self._fetch(block), first - block * width, weight, means, first - start, last - start)
            else:
                means[:, :, first - start : last - start] = np.nan
        return Window(slice(start, stop), weight, *means)

    def has_points(self, block: int) -> Bool:
        """Return True for pixels (rows, columns) of a block that have points."""
        return np.asarray(self._fetch(block)[:, :, 0] > 0, dtype=np.bool_)

    def sums(self, block: int) -> Whole:
        """Return the sums (rows, columns of a block, CHANNELS) of a block that has points."""
        return self._fetch(block)

    def put(self, block: int, sums: Int64) -> None:
        """Replace the sums of a block.

        Raises
        ------
        UserError
            If the temporary folder has no space for the blocks that do not fit in memory.
        """
        self._fetch(block)[:] = sums
        self._changed.add(block)

    def _fetch(self, block: int) -> Whole:
        """Return the sums of a block, loaded into memory, from the file or new."""
        if block in self._blocks:
            self._blocks.move_to_end(block)
            return self._blocks[block]
        while len(self._blocks) >= self._room:
            self._put_out(*self._blocks.popitem(last=False))
        sums: Whole = np.zeros(self._shape, self._type)
        if block in self._spilled:
            assert self._file
            self._file.seek(block * self._bytes)
            self._file.readinto(sums.data.cast("B"))  # type: ignore[attr-defined]
        self._blocks[block] = sums
        return sums

    def _put_out(self, block: int, sums: Whole) -> None:
        """Write a block that leaves memory to the file, unless it is already there."""
        if block not in self._changed:
            return
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(  # noqa: SIM115 - closed by __exit__
                    prefix="tunneldb-image-", buffering=0
                )
            self._file.seek(block * self._bytes)
            written = self._file.write(sums.data.cast("B"))
            if written < self._bytes:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise UserError(
                f"not enough space for the image of km {self.grid.km} in {tempfile.gettempdir()}: {error.strerror}; it may need"
                f" {self._bytes * self.grid.blocks / 1e9:.1f} GB; set TMPDIR to a folder with more space"
            ) from error
        self._changed.discard(block)
        self._spilled.add(block)


@kernel
def _touched(column: Int32, width: int, touched: Bool) -> None:  # pragma: no cover - compiled
    """Mark the blocks with points."""
    first, stop = 0, 0  # columns of the block of the previous point
    for i in range(column.shape[0]):
        c = int(column[i])
        if c >= 0 and not first <= c < stop:
            block = c // width
            touched[block] = True
            first, stop = block * width, (block + 1) * width


@kernel
def _add(
    sums: Whole,
    first: int,
    row: Int32,
    column: Int32,
    weight: Int32,
    offset: Single,
    raw: Single,
    corrected: Single,
    full: int,
    part: int,
    parts: int,
) -> None:  # pragma: no cover - compiled
    """Add the points of a block, into every ``parts``-th of its rows."""
    width = sums.shape[1]
    for i in range(row.shape[0]):
        r, c = row[i], column[i] - first
        if 0 <= c < width and r % parts == part and sums[r, c, 0] <= full:
            sums[r, c, 0] += weight[i]
            sums[r, c, 1] += weight[i] * _multiple(offset[i] * np.float32(1.0 / OFFSET))
            sums[r, c, 2] += weight[i] * _multiple(raw[i] * np.float32(1.0 / LEVEL))
            sums[r, c, 3] += weight[i] * _multiple(corrected[i] * np.float32(1.0 / LEVEL))


@point_inner
def _multiple(value: np.float32) -> np.int32:  # pragma: no cover - compiled
    most = np.float32(MAX_STEPS)
    return np.int32(np.rint(most if value > most else (value if value > -most else -most)))


@point_kernel
def _means(sums: Whole, skip: int, weight: Whole, means: Single, first: int, stop: int) -> None:  # pragma: no cover - compiled
    """Divide the sums of a block, from column ``skip`` on, into columns ``first`` to ``stop`` of a window."""
    for i in range(weight.shape[0]):
        for j in range(first, stop):
            k = j - first + skip
            total = sums[i, k, 0]
            weight[i, j] = total
            per = 1.0 / total if total > 0 else np.nan
            means[0, i, j] = sums[i, k, 1] * (per * OFFSET)
            means[1, i, j] = sums[i, k, 2] * (per * LEVEL)
            means[2, i, j] = sums[i, k, 3] * (per * LEVEL)
