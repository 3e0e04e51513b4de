"""Comparison with the last inspection of the tunnel, for the summary of a report: leaks, and elements by result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import psycopg

from tunneldb.measures.change.tables import change_rows, summary
from tunneldb.report.data import read_statistics
from tunneldb.report.rating import Rating, count_results, excess, rate_stretch
from tunneldb.store.survey import Survey, get_survey

Row = dict[str, Any]

LISTED_WORSE = 20
"""Number of listed elements that became worse, the worst ones."""


@dataclass(frozen=True)
class RatingChange:
    """Elements of a stretch by result in two surveys.

    Attributes
    ----------
    now : Rating
        The present rating.
    before : list of dict
        Rating of the same elements in the earlier survey.
    """

    now: Rating
    before: list[Row]

    @property
    def counts(self) -> list[tuple[str, int, int, int]]:
        """Each result with its level, and the number of elements then and now."""
        then = count_results(self.now.scheme, self.before)
        return [(result, level, old, new) for (result, level, old), (_, _, new) in zip(then, self.now.counts, strict=True)]

    @property
    def unrated(self) -> tuple[int, int]:
        """Number of elements that were not rated, then and now."""
        return sum(row["result"] is None for row in self.before), len(self.now.unrated)

    @property
    def partial(self) -> tuple[int, int]:
        """Number of elements whose result was a lower bound, then and now."""
        return sum(row["result"] is not None and not row["complete"] for row in self.before), len(self.now.partial)

    @property
    def states(self) -> dict[str, int]:
        """Number of elements that are worse, better, the same, or undecided."""
        states = dict.fromkeys(("worse", "better", "same", "undecided"), 0)
        for old, new in zip(self.before, self.now.rows, strict=True):
            states[compare_results(old, new)] += 1
        return states

    @property
    def worse(self) -> list[tuple[Row, Row]]:
        """Elements with a worse result than before, then and now, the worst first; also where one was a lower bound."""
        pairs = [
            (old, new)
            for old, new in zip(self.before, self.now.rows, strict=True)
            if old["level"] is not None and new["level"] is not None and new["level"] > old["level"]
        ]
        return sorted(pairs, key=lambda pair: (-pair[1]["level"], pair[0]["level"], -excess(pair[1]), pair[1]["number"]))


@dataclass(frozen=True)
class Since:
    """Comparison of a stretch with the last inspection.

    Attributes
    ----------
    old : Survey
        The earlier survey.
    then : dict
        Statistics of its leaks in the stretch.
    change : dict or None
        Sums of ``tunneldb compare``; None if the surveys were not compared.
    outdated : list of int
        Kilometres of the stretch whose comparison is missing or out of date; none without ``change``.
    ratings : list of RatingChange
        For each rating of the report.
    """

    old: Survey
    then: Row
    change: Row | None
    outdated: list[int]
    ratings: list[RatingChange]


def compare_results(old: Row, new: Row) -> str:
    """Return whether a result is worse, better or the same, or undecided, because one is missing or a lower bound."""
    before, after = old["level"], new["level"]
    if before is None or after is None:
        return "undecided"
    if old["complete"] and after > before:
        return "worse"
    if new["complete"] and after < before:
        return "better"
    return "same" if old["complete"] and new["complete"] else "undecided"


def read_since(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, ratings: Sequence[Rating]
) -> Since | None:
    """Compare a stretch, m, with the last inspection; None without an earlier survey that was searched for leaks there."""
    found = _last_inspection(conn, survey, low, high)
    if found is None:
        return None
    old, then = found
    change, outdated = _read_change(conn, old, survey, low, high)
    pairs = [RatingChange(one, rate_stretch(conn, old, one.elements, one.scheme, low, high)[0]) for one in ratings]
    return Since(old, then, change, outdated, pairs)


def _last_inspection(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float) -> tuple[Survey, Row] | None:
    """Return the last earlier survey that was searched for leaks in a stretch, and its statistics there.

    Of several with the same date, the one that inspected most. Copies from archives are not inspections.
    """
    rows = conn.execute(
        "SELECT s.date, s.name FROM tunnel.survey s WHERE s.tunnel_id = %s AND s.date < %s AND s.intensity_kind <> 'none'"
        " AND s.id NOT IN (SELECT c.survey_id FROM tunnel_internal.survey_copy c)"
        " AND EXISTS (SELECT FROM tunnel.coverage c WHERE c.survey_id = s.id AND c.km BETWEEN floor(%s / 1000)"
        " AND floor(%s / 1000)) ORDER BY s.date DESC, s.name",
        [survey.tunnel_id, survey.date, low, high],
    ).fetchall()
    for _, group in groupby(rows, key=lambda row: row[0]):
        surveys = [get_survey(conn, name) for _, name in group]
        stated = [(one, read_statistics(conn, one, [low], [high])[0]) for one in surveys]
        searched = [pair for pair in stated if pair[1]["searched_share"]]
        if searched:
            return max(searched, key=lambda pair: pair[1]["seen_area"])
    return None


def _read_change(
    conn: psycopg.Connection[Any], old: Survey, survey: Survey, low: float, high: float
) -> tuple[Row | None, list[int]]:
    """Return the sums of the comparison of a stretch, and its kilometres that are missing or out of date."""
    sections = change_rows(conn, "change_section", old, survey, low, high)
    if not sections:
        return None, []
    leaks = change_rows(conn, "leak_change", old, survey, low, high)
    states = conn.execute(
        "SELECT r.km FROM tunnel_internal.result_state(%(new)s, 'compare', %(old)s::text) r"
        " WHERE r.reason IS NOT NULL AND (r.km + 1) * 1000 > %(low)s AND r.km * 1000 < %(high)s"
        " AND (r.done_at IS NOT NULL OR NOT EXISTS (SELECT FROM tunnel.change_section c"
        " WHERE c.survey_id = %(new)s AND c.old_survey_id = %(old)s AND c.km = r.km)) ORDER BY r.km",
        {"new": survey.id, "old": old.id, "low": low, "high": high},
    ).fetchall()
    return summary(sections, [], leaks), [km for (km,) in states]
