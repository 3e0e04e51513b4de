"""CPU time of a backend for each view of tunnel_api, asked for one survey."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psycopg
from psycopg import sql

Connection = psycopg.Connection[Any]

REPEATS = 5
LONG_MS = 2000.0
"""Queries are asked again until they have taken so long, ms, or REPEATS times."""

EXPLAIN = sql.SQL("EXPLAIN (ANALYZE, TIMING OFF, SUMMARY OFF, FORMAT JSON) ")
LEAST_MS = 1.0
"""Times below this are told as they are, and not held against each other: they are those of starting a query, ms."""

LATER = "demo-2026"
"""The survey that was compared with the sample; views of changes speak of it."""


@dataclass(frozen=True)
class Asked:
    """A query on a view, and what it took.

    Attributes
    ----------
    name : str
        The view, and by what the survey is named.
    rows : int
    first, again : float
        CPU time of the backend, ms: as the first query of a session, and the least of those after it.
    """

    name: str
    rows: int
    first: float
    again: float


def queries(connection: Connection, survey: str) -> dict[str, sql.Composed]:
    """Return the queries: each view for the survey by its name, and by its key where it has both."""
    views = connection.execute(
        "SELECT c.relname, array_agg(a.attname::text) FROM pg_class c JOIN pg_attribute a ON a.attrelid = c.oid"
        " WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' AND a.attnum > 0"
        " GROUP BY c.relname ORDER BY c.relname"
    ).fetchall()
    found: dict[str, sql.Composed] = {}
    for view, columns in views:
        for title, condition in _conditions(connection, view, columns, survey):
            found[title] = sql.SQL("SELECT * FROM tunnel_api.{} {}").format(sql.Identifier(view), condition)
    found["points(survey, from, to)"] = sql.SQL("SELECT * FROM tunnel_api.points({}, 5000, 5100)").format(sql.Literal(survey))
    return found


def _conditions(connection: Connection, view: str, columns: list[str], survey: str) -> list[tuple[str, sql.Composable]]:
    name = LATER if {"old_survey", "old_survey_id"} & set(columns) else survey
    row = connection.execute("SELECT id FROM tunnel.survey WHERE name = %s", [name]).fetchone()
    assert row is not None
    key, text = sql.Literal(row[0]), sql.Literal(name)
    if view == "point":
        stretch = sql.SQL("AND km = 5 AND chainage BETWEEN 5000 AND 5100")
        named = sql.SQL("(SELECT id FROM tunnel_api.survey WHERE name = {})").format(text)
        return [
            ("point, by name", sql.SQL("WHERE survey_id = {} ").format(named) + stretch),
            ("point, by key", sql.SQL("WHERE survey_id = {} ").format(key) + stretch),
        ]
    by_name = [(f"{view}, by name", sql.SQL("WHERE survey = {}").format(text))] if "survey" in columns else []
    by_key = [(f"{view}, by key", sql.SQL("WHERE survey_id = {}").format(key))] if "survey_id" in columns else []
    if by_name or by_key:
        return [*by_name, *by_key]
    tunnel = sql.Literal(survey.partition("-")[0])
    if view in ("survey", "tunnel"):
        return [(f"{view}, by name", sql.SQL("WHERE name = {}").format(text if view == "survey" else tunnel))]
    if "tunnel" in columns:
        return [(f"{view}, by name", sql.SQL("WHERE tunnel = {}").format(tunnel))]
    return [(view, sql.SQL(""))]


def measure(dsn: str, query: sql.Composed) -> tuple[int, float, float]:
    """Return rows, and CPU time of the first query of a session and the least of those after it, ms."""
    took: list[float] = []
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute("SET max_parallel_workers_per_gather = 0; SET jit = off; SET statement_timeout = '120s'")
        watch = stopwatch(connection)
        while len(took) < 2 or (len(took) < REPEATS and sum(took) < LONG_MS):
            before = watch()
            plan = connection.execute(EXPLAIN + query).fetchone()
            took.append(1e3 * (watch() - before))
        assert plan is not None
    return int(plan[0][0]["Plan"]["Actual Rows"]), took[0], min(took[1:])


def stopwatch(connection: Connection) -> Callable[[], float]:
    """Return what tells the seconds that the connection's backend, a process of this machine, has run on a processor."""
    path = Path(f"/proc/{connection.info.backend_pid}/schedstat")
    return lambda: int(path.read_text().split()[0]) / 1e9


def ask_all(dsn: str, survey: str, only: str = "") -> list[Asked]:
    """Ask each view for the survey, or those whose names hold one of some words, parted by commas."""
    with psycopg.connect(dsn, autocommit=True) as connection:
        asked = queries(connection, survey)
    asked = {name: query for name, query in asked.items() if any(word in name for word in only.split(","))}
    found = []
    for name, query in asked.items():
        try:
            found.append(Asked(name, *measure(dsn, query)))
        except psycopg.errors.QueryCanceled:
            found.append(Asked(name, -1, float("inf"), float("inf")))
    return found
