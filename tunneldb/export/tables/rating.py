"""Ratings of elements as sheets of a workbook: results, facts of the elements, and the scheme."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import psycopg
from psycopg.rows import dict_row

from tunneldb.export.tables.workbook import Column, Sheet, write_workbook
from tunneldb.store.rating import rate, scheme_rules

_METRES, _WHOLE, _SHARE = "0.000", "0", "0.0 %"

_RATING = (
    (Column("No.", _WHOLE), "number"), (Column("Element"), "name"), (Column("Chainage from, m", _METRES), "chainage_from"),
    (Column("Chainage to, m", _METRES), "chainage_to"), (Column("Clock from, h", "0.0"), "clock_from"),
    (Column("Clock to, h", "0.0"), "clock_to"), (Column("Result"), "result"), (Column("Level, 1 is the best", _WHOLE), "level"),
    (Column("Lower bound"), "lower_bound"), (Column("Inspected", _SHARE), "inspected_share"),
    (Column("Findings", _WHOLE), "findings"), (Column("Rule", _WHOLE), "rule"), (Column("Measure"), "measure"),
    (Column("Value", "0.0000"), "value"), (Column("Limit"), "limit_reached"), (Column("Finding No.", _WHOLE), "finding_id"),
    (Column("Why"), "why"), (Column("Remark"), "remark"),
)  # fmt: skip
_ELEMENT = (
    (Column("No.", _WHOLE), "number"), (Column("Element"), "name"), (Column("Lining, m²", "0.00"), "lining_area"),
    (Column("Inspected", _SHARE), "inspected_share"), (Column("Findings", _WHOLE), "findings"),
    (Column("Leaks", _WHOLE), "leaks"), (Column("Wet area, m²", "0.0000"), "wet_area"),
    (Column("Wet share", "0.00 %"), "wet_share"), (Column("Largest leak, m²", "0.0000"), "largest_leak"),
    (Column("Length of cracks, m", _METRES), "crack_length"), (Column("Widest crack, mm", "0.00"), "crack_width_mm"),
    (Column("Worst severity", _WHOLE), "worst_severity"),
)  # fmt: skip

NOT_RATED = "not rated"
"""Result of an element that was not inspected."""


def rating_sheets(
    conn: psycopg.Connection[Any],
    survey: str,
    elements: str,
    scheme: str,
    version: str | None,
    low: float = -math.inf,
    high: float = math.inf,
) -> list[Sheet]:
    """Return the sheets Rating, Elements and Scheme, of the elements that touch a stretch, m.

    Raises
    ------
    UserError
        If there is no such scheme, or the tunnel has no such elements.
    """
    found, rules = scheme_rules(conn, scheme, version)
    rated = rate(conn, survey, elements, found["name"], found["version"])
    rows = [row for row in rated if row["chainage_to"] > low and row["chainage_from"] < high]
    inside = {row["number"] for row in rows}
    facts = conn.cursor(row_factory=dict_row).execute(
        "SELECT f.number, f.name, f.lining_area, f.inspected_share, f.findings, f.leaks, f.wet_area, f.wet_share,"
        " f.largest_leak, f.crack_length, f.crack_width_mm, f.worst_severity"
        " FROM tunnel_api.element_findings(%s, %s) f ORDER BY f.number",
        [survey, elements],
    ).fetchall()  # fmt: skip
    return [
        Sheet("Rating", [column for column, _ in _RATING], [_rating_cells(row) for row in rows]),
        Sheet(
            "Elements",
            [column for column, _ in _ELEMENT],
            [[row[name] for _, name in _ELEMENT] for row in facts if row["number"] in inside],
        ),
        _scheme_sheet(survey, elements, found, rules),
    ]


def write_rating(path: Path, conn: psycopg.Connection[Any], survey: str, elements: str, scheme: str, version: str) -> None:
    """Write the rating of the elements of a survey as a workbook."""
    write_workbook(path, rating_sheets(conn, survey, elements, scheme, version), f"{survey}: {scheme} {version}")


def _rating_cells(row: dict[str, Any]) -> list[Any]:
    unrated = row["result"] is None
    values = row | {"result": NOT_RATED if unrated else row["result"], "lower_bound": not unrated and not row["complete"]}
    return [values[name] for _, name in _RATING]


def _scheme_sheet(survey: str, elements: str, scheme: dict[str, Any], rules: Sequence[dict[str, Any]]) -> Sheet:
    """Return the sheet of scheme and rules, a row for each."""
    head = [
        ("Survey", survey), ("Elements", elements), ("Scheme", scheme["name"]), ("Version", scheme["version"]),
        ("Source", scheme["source"]), ("Valid from", scheme["valid_from"]),
        ("Results, from the best to the worst", ", ".join(scheme["results"])),
        ("Inspected share below which a result is a lower bound", scheme["min_inspected"]),
    ]  # fmt: skip
    return Sheet(
        "Scheme",
        [Column("What"), Column("Value")],
        [*map(list, head), *([f"Rule {rule['number']}", rule["text"]] for rule in rules)],
    )
