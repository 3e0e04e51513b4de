"""Deviation of a survey's lining from its design profiles, kilometre by kilometre."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Bool, Float
from tunneldb.classification.classes import PointClass
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.measures.deviation.compute import STATIONS, Design, Step, block_steps
from tunneldb.measures.deviation.rows import load_offsets, replace_image, save_steps
from tunneldb.progress import StartProgress
from tunneldb.raster.geotiff import Raster
from tunneldb.shape.profile import Deviation
from tunneldb.stages.on_demand import measure_kilometres, refuse_beyond
from tunneldb.stages.run import nothing_yet
from tunneldb.stages.stale import Result, ResultState, refuse_blocked, result_states
from tunneldb.store.design import load_design
from tunneldb.store.scene import load_scene
from tunneldb.store.surface import load_alignment, load_surface, survey_ends
from tunneldb.store.survey import Survey


def measure_deviation(
    conn: psycopg.Connection[Any],
    survey: Survey,
    layer: str,
    low: float,
    high: float,
    begin: StartProgress,
) -> list[int]:
    """Bring the deviation of a stretch up to date, each kilometre in one transaction; return those that were made.

    Parameters
    ----------
    conn : Connection
        Idle.
    layer : str
        Layer of the profiles.
    low, high : float
        Chainage, m.
    begin : callable
        See `tunneldb.progress.StartProgress`.

    Raises
    ------
    UserError
        If the layer has no profile, or the survey no offset image where it has one.
    """
    refuse_beyond(conn, survey, low, high)
    states = measurable_kilometres(conn, survey, layer, low, high)

    def measure(km: int) -> dict[str, Any]:
        steps, note = _kilometre(conn, survey, km, layer)
        save_steps(conn, survey, km, layer, steps)
        sums = {
            "steps": len(steps),
            "overbreak": sum(step.figures.overbreak * (step.high - step.low) for step in steps),
            "underbreak": sum(step.figures.underbreak * (step.high - step.low) for step in steps),
        }
        return {**sums, "note": note} if note else sums

    return measure_kilometres(
        conn, deviation_from(survey, layer), states, lambda km: {}, measure, f"deviation of {survey.name}", begin
    )


def deviation_from(survey: Survey, layer: str) -> Result:
    """Return the result of this measure that is of a layer."""
    return Result(survey, "deviation", {"layer": layer})


def measurable_kilometres(
    conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float
) -> dict[int, ResultState]:
    """Return the state of the deviation from a layer in each kilometre of a stretch that can be compared with it.

    Raises
    ------
    UserError
        As for `measure_deviation`.
    """
    load_design(conn, survey.tunnel_id, survey.tunnel, layer)
    states = result_states(conn, deviation_from(survey, layer), low, high)
    conn.rollback()
    if not states:
        raise nothing_yet(conn, survey, f"has no offset image where layer {layer} has a profile")
    refuse_blocked(states, survey.name, "deviation")
    return states


def load_design_of(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> Design:
    """Load the design of a kilometre."""
    return Design(
        load_surface(conn, survey, km * KILOMETRE, (km + 1) * KILOMETRE),
        load_alignment(conn, survey, STATIONS),
        load_design(conn, survey.tunnel_id, survey.tunnel, layer),
    )


def deviation_blocks(
    conn: psycopg.Connection[Any], survey: Survey, km: int, design: Design
) -> Iterator[tuple[Raster, Float, Deviation]]:
    """Yield the blocks of a kilometre: offset image, chainage of its columns along the given axis, deviation of its pixels."""
    classes: Callable[[Raster], Bool] | None = None
    for offset, lining in load_offsets(conn, survey, km):
        if lining is None:
            classes = classes or lining_by_class(conn, survey, km, design.surface)
            lining = classes(offset)
        yield offset, *design.deviation(offset, lining)


def _kilometre(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> tuple[list[Step], str | None]:
    design = load_design_of(conn, survey, km, layer)
    ends = survey_ends(conn, survey) or (-np.inf, np.inf)
    steps: list[Step] = []

    def images() -> Iterator[Raster]:
        for offset, along, found in deviation_blocks(conn, survey, km, design):
            steps.extend(block_steps(design.stretches, offset, along, found, ends))
            yield Raster(np.ascontiguousarray(found.distance.T, np.float32), offset.transform)

    replace_image(conn, survey, km, layer, images())
    states = conn.execute(
        "SELECT EXISTS (SELECT FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind = 'state')", [survey.id, km]
    ).fetchone()
    assert states is not None
    note = None if states[0] else "no intensity: lining is taken from the classes of stage ground, which include thin cables"
    return steps, note


def lining_by_class(conn: psycopg.Connection[Any], survey: Survey, km: int, surface: Surface) -> Callable[[Raster], Bool]:
    """Return a function that finds lining in an offset image from the classes of stage ``ground``, without stored states."""
    scene = load_scene(conn, survey, km, km)

    def lining(offset: Raster) -> Bool:
        chainage, arc = offset.places()
        row, column = np.nonzero(np.isfinite(offset.values))
        points = surface.to_space(chainage[column], arc[row], offset.values[row, column].astype(np.float64))
        valid = np.isfinite(points[:, 0])
        shown = np.zeros(offset.values.shape, np.bool_)
        shown[row[valid], column[valid]] = scene.classes(points[valid]) == PointClass.LINING
        return shown

    return lining
