"""Connections to the embedded server, or to the database of a DSN."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import psycopg

from tunneldb.database.binaries import MINIMUM_POSTGRESQL
from tunneldb.database.failures import first_line
from tunneldb.database.server import Server
from tunneldb.errors import UserError

if TYPE_CHECKING:
    import sqlalchemy

MINIMUM_POSTGIS = (3, 3)


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
    return connection


def sqlalchemy_engine(dsn: str | None) -> sqlalchemy.Engine:
    """Return an SQLAlchemy engine on the database; None means the embedded server."""
    import sqlalchemy
    from sqlalchemy.pool import NullPool

    conninfo = resolve_dsn(dsn)
    return sqlalchemy.create_engine("postgresql+psycopg://", creator=lambda: psycopg.connect(conninfo), poolclass=NullPool)


def engine_on(connection: psycopg.Connection[Any]) -> sqlalchemy.Engine:
    """Return an engine on one connection, which the caller must close; it must be idle."""
    import sqlalchemy
    from sqlalchemy.pool import StaticPool

    return sqlalchemy.create_engine(
        "postgresql+psycopg://", creator=lambda: connection, poolclass=StaticPool, pool_reset_on_return=None
    )
