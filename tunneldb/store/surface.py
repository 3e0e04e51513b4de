"""A survey's segments and sections, read from the database into arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg

from tunneldb.errors import NotReadyError
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.surface import Surface
from tunneldb.store.survey import Survey


def load_alignment(conn: psycopg.Connection[Any], survey: Survey, spacing: float | None = None) -> Alignment:
    """Load the given axis of a survey's tunnel, which is no site, with stations this far apart, m; None: its vertices."""
    alignment = alignment_of(conn, survey.tunnel_id, spacing)
    assert alignment is not None
    return alignment


def alignment_of(conn: psycopg.Connection[Any], tunnel_id: int, spacing: float | None = None) -> Alignment | None:
    """Load the given axis of a tunnel, with stations this far apart, m; None: its vertices. None for a site."""
    rows = conn.execute(
        "SELECT public.ST_X(d.geom), public.ST_Y(d.geom), public.ST_Z(d.geom), t.start_chainage, t.spacing"
        " FROM tunnel_api.tunnel t, public.ST_DumpPoints(t.geom) d WHERE t.id = %s ORDER BY d.path",
        [tunnel_id],
    ).fetchall()
    if not rows:
        return None
    return Alignment.from_polyline(np.array([row[:3] for row in rows]), rows[0][3], spacing or rows[0][4])


def load_surface(conn: psycopg.Connection[Any], survey: Survey, first: float = -np.inf, last: float = np.inf) -> Surface:
    """Load the surface of a survey between two chainages (m), with one spacing more on both sides; the whole by default.

    Raises
    ------
    UserError
        If the stages ``segments`` and ``sections`` have not run there.
    """
    low, high = first - survey.spacing, last + survey.spacing
    segments = conn.execute(
        "SELECT n, chainage_from, chainage_to, vertex_from || vertex_to || tangent_from || tangent_to FROM tunnel.segment"
        " WHERE survey_id = %s AND chainage_to >= %s AND chainage_from <= %s ORDER BY n",
        [survey.id, low, high],
    ).fetchall()
    sections = conn.execute(
        "SELECT chainage, radius, arc FROM tunnel.section"
        " WHERE survey_id = %s AND chainage BETWEEN %s AND %s ORDER BY chainage",
        [survey.id, low, high],
    ).fetchall()
    if not segments or not sections:
        raise NotReadyError(f"survey {survey.name} has no sections yet: tunneldb run {survey.name} --to sections")
    return Surface(
        number=np.array([row[0] for row in segments]),
        segments=np.array([row[3] for row in segments]),
        ends=np.array([row[1:3] for row in segments]),
        chainages=np.array([row[0] for row in sections]),
        radius=np.array([row[1] for row in sections]),
        arcs=np.array([row[2] for row in sections]),
        reach=survey.spacing,
    )


def survey_ends(conn: psycopg.Connection[Any], survey: Survey) -> tuple[float, float] | None:
    """Return the chainages of a survey's first and last point, within its segments, m; None without segments."""
    row = conn.execute("SELECT chainage_from, chainage_to FROM tunnel_api.survey_ends(%s)", [survey.id]).fetchone()
    return None if row is None or row[0] is None else (float(row[0]), float(row[1]))
