"""Advisory locks of surveys and kilometres, and the sessions that hold them."""

from __future__ import annotations

from typing import Any

import psycopg


def wait_for_kilometre(conn: psycopg.Connection[Any], survey_id: int, km: int) -> None:
    """Lock a kilometre of a survey until the transaction ends.

    While another session has the lock, the server warns of that session (`tunneldb.log.WAITS`).

    Raises
    ------
    psycopg.errors.LockNotAvailable
        If it has the lock for longer than the session's lock_timeout; the message names it.
    """
    conn.execute("SELECT tunnel_internal.wait_lock(%s, %s, false, %s)", [survey_id, km, f"kilometre {km}"])


def holder_text(conn: psycopg.Connection[Any], first: int, second: int) -> str:
    """Return the end of a message: the sessions that hold an advisory lock; empty if there is none any more."""
    row = conn.execute("SELECT tunnel_internal.lock_holder(%s, %s)", [first, second]).fetchone()
    return f"; it is locked by {row[0]}" if row is not None and row[0] else ""


def lock_waits(conn: psycopg.Connection[Any]) -> list[str]:
    """Return a sentence for each session that waits for a lock, and for each session of another program with a lock."""
    rows = conn.execute("SELECT waiting, holder FROM tunnel_internal.lock_waits()").fetchall()
    return [
        f"{holder} holds an advisory lock" if waiting is None else f"{waiting} waits for {holder}" for waiting, holder in rows
    ]


def open_transactions(conn: psycopg.Connection[Any]) -> str:
    """Return the other sessions of the database with an open transaction, in words; empty without any.

    Works also where schema tunnel_internal does not exist.
    """
    rows = conn.execute(
        "SELECT usename, pid, application_name FROM pg_catalog.pg_stat_activity"
        " WHERE datname = pg_catalog.current_database() AND pid <> pg_catalog.pg_backend_pid()"
        "   AND (state IS NULL OR state <> 'idle') AND usename IS NOT NULL ORDER BY pid"
    ).fetchall()
    return ", ".join(f"{user} (process {pid}, {program or 'unnamed program'})" for user, pid, program in rows)
