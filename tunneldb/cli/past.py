"""The option ``--as-of``: a survey as it was at a moment."""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click
import psycopg

from tunneldb.cli.param_types import Moment
from tunneldb.database import as_of, connect

as_of_option = click.option(
    "--as-of", "moment", type=Moment(), metavar="MOMENT",
    help="The survey as it was on a day (2026-03-31, its end) or at a moment (2026-03-31T12:00).",
)  # fmt: skip


@contextmanager
def connect_as_of(dsn: str | None, survey: str, moment: dt.datetime | None) -> Iterator[psycopg.Connection[Any]]:
    """Connect to read; with a moment, this survey is as it was then.

    Raises
    ------
    UserError
        If the survey cannot be shown as it was.
    """
    with connect(dsn) as conn:
        if moment is None:
            yield conn
            return
        with as_of(conn, survey, moment):
            yield conn
