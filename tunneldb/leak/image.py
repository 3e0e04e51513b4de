"""The unrolled image of a kilometre, gathered from points in any order in bounded memory.

A pixel holds sums over the points that fall into it. Only the blocks used last lie in memory; the others in a file
of the temporary folder.
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
from affine import Affine
from numba import njit
from numpy.typing import NDArray

from tunneldb.errors import UserError

Float = NDArray[np.float64]
Single = NDArray[np.float32]

KILOMETRE = 1000.0
BLOCK = 50.0
"""Length of a block of the image along the tunnel, m."""

MEMORY = 400_000_000
"""Bytes of memory for sums."""

CHANNELS = 4
"""Sums a pixel holds: points, offset, raw, corrected."""


@dataclass(frozen=True)
class Grid:
    """Pixels of one kilometre in the unrolled plane: columns along the chainage, rows from the greatest arc.

    Attributes
    ----------
    km : int
        Kilometre: chainage from 1000 km to 1000 (km + 1).
    pixel : float
        Side of a pixel, m; divides a block of 50 m.
    bottom : int
        Arc of the lower edge of the last row, in pixels.
    rows : int
        Number of rows.
    """

    km: int
    pixel: float
    bottom: int
    rows: int

    @classmethod
    def covering(cls, km: int, pixel: float, arc_min: float, arc_max: float) -> Grid:
        """Make the grid that covers the given arcs, m.

        Raises
        ------
        UserError
            If the pixel is smaller than 2 mm or doesn't divide 50 m.
        """
        if not pixel >= 0.002 or abs(BLOCK / pixel - round(BLOCK / pixel)) > 1e-6:
            raise UserError(f"image.pixel must be at least 0.002 m and divide 50 m: {pixel:g} m does not")
        bottom, top = int(np.floor(arc_min / pixel)), int(np.ceil(arc_max / pixel))
        return cls(km, pixel, bottom, top - bottom)

    @property
    def columns(self) -> int:
        """Number of columns."""
        return self.block_columns * self.blocks

    @property
    def block_columns(self) -> int:
        """Number of columns in a block."""
        return round(BLOCK / self.pixel)

    @property
    def blocks(self) -> int:
        """Number of blocks in the kilometre."""
        return round(KILOMETRE / BLOCK)

    @property
    def first_block(self) -> int:
        """Number of the kilometre's first block, counted from chainage 0."""
        return self.km * self.blocks

    def transform(self, column: int = 0) -> Affine:
        """Transform from pixels, counted from a column, to (chainage, arc)."""
        west = self.km * KILOMETRE + column * self.pixel
        return Affine(self.pixel, 0.0, west, 0.0, -self.pixel, (self.bottom + self.rows) * self.pixel)

    def pick(self, mask: NDArray[np.bool_], chainage: Float, arc: Float) -> NDArray[np.bool_]:
        """Value of a mask (rows, columns) at places (n,) in the unrolled plane; False outside the kilometre."""
        held = np.isfinite(chainage) & np.isfinite(arc)
        column = np.floor((np.where(held, chainage, 0.0) - self.km * KILOMETRE) / self.pixel).astype(np.int64)
        row = self.rows - 1 - (np.floor(np.where(held, arc, 0.0) / self.pixel).astype(np.int64) - self.bottom)
        held &= (column >= 0) & (column < self.columns) & (row >= 0) & (row < self.rows)
        values = np.zeros(len(held), np.bool_)
        values[held] = mask[row[held], column[held]]
        return values

    def chainages(self, columns: slice) -> Float:
        """Chainage of the centres of columns, m."""
        return np.asarray(self.km * KILOMETRE + (np.arange(columns.start, columns.stop) + 0.5) * self.pixel)

    def arcs(self) -> Float:
        """Arc of the centres of the rows, m."""
        return np.asarray((self.bottom + self.rows - np.arange(self.rows) - 0.5) * self.pixel)


@dataclass(frozen=True)
class Window:
    """Means over a few columns of the image; (rows, columns) arrays, NaN where no point fell.

    Attributes
    ----------
    columns : slice
        Columns of the grid.
    count : int32 array
        Points in the pixel.
    offset : float32 array
        Mean offset from the section surface, m.
    raw, corrected : float32 arrays
        Mean raw and corrected intensity, dB.
    """

    columns: slice
    count: NDArray[np.int32]
    offset: Single
    raw: Single
    corrected: Single


