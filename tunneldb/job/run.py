"""Running the stages of a survey, stage by stage and kilometre by kilometre."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import psycopg

from tunneldb.database.survey import Survey
from tunneldb.errors import UserError
from tunneldb.job.ledger import Run, stage_run
from tunneldb.job.parameters import of_stage
from tunneldb.job.stages import STAGES, Progress, Stage


def parse_km(text: str | None, there: list[int]) -> list[int]:
    """Kilometres of ``text`` (``511`` or ``511-513``) that are there; all of them without a text.

    Raises
    ------
    UserError
        If the text is no range, or no points are loaded in any of its kilometres.
    """
    if text is None:
        return there
    match = re.fullmatch(r"(\d+)(?:-(\d+))?", text.strip())
    if match is None:
        raise UserError(f"--km takes a kilometre or a range of them, 511 or 511-513, not {text!r}")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise UserError(f"--km {text}: the range runs backwards")
    chosen = [km for km in there if first <= km <= last]
    if not chosen:
        loaded = ", ".join(map(str, there)) or "none"
        raise UserError(f"no points are loaded in kilometre {text.strip()}; loaded: {loaded}")
    return chosen


def loaded_kilometres(conn: psycopg.Connection[Any], survey: Survey) -> list[int]:
    """Kilometres of a survey that hold points."""
    rows = conn.execute(
        """
        SELECT substring(c.relname FROM '_km(-?[0-9]+)$')::int AS km
        FROM pg_partition_tree(to_regclass('tunnel.' || 'point_s' || %s)) p JOIN pg_class c ON c.oid = p.relid
        WHERE p.isleaf AND c.relname ~ '_km-?[0-9]+$' ORDER BY 1
        """,
        [survey.id],
    ).fetchall()
    return [row[0] for row in rows]


def choose_stages(first: str | None, last: str | None) -> list[Stage]:
    """Stages from ``first`` to ``last``, both by name and included.

    Raises
    ------
    UserError
        If a name is unknown or the two are in the wrong order.
    """
    names = [stage.name for stage in STAGES]
    for name in (first, last):
        if name is not None and name not in names:
            raise UserError(f"there is no stage {name!r}; the stages are {', '.join(names)}")
    begin = names.index(first) if first else 0
    end = names.index(last) if last else len(names) - 1
    if end < begin:
        raise UserError(f"stage {last} comes before {first}")
    return list(STAGES[begin : end + 1])


def run_stages(
    conn: psycopg.Connection[Any],
    survey: Survey,
    kilometres: list[int],
    stages: list[Stage],
    values: Mapping[str, float],
    begin: Callable[[Stage, int], Progress],
    end: Callable[[Stage, int, Run], None],
) -> None:
    """Run stages over kilometres, each stage of each kilometre in a transaction of its own.

    A stage is done for all kilometres before the next one, for the axis of a kilometre shapes its neighbours' segments.

    Parameters
    ----------
    begin, end : callable
        Called before and after each; ``begin`` returns what takes the progress.
    """
    for stage in stages:
        for km in kilometres:
            progress = begin(stage, km)
            with stage_run(conn, survey.id, km, stage.name, of_stage(values, stage.parameters)) as run:
                run.counts.update(stage.work(conn, survey, km, values, progress))
            end(stage, km, run)
