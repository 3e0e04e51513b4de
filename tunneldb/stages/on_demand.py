"""Measures by kilometre: their runs, and the requests that all of them refuse."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import psycopg

from tunneldb.errors import UserError
from tunneldb.progress import StartProgress
from tunneldb.stages.ledger import stage_run
from tunneldb.stages.stale import Result, ResultState, result_inputs
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey


def measure_kilometres(
    conn: psycopg.Connection[Any],
    result: Result,
    states: Mapping[int, ResultState],
    options: Callable[[int], Mapping[str, Any]],
    measure: Callable[[int], Mapping[str, Any]],
    title: str,
    begin: StartProgress,
) -> list[int]:
    """Make a result where it is out of date or was made with other options, and return in which kilometres.

    Each kilometre is a run of the ledger and a transaction of its own.

    Parameters
    ----------
    conn : Connection
        With nothing written.
    result : Result
    states : mapping
        State of the result by kilometre.
    options : callable
        Takes a kilometre; returns the options to make it with, as the ledger keeps them.
    measure : callable
        Takes a kilometre; replaces what is stored of it and returns counts for the ledger.
    title : str
        Title of the progress bar.
    """
    wanted = [
        km
        for km, state in states.items()
        if state.reason is not None or any(state.parameters.get(name) != value for name, value in options(km).items())
    ]
    advance = begin(title, len(wanted))
    for km in wanted:
        parameters = {**result.subject, **result_inputs(conn, result, km), **options(km)}
        conn.rollback()
        with stage_run(conn, result.survey.id, km, result.stage, parameters) as run:
            run.counts.update(measure(km))
        advance(1)
    return wanted


def refuse_beyond(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> None:
    """Refuse a stretch beyond the ends of a survey, before its kilometres are measured in vain.

    Raises
    ------
    UserError
        If it does.
    """
    ends = survey_ends(conn, survey)
    if ends is not None and (high <= ends[0] or low >= ends[1]):
        raise UserError(f"survey {survey.name} has no data there: it extends from chainage {ends[0]:.3f} to {ends[1]:.3f} m")


def refuse_wrong_pair(conn: psycopg.Connection[Any], one: Survey, other: Survey, command: str) -> None:
    """Refuse a pair that is one survey or a copy of it, surveys of two tunnels, or the older one in place of the newer.

    Surveys of one day may be given in either order.

    Raises
    ------
    UserError
        If they are.
    """
    if one.id == other.id:
        raise UserError(f"survey {one.name} is given twice: {command} needs two surveys of one tunnel")
    if one.date > other.date:
        raise UserError(
            f"survey {one.name} is of {one.date}, {other.name} of {other.date}: the older survey comes first, or all changes"
            f" would have the wrong sign: tunneldb {command} {other.name} {one.name}; if a date is wrong:"
            " tunneldb survey set SURVEY --date YYYY-MM-DD"
        )
    pair = "SELECT FROM tunnel_internal.survey_copy WHERE survey_id = ANY (%(ids)s) AND of_id = ANY (%(ids)s)"
    if conn.execute(pair, {"ids": [one.id, other.id]}).fetchone() is not None:
        raise UserError(
            f"surveys {one.name} and {other.name} are the same scan, one is from an archive of the other:"
            f" {command} needs two scans of one tunnel"
        )
    if one.tunnel_id != other.tunnel_id:
        raise UserError(
            f"survey {one.name} is of tunnel {one.tunnel}, {other.name} of {other.tunnel}: {command} needs two surveys of one"
            " tunnel"
        )
