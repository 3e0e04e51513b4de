"""What lies between the linings of two surveys, kilometre by kilometre, from their deviation from one layer's profiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import psycopg

from tunneldb.errors import UserError
from tunneldb.measures.deviation.measure import measurable_kilometres, measure_deviation
from tunneldb.measures.deviation.rows import STEP
from tunneldb.measures.thickness.compute import section_thickness
from tunneldb.measures.thickness.rows import (
    DeviationCells,
    ThicknessStep,
    load_cells,
    save_thickness,
    stale_thickness,
    thickness_inputs,
)
from tunneldb.shape.profile import Stretch
from tunneldb.stages.on_demand import Begin, measure_kilometres, refuse_beyond, refuse_different_tunnels
from tunneldb.store.design import load_design
from tunneldb.store.survey import Survey


def measure_thickness(
    conn: psycopg.Connection[Any],
    before: Survey,
    after: Survey,
    layer: str,
    low: float,
    high: float,
    begin: Begin,
) -> list[int]:
    """Bring what lies between two surveys up to date, each kilometre in a transaction of its own; return which were.

    Parameters
    ----------
    conn : Connection
        Idle.
    before, after : Survey
        Of one tunnel. Both are first held against the layer's profiles, where that is missing or out of date.
    layer : str
        Layer of the profiles along whose normals thickness is measured.
    low, high : float
        Chainage, m.
    begin : callable
        See `tunneldb.stages.on_demand.Begin`.

    Raises
    ------
    UserError
        If they are of two tunnels, or one, or have no kilometre in common there.
    """
    refuse_different_tunnels(before, after, "thickness")
    for survey in (before, after):  # both, before anything is measured
        refuse_beyond(conn, survey, low, high)
        measurable_kilometres(conn, survey, layer, low, high)
    for survey in (before, after):
        measure_deviation(conn, survey, layer, low, high, begin)
    stretches = load_design(conn, after.tunnel_id, after.tunnel, layer)
    there = stale_thickness(conn, before, after, layer, low, high)
    conn.rollback()
    if not there:
        raise UserError(f"surveys {before.name} and {after.name} have no kilometre in common there")

    def measure(km: int) -> dict[str, Any]:
        old, new = load_cells(conn, before, km, layer), load_cells(conn, after, km, layer)
        steps = list(compared_steps(stretches, old, new))
        save_thickness(conn, before, after, km, layer, steps)
        return {"steps": len(steps), "volume": sum(step.figures.area * (step.high - step.low) for step in steps)}

    return measure_kilometres(
        conn, after, "thickness", [km for km, why in there.items() if why is not None],
        lambda km: thickness_inputs(conn, before, after, km, layer),
        measure, f"thickness from {before.name} to {after.name}", begin,
    )  # fmt: skip


def compared_steps(
    stretches: Sequence[Stretch], before: Sequence[DeviationCells], after: Sequence[DeviationCells]
) -> Iterator[ThicknessStep]:
    """What lies between two surveys, of the steps that both have, as far as both reach."""
    by_place = {(np.floor(old.low / STEP), old.profile): old for old in before}
    by_name = {stretch.name: stretch for stretch in stretches}
    for new in after:
        old = by_place.get((np.floor(new.low / STEP), new.profile))
        if old is None:
            continue
        low, high = max(old.low, new.low), min(old.high, new.high)
        if low < high:
            outline = by_name[new.profile].at((low + high) / 2.0)
            noise = float(np.hypot(old.noise_area, new.noise_area))
            yield ThicknessStep(low, high, noise, section_thickness(old.cells, new.cells, outline))
