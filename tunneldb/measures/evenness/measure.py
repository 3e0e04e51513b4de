"""Evenness of a survey's lining, by kilometre, from the image of its deviation from the design."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Single
from tunneldb.errors import UserError
from tunneldb.measures.deviation.compute import MIN_PIXELS
from tunneldb.measures.deviation.measure import measure_deviation
from tunneldb.measures.evenness.compute.evenness import evenness
from tunneldb.measures.evenness.compute.sections import CellGrid, cells_in, polygons_of, steps_of
from tunneldb.measures.evenness.compute.straightedge import Cells, cell_means
from tunneldb.measures.evenness.rows import save_evenness
from tunneldb.progress import StartProgress
from tunneldb.raster.geotiff import DEVIATION_KINDS, laid
from tunneldb.raster.grid import BLOCK
from tunneldb.stages.on_demand import measure_kilometres, refuse_beyond
from tunneldb.stages.stale import Result, result_states
from tunneldb.store.images import image_blocks, load_block
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey


def measure_evenness(
    conn: psycopg.Connection[Any],
    survey: Survey,
    layer: str,
    length: float,
    limit: float,
    low: float,
    high: float,
    begin: StartProgress,
) -> list[int]:
    """Bring the evenness of a stretch up to date, each kilometre in one transaction; return those that were made.

    Parameters
    ----------
    conn : Connection
        Idle.
    layer : str
        Layer of the template profiles; the survey is first compared with them.
    length, limit : float
        Length of the straightedge, and limit of the gap beneath it, m.
    low, high : float
        Chainage, m.
    begin : callable
        See `tunneldb.progress.StartProgress`.

    Raises
    ------
    UserError
        As for :func:`measure_deviation`, or if the straightedge is too short for the image's pixels.
    """
    refuse_beyond(conn, survey, low, high)
    # The kilometres beside are part of what a straightedge near an end lies on.
    measure_deviation(conn, survey, layer, low - length, high + length, begin)
    result = Result(survey, "evenness", {"layer": layer})
    states = result_states(conn, result, low, high)
    conn.rollback()

    def measure(km: int) -> dict[str, int]:
        grid = load_cells(conn, survey, km, layer)
        steps, areas = [], []
        if grid is not None:
            if length < 4.0 * grid.cell:
                raise UserError(
                    f"--length {length:g} is less than four cells of {grid.cell:g} m: give {4.0 * grid.cell:g} or more"
                )
            found = evenness(grid.cells, length, grid.cell)
            steps = list(steps_of(grid, found, km, limit, survey_ends(conn, survey) or (-np.inf, np.inf)))
            areas = list(polygons_of(grid, found, km, limit))
        save_evenness(conn, survey, km, layer, (length, limit), steps, areas)
        return {"steps": len(steps), "areas": len(areas)}

    return measure_kilometres(
        conn, result, states, lambda km: {"length": length, "limit": limit}, measure, f"evenness of {survey.name}", begin
    )


def load_cells(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> CellGrid | None:
    """Load the cells of a kilometre's image of deviation, with a block of each neighbour; None without an image."""
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
    """Return the values with additional empty rows at the end."""
    return np.pad(values, ((0, rows - len(values)), (0, 0)), constant_values=np.nan)
