"""Waterproofing statistics of each kilometre (tunnel.waterproof), computed if missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import psycopg

from tunneldb.progress import StartProgress


def keep_missing(conn: psycopg.Connection[Any], begin: StartProgress) -> int:
    """Work out and keep the statistics of all kilometres that have none; each is committed by itself.

    Views are right without them, and slower. After an interruption the next call continues with the rest.

    Parameters
    ----------
    conn : Connection
        Idle; as the owner of schema `tunnel_api`.
    begin : callable
        Called with each survey that begins, and its number of kilometres.

    Returns
    -------
    int
        Number of kilometres that were worked out.
    """
    missing = conn.execute(
        "SELECT s.id, s.name, array_agg(u.km ORDER BY u.km) FROM tunnel.survey s"
        " CROSS JOIN LATERAL tunnel_internal.waterproof_unkept(s.id) AS u (km) GROUP BY s.id, s.name ORDER BY s.id"
    ).fetchall()
    conn.commit()
    done = 0
    for survey_id, name, kilometres in missing:
        done += _keep(conn, survey_id, kilometres, begin(f"waterproofing of {name}", len(kilometres)))
    return done


def _keep(conn: psycopg.Connection[Any], survey_id: int, kilometres: Sequence[int], advance: Callable[[float], None]) -> int:
    for done, km in enumerate(kilometres):
        try:
            conn.execute("SELECT tunnel_internal.keep_waterproof(%s, %s)", [survey_id, km])
            conn.commit()
        except psycopg.errors.ForeignKeyViolation:  # the survey was removed meanwhile
            conn.rollback()
            return done
        advance(1.0)
    return len(kilometres)
