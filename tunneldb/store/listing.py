"""Rows that commands list: tunnels, surveys, sizes, counts of findings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import psycopg
from psycopg import sql

from tunneldb.errors import InputError
from tunneldb.store.survey import Survey

Rows = list[tuple[Any, ...]]


class Holdings(NamedTuple):
    """Numbers of what is lost with a survey."""

    points: int
    findings: int
    reviewed: int


def list_tunnels(conn: psycopg.Connection[Any]) -> Rows:
    """Return name, SRID, label of the start, length in m, spacing in m and number of surveys of each tunnel."""
    return conn.execute(
        """
        SELECT t.name, t.srid, tunnel_api.station_label(t.id, t.start_chainage), round(ST_Length(t.geom)::numeric, 1),
               t.spacing, count(s.id)
          FROM tunnel_api.tunnel t LEFT JOIN tunnel_api.survey s ON s.tunnel_id = t.id
         GROUP BY t.id, t.name, t.srid, t.start_chainage, t.geom, t.spacing ORDER BY t.name
        """
    ).fetchall()


def list_station_pieces(conn: psycopg.Connection[Any], tunnel_id: int) -> Rows:
    """Return chainages and labels of both ends, and the direction, of each piece of a tunnel's stationing."""
    return conn.execute(
        """
        SELECT to_char(p.chainage_from, 'FM999999990.000'), to_char(p.chainage_to, 'FM999999990.000'), p.label_from,
               p.label_to, CASE p.direction WHEN 1 THEN 'up' ELSE 'back' END
          FROM tunnel_api.station_pieces(%s) p
        """,
        [tunnel_id],
    ).fetchall()


def list_surveys(conn: psycopg.Connection[Any]) -> Rows:
    """Return name, tunnel, date, platform, intensity kind, files, points and labels of both ends of each survey."""
    return conn.execute(
        """
        SELECT name, tunnel, date, platform, intensity_kind, files, points,
               tunnel_api.station_label(tunnel_id, chainage_from), tunnel_api.station_label(tunnel_id, chainage_to)
          FROM tunnel_api.survey ORDER BY tunnel, date, name
        """
    ).fetchall()


def describe_survey(conn: psycopg.Connection[Any], name: str) -> Rows:
    """Return name, tunnel, date, files, points and labels of both ends of one survey, as one row; none if unknown."""
    return conn.execute(
        """
        SELECT name, tunnel, date, files, points, tunnel_api.station_label(tunnel_id, chainage_from),
               tunnel_api.station_label(tunnel_id, chainage_to)
          FROM tunnel_api.survey WHERE name = %s
        """,
        [name],
    ).fetchall()


def list_progress(conn: psycopg.Connection[Any], stages: Sequence[str], at_once: int) -> Rows:
    """Return what is loaded of each survey, its kilometres, and at how many of them each stage is done and up to date.

    Parameters
    ----------
    conn : Connection
    stages : sequence of str
        Names of the stages.
    at_once : int
        Number of surveys whose states are computed together.

    Returns
    -------
    list of tuple
        Name, tunnel, date, files, points, labels of both ends, number of kilometres, counts in the order of the stages.
    """
    return conn.execute(
        """
        SELECT s.name, s.tunnel, s.date, s.files, s.points, tunnel_api.station_label(s.tunnel_id, s.chainage_from),
               tunnel_api.station_label(s.tunnel_id, s.chainage_to), k.kilometres, k.done
          FROM tunnel_api.survey s
          LEFT JOIN (
               SELECT d.survey_id, max(d.there) AS kilometres, array_agg(d.done ORDER BY d.step) AS done
                 FROM (SELECT t.survey_id, t.step, count(*) AS there,
                              count(*) FILTER (WHERE t.outcome = 'done' AND t.reason IS NULL) AS done
                         FROM (SELECT array_agg(a.id) AS ids FROM tunnel_api.survey a GROUP BY a.id / %s) p
                        CROSS JOIN LATERAL tunnel_internal.stage_states(p.ids) t
                        WHERE t.stage = ANY (%s)
                        GROUP BY t.survey_id, t.step) d
                GROUP BY d.survey_id) k ON k.survey_id = s.id
         ORDER BY s.tunnel, s.date, s.name
        """,
        [at_once, list(stages)],
    ).fetchall()


