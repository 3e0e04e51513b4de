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
    area : float
        Area, m².
    recorded_by : str
    recorded_at : datetime
    """

    id: int
    source: str
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    area: float
    recorded_by: str
    recorded_at: dt.datetime


def add_crack_search(conn: psycopg.Connection[Any], survey: Survey, area: BaseGeometry, source: str) -> float:
    """Record that an area of the unrolled plane was searched for cracks, once; return its area on the lining, m².

    Raises
    ------
    psycopg.errors.InvalidParameterValue
        If it does not meet the lining.
    """
    query = "SELECT tunnel_api.crack_search_add(%s, public.ST_GeomFromWKB(%s), %s)"
    key = conn.execute(query, [survey.name, shapely.to_wkb(shapely.simplify(area, TOLERANCE)), source]).fetchone()
    assert key is not None
    found = conn.execute("SELECT area FROM tunnel_api.crack_search WHERE id = %s", key).fetchone()
    assert found is not None
    return float(found[0])


def read_crack_searches(conn: psycopg.Connection[Any], survey: Survey) -> list[CrackSearch]:
    """Return what was searched, by chainage."""
    names = sql.SQL(", ").join(sql.Identifier(field.name) for field in fields(CrackSearch))
    query = sql.SQL("SELECT {} FROM tunnel_api.crack_search WHERE survey_id = %s ORDER BY chainage_from, id").format(names)
    with conn.cursor(row_factory=class_row(CrackSearch)) as cursor:
        return cursor.execute(query, [survey.id]).fetchall()


def remove_crack_search(conn: psycopg.Connection[Any], key: int) -> None:
    """Remove a record; raise psycopg.errors.NoDataFound if there is none."""
    conn.execute("SELECT tunnel_api.crack_search_remove(%s)", [key])
