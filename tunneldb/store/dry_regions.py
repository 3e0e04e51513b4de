"""Dry regions drawn by inspectors, and the leaks that each removed."""

from __future__ import annotations

import datetime as dt
import math
from dataclasses import dataclass, fields
from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import class_row

from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class DryRegion:
    """A dry region, as tunnel_api.dry_region has it; lengths in m, areas in m².

    ``leak_ids`` are the open leaks with at least half of their area in it: they are kept, but not counted. A region with
    ``pending_approval`` removes nothing yet; ``approved_by`` is the operator who approved it.
    """

    id: int
    label_from: str
    label_to: str
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    area: float
    area_limit: float
    reason: str | None
    drawn_by: str | None
    drawn_at: dt.datetime | None
    pending_approval: bool
    approved_by: str | None
    approved_at: dt.datetime | None
    leaks: int
    leaks_area: float
    leak_ids: list[int] | None


_REGIONS = sql.SQL(
    "SELECT {} FROM tunnel_api.dry_region WHERE survey_id = %s AND chainage_to > %s AND chainage_from < %s"
    " ORDER BY chainage_from, id"
).format(sql.SQL(", ").join(sql.Identifier(field.name) for field in fields(DryRegion)))


def read_dry_regions(
    conn: psycopg.Connection[Any], survey: Survey, low: float = -math.inf, high: float = math.inf
) -> list[DryRegion]:
    """Read the dry regions that reach between two chainages, m."""
    with conn.cursor(row_factory=class_row(DryRegion)) as cursor:
        return cursor.execute(_REGIONS, [survey.id, low, high]).fetchall()
