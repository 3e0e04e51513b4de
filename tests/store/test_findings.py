"""What people draw stays over reruns of detection, counts once, and adds up the same wherever it is stated."""

from __future__ import annotations

import numpy as np
import psycopg
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon, box
from support.example_survey import KM, NAME, example_surface

from tunneldb.anomalies.features import NAMES
from tunneldb.anomalies.reconcile import Summary
from tunneldb.anomalies.records import Anomaly
from tunneldb.anomalies.verdict import Verdict
from tunneldb.export.tables.finding_counts import STATES, count_findings
from tunneldb.geometry.surface import Surface
from tunneldb.pipeline.replace_findings import replace_findings
from tunneldb.store.findings import Chosen, read_findings
from tunneldb.store.learned import load_measured
from tunneldb.store.survey import get_survey

SUMS = (
    "SELECT patches, wet_area FROM tunnel_api.leak_statistics('demo-2024', '-Infinity', 'Infinity')",
    "SELECT count(*)::int, coalesce(sum(area), 0) FROM tunnel_api.leak WHERE counted",
    "SELECT count(*)::int, coalesce(sum(area), 0) FROM tunnel_api.finding WHERE counted AND wet",
    "SELECT sum(counted)::int, sum(area) FROM tunnel_api.finding_count WHERE wet",
    "SELECT sum(leaks)::int, sum(wet_area) FROM tunnel_api.km_statistics",
    "SELECT sum(patches)::int, tunnel_api.wet_area('demo-2024', -1e9, 1e9) FROM tunnel_api.km_waterproof",
    "SELECT sum(leaks)::int - (SELECT count(*) FROM tunnel_api.leak WHERE counted AND floor(chainage_from / 50) "
    "< floor(chainage_to / 50))::int, sum(wet_area) FROM tunnel_api.sheet",
)
"""How many leaks count and their area, wherever it is stated: the first is of the statistics, the last of the sheets."""

STATED = b"""
    SELECT kind, sum(area), sum(counted)::int, sum(rejected)::int, sum(gone)::int, sum(dry)::int, sum(same)::int,
           sum(merged)::int
      FROM tunnel_api.finding_count GROUP BY kind ORDER BY kind
"""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture(scope="module")
def surface() -> Surface:
    return example_surface()[0]


def found(outline: Polygon, kind: str = "leak") -> Anomaly:
    verdict = Verdict(kind, (), 0.9, {}, np.zeros(len(NAMES)), 1.0, "test")  # type: ignore[arg-type]
    return Anomaly(outline, 3.0, 4.0, 3.5, 1.0, verdict)


def outlines(conn: psycopg.Connection) -> list[Polygon]:
    rows = conn.execute("SELECT ST_AsBinary(unrolled) FROM tunnel.finding WHERE kind = 'leak' ORDER BY id").fetchall()
    return [shapely.from_wkb(bytes(wkb)) for (wkb,) in rows]


def rerun(conn: psycopg.Connection, surface: Surface, leaks: list[Polygon]) -> Summary:
    """Detection finds these leaks."""
    summary, _ = replace_findings(conn, get_survey(conn, NAME), KM, surface, [found(leak) for leak in leaks], [], 0.04)
    return summary


def wet(conn: psycopg.Connection) -> tuple[int, float]:
    first, *others = [conn.execute(query.encode()).fetchone() for query in SUMS]
    for query, other in zip(SUMS[1:], others, strict=True):
        assert other == (first[0], pytest.approx(first[1], rel=1e-6)), query
    assert documents(conn) == conn.execute(STATED).fetchall()
    return first


def documents(conn: psycopg.Connection) -> list[tuple[object, ...]]:
    """Return what report, workbook and ``findings --json`` state of each kind, as all three do by one function."""
    counts = count_findings(read_findings(conn, get_survey(conn, NAME), chosen=Chosen(states=())))
    return [(one.kind, pytest.approx(one.area, rel=1e-6), one.counted, *(one.states[s] for s in STATES[2:])) for one in counts]


def draw(conn: psycopg.Connection, shape: Polygon) -> int:
    return conn.execute(
        "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom) VALUES (%s, 'leak', ST_GeomFromWKB(%s, 0)) RETURNING id",
        [NAME, shapely.to_wkb(shape)],
    ).fetchone()[0]


def state(conn: psycopg.Connection, key: int) -> str | None:
    row = conn.execute("SELECT state FROM tunnel_api.finding WHERE id = %s", [key]).fetchone()
    return None if row is None else row[0]


