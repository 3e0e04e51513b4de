"""A queue made by hand, row by row as a batch and its workers leave it, for tests of what shows it."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg.types.json import Jsonb


def survey_id(conn: psycopg.Connection, survey: str) -> int:
    row = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [survey]).fetchone()
    assert row is not None
    return int(row[0])


def add_goal(conn: psycopg.Connection, survey: str, km: int, stage: str = "detect") -> None:
    conn.execute(
        "INSERT INTO tunnel.goal (survey_id, km, stage) VALUES (%s, %s, %s)",
        [survey_id(conn, survey), km, stage],
    )


def add_file(conn: psycopg.Connection, survey: str, name: str, km: int | None, message: str | None = None) -> None:
    conn.execute(
        "INSERT INTO tunnel.incoming (survey_id, name, path, bytes, points, km_from, km_to, failed_at, message) "
        "VALUES (%s, %s, %s, 1000, 2000, %s, %s, CASE WHEN %s::text IS NOT NULL THEN clock_timestamp() END, %s)",
        [survey_id(conn, survey), name, f"/scans/{name}", km, km, message, message],
    )


def add_run(
    conn: psycopg.Connection,
    survey: str,
    km: int | None,
    stage: str,
    seconds: float = 10,
    message: str | None = None,
    ago: float = 0,
    **more: Any,
) -> None:
    """A run of so many seconds that ended some seconds ago; failed when it has a message."""
    conn.execute(
        "INSERT INTO tunnel.run (survey_id, km, stage, started_at, finished_at, outcome, message, counts) VALUES "
        "(%s, %s, %s, now() - make_interval(secs => %s), now() - make_interval(secs => %s), %s, %s, %s)",
        [survey_id(conn, survey), km, stage, ago + seconds, ago, "failed" if message else "done", message, Jsonb(more)],
    )


def add_worker(conn: psycopg.Connection, host: str, pid: int, silent: float = 1) -> int:
    """A worker that was heard of some seconds ago."""
    row = conn.execute(
        "INSERT INTO tunnel_queue.procrastinate_workers (last_heartbeat) VALUES (now() - make_interval(secs => %s)) "
        "RETURNING id",
        [silent],
    ).fetchone()
    assert row is not None
    conn.execute("INSERT INTO tunnel.worker (id, host, pid) VALUES (%s, %s, %s)", [row[0], host, pid])
    return int(row[0])


def add_job(
    conn: psycopg.Connection, survey: str, km: int | None, stage: str, worker: int | None = None, file: str | None = None
) -> int:
    """A job that waits, or that a worker is at."""
    args = {"survey_id": survey_id(conn, survey), "stage": stage, "km": km, "file": file}
    lock = f"s{args['survey_id']}." + (f"f{file}" if file else f"km{km}")
    row = conn.execute(
        "INSERT INTO tunnel_queue.procrastinate_jobs (queue_name, task_name, args, lock, queueing_lock) "
        "VALUES ('tunneldb', %s, %s, %s, %s) RETURNING id",
        ["read" if file else "stage", Jsonb({name: value for name, value in args.items() if value is not None}), lock, lock],
    ).fetchone()
    assert row is not None
    if worker is not None:
        conn.execute(
            "UPDATE tunnel_queue.procrastinate_jobs SET status = 'doing', worker_id = %s WHERE id = %s", [worker, row[0]]
        )
    return int(row[0])
