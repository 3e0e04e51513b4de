"""Sessions of workers: they end soon after a lost connection, and leave the other cores to other workers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, LiteralString

import psycopg

from tunneldb.database.connection import open_connection, prepare_session, resolve_dsn
from tunneldb.database.schema import require_current_schema
from tunneldb.threads import threads

APPLICATION = "tunneldb worker"
CONNECT: dict[str, Any] = {
    "application_name": APPLICATION,
    "client_encoding": "UTF8",
    "connect_timeout": 15,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "tcp_user_timeout": 25_000,
}
"""Parameters for libpq: a lost server is noticed within 25 s."""

SETTINGS: LiteralString = """
    SELECT set_config('tcp_keepalives_idle', '10', false), set_config('tcp_keepalives_interval', '5', false),
           set_config('tcp_keepalives_count', '3', false), set_config('tcp_user_timeout', '25s', false),
           set_config('client_connection_check_interval', '10s', false)
"""
"""The same settings for the server: a session of a lost worker ends, and its locks are released."""


@contextmanager
def worker_session(dsn: str | None) -> Iterator[psycopg.Connection[Any]]:
    """Connect for one job; None means the embedded server, which is started if necessary.

    Raises
    ------
    psycopg.OperationalError
        If the server can't be reached.
    UserError
        If its schema is not this program's.
    """
    with psycopg.connect(resolve_dsn(dsn), **CONNECT) as conn:
        prepare_session(conn)
        require_current_schema(conn)
        conn.execute(SETTINGS)
        conn.execute("SELECT set_config('max_parallel_workers_per_gather', %s, false)", [str(threads() - 1)])
        conn.commit()
        yield conn


def connect(dsn: str | None) -> psycopg.Connection[Any]:
    """Connect to a database that `tunneldb init` has prepared; None means the embedded server.

    Returns
    -------
    psycopg.Connection
        Connection in transaction mode (no autocommit), idle.

    Raises
    ------
    UserError
        If the server is down, has no PostGIS, or its schema is missing, older or newer than this program's.
    """
    from tunneldb.database.schema import require_current_schema

    connection = open_connection(dsn)
    try:
        require_current_schema(connection)
        connection.rollback()
    except BaseException:
        connection.close()
        raise
    return connection


@contextmanager
def snapshot(connection: psycopg.Connection[Any]) -> Iterator[None]:
    """Read the database as of one moment within a with block; later commits of others are not visible.

    The connection must be idle.
    """
    with connection.transaction():
        connection.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
        yield
