"""How even a survey's lining is, kilometre by kilometre, from the image of its deviation from the design."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
import rasterio.features
import shapely
import shapely.geometry
from affine import Affine

from tunneldb.arrays import Single
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.deviation.compute import CELL, MIN_PIXELS
from tunneldb.measures.deviation.measure import measure_deviation
from tunneldb.measures.deviation.rows import STEP
from tunneldb.measures.evenness.compute.evenness import ALONG, AROUND, Evenness, evenness, step_evenness, uneven_areas
from tunneldb.measures.evenness.compute.straightedge import Cells, cell_means
from tunneldb.measures.evenness.rows import (
    EvennessStep,
    UnevenPolygon,
    evenness_inputs,
    evenness_kilometres,
    save_evenness,
)
from tunneldb.raster.geotiff import DEVIATION_KINDS, laid
from tunneldb.raster.grid import BLOCK
from tunneldb.stages.on_demand import Begin, measure_kilometres, refuse_beyond
from tunneldb.store.images import image_blocks, load_block
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey


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


def measure_evenness(
    conn: psycopg.Connection[Any],
    survey: Survey,
    layer: str,
    length: float,
    limit: float,
    low: float,
    high: float,
    begin: Begin,
) -> list[int]:
    """Bring the evenness of a stretch up to date, each kilometre in a transaction of its own; return which were.

    Parameters
    ----------
    conn : Connection
        Idle.
    layer : str
        Layer of the profiles that are the template; the survey is first held against them.
    length, limit : float
        Of the straightedge, and of the gap beneath it, m.
    low, high : float
        Chainage, m.
    begin : callable
        See `tunneldb.stages.on_demand.Begin`.

    Raises
    ------
    UserError
        As :func:`measure_deviation` does, or if the straightedge is too short for the image's pixels.
    """
    refuse_beyond(conn, survey, low, high)
    # The kilometres beside are part of what a straightedge near an end lies on.
    measure_deviation(conn, survey, layer, low - length, high + length, begin)
    there = evenness_kilometres(conn, survey, layer, length, limit, low, high)
    conn.rollback()

    def measure(km: int) -> dict[str, int]:
        grid = load_cells(conn, survey, km, layer)
        steps, areas = [], []
        if grid is not None:
            if length < 4.0 * grid.cell:
                raise UserError(f"--length {length:g} is less than four cells of {grid.cell:g} m, which is what pixels allow")
            found = evenness(grid.cells, length, grid.cell)
            steps = list(steps_of(grid, found, km, limit, survey_ends(conn, survey) or (-np.inf, np.inf)))
            areas = list(polygons_of(grid, found, km, limit))
        save_evenness(conn, survey, km, layer, (length, limit), steps, areas)
        return {"steps": len(steps), "areas": len(areas)}

    return measure_kilometres(
        conn, survey, "evenness", [km for km, why in there.items() if why is not None],
        lambda km: {**evenness_inputs(conn, survey, km, layer), "length": length, "limit": limit},
        measure, f"evenness of {survey.name}", begin,
    )  # fmt: skip


def cells_in(pixel: float) -> int:
    """Pixels to a side of a cell, of CELL or three pixels, that fills blocks and steps of chainage without a rest."""
    factor = max(3, round(CELL / pixel))
    return next((n for n in range(factor, 8 * factor) if _whole(STEP / (n * pixel)) and _whole(BLOCK / (n * pixel))), factor)


def _whole(number: float) -> bool:
    return abs(number - round(number)) < 1e-6


def load_cells(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> CellGrid | None:
    """Cells of a kilometre's image of deviation, with a block of either neighbour; None without an image."""
    kind = DEVIATION_KINDS[layer]
    blocks = [(km, block) for block in image_blocks(conn, survey, km, kind)]
    if not blocks:
        return None
    like = load_block(conn, survey, km, kind, blocks[0][1])
    pixel = like.transform.a
    around = [
        *((km - 1, block) for block in image_blocks(conn, survey, km - 1, kind)[-1:] if block == blocks[0][1] - 1),
        *blocks,
        *((km + 1, block) for block in image_blocks(conn, survey, km + 1, kind)[:1] if block == blocks[-1][1] + 1),
    ]
    factor = cells_in(pixel)
    cell = factor * pixel
    first = around[0][1]
    wide = round(BLOCK / cell)
    rows = -(-like.values.shape[0] // factor)
    shape = (rows, wide * (around[-1][1] - first + 1))
    cells = Cells(np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape, np.int64))
    for other, block in around:
        raster = load_block(conn, survey, other, kind, block)
        if raster.transform.a != pixel:
            continue
        part = cell_means(_padded(laid(raster, like), rows * factor), factor, MIN_PIXELS)
        here = slice(wide * (block - first), wide * (block - first + 1))
        for whole, means in ((cells.mean, part.mean), (cells.sigma, part.sigma), (cells.seen, part.seen)):
            whole[:, here] = means[::-1]
    return CellGrid(cell, first * BLOCK, like.transform.f - rows * cell, cells)


def _padded(values: Single, rows: int) -> Single:
    """The same with so many rows, the last ones empty."""
    return np.pad(values, ((0, rows - len(values)), (0, 0)), constant_values=np.nan)


def steps_of(grid: CellGrid, found: Evenness, km: int, limit: float, ends: tuple[float, float]) -> Iterator[EvennessStep]:
    """Steps of a kilometre in which something was seen, as far as the survey reaches."""
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
    """Where the gap is too large in a kilometre, in the unrolled plane, along the sides of cells."""
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
