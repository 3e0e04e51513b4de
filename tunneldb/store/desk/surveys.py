"""Surveys for the desk: their list, one with its places and kinds, and its ribbon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg

from tunneldb.store.desk.rows import named

MAP_ERROR = 1.0
"""Maximum deviation of a tunnel's line on the map of all tunnels, m."""


@dataclass(frozen=True)
class Place:
    """A survey of a tunnel.

    Attributes
    ----------
    id : int
    name, tunnel, date : str
    tunnel_id : int
    low, high : float or None
        Ends of its measured axis, chainage, m; None before there is one.
    """

    id: int
    name: str
    tunnel: str
    date: str
    tunnel_id: int
    low: float | None
    high: float | None


def list_surveys(conn: psycopg.Connection[Any]) -> list[dict[str, Any]]:
    """Return the surveys of tunnels with the number of their findings, the latest first."""
    rows = conn.execute(
        "SELECT s.id, s.name, s.tunnel, s.date::text AS date, e.chainage_from AS from, e.chainage_to AS to,"
        " coalesce(c.findings, 0) AS findings,"
        " coalesce(c.open, 0) AS open, coalesce(c.confirmed, 0) AS confirmed, coalesce(c.rejected, 0) AS rejected"
        " FROM tunnel_api.survey s JOIN tunnel_api.tunnel u ON u.id = s.tunnel_id AND NOT u.site"
        " CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e"
        " LEFT JOIN LATERAL (SELECT sum(f.counted)::bigint AS findings, sum(f.open)::bigint AS open,"
        " sum(f.confirmed)::bigint AS confirmed, sum(f.rejected)::bigint AS rejected FROM tunnel_api.finding_count f"
        " WHERE f.survey_id = s.id) c ON true ORDER BY s.date DESC, s.name"
    )
    return named(rows)


def statistics(conn: psycopg.Connection[Any], survey: Place) -> dict[str, Any]:
    """Return inspected share, class, number and area of the leaks of a whole survey; None where they are not known."""
    return named(
        conn.execute(
            "SELECT t.seen_share AS inspected_share, t.class, t.patches AS leaks, t.wet_area"
            " FROM (SELECT) one LEFT JOIN tunnel_api.leak_statistics(%s, '-infinity', 'infinity') t ON true",
            [survey.name],
        )
    )[0]


def tunnels(conn: psycopg.Connection[Any]) -> list[dict[str, Any]]:
    """Return the tunnels with their given axes in longitude and latitude, to MAP_ERROR; None for local coordinates."""
    rows = conn.execute(
        "SELECT t.name, CASE WHEN t.srid > 0 THEN public.ST_AsGeoJSON(public.ST_Transform("
        "public.ST_Simplify(public.ST_Force2D(t.geom), %s), 4326), 6)::json END AS axis"
        " FROM tunnel_api.tunnel t WHERE NOT t.site ORDER BY t.name",
        [MAP_ERROR],
    )
    return named(rows)


def find_survey(conn: psycopg.Connection[Any], name: str) -> Place | None:
    """Return the survey of a tunnel with a name; None if there is none."""
    row = conn.execute(
        "SELECT s.id, s.name, s.tunnel, s.date::text, s.tunnel_id, e.chainage_from, e.chainage_to FROM tunnel_api.survey s"
        " JOIN tunnel_api.tunnel u ON u.id = s.tunnel_id AND NOT u.site CROSS JOIN LATERAL tunnel_api.survey_ends(s.id) e"
        " WHERE s.name = %s",
        [name],
    ).fetchone()
    return None if row is None else Place(*row)


def arcs(conn: psycopg.Connection[Any], survey_id: int) -> tuple[float, float] | None:
    """Return the smallest and the greatest arc of a survey's sections, m; None without sections."""
    row = conn.execute(
        "SELECT min(u.arc_from), max(u.arc_to) FROM tunnel_api.section_unrolled u WHERE u.survey_id = %s", [survey_id]
    ).fetchone()
    return None if row is None or row[0] is None else (row[0], row[1])


def finding_kinds(conn: psycopg.Connection[Any]) -> list[dict[str, Any]]:
    """Return the kinds of findings in the order of lists."""
    return named(
        conn.execute(
            "SELECT k.code, k.label, k.wet, k.geometries, k.active FROM tunnel_api.finding_kind k ORDER BY k.position, k.code"
        )
    )


def severities(conn: psycopg.Connection[Any]) -> list[dict[str, Any]]:
    """Return the degrees of severity."""
    return named(conn.execute("SELECT v.id, v.label FROM tunnel_api.severity v ORDER BY v.id"))


def neighbours(conn: psycopg.Connection[Any], survey: Place) -> list[str]:
    """Return the names of the other surveys of a survey's tunnel, the latest first."""
    rows = conn.execute(
        "SELECT s.name FROM tunnel_api.survey s WHERE s.tunnel_id = %s AND s.id <> %s ORDER BY s.date DESC, s.name",
        [survey.tunnel_id, survey.id],
    )
    return [name for (name,) in rows]


def remarks(conn: psycopg.Connection[Any], survey_id: int) -> list[str]:
    """Return the notes and limitations of a survey's results."""
    return [said for (said,) in conn.execute("SELECT r.said FROM tunnel_api.remarks(%s) r", [survey_id])]


def statement(conn: psycopg.Connection[Any], survey_id: int) -> str | None:
    """Return the statement on where leaks could be missed; None if nothing is to be stated."""
    row = conn.execute("SELECT tunnel_api.coverage_statement(%s)", [survey_id]).fetchone()
    return None if row is None else row[0]


def ribbon(conn: psycopg.Connection[Any], survey: Place, bins: int) -> list[tuple[Any, ...]]:
    """Return the bins of a survey: inspected share, wet area, findings by kind, reviewed ones, probability, deviation.

    Deviation is layer, smallest and greatest value, m; None where it was not measured.
    """
    return conn.execute(
        "SELECT r.seen_share, r.wet_area, r.findings, r.reviewed, r.probability, r.layer, r.deviation_least,"
        " r.deviation_greatest FROM tunnel_api.ribbon(%s, %s, %s, %s) r",
        [survey.id, survey.low, survey.high, bins],
    ).fetchall()
