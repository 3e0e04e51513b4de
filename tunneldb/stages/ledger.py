"""Ledger: a row of tunnel.run for each attempt of a stage in a kilometre."""

from __future__ import annotations

import datetime as dt
import logging
import os
import platform
import random
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import Any, LiteralString

import psycopg
from psycopg.types.json import Jsonb

from tunneldb import __version__
from tunneldb.database.failures import describe_failure, first_line
from tunneldb.database.locks import holder_text
from tunneldb.errors import BusyError, UserError
from tunneldb.log import fields

log = logging.getLogger(__name__)

_LIBRARIES = ("numpy", "scipy", "numba", "onnxruntime", "laspy", "lazrs", "shapely", "rasterio", "psycopg")


_TRANSIENT = (
    psycopg.errors.DeadlockDetected,
    psycopg.errors.SerializationFailure,
    psycopg.errors.LockNotAvailable,
    psycopg.errors.OutOfMemory,
)
_ATTEMPTS = 6


class LostError(Exception):
    """Job that was taken from its worker, which was thought to be lost; its work must not be committed."""


@dataclass
class Run:
    """Run in progress; ``counts`` is written at its end."""

    id: int
    started_at: dt.datetime
    counts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    """Job of the queue that a worker runs; ``attempts`` is the number of earlier attempts."""

    id: int
    worker: int
    attempts: int = 0


@contextmanager
def stage_run(
    conn: psycopg.Connection[Any],
    survey_id: int,
    km: int | None,
    stage: str,
    parameters: Mapping[str, Any],
    job: Job | None = None,
) -> Iterator[Run]:
    """Run a stage in one transaction, and record it in the ledger.

    First the start of the run is committed. The results are then committed together with the end of the run. After an error
    they are rolled back, and the failure is recorded; without a job, a run that finds the kilometre locked is removed from the
    ledger. A killed run stays "running", with a database session that has ended.
    An advisory lock excludes a second run of the same survey and kilometre; files of a survey may be read at the same time.

    The job of the run, if any, ends in the same transaction, and its follow-up jobs are queued there. After an error it
    returns to the queue if the error can be transient; otherwise it ends as failed.

    Parameters
    ----------
    conn : Connection
        Idle; no transaction may be open.
    survey_id : int
    km : int or None
        The kilometre; None for a stage of the whole survey.
    stage : str
    parameters : mapping
        Values that the result depends on, for the ledger.
    job : Job or None

    Raises
    ------
    BusyError
        If another process is at work on the same survey and kilometre.
    LostError
        If another worker has taken over the job.
    """
    run = _begin(conn, survey_id, km, stage, parameters, job)
    began, what = time.monotonic(), {"run": run.id, "survey_id": survey_id, "km": km, "stage": stage}
    name = stage if km is None else f"{stage} of kilometre {km}"
    log.info("%s begins", name, extra=fields(**what))
    try:
        with conn.transaction():
            lock(conn, survey_id, km, shared=job is not None)
            yield run
            _finish(conn, survey_id, run, job)
    except BaseException as error:
        log.info("%s failed: %s", name, describe(error), exc_info=error, extra=fields(**what))
        _fail(conn, survey_id, run, job, error)
        raise
    conn.commit()
    seconds = round(time.monotonic() - began, 3)
    log.info("%s done in %.1f s", name, seconds, extra=fields(**what, seconds=seconds, counts=run.counts))


def _begin(
    conn: psycopg.Connection[Any],
    survey_id: int,
    km: int | None,
    stage: str,
    parameters: Mapping[str, Any],
    job: Job | None,
) -> Run:
    if job is not None:
        _hold(conn, job)
    conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey_id])
    row = conn.execute(
        """
        INSERT INTO tunnel.run (survey_id, km, stage, parameters, versions, counts, backend_pid, backend_start,
                                started_at, outcome, worker, job_id)
        SELECT %s, %s, %s, %s, %s, '{}', a.pid, a.backend_start, clock_timestamp(), 'running', %s, %s
        FROM pg_stat_activity a WHERE a.pid = pg_backend_pid()
        RETURNING id, started_at
        """,
        [
            survey_id,
            km,
            stage,
            Jsonb(dict(parameters)),
            Jsonb(versions(conn)),
            f"{platform.node()}/{os.getpid()}",
            job.id if job else None,
        ],
    ).fetchone()
    conn.commit()
    assert row is not None
    return Run(*row)


