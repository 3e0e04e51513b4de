"""Thickness between the linings of two surveys, by kilometre, from their deviation from one layer's profiles."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.measures.deviation.measure import measurable_kilometres, measure_deviation
from tunneldb.measures.thickness.compute import compared_steps
from tunneldb.measures.thickness.rows import (
    load_cells,
    save_thickness,
)
from tunneldb.progress import StartProgress
from tunneldb.stages.on_demand import measure_kilometres, refuse_beyond, refuse_wrong_pair
from tunneldb.stages.stale import Result, result_states
from tunneldb.store.design import load_design
from tunneldb.store.survey import Survey


def measure_thickness(
    conn: psycopg.Connection[Any],
    before: Survey,
    after: Survey,
    layer: str,
    low: float,
    high: float,
    begin: StartProgress,
) -> list[int]:
    """Bring the thickness between two surveys up to date, each kilometre in one transaction; return those that were made.

    Parameters
    ----------
    conn : Connection
        Idle.
    before, after : Survey
        Surveys of one tunnel. Both are first compared with the layer's profiles, if that is missing or out of date.
    layer : str
        Layer of the profiles along whose normals thickness is measured.
    low, high : float
        Chainage, m.
    begin : callable
        See `tunneldb.progress.StartProgress`.

    Raises
    ------
    UserError
        If they are of two tunnels, or one, or the older one comes last, or have no kilometre in common there.
    """
    refuse_wrong_pair(conn, before, after, "thickness")
    for survey in (before, after):  # both, before anything is measured
        refuse_beyond(conn, survey, low, high)
        measurable_kilometres(conn, survey, layer, low, high)
    for survey in (before, after):
        measure_deviation(conn, survey, layer, low, high, begin)
    stretches = load_design(conn, after.tunnel_id, after.tunnel, layer)
    result = Result(after, "thickness", {"before": before.id, "layer": layer})
    states = result_states(conn, result, low, high)
    conn.rollback()
    if not states:
        raise UserError(f"surveys {before.name} and {after.name} have no common kilometre there")

    def measure(km: int) -> dict[str, Any]:
        old, new = load_cells(conn, before, km, layer), load_cells(conn, after, km, layer)
        steps = list(compared_steps(stretches, old, new))
        save_thickness(conn, before, after, km, layer, steps)
        return {"steps": len(steps), "volume": sum(step.figures.area * (step.high - step.low) for step in steps)}

    return measure_kilometres(
        conn, result, states, lambda km: {}, measure, f"thickness from {before.name} to {after.name}", begin
    )
