"""Elements and ratings: parts of findings, shares, limits and what decides, against geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
import psycopg
import pytest
import shapely
from psycopg.rows import dict_row
from support.example_rating import BLOCKS
from support.example_survey import NAME, add_later_survey


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


def scheme(conn: psycopg.Connection, rules: str, totals: str = "NULL, NULL") -> None:
    """Add scheme "own" with results A to D and rules: VALUES of (number, text, kinds, measure, inclusive, limits, …)."""
    conn.execute(
        "INSERT INTO tunnel.rating_scheme (name, version, source, results, totals, total_results)"
        f" VALUES ('own', '1', 'of the tests', '{{A,B,C,D}}', {totals})"  # type: ignore[arg-type]
    )
    conn.execute(
        "INSERT INTO tunnel.rating_rule (scheme_id, number, text, kinds, measure, inclusive, limits, results, points,"
        " by_measure, by_kinds, by_inclusive, by_limits)"
        f" SELECT s.id, r.* FROM tunnel.rating_scheme s, (VALUES {rules}) AS r WHERE s.name = 'own'"  # type: ignore[arg-type]
    )


def own(conn: psycopg.Connection) -> list[dict[str, Any]]:
    return ask(conn, "SELECT * FROM tunnel_api.rating(%s, 'blocks', 'own')", [NAME])


@pytest.fixture
def facts(conn: psycopg.Connection, example: str) -> list[dict[str, Any]]:
    """Findings of each block."""
    return ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'blocks')", [NAME])


def test_a_matrix_has_the_result_of_its_cell(conn: psycopg.Connection, facts: list[dict[str, Any]]) -> None:
    """Rows: largest leak below 0.5 m², below 1, larger; columns: fewer than two leaks, or more."""
    cells = [["A", "B"], ["B", "C"], ["C", "D"]]
    flat = ",".join(cell for row in cells for cell in row)
    scheme(
        conn,
        f"(1, 'size and number', '{{leak}}'::text[], 'largest_area', true, '{{0.5,1}}'::float8[], '{{{flat}}}'::text[],"
        " NULL::float8[], 'count', '{leak}'::text[], true, '{2}'::float8[])",
    )
    seen = set()
    for row, fact in zip(own(conn), facts, strict=True):
        largest, leaks = fact["largest_leak"] or 0.0, fact["leaks"]
        expected = cells[(largest >= 0.5) + (largest >= 1)][leaks >= 2]
        seen.add(expected)
        assert row["result"] == expected
        if leaks:
            assert row["rule"] == 1
            assert row["why"] == f"size and number: {round(largest, 4):g} and {leaks}"
            assert row["value"] == pytest.approx(largest)
    assert len(seen) > 1


def test_points_of_rules_are_summed(conn: psycopg.Connection, facts: list[dict[str, Any]]) -> None:
    """1 point for a leak, 3 for two, 4 for a wet area over 0.6 m²; from 3 points B, from 7 C."""
    nothing = "NULL::text, NULL::text[], NULL::boolean, NULL::float8[]"
    scheme(
        conn,
        f"(1, 'leaks', '{{leak}}'::text[], 'count', true, '{{1,2}}'::float8[], '{{}}'::text[], '{{1,3}}'::float8[], {nothing}),"
        f" (2, 'wet area', '{{}}', 'area', false, '{{0.6}}', '{{}}', '{{4}}', {nothing})",
        "'{3,7}', '{B,C}'",
    )
    sums = set()
    for row, fact in zip(own(conn), facts, strict=True):
        points = (1 if fact["leaks"] == 1 else 3 if fact["leaks"] else 0) + 4 * (fact["wet_area"] > 0.6)
        sums.add(points)
        assert row["result"] == ("C" if points >= 7 else "B" if points >= 3 else "A")
        if points >= 3:
            assert (row["value"], row["measure"]) == (points, "sum")
            assert row["why"].startswith(f"{points} points: ")
            assert row["rule"] == (2 if fact["wet_area"] > 0.6 else 1)
    assert len(sums) > 1


def test_density_is_length_over_inspected_lining(conn: psycopg.Connection, example: str) -> None:
    """A crack of 6 m along the tunnel lies in two blocks, with 4 m and 2 m."""
    conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, width_mm, geom)"
        " VALUES (%s, 'crack', 0.4, 'LINESTRING(12346 1, 12352 1)')",
        [NAME],
    )
    facts = ask(conn, "SELECT * FROM tunnel_api.element_findings(%s, 'blocks')", [NAME])
    assert [row["crack_length"] for row in facts[:2]] == pytest.approx([4, 2], rel=0.02)
    nothing = "NULL::float8[], NULL::text, NULL::text[], NULL::boolean, NULL::float8[]"
    scheme(
        conn,
        f"(1, 'cracks', '{{crack}}'::text[], 'density_length', false, '{{0}}'::float8[], '{{D}}'::text[], {nothing})",
    )
    for row, fact, length in zip(own(conn)[:2], facts, (4, 2), strict=False):
        assert row["value"] == pytest.approx(length / (fact["lining_area"] * fact["inspected_share"]), rel=0.02)
        assert row["result"] == "D"


GROWTH = (
    "(1, 'growth', '{}'::text[], 'growth', true, '{0.01}'::float8[], '{D}'::text[],"
    " NULL::float8[], NULL::text, NULL::text[], NULL::boolean, NULL::float8[])"
)


def test_growth_is_since_the_earlier_inspection(conn: psycopg.Connection, facts: list[dict[str, Any]]) -> None:
    """Two years before, the same lining was inspected and was dry: the growth is half of the wet area, m² a year."""
    scheme(conn, GROWTH)
    add_later_survey(conn, "demo-2022")
    conn.execute("UPDATE tunnel.survey SET date = '2022-05-04' WHERE name = 'demo-2022'")
    for row, fact in zip(own(conn), facts, strict=True):
        grown = fact["wet_area"] * 365.25 / 731
        if row["inspected_share"] >= 0.95:
            assert row["result"] == ("D" if grown >= 0.01 else "A")
            assert row["complete"]
            assert row["remark"] is None
        if row["result"] == "D":
            assert row["value"] == pytest.approx(grown)


def test_growth_is_unknown_without_an_earlier_inspection(conn: psycopg.Connection, facts: list[dict[str, Any]]) -> None:
    """No element is then called complete; one that the earlier inspection did not see is not, either."""
    scheme(conn, GROWTH)
    for row in own(conn):
        assert (row["result"], row["complete"]) == ("A", False)
        assert row["remark"].endswith("growth unknown: no earlier inspection")
    add_later_survey(conn, "demo-2022")
    conn.execute("UPDATE tunnel.survey SET date = '2022-05-04' WHERE name = 'demo-2022'")
    conn.execute(
        "UPDATE tunnel.coverage c SET seen = (SELECT array_agg(CASE WHEN c.step * u.n > 360 THEN u.v ELSE 0 END ORDER BY u.n)"
        " FROM unnest(c.seen) WITH ORDINALITY AS u (v, n)) WHERE c.survey_id = tunnel_api.survey_id('demo-2022')"
    )
    rows = own(conn)
    assert [row["complete"] for row in rows] == [False, False, True, True]
    assert rows[0]["rule"] is None, "growth against lining that was not inspected then is no growth"
    assert "% inspected then" in rows[1]["remark"]


def test_the_earlier_inspection_has_its_own_rating(conn: psycopg.Connection, facts: list[dict[str, Any]]) -> None:
    """A dry tunnel two years before: each block is worse by the levels that it has now."""
    assert {row["earlier_survey"] for row in change(conn)} == {None}
    add_later_survey(conn, "demo-2022")
    conn.execute("UPDATE tunnel.survey SET date = '2022-05-04' WHERE name = 'demo-2022'")
    for row, now in zip(change(conn), rating(conn), strict=True):
        assert (row["earlier_survey"], row["earlier_result"]) == ("demo-2022", "A")
        assert (row["result"], row["why"]) == (now["result"], now["why"])
        assert row["change"] == now["level"] - 1
        assert row["known"] is now["complete"]


def change(conn: psycopg.Connection) -> list[dict[str, Any]]:
    return ask(conn, "SELECT * FROM tunnel_api.rating_change(%s, 'blocks', 'example')", [NAME])


def test_two_schemes_are_compared_by_place_in_their_scale(conn: psycopg.Connection, facts: list[dict[str, Any]]) -> None:
    """Scheme own says D to each leak; the example has A to D by share and severity."""
    nothing = "NULL::float8[], NULL::text, NULL::text[], NULL::boolean, NULL::float8[]"
    scheme(conn, f"(1, 'any leak', '{{leak}}'::text[], 'count', true, '{{1}}'::float8[], '{{D}}'::text[], {nothing})")
    rows = ask(conn, "SELECT * FROM tunnel_api.rating_comparison(%s, 'blocks', 'example', 'own')", [NAME])
    for row, first, fact in zip(rows, rating(conn), facts, strict=True):
        assert row["result"] == first["result"]
        assert row["other_result"] == ("D" if fact["leaks"] else "A")
        expected = ("ABCD".index(row["other_result"]) - "ABCD".index(row["result"])) / 3
        assert row["difference"] == pytest.approx(expected)


LAYER = "survey = %s AND element_set = %s AND scheme = 'example' AND version = '1'"


@pytest.mark.parametrize("view", ["rating_unrolled", "rating_map"])
@pytest.mark.parametrize("element_set", ["blocks", "zones"])
def test_the_layers_state_the_rating(conn: psycopg.Connection, example: str, view: str, element_set: str) -> None:
    """Rows as of the function; the outlines of all elements cover the lining once, on the map strip too."""
    rows = ask(conn, f"SELECT * FROM tunnel_api.{view} WHERE {LAYER} ORDER BY number", [NAME, element_set])
    known = ask(conn, "SELECT * FROM tunnel_api.rating(%s, %s, 'example', '1') ORDER BY number", [NAME, element_set])
    shared = set(known[0]) & set(rows[0])
    assert len(shared) > 12
    assert [{name: row[name] for name in shared} for row in rows] == [{name: row[name] for name in shared} for row in known]
    for row in rows:
        words = "not rated" if row["result"] is None else row["result"] if row["complete"] else f"at least {row['result']}"
        assert (row["result_text"], row["levels"]) == (words, 4)
    (row,) = ask(
        conn,
        "SELECT sum(public.ST_Area(geom)) AS area, public.ST_Area(public.ST_Union(geom)) AS joined,"
        f" bool_and(public.ST_IsValid(geom)) AS valid FROM tunnel_api.{view} WHERE {LAYER}",
        [NAME, element_set],
    )
    (girth,) = conn.execute(
        "SELECT avg(arc_to - arc_from) FROM tunnel_api.section_unrolled WHERE survey = %s", [NAME]
    ).fetchone()  # type: ignore[misc]
    assert row["valid"]
    assert row["area"] == pytest.approx(row["joined"], rel=1e-3)
    assert row["area"] == pytest.approx(200 * girth, rel=0.01)


def test_a_layer_computes_one_rating(conn: psycopg.Connection, example: str) -> None:
    plan = conn.execute(f"EXPLAIN (ANALYZE, TIMING off) SELECT * FROM tunnel_api.rating_map WHERE {LAYER}", [NAME, "blocks"])
    calls = [line for (line,) in plan if "Function Scan on rating " in line]
    assert len(calls) == 1
    assert "loops=1)" in calls[0]
