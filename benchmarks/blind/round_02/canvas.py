"""The unrolled lining: what it is made of, its relief, dirt and moisture, on rasters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .arrays import FloatArray

CELL = 0.01


@dataclass(frozen=True)
class Window:
    """Part of the canvas with the coordinates of its cells."""

    rows: slice
    columns: slice
    s: FloatArray
    t: FloatArray

    @property
    def index(self) -> tuple[slice, slice]:
        """Index into the rasters of the canvas."""
        return self.rows, self.columns

    @property
    def shape(self) -> tuple[int, int]:
        """Count of cells along and across."""
        return self.s.size, self.t.size


@dataclass(frozen=True)
class Mark:
    """Something on the lining that has an outline: where `weight` exceeds one half.

    Attributes
    ----------
    kind : str
        Word for it.
    window : Window
        Where it lies.
    weight : ndarray
        0 to 1.
    limit : str
        Why an inspector could not tell it, if so.
    """

    kind: str
    window: Window
    weight: FloatArray
    limit: str = ""


class Canvas:
    """Rasters over chainage (rows) and girth (columns).

    Parameters
    ----------
    length : float
        Metres of tunnel, from chainage 0.
    half : float
        Girth from the crown to the end of a side.
    """

    def __init__(self, length: float, half: float) -> None:
        self.length, self.half = length, half
        self.s = (np.arange(round(length / CELL)) + 0.5) * CELL
        self.t = (np.arange(int(2 * half / CELL)) + 0.5) * CELL - half
        shape = self.s.size, self.t.size
        self.shape = shape
        self.albedo = np.zeros(shape, dtype=np.float32)
        self.relief = np.zeros(shape, dtype=np.float32)
        self.soot = np.zeros(shape, dtype=np.float32)
        self.units = np.zeros(shape, dtype=np.float32)
        self.wet = np.zeros(shape, dtype=np.float32)
        self.drop = np.zeros(shape, dtype=np.float32)
        self.film = np.zeros(shape, dtype=np.float32)
        self.leaks: list[Mark] = []
        self.others: list[Mark] = []

    def window(self, s0: float, s1: float, t0: float, t1: float) -> Window:
        """Part between two chainages and two girths."""
        rows = slice(max(0, round(s0 / CELL)), min(self.s.size, round(s1 / CELL)))
        columns = slice(max(0, round((t0 + self.half) / CELL)), min(self.t.size, round((t1 + self.half) / CELL)))
        return Window(rows, columns, self.s[rows], self.t[columns])

    def whole(self) -> Window:
        """All of it."""
        return Window(slice(None), slice(None), self.s, self.t)

    def reflectance(self) -> FloatArray:
        """Reflectance of each cell in dB; what is sooty already darkens less by water."""
        return np.asarray(self.albedo - self.drop * (1 - 0.5 * np.clip(self.soot, 0, 1)))

    def sample(self, raster: FloatArray, s: FloatArray, t: FloatArray) -> FloatArray:
        """Values of a raster at points, bilinear."""
        where = np.stack([s / CELL - 0.5, (t + self.half) / CELL - 0.5])
        return np.asarray(ndimage.map_coordinates(raster, where, output=np.float64, order=1, mode="nearest"))
