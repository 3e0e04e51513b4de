"""Polygons of wet regions in the unrolled plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import rasterio.features
import shapely
from shapely.geometry import Polygon

from tunneldb.arrays import Bool
from tunneldb.raster.grid import PixelGrid

SIMPLIFY = 0.75
"""Tolerance of the simplification, pixels: enough to straighten the stairs of an oblique edge."""

MIN_HOLE_AREA = 0.01
"""Minimum area of holes that are kept, m²: noise makes smaller ones in weak leaks."""


def outline(mask: Bool, column: int, row: int, pixel: float) -> Polygon:
    """Outline a connected region, with its holes that are large enough.

    Parameters
    ----------
    mask : (rows, columns) bool array
        Its pixels, the first row at the lowest arc; connected by their sides.
    column, row : int
        Chainage and arc of the mask's lowest corner, pixels.
    pixel : float
        Side of a pixel, m.

    Returns
    -------
    Polygon
        Polygon of (chainage, arc), m; valid, exterior counter-clockwise.
    """
    image = np.ascontiguousarray(mask[::-1], dtype=np.uint8)
    ((shape, _),) = rasterio.features.shapes(image, mask=image.astype(bool), connectivity=4)
    pixels = _straighten(_without_specks(shapely.geometry.shape(shape), MIN_HOLE_AREA / pixel**2))
    # Whole pixels until the end: the outline of a region must not depend on its kilometre.
    corner, down = np.array([column, row + len(mask)]), np.array([1, -1])
    moved = shapely.transform(pixels, lambda at: (corner + np.round(at) * down) * pixel)
    return shapely.geometry.polygon.orient(shapely.normalize(moved))


def _without_specks(stairs: Polygon, least: float) -> Polygon:
    return Polygon(stairs.exterior, [hole for hole in stairs.interiors if Polygon(hole).area >= least])


def _straighten(stairs: Polygon) -> Polygon:
    """Simplify a polygon by less than the tolerance; keep its stairs if it would fall apart."""
    simple = shapely.simplify(stairs, SIMPLIFY, preserve_topology=True)
    return simple if isinstance(simple, Polygon) and not simple.is_empty and simple.is_valid else stairs


def mask_of_polygons(grid: PixelGrid, polygons: Sequence[Polygon]) -> Iterator[tuple[slice, Bool]]:
    """Yield the columns of each block that a polygon reaches, with a mask (rows, columns) of pixels with centres in one."""
    for start in range(0, grid.columns, grid.block_columns):
        columns = slice(start, start + grid.block_columns)
        transform, shape = grid.transform(start), (grid.rows, grid.block_columns)
        west, east = transform.c, transform.c + shape[1] * transform.a
        near = [polygon for polygon in polygons if polygon.bounds[0] < east and polygon.bounds[2] > west]
        if near:
            yield columns, rasterio.features.geometry_mask(near, shape, transform, invert=True)