def test_a_rerun_leaves_what_was_redrawn_and_links_what_it_finds(conn: psycopg.Connection, surface: Surface) -> None:
    leaks = outlines(conn)
    rerun(conn, surface, leaks)
    (key,) = conn.execute("SELECT min(id) FROM tunnel_api.leak WHERE review = 'confirmed'").fetchone()
    conn.execute("UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.1) WHERE id = %s", [key])
    before = conn.execute("SELECT unrolled, area, origin, review FROM tunnel.finding WHERE id = %s", [key]).fetchone()
    counted = wet(conn)
    for _ in range(2):
        rerun(conn, surface, leaks)
        assert (
            conn.execute("SELECT unrolled, area, origin, review FROM tunnel.finding WHERE id = %s", [key]).fetchone() == before
        )
        assert wet(conn) == (counted[0], pytest.approx(counted[1], rel=1e-12))  # summed in another order
        also, ids = conn.execute(
            "SELECT also_detected, cardinality(detected_as) FROM tunnel_api.finding WHERE id = %s", [key]
        ).fetchone()
        assert (also, ids) == (True, 1)
    rerun(conn, surface, [])
    assert state(conn, key) == "confirmed"
    assert conn.execute("SELECT also_detected FROM tunnel_api.finding WHERE id = %s", [key]).fetchone() == (False,)


def test_learning_takes_what_is_found_of_the_redrawn_as_that_is_reviewed(conn: psycopg.Connection, surface: Surface) -> None:
    leaks = [box(12350.0, 0.0, 12351.0, 1.0), box(12353.0, 0.0, 12354.0, 1.0)]
    rerun(conn, surface, leaks)
    ids = [row[0] for row in conn.execute("SELECT id FROM tunnel_api.leak WHERE counted ORDER BY id DESC LIMIT 2")][::-1]
    for key, review in zip(ids, ("confirmed", "rejected"), strict=True):
        conn.execute(
            "UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.05), review = %s WHERE id = %s", [review, key]
        )
    rerun(conn, surface, leaks)
    measured = load_measured(conn, [1])
    assert measured.said[measured.known & (measured.detected)].tolist()[:2] == ["confirmed leak", "rejected"]


def test_what_was_rejected_or_merged_is_not_resurrected(conn: psycopg.Connection, surface: Surface) -> None:
    leaks = [box(12350.0 + 2 * k, 0.0, 12351.5 + 2 * k, 1.0) for k in range(4)]
    rerun(conn, surface, leaks)
    ids = [r[0] for r in conn.execute("SELECT id FROM tunnel_api.leak WHERE detected ORDER BY chainage_from")]
    kept = [r for r in ids if state(conn, r) == "open"][-4:]
    conn.execute("SELECT tunnel_api.finding_merge(%s)", [kept[:2]])
    conn.execute("UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.05) WHERE id = %s", [kept[2]])
    conn.execute("UPDATE tunnel_api.finding_unrolled SET review = 'rejected' WHERE id = %s", [kept[2]])
    counted = wet(conn)
    for _ in range(2):
        rerun(conn, surface, leaks)
        assert [state(conn, key) for key in kept] == ["open", "merged", "rejected", "open"]
        assert wet(conn) == counted


def test_leaks_in_a_dry_region_survive_a_detection_that_does_not_find_them(conn: psycopg.Connection, surface: Surface) -> None:
    leaks = [box(12350.0, 0.0, 12351.0, 1.0), box(12353.0, 0.0, 12354.0, 1.0)]
    rerun(conn, surface, leaks)
    counted = wet(conn)
    (region,) = conn.execute(
        "INSERT INTO tunnel_api.region (survey, kind, geom) VALUES (%s, 'dry', ST_MakeEnvelope(12349.5, -1, 12351.5, 2)) "
        "RETURNING id",
        [NAME],
    ).fetchone()
    rerun(conn, surface, leaks[1:])
    assert wet(conn) == (counted[0] - 1, pytest.approx(counted[1] - conn.execute(
        "SELECT leaks_area FROM tunnel_api.dry_region WHERE id = %s", [region]).fetchone()[0]))  # fmt: skip
    conn.execute("DELETE FROM tunnel_api.region WHERE id = %s", [region])
    assert wet(conn) == (counted[0], pytest.approx(counted[1]))


def test_a_finding_over_the_end_of_a_kilometre_is_found_from_both_sides(conn: psycopg.Connection, surface: Surface) -> None:
    key = draw(conn, box(12399.0, 1.0, 12402.0, 2.0))
    for low, high, part in ((12390.0, 12400.0, 1 / 3), (12400.0, 12410.0, 2 / 3)):
        area, before = conn.execute(
            "SELECT tunnel_api.wet_area(%s, %s, %s), sum(tunnel_internal.area_between(unrolled, area, %s, %s)) "
            "FROM tunnel_api.leak WHERE counted AND id <> %s AND chainage_to > %s AND chainage_from < %s",
            [NAME, low, high, low, high, key, low, high],
        ).fetchone()
        (whole,) = conn.execute("SELECT area FROM tunnel_api.leak WHERE id = %s", [key]).fetchone()
        assert area - (before or 0) == pytest.approx(whole * part)


