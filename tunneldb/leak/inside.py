"""Pixels whose centres lie in polygons of the unrolled plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import rasterio.features
from shapely.geometry import Polygon

from tunneldb.arrays import Bool
from tunneldb.raster.accumulator import Grid


def inside(grid: Grid, polygons: Sequence[Polygon]) -> Iterator[tuple[slice, Bool]]:
    """Columns of each block that a polygon reaches, with a mask (rows, columns) of the pixels whose centres lie in one."""
    for start in range(0, grid.columns, grid.block_columns):
        columns = slice(start, start + grid.block_columns)
        transform, shape = grid.transform(start), (grid.rows, grid.block_columns)
        west, east = transform.c, transform.c + shape[1] * transform.a
        near = [polygon for polygon in polygons if polygon.bounds[0] < east and polygon.bounds[2] > west]
        if near:
            yield columns, rasterio.features.geometry_mask(near, shape, transform, invert=True)
