"""Findings for the desk: read, reviewed, drawn and undone through the views and functions of ``tunnel_api``."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import psycopg
from psycopg import sql

from tunneldb.store.desk import actions
from tunneldb.store.desk.photos import is_stored
from tunneldb.store.desk.rows import named

REVIEWED = ("review", "remark", "kind")
"""Columns that a review writes."""

ORDERS = {
    "likely": "probability DESC, chainage_from, id",
    "unlikely": "probability, chainage_from, id",
    "doubtful": "abs(probability - 0.5), chainage_from, id",
    "large": "area DESC, chainage_from, id",
    "chainage": "chainage_from, arc_from, id",
    "images": "other_contrast DESC NULLS LAST, chainage_from, id",
}
"""Orders of the work list, as in the QGIS plugin."""

MOST = 5000
"""Maximum length of a work list."""


def worklist(
    conn: psycopg.Connection[Any], survey_id: int, order: str, kinds: Sequence[str], low: float, high: float, min_area: float
) -> list[dict[str, Any]]:
    """Return the findings to review in a stretch, m, in an order of ORDERS; of all kinds if none is given."""
    rows = conn.execute(
        sql.SQL(
            "SELECT * FROM (SELECT f.id, f.kind, f.review, f.chainage_from, f.chainage_to, f.arc_from, f.arc_to,"
            " tunnel_api.leak_probability(f.kind_detected, f.confidence, f.wet) AS probability, f.area, f.other_contrast"
            " FROM tunnel_api.finding f WHERE f.survey_id = %s AND f.state IN ('open', 'confirmed', 'rejected', 'gone')"
            " AND f.chainage_to > %s AND f.chainage_from < %s AND f.area >= %s AND (%s OR f.kind = ANY(%s))) f"
            " ORDER BY {} LIMIT {}"
        ).format(sql.SQL(ORDERS[order]), MOST),
        [survey_id, low, high, min_area, not kinds, list(kinds)],
    )
    return named(rows)


def finding(conn: psycopg.Connection[Any], finding_id: int) -> dict[str, Any] | None:
    """Return a finding with its evidence, photos, actions and history; None if there is none."""
    with conn.pipeline():  # one round trip for all
        rows = conn.execute(
            "SELECT f.id, f.survey, f.label, f.clock, f.chainage_from, f.chainage_to, f.arc_from, f.arc_to, f.kind,"
            " f.kind_label, f.kind_detected, f.origin, f.state, f.review, f.severity, f.width_mm, f.remark, f.area, f.length,"
            " f.orientation, f.orientation_class, f.darkening_mean, f.darkening_max, f.contrast, f.confidence, f.other_images,"
            " f.reviewed_by,"
            " to_char(f.reviewed_at, 'YYYY-MM-DD HH24:MI') AS reviewed_at,"
            " f.drawn_by, public.ST_AsGeoJSON(f.unrolled, 4)::json AS outline FROM tunnel_api.finding f WHERE f.id = %s",
            [finding_id],
        )
        evidence = conn.execute(
            "SELECT e.words, e.log_odds FROM tunnel_api.finding_evidence e WHERE e.finding_id = %s AND abs(e.log_odds) >= 0.05"
            " ORDER BY abs(e.log_odds) DESC, e.words",
            [finding_id],
        )
        photos = conn.execute(
            "SELECT p.id, p.path, p.caption, p.added_by, to_char(p.added_at, 'YYYY-MM-DD HH24:MI') AS added_at"
            " FROM tunnel_api.finding_photo p WHERE p.finding_id = %s ORDER BY p.id",
            [finding_id],
        )
        history = conn.execute(
            "SELECT to_char(a.at, 'YYYY-MM-DD HH24:MI') AS at, a.who AS by, a.action, a.before, a.after FROM tunnel_api.audit a"
            " WHERE a.row_id = %s AND a.view = 'finding' ORDER BY a.id DESC LIMIT 50",
            [finding_id],
        )
        demanded = actions.read_of_finding(conn, finding_id)
    found = named(rows)
    if not found:
        return None
    shown = {"actions": named(demanded), "evidence": named(evidence), "history": named(history)}
    listed = [photo | {"stored": is_stored(photo["path"])} for photo in named(photos)]
    return {**found[0], **shown, "photos": listed}


def write_review(conn: psycopg.Connection[Any], finding_id: int, seen: Mapping[str, Any], values: Mapping[str, Any]) -> bool:
    """Write columns of REVIEWED if all of them are still as seen; return False if nothing was written.

    The view's trigger locks the row, and writes nothing where another person writes the same at the same moment.
    """
    changes = sql.SQL(", ").join(sql.SQL("{} = {}").format(sql.Identifier(name), sql.Placeholder(name)) for name in values)
    same = sql.SQL(" AND ").join(
        sql.SQL("f.{} IS NOT DISTINCT FROM {}").format(sql.Identifier(name), sql.Placeholder(f"seen_{name}"))
        for name in REVIEWED
    )
    row = conn.execute(
        sql.SQL(
            "WITH done AS (UPDATE tunnel_api.finding_unrolled f SET {} WHERE f.id = %(id)s AND {}"
            " RETURNING f.id, f.reviewed_at) SELECT d.id FROM done d WHERE d.reviewed_at >= statement_timestamp()"
        ).format(changes, same),
        {"id": finding_id, **values, **{f"seen_{name}": seen[name] for name in REVIEWED}},
    ).fetchone()
    return row is not None


def undo(conn: psycopg.Connection[Any], finding_id: int) -> str:
    """Undo the last change of a finding; return what it was."""
    return str(_value(conn, "SELECT tunnel_api.finding_undo(%s)", [finding_id]))


def draw(conn: psycopg.Connection[Any], survey: str, geometry: Any, values: Mapping[str, Any], *, again: bool = False) -> int:
    """Add a drawn finding, a GeoJSON geometry in the unrolled plane; return its id.

    Parameters
    ----------
    again : bool
        True to return the finding that the person has drawn with this outline before, if there is one.
    """
    outline = json.dumps(geometry)
    with conn.transaction():
        # The first request may still be under way: drawings of a person follow each other.
        conn.execute("SELECT pg_advisory_xact_lock(hashtextextended('drawing by ' || session_user, 0))")
        if again and (found := _drawn(conn, survey, outline)) is not None:
            return found
        return int(
            _value(
                conn,
                "INSERT INTO tunnel_api.finding_unrolled (survey, kind, severity, width_mm, remark, geom) VALUES"
                " (%s, %s, %s, %s, %s, public.ST_SetSRID(public.ST_GeomFromGeoJSON(%s), 0)) RETURNING id",
                [survey, values["kind"], values["severity"], values["width_mm"], values["remark"], outline],
            )
        )


def _drawn(conn: psycopg.Connection[Any], survey: str, outline: str) -> int | None:
    """Return the finding that the person has drawn with an outline, by the audit: also if it was changed or deleted since."""
    row = conn.execute(
        "SELECT a.row_id FROM tunnel_api.audit a WHERE a.survey = %s AND a.view = 'finding' AND a.action = 'insert'"
        " AND a.who = session_user AND a.undoes IS NULL AND a.imported_by IS NULL"
        " AND public.ST_Equals(public.ST_GeomFromEWKT(a.after ->> 'geom'),"
        " public.ST_SetSRID(public.ST_GeomFromGeoJSON(%s), 0)) ORDER BY a.id DESC LIMIT 1",
        [survey, outline],
    ).fetchone()
    return None if row is None else int(row[0])


def redraw(conn: psycopg.Connection[Any], finding_id: int, geometry: Any) -> bool:
    """Replace the outline of a finding; return False if there is none."""
    done = conn.execute(
        "UPDATE tunnel_api.finding_unrolled SET geom = public.ST_SetSRID(public.ST_GeomFromGeoJSON(%s), 0) WHERE id = %s",
        [json.dumps(geometry), finding_id],
    )
    return done.rowcount > 0


def split(conn: psycopg.Connection[Any], finding_id: int, line: Any) -> list[int]:
    """Split a finding by a GeoJSON line; return the ids of the parts."""
    parts = _value(
        conn,
        "SELECT tunnel_api.finding_split(%s, public.ST_SetSRID(public.ST_GeomFromGeoJSON(%s), 0))",
        [finding_id, json.dumps(line)],
    )
    return [int(part) for part in parts]


def merge(conn: psycopg.Connection[Any], ids: Sequence[int]) -> int:
    """Merge findings; return the id of the one that remains."""
    return int(_value(conn, "SELECT tunnel_api.finding_merge(%s::bigint[])", [list(ids)]))


def delete(conn: psycopg.Connection[Any], finding_id: int) -> bool:
    """Delete a drawn finding; return False if there is none."""
    return conn.execute("DELETE FROM tunnel_api.finding_unrolled WHERE id = %s", [finding_id]).rowcount > 0


def finding_tile(
    conn: psycopg.Connection[Any], survey_id: int, bounds: tuple[float, float, float, float], outlines: bool
) -> bytes:
    """Return the findings between west, south, east and north, m, as a vector tile."""
    row = conn.execute(
        "SELECT tunnel_api.finding_tile(%s, %s, %s, %s, %s, %s)", [survey_id, *bounds, outlines], binary=True
    ).fetchone()
    return bytes(row[0]) if row is not None and row[0] is not None else b""


def _value(conn: psycopg.Connection[Any], query: str, parameters: Sequence[Any]) -> Any:
    row = conn.execute(query, parameters).fetchone()
    assert row is not None
    return row[0]
