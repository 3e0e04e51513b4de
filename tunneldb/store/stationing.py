"""A tunnel's station equations: from a file, to the database and back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.arrays import Float
from tunneldb.csvfile import read_csv
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import Equation, Stationing
from tunneldb.store.survey import Survey


def read_equations(path: Path) -> list[Equation]:
    """Read station equations from a CSV with chainage,station (m) and perhaps direction (1 or -1).

    Raises
    ------
    UserError
        For a file that cannot be read or has no rows, chainages that do not grow, or another direction; names the line.
    """
    table = read_csv(path, ("chainage", "station", "direction"), default={"direction": 1.0})
    if len(table) == 0:
        raise UserError(f"{path} has no row under its header; it needs one for each piece of the stationing")
    table.require_growing("chainage")
    for row, direction in enumerate(table["direction"]):
        if direction not in (1, -1):
            raise table.error(row, f"direction {direction:g} is neither 1 (stations grow with chainage) nor -1 (they run back)")
    return [Equation(chainage, station, int(direction)) for chainage, station, direction in table.values.tolist()]


def save_equations(connection: psycopg.Connection[Any], tunnel_id: int, equations: Sequence[Equation]) -> None:
    """Give a tunnel these station equations in place of those that it had; without any its stations are its chainages.

    Raises
    ------
    UserError
        For numbers that are not finite, chainages that do not grow, a direction other than 1 and -1, or an equation where
        the tunnel has ended.
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
    """An equation beyond the end is likely a station where a chainage should stand. Before the beginning one may lie."""
    row = connection.execute(
        "SELECT name, start_chainage, start_chainage + ST_Length(alignment) FROM tunnel.tunnel WHERE id = %s", [tunnel_id]
    ).fetchone()
    assert row is not None
    name, start, end = row
    if equations and equations[-1].chainage >= end:
        raise UserError(
            f"a station equation at chainage {equations[-1].chainage:.3f} m lies beyond the end of tunnel {name!r}, which "
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
    """Stations at chainages (m) of a survey's tunnel, written 12+345.678."""
    rows = conn.execute(
        "SELECT tunnel_api.station_label(%s, c.chainage) FROM unnest(%s::float8[]) WITH ORDINALITY AS c (chainage, n)"
        " ORDER BY n",
        [survey.tunnel_id, chainages.tolist()],
    ).fetchall()
    return [row[0] for row in rows]
