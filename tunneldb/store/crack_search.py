"""Parts of the lining that were searched for cracks, from the view ``crack_search``."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass, fields
from typing import Any

import psycopg
import shapely
from psycopg import sql
from psycopg.rows import class_row
from shapely.geometry.base import BaseGeometry

from tunneldb.errors import UserError
from tunneldb.store.survey import Survey

TOLERANCE = 0.01
"""Maximum distance of a stored outline from the given one, m."""


@dataclass(frozen=True)
class CrackSearch:
    """Part of the lining that was searched for cracks.

    Attributes
    ----------
    id : int
    source : str
        What was searched.
    chainage_from, chainage_to, arc_from, arc_to : float
        Extent in the unrolled plane, m.
    recorded_by : str
    recorded_at : datetime
    """

    id: int
    source: str
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    recorded_by: str
    recorded_at: dt.datetime


def add_crack_search(conn: psycopg.Connection[Any], survey: Survey, area: BaseGeometry, source: str) -> CrackSearch:
    """Record that an area of the unrolled plane was searched for cracks, once; return what is recorded.

    Raises
    ------
    UserError
        If the area does not meet the lining, or the source is empty or too long.
    """
    query = "SELECT tunnel_api.crack_search_add(%s, public.ST_GeomFromWKB(%s), %s)"
    try:
        key = conn.execute(query, [survey.name, shapely.to_wkb(shapely.simplify(area, TOLERANCE)), source]).fetchone()
    except psycopg.DataError as error:
        hint = f"; {error.diag.message_hint}" if error.diag.message_hint else ""
        raise UserError(f"{error.diag.message_primary}{hint}") from None
    assert key is not None
    return next(one for one in read_crack_searches(conn, survey) if one.id == key[0])


def read_crack_searches(conn: psycopg.Connection[Any], survey: Survey) -> list[CrackSearch]:
    """Return what was searched, by chainage."""
    names = sql.SQL(", ").join(sql.Identifier(field.name) for field in fields(CrackSearch))
    query = sql.SQL("SELECT {} FROM tunnel_api.crack_search WHERE survey_id = %s ORDER BY chainage_from, id").format(names)
    with conn.cursor(row_factory=class_row(CrackSearch)) as cursor:
        return cursor.execute(query, [survey.id]).fetchall()


def remove_crack_search(conn: psycopg.Connection[Any], key: int) -> None:
    """Remove a record; raise psycopg.errors.NoDataFound if there is none."""
    conn.execute("SELECT tunnel_api.crack_search_remove(%s)", [key])
