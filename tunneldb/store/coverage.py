"""Search and inspection coverage of a survey, as stated in every document."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import psycopg
from psycopg import sql
from psycopg.rows import class_row

from tunneldb.store.survey import Survey

GAP_STATES = (
    "not scanned", "not loaded", "not searched", "failed", "interrupted", "stale", "unseen", "undecided", "no intensity",
)  # fmt: skip
"""States of a gap, by ``tunnel_api.coverage_gaps``."""


@dataclass(frozen=True)
class CoverageGap:
    """A stretch for which a list of leaks can't be vouched for.

    Attributes
    ----------
    chainage_from, chainage_to : float
        m.
    label_from, label_to : str
        The same in the tunnel's stationing.
    state : str
        not scanned, not loaded, not searched, failed, interrupted, stale, unseen, undecided or no intensity.
    reason : str
        Why.
    searched : bool
        True if there is a result of a search for leaks nevertheless.
    seen_share : float or None
        Share of the lining seen, 0 to 1, where that is little.
    """

    chainage_from: float
    chainage_to: float
    label_from: str
    label_to: str
    state: str
    reason: str
    searched: bool
    seen_share: float | None


@dataclass(frozen=True)
class Coverage:
    """Data for a statement on the leaks of a stretch.

    Attributes
    ----------
    gaps : list of CoverageGap
        Stretches in which leaks could be missed, those not searched first.
    statement : str or None
        The same in words; None where there is nothing to say.
    seen_area : float
        Lining seen, m².
    seen_share : float
        Inspected share of the lining of the whole stretch, 0 to 1; parts not searched count as not inspected.
    searched_share : float
        Share of the length that was searched for leaks, 0 to 1.
    """

    gaps: list[CoverageGap]
    statement: str | None
    seen_area: float
    seen_share: float
    searched_share: float

    @property
    def complete(self) -> bool:
        """True if all of it was searched, and anything was inspected."""
        return self.seen_area > 0 and all(gap.searched for gap in self.gaps)


_GAPS = sql.SQL(
    "SELECT {} FROM (SELECT g.*, tunnel_api.station_label(%(tunnel)s, g.chainage_from) AS label_from,"
    " tunnel_api.station_label(%(tunnel)s, g.chainage_to) AS label_to"
    " FROM tunnel_api.coverage_gaps(%(survey)s, %(low)s, %(high)s) WITH ORDINALITY g"
    "  (chainage_from, chainage_to, state, reason, searched, seen_share, n)) q ORDER BY n"
).format(sql.SQL(", ").join(sql.Identifier(field.name) for field in fields(CoverageGap)))


def read_coverage(conn: psycopg.Connection[Any], survey: Survey, low: float = -math.inf, high: float = math.inf) -> Coverage:
    """Read the data for a statement on the leaks between two chainages, m."""
    place = {"survey": survey.id, "tunnel": survey.tunnel_id, "name": survey.name, "low": low, "high": high}
    with conn.cursor(row_factory=class_row(CoverageGap)) as cursor:
        gaps = cursor.execute(_GAPS, place).fetchall()
    row = conn.execute(
        "SELECT tunnel_api.coverage_statement(%(survey)s, %(low)s, %(high)s), coalesce(t.seen_area, 0),"
        " coalesce(t.seen_share, 0), coalesce(t.searched_share, 0)"
        " FROM (SELECT) one LEFT JOIN tunnel_api.leak_statistics(%(name)s, %(low)s, %(high)s) t ON true",
        place,
    ).fetchone()
    assert row is not None
    return Coverage(gaps, *row)


def seen_share(conn: psycopg.Connection[Any], survey: Survey, km: int) -> float:
    """Return the share of a kilometre's lining that the last detection inspected, within the survey, 0 to 1."""
    row = conn.execute(
        "SELECT c.seen_share FROM tunnel_internal.km_ends k"
        " CROSS JOIN LATERAL tunnel_api.coverage(%s, k.chainage_from, k.chainage_to) c WHERE k.survey_id = %s AND k.km = %s",
        [survey.name, survey.id, km],
    ).fetchone()
    return 0.0 if row is None or row[0] is None else float(row[0])


def sum_leaks(conn: psycopg.Connection[Any], survey: Survey) -> tuple[int, float]:
    """Return number and area, m², of a survey's leaks that were found last and not rejected."""
    row = conn.execute(
        "SELECT coalesce(patches, 0), coalesce(wet_area, 0) FROM tunnel_api.leak_statistics(%s, '-infinity', 'infinity')",
        [survey.name],
    ).fetchone()
    return (0, 0.0) if row is None else (int(row[0]), float(row[1]))
