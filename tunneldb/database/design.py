"""A tunnel's design alignment in the database."""

from __future__ import annotations

from typing import Any

import psycopg

from tunneldb.alignment.design import Design


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
        from tunneldb.database.stationing import save_equations
        from tunneldb.geometry.stationing import Equation

        pieces = [Equation(design.start + piece.distance, piece.station, piece.direction) for piece in design.pieces]
        save_equations(connection, tunnel_id, pieces)
