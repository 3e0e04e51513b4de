"""A tunnel's design alignment in the database, and how far the axis as measured lies from it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import psycopg

from tunneldb.alignment.design import Design
from tunneldb.alignment.deviation import Deviation, Part
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import Equation
from tunneldb.store.stationing import load_stationing, save_equations
from tunneldb.store.survey import Survey


def save_design(connection: psycopg.Connection[Any], tunnel_id: int, design: Design) -> None:
    """Store the elements of a design alignment, and its stationing where it has its own."""
    plan = [
        (tunnel_id, n, e.kind, design.start + distance, e.length, e.x, e.y, e.bearing, e.curvature_from, e.curvature_to)
        for n, (e, distance) in enumerate(zip(design.plan, design.distances.tolist(), strict=False), start=1)
    ]
    profile = [
        (tunnel_id, n, e.kind, design.start + e.distance, e.length, e.z, e.grade_from, e.grade_to)
        for n, e in enumerate(design.profile, start=1)
    ]
    with connection.cursor() as cursor:
        cursor.executemany(
            """
            INSERT INTO tunnel.alignment_element
                   (tunnel_id, plane, n, kind, chainage, length, x, y, bearing, curvature_from, curvature_to)
            VALUES (%s, 'horizontal', %s, %s, %s, %s, %s, %s, %s, %s, %s)
            """,
            plan,
        )
        cursor.executemany(
            """
            INSERT INTO tunnel.alignment_element (tunnel_id, plane, n, kind, chainage, length, z, grade_from, grade_to)
            VALUES (%s, 'vertical', %s, %s, %s, %s, %s, %s, %s)
            """,
            profile,
        )
    if design.pieces:
        pieces = [Equation(design.start + piece.distance, piece.station, piece.direction) for piece in design.pieces]
        row = connection.execute(  # of the line that is kept, a little shorter than its curves
            "SELECT start_chainage + ST_Length(alignment) FROM tunnel.tunnel WHERE id = %s", [tunnel_id]
        ).fetchone()
        assert row is not None
        (end,) = row
        save_equations(connection, tunnel_id, [piece for piece in pieces if piece.chainage < end])


def load_deviation(
    connection: psycopg.Connection[Any], survey: Survey, low: float = -math.inf, high: float = math.inf
) -> Deviation:
    """Return how far a survey's axis lies from the axis given, between two chainages (m).

    Raises
    ------
    UserError
        When the survey has no axis there.
    """
    rows = connection.execute(
        """
        SELECT d.chainage, d.label, d.source, d.to_right, d.up, ST_X(d.geom), ST_Y(d.geom), ST_Z(d.geom)
          FROM tunnel_api.axis_deviation d
         WHERE d.survey_id = %s AND d.chainage BETWEEN %s AND %s ORDER BY d.chainage
        """,
        [survey.id, low, high],
    ).fetchall()
    if not rows:
        raise UserError(f"survey {survey.name} has no axis there: tunneldb run {survey.name} --to axis")
    elements = connection.execute(
        """
        SELECT plane, kind, turn, chainage_from, chainage_to, label_from, label_to, radius_from, radius_to, grade_from, grade_to
          FROM tunnel_api.alignment_element WHERE tunnel_id = %s ORDER BY id
        """,
        [survey.tunnel_id],
    ).fetchall()
    found = connection.execute("SELECT design FROM tunnel_api.tunnel WHERE id = %s", [survey.tunnel_id]).fetchone()
    assert found is not None
    numbers = np.array([(row[0], *row[3:]) for row in rows])
    return Deviation(
        survey=survey.name,
        design=found[0],
        chainage=numbers[:, 0],
        label=tuple(row[1] for row in rows),
        source=tuple(row[2] for row in rows),
        to_right=numbers[:, 1],
        up=numbers[:, 2],
        vertices=numbers[:, 3:],
        elements=tuple(Part(*row) for row in elements),
        stationing=load_stationing(connection, survey.tunnel_id),
    )
