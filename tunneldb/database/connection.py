"""Connections to the embedded server, or to the database of a DSN."""

from __future__ import annotations

import datetime as dt
import logging
from typing import TYPE_CHECKING, Any, LiteralString

import psycopg
from psycopg.types.datetime import DateLoader, TimestamptzLoader

from tunneldb.database.binaries import MINIMUM_POSTGRESQL
from tunneldb.database.failures import first_line
from tunneldb.database.server import Server
from tunneldb.errors import UserError
from tunneldb.log import WAITS

if TYPE_CHECKING:
    import sqlalchemy

MINIMUM_POSTGIS = (3, 3)

SESSION: LiteralString = """
    SELECT pg_catalog.set_config(s.name, s.value, false)
      FROM (VALUES ('search_path', 'public'), ('DateStyle', 'ISO, MDY'), ('IntervalStyle', 'postgres'), ('TimeZone', 'UTC'),
                   ('client_encoding', 'UTF8'), ('extra_float_digits', '1'), ('bytea_output', 'hex'),
                   ('standard_conforming_strings', 'on'), ('quote_all_identifiers', 'off'), ('transform_null_equals', 'off'),
                   ('client_min_messages', 'notice'), ('default_transaction_isolation', 'read committed'),
                   ('statement_timeout', '0'),
                   ('lock_timeout', CASE pg_catalog.current_setting('lock_timeout') WHEN '0' THEN '10min'
                                         ELSE pg_catalog.current_setting('lock_timeout') END)) AS s (name, value)
"""
"""Settings of a session, whatever its role, its database or PGOPTIONS state: formats of values, names, patience for locks."""


class _Date(DateLoader):
    """Loader of dates that Python cannot hold, such as infinity: as the last date."""

    def load(self, data: Any) -> dt.date:
        try:
            return super().load(data)
        except psycopg.DataError:
            return dt.date.max


class _Moment(TimestamptzLoader):
    """Loader of times that Python cannot hold, such as infinity: as the last time."""

    def load(self, data: Any) -> dt.datetime:
        try:
            return super().load(data)
        except psycopg.DataError:
            return dt.datetime.max.replace(tzinfo=dt.UTC)


def prepare_session(connection: psycopg.Connection[Any]) -> None:
    """Set SESSION on an idle connection, log the locks that it waits for, and read dates beyond those of Python."""
    before, connection.autocommit = connection.autocommit, True
    connection.execute(SESSION)
    connection.autocommit = before
    connection.adapters.register_loader("date", _Date)
    connection.adapters.register_loader("timestamptz", _Moment)
    connection.add_notice_handler(_log_wait)


def _log_wait(notice: psycopg.errors.Diagnostic) -> None:
    if notice.sqlstate == psycopg.errors.LockNotAvailable.sqlstate:
        logging.getLogger(WAITS).warning("%s", notice.message_primary)


def resolve_dsn(dsn: str | None) -> str:
    """Return the DSN, or that of the embedded server, which is started if necessary."""
    return dsn if dsn is not None else Server().start()


def open_connection(dsn: str | None) -> psycopg.Connection[Any]:
    """Connect without checking the schema.

    Raises
    ------
    UserError
        If the server is down, refuses, or is too old.
    """
    try:
        connection = psycopg.connect(
            resolve_dsn(dsn),
            application_name="tunneldb",
            client_encoding="UTF8",
            connect_timeout=15,
            # a prepared statement may get a generic plan, which covers and locks all partitions of all surveys
            prepare_threshold=None,
        )
    except psycopg.ProgrammingError as error:
        raise UserError(f"the DSN is not valid for libpq: {first_line(error)}") from None
    except psycopg.OperationalError as error:
        full = "; its disk is full" if "could not write init file" in str(error) else ""
        raise UserError(f"cannot connect to the database: {first_line(error)}{full}") from None
    major = connection.info.server_version // 10000
    if major < MINIMUM_POSTGRESQL:
        connection.close()
        raise UserError(f"the server is PostgreSQL {major}; tunneldb needs {MINIMUM_POSTGRESQL} or newer")
    prepare_session(connection)
    return connection


def sqlalchemy_engine(dsn: str | None) -> sqlalchemy.Engine:
    """Return an SQLAlchemy engine on the database; None means the embedded server."""
    import sqlalchemy
    from sqlalchemy.pool import NullPool

    return sqlalchemy.create_engine("postgresql+psycopg://", creator=lambda: open_connection(dsn), poolclass=NullPool)


def engine_on(connection: psycopg.Connection[Any]) -> sqlalchemy.Engine:
    """Return an engine on one connection, which the caller must close; it must be idle."""
    import sqlalchemy
    from sqlalchemy.pool import StaticPool

    return sqlalchemy.create_engine(
        "postgresql+psycopg://", creator=lambda: connection, poolclass=StaticPool, pool_reset_on_return=None
    )
