"""Station equations and design alignment of a tunnel in the database, and the deviation of the axis from the design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.alignment.design import Design
from tunneldb.alignment.deviation import Deviation, Part
from tunneldb.arrays import Float
from tunneldb.csvfile import read_csv
from tunneldb.errors import NotReadyError, UserError
from tunneldb.geometry.stationing import Equation, Stationing
from tunneldb.store.survey import Survey


def read_equations(path: Path) -> list[Equation]:
    """Read station equations from a CSV with chainage,station (m) and perhaps direction (1 or -1).

    Raises
    ------
    UserError
        If a file cannot be read or has no rows, chainages do not increase, or a direction is unknown; with the line.
    """
    table = read_csv(path, ("chainage", "station", "direction"), default={"direction": 1.0})
    if len(table) == 0:
        raise UserError(f"{path} has no row below its header; it needs one for each piece of the stationing")
    table.require_growing("chainage")
    for row, direction in enumerate(table["direction"]):
        if direction not in (1, -1):
            raise table.error(row, f"direction {direction:g} is neither 1 (stations grow with chainage) nor -1 (they run back)")
    return [Equation(chainage, station, int(direction)) for chainage, station, direction in table.values.tolist()]


def station_chainages(connection: psycopg.Connection[Any], tunnel_id: int, station: str) -> list[float]:
    """Return the chainages, m, of a station such as 12+345.678, in order: none, one or, if stations repeat, several.

    Raises
    ------
    ValueError
        If it is not written as a station.
    """
    try:
        with connection.transaction():
            rows = connection.execute(
                "SELECT chainage FROM tunnel_api.station_chainages(%s, %s) AS chainage ORDER BY 1", [tunnel_id, station]
            ).fetchall()
    except psycopg.errors.InvalidTextRepresentation:
        raise ValueError(f"{station!r} is no station") from None
    return [float(chainage) for (chainage,) in rows]


def save_equations(connection: psycopg.Connection[Any], tunnel_id: int, equations: Sequence[Equation]) -> None:
    """Replace a tunnel's station equations by these; without any its stations are its chainages.

    Raises
    ------
    UserError
        If numbers are not finite, chainages do not increase, a direction is not 1 or -1, or an equation is beyond the end of
        the tunnel.
    """
    for equation in equations:
        if not (math.isfinite(equation.chainage) and math.isfinite(equation.station)):
            raise UserError(f"station {equation.station:g} at chainage {equation.chainage:g}: both must be finite numbers")
        if equation.direction not in (1, -1):
            raise UserError(f"the direction of stations at chainage {equation.chainage:g} is 1 or -1, not {equation.direction}")
    for before, after in pairwise(equations):
        if after.chainage <= before.chainage:
            raise UserError(f"station equations in growing chainage: {after.chainage:.15g} m follows {before.chainage:.15g} m")
    _require_within(connection, tunnel_id, equations)
    connection.execute("DELETE FROM tunnel.station_equation WHERE tunnel_id = %s", [tunnel_id])
    with connection.cursor() as cursor:
        cursor.executemany(
            "INSERT INTO tunnel.station_equation (tunnel_id, chainage, station, direction) VALUES (%s, %s, %s, %s)",
            [(tunnel_id, *equation) for equation in equations],
        )


def _require_within(connection: psycopg.Connection[Any], tunnel_id: int, equations: Sequence[Equation]) -> None:
    """Refuse an equation beyond the end, probably a station instead of a chainage. One before the beginning is allowed."""
    row = connection.execute(
        "SELECT name, start_chainage, start_chainage + ST_Length(alignment) FROM tunnel.tunnel WHERE id = %s", [tunnel_id]
    ).fetchone()
    assert row is not None
    name, start, end = row
    if equations and equations[-1].chainage >= end:
        raise UserError(
            f"a station equation at chainage {equations[-1].chainage:.3f} m is beyond the end of tunnel {name!r}, which "
            f"reaches from {start:.3f} to {end:.3f} m; chainage is distance along the axis, not a station"
        )


def load_stationing(connection: psycopg.Connection[Any], tunnel_id: int) -> Stationing:
    """Return a tunnel's stationing."""
    rows = connection.execute(
        "SELECT chainage, station, direction FROM tunnel_api.station_equation WHERE tunnel_id = %s ORDER BY chainage",
        [tunnel_id],
    ).fetchall()
    return Stationing([Equation(*row) for row in rows])


def labels(conn: psycopg.Connection[Any], survey: Survey, chainages: Float) -> list[str]:
    """Return the stations at chainages (m) of a survey's tunnel, in the form 12+345.678."""
    rows = conn.execute(
        "SELECT tunnel_api.station_label(%s, c.chainage) FROM unnest(%s::float8[]) WITH ORDINALITY AS c (chainage, n)"
        " ORDER BY n",
        [survey.tunnel_id, chainages.tolist()],
    ).fetchall()
    return [row[0] for row in rows]


def save_design(connection: psycopg.Connection[Any], tunnel_id: int, design: Design) -> None:
    """Store the elements of a design alignment, and its stationing if it has one."""
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
    """Return the deviation of a survey's axis from the given axis, between two chainages (m).

    Raises
    ------
    UserError
        If the survey has no axis there.
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
        raise NotReadyError(f"survey {survey.name} has no axis there: tunneldb run {survey.name} --to axis")
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
