"""Scoring of scenes that detection has never seen: intervals of shares, looks of a review, classes of waterproofing."""

from __future__ import annotations

import numpy as np
import psycopg
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from psycopg import sql
from scipy.stats import binomtest
from shapely.geometry import MultiPolygon, Polygon, box
from support.benchmark_files import load_benchmark

from tunneldb.anomalies.coverage import Coverage

statistics, waterproof = load_benchmark("blind/statistics.py"), load_benchmark("blind/waterproof.py")


@given(count=st.integers(1, 400), part=st.floats(0, 1))
def test_intervals_are_those_of_wilson(count: int, part: float) -> None:
    hits = round(part * count)
    low, high = statistics.wilson(np.array([hits]), np.array([count]))
    theirs = binomtest(hits, count).proportion_ci(0.95, method="wilson")
    assert (low[0], high[0]) == pytest.approx((theirs.low, theirs.high), abs=1e-12)
    assert low[0] <= hits / count <= high[0]


def test_nothing_counted_says_nothing() -> None:
    low, high = statistics.wilson(np.zeros(1), np.zeros(1))
    assert (low[0], high[0]) == (0.0, 1.0)


def test_a_review_sees_leaks_in_order_of_probability() -> None:
    """Five looks at four leaks: the first shows two, the second one of them again, the third none; the last leak none shows."""
    probabilities = np.array([0.3, 0.9, 0.5, 0.7, 0.2])
    first = statistics.ranks(probabilities, [[2], [0, 1], [], [1], []], 4)
    assert first.tolist() == [1, 1, 4, np.inf]
    assert statistics.review_curve(first, (0.25, 0.5, 0.75, 1.0, 3.0)) == [0.5, 0.5, 0.5, 0.75, 0.75]
    assert statistics.looks_for_each(first, 0.9) == pytest.approx(4 / 3)
    assert statistics.looks_for_each(first, 0.5) == pytest.approx(1 / 2)


def test_a_perfect_review_takes_a_look_a_leak_and_an_order_by_chance_as_many_as_there_are_things() -> None:
    ordered = statistics.ranks(np.linspace(1, 0, 200), [[k] if k < 100 else [] for k in range(200)], 100)
    assert statistics.review_curve(ordered, (0.5, 1.0)) == [0.5, 1.0]
    assert statistics.looks_for_each(ordered, 0.9) == 1.0
    every_other = statistics.ranks(np.linspace(1, 0, 200), [[k // 2] if k % 2 else [] for k in range(200)], 100)
    assert statistics.review_curve(every_other, (1.0, 2.0)) == [0.5, 1.0]
    assert statistics.looks_for_each(every_other, 0.9) == 2.0


def test_without_leaks_a_review_has_no_figures() -> None:
    none = statistics.ranks(np.array([0.5]), [[]], 0)
    assert np.isnan(statistics.review_curve(none, (1.0,))[0])
    assert np.isnan(statistics.looks_for_each(none, 0.9))


def test_classes_are_counted_as_right_near_too_good_or_too_bad() -> None:
    a = statistics.compare_classes([1, 1, 2, 3, 4, 4, None, 2], [1, 2, 2, 4, 3, 1, 3, None])
    assert a.table.tolist() == [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1], [1, 0, 1, 0]]
    assert (a.unknown, a.right, a.near, a.lenient, a.strict) == (2, 2, 3, 2, 2)


def lining(length: float, width: float = 20.0, seen: float = 1.0, start: float = 100.0) -> dict[int, Coverage]:
    """A stretch of lining in kilometre 2."""
    step = 0.1
    at = (np.arange(10_000) + 0.5) * step
    area = np.where((at > start) & (at < start + length), step * width, 0.0).astype(np.float32)
    return {2: Coverage(step, area, (seen * area).astype(np.float32), np.zeros_like(area))}


def square(chainage: float, area: float, arc: float = 0.0) -> Polygon:
    side = np.sqrt(area) / 2
    return box(2000 + chainage - side, arc - side, 2000 + chainage + side, arc + side)


def test_classes_of_leaks_are_those_of_the_standard(conn: psycopg.Connection) -> None:
    """GB 50108-2008, table 3.2.1, on 2000 m²: of up to 4 m², 0.2 m² a patch the second, 0.3 m² a patch the third class."""

    def whole(*leaks: shapely.Geometry, seen: float = 1.0) -> int:
        return waterproof.classes(conn, lining(100, seen=seen), leaks)[0]

    assert whole() == 1
    assert whole(square(120, 0.19)) == 2
    assert whole(square(120, 0.21)) == 3
    assert whole(square(120, 0.31)) == 4
    # 12 of 0.19 m², far apart, are 1.14 ‰ of the lining, and 2.28 ‰ of what was seen if that is half of it
    many = [square(104 + 8 * k, 0.19) for k in range(12)]
    assert whole(*many) == 2
    assert whole(*many, seen=0.5) == 3
    # 100 m² are 5 m: eight leaks are more than seven
    assert whole(*(square(120 + 0.5 * k, 0.05) for k in range(7))) == 3
    assert whole(*(square(120 + 0.5 * k, 0.05) for k in range(8))) == 4


def test_parts_of_a_leak_are_one_patch_and_pieces_that_were_found_are_several(conn: psycopg.Connection) -> None:
    parts = [square(120, 0.19, arc) for arc in (-1.0, 1.0)]
    assert waterproof.classes(conn, lining(100), parts)[0] == 2
    assert waterproof.classes(conn, lining(100), [MultiPolygon(parts)])[0] == 4


def test_stretches_are_classed_by_what_lies_in_them_and_nothing_stays_in_the_database(conn: psycopg.Connection) -> None:
    found = waterproof.classes(conn, lining(10), [square(103, 0.5), square(107, 0.19)])
    assert found == [4, 1, 4, 1, 3, 1]
    for table in ("tunnel", "survey", "segment", "coverage", "finding"):
        assert conn.execute(sql.SQL("SELECT count(*) FROM tunnel.{}").format(sql.Identifier(table))).fetchone() == (0,)


def test_without_lining_there_is_no_class_and_without_any_that_was_seen_it_is_not_known(conn: psycopg.Connection) -> None:
    assert waterproof.classes(conn, {}, [square(103, 0.5)]) == []
    assert waterproof.classes(conn, lining(4, seen=0.0), []) == [None, None, None]
