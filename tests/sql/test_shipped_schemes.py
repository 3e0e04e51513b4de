"""Schemes that are part of the program: their files, and the results that their sources state at each limit."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import psycopg
import pytest
from support.example_survey import NAME

from tunneldb.errors import InputError
from tunneldb.pipeline.rating_file import RULE_KEYS, SHIPPED, list_shipped, read_scheme, shipped_scheme
from tunneldb.store.rating import save_scheme

FILES = sorted(SHIPPED.glob("*.toml"))
MATRIX = pytest.mark.skipif("by" not in RULE_KEYS, reason="needs rules of two measures")


def marked(path: Path) -> Any:
    return pytest.param(path, id=path.stem, marks=[MATRIX] if "\nby = " in path.read_text("utf-8") else [])


@pytest.mark.parametrize("path", [marked(path) for path in FILES])
def test_each_is_a_scheme_with_the_name_of_its_file(path: Path) -> None:
    assert read_scheme(path).name == path.stem


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_each_states_its_source_and_what_it_lacks(path: Path) -> None:
    text = path.read_text("utf-8")
    assert "http" in tomllib.loads(text)["source"]
    assert "# Not covered:" in text
    assert "# Difference" in text
    assert f"tunneldb rating add --shipped {path.stem}\n" in text


def test_they_are_listed_by_name() -> None:
    assert [scheme["name"] for scheme in list_shipped()] == [path.stem for path in FILES]


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"no scheme 'sia-272' .*ztv-ing-waterproofing\. Did you mean 'sia-272-2024'\?"):
        shipped_scheme("sia-272")


@pytest.fixture
def place(conn: psycopg.Connection, example: str) -> int:
    """Element of 4 m, 12+316 to 12+320, with one finding that is all in it. Return the key of the finding."""
    conn.execute("UPDATE tunnel.finding SET review = 'rejected'")
    conn.execute(
        "WITH d AS (INSERT INTO tunnel.element_set (tunnel_id, name, source) SELECT tunnel_id, 'place', 'length'"
        " FROM tunnel.survey WHERE name = %s RETURNING id)"
        " INSERT INTO tunnel.element (element_set_id, number, name, chainage_from, chainage_to)"
        " SELECT d.id, 1, 'place', 12316, 12320 FROM d",
        [NAME],
    )
    (key,) = conn.execute(
        "SELECT id FROM tunnel_api.finding WHERE survey = %s AND kind = 'leak' AND chainage_from > 12316"
        " AND chainage_to < 12320",
        [NAME],
    ).fetchone()  # type: ignore[misc]
    return int(key)


def rated(conn: psycopg.Connection, scheme: str, key: int, facts: dict[str, Any] | None) -> str:
    """Return the result of the element by a scheme, if its finding has these values; without any, there is no finding."""
    save_scheme(conn, read_scheme(shipped_scheme(scheme)))
    if facts is not None:
        values = {"kind": "leak", "area": 0.01, "width_mm": None, "length": None} | facts
        conn.execute(
            "UPDATE tunnel.finding SET review = 'open', kind = %(kind)s, area = %(area)s, width_mm = %(width_mm)s,"
            " length = %(length)s WHERE id = %(key)s",
            values | {"key": key},
        )
    row = conn.execute("SELECT result FROM tunnel_api.rating(%s, 'place', %s)", [NAME, scheme]).fetchone()
    assert row is not None
    return str(row[0])


GB = [
    (None, "1"),  # no wet patch
    ({"area": 0.001}, "2"),
    ({"kind": "drip"}, "3"),  # no leakage in class 2
    ({"area": 0.3}, "3"),
    ({"area": 0.301}, "4"),  # patch of more than 0.3 m²
    ({"kind": "crack", "width_mm": 9}, "1"),
]
SIA = [
    (None, "1"),  # no damp patch
    ({}, "2"),  # single damp patches
    ({"area": 2.0}, "2"),
    ({"kind": "drip"}, "3 or 4"),  # no dripping water in class 2
    ({"kind": "dark"}, "1"),
]
ZTV = [
    (None, "1"),  # no damp patch
    ({}, "2 or 3"),  # dampness in isolated locations
    ({"kind": "drip"}, "none"),  # no water drips in class 3
]
MBEI = [
    (None, "CS1"),
    ({"kind": "crack", "width_mm": 0.3}, "CS1"),  # less than 0.012 in.
    ({"kind": "crack", "width_mm": 0.3048}, "CS2"),  # 0.012 to 0.05 in.
    ({"kind": "crack", "width_mm": 1.27}, "CS2"),
    ({"kind": "crack", "width_mm": 1.28}, "CS3"),  # greater than 0.05 in.
    ({"kind": "spall", "area": 0.0182}, "CS2"),  # 6 in. or less in diameter
    ({"kind": "spall", "area": 0.0183}, "CS3"),  # greater than 6 in. in diameter
    ({"kind": "delamination"}, "CS2"),
    ({"kind": "efflorescence"}, "CS2"),
    ({"kind": "leak"}, "CS1"),
]
CRACKS = [
    (None, "no crack"),
    ({"width_mm": 3, "length": 12}, "1/2"),
    ({"width_mm": 3.1, "length": 5}, "2"),
    ({"width_mm": 3.1, "length": 5.1}, "2/3"),
    ({"width_mm": 5, "length": 10}, "2/3"),
    ({"width_mm": 5, "length": 10.1}, "3"),
    ({"width_mm": 5.1, "length": 5}, "2/3"),
    ({"width_mm": 5.1, "length": 10}, "2/3"),
    ({"width_mm": 5.1, "length": 10.1}, "3/4"),
]


@pytest.mark.parametrize(
    ("scheme", "facts", "result"),
    [("gb-50108-2008", *case) for case in GB]
    + [("sia-272-2024", *case) for case in SIA]
    + [("ztv-ing-waterproofing", *case) for case in ZTV]
    + [("mbei-2019-concrete", *case) for case in MBEI],
)
def test_a_finding_has_the_result_that_the_source_states(
    conn: psycopg.Connection, place: int, scheme: str, facts: dict[str, Any] | None, result: str
) -> None:
    assert rated(conn, scheme, place, facts) == result


@MATRIX
@pytest.mark.parametrize(("facts", "result"), CRACKS)
def test_a_crack_has_the_result_of_its_cell(
    conn: psycopg.Connection, place: int, facts: dict[str, Any] | None, result: str
) -> None:
    given = None if facts is None else {"kind": "crack", **facts}
    assert rated(conn, "highway-cracks-2019", place, given) == result


@pytest.mark.parametrize(("factor", "result"), [(0.999, "2"), (1.001, "3")])
def test_the_wet_share_of_class_2_is_at_most_2_in_1000(
    conn: psycopg.Connection, place: int, factor: float, result: str
) -> None:
    """The element is so small that its share decides before the size of a patch."""
    row = conn.execute("SELECT lining_area * inspected_share FROM tunnel_api.element_findings(%s, 'place')", [NAME]).fetchone()
    assert row is not None
    area = 0.002 * factor * row[0]
    assert area < 0.2
    assert rated(conn, "gb-50108-2008", place, {"area": area}) == result


def test_a_patch_of_class_2_has_at_most_a_fifth_of_a_square_metre(conn: psycopg.Connection, place: int) -> None:
    """In an element of 50 m, where the share does not decide."""
    conn.execute(
        "UPDATE tunnel.element SET chainage_from = 12310, chainage_to = 12360 WHERE name = 'place'",
    )
    assert rated(conn, "gb-50108-2008", place, {"area": 0.2}) == "2"
    conn.execute("UPDATE tunnel.finding SET area = 0.201 WHERE id = %s", [place])
    row = conn.execute("SELECT result FROM tunnel_api.rating(%s, 'place', 'gb-50108-2008')", [NAME]).fetchone()
    assert row == ("3",)


def test_limits_of_gb_50108_are_those_of_the_classes_of_waterproofing(conn: psycopg.Connection, example: str) -> None:
    """The scheme and waterproof_class have the same limits of share and patch."""
    scheme = read_scheme(shipped_scheme("gb-50108-2008"))
    known = conn.execute("SELECT wet_ratio, patch_area FROM tunnel_api.waterproof_limit ORDER BY id").fetchall()
    limits = {rule.measure: rule.limits for rule in scheme.rules}
    assert limits["share"] == (known[1][0],)
    assert limits["largest_area"] == (known[1][1], known[2][1])
