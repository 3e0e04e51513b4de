"""Images in pixels of their own, resampled into blocks of the unrolled plane; of each block only the pixels needed are read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from tunneldb.arrays import Float, Int64, Single
from tunneldb.compiled import kernel
from tunneldb.raster.geotiff import Raster
from tunneldb.raster.grid import BLOCK, Grid
from tunneldb.raster.placement.mapping import Bounds, Mapping, inverse, pixel_sides
from tunneldb.threads import in_blocks

PIXELS = (0.002, 0.0025, 0.004, 0.005, 0.01, 0.02, 0.025, 0.04, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0)
"""Sides of the pixels of imported images, m: they divide a block of 50 m."""

PART = 1 << 24
"""Number of pixels that are computed at once."""

ROWS = 256
"""Number of rows that a thread computes at once."""

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
    bounds = [frame.mapping.bounds(frame.source.columns, frame.source.rows) for frame in frames]
    for first in range(0, grid.columns, grid.block_columns):
        west = grid.west + first * grid.pixel
        inside = [
            (frame, place)
            for frame, place in zip(frames, bounds, strict=True)
            if place.chainage_from < west + BLOCK and place.chainage_to > west
        ]
        if not inside:
            continue
        values = _block(inside, grid, first)
        if np.isfinite(values).any():
            pixels = values[0] if len(values) == 1 else np.moveaxis(values, 0, 2)
            yield grid.first_block + first // grid.block_columns, Raster(pixels, grid.transform(first))


def _block(frames: Sequence[tuple[Frame, Bounds]], grid: Grid, first: int) -> Single:
    """Return the values (bands, rows, columns) of a block that begins with a column."""
    shape = grid.rows, grid.block_columns
    out = np.full((frames[0][0].source.bands, *shape), np.nan, np.float32)
    nearest = np.full(shape, np.inf, np.float32)
    chainages, arcs = grid.chainages(slice(first, first + grid.block_columns)), grid.arcs()
    width = max(1, PART // grid.rows)
    for frame, place in frames:
        rows = slice(*np.searchsorted(-arcs, (-place.arc_to, -place.arc_from)).tolist())
        west, east = np.searchsorted(chainages, (place.chainage_from, place.chainage_to)).tolist()
        for start in range(west, east, width):
            _add(out, nearest, frame, _Part(slice(start, min(start + width, east)), rows, chainages, arcs, grid.pixel))
    return out


@dataclass(frozen=True)
class _Part:
    """Part of a block.

    Attributes
    ----------
    columns, rows : slice
    chainages, arcs : (n,) array
        Of the columns and rows of the whole block, m.
    pixel : float
        Side of a pixel, m.
    """

    columns: slice
    rows: slice
    chainages: Float
    arcs: Float
    pixel: float

    def halves(self) -> list[_Part]:
        """Return its left and its right half."""
        middle = (self.columns.start + self.columns.stop) // 2
        return [
            replace(self, columns=columns) for columns in (slice(self.columns.start, middle), slice(middle, self.columns.stop))
        ]


def _add(out: Single, nearest: Single, frame: Frame, part: _Part) -> None:
    """Add an image to a part of a block (bands, rows, columns), where its middle is nearer than that of images before."""
    chainages, arcs = part.chainages[part.columns], part.arcs[part.rows]
    if not (len(chainages) and len(arcs)):
        return
    source, mapping = frame.source, frame.mapping
    at = inverse(mapping, chainages, arcs[[0, -1], None])
    factor = max(1, int(part.pixel / max(pixel_sides(mapping)) + 0.05))
    columns, rows = (_window(v, count, factor) for v, count in zip(at, (source.columns, source.rows), strict=True))
    while (columns.stop - columns.start) * (rows.stop - rows.start) > MAX_SOURCE * factor**2:
        if len(chainages) > 1:
            for half in part.halves():
                _add(out, nearest, frame, half)
            return
        factor *= 2
    if columns.stop > columns.start and rows.stop > rows.start:
        values = np.ascontiguousarray(source.read(columns, rows, factor))
        places = *mapping.uncorrected(chainages), arcs, np.array([*~mapping.linear][:6])
        corner = np.array([part.rows.start, part.columns.start])
        size, origin = np.array([source.columns, source.rows]), np.array([columns.start, rows.start, factor])

        def draw(begin: int, end: int) -> None:
            _draw(out, nearest, values, *places, corner, size, origin, begin, end)

        in_blocks(draw, len(arcs), ROWS)


def _window(at: Float, count: int, factor: int) -> slice:
    """Return the pixels of a source image that are needed for coordinates, whole multiples of a factor if possible."""
    low = max(0, (int(np.floor(at.min())) - 1) // factor - 1) * factor
    high = min(count, (int(np.ceil(at.max())) // factor + 2) * factor)
    return slice(low, high)


@kernel
def _draw(
    out: Single,
    nearest: Single,
    values: Single,
    along: Float,
    shift: Float,
    arcs: Float,
    inverted: Float,
    corner: Int64,
    size: Int64,
    read: Int64,
    begin: int,
    end: int,
) -> None:  # pragma: no cover - compiled
    """Interpolate values (bands, rows, columns) linearly into some rows from a corner on, passing over NaNs."""
    bands, height, width = values.shape
    found = np.empty(bands, np.float32)
    per_column, per_row, per_pixel = 1.0 / size[0], 1.0 / size[1], 1.0 / read[2]
    for i in range(begin, end):
        for j in range(len(along)):
            arc = arcs[i] - shift[j]
            x = inverted[0] * along[j] + inverted[1] * arc + inverted[2]
            y = inverted[3] * along[j] + inverted[4] * arc + inverted[5]
            if not (0.0 <= x <= size[0] and 0.0 <= y <= size[1]):
                continue
            row, column = corner[0] + i, corner[1] + j
            far = np.float32(max(abs(x * per_column - 0.5), abs(y * per_row - 0.5)))
            if not far < nearest[row, column]:
                continue
            x = min(max((x - read[0]) * per_pixel - 0.5, 0.0), width - 1.0)
            y = min(max((y - read[1]) * per_pixel - 0.5, 0.0), height - 1.0)
            left, top = int(x), int(y)
            right, below = min(left + 1, width - 1), min(top + 1, height - 1)
            x, y = x - left, y - top
            valid = True
            for band in range(bands):
                weight, total = 0.0, 0.0
                for r, c, share in (
                    (top, left, (1.0 - y) * (1.0 - x)),
                    (top, right, (1.0 - y) * x),
                    (below, left, y * (1.0 - x)),
                    (below, right, y * x),
                ):
                    value = values[band, r, c]
                    if np.isfinite(value):
                        weight += share
                        total += share * value
                valid = valid and weight >= MIN_WEIGHT
                found[band] = total / max(weight, MIN_WEIGHT)
            if valid:
                nearest[row, column] = far
                for band in range(bands):
                    out[band, row, column] = found[band]
