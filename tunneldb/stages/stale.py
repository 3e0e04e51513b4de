"""State of the results of a measure: which are out of date, and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import psycopg

from tunneldb.errors import NotReadyError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Result:
    """Result that a measure makes of each kilometre of a survey.

    Attributes
    ----------
    survey : Survey
        The survey; of a pair the newer one.
    stage : str
        Name of the measure.
    subject : mapping
        Values of the parameters that distinguish it from other results of the measure, in the order of the registry.
    """

    survey: Survey
    stage: str
    subject: Mapping[str, str | int] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The subject as the ledger has it."""
        return " ".join(map(str, self.subject.values()))


@dataclass(frozen=True)
class ResultState:
    """State of a result in a kilometre.

    Attributes
    ----------
    reason : str or None
        Why it is out of date; None if it is not.
    blocked_by : str or None
        Stage that is itself out of date and must run first.
    parameters : mapping
        Parameters of the last run that succeeded; empty without one.
    """

    reason: str | None
    blocked_by: str | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)


def result_states(
    conn: psycopg.Connection[Any], result: Result, low: float = -math.inf, high: float = math.inf
) -> dict[int, ResultState]:
    """Return the state of a result in each kilometre of a stretch in which there can be one; chainages in m."""
    rows = conn.execute(
        "SELECT km, reason, blocked_by, coalesce(parameters, '{}') FROM tunnel_internal.result_state(%s, %s, %s)"
        " WHERE (km + 1) * %s::float8 > %s AND km * %s::float8 < %s ORDER BY km",
        [result.survey.id, result.stage, result.key, KILOMETRE, low, KILOMETRE, high],
    ).fetchall()
    return {km: ResultState(*state) for km, *state in rows}


def result_inputs(conn: psycopg.Connection[Any], result: Result, km: int) -> dict[str, Any]:
    """Return the runs and checksums that a result would be made from now."""
    row = conn.execute(
        "SELECT tunnel_internal.result_inputs(%s, %s, %s, %s)", [result.survey.id, result.stage, km, result.key]
    ).fetchone()
    assert row is not None
    return dict(row[0])


def refuse_blocked(states: Mapping[int, ResultState], survey: str, command: str) -> None:
    """Refuse to measure with the results of a stage that is out of date.

    Raises
    ------
    NotReadyError
        If a kilometre is blocked by another stage.
    """
    for km, state in states.items():
        if state.blocked_by is not None:
            raise NotReadyError(f"kilometre {km}: {state.reason}; tunneldb run {survey} --stale, then {command}")
