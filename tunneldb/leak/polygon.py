"""Polygons of wet pixels in the unrolled plane."""

from __future__ import annotations

import numpy as np
import rasterio.features
import shapely
from affine import Affine
from numpy.typing import NDArray
from shapely.geometry import Polygon

SIMPLIFY = 0.75
"""Tolerance of the simplification, pixels: enough to straighten the stairs of a slanting edge."""


def polygons(mask: NDArray[np.bool_] | NDArray[np.uint8], transform: Affine, min_area: float) -> list[Polygon]:
    """Outline the connected regions of a mask, with their holes.

    Parameters
    ----------
    mask : (rows, columns) bool array
        Wet pixels. Those that share a side belong together.
    transform : Affine
        From pixels (column, row) to (chainage, arc), m.
    min_area : float
        Smaller regions are left out, m².

    Returns
    -------
    list of Polygon
        Valid, exterior counter-clockwise, ordered by where they begin along the tunnel.
    """
    columns = np.flatnonzero(mask.any(axis=0))
    if len(columns) == 0:
        return []
    pixel, first = abs(transform.a), int(columns[0])
    image = np.ascontiguousarray(mask[:, first : columns[-1] + 1], dtype=np.uint8)
    transform = transform @ Affine.translation(first, 0)
    found = []
    for shape, _ in rasterio.features.shapes(image, mask=image.astype(bool), connectivity=4, transform=transform):
        outline = shapely.geometry.shape(shape)
        if outline.area >= min_area:
            found.append(_straighten(outline, SIMPLIFY * pixel))
    found.sort(key=lambda polygon: polygon.bounds)
    return found


def _straighten(outline: Polygon, tolerance: float) -> Polygon:
    """Simplify a polygon by less than the tolerance; one that would fall apart keeps its stairs."""
    simple = shapely.simplify(outline, tolerance, preserve_topology=True)
    if not isinstance(simple, Polygon) or simple.is_empty or not simple.is_valid:
        simple = outline
    return shapely.geometry.polygon.orient(simple)
