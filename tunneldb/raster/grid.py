"""Pixels of a kilometre in the unrolled plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from affine import Affine

from tunneldb.arrays import Bool, Float, Int32
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE

BLOCK = 50.0
"""Length of a block of the image along the tunnel, m."""

BLOCKS = round(KILOMETRE / BLOCK)
"""Number of blocks of a kilometre."""


class PixelGrid:
    """Pixels of an unrolled surface: columns along its first coordinate, rows from the greatest of its second.

    Attributes
    ----------
    pixel : float
        Side of a pixel, m.
    bottom : int
        Second coordinate of the lower edge of the last row, in pixels.
    rows : int
        Number of rows.
    """

    pixel: float
    bottom: int
    rows: int

    @property
    def columns(self) -> int:
        """Number of columns."""
        raise NotImplementedError

    @property
    def first_column(self) -> int:
        """Number of the first column, counted from where the first coordinate is 0."""
        raise NotImplementedError

    @property
    def block_columns(self) -> int:
        """Number of columns in a block."""
        return self.columns

    @property
    def inner(self) -> slice:
        """Columns with results; the others only provide context."""
        return slice(0, self.columns)

    @property
    def west(self) -> float:
        """First coordinate at which the first column begins, m."""
        return self.first_column * self.pixel

    def transform(self, column: int = 0) -> Affine:
        """Return the transform from pixels, counted from a column, to unrolled coordinates."""
        return Affine(
            self.pixel, 0.0, self.west + column * self.pixel, 0.0, -self.pixel, (self.bottom + self.rows) * self.pixel
        )

    def place(self, chainage: Float, arc: Float) -> tuple[Int32, Int32]:
        """Return row and column of places (n,) in the unrolled plane, m; column -1 outside the grid."""
        with np.errstate(invalid="ignore"):
            column = np.floor((chainage - self.west) / self.pixel)
            row = self.rows - 1 - (np.floor(arc / self.pixel) - self.bottom)
            selected = (column >= 0) & (column < self.columns) & (row >= 0) & (row < self.rows)
        return np.where(selected, row, 0).astype(np.int32), np.where(selected, column, -1).astype(np.int32)

    def pick(self, mask: Bool, chainage: Float, arc: Float) -> Bool:
        """Return the values of a mask (rows, columns) at places (n,) in the unrolled plane; False outside the grid."""
        row, column = self.place(chainage, arc)
        return np.asarray((column >= 0) & mask[row, column], dtype=np.bool_)


@dataclass(frozen=True)
class FaceGrid(PixelGrid):
    """Pixels of one face, all with results.

    Attributes
    ----------
    pixel, bottom, rows
        As for any grid.
    left, width : int
        Number of the first column, counted from where the first coordinate is 0, and number of columns.
    """

    pixel: float
    bottom: int
    rows: int
    left: int
    width: int

    @property
    def columns(self) -> int:
        """Number of columns."""
        return self.width

    @property
    def first_column(self) -> int:
        """Number of the first column."""
        return self.left


@dataclass(frozen=True)
class Grid(PixelGrid):
    """Pixels of one kilometre in the unrolled plane: columns along the chainage, rows from the greatest arc.

    With a halo the grid has one more block before and after the kilometre, as context for pixels at its ends. Rows and columns
    of the grids of all kilometres are aligned. If a tunnel begins or ends within the kilometre, the grid covers only the blocks
    of the tunnel.

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
    halo : int
        Columns beyond each end of the kilometre that accept points, at most a block; 0 for the kilometre alone.
    covered : pair of int
        First covered block of the kilometre, and one after the last.
    """

    km: int
    pixel: float
    bottom: int
    rows: int
    halo: int = 0
    covered: tuple[int, int] = (0, BLOCKS)

    @classmethod
    def covering(
        cls,
        km: int,
        pixel: float,
        arc_min: float,
        arc_max: float,
        halo: int = 0,
        chainages: tuple[float, float] = (-np.inf, np.inf),
    ) -> Grid:
        """Make the grid for the given arcs, m, a halo, pixels, and the blocks between two chainages, m; all by default.

        Raises
        ------
        UserError
            If the pixel is smaller than 2 mm or does not divide 50 m.
        """
        if not pixel >= 0.002 or abs(BLOCK / pixel - round(BLOCK / pixel)) > 1e-6:
            raise UserError(f"image.pixel is {pixel:g} m; it must be at least 0.002 m and divide 50 m")
        bottom, top = int(np.floor(arc_min / pixel)), int(np.ceil(arc_max / pixel))
        west, east = np.array(chainages) / BLOCK - km * BLOCKS
        first = int(np.clip(np.floor(west), 0, BLOCKS - 1))
        return cls(km, pixel, bottom, top - bottom, halo, (first, int(np.clip(np.ceil(east), first + 1, BLOCKS))))

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
        """Number of blocks."""
        first, stop = self.covered
        return stop - first + 2 * self._ahead

    @property
    def _ahead(self) -> int:
        """Blocks before the kilometre."""
        return 1 if self.halo else 0

    @property
    def inner(self) -> slice:
        """Covered columns of the kilometre itself."""
        return slice(self._ahead * self.block_columns, (self.blocks - self._ahead) * self.block_columns)

    @property
    def near(self) -> slice:
        """Columns that accept points: the kilometre's and those of the halo."""
        return slice(self.inner.start - self.halo, self.inner.stop + self.halo)

    def columns_between(self, low: float, high: float) -> slice:
        """Return the columns entirely between two chainages, m, which may be infinite."""
        first, stop = np.clip((np.array([low, high]) - self.west) / self.pixel, 0.0, self.columns)
        begin = int(np.ceil(first - 1e-6))
        return slice(begin, max(int(np.floor(stop + 1e-6)), begin))

    @property
    def first_block(self) -> int:
        """Number of the first block, counted from chainage 0."""
        return self.km * BLOCKS + self.covered[0] - self._ahead

    @property
    def first_column(self) -> int:
        """Number of the first column, counted from chainage 0."""
        return self.first_block * self.block_columns

    @property
    def west(self) -> float:
        """Chainage at which the first column begins, m."""
        return self.first_block * BLOCK

    def chainages(self, columns: slice) -> Float:
        """Return the chainage of the centres of columns, m."""
        return np.asarray(self.west + (np.arange(columns.start, columns.stop) + 0.5) * self.pixel)

    def arcs(self) -> Float:
        """Return the arc of the centres of the rows, m."""
        return np.asarray((self.bottom + self.rows - np.arange(self.rows) - 0.5) * self.pixel)
