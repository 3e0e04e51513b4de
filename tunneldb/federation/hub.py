"""The hub's database: extensions, schemas, and settings for its planner."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.database.failures import first_line
from tunneldb.database.locks import open_transactions
from tunneldb.database.resources import resource_dir
from tunneldb.errors import BusyError, UserError
from tunneldb.federation.names import HUB, INTERNAL

_LOCK = 7088630453  # arbitrary number; commands that change the hub wait for each other
LOCK_TIMEOUT = "10s"
"""Time to wait for queries that use the views. Later queries wait behind it."""

_SETTINGS = ("enable_partitionwise_join", "enable_partitionwise_aggregate")
"""Settings by which the planner sends joins and aggregates of each server to it; off by default."""


@contextmanager
def changing(connection: psycopg.Connection[Any], lock_timeout: str = LOCK_TIMEOUT) -> Iterator[None]:
    """Change the hub in one transaction within a with block; other commands that change it wait.

    Raises
    ------
    BusyError
        If queries use the views for longer than the lock timeout. Nothing is changed.
    UserError
        If this role may not change the hub.
    """
    try:
        with connection.transaction():
            connection.execute("SELECT pg_advisory_xact_lock(%s)", [_LOCK])
            connection.execute(sql.SQL("SET LOCAL lock_timeout = {}").format(lock_timeout))
            yield
    except psycopg.errors.LockNotAvailable:
        holders = open_transactions(connection)
        connection.rollback()
        raise BusyError(f"the views of the hub are in use{': ' if holders else ''}{holders}; nothing was changed") from None
    except psycopg.errors.InsufficientPrivilege as error:
        raise UserError(
            f"{connection.info.user} may not change the hub ({first_line(error)}): use the role that made it"
        ) from None


def prepare_hub(connection: psycopg.Connection[Any]) -> None:
    """Create what a hub needs besides its servers.

    Raises
    ------
    UserError
        If an extension is missing on the server, or this role may not create it.
    """
    for extension in ("postgis", "postgres_fdw"):
        if connection.execute("SELECT FROM pg_extension WHERE extname = %s", [extension]).fetchone() is not None:
            continue
        try:
            with connection.transaction():
                connection.execute(sql.SQL("CREATE EXTENSION {} SCHEMA public").format(sql.Identifier(extension)))
        except psycopg.errors.InsufficientPrivilege:
            raise UserError(f"the hub has no {extension}: have a superuser run there: CREATE EXTENSION {extension};") from None
        except (psycopg.errors.FeatureNotSupported, psycopg.errors.UndefinedFile) as error:
            raise UserError(
                f"{extension} is not installed on the hub's machine ({first_line(error)}): on Debian, PostGIS is in"
                " postgresql-15-postgis-3, and postgres_fdw comes with postgresql-15"
            ) from None
    connection.execute((resource_dir("sql") / "hub" / "hub.sql").read_bytes())


def set_planner(connection: psycopg.Connection[Any], *, on: bool) -> str | None:
    """Set the planner's settings of the database, or remove them; return the statement if this role may not."""
    database = sql.Identifier(connection.info.dbname)
    form = "ALTER DATABASE {} SET {} = on" if on else "ALTER DATABASE {} RESET {}"
    statements = [sql.SQL(form).format(database, sql.Identifier(name)) for name in _SETTINGS]
    try:
        with connection.transaction():
            for statement in statements:
                connection.execute(statement)
    except psycopg.errors.InsufficientPrivilege:
        return "; ".join(statement.as_string(connection) for statement in statements)
    return None


def drop_hub(connection: psycopg.Connection[Any]) -> None:
    """Drop the schemas of a hub that has no server any more; its extensions stay.

    Raises
    ------
    UserError
        If they contain objects of users.
    """
    try:
        connection.execute("DROP TABLE tunnel_hub.server")
        connection.execute(
            "DROP FUNCTION tunnel_hub_internal.warn_away(text), tunnel_hub_internal.warn_lacking(text, text),"
            " tunnel_hub_internal.copy_comments(text)"
        )
        connection.execute(sql.SQL("DROP SCHEMA {}, {}").format(sql.Identifier(HUB), sql.Identifier(INTERNAL)))
    except psycopg.errors.DependentObjectsStillExist as error:
        detail = (error.diag.message_detail or "").splitlines()
        raise UserError(f"{first_line(error)}: {detail[0] if detail else ''}; drop it first") from None
