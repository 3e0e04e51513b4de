"""The catalogue of kinds and severities of findings, which the owner extends and words."""

from __future__ import annotations

from typing import Any

import psycopg


def read_kinds(conn: psycopg.Connection[Any]) -> list[str]:
    """Read the codes of all kinds, in the order of the catalogue."""
    return [code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind ORDER BY position, code")]


def read_wet_kinds(conn: psycopg.Connection[Any]) -> frozenset[str]:
    """Read the codes of the kinds that count as wet: the leaks of statistics and classes."""
    return frozenset(code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind WHERE wet"))


def read_severities(conn: psycopg.Connection[Any]) -> dict[int, str]:
    """Read the owner's words for the degrees of severity."""
    return dict(conn.execute("SELECT id, label FROM tunnel_api.severity ORDER BY id").fetchall())
