"""Stages that are run on demand by a verb of their own: what they share is how kilometres follow each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import psycopg

from tunneldb.errors import NotReadyError, UserError
from tunneldb.stages.ledger import stage_run
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey

Begin = Callable[[str, float], Callable[[float], None]]
"""Called with a text and the number of kilometres; returns what takes those that are done."""


def measure_kilometres(
    conn: psycopg.Connection[Any],
    survey: Survey,
    stage: str,
    kilometres: Iterable[int],
    inputs: Callable[[int], dict[str, Any]],
    measure: Callable[[int], Mapping[str, Any]],
    title: str,
    begin: Begin,
) -> list[int]:
    """Run a stage over kilometres, each in a transaction of its own that the ledger knows; return which.

    Parameters
    ----------
    conn : Connection
        With nothing written.
    survey : Survey
        Whose ledger it is.
    kilometres : iterable of int
        Those that are missing or out of date.
    inputs : callable
        Of a kilometre: what it rests on, by which it is known to be out of date later.
    measure : callable
        Of a kilometre: replace what is stored of it; counts for the ledger.
    title : str
        What the progress is called.
    """
    wanted = list(kilometres)
    advance = begin(title, len(wanted))
    for km in wanted:
        rests_on = inputs(km)
        conn.rollback()
        with stage_run(conn, survey.id, km, stage, rests_on) as run:
            run.counts.update(measure(km))
        advance(1)
    return wanted


def refuse_stale(reasons: Mapping[int, str | None], survey: str, verb: str) -> None:
    """Refuse to measure what rests on a stage that is itself out of date.

    Raises
    ------
    UserError
        If a kilometre's reason is that another stage is stale.
    """
    for km, why in reasons.items():
        if why is not None and " is stale" in why:
            raise NotReadyError(f"kilometre {km}: {why}; tunneldb run {survey} --stale, then {verb}")


def refuse_beyond(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> None:
    """Refuse a stretch that lies beyond the ends of a survey, before its kilometres are measured for nothing.

    Raises
    ------
    UserError
        If it does.
    """
    ends = survey_ends(conn, survey)
    if ends is not None and (high <= ends[0] or low >= ends[1]):
        raise UserError(f"survey {survey.name} has nothing there: it reaches from chainage {ends[0]:.3f} to {ends[1]:.3f} m")


def refuse_different_tunnels(one: Survey, other: Survey, verb: str) -> None:
    """Refuse a pair that is one survey, or surveys of two tunnels.

    Raises
    ------
    UserError
        If they are.
    """
    if one.id == other.id:
        raise UserError(f"survey {one.name} is given twice: {verb} takes two surveys of one tunnel")
    if one.tunnel_id != other.tunnel_id:
        raise UserError(
            f"survey {one.name} is of tunnel {one.tunnel}, {other.name} of {other.tunnel}: {verb} takes two surveys of one"
            " tunnel"
        )
