"""Sessions of workers: they end soon after a lost connection, and leave the other cores to other workers."""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, LiteralString

import psycopg

from tunneldb.database.connection import open_connection, prepare_session, resolve_dsn
from tunneldb.database.schema import require_current_schema
from tunneldb.errors import UserError
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
def as_of(connection: psycopg.Connection[Any], survey: str, moment: dt.datetime | None = None) -> Iterator[dt.datetime]:
    """Read the database as of one moment within a with block; with a moment, this survey as it was then.

    The connection must be idle. Yields the moment that is read.

    Raises
    ------
    UserError
        If the survey cannot be shown as it was: it is younger, or a stage ran since.
    """
    if moment is None:
        with snapshot(connection):
            row = connection.execute("SELECT clock_timestamp()").fetchone()
            assert row is not None
            yield row[0]
        return
    with connection.transaction(force_rollback=True):
        connection.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ")
        try:
            connection.execute("SELECT tunnel_api.show_as_of(%s, %s)", [survey, moment])
        except (psycopg.errors.InvalidParameterValue, psycopg.errors.NoDataFound) as error:
            hint = f" {error.diag.message_hint}" if error.diag.message_hint else ""
            raise UserError(f"{error.diag.message_primary}.{hint}") from None
        yield moment


@contextmanager
def snapshot(connection: psycopg.Connection[Any]) -> Iterator[None]:
    """Read the database as of one moment within a with block; later commits of others are not visible.

    The connection must be idle.
    """
    with connection.transaction():
        connection.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
        yield
