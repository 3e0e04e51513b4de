"""Elements and ratings: parts of findings, shares, limits and what decides, against geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
import pytest
import shapely
from psycopg.rows import dict_row
from support.example_rating import BLOCKS
from support.example_survey import NAME


def ask(conn: psycopg.Connection, query: str, values: Any = ()) -> list[dict[str, Any]]:
    return conn.cursor(row_factory=dict_row).execute(query, values).fetchall()


def counted(conn: psycopg.Connection) -> list[tuple[int, str, bool, float, shapely.Geometry]]:
    rows = conn.execute(
        "SELECT id, kind, wet, area, public.ST_AsBinary(unrolled) FROM tunnel_api.finding WHERE survey = %s AND counted", [NAME]
    ).fetchall()
    return [(*row[:4], shapely.from_wkb(row[4])) for row in rows]


def part(outline: shapely.Geometry, area: float, *boxes: shapely.Geometry) -> float:
    """Return the part of an area, m², whose outline lies in boxes."""
    return area * sum(shapely.area(shapely.intersection(outline, box)) for box in boxes) / shapely.area(outline)


@pytest.fixture
def moved(conn: psycopg.Connection, example: str) -> None:
    """Move the ends of the blocks by 18 m: some leaks are then cut."""
    conn.execute("UPDATE tunnel.element SET chainage_from = chainage_from + 17.8, chainage_to = chainage_to + 17.8")
    conn.commit()


def test_parts_of_findings_are_those_of_their_outlines(conn: psycopg.Connection, moved: None) -> None:
    """PostGIS and Shapely cut the same areas; a leak across a boundary is in both blocks."""
    rows = ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'blocks')", [NAME])
    assert [row["number"] for row in rows] == list(range(1, BLOCKS + 1))
    cut = 0
    for row in rows:
        low = 12267.8 + 50 * row["number"]
        box = shapely.box(low, -100, low + 50, 100)
        parts = [(one, part(one[4], one[3], box)) for one in counted(conn)]
        inside = [(one, size) for one, size in parts if size > 0]
        cut += sum(size < 0.999 * one[3] for one, size in inside)
        assert row["findings"] == len(inside)
        assert row["wet_area"] == pytest.approx(sum(size for one, size in inside if one[2]), rel=1e-6)
    assert cut >= 1


def test_zones_of_a_block_have_its_findings_by_clock(conn: psycopg.Connection, moved: None) -> None:
    """The section is a circle of 4 m with a floor: arcs of clock positions above it are those of the circle."""
    rows = ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'zones')", [NAME])
    edges = {"crown": (-60, 60), "right": (60, 150), "left": (-150, -60)}
    for row in rows:
        _, block, zone = row["name"].split()
        if zone == "invert":
            continue
        low = 12267.8 + 50 * int(block)
        arcs = np.radians(edges[zone]) * 4.0 if zone == "crown" else None
        if arcs is None:
            continue
        box = shapely.box(low, arcs[0], low + 50, arcs[1])
        wet = sum(part(one[4], one[3], box) for one in counted(conn) if one[2])
        assert row["wet_area"] == pytest.approx(wet, rel=1e-3, abs=1e-6)
    whole = ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'blocks')", [NAME])
    for block in whole:
        zones = [row for row in rows if row["name"].startswith(f"{block['name']} ")]
        assert sum(zone["wet_area"] for zone in zones) == pytest.approx(block["wet_area"], rel=1e-6, abs=1e-9)
        assert sum(zone["lining_area"] for zone in zones) == pytest.approx(block["lining_area"], rel=1e-6)


def test_extent_is_that_of_the_statistics(conn: psycopg.Connection, example: str) -> None:
    """Lining and inspected share of a block are those of leak_statistics for its stretch."""
    for row in ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'blocks')", [NAME]):
        low = 12250 + 50 * row["number"]
        (known,) = ask(conn, "SELECT * FROM tunnel_api.leak_statistics(%s, %s, %s)", [NAME, low, low + 50])
        assert row["lining_area"] == pytest.approx(known["lining_area"])
        assert row["inspected_share"] == pytest.approx(known["seen_share"])
        assert row["wet_area"] == pytest.approx(known["wet_area"])


def rating(conn: psycopg.Connection, element_set: str = "blocks") -> list[dict[str, Any]]:
    return ask(conn, "SELECT * FROM tunnel_api.rating(%s, %s, 'example')", [NAME, element_set])


def test_the_worst_rule_decides_and_says_why(conn: psycopg.Connection, example: str) -> None:
    """Shares by hand: wet area over inspected lining, against the limits 0.0005 and 0.002."""
    facts = {row["number"]: row for row in ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'blocks')", [NAME])}
    conn.execute("DELETE FROM tunnel.rating_rule WHERE number = 2")
    for row in rating(conn):
        share = facts[row["number"]]["wet_share"] or 0.0
        expected = "C" if share > 0.002 else "B" if share > 0.0005 else "A"
        assert row["result"] == expected
        assert row["level"] == "ABCD".index(expected) + 1
        if expected != "A":
            assert (row["rule"], row["measure"]) == (1, "share")
            assert row["value"] == pytest.approx(share)
            assert row["why"].startswith("share of wet lining: ")
            largest = max((one[3], -one[0]) for one in counted(conn) if one[2] and one[0] == row["finding_id"])
            assert largest[0] > 0


def test_limits_are_reached_as_the_rule_says(conn: psycopg.Connection, example: str) -> None:
    """A severity of 4 reaches 'from 4', and not 'above 4'."""
    (key,) = conn.execute(
        "SELECT id FROM tunnel_api.finding WHERE survey = %s AND kind = 'leak' AND counted AND chainage_from > 12310"
        " ORDER BY chainage_from LIMIT 1",
        [NAME],
    ).fetchone()  # type: ignore[misc]
    conn.execute("UPDATE tunnel.finding SET severity = 4 WHERE id = %s", [key])
    conn.execute("DELETE FROM tunnel.rating_rule WHERE number = 1")
    (first,) = [row for row in rating(conn) if row["finding_id"] == key]
    assert (first["result"], first["value"], first["limit_reached"]) == ("D", 4.0, 4.0)
    assert first["why"] == "severity: 4 ≥ 4"
    conn.execute("UPDATE tunnel.rating_rule SET inclusive = false WHERE number = 2")
    (first,) = [row for row in rating(conn) if row["finding_id"] == key]
    assert (first["result"], first["value"], first["limit_reached"]) == ("C", 4.0, 3.0)
    assert first["why"] == "severity: 4 > 3"


def test_what_was_not_inspected_has_no_good_result(conn: psycopg.Connection, example: str) -> None:
    """Without coverage no element is rated A; with a part of it the result is marked as incomplete."""
    conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
    before = rating(conn)
    assert {row["result"] for row in before} == {"A"}
    assert [row["complete"] for row in before] == [False, True, True, True], "the first 10 m were not inspected"
    conn.execute("DELETE FROM tunnel.coverage")
    for row in rating(conn):
        assert (row["result"], row["level"], row["complete"], row["inspected_share"]) == (None, None, False, 0)


def test_elements_beyond_the_survey_are_listed_without_result(conn: psycopg.Connection, example: str) -> None:
    conn.execute("UPDATE tunnel.element SET chainage_from = 99000, chainage_to = 99050 WHERE name = 'block 1'")
    (row,) = [row for row in rating(conn) if row["name"] == "block 1"]
    assert (row["result"], row["inspected_share"], row["findings"]) == (None, 0, 0)


def test_versions_stand_side_by_side(conn: psycopg.Connection, example: str) -> None:
    """Without a version the one added last is used; the older one still gives its own results."""
    conn.execute(
        "INSERT INTO tunnel.rating_scheme (name, version, source, results) VALUES ('example', '2', 'stricter', '{A,D}')"
    )
    conn.execute(
        "INSERT INTO tunnel.rating_rule SELECT id, 1, 'any leak', '{leak}', 'count', true, '{1}', '{D}'"
        " FROM tunnel.rating_scheme WHERE version = '2'"
    )
    new = {row["result"] for row in rating(conn)}
    old = {row["result"] for row in ask(conn, "SELECT * FROM tunnel_api.rating(%s, 'blocks', 'example', '1')", [NAME])}
    assert new == {"A", "D"}
    assert old <= {"A", "B", "C"}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("rating('demo-2024', 'nothing', 'example')", "has no elements named nothing"),
        ("rating('demo-2024', 'blocks', 'nothing')", "there is no rating scheme nothing"),
        ("rating('demo-2024', 'blocks', 'example', '7')", "there is no rating scheme example 7"),
    ],
)
def test_wrong_names_are_said(conn: psycopg.Connection, example: str, call: str, message: str) -> None:
    with pytest.raises(psycopg.Error, match=message):
        conn.execute(f"SELECT * FROM tunnel_api.{call}")


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_viewers_may_rate(person: psycopg.Connection, conn: psycopg.Connection, example: str) -> None:
    rows = person.execute("SELECT result FROM tunnel_api.rating(%s, 'zones', 'example')", [NAME]).fetchall()
    assert len(rows) == 4 * BLOCKS
