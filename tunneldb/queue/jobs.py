"""Queue of procrastinate, in schema tunnel_queue; jobs end in the transaction of the stage that they run."""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

import procrastinate
import psycopg
from procrastinate import JobContext
from procrastinate.connector import BaseConnector
from procrastinate.jobs import Job as QueueJob
from procrastinate.jobs import Status
from procrastinate.manager import JobManager

from tunneldb.database.connection import SESSION
from tunneldb.database.failures import describe_failure
from tunneldb.database.session import CONNECT, SETTINGS, worker_session
from tunneldb.errors import UserError
from tunneldb.stages.ledger import Job, LostError, describe, stage_run
from tunneldb.stages.parameters import of_stage, settings
from tunneldb.stages.registry import STAGES
from tunneldb.store.survey import Survey, get_survey

QUEUE = "tunneldb"
log = logging.getLogger("tunneldb.worker")


class GoneError(Exception):
    """Error for a job whose subject no longer exists."""


class Manager(JobManager):
    """Job manager that leaves the end of jobs to the transactions of their stages, and records each worker.

    Parameters
    ----------
    connector : BaseConnector
    registered : callable
        Function of the worker's number, called before it takes a job.
    unsettled : callable
        Function called if a job could neither be ended nor put back.
    """

    def __init__(
        self, connector: BaseConnector, registered: Callable[[int], Awaitable[None]], unsettled: Callable[[], None]
    ) -> None:
        super().__init__(connector)
        self._registered = registered
        self._unsettled = unsettled

    async def register_worker(self) -> int:
        """Register the worker and record it."""
        worker = await super().register_worker()
        await self._registered(worker)
        return worker

    async def finish_job(self, job: QueueJob, status: Status, delete_job: bool) -> None:
        """End a job of a kind unknown to this program; others have ended already, or their worker exits."""
        if job.task_name not in ("read", "stage"):
            await super().finish_job(job, status, delete_job)
        elif status != Status.SUCCEEDED:
            self._unsettled()


def make_app(
    dsn: str, home: str | None, registered: Callable[[int], Awaitable[None]], unsettled: Callable[[], None]
) -> procrastinate.App:
    """Return the queue of a database.

    Parameters
    ----------
    dsn : str
        Database of the queue.
    home : str or None
        Database for jobs to connect to: None for the embedded server, which they start if it is down.
    registered, unsettled : callable
        As for `Manager`.
    """

    async def configure(conn: psycopg.AsyncConnection[Any]) -> None:
        await conn.execute(SESSION)
        await conn.execute("SELECT set_config('search_path', 'tunnel_queue, pg_temp', false)")
        await conn.execute(SETTINGS)
        await conn.commit()

    connector = procrastinate.PsycopgConnector(
        conninfo=dsn, kwargs=CONNECT, configure=configure, min_size=1, max_size=3, timeout=10.0, reconnect_timeout=5.0
    )
    app = procrastinate.App(connector=connector)
    app.job_manager = Manager(connector, registered, unsettled)

    @app.task(name="read", pass_context=True)
    def read(context: JobContext, survey_id: int, file: str, stage: str) -> None:
        _run(home, context, lambda conn, job: _read(conn, job, survey_id, file))

    @app.task(name="stage", pass_context=True)
    def stage(context: JobContext, survey_id: int, km: int, stage: str) -> None:
        _run(home, context, lambda conn, job: _stage(conn, job, survey_id, km, stage))

    return app


def _run(dsn: str | None, context: JobContext, work: Callable[[psycopg.Connection[Any], Job], None]) -> None:
    """Run a job; if its stage did not record its end, record it here."""
    assert context.job.id is not None
    assert context.job.worker_id is not None
    job = Job(context.job.id, context.job.worker_id, context.job.attempts)
    what = " ".join(str(value) for name, value in context.job.task_kwargs.items() if name != "survey_id")
    try:
        with worker_session(dsn) as conn:
            work(conn, job)
    except LostError as error:
        log.warning("%s: %s", what, error)
    except Exception as error:
        bug = not isinstance(error, (UserError, GoneError)) and describe_failure(error) is None
        log.warning("%s: %s", what, describe(error), exc_info=bug)
        end_job(dsn, job, error)


def end_job(dsn: str | None, job: Job, error: Exception) -> None:
    """End or put back a job that its stage has left, in a session of its own.

    Raises
    ------
    psycopg.OperationalError
        If there is no connection; the job is taken over after the worker has exited.
    """
    with worker_session(dsn) as conn:
        owned = conn.execute("SELECT tunnel_internal.queue_hold(%s, %s)", [job.id, job.worker]).fetchone()
        if owned is None or not owned[0]:
            return
        if isinstance(error, psycopg.OperationalError):
            conn.execute("SELECT tunnel_internal.queue_return(%s)", [job.id])
        elif isinstance(error, GoneError):
            conn.execute("SELECT tunnel_queue.procrastinate_finish_job_v1(%s, 'aborted', false)", [job.id])
        else:
            conn.execute("SELECT tunnel_internal.queue_fail(%s, %s)", [job.id, describe(error)])


def _survey(conn: psycopg.Connection[Any], survey_id: int) -> Survey:
    row = conn.execute("SELECT name FROM tunnel.survey WHERE id = %s", [survey_id]).fetchone()
    if row is None:
        raise GoneError(f"survey {survey_id} was removed")
    return get_survey(conn, row[0])


def _read(conn: psycopg.Connection[Any], job: Job, survey_id: int, name: str) -> None:
    from tunneldb.pipeline.load import settings_of
    from tunneldb.pipeline.read import read_file
    from tunneldb.queue.batch import restrict_failed_file

    survey = _survey(conn, survey_id)
    row = conn.execute(
        "SELECT path, parameters FROM tunnel.incoming WHERE survey_id = %s AND name = %s", [survey_id, name]
    ).fetchone()
    conn.rollback()
    if row is None:
        raise GoneError(f"{name} is no longer requested")
    path, parameters = row
    try:
        with stage_run(conn, survey_id, None, "read", {**parameters, "file": name}, job) as run:
            run.counts.update(read_file(conn, survey, Path(path), settings_of(parameters)))
    except UserError:
        restrict_failed_file(conn, survey, name)
        raise


def _stage(conn: psycopg.Connection[Any], job: Job, survey_id: int, km: int, name: str) -> None:
    survey = _survey(conn, survey_id)
    row = conn.execute("SELECT parameters FROM tunnel.goal WHERE survey_id = %s AND km = %s", [survey_id, km]).fetchone()
    conn.rollback()
    parameters: Mapping[str, Any] = row[0] if row else {}
    if name == "load":
        _load(conn, job, survey, km, parameters)
        return
    stage = next(stage for stage in STAGES if stage.name == name)
    values = settings(f"{key}={value}" for key, value in parameters.items() if not key.startswith("load."))
    with stage_run(conn, survey_id, km, name, of_stage(values, stage.parameters), job) as run:
        run.counts.update(stage.work(conn, survey, km, values, lambda share: None))


def _load(conn: psycopg.Connection[Any], job: Job, survey: Survey, km: int, parameters: Mapping[str, Any]) -> None:
    from tunneldb.pipeline.load import load_kilometre, parameters_of, settings_of

    how = settings_of(parameters)
    with stage_run(conn, survey.id, km, "load", parameters_of(how), job) as run:
        run.counts.update(load_kilometre(conn, survey, km, how))
