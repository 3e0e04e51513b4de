"""Tunnel of an archived survey: an existing one with the same name, if its axis is the same."""

from __future__ import annotations

from typing import Any

import psycopg
from psycopg import sql

from tunneldb.errors import UserError

_DESIGNS = {
    "station_equation": "station equations",
    "design_profile": "design profiles",
    "gauge": "outlines of clearance",
    "learned_model": "what was learned from reviews",
}


def existing_tunnel(conn: psycopg.Connection[Any], name: str) -> int | None:
    """Return the number of the tunnel with that name, None if there is none."""
    row = conn.execute("SELECT id FROM tunnel.tunnel WHERE name = %s FOR KEY SHARE", [name]).fetchone()
    return None if row is None else int(row[0])


def use_tunnel(conn: psycopg.Connection[Any], tunnel: int, name: str) -> list[str]:
    """Use the existing tunnel for the archive's; return their differences, which stay as they are here.

    Raises
    ------
    UserError
        If its given axis, SRID, first chainage or spacing is another: all chainages would be.
    """
    row = conn.execute(
        """
        SELECT (t.srid, t.start_chainage, t.spacing) = (a.srid, a.start_chainage, a.spacing)
               AND public.ST_AsEWKB(t.alignment) IS NOT DISTINCT FROM public.ST_AsEWKB(a.alignment)
          FROM tunnel.tunnel t CROSS JOIN pg_temp.archive_tunnel a WHERE t.id = %s
        """,
        [tunnel],
    ).fetchone()
    if row is None or not row[0]:
        raise UserError(
            f"there is a tunnel {name!r} with another axis, SRID or spacing, so that chainages of the archive would be"
            " wrong: import into another database; nothing was imported"
        )
    conn.execute(
        "CREATE TEMPORARY TABLE map_tunnel ON COMMIT DROP AS"
        " SELECT id::bigint AS old, %s::bigint AS new FROM pg_temp.archive_tunnel",
        [tunnel],
    )
    conn.execute(
        "CREATE TEMPORARY TABLE map_learned_model ON COMMIT DROP AS SELECT a.id::bigint AS old, min(m.id)::bigint AS new"
        " FROM pg_temp.archive_learned_model a JOIN tunnel.learned_model m ON m.tunnel_id = %s"
        " AND (m.base, m.way, m.parameters, m.applied_by, m.active_from)"
        " = (a.base, a.way, a.parameters, a.applied_by, a.active_from)"
        " GROUP BY a.id",
        [tunnel],
    )
    return [
        f"the tunnel {name} is there already and keeps its {said}, which differ from the archive's"
        for table, said in _DESIGNS.items()
        if _differ(conn, table, tunnel)
    ]


def _differ(conn: psycopg.Connection[Any], table: str, tunnel: int) -> bool:
    rows = sql.SQL("SELECT to_jsonb(x) - ARRAY['id', 'tunnel_id', 'added_at'] FROM {} x{}")
    held = rows.format(sql.Identifier("pg_temp", f"archive_{table}"), sql.SQL(""))
    there = rows.format(sql.Identifier("tunnel", table), sql.SQL(" WHERE x.tunnel_id = {}").format(sql.Literal(tunnel)))
    row = conn.execute(
        sql.SQL("SELECT EXISTS (({0}) EXCEPT ({1})) OR EXISTS (({1}) EXCEPT ({0}))").format(held, there)
    ).fetchone()
    return row is not None and bool(row[0])
