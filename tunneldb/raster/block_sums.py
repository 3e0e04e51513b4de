"""Sums by pixel of a kilometre, in blocks: those used last in memory, the others in a file in the temporary folder."""

from __future__ import annotations

import errno
import os
import tempfile
from collections import OrderedDict
from collections.abc import Callable
from types import TracebackType
from typing import BinaryIO, Self

import numpy as np

from tunneldb.arrays import Bool, Int32, Int64, Whole
from tunneldb.compiled import kernel
from tunneldb.errors import UserError
from tunneldb.raster.grid import Grid
from tunneldb.raster.projection import WEIGHT, Pixels
from tunneldb.threads import in_blocks, threads

MAX_WEIGHT_SUM = 2**17 - WEIGHT
"""Sum of weights from which a pixel accepts no more points, so that no sum exceeds 2³¹. It is 2,047 points seen at right
angles from nearby, 0.4 mm apart in a pixel of 2 cm. Larger pixels have 64-bit sums and are never full."""

MAX_STEPS = 2**14 - 1
"""Maximum number of steps that a point adds per unit of its weight."""


class BlockSums:
    """Whole-number sums of a kilometre by pixel; the first channel is the sum of weights.

    Use it as a context manager: it deletes its file at the end.

    Parameters
    ----------
    grid : Grid
        The pixels.
    channels : int
        Number of sums of a pixel.
    memory : int
        Bytes of memory for sums, at least those of one block.
    """

    def __init__(self, grid: Grid, channels: int, memory: int) -> None:
        self.grid = grid
        self._shape = (grid.rows, grid.block_columns, channels)
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

    def __enter__(self) -> Self:
        """Return the sums."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Free memory and file."""
        self._blocks.clear()
        if self._file:
            self._file.close()

    def _touched(self, pixels: Pixels) -> list[int]:
        """Return the blocks of points, those in memory first, before fetching another one removes them."""
        width = self.grid.block_columns
        marked = np.zeros(self.grid.columns // width, np.bool_)
        _touched(pixels.column, width, marked)
        return sorted(np.flatnonzero(marked).tolist(), key=lambda block: block not in self._blocks)

    def _add_points(self, pixels: Pixels, add: Callable[[Whole, int, int, int], None]) -> None:
        """Add points to the blocks that they touch.

        Parameters
        ----------
        pixels : Pixels
            Pixels of the points; those with column -1 are skipped.
        add : callable
            Adds the points of a block; given its sums, its first column, the thread's part and the number of parts.

        Raises
        ------
        UserError
            If the temporary folder has no space for the blocks that do not fit in memory.
        """
        for block in self._touched(pixels):
            self._add_to(block, add)

    def _add_to(self, block: int, add: Callable[[Whole, int, int, int], None]) -> None:
        """Add the points of a block; each thread has its own rows."""
        sums, first, parts = self._fetch(block), block * self.grid.block_columns, threads()
        in_blocks(lambda part, _: add(sums, first, part, parts), parts, 1)
        self._changed.add(block)

    def blocks(self) -> list[int]:
        """Return the blocks, counted from 0, that have points."""
        return sorted(self._spilled | self._blocks.keys())

    def inner_blocks(self) -> list[int]:
        """Return the blocks of the kilometre itself that have points."""
        width, inner = self.grid.block_columns, self.grid.inner
        return [block for block in self.blocks() if inner.start <= block * width < inner.stop]

    def has_points(self, block: int) -> Bool:
        """Return True for pixels (rows, columns) of a block that have points."""
        return np.asarray(self._fetch(block)[:, :, 0] > 0, dtype=np.bool_)

    def sums(self, block: int) -> Whole:
        """Return the sums (rows, columns of a block, channels) of a block that has points."""
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