def count_stale(conn: psycopg.Connection[Any], survey_id: int) -> int:
    """Return the number of stages of a survey that are stale."""
    row = conn.execute("SELECT count(*) FROM tunnel_api.stage_status WHERE survey_id = %s AND stale", [survey_id]).fetchone()
    assert row is not None
    return int(row[0])


def count_holdings(conn: psycopg.Connection[Any], survey_id: int) -> Holdings:
    """Return the numbers of points and findings of a survey, and of reviewed findings."""
    row = conn.execute(
        """
        SELECT (SELECT coalesce(sum(kept), 0) FROM tunnel.scan_file WHERE survey_id = %(id)s),
               (SELECT count(*) FROM tunnel.finding WHERE survey_id = %(id)s),
               (SELECT count(*) FROM tunnel.finding
                 WHERE survey_id = %(id)s AND (review <> 'open' OR kind_override IS NOT NULL))
        """,
        {"id": survey_id},
    ).fetchone()
    assert row is not None
    return Holdings(*row)


def list_sizes(conn: psycopg.Connection[Any], survey_id: int | None) -> tuple[Rows, int]:
    """Return survey, kind, rows, bytes and True if estimated, of one survey or of all; and the bytes of the database."""
    rows = conn.execute(
        "SELECT s.name, z.kind, z.rows, z.bytes, z.estimated FROM tunnel_api.survey_size z"
        " LEFT JOIN tunnel.survey s ON s.id = z.survey_id WHERE %(survey)s::int IS NULL OR z.survey_id = %(survey)s"
        " ORDER BY s.name NULLS LAST, z.id",
        {"survey": survey_id},
    ).fetchall()
    database = conn.execute("SELECT pg_database_size(current_database())").fetchone()
    assert database is not None
    return rows, int(database[0])


def list_leak_statistics(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, names: Sequence[str]
) -> tuple[Rows, Rows]:
    """Return statistics of the leaks of each kilometre of a stretch, and of the stretch, as one row.

    Parameters
    ----------
    conn : Connection
    survey : Survey
    low, high : float
        Chainages of the stretch, m.
    names : sequence of str
        Columns of ``tunnel_api.km_waterproof``; ``wet_per_mille`` is 1000 times its ``wet_ratio``.
    """
    columns = sql.SQL(", ").join(
        sql.SQL("1000 * t.wet_ratio") if name == "wet_per_mille" else sql.Identifier("t", name) for name in names
    )
    place = {"survey": survey.id, "name": survey.name, "low": low, "high": high}
    rows = conn.execute(
        sql.SQL(
            "SELECT t.km::text, {} FROM tunnel_api.km_waterproof t"
            " WHERE t.survey_id = %(survey)s AND t.chainage_to > %(low)s AND t.chainage_from < %(high)s ORDER BY t.km"
        ).format(columns),
        place,
    ).fetchall()
    whole = sql.SQL("SELECT 'all', {} FROM tunnel_api.leak_statistics(%(name)s, %(low)s, %(high)s) t").format(columns)
    return rows, conn.execute(whole, place).fetchall()


def list_finding_counts(conn: psycopg.Connection[Any], survey: Survey, kinds: Sequence[str], origins: Sequence[str]) -> Rows:
    """Return the numbers and the area of findings by kind and origin; no kinds or origins stand for all."""
    return conn.execute(
        "SELECT c.kind, c.origin, counted, open, confirmed, rejected, merged, same, dry, gone, to_measure, area"
        " FROM tunnel_api.finding_count c JOIN tunnel_api.finding_kind k ON k.code = c.kind"
        " WHERE survey_id = %s AND (%s::text[] = '{}' OR c.kind = ANY (%s)) AND (%s::text[] = '{}' OR c.origin = ANY (%s))"
        " ORDER BY k.position, c.kind, c.origin",
        [survey.id, list(kinds), list(kinds), list(origins), list(origins)],
    ).fetchall()


def require_finding_kinds(conn: psycopg.Connection[Any], kinds: Sequence[str]) -> None:
    """Raise InputError if one of the kinds is unknown."""
    if unknown := set(kinds) - {code for (code,) in conn.execute("SELECT code FROM tunnel_api.finding_kind")}:
        names = ", ".join(map(repr, sorted(unknown)))
        raise InputError(f"there is no kind {names} of findings: SELECT code FROM tunnel_api.finding_kind")
