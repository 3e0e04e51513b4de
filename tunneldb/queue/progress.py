"""Progress of a survey: stages of kilometres, waiting and failed files, workers, speed and time left."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import psycopg
from psycopg.rows import class_row

from tunneldb.queue.throughput import measure, points_per_second
from tunneldb.queue.worker import STALLED
from tunneldb.stages.registry import STAGE_NAMES

TO_DO = ("queued", "waits", "running")
"""States of a step that workers will run without user action."""


@dataclass(frozen=True)
class Cell:
    """Stage of a kilometre.

    Attributes
    ----------
    state : str
        ``done``, ``running``, ``queued`` (next for a worker), ``waits`` (for its input), ``failed``, ``stale``,
        ``interrupted``, ``never`` or ``empty`` (the kilometre has no points and expects none).
    reason : str or None
        Reason for failed and stale.
    worker : str or None
        Machine and process of its worker.
    since : datetime or None
        Start time.
    """

    state: str
    reason: str | None = None
    worker: str | None = None
    since: dt.datetime | None = None


@dataclass(frozen=True)
class File:
    """File of a batch; ``state`` is ``waiting``, ``running`` or ``failed``."""

    name: str
    path: str
    points: int
    km_from: int | None
    km_to: int | None
    state: str
    message: str | None


@dataclass(frozen=True)
class Worker:
    """Worker; ``silent`` is the age of its last heartbeat, s, ``busy`` the time since the start of its job, s."""

    host: str
    pid: int
    started_at: dt.datetime
    silent: float
    stopping: bool
    doing: str | None
    busy: float | None

    @property
    def lost(self) -> bool:
        """True if it has been silent so long that its job is taken over."""
        return self.silent > STALLED


@dataclass(frozen=True)
class Overview:
    """Progress of a survey at a moment.

    Attributes
    ----------
    survey : str
    now : datetime
        Time of the server's clock.
    kilometres : dict
        Cell of each stage of each kilometre that is loaded, was processed or is requested.
    targets : dict
        Last requested stage of each kilometre.
    files : tuple of File
    workers : tuple of Worker
        All workers of the database, for any survey.
    done, total : int
        Number of completed steps, and of all: stages of requested kilometres.
    share : float or None
        Share of the work completed since the last unfinished batch was started, 0 to 1; each step is weighted by the time of
        its stage in this survey. None while a remaining stage has never been measured.
    rate : float or None
        Points of the files per second since the last unfinished batch was started.
    left : float or None
        Remaining time, s; None if unknown.
    """

    survey: str
    now: dt.datetime
    kilometres: dict[int, dict[str, Cell]]
    targets: dict[int, str]
    files: tuple[File, ...]
    workers: tuple[Worker, ...]
    done: int
    total: int
    share: float | None
    rate: float | None
    left: float | None

    @property
    def active(self) -> bool:
        """True if steps remain that workers will run without user action."""
        return any(file.state != "failed" for file in self.files) or any(
            cell.state in TO_DO for cells in self.kilometres.values() for cell in cells.values()
        )

    @property
    def live(self) -> int:
        """Number of workers with a recent heartbeat."""
        return sum(not worker.lost for worker in self.workers)


class _Goal(NamedTuple):
    step: int
    requested_at: dt.datetime


class _Status(NamedTuple):
    outcome: str
    stale: bool
    reason: str | None
    message: str | None


class _Plan(NamedTuple):
    state: str
    message: str | None


class _Run(NamedTuple):
    worker: str | None
    since: dt.datetime | None


class _Known(NamedTuple):
    """Records of stages of kilometres in the database, by kilometre and stage."""

    statuses: dict[tuple[int, str], _Status]
    plans: dict[tuple[int, str], _Plan]
    runs: dict[tuple[int, str], _Run]
    active: bool


def overview(conn: psycopg.Connection[Any], survey: str) -> Overview:
    """Return the progress of a survey; needs only the rights of a viewer.

    Parameters
    ----------
    conn : Connection
        Connection; its transaction stays open, so that the data are of one moment if it began with this call.
    survey : str
        Name of an existing survey.
    """
    now = conn.execute("SELECT clock_timestamp()").fetchone()
    assert now is not None
    goals, files = _goals(conn, survey), _files(conn, survey)
    known = _known(conn, survey, files)
    kilometres = {
        km: {stage: _cell(km, stage, known) for stage in STAGE_NAMES}
        for km in sorted({*goals, *(km for km, _ in known.statuses), *_touched(files)})
    }
    _mark_failed_files(kilometres, files)
    workers = _workers(conn)
    throughput = measure(conn, survey)
    steps = [[(stage, cell.since) for stage, cell in cells.items() if cell.state in TO_DO] for cells in kilometres.values()]
    to_read = sum(file.state != "failed" for file in files)
    asked = max((goals[km].requested_at for km in goals if _unfinished(kilometres[km])), default=None)
    share = throughput.share(steps, to_read, asked) if asked is not None else None
    requested = [kilometres[km][stage].state for km, goal in goals.items() for stage in STAGE_NAMES[: goal.step + 1]]
    return Overview(
        survey,
        now[0],
        kilometres,
        {km: STAGE_NAMES[goal.step] for km, goal in goals.items()},
        files,
        workers,
        done=sum(state in ("done", "empty") for state in requested),
        total=len(requested),
        share=share,
        rate=points_per_second(conn, survey, share, asked, now[0]) if asked is not None and share is not None else None,
        left=throughput.left(steps, to_read, sum(not worker.lost for worker in workers), now[0]),
    )


def _goals(conn: psycopg.Connection[Any], survey: str) -> dict[int, _Goal]:
    rows = conn.execute("SELECT km, stage, requested_at FROM tunnel_api.goal WHERE survey = %s", [survey])
    return {km: _Goal(STAGE_NAMES.index(stage), requested_at) for km, stage, requested_at in rows}


def _known(conn: psycopg.Connection[Any], survey: str, files: tuple[File, ...]) -> _Known:
    of_survey = conn.execute("SELECT id FROM tunnel_api.survey WHERE name = %s", [survey]).fetchone()
    assert of_survey is not None
    statuses = conn.execute(
        "SELECT km, stage, outcome, stale, reason, message FROM tunnel_api.stage_status WHERE survey_id = %s",
        of_survey,
    ).fetchall()
    plans = conn.execute("SELECT km, stage, state, message FROM tunnel_internal.queue_state(%s)", of_survey).fetchall()
    runs = conn.execute(
        "SELECT r.km, r.stage, r.worker, r.started_at FROM unnest(%s::text[]) AS s (stage)"
        " CROSS JOIN LATERAL tunnel_internal.last_runs(%s, s.stage, false) r WHERE r.outcome = 'running'",
        [list(STAGE_NAMES), *of_survey],
    ).fetchall()
    return _Known(
        {(km, stage): _Status(*rest) for km, stage, *rest in statuses},
        {(km, stage): _Plan(*rest) for km, stage, *rest in plans},
        {(km, stage): _Run(*rest) for km, stage, *rest in runs},
        any(file.state != "failed" for file in files) or any(state in ("queued", "running") for _, _, state, _ in plans),
    )


def _files(conn: psycopg.Connection[Any], survey: str) -> tuple[File, ...]:
    with conn.cursor(row_factory=class_row(File)) as cursor:
        cursor.execute(
            """
            SELECT i.name, i.path, i.points, i.km_from, i.km_to,
                   CASE WHEN i.state = 'waiting' AND EXISTS (
                             SELECT FROM tunnel_api.job j
                              WHERE j.survey_id = i.survey_id AND j.file = i.name AND j.state = 'running')
                        THEN 'running' ELSE i.state END AS state, i.message
              FROM tunnel_api.incoming i WHERE i.survey = %s ORDER BY i.km_from NULLS LAST, i.name
            """,
            [survey],
        )
        return tuple(cursor)


def _workers(conn: psycopg.Connection[Any]) -> tuple[Worker, ...]:
    with conn.cursor(row_factory=class_row(Worker)) as cursor:
        cursor.execute(
            """
            SELECT host, pid, started_at, extract(epoch FROM clock_timestamp() - heartbeat)::float8 AS silent, stopping, doing,
                   extract(epoch FROM clock_timestamp() - since)::float8 AS busy
              FROM tunnel_api.worker ORDER BY host, pid
            """
        )
        return tuple(cursor)


def _touched(files: tuple[File, ...]) -> set[int]:
    return {km for file in files if file.km_from is not None and file.km_to is not None
            for km in range(file.km_from, file.km_to + 1)}  # fmt: skip


def _cell(km: int, stage: str, known: _Known) -> Cell:
    status = known.statuses.get((km, stage), _Status("never", False, None, None))
    plan = known.plans.get((km, stage))
    if status.outcome == "running" or (plan is not None and plan.state == "running"):
        run = known.runs.get((km, stage), _Run(None, None))
        return Cell("running", worker=run.worker, since=run.since)
    if plan is not None:
        if plan.state in ("done", "empty", "queued", "failed"):
            return Cell(plan.state, plan.message)
        if plan.state in ("ready", "waits") and known.active:
            return Cell("waits")
    if status.outcome == "failed":
        return Cell("failed", status.message)
    if status.outcome == "interrupted":
        return Cell("interrupted", "the program that ran it, or its connection, has ended")
    return Cell("stale", status.reason) if status.outcome == "done" and status.stale else Cell(status.outcome)


def _mark_failed_files(kilometres: dict[int, dict[str, Cell]], files: tuple[File, ...]) -> None:
    """Show a failed file at the kilometres that it touches, unless one of their stages is running."""
    for file in files:
        for cells in [kilometres[km] for km in _touched((file,)) if file.state == "failed"]:
            if cells["load"].state not in ("running", "queued"):
                cells["load"] = Cell("failed", file.message)
                cells.update((stage, Cell("never")) for stage in STAGE_NAMES if cells[stage].state == "empty")


def _unfinished(cells: Mapping[str, Cell]) -> bool:
    return any(cell.state in TO_DO for cell in cells.values())
