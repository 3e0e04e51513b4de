"""Rows with numbers that nothing can be computed with, which no view and no command writes."""

from __future__ import annotations

from typing import Any, NamedTuple

import psycopg

from tunneldb.database.connection import open_connection
from tunneldb.database.server import Server
from tunneldb.errors import UserError


class BrokenRow(NamedTuple):
    """Row of a table: name, fault, and the statement or the command that fixes it."""

    name: str
    fault: str
    remedy: str


def broken_rows(connection: psycopg.Connection[Any], survey_id: int | None = None) -> list[BrokenRow]:
    """Return the rows of a survey, or of all, with numbers that nothing can be computed with."""
    rows = connection.execute("SELECT name, fault, remedy FROM tunnel_internal.broken_rows(%s)", [survey_id])
    return [BrokenRow(*row) for row in rows]


def explain_by_broken_row(dsn: str | None) -> str | None:
    """Return one line on the first broken row of a database, as the cause of an error; None if there is none.

    Parameters
    ----------
    dsn : str or None
        Database; None for the embedded server.
    """
    if dsn is None and Server().state() != "running":
        return None
    try:
        with open_connection(dsn) as connection:
            rows = broken_rows(connection)
    except (UserError, psycopg.Error):
        return None
    return f"{rows[0].name}: {rows[0].fault}; type tunneldb check" if rows else None
