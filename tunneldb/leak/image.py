"""The unrolled image of a kilometre, gathered from points in any order in bounded memory.

A pixel holds sums over the points that fall into it. The sums lie in a file of the temporary folder that is
mapped into memory and given back to the system after each chunk of points, so that the memory in use doesn't
grow with the image.
"""

from __future__ import annotations

import mmap
import os
import tempfile
from dataclasses import dataclass
from types import TracebackType

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

    Use it as a context manager: the file that holds the sums goes at the end.

    Parameters
    ----------
    grid : Grid
        The pixels.

    Raises
    ------
    UserError
        If the temporary folder has no room for the image.
    """

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        shape = (grid.blocks, grid.rows, grid.block_columns, CHANNELS)
        size = int(np.prod(shape)) * 4
        self._file = tempfile.TemporaryFile(prefix="tunneldb-image-")  # noqa: SIM115 - closed by __exit__
        try:
            os.posix_fallocate(self._file.fileno(), 0, size)
        except OSError as error:
            self._file.close()
            raise UserError(
                f"no room for the image of km {grid.km} in {tempfile.gettempdir()} ({size / 1e9:.1f} GB): "
                f"{error.strerror}; set TMPDIR to a folder with more"
            ) from None
        self._map = mmap.mmap(self._file.fileno(), size)
        self._sums = np.frombuffer(self._map, dtype=np.float32).reshape(shape)
        self._held = np.zeros(grid.blocks, np.bool_)

    def __enter__(self) -> Accumulator:
        """Return the accumulator."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Give the file back."""
        del self._sums
        self._map.close()
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
        """
        grid = self.grid
        added = _add(
            self._sums,
            self._held,
            grid.km * KILOMETRE,
            1.0 / grid.pixel,
            grid.bottom,
            chainage,
            arc,
            offset,
            raw,
            corrected,
            use,
        )
        self._give_back()
        return int(added)

    def blocks(self) -> list[int]:
        """Blocks, counted from 0, that hold points."""
        return [int(block) for block in np.flatnonzero(self._held)]

    def window(self, start: int, stop: int) -> Window:
        """Means over the columns from ``start`` up to ``stop``; columns outside the kilometre are cut off."""
        start, stop = max(start, 0), min(stop, self.grid.columns)
        width = self.grid.block_columns
        pieces = []
        for block in range(start // width, (stop - 1) // width + 1):
            first = block * width
            pieces.append(self._sums[block, :, max(start - first, 0) : stop - first, :].copy())
        self._give_back()
        sums = np.concatenate(pieces, axis=1)
        count = sums[:, :, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            offset, raw, corrected = (sums[:, :, k] / count for k in (1, 2, 3))
        return Window(slice(start, stop), count.astype(np.int32), offset, raw, corrected)

    def _give_back(self) -> None:
        """Let the system drop the mapped pages from this process; the sums stay in its cache or on disk."""
        self._map.madvise(mmap.MADV_DONTNEED)


@njit(cache=True, nogil=True)
def _add(
    sums: NDArray[np.float32],
    held: NDArray[np.bool_],
    start: float,
    per_metre: float,
    bottom: int,
    chainage: Float,
    arc: Float,
    offset: Float,
    raw: Single,
    corrected: Single,
    use: NDArray[np.bool_],
) -> int:  # pragma: no cover - compiled
    blocks, rows, width, _ = sums.shape
    added = 0
    for i in range(chainage.shape[0]):
        if not use[i]:
            continue
        column = int(np.floor((chainage[i] - start) * per_metre))
        row = rows - 1 - (int(np.floor(arc[i] * per_metre)) - bottom)
        if column < 0 or column >= blocks * width or row < 0 or row >= rows:
            continue
        block = column // width
        held[block] = True
        pixel = sums[block, row, column - block * width]
        pixel[0] += 1.0
        pixel[1] += offset[i]
        pixel[2] += raw[i]
        pixel[3] += corrected[i]
        added += 1
    return added