def test_after_the_axis_has_moved_what_was_drawn_lies_on_the_new_surface(conn: psycopg.Connection, surface: Surface) -> None:
    key = draw(conn, box(12350.0, 0.0, 12351.0, 1.0))
    conn.execute("UPDATE tunnel.finding SET surface = ST_Translate(surface, 0, 0, 5), area = 99 WHERE id = %s", [key])
    rerun(conn, surface, [])
    height, area = conn.execute(
        "SELECT ST_ZMin(surface) - ST_Z(tunnel_api.roll(survey_id, 12350, 0)), area FROM tunnel.finding WHERE id = %s", [key]
    ).fetchone()
    assert abs(height) < 0.3
    assert area < 2


STEPS = st.lists(
    st.tuples(st.sampled_from(["draw", "split", "merge", "delete", "reject", "redraw", "rerun"]), st.integers(0, 99)),
    max_size=8,
)


@given(steps=STEPS)
@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
def test_any_order_of_steps_leaves_counts_and_areas_that_agree(
    scratch: psycopg.Connection, surface: Surface, steps: list[tuple[str, int]]
) -> None:
    conn = scratch
    leaks = outlines(conn)
    try:
        rerun(conn, surface, leaks)
        known = wet(conn)
        mine: list[int] = []
        parts: list[tuple[int, int]] = []
        for step, number in steps:
            before = wet(conn)
            all_ids = [r[0] for r in conn.execute("SELECT id FROM tunnel_api.leak WHERE counted ORDER BY id")]
            if not all_ids:
                break
            key = all_ids[number % len(all_ids)]
            area = conn.execute("SELECT area FROM tunnel.finding WHERE id = %s", [key]).fetchone()[0]
            if step == "draw":
                mine.append(draw(conn, box(12350.0, -3 + number / 20, 12350.6, -3 + number / 20 + 0.04)))
                assert wet(conn)[0] == before[0] + 1
            elif step == "split":
                middle = (
                    "SELECT (chainage_from + chainage_to) / 2, arc_from - 0.1, arc_to + 0.1 FROM tunnel.finding WHERE id = %s"
                )
                x, low, high = conn.execute(middle, [key]).fetchone()
                line = shapely.to_wkb(shapely.LineString([(x, low), (x, high)]))
                ids = conn.execute("SELECT tunnel_api.finding_split(%s, ST_GeomFromWKB(%s, 0))", [key, line]).fetchone()[0]
                parts += [(ids[0], other) for other in ids[1:]]
                assert wet(conn) == (before[0] + len(ids) - 1, pytest.approx(before[1], rel=1e-3))
            elif step == "merge" and parts:
                pair = parts.pop(number % len(parts))
                if not all(state(conn, one) in ("open", "confirmed") for one in pair):
                    continue
                kept = conn.execute("SELECT tunnel_api.finding_merge(%s)", [list(pair)]).fetchone()[0]
                assert kept == pair[0]
                assert wet(conn)[0] == before[0] - 1
                assert wet(conn)[1] == pytest.approx(before[1], rel=1e-3, abs=0.02)
            elif step == "delete" and mine:
                gone = mine.pop(number % len(mine))
                held = (
                    "SELECT EXISTS (SELECT FROM tunnel.finding WHERE merged_into = %(id)s OR (id = %(id)s AND merged_into > 0))"
                )
                if conn.execute(held, {"id": gone}).fetchone()[0]:
                    continue
                conn.execute("DELETE FROM tunnel_api.finding_map WHERE id = %s", [gone])
                assert state(conn, gone) is None
            elif step == "reject":
                conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = %s", [key])
                assert wet(conn) == (before[0] - 1, pytest.approx(before[1] - area, abs=1e-6))
            elif step == "redraw":
                conn.execute("UPDATE tunnel_api.finding_unrolled SET geom = ST_Buffer(geom, 0.01) WHERE id = %s", [key])
                assert wet(conn)[0] == before[0]
            elif step == "rerun":
                rerun(conn, surface, leaks)
                assert wet(conn) == (before[0], pytest.approx(before[1]))
        by_state = conn.execute("SELECT count(*) FROM tunnel_api.finding").fetchone()
        columns = "counted + rejected + merged + same + dry + gone"
        assert conn.execute(f"SELECT sum({columns}) FROM tunnel_api.finding_count".encode()).fetchone() == by_state
        assert known[0] >= 0
    finally:
        conn.rollback()


@pytest.fixture
def scratch(conn: psycopg.Connection) -> psycopg.Connection:
    """A connection that each example rolls back."""
    return conn
