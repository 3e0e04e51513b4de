"""Images in pixels of their own, resampled into blocks of the unrolled plane; of each block only the pixels needed are read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import ndimage

from tunneldb.arrays import Float, Single
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.placement.mapping import Mapping, outline, pixel_sides

PIXELS = (0.002, 0.0025, 0.004, 0.005, 0.01, 0.02, 0.025, 0.04, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0)
"""Sides of the pixels of imported images, m: they divide a block of 50 m."""

PART = 1 << 20
"""Number of pixels that are computed at once."""

MAX_SOURCE = 1 << 26
"""Maximum number of pixels of a source image that are read at once."""

MIN_WEIGHT = 0.5
"""Minimum weight of valid neighbours of a resampled value."""


class Source(Protocol):
    """Image in pixels of its own.

    Attributes
    ----------
    columns, rows, bands : int
        Size.
    """

    @property
    def columns(self) -> int:
        """Number of columns."""

    @property
    def rows(self) -> int:
        """Number of rows."""

    @property
    def bands(self) -> int:
        """Number of bands."""

    def read(self, columns: slice, rows: slice, factor: int) -> Single:
        """Return pixels (bands, rows, columns), averaged over ``factor`` × ``factor``, NaN without a value."""


@dataclass(frozen=True)
class Frame:
    """A source image and its place."""

    source: Source
    mapping: Mapping

    def ends(self) -> tuple[float, float]:
        """Return its least and greatest chainage, m."""
        chainage, _ = outline(self.mapping, self.source.columns, self.source.rows)
        return float(chainage.min()), float(chainage.max())


def usual_pixel(mapping: Mapping) -> float:
    """Return the side of the pixels of an imported image, m: the next smaller of PIXELS, or the smallest."""
    side = min(pixel_sides(mapping)) * 1.05
    return max((pixel for pixel in PIXELS if pixel <= side), default=PIXELS[0])


def resample(frames: Sequence[Frame], grid: Grid) -> Iterator[tuple[int, Raster]]:
    """Resample images into the blocks of a kilometre; where they overlap, the image whose middle is nearer is used.

    Parameters
    ----------
    frames : sequence of Frame
        Images with the same number of bands.
    grid : Grid
        Pixels of the kilometre, without halo.

    Yields
    ------
    block : int
        Number of a block with values.
    raster : Raster
        Its values; of three bands as colours.
    """
    extents = [frame.ends() for frame in frames]
    for first in range(0, grid.columns, grid.block_columns):
        west = grid.west + first * grid.pixel
        inside = [frame for frame, (low, high) in zip(frames, extents, strict=True) if low < west + BLOCK and high > west]
        if not inside:
            continue
        values = _block(inside, grid, first)
        if np.isfinite(values).any():
            pixels = values[0] if len(values) == 1 else np.moveaxis(values, 0, 2)
            yield grid.first_block + first // grid.block_columns, Raster(pixels, grid.transform(first))


def _block(frames: Sequence[Frame], grid: Grid, first: int) -> Single:
    """Return the values (bands, rows, columns) of a block that begins with a column."""
    out = np.full((frames[0].source.bands, grid.rows, grid.block_columns), np.nan, np.float32)
    width = max(1, PART // grid.rows)
    arcs = grid.arcs()[:, None]
    for start in range(0, grid.block_columns, width):
        part = slice(start, min(start + width, grid.block_columns))
        chainages = grid.chainages(slice(first + part.start, first + part.stop))[None, :]
        nearest = np.full((grid.rows, part.stop - part.start), np.inf, np.float32)
        for frame in frames:
            _add(out[:, :, part], nearest, frame, chainages, arcs, grid.pixel)
    return out


def _add(out: Single, nearest: Single, frame: Frame, chainages: Float, arcs: Float, pixel: float) -> None:
    """Add an image to values (bands, rows, columns), where its middle is nearer than that of images before."""
    source = frame.source
    column, row = (np.asarray(v) for v in np.broadcast_arrays(*frame.mapping.inverse(chainages, arcs)))
    inside = (column >= 0) & (column <= source.columns) & (row >= 0) & (row <= source.rows)
    middle = np.maximum(abs(column / source.columns - 0.5), abs(row / source.rows - 0.5)).astype(np.float32)
    inside &= middle < nearest
    if not inside.any():
        return
    factor = max(1, int(pixel / max(pixel_sides(frame.mapping)) + 0.05))
    columns, rows = (_window(v[inside], count, factor) for v, count in ((column, source.columns), (row, source.rows)))
    while (columns.stop - columns.start) * (rows.stop - rows.start) > MAX_SOURCE * factor**2:
        factor *= 2
    values = source.read(columns, rows, factor)
    at = np.stack([(row[inside] - rows.start) / factor - 0.5, (column[inside] - columns.start) / factor - 0.5])
    found = np.stack([_interpolate(band, at) for band in values])
    there = np.isfinite(found).all(axis=0)
    place = np.flatnonzero(inside)[there]
    at_row, at_column = np.unravel_index(place, inside.shape)
    out[:, at_row, at_column] = found[:, there]
    nearest[at_row, at_column] = middle[at_row, at_column]


def _window(at: Float, count: int, factor: int) -> slice:
    """Return the pixels of a source image that are needed for coordinates, whole multiples of a factor if possible."""
    low = max(0, (int(np.floor(at.min())) - 1) // factor - 1) * factor
    high = min(count, (int(np.ceil(at.max())) // factor + 2) * factor)
    return slice(low, max(high, low + 1))


def _interpolate(values: Single, at: Float) -> Single:
    """Interpolate values (rows, columns) linearly at coordinates (2, n), passing over NaNs."""
    valid = np.isfinite(values)
    if valid.all():
        return np.asarray(ndimage.map_coordinates(values, at, np.float32, order=1, mode="nearest"))
    weight = ndimage.map_coordinates(valid.astype(np.float32), at, np.float32, order=1, mode="nearest")
    total = ndimage.map_coordinates(np.where(valid, values, np.float32(0.0)), at, np.float32, order=1, mode="nearest")
    enough = weight >= MIN_WEIGHT
    return np.where(enough, total / np.where(enough, weight, np.float32(1.0)), np.float32(np.nan)).astype(np.float32)
