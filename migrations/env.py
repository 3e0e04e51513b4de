"""Alembic's environment: schemas `tunnel` and `tunnel_audit` only, on the connection that `tunneldb init` hands over."""

from __future__ import annotations

import re
from typing import Any

from alembic import context
from sqlalchemy import Connection, text

from tunneldb.database.models import AUDIT_SCHEMA, SCHEMA, Base

# Partitions and fragments come and go with surveys, files and kilometres; the models know only the partitions' parent.
PARTITION = re.compile(r"(point|image|fragment)_s\d+")


def include_name(name: str | None, kind: str, parents: Any) -> bool:
    """Leave other schemas and partitions and fragments out of comparisons."""
    if kind == "schema":
        return name in (SCHEMA, AUDIT_SCHEMA)
    return not (kind == "table" and name is not None and PARTITION.match(name))


def run(connection: Connection) -> None:
    """Migrate within the connection's transaction."""
    connection.execute(text(f"CREATE SCHEMA IF NOT EXISTS {SCHEMA}"))
    context.configure(
        connection=connection,
        target_metadata=Base.metadata,
        version_table="alembic_version",
        version_table_schema=SCHEMA,
        include_schemas=True,
        include_name=include_name,
        compare_server_default=True,
        transaction_per_migration=False,
    )
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    run(given)
else:  # the developer's `alembic revision`, on the database of TUNNELDB_DSN or the embedded server
    import os

    from tunneldb.database.connection import sqlalchemy_engine

    with sqlalchemy_engine(os.environ.get("TUNNELDB_DSN")).begin() as connection:
        run(connection)
