"""Findings of all kinds, detected and drawn, as reports and lists have them."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, fields
from typing import Any, Literal

import psycopg
import shapely
from psycopg import sql
from shapely.geometry.base import BaseGeometry

from tunneldb.store.survey import Survey

Geometry = Literal["unrolled", "map", "3d"]
"""Geometries: unrolled plane (chainage, arc); map strip beside the axis; on the surface in space."""

State = Literal["open", "confirmed", "rejected", "gone", "dry", "same", "merged"]
COUNTED: tuple[State, ...] = ("open", "confirmed")


@dataclass(frozen=True)
class Finding:
    """A finding; the attributes are the columns of the view ``finding``, which describes them.

    Lengths are in m, areas in m², darkening in dB, clock positions in hours, orientations in degrees, shares and
    confidence from 0 to 1.

    Attributes
    ----------
    id : int
        Number by which lists, sheets, reports and QGIS name it.
    share : float
        Share of it in the stretch that was asked for: sums include it by this share.
    geometry : geometry
        In the coordinates that were asked for.
    """

    id: int
    km: int
    label: str
    chainage_from: float
    chainage_to: float
    arc_from: float
    arc_to: float
    clock: float
    kind: str
    kind_label: str
    kind_detected: str | None
    reasons: list[str]
    origin: str
    severity: int | None
    severity_label: str | None
    area: float
    length: float | None
    width_mm: float | None
    orientation: float | None
    orientation_class: str | None
    darkening_mean: float | None
    darkening_max: float | None
    contrast: float | None
    image_share: float | None
    confidence: float | None
    other_images: str | None
    other_contrast: float | None
    review: str
    state: str
    detected: bool
    counted: bool
    also_detected: bool
    merged_into: int | None
    same_as: int | None
    parent_id: int | None
    dry_region_id: int | None
    drawn_by: str | None
    drawn_at: dt.datetime | None
    reviewed_by: str | None
    reviewed_at: dt.datetime | None
    remark: str | None
    photos: int
    easting: float
    northing: float
    height: float
    share: float
    geometry: BaseGeometry

    @property
    def middle(self) -> float:
        """Chainage of its middle, m."""
        return (self.chainage_from + self.chainage_to) / 2

    @property
    def confidence_in_kind(self) -> float | None:
        """Confidence in its kind; None if an inspector gave it another kind than detection."""
        return self.confidence if self.kind == self.kind_detected else None


COLUMNS = tuple(field.name for field in fields(Finding) if field.name not in ("share", "geometry"))
"""Columns of the view for a finding."""

GEOMETRY_COLUMN = {"unrolled": "unrolled", "map": "map", "3d": "surface"}


def finding_of(row: Sequence[Any]) -> Finding:
    """Return the finding of a row: COLUMNS, its share and its geometry as WKB."""
    names = (*COLUMNS, "share", "geometry")
    return Finding(**dict(zip(names, (*row[:-1], shapely.from_wkb(bytes(row[-1]))), strict=True)))


@dataclass(frozen=True)
class Chosen:
    """Selection of findings.

    Attributes
    ----------
    kinds, origins : sequence of str
        Kinds and origins; empty for all.
    states : sequence of str
        States; empty for all.
    low, high : float
        Limits of chainage, m; findings must reach between them.
    clock : (float, float) or None
        Limits of the hours of their middles, clockwise.
    min_area : float
        Minimum area, m².
    min_severity : int
        Minimum severity; 0 includes those without one.
    """

    kinds: Sequence[str] = ()
    origins: Sequence[str] = ()
    states: Sequence[str] = COUNTED
    low: float = -math.inf
    high: float = math.inf
    clock: tuple[float, float] | None = None
    min_area: float = 0.0
    min_severity: int = 0


# Of a polygon by its area, as sums of leaks have it; of a line by its length; a point lies in it or not.
_SHARE = sql.SQL(
    "CASE WHEN chainage_from >= %(low)s AND chainage_to <= %(high)s THEN 1"
    " WHEN public.ST_Dimension(unrolled) = 2 THEN tunnel_internal.area_between(unrolled, 1, %(low)s, %(high)s)"
    " WHEN public.ST_Dimension(unrolled) = 1 THEN public.ST_Length(public.ST_ClipByBox2D(unrolled, public.ST_MakeBox2D("
    "public.ST_MakePoint(greatest(%(low)s, -1e9), -1e4), public.ST_MakePoint(least(%(high)s, 1e9), 1e4))))"
    " / nullif(public.ST_Length(unrolled), 0) ELSE 1 END"
)


BLOCK = 20_000
"""Number of findings read at a time."""


def read_findings(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", chosen: Chosen | None = None
) -> list[Finding]:
    """Read findings of a survey, in order of chainage."""
    with closing(stream_findings(conn, survey, geometry, chosen)) as found:
        return list(found)


def stream_findings(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", chosen: Chosen | None = None
) -> Generator[Finding, None, None]:
    """Yield findings of a survey in order of chainage, BLOCK at a time, until the transaction ends or it is closed."""
    wanted = Chosen() if chosen is None else chosen
    query = sql.SQL(
        "SELECT {}, coalesce({}, 1), public.ST_AsBinary({}) FROM tunnel_api.finding WHERE survey_id = %(survey)s"
        " AND (%(kinds)s::text[] = '{{}}' OR kind = ANY (%(kinds)s))"
        " AND (%(origins)s::text[] = '{{}}' OR origin = ANY (%(origins)s))"
        " AND (%(states)s::text[] = '{{}}' OR state = ANY (%(states)s)) AND area >= %(min_area)s"
        " AND coalesce(severity, 0) >= %(min_severity)s AND chainage_to > %(low)s AND chainage_from < %(high)s"
        " AND (%(clock)s::float8[] IS NULL OR tunnel_api.clock_between(clock, (%(clock)s)[1], (%(clock)s)[2]))"
        " ORDER BY chainage_from + chainage_to, arc_from, id"
    ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS)), _SHARE, sql.Identifier(GEOMETRY_COLUMN[geometry]))
    values = {
        "survey": survey.id,
        "kinds": list(wanted.kinds),
        "origins": list(wanted.origins),
        "states": list(wanted.states),
        "low": wanted.low,
        "high": wanted.high,
        "clock": None if wanted.clock is None else list(wanted.clock),
        "min_area": wanted.min_area,
        "min_severity": wanted.min_severity,
    }
    with conn.transaction(), conn.cursor(name="findings") as cursor:
        cursor.execute(query, values)
        while rows := cursor.fetchmany(BLOCK):
            for row in rows:
                yield finding_of(row)
