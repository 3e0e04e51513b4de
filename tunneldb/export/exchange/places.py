"""Names of places along a tunnel, and its coordinate system, for a file."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.arrays import Float
from tunneldb.database import Survey
from tunneldb.errors import UserError


def labels(conn: psycopg.Connection[Any], survey: Survey, chainages: Float) -> list[str]:
    """Stations at chainages (m) of a survey's tunnel, written 12+345.678."""
    rows = conn.execute(
        "SELECT tunnel_api.station_label(%s, c.chainage) FROM unnest(%s::float8[]) WITH ORDINALITY AS c (chainage, n)"
        " ORDER BY n",
        [survey.tunnel_id, chainages.tolist()],
    ).fetchall()
    return [row[0] for row in rows]


def crs_text(conn: psycopg.Connection[Any], srid: int) -> str:
    """A coordinate system of the database as other programs know it: AUTHORITY:CODE, or its definition.

    Raises
    ------
    UserError
        The SRID isn't in ``spatial_ref_sys``.
    """
    row = conn.execute("SELECT auth_name, auth_srid, srtext FROM spatial_ref_sys WHERE srid = %s", [srid]).fetchone()
    if row is None:
        raise UserError(f"SRID {srid} is not in the database's spatial_ref_sys; add its definition there")
    return f"{row[0]}:{row[1]}" if row[0] in ("EPSG", "ESRI") else str(row[2])
