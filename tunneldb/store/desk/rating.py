"""Ratings of elements for the desk: divisions, schemes, results and their change, as the views of ``tunnel_api`` state them."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.store.desk.rows import named
from tunneldb.store.desk.surveys import Place


def element_sets(conn: psycopg.Connection[Any], survey: Place) -> list[dict[str, Any]]:
    """Return the divisions of a survey's tunnel, with their number of elements."""
    return named(
        conn.execute(
            "SELECT e.element_set AS name, e.source, count(*) AS elements FROM tunnel_api.element e WHERE e.tunnel_id = %s"
            " GROUP BY e.element_set, e.source ORDER BY e.element_set",
            [survey.tunnel_id],
        )
    )


def schemes(conn: psycopg.Connection[Any]) -> list[dict[str, Any]]:
    """Return the rating schemes with their versions, the one added last first."""
    return named(
        conn.execute(
            "SELECT r.name, r.version, r.source, r.valid_from::text AS valid_from, r.results, r.min_inspected"
            " FROM tunnel_api.rating_scheme r ORDER BY r.added_at DESC, r.id DESC"
        )
    )


def rating(conn: psycopg.Connection[Any], survey: Place, element_set: str, scheme: str, version: str) -> list[dict[str, Any]]:
    """Return the rating of each element; boxes are its rectangles: chainage and arc from, chainage and arc to, m."""
    return named(
        conn.execute(
            "SELECT r.element_id AS id, r.number, r.name, r.label, r.chainage_from, r.chainage_to, r.clock_from, r.clock_to,"
            " r.inspected_share, r.findings, r.result, r.level, r.complete, r.result_text, r.finding_id, r.why, r.remark,"
            " ARRAY(SELECT ARRAY[public.ST_XMin(d.geom), public.ST_YMin(d.geom), public.ST_XMax(d.geom),"
            " public.ST_YMax(d.geom)] FROM public.ST_Dump(r.geom) d) AS boxes"
            " FROM tunnel_api.rating_unrolled r WHERE r.survey = %s AND r.element_set = %s AND r.scheme = %s AND r.version = %s"
            " ORDER BY r.number",
            [survey.name, element_set, scheme, version],
        )
    )


def change(conn: psycopg.Connection[Any], survey: Place, element_set: str, scheme: str, version: str) -> list[dict[str, Any]]:
    """Return the change of each element's rating since the earlier inspection of the tunnel."""
    return named(
        conn.execute(
            "SELECT c.element_id AS id, c.earlier_survey, c.earlier_date::text AS earlier_date, c.earlier_result, c.change,"
            " c.known FROM tunnel_api.rating_change(%s, %s, %s, %s) c ORDER BY c.number",
            [survey.name, element_set, scheme, version],
        )
    )
