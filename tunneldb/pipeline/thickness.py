"""Thickness between the linings of two surveys of a tunnel, kilometre by kilometre."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.pipeline.deviation import measure_deviation
from tunneldb.shape.profile import Stretch
from tunneldb.shape.thickness import section_thickness
from tunneldb.store.design import load_design
from tunneldb.store.ledger import stage_run
from tunneldb.store.survey import Survey
from tunneldb.store.thickness import Pair, Step, load_pairs, save_thickness, stale_kilometres, thickness_inputs

Begin = Callable[[str, float], Callable[[float], None]]


def measure_thickness(
    conn: psycopg.Connection[Any], before: Survey, after: Survey, layer: str, low: float, high: float, begin: Begin
) -> list[int]:
    """Bring what lies between two surveys up to date, each kilometre in a transaction of its own; return which were.

    Parameters
    ----------
    conn : Connection
        Idle.
    before, after : Survey
        The earlier and the later one, of one tunnel.
    layer : str
        Layer whose profiles both are held against: which one says only along which normals is measured.
    low, high : float
        Chainage, m.
    begin : callable
        Called with a text and the number of kilometres; returns what takes those that are done.

    Raises
    ------
    UserError
        If they are of two tunnels or one survey, cannot be held against the layer, or have no kilometre in common.
    """
    if before.id == after.id:
        raise UserError(f"survey {before.name} is both: thickness is between an earlier and a later survey")
    if before.tunnel_id != after.tunnel_id:
        raise UserError(f"{before.name} is of tunnel {before.tunnel}, {after.name} of {after.tunnel}: one tunnel is needed")
    for survey in (before, after):
        measure_deviation(conn, survey, layer, low, high, begin)
    there = stale_kilometres(conn, before, after, layer, low, high)
    stretches = load_design(conn, after.tunnel_id, after.tunnel, layer)
    conn.rollback()
    if not there:
        raise UserError(f"{before.name} and {after.name} have no kilometre in common where layer {layer} has a profile")
    wanted = [km for km, why in there.items() if why is not None]
    advance = begin(f"thickness from {before.name} to {after.name}", len(wanted))
    for km in wanted:
        inputs = thickness_inputs(conn, before, after, km, layer)
        conn.rollback()
        with stage_run(conn, after.id, km, "thickness", inputs) as run:
            steps = [step for pair in load_pairs(conn, before, after, km, layer) for step in pair_step(pair, stretches)]
            save_thickness(conn, before, after, km, layer, steps)
            run.counts.update(steps=len(steps), volume=sum(step.figures.area * (step.high - step.low) for step in steps))
        advance(1)
    return wanted


def pair_step(pair: Pair, stretches: Sequence[Stretch]) -> list[Step]:
    """What lies between the sections of a pair; nothing where no profile holds in its middle."""
    middle = (pair.low + pair.high) / 2.0
    return [
        Step(pair.low, pair.high, pair.noise_area, section_thickness(pair.before, pair.after, stretch.at(middle)))
        for stretch in stretches
        if stretch.low <= middle < stretch.high
    ]