class Accumulator:
    """Sums of all points of a kilometre by pixel.

    Use it as a context manager: the file that holds what memory doesn't goes at the end.

    Parameters
    ----------
    grid : Grid
        The pixels.
    memory : int
        Bytes of memory for sums, at least one block's.
    """

    def __init__(self, grid: Grid, memory: int = MEMORY) -> None:
        self.grid = grid
        self._shape = (grid.rows, grid.block_columns, CHANNELS)
        self._bytes = 4 * int(np.prod(self._shape))
        self._room = max(1, memory // self._bytes)
        self._blocks: OrderedDict[int, Single] = OrderedDict()
        """Blocks in memory, the one used last at the end."""
        self._changed: set[int] = set()
        self._spilled: set[int] = set()
        self._file: BinaryIO | None = None

    def __enter__(self) -> Accumulator:
        """Return the accumulator."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Give memory and file back."""
        self._blocks.clear()
        if self._file:
            self._file.close()

    def add(
        self,
        chainage: Float,
        arc: Float,
        offset: Float,
        raw: Single,
        corrected: Single,
        use: NDArray[np.bool_],
    ) -> int:
        """Add points; return how many fell on the image.

        Parameters
        ----------
        chainage, arc, offset : (n,) float arrays
            Coordinates in the unrolled plane and offset, m. Points of other kilometres are passed over.
        raw, corrected : (n,) float32 arrays
            Intensity, dB.
        use : (n,) bool array
            Which points to add; their offset and intensities must not be NaN.

        Raises
        ------
        UserError
            If the temporary folder has no room for what memory doesn't hold.
        """
        grid = self.grid
        row, column = _pixels(grid.km * KILOMETRE, 1.0 / grid.pixel, grid.bottom, grid.rows, grid.columns, chainage, arc, use)
        width = grid.block_columns
        touched = np.unique(column[column >= 0] // width).tolist()
        # Blocks in memory first, lest fetching another one puts them out.
        for block in sorted(touched, key=lambda b: b not in self._blocks):
            _add(self._fetch(block), row, column - block * width, offset, raw, corrected)
            self._changed.add(block)
        return int(np.count_nonzero(column >= 0))

    def blocks(self) -> list[int]:
        """Blocks, counted from 0, that hold points."""
        return sorted(self._spilled | self._blocks.keys())

    def window(self, start: int, stop: int) -> Window:
        """Means over the columns from ``start`` up to ``stop``; columns outside the kilometre are cut off."""
        start, stop = max(start, 0), min(stop, self.grid.columns)
        width = self.grid.block_columns
        held = set(self.blocks())
        sums = np.zeros((self.grid.rows, stop - start, CHANNELS), np.float32)
        for block in range(start // width, (stop - 1) // width + 1):
            if block in held:
                first, last = max(block * width, start), min((block + 1) * width, stop)
                part = self._fetch(block)[:, first - block * width : last - block * width]
                sums[:, first - start : last - start] = part
        count = sums[:, :, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            offset, raw, corrected = (sums[:, :, k] / count for k in (1, 2, 3))
        return Window(slice(start, stop), count.astype(np.int32), offset, raw, corrected)

    def _fetch(self, block: int) -> Single:
        """Sums of a block, brought into memory, from the file or new."""
        if block in self._blocks:
            self._blocks.move_to_end(block)
            return self._blocks[block]
        while len(self._blocks) >= self._room:
            self._put_out(*self._blocks.popitem(last=False))
        sums = np.zeros(self._shape, np.float32)
        if block in self._spilled:
            assert self._file
            self._file.seek(block * self._bytes)
            self._file.readinto(sums.data.cast("B"))  # type: ignore[attr-defined]
        self._blocks[block] = sums
        return sums

    def _put_out(self, block: int, sums: Single) -> None:
        """Write a block that leaves memory to the file, unless it is there already."""
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
                f"no room for the image of km {self.grid.km} in {tempfile.gettempdir()}: {error.strerror}; it may need"
                f" {self._bytes * self.grid.blocks / 1e9:.1f} GB; set TMPDIR to a folder with more"
            ) from error
        self._changed.discard(block)
        self._spilled.add(block)


@njit(cache=True, nogil=True)
def _pixels(
    start: float,
    per_metre: float,
    bottom: int,
    rows: int,
    columns: int,
    chainage: Float,
    arc: Float,
    use: NDArray[np.bool_],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:  # pragma: no cover - compiled
    """Row and column of each point; column -1 for those not to be added."""
    row = np.zeros(chainage.shape[0], np.int32)
    column = np.full(chainage.shape[0], -1, np.int32)
    for i in range(chainage.shape[0]):
        if use[i]:
            c = np.floor((chainage[i] - start) * per_metre)
            r = rows - 1 - (np.floor(arc[i] * per_metre) - bottom)
            if 0 <= c < columns and 0 <= r < rows:
                row[i] = int(r)
                column[i] = int(c)
    return row, column


@njit(cache=True, nogil=True)
def _add(
    sums: Single,
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    offset: Float,
    raw: Single,
    corrected: Single,
) -> None:  # pragma: no cover - compiled
    width = sums.shape[1]
    for i in range(row.shape[0]):
        if 0 <= column[i] < width:
            pixel = sums[row[i], column[i]]
            pixel[0] += 1.0
            pixel[1] += offset[i]
            pixel[2] += raw[i]
            pixel[3] += corrected[i]
