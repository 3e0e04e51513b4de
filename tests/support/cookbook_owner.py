"""Data for the questions of owners: a later inspection, a second rating scheme, actions, and edits of actions."""

from __future__ import annotations

import psycopg

from support.cookbook_survey import CONFIRMED, COPIED
from support.example_change import LATER
from support.example_survey import copy_rows

OF_OLD = "2024-05-05"
"""Day on which the survey was added, so that a query can go back to a day after it."""

WETTER_FROM, WETTER = 12450.0, 4.0
"""Chainage from which leaks have grown until the later inspection, m, and by which factor."""

STILL_WET = 12402.5
"""Middle of a leak that is still wet in the later survey though its action is done, m."""

COUNT_LIMIT = 1
"""Number of leaks in an element above which the second scheme rates it bad."""


def add_owner(conn: psycopg.Connection, survey: str, drawn: dict[str, int]) -> dict[str, int]:
    """Add it to the example survey with drawn findings; return the ids of the actions. The caller commits, or not."""
    conn.execute("UPDATE tunnel.survey SET created_at = %s WHERE name = %s", (OF_OLD, survey))
    _add_later_inspection(conn, survey)
    conn.execute(
        "WITH s AS (INSERT INTO tunnel.rating_scheme (name, version, source, results)"
        " VALUES ('count', '1', 'example of the tests', '{good,bad}') RETURNING id)"
        " INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results)"
        " SELECT s.id, 1, 'number of leaks', '{leak}', 'count', false, ARRAY[%s::float8], '{bad}' FROM s",
        (COUNT_LIMIT,),
    )
    (seal,) = conn.execute("SELECT id FROM tunnel.action").fetchone()  # type: ignore[misc]  # that of the example

    def demanded(place: float | int | tuple[float, float], **values: object) -> int:
        """Add an action for a leak at a chainage, a finding or a stretch."""
        if isinstance(place, float):
            row = conn.execute(
                "SELECT id FROM tunnel_api.finding WHERE survey = %s AND origin = 'detected' AND kind = 'leak'"
                " AND %s BETWEEN chainage_from AND chainage_to",
                (survey, place),
            ).fetchone()
            assert row is not None
            values["finding_id"] = row[0]
        elif isinstance(place, int):
            values["finding_id"] = place
        else:
            values["chainage_from"], values["chainage_to"] = place
        names, marks = ", ".join(values), ", ".join(["%s"] * len(values))
        row = conn.execute(
            f"INSERT INTO tunnel_api.action (survey, {names}) VALUES (%s, {marks}) RETURNING id".encode(),
            (survey, *values.values()),
        ).fetchone()
        assert row is not None
        return int(row[0])

    made = {
        "seal": int(seal),
        "late": demanded(
            CONFIRMED, measure="inject", urgency="urgent", due="2025-03-31", responsible="Works Ltd", cost=800, currency="EUR"
        ),
        "late but dry": demanded(CONFIRMED, measure="drain", due="2025-03-31", state="done"),
        "still wet": demanded(STILL_WET, measure="inject", due="2025-06-30", state="done", cost=300, currency="CHF"),
        "not compared": demanded(COPIED, measure="inject", state="verified"),
        "crack": demanded(drawn["longer crack"], measure="close the crack", urgency="immediate"),
        "drain": demanded((12310.0, 12320.0), measure="clean the drain", urgency="urgent", cost=500, currency="EUR"),
    }
    conn.execute("UPDATE tunnel_api.action SET state = 'ordered', responsible = 'Drains Ltd' WHERE id = %s", (made["drain"],))
    return made


def _add_later_inspection(conn: psycopg.Connection, survey: str) -> None:
    """The later survey saw the same lining and detected the same leaks, some of them larger; no one has drawn in it yet."""
    (later,) = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", (LATER,)).fetchone()  # type: ignore[misc]
    copy_rows(conn, survey, later, ("axis_vertex", "segment", "section", "coverage"))
    conn.execute(
        "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons,"
        " confidence, contrast, area, darkening_mean, darkening_max, image_share, unrolled, map, surface)"
        " SELECT %s, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, reasons, confidence, contrast,"
        " CASE WHEN chainage_from > %s THEN %s ELSE 1 END * area, darkening_mean, darkening_max, image_share, unrolled, map,"
        " surface FROM tunnel.finding"
        " WHERE survey_id = (SELECT id FROM tunnel.survey WHERE name = %s)"
        " AND kind = 'leak' AND origin = 'detected' AND detected AND review <> 'rejected'",
        (later, WETTER_FROM, WETTER, survey),
    )
