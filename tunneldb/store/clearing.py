"""Delete the results of a kilometre without points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, LiteralString

import psycopg
from psycopg import sql

from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class Work:
    """Manual edits of the results of kilometres.

    Attributes
    ----------
    anomalies : int
        Leaks and other dry dark areas there, as detected.
    reviewed : int
        Number of these with a review.
    edited : int
        Vertices of the axis that somebody has moved.
    drawn : int
        Drawn, redrawn, split or merged findings there, and those merged into them: these stay.
    """

    anomalies: int
    reviewed: int
    edited: int
    drawn: int = 0


def work_in(conn: psycopg.Connection[Any], survey: Survey, kms: list[int]) -> Work:
    """Count the manual edits that would be lost with the results of kilometres."""
    row = conn.execute(
        """
        SELECT count(*) FILTER (WHERE NOT q.drawn), count(*) FILTER (WHERE NOT q.drawn AND q.reviewed),
               (SELECT count(*) FROM tunnel.axis_vertex v WHERE v.survey_id = %(survey)s AND v.km = ANY (%(kms)s)
                   AND v.edited_at IS NOT NULL),
               count(*) FILTER (WHERE q.drawn)
          FROM (SELECT l.origin <> 'detected' OR l.merged_into IS NOT NULL AS drawn,
                       l.review <> 'open' OR l.kind_override IS NOT NULL AS reviewed
                  FROM tunnel.finding l WHERE l.survey_id = %(survey)s AND l.km = ANY (%(kms)s)) q
        """,
        {"survey": survey.id, "kms": kms},
    ).fetchone()
    assert row is not None
    return Work(*row)


def has_results(conn: psycopg.Connection[Any], survey: Survey, km: int) -> bool:
    """Return True if a stage after ``load`` was tried in a kilometre, so that there may be results."""
    row = conn.execute(
        "SELECT FROM tunnel.run WHERE survey_id = %s AND km = %s AND stage <> 'load' LIMIT 1", [survey.id, km]
    ).fetchone()
    return row is not None


_ONLY: dict[str, LiteralString] = {
    "finding": " AND origin = 'detected' AND merged_into IS NULL",
    "image": " AND kind !~ '^(overview_)?imported_'",
}
"""Tables of which only some rows are results of a stage, and their condition."""


def clear_kilometre(conn: psycopg.Connection[Any], survey: Survey, km: int) -> Work:
    """Delete the results and runs of all stages after ``load`` in a kilometre, and its requests of a batch.

    The ledger keeps that points were loaded and are gone, which makes the neighbours' results stale. Findings that people drew
    and images of other instruments stay, and manual edits stay in the audit.
    """
    lost = work_in(conn, survey, [km])
    tables = conn.execute(
        "SELECT t.name FROM tunnel.stage s CROSS JOIN unnest(s.tables) WITH ORDINALITY AS t (name, n)"
        " ORDER BY s.step DESC, t.n DESC"
    ).fetchall()
    for (table,) in tables:
        detected = sql.SQL(_ONLY.get(table, ""))
        query = sql.SQL("DELETE FROM {} WHERE survey_id = %s AND km = %s{}").format(sql.Identifier("tunnel", table), detected)
        conn.execute(query, [survey.id, km])
    conn.execute("DELETE FROM tunnel.run WHERE survey_id = %s AND km = %s AND stage <> 'load'", [survey.id, km])
    conn.execute(
        "DELETE FROM tunnel.goal g WHERE g.survey_id = %(survey)s AND g.km = %(km)s AND NOT EXISTS ("
        "SELECT FROM tunnel.incoming i WHERE i.survey_id = g.survey_id AND g.km BETWEEN i.km_from AND i.km_to)",
        {"survey": survey.id, "km": km},
    )
    return lost