def lock(conn: psycopg.Connection[Any], survey_id: int, km: int | None, *, shared: bool = False) -> None:
    """Lock a survey's kilometre, or with None its stages of the whole survey, until the transaction ends.

    Parameters
    ----------
    shared : bool
        True if other shared locks of the whole survey are allowed at the same time; a kilometre is never shared.

    Raises
    ------
    BusyError
        If another process is at work on it.
    """
    if km is None and shared:
        query: LiteralString = "SELECT pg_try_advisory_xact_lock_shared(%s, %s)"
    else:
        query = "SELECT pg_try_advisory_xact_lock(%s, %s)"
    taken = conn.execute(query, [survey_id, -1 if km is None else km]).fetchone()
    if taken is None or not taken[0]:
        where = "the survey" if km is None else f"kilometre {km}"
        raise BusyError(
            f"another process is at work on {where}: wait until it has finished (tunneldb status)"
            f"{holder_text(conn, survey_id, -1 if km is None else km)}"
        )


def _hold(conn: psycopg.Connection[Any], job: Job) -> None:
    held = conn.execute("SELECT tunnel_internal.queue_hold(%s, %s)", [job.id, job.worker]).fetchone()
    if held is None or not held[0]:
        raise LostError(f"another worker has taken over job {job.id}")


def _finish(conn: psycopg.Connection[Any], survey_id: int, run: Run, job: Job | None) -> None:
    """Record the end, and the entries of a load for each of its kilometres, as the last step before the commit."""
    if job is not None:
        _hold(conn, job)
    conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey_id])
    conn.execute(
        "UPDATE tunnel.run SET outcome = 'done', finished_at = clock_timestamp() WHERE survey_id = %s AND started_at = %s"
        " AND backend_pid = pg_backend_pid()",
        [survey_id, run.started_at],
    )
    conn.execute("UPDATE tunnel.run SET counts = %s WHERE id = %s", [Jsonb(run.counts), run.id])
    if job is not None:
        conn.execute("SELECT tunnel_internal.queue_done(%s, %s)", [job.id, run.started_at])


def _fail(conn: psycopg.Connection[Any], survey_id: int, run: Run, job: Job | None, error: BaseException) -> None:
    if conn.closed or conn.broken:
        return
    try:
        conn.rollback()
        with conn.transaction():
            if job is not None and not isinstance(error, LostError):
                _hold(conn, job)
            conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey_id])
            if job is None and isinstance(error, BusyError):  # nothing was tried: what another does there is the last run
                conn.execute("DELETE FROM tunnel.run WHERE id = %s", [run.id])
                return
            conn.execute(
                "UPDATE tunnel.run SET outcome = 'failed', finished_at = clock_timestamp(), counts = %s, message = %s"
                " WHERE id = %s",
                [Jsonb(run.counts), describe(error), run.id],
            )
            if job is not None and not isinstance(error, LostError):
                _end_job(conn, job, error)
    except (psycopg.OperationalError, LostError):
        return  # the server went away, or the job is another's: the run stays "running" with a backend that is gone


def _end_job(conn: psycopg.Connection[Any], job: Job, error: BaseException) -> None:
    """Return a job to the queue if a retry may succeed; end it as failed otherwise."""
    again = retry_at(error, job.attempts)
    if again is None:
        conn.execute("SELECT tunnel_internal.queue_fail(%s, %s)", [job.id, describe(error)])
    else:
        conn.execute(
            "SELECT tunnel_queue.procrastinate_retry_job_v2(%s, clock_timestamp() + %s, NULL, NULL, NULL)", [job.id, again]
        )


def retry_at(error: BaseException, attempts: int) -> dt.timedelta | None:
    """Return the time to wait before another attempt, about 1, 2, 4 s and so on; None if it would fail again."""
    if attempts + 1 >= _ATTEMPTS or not isinstance(error, (BusyError, *_TRANSIENT)):
        return None
    return dt.timedelta(seconds=2.0**attempts * random.uniform(0.7, 1.3))


def describe(error: BaseException) -> str:
    """Return one line: the message of an error that the user can fix; of any other also its type."""
    if isinstance(error, Exception) and (known := describe_failure(error)) is not None:
        return known
    text = " ".join((first_line(error) if isinstance(error, psycopg.Error) else str(error)).split())
    if isinstance(error, UserError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def versions(conn: psycopg.Connection[Any]) -> dict[str, str]:
    """Return the versions of the program, the server and the libraries that results depend on."""
    row = conn.execute("SELECT current_setting('server_version'), PostGIS_Lib_Version()").fetchone()
    assert row is not None
    return {
        "tunneldb": __version__,
        "python": platform.python_version(),
        "postgresql": row[0],
        "postgis": row[1],
        **_library_versions(),
    }


@cache
def _library_versions() -> dict[str, str]:
    """Return the versions of the libraries as they were first asked for: a process keeps what it has imported."""
    return {name: version(name) for name in _LIBRARIES}
