"""The chapter on actions: what this inspection and earlier ones demand, and the state of their leaks since."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import psycopg
from psycopg.rows import dict_row

from tunneldb.report.words import Words
from tunneldb.store.survey import Survey

_STATED = (
    "id", "finding_id", "element", "measure", "urgency", "responsible", "due", "cost", "currency", "state", "remark",
)  # fmt: skip
"""Columns that the digest includes."""

FOLLOW_UP = {
    re.compile(r"not compared"): "not compared",
    re.compile(r"dry since (?P<day>\S+)"): "dry since {day}",
    re.compile(r"not inspected on (?P<day>\S+)"): "not inspected on {day}",
    re.compile(r"(?P<state>\w+) on (?P<day>\S+): (?P<old>\S+) to (?P<new>\S+) m²"): "{state} on {day}: {old} to {new} m²",
}
"""Texts of the view's column follow_up, and the words for each."""


@dataclass(frozen=True)
class Actions:
    """Actions of a stretch.

    Attributes
    ----------
    rows : list of dict
        Rows of the view, overdue ones first, then by due date.
    states : mapping of str to int
        Number of actions by state.
    overdue : int
        Number of actions that are open or ordered after their due date.
    earlier : bool
        True if those of earlier surveys are included.
    """

    rows: list[dict[str, Any]]
    states: Mapping[str, int]
    overdue: int
    earlier: bool


def read_actions(conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, earlier: bool) -> Actions:
    """Read the actions of a survey that touch a stretch, m; with those of earlier surveys of the tunnel, if wanted."""
    rows = conn.cursor(row_factory=dict_row).execute(
        "SELECT a.id, a.survey, a.survey_id, a.label, a.finding_id, a.element, a.measure, a.urgency, a.responsible, a.due,"
        " coalesce(a.overdue, false) AS overdue, a.cost, a.currency, a.state, a.remark, a.follow_up"
        " FROM tunnel_api.action a JOIN tunnel_api.survey s ON s.id = a.survey_id JOIN tunnel_api.survey n ON n.id = %(id)s"
        " WHERE a.tunnel_id = %(tunnel)s AND a.chainage_to >= %(low)s AND a.chainage_from <= %(high)s"
        " AND (a.survey_id = %(id)s OR (%(earlier)s AND s.date < n.date))"
        " ORDER BY coalesce(a.overdue, false) DESC, a.due NULLS LAST, a.chainage_from, a.id",
        {"id": survey.id, "tunnel": survey.tunnel_id, "low": low, "high": high, "earlier": earlier},
    ).fetchall()  # fmt: skip
    return Actions(rows, Counter(row["state"] for row in rows), sum(row["overdue"] for row in rows), earlier)


def follow_up_text(words: Words, text: str | None) -> str:
    """Return a text of the view's column follow_up in the language of the report."""
    return "; ".join(_part(words, part) for part in (text or "").split("; ") if part)


def _part(words: Words, part: str) -> str:
    for pattern, template in FOLLOW_UP.items():
        if found := pattern.fullmatch(part):
            values = found.groupdict()
            if "state" in values:
                values["state"] = words(values["state"])
            return words(template, **values)
    return part


def digest_actions(digest: hashlib._Hash, found: Actions, survey: Survey) -> None:
    """Add the reported actions of the survey itself."""
    own = [row for row in found.rows if row["survey_id"] == survey.id]
    for row in sorted(own, key=lambda row: row["id"]):
        digest.update(repr([str(row[name]) for name in _STATED]).encode())
