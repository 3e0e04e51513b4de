"""Steps of chainage and areas of a kilometre, from the evenness of its cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import rasterio.features
import shapely
import shapely.geometry
from affine import Affine
from shapely.geometry import Polygon

from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.deviation.compute import CELL, STEP
from tunneldb.measures.evenness.compute.evenness import ALONG, AROUND, Evenness, StepEvenness, step_evenness, uneven_areas
from tunneldb.measures.evenness.compute.straightedge import Cells
from tunneldb.raster.grid import BLOCK


@dataclass(frozen=True)
class EvennessStep:
    """Step of chainage, with rows of cells from an arc, m, upwards."""

    low: float
    high: float
    arc_from: float
    cell: float
    figures: StepEvenness


@dataclass(frozen=True)
class UnevenPolygon:
    """Area with too large gaps, in the unrolled plane, with its area, m², greatest gap, m, and straightedge direction."""

    outline: Polygon
    area: float
    gap: float
    direction: str


@dataclass(frozen=True)
class CellGrid:
    """Cells of a stretch of an image.

    Attributes
    ----------
    cell : float
        Side of a cell, m.
    west, south : float
        Least chainage and arc, m.
    cells : Cells
        Rows from the lowest arc up.
    """

    cell: float
    west: float
    south: float
    cells: Cells


def cells_in(pixel: float) -> int:
    """Return the pixels along a side of a cell of CELL or three pixels that divides blocks and steps of chainage."""
    factor = max(3, round(CELL / pixel))
    return next((n for n in range(factor, 8 * factor) if _whole(STEP / (n * pixel)) and _whole(BLOCK / (n * pixel))), factor)


def _whole(number: float) -> bool:
    return abs(number - round(number)) < 1e-6


def steps_of(grid: CellGrid, found: Evenness, km: int, limit: float, ends: tuple[float, float]) -> Iterator[EvennessStep]:
    """Yield the steps of a kilometre with seen cells, within the ends of the survey."""
    columns = max(round(STEP / grid.cell), 1)
    for first in range(0, found.cells.mean.shape[1], columns):
        low = round(grid.west + first * grid.cell, 6)
        high = round(low + columns * grid.cell, 6)
        if np.floor((low + high) / 2.0 / KILOMETRE) != km or high <= ends[0] or low >= ends[1]:
            continue
        figures = step_evenness(found, slice(first, first + columns), limit)
        if figures.seen:
            yield EvennessStep(max(low, ends[0]), min(high, ends[1]), grid.south, grid.cell, figures)


def polygons_of(grid: CellGrid, found: Evenness, km: int, limit: float) -> Iterator[UnevenPolygon]:
    """Yield the areas of a kilometre with too large a gap, in the unrolled plane, along the sides of cells."""
    first = max(round((km * KILOMETRE - grid.west) / grid.cell), 0)
    last = min(round(((km + 1) * KILOMETRE - grid.west) / grid.cell), found.cells.mean.shape[1])
    areas = uneven_areas(found, slice(first, last), limit)
    place = Affine(grid.cell, 0.0, round(grid.west + first * grid.cell, 6), 0.0, grid.cell, grid.south)
    for shape, number in rasterio.features.shapes(areas.label, areas.label > 0, connectivity=4, transform=place):
        k = int(number) - 1
        yield UnevenPolygon(
            shapely.geometry.polygon.orient(shapely.geometry.shape(shape)),
            float(areas.cells[k] * grid.cell**2),
            float(areas.gap[k]),
            ALONG if areas.along[k] else AROUND,
        )
