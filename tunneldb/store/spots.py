"""Spots of structures, and the inspected share of the faces, for lists."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass, fields
from typing import Any, Literal

import psycopg
import shapely
from psycopg import sql
from shapely.geometry import Polygon

from tunneldb.counted import counted
from tunneldb.store.survey import Survey
from tunneldb.structures.results import LeftOut

Geometry = Literal["face", "map", "3d"]
"""Geometries: the face's own plane; the map; in space."""

Kind = Literal["dark", "bright", "all"]

_COLUMN = {"face": "outline", "map": "map", "3d": "surface"}


@dataclass(frozen=True)
class ListedSpot:
    """A spot as it is listed; see the columns of view ``spot``."""

    id: int
    number: int
    member: int | None
    member_kind: str | None
    face: int | None
    kind: str
    chainage: float | None
    label: str | None
    reasons: list[str]
    confidence: float
    contrast: float
    difference: float
    area: float
    points: int
    scans: int
    review: str
    reviewed_by: str | None
    reviewed_at: dt.datetime | None
    remark: str | None
    detected: bool
    counted: bool
    rgb: list[int] | None
    geometry: Polygon


COLUMNS = tuple(field.name for field in fields(ListedSpot) if field.name != "geometry")


@dataclass(frozen=True)
class SpotSelection:
    """Selection of spots.

    Attributes
    ----------
    kind : {'dark', 'bright', 'all'}
    min_area, min_confidence : float
        Minimum area, m², and minimum confidence of detection.
    stretch : (float, float) or None
        Limits of the chainage of middles, m, of faces and members likewise; None for all, including those without one.
    """

    kind: Kind = "all"
    min_area: float = 0.0
    min_confidence: float = 0.0
    stretch: tuple[float, float] | None = None


@dataclass(frozen=True)
class SpotList:
    """Spots of a survey.

    Attributes
    ----------
    rows : list of ListedSpot
        By member and number: those of the last run, and confirmed ones that it did not find.
    count : int
        Number included in totals: found last, and not rejected.
    area : float
        Area of these, m².
    face_area, seen_area : float
        Area of all faces, and inspected area, m².
    statement : str or None
        Gaps of the inspection and regions left out, if any.
    searched : bool
        True if members were found in the current files with the current settings.
    """

    rows: list[ListedSpot]
    count: int
    area: float
    face_area: float
    seen_area: float
    statement: str | None
    searched: bool

    @property
    def total(self) -> str:
        """Return number, total area, and inspected area."""
        if not self.rows and not self.seen_area:
            return "spots were not searched for"
        count = counted(self.count, "spot")
        return f"{count}, {self.area:.4f} m², on {self.seen_area:.1f} m² inspected of {self.face_area:.1f} m² of faces"


def read_spots(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "face", selection: SpotSelection | None = None
) -> SpotList:
    """Read the spots of a survey, and notes on the rest."""
    chosen = SpotSelection() if selection is None else selection
    query = sql.SQL(
        "SELECT {}, public.ST_AsBinary({}) FROM tunnel_api.spot WHERE survey_id = %(survey)s"
        " AND (detected OR review = 'confirmed') AND %(kind)s IN (kind, 'all') AND area >= %(min_area)s"
        " AND confidence >= %(min_confidence)s"
        " AND (%(low)s::float8 IS NULL OR chainage BETWEEN %(low)s AND %(high)s) ORDER BY member, number"
    ).format(sql.SQL(", ").join(map(sql.Identifier, COLUMNS)), sql.Identifier(_COLUMN[geometry]))
    low, high = chosen.stretch or (None, None)
    asked = {
        "survey": survey.id,
        "kind": chosen.kind,
        "min_area": chosen.min_area,
        "min_confidence": chosen.min_confidence,
        "low": low,
        "high": high,
    }
    rows = [
        ListedSpot(**dict(zip(COLUMNS, row[:-1], strict=True)), geometry=shapely.from_wkb(bytes(row[-1])))
        for row in conn.execute(query, asked).fetchall()
    ]
    counted = [row for row in rows if row.counted]
    face_area, seen_area, statement, searched = _coverage(conn, survey, low, high)
    return SpotList(rows, len(counted), sum(row.area for row in counted), face_area, seen_area, statement, searched)


def _coverage(
    conn: psycopg.Connection[Any], survey: Survey, low: float | None, high: float | None
) -> tuple[float, float, str | None, bool]:
    """Return area and inspected area of the faces, m², notes on the rest, and whether the search is up to date."""
    row = conn.execute(
        """
        SELECT a.area, a.seen, a.unplaced,
               r.current, r.left_out,
               (SELECT string_agg(m.number::text, ', ' ORDER BY m.number) FROM tunnel.member m
                 WHERE m.survey_id = s.id AND m.bimodal
                   AND (%(low)s::float8 IS NULL OR m.chainage BETWEEN %(low)s AND %(high)s))
          FROM tunnel.survey s
          LEFT JOIN LATERAL (
            SELECT r.parameters @> tunnel_internal.members_inputs(s.id) AS current, r.counts -> 'left_out' AS left_out
              FROM tunnel.run r
             WHERE r.survey_id = s.id AND r.stage = 'members' AND r.outcome = 'done' ORDER BY r.id DESC LIMIT 1) r ON true
         CROSS JOIN LATERAL (
            SELECT coalesce(sum(f.area) FILTER (WHERE t.inside), 0) AS area,
                   coalesce(sum(f.area * f.seen_share) FILTER (WHERE t.inside), 0) AS seen,
                   coalesce(sum(f.area) FILTER (WHERE t.inside IS NULL), 0) AS unplaced
              FROM tunnel.face f
             CROSS JOIN LATERAL (SELECT CASE WHEN %(low)s::float8 IS NULL THEN true
                                             ELSE f.chainage BETWEEN %(low)s AND %(high)s END AS inside) t
             WHERE f.survey_id = s.id) a
         WHERE s.id = %(survey)s
        """,
        {"survey": survey.id, "low": low, "high": high},
    ).fetchone()
    assert row is not None
    face_area, seen_area, unplaced, current, left_out, bimodal = row
    if current is None:
        return 0.0, 0.0, f"members have not been searched for: tunneldb members {survey.name}", False
    said = []
    if not current:
        said.append(f"files or settings have changed since members were found: tunneldb members {survey.name}")
    if seen_area < face_area:
        share = 1.0 - seen_area / face_area
        said.append(f"{100 * share:.0f} % of the faces ({face_area - seen_area:.1f} m²) could not be inspected")
    if unplaced:
        said.append(f"{unplaced:.1f} m² of faces have no chainage, and are not in the stretch")
    if left_out and (regions := LeftOut(**left_out).statement):  # of the whole survey: they have no place
        said.append(regions if low is None else f"in the whole survey {regions}")
    if bimodal:
        said.append(f"more than half of member {bimodal} differs: its own surface cannot be identified")
    return face_area, seen_area, "; ".join(said) or None, current
