"""Queries of the commands about the queue: time of the server, finished jobs, ended runs, workers to stop."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from typing import Any

import psycopg


def server_time(conn: psycopg.Connection[Any]) -> dt.datetime:
    """Return the time of the server."""
    row = conn.execute("SELECT clock_timestamp()").fetchone()
    assert row is not None
    return row[0]


def is_busy(conn: psycopg.Connection[Any], survey_id: int) -> bool:
    """Return True if jobs of a survey are queued or under way."""
    row = conn.execute("SELECT tunnel_internal.queue_busy(%s)", [survey_id]).fetchone()
    assert row is not None
    return bool(row[0])


def count_jobs(conn: psycopg.Connection[Any], workers: Sequence[str], since: dt.datetime) -> tuple[int, int]:
    """Return the number of jobs that workers have done since a time, and of those queued or under way in the database.

    Parameters
    ----------
    conn : Connection
    workers : sequence of str
        Names of the workers, host/process.
    since : datetime
    """
    row = conn.execute(
        """
        SELECT (SELECT count(*) FROM tunnel_api.run WHERE worker = ANY (%s) AND finished_at > %s),
               (SELECT count(*) FROM tunnel_api.job WHERE state IN ('queued', 'running'))
        """,
        [list(workers), since],
    ).fetchone()
    assert row is not None
    return row[0], row[1]


def list_ended_runs(conn: psycopg.Connection[Any], survey: str, since: dt.datetime) -> list[tuple[Any, ...]]:
    """Return the runs of stages, and files read, of a survey that ended after a time, in their order.

    Returns
    -------
    list of tuple
        Stage, kilometre or file, outcome, message, seconds, time of the end, True if of a kilometre, points.
    """
    return conn.execute(
        """
        SELECT stage, coalesce('km ' || km, parameters ->> 'file'), outcome, message,
               extract(epoch FROM duration)::float8, finished_at, km IS NOT NULL, coalesce((counts ->> 'points')::bigint, 0)
          FROM tunnel_api.run
         WHERE survey = %s AND finished_at > %s AND (km IS NOT NULL OR stage = 'read') ORDER BY finished_at
        """,
        [survey, since],
    ).fetchall()


def ask_workers_to_stop(conn: psycopg.Connection[Any]) -> list[int]:
    """Ask all workers to stop, and return their ids."""
    conn.execute("SELECT tunnel_internal.queue_rescue()")
    return [row[0] for row in conn.execute("UPDATE tunnel.worker SET stop = true RETURNING id")]


def workers_left(conn: psycopg.Connection[Any], ids: Sequence[int]) -> bool:
    """Return True if one of some workers is still there; workers that were lost are not."""
    conn.execute("SELECT tunnel_internal.queue_rescue()")
    return conn.execute("SELECT 1 FROM tunnel.worker WHERE id = ANY (%s)", [list(ids)]).fetchone() is not None
