"""Leaks, joints and dry dark areas of a survey, with statements on the stretch, for lists."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import psycopg
from psycopg import sql

from tunneldb.finding_kind import DETECTED
from tunneldb.store.coverage import Coverage, read_coverage
from tunneldb.store.findings import COLUMNS, GEOMETRY_COLUMN, Finding, Geometry, finding_of
from tunneldb.store.remarks import Remark, read_remarks
from tunneldb.store.surface import survey_ends
from tunneldb.store.survey import Survey

Kind = Literal["leak", "joint", "dark", "all"]
"""Kinds to list: leaks, joints, dry dark areas, or all."""

_NAMES = {"leak": ("leak", "leaks"), "joint": ("joint", "joints"), "dark": ("dry dark area", "dry dark areas")}
"""Name of one, and of several."""


@dataclass(frozen=True)
class Selection:
    """Selection of leaks, joints and dry dark areas to read.

    Attributes
    ----------
    kind : {'leak', 'joint', 'dark', 'all'}
        Kind.
    low, high : float
        Only those that reach between these chainages, m.
    clock : (float, float) or None
        Limits of the hours of their middles, clockwise.
    min_area : float
        Smaller ones are left out, m².
    min_confidence : float
        Less certain ones are left out, 0 to 1; above 0 also those without a confidence.
    """

    kind: Kind = "leak"
    low: float = -math.inf
    high: float = math.inf
    clock: tuple[float, float] | None = None
    min_area: float = 0.0
    min_confidence: float = 0.0


@dataclass(frozen=True)
class LeakList:
    """Leaks, or other dark areas, of a survey.

    Attributes
    ----------
    kind : {'leak', 'joint', 'dark', 'all'}
        Kind.
    rows : list of Finding
        In order of chainage: those that the last detection found, and those that an inspector confirmed although it did not.
    sums : dict of str to (int, float)
        Number and area (m², within the stretch) included in totals, by leak (all wet kinds), joint and dark.
    coverage : Coverage
        Statement on the stretch.
    remarks : list of Remark
        Remarks on the results there.
    """

    kind: Kind
    rows: list[Finding]
    sums: dict[str, tuple[int, float]]
    coverage: Coverage
    remarks: list[Remark]

    @property
    def count(self) -> int:
        """Number included in totals: found last, and not rejected."""
        return sum(count for count, _ in self.sums.values())

    @property
    def area(self) -> float:
        """Area of these within the stretch, m²."""
        return sum(area for _, area in self.sums.values())

    @property
    def total(self) -> str:
        """Return number and total area, and other listed items; also if nothing was searched."""
        if not self.rows and not self.coverage.seen_area:
            return f"{_NAMES['leak' if self.kind == 'all' else self.kind][1]} were not searched for"
        others = {
            "rejected": sum(row.review == "rejected" for row in self.rows),
            "not found again": sum(row.review != "rejected" and not row.detected for row in self.rows),
        }
        besides = " and ".join(f"{count} {name}" for name, count in others.items() if count)
        sums = self.sums or {"leak" if self.kind == "all" else self.kind: (0, 0.0)}
        said = "; ".join(
            f"{count} {_NAMES.get(kind, (kind, kind))[count != 1]}, {area:.2f} m²" for kind, (count, area) in sums.items()
        )
        return said + (f"; also listed: {besides}" if besides else "")


_CHOSEN = sql.SQL(
    "FROM tunnel_api.finding f JOIN tunnel_api.finding_polygon p USING (id) WHERE f.survey_id = %(survey)s"
    " AND NOT superseded AND (wet OR coalesce(kind_detected, kind) = ANY (%(detected)s))"
    " AND (detected OR review = 'confirmed') AND area >= %(min_area)s"
    " AND (%(min_confidence)s = 0 OR kind = kind_detected AND confidence >= %(min_confidence)s)"
    " AND CASE %(kind)s WHEN 'all' THEN true WHEN 'leak' THEN wet ELSE kind = %(kind)s END"
    " AND chainage_to > %(low)s AND chainage_from < %(high)s"
    " AND (%(clock)s::float8[] IS NULL OR tunnel_api.clock_between(clock, (%(clock)s)[1], (%(clock)s)[2]))"
)


def read_leaks(
    conn: psycopg.Connection[Any], survey: Survey, geometry: Geometry = "unrolled", selection: Selection | None = None
) -> LeakList:
    """Read the leaks, or other dark areas, of a survey.

    Parameters
    ----------
    conn, survey
        Source.
    geometry : {'unrolled', 'map', '3d'}
        Coordinates.
    selection : Selection, optional
        Selection; else all leaks.
    """
    chosen = Selection() if selection is None else selection
    ends = survey_ends(conn, survey) or (-math.inf, math.inf)
    asked = {
        "survey": survey.id,
        "kind": chosen.kind,
        "detected": list(map(str, DETECTED)),
        "min_area": chosen.min_area,
        "min_confidence": chosen.min_confidence,
        "low": max(chosen.low, ends[0]),
        "high": min(chosen.high, ends[1]),
        "clock": None if chosen.clock is None else list(chosen.clock),
    }
    query = sql.SQL("SELECT {}, 1, public.ST_AsBinary(p.{}) {} ORDER BY chainage_from + chainage_to, arc_from, id").format(
        sql.SQL(", ").join(map(sql.Identifier, COLUMNS)), sql.Identifier(GEOMETRY_COLUMN[geometry]), _CHOSEN
    )
    rows = conn.execute(query, asked).fetchall()
    sums = sql.SQL(
        "SELECT CASE WHEN wet THEN 'leak' ELSE kind END, count(*),"
        " coalesce(sum(tunnel_internal.area_between(p.unrolled, area, %(low)s, %(high)s)), 0) {} AND counted"
        " GROUP BY 1 ORDER BY array_position('{{leak,joint,dark}}', CASE WHEN wet THEN 'leak' ELSE kind END), 1"
    )
    summed = conn.execute(sums.format(_CHOSEN), asked).fetchall()
    return LeakList(
        chosen.kind,
        [finding_of(row) for row in rows],
        sums={kind: (count, area) for kind, count, area in summed},
        coverage=read_coverage(conn, survey, chosen.low, chosen.high),
        remarks=read_remarks(conn, survey, chosen.low, chosen.high),
    )
