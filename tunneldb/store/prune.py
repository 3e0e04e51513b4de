"""Superseded runs of the ledger and jobs of the queue."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import class_row

from tunneldb.errors import BusyError
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Superseded:
    """Superseded runs and jobs of a survey, also of a deleted one.

    Attributes
    ----------
    survey_id : int or None
        None for jobs of surveys that are gone.
    survey : str or None
    what : str
        ``runs``, or ``jobs`` of the queue, with their states.
    stage : str or None
        Stage of the runs; None for jobs.
    count : int
    rows, bytes : int
        Rows of tables, and their length.
    since, until : datetime or None
        Begin of the first and the last run, or end of jobs.
    """

    survey_id: int | None
    survey: str | None
    what: str
    stage: str | None
    count: int
    rows: int
    bytes: int
    since: dt.datetime | None
    until: dt.datetime | None


def superseded(conn: psycopg.Connection[Any], survey: Survey | None, before: dt.date | None) -> list[Superseded]:
    """Return what would be pruned, for one survey or all: by survey, runs by stage, then jobs.

    Parameters
    ----------
    before : date or None
        Only runs that began, or jobs that ended, before that day.
    """
    with conn.cursor(row_factory=class_row(Superseded)) as cursor:
        return cursor.execute(
            """
            WITH moment AS MATERIALIZED (
                SELECT coalesce(%(before)s::date::timestamptz, 'infinity') AS before
            ), run AS (
                SELECT r.survey_id, 'runs' AS what, r.stage, count(*) AS count, count(*) AS rows, sum(r.bytes)::bigint AS bytes,
                       min(r.started_at) AS since, max(r.started_at) AS until
                  FROM moment m CROSS JOIN LATERAL tunnel_internal.superseded_runs(%(survey)s, m.before) r
                 GROUP BY r.survey_id, r.stage
            ), job AS (
                SELECT e.id AS survey_id, 'jobs' AS what, NULL AS stage, count(*) AS count, sum(j.rows)::bigint AS rows,
                       sum(j.bytes)::bigint AS bytes, min(j.ended_at) AS since, max(j.ended_at) AS until
                  FROM moment m CROSS JOIN LATERAL tunnel_internal.superseded_jobs(%(survey)s, m.before) j
                  LEFT JOIN tunnel.survey e ON e.id = j.survey_id
                 GROUP BY e.id
            )
            SELECT u.survey_id, s.name AS survey, u.what, u.stage, u.count, u.rows, u.bytes, u.since, u.until
              FROM (SELECT * FROM run UNION ALL SELECT * FROM job) u
              LEFT JOIN tunnel.survey s ON s.id = u.survey_id
              LEFT JOIN tunnel.stage t ON t.name = u.stage
             ORDER BY s.name NULLS LAST, u.what DESC, t.step NULLS LAST, u.stage
            """,
            {"before": before, "survey": None if survey is None else survey.id},
        ).fetchall()


def busy(conn: psycopg.Connection[Any], survey_id: int) -> bool:
    """Return True if jobs of a survey wait or run: estimates of the remaining time need all runs."""
    row = conn.execute("SELECT tunnel_internal.queue_busy(%s)", [survey_id]).fetchone()
    return row is not None and bool(row[0])


def prune(conn: psycopg.Connection[Any], survey_id: int | None, before: dt.date | None) -> tuple[int, int]:
    """Delete superseded runs of a survey, or with None jobs of deleted surveys; return the numbers of runs and jobs.

    One transaction. Nobody commits a result of the survey, or begins a run, until it ends.

    Raises
    ------
    BusyError
        If jobs of the survey have come since to wait or run.
    """
    with conn.transaction():
        if survey_id is None:
            jobs = conn.execute(
                "DELETE FROM tunnel_queue.procrastinate_jobs WHERE id IN"
                " (SELECT j.id FROM tunnel_internal.superseded_jobs(NULL, coalesce(%s::date::timestamptz, 'infinity')) j"
                " WHERE NOT EXISTS (SELECT FROM tunnel.survey s WHERE s.id = j.survey_id))",
                [before],
            )
            return 0, jobs.rowcount
        conn.execute("SELECT tunnel_internal.queue_lock(%s)", [survey_id])
        if busy(conn, survey_id):
            raise BusyError("a batch is at work on the survey: wait until it has finished (tunneldb status)")
        jobs = conn.execute(  # first, for they go by the runs
            "DELETE FROM tunnel_queue.procrastinate_jobs WHERE id IN"
            " (SELECT j.id"
            " FROM tunnel_internal.superseded_jobs(%(survey)s, coalesce(%(before)s::date::timestamptz, 'infinity')) j)",
            {"before": before, "survey": survey_id},
        )
        runs = conn.execute(
            "DELETE FROM tunnel.run WHERE id IN"
            " (SELECT r.id"
            " FROM tunnel_internal.superseded_runs(%(survey)s, coalesce(%(before)s::date::timestamptz, 'infinity')) r)",
            {"before": before, "survey": survey_id},
        )
        return runs.rowcount, jobs.rowcount
