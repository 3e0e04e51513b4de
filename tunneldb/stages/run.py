"""Runs of the stages of a survey, by stage and kilometre."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import psycopg

from tunneldb.errors import NotReadyError, UserError
from tunneldb.stages.ledger import Run, stage_run
from tunneldb.stages.parameters import check_together, of_stage, settings
from tunneldb.stages.registry import STAGES
from tunneldb.stages.stage import Progress, Stage
from tunneldb.store.survey import Survey


def km_range(text: str) -> range:
    """Return the kilometres of ``511`` or ``511-513``; before chainage zero they are negative, ``-2`` or ``-2--1``.

    Raises
    ------
    UserError
        If the text is no range.
    """
    match = re.fullmatch(r"(-?[0-9]+)(?:-(-?[0-9]+))?", text.strip())
    if match is None:
        raise UserError(f"--km needs a kilometre or a range, 511 or 511-513, not {text!r}")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise UserError(f"--km {text}: the range runs backwards")
    return range(first, last + 1)


def parse_km(text: str | None, there: list[int]) -> list[int]:
    """Return the existing kilometres of ``text`` (``511`` or ``511-513``); all of them without a text.

    Raises
    ------
    UserError
        If the text is no range, or no points are loaded in any of its kilometres.
    """
    if text is None:
        return there
    wanted = km_range(text)
    chosen = [km for km in there if km in wanted]
    if not chosen:
        loaded = f"loaded: {', '.join(map(str, there))}" if there else "no kilometre is: tunneldb load SURVEY FILE..."
        raise UserError(f"no points are loaded in kilometre {text.strip()}; {loaded}")
    return chosen


def loaded_kilometres(conn: psycopg.Connection[Any], survey: Survey) -> list[int]:
    """Return the kilometres of a survey that hold points."""
    rows = conn.execute(
        """
        SELECT substring(c.relname FROM '_km(-?[0-9]+)$')::int AS km
        FROM pg_partition_tree(to_regclass('tunnel.' || 'point_s' || %s)) p JOIN pg_class c ON c.oid = p.relid
        WHERE p.isleaf AND c.relname ~ '_km-?[0-9]+$' ORDER BY 1
        """,
        [survey.id],
    ).fetchall()
    return [row[0] for row in rows]


def nothing_yet(conn: psycopg.Connection[Any], survey: Survey, lack: str) -> NotReadyError:
    """Return the error for missing results of a survey's stages, with the command to type: load or run."""
    run = f"tunneldb run {survey.name}"
    if not loaded_kilometres(conn, survey):
        run = f"it holds no points: tunneldb load {survey.name} FILE..., then {run}"
    return NotReadyError(f"survey {survey.name} {lack} yet: {run}")


def choose_stages(first: str | None, last: str | None) -> list[Stage]:
    """Return the stages from ``first`` to ``last``, both by name and included.

    Raises
    ------
    UserError
        If a name is unknown or the two are in the wrong order.
    """
    there = [stage for stage in STAGES if stage.function]
    names = [stage.name for stage in there]
    for name in (first, last):
        if name is not None and name not in names:
            raise UserError(f"unknown stage {name!r}; the stages are {', '.join(names)}")
    begin = names.index(first) if first else 0
    end = names.index(last) if last else len(names) - 1
    if end < begin:
        raise UserError(f"stage {last} comes before {first}")
    return there[begin : end + 1]


class Task(NamedTuple):
    """Stage of a kilometre to run, with the values of all parameters."""

    stage: Stage
    km: int
    values: Mapping[str, float]


def stage_tasks(kilometres: Iterable[int], stages: Iterable[Stage], values: Mapping[str, float]) -> list[Task]:
    """Return stages of kilometres: each for all kilometres before the next, since an axis shapes neighbouring segments."""
    return [Task(stage, km, values) for stage in stages for km in kilometres]


def stale_tasks(
    conn: psycopg.Connection[Any],
    survey: Survey,
    kilometres: Iterable[int],
    stages: Iterable[Stage],
    assignments: Sequence[str] = (),
) -> list[Task]:
    """Return the stale stages of a survey in the order in which they must run, from ``tunnel_api.stage_status``.

    Parameters
    ----------
    conn : psycopg.Connection
        Left in the transaction that this reads in.
    survey : Survey
        The survey.
    kilometres, stages
        What to look among.
    assignments : sequence of str
        Parameters set as ``name=value``; others keep the values of the last run that was successful, there and then.

    Raises
    ------
    UserError
        If a kilometre awaits points that were read since it was loaded, or what is set does not go with what is kept.
    """
    chosen, by_name = set(kilometres), {stage.name: stage for stage in stages}
    given = {assignment.partition("=")[0] for assignment in assignments}
    values = settings(assignments)
    tasks = []
    rows = conn.execute(
        "SELECT km, stage, reason, done_parameters FROM tunnel_internal.stage_state(%s)"
        " WHERE reason IS NOT NULL ORDER BY step, km",
        [survey.id],
    )
    for km, name, reason, former in rows:
        if km not in chosen:
            continue
        if name == "load":
            raise UserError(f"kilometre {km} must be loaded first, because of {reason}: tunneldb batch {survey.name}")
        if name in by_name:
            kept = {key: value for key, value in (former or {}).items() if key in values and key not in given}
            together = {**values, **kept}
            try:
                check_together(together)
            except UserError as error:
                raise UserError(f"stage {name} of kilometre {km}, with its earlier parameters: {error}") from None
            tasks.append(Task(by_name[name], km, together))
    return tasks


def run_tasks(
    conn: psycopg.Connection[Any],
    survey: Survey,
    tasks: Iterable[Task],
    begin: Callable[[Stage, int], Progress],
    end: Callable[[Stage, int, Run], None],
) -> None:
    """Run stages of kilometres one after the other, each in a transaction of its own.

    Parameters
    ----------
    begin, end : callable
        Called before and after each; ``begin`` returns what takes the progress.
    """
    for stage, km, values in tasks:
        progress = begin(stage, km)
        with stage_run(conn, survey.id, km, stage.name, of_stage(values, stage.parameters)) as run:
            run.counts.update(stage.work(conn, survey, km, values, progress))
        end(stage, km, run)
