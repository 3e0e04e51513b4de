"""Rows by the names of their columns."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg.rows import dict_row


def named(rows: psycopg.Cursor[Any]) -> list[dict[str, Any]]:
    """Return the rows of an executed query as dictionaries."""
    make = dict_row(rows)
    return [make(row) for row in rows.fetchall()]
